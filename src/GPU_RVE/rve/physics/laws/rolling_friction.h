// Resistance to rolling and, of spheres, to twisting: moments against the turning of two grains on each other, beside any contact law.
//
// As LAMMPS' `pair granular ... rolling sds k_roll 0 mu_roll twisting sds k_twist 0 mu_twist`, after Luding (2008), "Cohesive, frictional
// powders: contact models for tension", Granular Matter 10, 235-246: a spring with a limit for a force that exists in name only,
// "pseudo-force", since only its moment acts.

#ifndef RVE_PHYSICS_LAWS_ROLLING_FRICTION_H
#define RVE_PHYSICS_LAWS_ROLLING_FRICTION_H

#include "rve/physics/laws/grain_contact.h"

namespace rve {
inline namespace RVE_ISA {

  /// k_r and mu_r, and of spheres k_q and mu_q.
  template <class Numbers, int D> struct TurningConstants {
    typename Numbers::Spring rolling_stiffness;
    typename Numbers::Real rolling_friction;
  };
  template <class Numbers> struct TurningConstants<Numbers, 3> : TurningConstants<Numbers, 2> {
    typename Numbers::Spring twisting_stiffness;
    typename Numbers::Real twisting_friction;
  };

  /// Of two disks. Rolling velocity v_r = R (w_j - w_i) with the reduced radius R = r_i r_j / (r_i + r_j); rolling force
  /// f_r <- f_r + k_r v_r dt, at most mu_r times the force that limits friction, kept as the tangential spring is; moments R f_r on
  /// grain i and -R f_r on grain j, and no force. A rigid rotation has equal spins and gives none. Under exchange of the grains v_r and
  /// f_r change sign exactly.
  template <class Real, class Spring, int D> struct TurningResistance {
    LinearTangential<Real, Spring, false> rolling;    ///< k_r [force/length], mu_r [-]

    using History = Spring;    ///< f_r [force]

    struct Answer {
      Real moment;        ///< on grain i; grain j gets the opposite [force length]
      History history;    ///< the new one
      History slipped;    ///< see TangentialForce
    };

    static RVE_INLINE History seen_from_partner(History history) { return -history; }
    static RVE_INLINE History in_units(History history, double force, double)
    {
      return static_cast<Spring>(force) * history;
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return static_cast<Spring>(pair.rolling_force);
    }
    template <class Pair> static void to_pair(History history, Pair &pair)
    {
      pair.rolling_force = static_cast<double>(history);
    }

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      rolling.stiffness = Spring(constants.rolling_stiffness);
      rolling.friction = Real(constants.rolling_friction);
    }

    RVE_INLINE void add_stiffness(const ContactPlace &, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = static_cast<double>(rolling.stiffness);
    }

    RVE_INLINE Answer advance(History force, const DiskContact<Real> &, const Vec<Real, 2> &,
                              const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                              Real limiting_force, Real dt) const
    {
      const Real reduced_radius = reduced(i.radius, j.radius);
      const Real velocity = reduced_radius * (j.spin - i.spin);
      const auto rolled = rolling.advance(force, velocity, limiting_force, dt);
      return {reduced_radius * rolled.force, rolled.spring, rolled.slipped};
    }

    /// The moment, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(History history)
    {
      return std::fabs(static_cast<Real>(0.5 * history));
    }

    RVE_INLINE double dissipated(const Answer &turned) const
    {
      const double stiffness = static_cast<double>(rolling.stiffness);
      return stiffness > 0.0
          ? static_cast<double>(turned.history) * static_cast<double>(turned.slipped) / stiffness
          : 0.0;
    }

    RVE_INLINE double elastic_energy(History history) const
    {
      return rolling.elastic_energy(history);
    }
  };

  /// What a pair of spheres remembers of its turning.
  template <class Number> struct SphereTurning {
    Vec<Number, 3> rolling;    ///< f_r, across the normal [force]
    Number twisting;           ///< moment on the first grain along the normal [force length]
  };

  /// Of two spheres. v_r = R (w_j - w_i) x n lies across the normal and f_r turns with the contact; moments R n x f_r. Beside them the
  /// twisting velocity w_q = (w_j - w_i) . n and a moment along the normal m_q <- m_q + k_q w_q dt, at most mu_q times the force that
  /// limits friction. Under exchange of the grains neither f_r nor m_q changes: the relative spin and the normal both turn round.
  template <class Real, class Spring> struct TurningResistance<Real, Spring, 3> {
    VectorSpring<Real, Spring, false> rolling;         ///< k_r [force/length], mu_r [-]
    LinearTangential<Real, Spring, false> twisting;    ///< k_q [force length], mu_q [length]

    using History = SphereTurning<Spring>;

    struct Answer {
      Vec<Real, 3> moment;
      History history, slipped;
    };

    static RVE_INLINE const History &seen_from_partner(const History &history) { return history; }
    static RVE_INLINE History turned(const History &history, const Tensor3 &rotation)
    {
      return {along_turned(history.rolling, rotation), history.twisting};
    }
    static RVE_INLINE History in_units(const History &history, double force, double length)
    {
      return {static_cast<Spring>(force) * history.rolling,
              static_cast<Spring>(force * length) * history.twisting};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {in_numbers<Spring>(pair.rolling_force), static_cast<Spring>(pair.twisting_moment)};
    }
    template <class Pair> static void to_pair(const History &history, Pair &pair)
    {
      pair.rolling_force = in_numbers<double>(history.rolling);
      pair.twisting_moment = static_cast<double>(history.twisting);
    }

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      rolling.stiffness = Real(constants.rolling_stiffness);
      rolling.friction = Real(constants.rolling_friction);
      twisting.stiffness = Spring(constants.twisting_stiffness);
      twisting.friction = Real(constants.twisting_friction);
    }

    RVE_INLINE void add_stiffness(const ContactPlace &place, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = static_cast<double>(rolling.stiffness);
      const double reduced_radius = reduced(place.radius_i, place.radius_j);
      if (twisting.friction > Real(0))
        moduli.twisting =
            static_cast<double>(twisting.stiffness) / (reduced_radius * reduced_radius);
    }

    RVE_INLINE Answer advance(const History &history, const SphereContact<Real> &moving,
                              const Vec<Real, 3> &n, const SphereMotion<Real> &i,
                              const SphereMotion<Real> &j, Real limiting_force, Real dt) const
    {
      const Real reduced_radius = reduced(i.radius, j.radius);
      const Vec<Real, 3> turning = j.spin - i.spin;
      const auto rolled = rolling.advance(moving.turned(history.rolling, n, dt),
                                          reduced_radius * cross(turning, n), limiting_force, dt);
      const auto twisted = twisting.advance(history.twisting, dot(turning, n), limiting_force, dt);
      return {reduced_radius * cross(n, rolled.force) + twisted.force * n,
              {rolled.spring, twisted.spring},
              {rolled.slipped, twisted.slipped}};
    }

    /// A component of the moment, R n x f_r and m_q: it is at most twice this, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(const History &history)
    {
      return static_cast<Real>(larger(Spring(0.5) * magnitude(history.rolling),
                                      static_cast<Spring>(fabs(history.twisting))));
    }

    RVE_INLINE double dissipated(const Answer &turned) const
    {
      const double of_rolling = static_cast<double>(rolling.stiffness),
                   of_twisting = static_cast<double>(twisting.stiffness);
      double heat = 0.0;
      if (of_rolling > 0.0)
        heat += product(in_numbers<double>(turned.history.rolling),
                        in_numbers<double>(turned.slipped.rolling)) /
            of_rolling;
      if (of_twisting > 0.0)
        heat += static_cast<double>(turned.history.twisting) *
            static_cast<double>(turned.slipped.twisting) / of_twisting;
      return heat;
    }

    RVE_INLINE double elastic_energy(const History &history) const
    {
      return rolling.elastic_energy(history.rolling) + twisting.elastic_energy(history.twisting);
    }
  };

  /// What a pair remembers.
  template <class ContactHistory, class Turning> struct RollingHistory {
    ContactHistory contact;    ///< of the law without rolling resistance
    Turning turning;
  };

  template <class Contact> struct RollingForce : Contact::Force {
    using Resistance = TurningResistance<typename Contact::Numbers::Real,
                                         typename Contact::Numbers::Spring, Contact::D>;
    using History = RollingHistory<typename Contact::History, typename Resistance::History>;
    typename Resistance::Answer turned;

    RVE_INLINE History history() const { return {Contact::Force::history(), turned.history}; }
  };

  template <class Contact>
  struct alignas(16) RollingConstants :
      Contact::Constants,
      TurningConstants<typename Contact::Numbers, Contact::D> {
    using Numbers = typename Contact::Numbers;

    /// Beside those of the contact law, `parameters` has k_r [force/length] and mu_r, k_q [force length] and mu_q [length].
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Real = typename Numbers::Real;
      using Spring = typename Numbers::Spring;
      const double stiffness_unit = units.length * units.per_force;
      Contact::Constants::set(parameters, units, arm);
      // without a spring there is no force to limit
      this->rolling_stiffness = static_cast<Spring>(parameters.rolling_stiffness * stiffness_unit);
      this->rolling_friction =
          static_cast<Real>(parameters.rolling_stiffness > 0.0 ? parameters.rolling_friction : 0.0);
      if constexpr (Contact::D == 3) {
        this->twisting_stiffness =
            static_cast<Spring>(parameters.twisting_stiffness * (units.per_force / units.length));
        this->twisting_friction = static_cast<Real>(
            parameters.twisting_stiffness > 0.0 ? parameters.twisting_friction / units.length
                                                : 0.0);
      }
    }
  };

  /// A contact law with resistance to rolling, and to twisting in space. The same bits where that has coefficients of zero.
  template <class Contact> struct WithRolling : Contact {
    using Numbers = typename Contact::Numbers;
    static constexpr int D = Contact::D;
    using Real = typename Numbers::Real;
    using Spring = typename Numbers::Spring;
    using Resistance = TurningResistance<Real, Spring, D>;
    using Force = RollingForce<Contact>;
    using History = typename Force::History;
    using Constants = RollingConstants<Contact>;
    static constexpr bool has_rolling = true;

    template <class OtherNumbers>
    using In = WithRolling<typename Contact::template In<OtherNumbers>>;

    /// The moments on the two grains are opposite.
    static RVE_INLINE History seen_from_partner(const History &history)
    {
      return {Contact::seen_from_partner(history.contact),
              Resistance::seen_from_partner(history.turning)};
    }
    /// As of LinearFrictionLaw.
    static RVE_INLINE History turned(const History &history, const Tensor3 &rotation)
    {
      return {Contact::turned(history.contact, rotation),
              Resistance::turned(history.turning, rotation)};
    }
    static RVE_INLINE Along<Spring, D> tangential_force(const History &history)
    {
      return Contact::tangential_force(history.contact);
    }
    static RVE_INLINE History in_units(const History &history, double force, double length)
    {
      return {Contact::in_units(history.contact, force, length),
              Resistance::in_units(history.turning, force, length)};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {Contact::of_pair(pair), Resistance::of_pair(pair)};
    }
    template <class Pair> static void to_pair(const History &history, Pair &pair)
    {
      Contact::to_pair(history.contact, pair);
      Resistance::to_pair(history.turning, pair);
    }

    Resistance resistance;

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &constants)
    {
      Contact::take(constants);
      resistance.take(constants);
    }

    RVE_INLINE ContactModuli stiffness(const ContactPlace &place) const
    {
      ContactModuli moduli = Contact::stiffness(place);
      resistance.add_stiffness(place, moduli);
      return moduli;
    }

    RVE_INLINE Force evaluate(const ContactGeometry<Real, D> &contact,
                              const GrainMotion<Real, D> &i, const GrainMotion<Real, D> &j,
                              const Tensor<Real, D> &velocity_gradient, const History &history,
                              Real dt) const
    {
      return answer(contact, i, j, Contact::motion(contact, i, j, velocity_gradient, dt), history,
                    dt);
    }

    RVE_INLINE Force answer(const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &i,
                            const GrainMotion<Real, D> &j, const GrainContact<Real, D> &moving,
                            const History &history, Real dt) const
    {
      Force result;
      static_cast<typename Contact::Force &>(result) =
          Contact::answer(contact, i, j, moving, history.contact, dt);
      result.turned = resistance.advance(history.turning, moving, contact.normal, i, j,
                                         Contact::limiting_force(result), dt);
      result.torque_i = result.torque_i + result.turned.moment;
      result.torque_j = result.torque_j - result.turned.moment;
      return result;
    }

    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(Contact::largest(force, so_far), Resistance::largest(force.turned.history));
    }

    RVE_INLINE void dissipate(const Force &force, Real time_step, Dissipation &heat) const
    {
      Contact::dissipate(force, time_step, heat);
      heat.friction += resistance.dissipated(force.turned);
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      return Contact::elastic_energy(contact, force) +
          resistance.elastic_energy(force.turned.history);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
