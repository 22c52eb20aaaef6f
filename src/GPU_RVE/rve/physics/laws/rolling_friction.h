// Rolling resistance: a moment against the rolling of two disks on each other, and the contact law with it.
//
// As LAMMPS' `pair granular ... rolling sds k_roll 0 mu_roll`, after Luding (2008), "Cohesive, frictional powders: contact models for
// tension", Granular Matter 10, 235-246: a spring with a limit for a force that exists in name only, "pseudo-force", since only its
// moment acts.

#ifndef RVE_PHYSICS_LAWS_ROLLING_FRICTION_H
#define RVE_PHYSICS_LAWS_ROLLING_FRICTION_H

#include "rve/physics/laws/linear_friction.h"
#include "rve/physics/laws/spring_forces.h"

namespace rve {
inline namespace RVE_ISA {

  /// Rolling velocity v_r = R (w_j - w_i) with the reduced radius R = r_i r_j / (r_i + r_j); rolling force
  /// f_r <- f_r + k_r v_r dt, at most mu_r |f_n|, kept as the tangential spring is; moments R f_r on grain i and -R f_r on grain j, and
  /// no force. A rigid rotation has equal spins and gives none. Under exchange of the grains v_r and f_r change sign exactly.
  template <class Real, class Spring> struct RollingResistance {
    LinearTangential<Real, Spring, false> spring;    ///< k_r [force/length], mu_r [-]

    struct Rolling {
      Real moment;       ///< on grain i; grain j gets the opposite [force length]
      Spring force;      ///< f_r, history [force]
      Spring slipped;    ///< see TangentialForce
    };

    RVE_INLINE Rolling advance(Spring force, const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                               Real normal_force, Real dt) const
    {
      const Real reduced_radius = i.radius * j.radius * reciprocal(i.radius + j.radius);
      const Real velocity = reduced_radius * (j.spin - i.spin);
      const auto rolled = spring.advance(force, velocity, normal_force, dt);
      return {reduced_radius * rolled.force, rolled.spring, rolled.slipped};
    }
  };

  template <class Real, class Spring> struct RollingContactForce : ContactForce<Real, Spring> {
    Spring rolling;            ///< new history [force]
    Spring rolling_slipped;    ///< see TangentialForce

    RVE_INLINE SpringForces<Spring> history() const { return {this->spring, rolling}; }
  };

  template <class Numbers> struct alignas(16) RollingConstants : LinearConstants<Numbers> {
    typename Numbers::Spring rolling_stiffness;
    typename Numbers::Real rolling_friction;

    /// Beside those of the linear laws, `parameters` has k_r [force/length] and mu_r.
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      const double stiffness_unit = units.length * units.per_force;
      LinearConstants<Numbers>::set(parameters, units, arm);
      rolling_stiffness =
          static_cast<typename Numbers::Spring>(parameters.rolling_stiffness * stiffness_unit);
      // without a spring there is no force to limit
      rolling_friction = static_cast<typename Numbers::Real>(
          parameters.rolling_stiffness > 0.0 ? parameters.rolling_friction : 0.0);
    }
  };

  /// The damped law with rolling resistance. The same bits where that has a coefficient of zero.
  template <class NumberFormat> struct RollingFriction : LinearFrictionLaw<NumberFormat, true> {
    using Sliding = LinearFrictionLaw<NumberFormat, true>;
    using Real = typename NumberFormat::Real;
    using Spring = typename NumberFormat::Spring;
    using History = SpringForces<Spring>;
    using Force = RollingContactForce<Real, Spring>;
    using Constants = RollingConstants<NumberFormat>;
    static constexpr bool has_rolling = true;

    template <class OtherNumbers> using In = RollingFriction<OtherNumbers>;

    /// The tangential force turns round, and so does t. The moments on the two grains are opposite.
    static RVE_INLINE History seen_from_partner(const History &history)
    {
      return {history.tangential, -history.rolling};
    }
    static RVE_INLINE Spring tangential_force(const History &history) { return history.tangential; }
    static RVE_INLINE History in_units(const History &history, double force, double)
    {
      const Spring unit = static_cast<Spring>(force);
      return {unit * history.tangential, unit * history.rolling};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {static_cast<Spring>(pair.tangential_force), static_cast<Spring>(pair.rolling_force)};
    }
    template <class Pair> static void to_pair(const History &history, Pair &pair)
    {
      pair.tangential_force = static_cast<double>(history.tangential);
      pair.rolling_force = static_cast<double>(history.rolling);
    }

    RollingResistance<Real, Spring> rolling;

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      Sliding::take(constants);
      rolling.spring.stiffness = Spring(constants.rolling_stiffness);
      rolling.spring.friction = Real(constants.rolling_friction);
    }

    RVE_INLINE ContactModuli stiffness(const ContactPlace &place) const
    {
      ContactModuli moduli = Sliding::stiffness(place);
      if (rolling.spring.friction > Real(0))
        moduli.rolling = static_cast<double>(rolling.spring.stiffness);
      return moduli;
    }

    RVE_INLINE Force evaluate(const ContactGeometry<Real, 2> &contact, const DiskMotion<Real> &i,
                              const DiskMotion<Real> &j, const Tensor<Real, 2> &velocity_gradient,
                              const History &history, Real dt) const
    {
      Force result;
      static_cast<ContactForce<Real, Spring> &>(result) =
          Sliding::evaluate(contact, i, j, velocity_gradient, history.tangential, dt);
      const auto rolled = rolling.advance(history.rolling, i, j, result.normal_force, dt);
      result.torque_i = result.torque_i + rolled.moment;
      result.torque_j = result.torque_j - rolled.moment;
      result.rolling = rolled.force;
      result.rolling_slipped = rolled.slipped;
      return result;
    }

    /// The moment, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(Sliding::largest(force, so_far),
                    std::fabs(static_cast<Real>(0.5 * force.rolling)));
    }

    RVE_INLINE void dissipate(const Force &force, Real time_step, Dissipation &heat) const
    {
      Sliding::dissipate(force, time_step, heat);
      const double stiffness = static_cast<double>(rolling.spring.stiffness);
      if (stiffness > 0.0)
        heat.friction += static_cast<double>(force.rolling) *
            static_cast<double>(force.rolling_slipped) / stiffness;
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, 2> &contact,
                                     const Force &force) const
    {
      return Sliding::elastic_energy(contact, force) + rolling.spring.elastic_energy(force.rolling);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
