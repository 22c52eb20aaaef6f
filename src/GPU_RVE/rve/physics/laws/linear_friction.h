// Linear springs with friction: composes normal and tangential forces with the kinematics of a contact of two disks.

#ifndef RVE_PHYSICS_LAWS_LINEAR_FRICTION_H
#define RVE_PHYSICS_LAWS_LINEAR_FRICTION_H

#include "rve/physics/contact_geometry.h"
#include "rve/physics/laws/law.h"
#include "rve/physics/normal_force.h"
#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Parameters of the linear laws in internal units, side by side for those whose calls are prepared alike.
  template <class Numbers> struct alignas(16) LinearConstants {
    typename Numbers::Spring tangential_stiffness;
    typename Numbers::Real normal_stiffness, friction;
    typename Numbers::Real dt;    ///< zero evaluates without advancing the history [time]
    typename Numbers::Real normal_viscosity, tangential_viscosity, velocity_arm;

    /// `parameters` has k_n, k_t [force/length], mu, gamma_n and gamma_t [force time/length].
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      const double stiffness_unit = units.length * units.per_force;
      using Real = typename Numbers::Real;
      using Spring = typename Numbers::Spring;
      normal_stiffness = static_cast<Real>(parameters.normal_stiffness * stiffness_unit);
      normal_viscosity = static_cast<Real>(parameters.normal_viscosity * stiffness_unit);
      tangential_stiffness = static_cast<Spring>(parameters.tangential_stiffness * stiffness_unit);
      friction = static_cast<Real>(parameters.friction);
      tangential_viscosity = static_cast<Real>(parameters.tangential_viscosity * stiffness_unit);
      velocity_arm = static_cast<Real>(arm);
    }
  };

  /// Linear springs and Coulomb friction, for disks, in a number format.
  ///
  /// Arms: torque r - overlap/2, the distance to the contact point of equation (11), and the same for the surface velocity: the
  /// arms add up to |b|, so a rigid rotation of the pair gives no slip.
  /// Damped: with dashpots, and with a choice for the arm of the surface velocity, r - velocity_arm * overlap: 1/2, or 0 as
  /// LAMMPS has it (not objective, for cross-checks).
  /// Frictional: compiled in only for scenes that have friction. Without, the law is that with a coefficient of zero.
  template <class NumberFormat, bool Damped, bool Frictional = true> struct LinearFrictionLaw {
    using Numbers = NumberFormat;
    using Real = typename Numbers::Real;
    using History = typename Numbers::Spring;    ///< tangential force
    using Force = ContactForce<Real, History>;
    using Constants = LinearConstants<Numbers>;
    static constexpr bool has_friction = Frictional;
    static constexpr bool has_rolling = false;
    static constexpr bool is_damped = Damped;
    static constexpr bool has_constant_moduli = true;
    static constexpr bool bounds_tangential_forces = true;

    /// The same law in other numbers.
    template <class OtherNumbers> using In = LinearFrictionLaw<OtherNumbers, Damped, Frictional>;

    /// The history of a pair as its other grain sees it: the force turns round, and so does t.
    static RVE_INLINE History seen_from_partner(const History &history) { return history; }
    /// The tangential force on the first grain that a pair remembers [force].
    static RVE_INLINE History tangential_force(const History &history) { return history; }

    LinearNormal<Real> normal;
    LinearTangential<Real, History, Damped> tangential;
    VelocityDamping<Real> normal_damping;    ///< Damped
    Real velocity_arm;                       ///< Damped

    /// From constants in these or, for packs, in single numbers.
    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      normal.stiffness = Real(constants.normal_stiffness);
      tangential.stiffness = History(constants.tangential_stiffness);
      tangential.friction = Real(constants.friction);
      if constexpr (Damped) {
        normal_damping.viscosity = Real(constants.normal_viscosity);
        tangential.viscosity = Real(constants.tangential_viscosity);
        velocity_arm = Real(constants.velocity_arm);
      }
    }

    RVE_INLINE double spring_force(const ContactPlace &place) const
    {
      return static_cast<double>(normal.stiffness) * place.overlap;
    }
    RVE_INLINE ContactModuli stiffness(const ContactPlace &) const
    {
      return {static_cast<double>(normal.stiffness),
              slides() ? static_cast<double>(tangential.stiffness) : 0.0, 0.0};
    }
    RVE_INLINE ContactModuli viscosity(const ContactPlace &) const
    {
      if constexpr (Damped)
        return {static_cast<double>(normal_damping.viscosity),
                slides() ? static_cast<double>(tangential.viscosity) : 0.0, 0.0};
      return {0.0, 0.0, 0.0};
    }
    template <class Parameters>
    static RVE_INLINE bool has_normal_dashpot(const Parameters &parameters)
    {
      return parameters.normal_viscosity != 0.0;
    }

    RVE_INLINE Force evaluate(const ContactGeometry<Real, 2> &contact, const DiskMotion<Real> &i,
                              const DiskMotion<Real> &j, const Tensor<Real, 2> &velocity_gradient,
                              History spring, Real dt) const
    {
      // relative velocity c_j - c_i + L b: equation (20a) without any counting of periods
      const Vec<Real, 2> velocity = (j.velocity - i.velocity) + velocity_gradient * contact.branch;
      const Vec<Real, 2> &n = contact.normal;

      const Real arm_i = fma(Real(-0.5), contact.overlap, i.radius);
      const Real arm_j = fma(Real(-0.5), contact.overlap, j.radius);
      const Real velocity_arm_i = Damped ? fma(-velocity_arm, contact.overlap, i.radius) : arm_i;
      const Real velocity_arm_j = Damped ? fma(-velocity_arm, contact.overlap, j.radius) : arm_j;
      const Real normal_velocity = dot(velocity, n);
      // a sum of two products, not fma: it must not depend on the order of the grains
      const Real tangential_velocity =
          cross(n, velocity) - (velocity_arm_i * i.spin + velocity_arm_j * j.spin);

      Force result;
      result.normal_velocity = normal_velocity;
      result.tangential_velocity = tangential_velocity;
      result.normal_force = normal.force(contact.overlap);
      if (Damped) result.normal_force = result.normal_force + normal_damping.force(normal_velocity);
      if constexpr (!Frictional) {
        result.force = -result.normal_force * n;
        result.tangential = result.torque_i = result.torque_j = Real(0);
        result.spring = result.slipped = History(0);
        result.sliding = History(0) >= History(0);    // at its limit of zero
        return result;
      }
      const auto shear = tangential.advance(spring, tangential_velocity, result.normal_force, dt);
      result.tangential = shear.force;
      result.spring = shear.spring;
      result.slipped = shear.slipped;
      result.sliding = shear.sliding;

      // force on i: -f_n n + f_t t with t = (-n_y, n_x)
      result.force[0] = fma(-shear.force, n[1], -(result.normal_force * n[0]));
      result.force[1] = fma(shear.force, n[0], -(result.normal_force * n[1]));
      result.torque_i = arm_i * shear.force;
      result.torque_j = arm_j * shear.force;
      return result;
    }

    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(so_far, std::fabs(force.tangential));
    }

    /// What slides dissipates as much as the limit took from the spring; without a spring, what the velocity says.
    RVE_INLINE void dissipate(const Force &force, Real time_step, Dissipation &heat) const
    {
      const double dt = static_cast<double>(time_step);
      const double vt = force.tangential_velocity, vn = force.normal_velocity;
      if constexpr (Frictional) {
        const double capped = static_cast<double>(force.tangential);
        const double stiffness = static_cast<double>(tangential.stiffness);
        if (stiffness > 0.0)
          heat.friction += capped * static_cast<double>(force.slipped) / stiffness;
        else
          heat.friction += capped * vt * dt;
      }
      if constexpr (Damped) {
        heat.viscous += static_cast<double>(normal_damping.viscosity) * vn * vn * dt;
        if (!force.sliding)
          heat.viscous += static_cast<double>(tangential.viscosity) * vt * vt * dt;
      }
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, 2> &contact,
                                     const Force &force) const
    {
      return static_cast<double>(normal.elastic_energy(contact.overlap)) +
          tangential.elastic_energy(force.spring);
    }

   private:
    /// Without friction no tangential force is carried.
    RVE_INLINE bool slides() const { return Frictional && tangential.friction > Real(0); }
  };

  /// The laws that programs have (engine/programs.h).
  template <class Numbers> using NormalSprings = LinearFrictionLaw<Numbers, false, false>;
  template <class Numbers> using FrictionalSprings = LinearFrictionLaw<Numbers, false>;
  template <class Numbers> using DampedSprings = LinearFrictionLaw<Numbers, true>;

}    // namespace RVE_ISA
}    // namespace rve

#endif
