// Rolling resistance: a moment against the rolling of two disks on each other, beside any contact law.
//
// As LAMMPS' `pair granular ... rolling sds k_roll 0 mu_roll`, after Luding (2008), "Cohesive, frictional powders: contact models for
// tension", Granular Matter 10, 235-246: a spring with a limit for a force that exists in name only, "pseudo-force", since only its
// moment acts.

#ifndef RVE_PHYSICS_LAWS_ROLLING_FRICTION_H
#define RVE_PHYSICS_LAWS_ROLLING_FRICTION_H

#include "rve/physics/laws/disk_contact.h"
#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Rolling velocity v_r = R (w_j - w_i) with the reduced radius R = r_i r_j / (r_i + r_j); rolling force
  /// f_r <- f_r + k_r v_r dt, at most mu_r times the force that limits friction, kept as the tangential spring is; moments R f_r on
  /// grain i and -R f_r on grain j, and no force. A rigid rotation has equal spins and gives none. Under exchange of the grains v_r and
  /// f_r change sign exactly.
  template <class Real, class Spring> struct RollingResistance {
    LinearTangential<Real, Spring, false> spring;    ///< k_r [force/length], mu_r [-]

    struct Rolling {
      Real moment;       ///< on grain i; grain j gets the opposite [force length]
      Spring force;      ///< f_r, history [force]
      Spring slipped;    ///< see TangentialForce
    };

    RVE_INLINE Rolling advance(Spring force, const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                               Real limiting_force, Real dt) const
    {
      const Real reduced_radius = i.radius * j.radius * reciprocal(i.radius + j.radius);
      const Real velocity = reduced_radius * (j.spin - i.spin);
      const auto rolled = spring.advance(force, velocity, limiting_force, dt);
      return {reduced_radius * rolled.force, rolled.spring, rolled.slipped};
    }
  };

  /// What a pair remembers.
  template <class ContactHistory, class Number> struct RollingHistory {
    ContactHistory contact;    ///< of the law without rolling resistance
    Number rolling;            ///< moment on the first grain over the reduced radius [force]
  };

  template <class Contact> struct RollingForce : Contact::Force {
    using Spring = typename Contact::Numbers::Spring;
    using History = RollingHistory<typename Contact::History, Spring>;
    Spring rolling;            ///< new history [force]
    Spring rolling_slipped;    ///< see TangentialForce

    RVE_INLINE History history() const { return {Contact::Force::history(), rolling}; }
  };

  template <class Contact> struct alignas(16) RollingConstants : Contact::Constants {
    using Numbers = typename Contact::Numbers;
    typename Numbers::Spring rolling_stiffness;
    typename Numbers::Real rolling_friction;

    /// Beside those of the contact law, `parameters` has k_r [force/length] and mu_r.
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      const double stiffness_unit = units.length * units.per_force;
      Contact::Constants::set(parameters, units, arm);
      rolling_stiffness =
          static_cast<typename Numbers::Spring>(parameters.rolling_stiffness * stiffness_unit);
      // without a spring there is no force to limit
      rolling_friction = static_cast<typename Numbers::Real>(
          parameters.rolling_stiffness > 0.0 ? parameters.rolling_friction : 0.0);
    }
  };

  /// A contact law with rolling resistance. The same bits where that has a coefficient of zero.
  template <class Contact> struct WithRolling : Contact {
    using Numbers = typename Contact::Numbers;
    using Real = typename Numbers::Real;
    using Spring = typename Numbers::Spring;
    using History = RollingHistory<typename Contact::History, Spring>;
    using Force = RollingForce<Contact>;
    using Constants = RollingConstants<Contact>;
    static constexpr bool has_rolling = true;

    template <class OtherNumbers>
    using In = WithRolling<typename Contact::template In<OtherNumbers>>;

    /// The moments on the two grains are opposite.
    static RVE_INLINE History seen_from_partner(const History &history)
    {
      return {Contact::seen_from_partner(history.contact), -history.rolling};
    }
    static RVE_INLINE Spring tangential_force(const History &history)
    {
      return Contact::tangential_force(history.contact);
    }
    static RVE_INLINE History in_units(const History &history, double force, double length)
    {
      return {Contact::in_units(history.contact, force, length),
              static_cast<Spring>(force) * history.rolling};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {Contact::of_pair(pair), static_cast<Spring>(pair.rolling_force)};
    }
    template <class Pair> static void to_pair(const History &history, Pair &pair)
    {
      Contact::to_pair(history.contact, pair);
      pair.rolling_force = static_cast<double>(history.rolling);
    }

    RollingResistance<Real, Spring> rolling;

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      Contact::take(constants);
      rolling.spring.stiffness = Spring(constants.rolling_stiffness);
      rolling.spring.friction = Real(constants.rolling_friction);
    }

    RVE_INLINE ContactModuli stiffness(const ContactPlace &place) const
    {
      ContactModuli moduli = Contact::stiffness(place);
      if (rolling.spring.friction > Real(0))
        moduli.rolling = static_cast<double>(rolling.spring.stiffness);
      return moduli;
    }

    RVE_INLINE Force evaluate(const ContactGeometry<Real, 2> &contact, const DiskMotion<Real> &i,
                              const DiskMotion<Real> &j, const Tensor<Real, 2> &velocity_gradient,
                              const History &history, Real dt) const
    {
      Force result;
      static_cast<typename Contact::Force &>(result) =
          Contact::evaluate(contact, i, j, velocity_gradient, history.contact, dt);
      const auto rolled =
          rolling.advance(history.rolling, i, j, Contact::limiting_force(result), dt);
      result.torque_i = result.torque_i + rolled.moment;
      result.torque_j = result.torque_j - rolled.moment;
      result.rolling = rolled.force;
      result.rolling_slipped = rolled.slipped;
      return result;
    }

    /// The moment, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(Contact::largest(force, so_far),
                    std::fabs(static_cast<Real>(0.5 * force.rolling)));
    }

    RVE_INLINE void dissipate(const Force &force, Real time_step, Dissipation &heat) const
    {
      Contact::dissipate(force, time_step, heat);
      const double stiffness = static_cast<double>(rolling.spring.stiffness);
      if (stiffness > 0.0)
        heat.friction += static_cast<double>(force.rolling) *
            static_cast<double>(force.rolling_slipped) / stiffness;
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, 2> &contact,
                                     const Force &force) const
    {
      return Contact::elastic_energy(contact, force) + rolling.spring.elastic_energy(force.rolling);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
