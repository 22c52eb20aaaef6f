// The contact law: composes normal and tangential laws with the kinematics of a contact of two disks. Stateless: what it
// needs to remember, the tangential history, comes in and goes out as a number.

#ifndef RVE_PHYSICS_CONTACT_LAW_H
#define RVE_PHYSICS_CONTACT_LAW_H

#include "rve/physics/contact_geometry.h"
#include "rve/physics/normal_force.h"
#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Motion of one disk as a contact sees it.
  template <class Real> struct DiskMotion {
    Vec<Real, 2> velocity;    ///< peculiar [length/time]
    Real spin;                ///< counter-clockwise [1/time]
    Real radius;              ///< [length]
  };

  template <class Real, class History> struct ContactForce {
    Vec<Real, 2> force;          ///< on grain i; grain j gets the opposite [force]
    Real torque_i;               ///< on grain i [force length]
    Real torque_j;               ///< on grain j [force length]
    Real normal_force;           ///< repulsion positive [force]
    Real tangential;             ///< along t = (-n_y, n_x) [force]
    History spring;              ///< new history [force]
    History slipped;             ///< see TangentialForce
    Real tangential_velocity;    ///< [length/time]
    Real normal_velocity;        ///< [length/time]
    Truth<History> sliding;

    RVE_INLINE History history() const { return spring; }
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
    static constexpr bool has_friction = Frictional;
    static constexpr bool has_rolling = false;
    static constexpr bool is_damped = Damped;

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

    RVE_INLINE ContactForce<Real, History> evaluate(const ContactGeometry<Real, 2> &contact,
                                                    const DiskMotion<Real> &i,
                                                    const DiskMotion<Real> &j,
                                                    const Tensor<Real, 2> &velocity_gradient,
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

      ContactForce<Real, History> result;
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
  };

  /// The laws that programs have (engine/programs.h).
  template <class Numbers> using NormalSprings = LinearFrictionLaw<Numbers, false, false>;
  template <class Numbers> using FrictionalSprings = LinearFrictionLaw<Numbers, false>;
  template <class Numbers> using DampedSprings = LinearFrictionLaw<Numbers, true>;

}    // namespace RVE_ISA
}    // namespace rve

#endif
