// SPDX-License-Identifier: GPL-2.0-only
// Resistance to rolling and, of spheres, to twisting: moments against the turning of two grains on each other, beside any contact law.
//
// As LAMMPS' `pair granular ... rolling sds k_roll gamma_roll mu_roll twisting sds k_twist gamma_twist mu_twist`, after Luding (2008),
// "Cohesive, frictional powders: contact models for tension", Granular Matter 10, 235-246: a spring and a dashpot with a limit for a force
// that exists in name only, "pseudo-force", since only its moment acts. And as its `twisting marshall`, after Marshall (2009),
// "Discrete-element modeling of particulate aerosol flows", J. Comput. Phys. 228, 1541-1561.

#pragma once

#include "rve/physics/laws/grain_contact.h"

namespace rve {
inline namespace RVE_ISA {

  /// k_r, mu_r and gamma_r, and of spheres k_q, mu_q and gamma_q.
  template <class Numbers, int D> struct TurningConstants {
    typename Numbers::Spring rolling_stiffness;
    typename Numbers::Real rolling_friction, rolling_viscosity;
  };
  template <class Numbers> struct TurningConstants<Numbers, 3> : TurningConstants<Numbers, 2> {
    typename Numbers::Spring twisting_stiffness;
    typename Numbers::Real twisting_friction, twisting_viscosity;
    typename Numbers::Real twists_by_friction;    ///< 1: after Marshall, 0: not
  };

  /// Of two disks. Rolling velocity v_r = R (w_j - w_i) with the reduced radius R = r_i r_j / (r_i + r_j); rolling force
  /// f_r <- f_r + k_r v_r dt, with gamma_r v_r beside it at most mu_r times the force that limits friction, kept as the tangential spring is;
  /// moments R f_r on grain i and -R f_r on grain j, and no force. A rigid rotation has equal spins and gives none. Under exchange of the
  /// grains v_r and f_r change sign exactly.
  template <class Real, class Spring, int D> struct TurningResistance {
    /// k_r [force/length], mu_r [-], gamma_r [force time/length].
    LinearTangential<Real, Spring, true> rolling;

    using History = Spring;    ///< f_r [force]

    struct Answer {
      Real moment;             ///< on grain i; grain j gets the opposite [force length]
      History history;         ///< the new one
      History slipped;         ///< see TangentialForce
      Real force, velocity;    ///< f_r with its dashpot, v_r
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
      rolling.viscosity = Real(constants.rolling_viscosity);
    }

    RVE_INLINE void add_stiffness(const ContactPlace &, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = static_cast<double>(rolling.stiffness);
    }
    RVE_INLINE void add_viscosity(const ContactPlace &, ContactModuli &dashpots) const
    {
      if (rolling.friction > Real(0)) dashpots.rolling = static_cast<double>(rolling.viscosity);
    }

    template <class Law, class Force>
    RVE_INLINE Answer advance(const Law &, const Force &, History spring,
                              const ContactGeometry<Real, 2> &, const DiskContact<Real> &,
                              const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                              Real limiting_force, Real dt) const
    {
      const Real reduced_radius = reduced(i.radius, j.radius);
      const Real velocity = reduced_radius * (j.spin - i.spin);
      const auto rolled = rolling.advance(spring, velocity, limiting_force, dt);
      return {reduced_radius * rolled.force, rolled.spring, rolled.slipped, rolled.force, velocity};
    }

    /// The moment, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(const Answer &turned)
    {
      return std::fabs(static_cast<Real>(0.5 * turned.history));
    }

    template <class Law>
    RVE_INLINE void dissipate(const Law &, const ContactGeometry<Real, 2> &, const Answer &turned,
                              double, double dt, Dissipation &heat) const
    {
      dissipate_spring(static_cast<double>(turned.force), static_cast<double>(turned.history),
                       static_cast<double>(turned.slipped), static_cast<double>(turned.velocity),
                       static_cast<double>(rolling.stiffness),
                       static_cast<double>(rolling.viscosity), dt, heat);
    }

    RVE_INLINE double elastic_energy(const Answer &turned) const
    {
      return rolling.elastic_energy(turned.history);
    }
    RVE_INLINE double released(History history) const { return rolling.elastic_energy(history); }
  };

  /// What a pair of spheres remembers of its turning.
  template <class Number> struct SphereTurning {
    Vec<Number, 3> rolling;    ///< f_r, across the normal [force]
    Number twisting;           ///< moment on the first grain along the normal [force length]
  };

  /// Of two spheres. v_r = R (w_j - w_i) x n lies across the normal and f_r turns with the contact; moments R n x f_r. Beside them the
  /// twisting velocity w_q = (w_j - w_i) . n and a moment along the normal m_q <- m_q + k_q w_q dt, with gamma_q w_q beside it at most mu_q
  /// times the force that limits friction. Under exchange of the grains neither f_r nor m_q changes: the relative spin and the normal both
  /// turn round.
  ///
  /// After Marshall friction over the area of contact, of radius a, resists twisting (his equations 30, 32 and 44): k_q = k_t a^2/2,
  /// gamma_q = gamma_t a^2/2 and mu_q = 2/3 mu a, with a^2 = R d at an overlap d. The angle is remembered, as the moment that it has at a
  /// depth d/R of one; the moment now is the `share` k_t a^2 of it.
  template <class Real, class Spring> struct TurningResistance<Real, Spring, 3> {
    /// k_r [force/length], mu_r [-], gamma_r [force time/length].
    VectorSpring<Real, Spring, true> rolling;
    /// k_q [force length], mu_q [length], gamma_q [force length time].
    LinearTangential<Real, Spring, true> twisting;
    Real twists_by_friction;    ///< 1: after Marshall

    using History = SphereTurning<Spring>;

    struct Answer {
      Vec<Real, 3> moment;
      History history, slipped;
      Vec<Real, 3> rolling_force, rolling_velocity;
      Real twisting_moment, twisting_velocity;          ///< on grain i along n [force length]
      LinearTangential<Real, Spring, true> twisting;    ///< of this contact
      Real share;                                       ///< of what is remembered
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
      rolling.viscosity = Real(constants.rolling_viscosity);
      twisting.stiffness = Spring(constants.twisting_stiffness);
      twisting.friction = Real(constants.twisting_friction);
      twisting.viscosity = Real(constants.twisting_viscosity);
      twists_by_friction = Real(constants.twists_by_friction);
    }

    RVE_INLINE void add_stiffness(const ContactPlace &place, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = static_cast<double>(rolling.stiffness);
      add_twisting(static_cast<double>(twisting.stiffness), moduli.tangential, place, moduli);
    }
    /// `dashpots` has the tangential one already, as the moduli have above.
    RVE_INLINE void add_viscosity(const ContactPlace &place, ContactModuli &dashpots) const
    {
      if (rolling.friction > Real(0)) dashpots.rolling = static_cast<double>(rolling.viscosity);
      add_twisting(static_cast<double>(twisting.viscosity), dashpots.tangential, place, dashpots);
    }

    template <class Law, class Force>
    RVE_INLINE Answer advance(const Law &law, const Force &force, const History &history,
                              const ContactGeometry<Real, 3> &contact,
                              const SphereContact<Real> &moving, const SphereMotion<Real> &i,
                              const SphereMotion<Real> &j, Real limiting_force, Real dt) const
    {
      const Vec<Real, 3> &n = contact.normal;
      const Real reduced_radius = reduced(i.radius, j.radius);
      const Vec<Real, 3> turning = j.spin - i.spin;
      Answer answer;
      answer.rolling_velocity = reduced_radius * cross(turning, n);
      answer.twisting_velocity = dot(turning, n);
      const auto rolled = rolling.advance(moving.turned(history.rolling, n, dt),
                                          answer.rolling_velocity, limiting_force, dt);
      answer.twisting = twisting;
      answer.share = Real(1);
      if (twists_by_friction > Real(0)) {
        const Real depth = contact.overlap * reciprocal(reduced_radius);
        answer.share = law.share_at(depth);
        answer.twisting =
            by_friction(law.sliding_resistance(force), depth, reduced_radius, answer.share);
      }
      const auto twisted =
          answer.twisting.advance(history.twisting, answer.twisting_velocity, limiting_force, dt);
      answer.rolling_force = rolled.force;
      answer.twisting_moment = answer.share * twisted.force;
      answer.moment = reduced_radius * cross(n, rolled.force) + answer.twisting_moment * n;
      answer.history = {rolled.spring, twisted.spring};
      answer.slipped = {rolled.slipped, twisted.slipped};
      return answer;
    }

    /// A component of the moment, R n x f_r and m_q: it is at most twice this, with reduced radii that are below half an internal length.
    static RVE_INLINE Real largest(const Answer &turned)
    {
      return larger(static_cast<Real>(Spring(0.5) * magnitude(turned.history.rolling)),
                    static_cast<Real>(fabs(turned.twisting_moment)));
    }

    /// An area of contact that grows or shrinks takes energy from the spring against twisting, or gives it some.
    template <class Law>
    RVE_INLINE void dissipate(const Law &law, const ContactGeometry<Real, 3> &contact,
                              const Answer &turned, double normal_velocity, double dt,
                              Dissipation &heat) const
    {
      dissipate_spring(
          in_numbers<double>(turned.rolling_force), in_numbers<double>(turned.history.rolling),
          in_numbers<double>(turned.slipped.rolling), in_numbers<double>(turned.rolling_velocity),
          static_cast<double>(rolling.stiffness), static_cast<double>(rolling.viscosity), dt, heat);
      Dissipation of_twisting{0.0, 0.0};
      dissipate_spring(static_cast<double>(turned.twisting_moment),
                       static_cast<double>(turned.history.twisting),
                       static_cast<double>(turned.slipped.twisting),
                       static_cast<double>(turned.twisting_velocity),
                       static_cast<double>(turned.twisting.stiffness),
                       static_cast<double>(turned.twisting.viscosity), dt, of_twisting);
      const double share = static_cast<double>(turned.share);
      heat.friction += share * of_twisting.friction;
      heat.viscous += share * of_twisting.viscous;
      if (twists_by_friction > Real(0)) {
        const double overlap = static_cast<double>(contact.overlap),
                     before = larger(0.0, overlap + normal_velocity * dt);
        heat.friction += (law.share_at(before / overlap) - 1.0) * elastic_energy_of_twist(turned);
      }
    }

    RVE_INLINE double elastic_energy(const Answer &turned) const
    {
      return rolling.elastic_energy(turned.history.rolling) + elastic_energy_of_twist(turned);
    }
    /// The moment against twisting over what is remembered of it [-].
    template <class Law> RVE_INLINE double twisting_share(const ContactPlace &place) const
    {
      return twists_by_friction > Real(0)
          ? Law::share_at(place.overlap / reduced(place.radius_i, place.radius_j))
          : 1.0;
    }
    /// After Marshall what resists twisting vanishes with the area of contact, and its energy has gone before.
    RVE_INLINE double released(const History &history) const
    {
      return rolling.elastic_energy(history.rolling) +
          (twists_by_friction > Real(0) ? 0.0 : twisting.elastic_energy(history.twisting));
    }

   private:
    /// k_q or gamma_q over the squared reduced radius.
    RVE_INLINE void add_twisting(double given, double tangential, const ContactPlace &place,
                                 ContactModuli &moduli) const
    {
      const double reduced_radius = reduced(place.radius_i, place.radius_j);
      if (twists_by_friction > Real(0))
        moduli.twisting = 0.5 * tangential * (place.overlap / reduced_radius);
      else if (twisting.friction > Real(0))
        moduli.twisting = given / (reduced_radius * reduced_radius);
    }

    /// The spring that is remembered: over `share` of what it is now.
    static RVE_INLINE LinearTangential<Real, Spring, true>
    by_friction(const SlidingResistance<Real> &sliding, Real depth, Real reduced_radius, Real share)
    {
      const Real per_share = reciprocal(share);
      const Real half_area = Real(0.5) * depth * reduced_radius * reduced_radius * per_share;
      LinearTangential<Real, Spring, true> spring;
      spring.stiffness = static_cast<Spring>(half_area * sliding.stiffness);
      spring.viscosity = half_area * sliding.viscosity;
      spring.friction =
          Real(2.0 / 3.0) * sliding.friction * reduced_radius * std::sqrt(depth) * per_share;
      return spring;
    }

    RVE_INLINE double elastic_energy_of_twist(const Answer &turned) const
    {
      return static_cast<double>(turned.share) *
          turned.twisting.elastic_energy(turned.history.twisting);
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

    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Real = typename Numbers::Real;
      using Spring = typename Numbers::Spring;
      using Of = MaterialNumbers;
      Contact::Constants::set(parameters, units, arm);
      // without a spring there is no force to limit, and without a limit no use for a dashpot
      this->rolling_stiffness =
          static_cast<Spring>(units.internal<&Of::rolling_stiffness>(parameters));
      this->rolling_friction = static_cast<Real>(
          parameters.rolling_stiffness > 0.0 ? units.internal<&Of::rolling_friction>(parameters)
                                             : 0.0);
      this->rolling_viscosity = static_cast<Real>(
          this->rolling_friction > Real(0) ? units.internal<&Of::rolling_viscosity>(parameters)
                                           : 0.0);
      if constexpr (Contact::D == 3) {
        this->twists_by_friction = static_cast<Real>(parameters.twisting_marshall);
        this->twisting_stiffness =
            static_cast<Spring>(units.internal<&Of::twisting_stiffness>(parameters));
        this->twisting_friction = static_cast<Real>(
            parameters.twisting_stiffness > 0.0 ? units.internal<&Of::twisting_friction>(parameters)
                                                : 0.0);
        this->twisting_viscosity = static_cast<Real>(
            this->twisting_friction > Real(0) ? units.internal<&Of::twisting_viscosity>(parameters)
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
    static RVE_INLINE History between_looks(const History &history)
    {
      return {Contact::between_looks(history.contact), history.turning};
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
      if (touches(place)) resistance.add_stiffness(place, moduli);
      return moduli;
    }
    RVE_INLINE ContactModuli viscosity(const ContactPlace &place) const
    {
      ContactModuli dashpots = Contact::viscosity(place);
      if (touches(place)) resistance.add_viscosity(place, dashpots);
      return dashpots;
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
      if constexpr (Contact::has_reach) {
        if (!(contact.overlap > Real(0))) {
          result.turned = typename Resistance::Answer();
          return result;
        }
      }
      result.turned =
          resistance.advance(static_cast<const Contact &>(*this), result, history.turning, contact,
                             moving, i, j, Contact::limiting_force(result), dt);
      result.torque_i = result.torque_i + result.turned.moment;
      result.torque_j = result.torque_j - result.turned.moment;
      return result;
    }

    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(Contact::largest(force, so_far), Resistance::largest(force.turned));
    }

    RVE_INLINE void dissipate(const ContactGeometry<Real, D> &contact, const Force &force,
                              Real time_step, Dissipation &heat) const
    {
      Contact::dissipate(contact, force, time_step, heat);
      resistance.dissipate(static_cast<const Contact &>(*this), contact, force.turned,
                           static_cast<double>(force.normal_velocity),
                           static_cast<double>(time_step), heat);
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      return Contact::elastic_energy(contact, force) + resistance.elastic_energy(force.turned);
    }
    RVE_INLINE double released(const History &history) const
    {
      return Contact::released(history.contact) + resistance.released(history.turning);
    }
    RVE_INLINE double twisting_share(const ContactPlace &place) const
    {
      return resistance.template twisting_share<Contact>(place);
    }

   private:
    /// Grains that do not touch resist no turning.
    static RVE_INLINE bool touches(const ContactPlace &place)
    {
      return !Contact::has_reach || place.overlap > 0.0;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
