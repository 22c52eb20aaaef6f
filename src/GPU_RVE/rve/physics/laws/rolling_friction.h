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

  /// A spring with a dashpot and a limit: without a spring there is no force to limit, and without a limit no use for a dashpot.
  template <class Numbers> struct SpringConstants {
    typename Numbers::Spring stiffness;
    typename Numbers::Real friction, viscosity;

    RVE_INLINE void set(double k, double mu, double gamma)
    {
      using Real = typename Numbers::Real;
      stiffness = typename Numbers::Spring(k);
      friction = Real(k > 0.0 ? mu : 0.0);
      viscosity = Real(friction > Real(0) ? gamma : 0.0);
    }
  };

  /// k_r, mu_r and gamma_r, and of spheres k_q, mu_q and gamma_q.
  template <class Numbers, int D> struct TurningConstants {
    SpringConstants<Numbers> rolling;
  };
  template <class Numbers> struct TurningConstants<Numbers, 3> {
    SpringConstants<Numbers> rolling, twisting;
    typename Numbers::Real twists_by_friction;    ///< 1: after Marshall, 0: not
  };

  /// What a pair remembers of its turning.
  template <class Number, int D> struct TurningHistory {
    Number rolling;    ///< f_r [force]
  };
  template <class Number> struct TurningHistory<Number, 3> {
    Vec<Number, 3> rolling;    ///< f_r, across the normal [force]
    Number twisting;           ///< moment on the first grain along the normal [force length]
  };

  /// Of two spheres: twisting velocity w_q = (w_j - w_i) . n and a moment along the normal m_q <- m_q + k_q w_q dt, with gamma_q w_q beside it at
  /// most mu_q times the force that limits friction. Under exchange of the grains m_q does not change.
  ///
  /// After Marshall friction over the area of contact, of radius a, resists twisting (his equations 30, 32 and 44): k_q = k_t a^2/2,
  /// gamma_q = gamma_t a^2/2 and mu_q = 2/3 mu a, with a^2 = R d at an overlap d. The angle is remembered, as the moment that it has at a
  /// depth d/R of one; the moment now is the `share` k_t a^2 of it.
  template <class Real, class Spring> struct TwistingResistance {
    using Moment = LinearTangential<Real, Spring, true>;

    /// k_q [force length], mu_q [length], gamma_q [force length time].
    Moment given;
    Real by_friction;    ///< 1: after Marshall

    struct Answer {
      Moment spring;            ///< of this contact
      Real share;               ///< of what is remembered
      Real moment, velocity;    ///< on grain i along n [force length], w_q
      Spring history, slipped;
    };

    /// `stiffness`: k_t or gamma_t of the contact, and k_q or gamma_q. Over the squared reduced radius.
    RVE_INLINE double modulus(double tangential, double twisting, const ContactPlace &place) const
    {
      const double reduced_radius = reduced(place.radius_i, place.radius_j);
      if (by_friction > Real(0)) return 0.5 * tangential * (place.overlap / reduced_radius);
      return given.friction > Real(0) ? twisting / (reduced_radius * reduced_radius) : 0.0;
    }

    template <class Law, class Force>
    RVE_INLINE Answer advance(const Law &law, const Force &force, Spring history, Real overlap,
                              Real reduced_radius, Real velocity, Real limiting_force,
                              Real dt) const
    {
      Answer answer;
      answer.velocity = velocity;
      answer.spring = given;
      answer.share = Real(1);
      if (by_friction > Real(0)) {
        const Real depth = overlap * reciprocal(reduced_radius);
        answer.share = law.share_at(depth);
        answer.spring = after_marshall(law.sliding_resistance(force), depth, reduced_radius,
                                       reciprocal(answer.share));
      }
      const auto twisted = answer.spring.advance(history, velocity, limiting_force, dt);
      answer.moment = answer.share * twisted.force;
      answer.history = twisted.spring;
      answer.slipped = twisted.slipped;
      return answer;
    }

    /// An area of contact that grows or shrinks takes energy from the spring, or gives it some.
    template <class Law>
    RVE_INLINE void dissipate(const Law &law, double overlap, const Answer &twisted,
                              double normal_velocity, double dt, Dissipation &heat) const
    {
      Dissipation of_spring{0.0, 0.0};
      dissipate_spring(twisted.moment, twisted.history, twisted.slipped, twisted.velocity,
                       double(twisted.spring.stiffness), double(twisted.spring.viscosity), dt,
                       of_spring);
      heat.friction += double(twisted.share) * of_spring.friction;
      heat.viscous += double(twisted.share) * of_spring.viscous;
      if (by_friction > Real(0)) {
        const double before = larger(0.0, overlap + normal_velocity * dt);
        heat.friction += (law.share_at(before / overlap) - 1.0) * elastic_energy(twisted);
      }
    }
    RVE_INLINE double elastic_energy(const Answer &twisted) const
    {
      return double(twisted.share) *
          energy_of_spring(twisted.history, double(twisted.spring.stiffness));
    }
    /// After Marshall what resists twisting vanishes with the area of contact, and its energy has gone before.
    RVE_INLINE double released(Spring history) const
    {
      return by_friction > Real(0) ? 0.0 : energy_of_spring(history, double(given.stiffness));
    }

   private:
    /// The spring that is remembered: over `share` of what it is now.
    static RVE_INLINE Moment after_marshall(const SlidingResistance<Real> &sliding, Real depth,
                                            Real reduced_radius, Real per_share)
    {
      const Real half_area = Real(0.5) * depth * reduced_radius * reduced_radius * per_share;
      return {Spring(half_area * sliding.stiffness),
              Real(2.0 / 3.0) * sliding.friction * reduced_radius * std::sqrt(depth) * per_share,
              half_area * sliding.viscosity};
    }
  };

  struct NoTwisting {
    struct Answer {};
  };

  /// Of two disks: rolling velocity v_r = R (w_j - w_i) with the reduced radius R = r_i r_j / (r_i + r_j); rolling force
  /// f_r <- f_r + k_r v_r dt, with gamma_r v_r beside it at most mu_r times the force that limits friction, kept as the tangential spring is;
  /// moments R f_r on grain i and -R f_r on grain j, and no force. A rigid rotation has equal spins and gives none. Under exchange of the
  /// grains v_r and f_r change sign exactly.
  ///
  /// Of two spheres: v_r = R (w_j - w_i) x n lies across the normal and f_r turns with the contact; moments R n x f_r and that of twisting. Under
  /// exchange of the grains f_r does not change: the relative spin and the normal both turn round.
  template <class Real, class Spring, int D> struct TurningResistance {
    using History = TurningHistory<Spring, D>;
    using Twisting = std::conditional_t<D == 3, TwistingResistance<Real, Spring>, NoTwisting>;

    /// k_r [force/length], mu_r [-], gamma_r [force time/length].
    TangentialSpring<Real, Spring, true, D> rolling;
    Twisting twisting;

    struct Answer {
      Spin<Real, D> moment;              ///< on grain i; grain j gets the opposite [force length]
      History history;                   ///< the new one
      Along<Spring, D> slipped;          ///< see LimitedForce
      Along<Real, D> force, velocity;    ///< f_r with its dashpot, v_r
      typename Twisting::Answer twisted;
    };

    static RVE_INLINE History seen_from_partner(const History &h)
    {
      if constexpr (D == 2) return {-h.rolling};
      return h;
    }
    static RVE_INLINE History turned(const History &h, const Tensor3 &rotation)
    {
      return {along_turned(h.rolling, rotation), h.twisting};
    }
    static RVE_INLINE History in_units(const History &h, double force, double length)
    {
      if constexpr (D == 2)
        return {Spring(force) * h.rolling};
      else
        return {Spring(force) * h.rolling, Spring(force * length) * h.twisting};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      History h;
      h.rolling = in_numbers<Spring>(pair.rolling_force);
      if constexpr (D == 3) h.twisting = Spring(pair.twisting_moment);
      return h;
    }
    template <class Pair> static void to_pair(const History &h, Pair &pair)
    {
      pair.rolling_force = in_numbers<double>(h.rolling);
      if constexpr (D == 3) pair.twisting_moment = double(h.twisting);
    }

    template <class Constants> RVE_INLINE void take(const Constants &given)
    {
      const auto &k = given.rolling;
      rolling = {decltype(rolling.stiffness)(k.stiffness), k.friction, k.viscosity};
      if constexpr (D == 3) {
        const auto &q = given.twisting;
        twisting = {{q.stiffness, q.friction, q.viscosity}, given.twists_by_friction};
      }
    }

    RVE_INLINE void add_stiffness(const ContactPlace &place, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = double(rolling.stiffness);
      if constexpr (D == 3)
        moduli.twisting =
            twisting.modulus(moduli.tangential, double(twisting.given.stiffness), place);
    }
    /// `dashpots` has the tangential one already, as the moduli have above.
    RVE_INLINE void add_viscosity(const ContactPlace &place, ContactModuli &dashpots) const
    {
      if (rolling.friction > Real(0)) dashpots.rolling = double(rolling.viscosity);
      if constexpr (D == 3)
        dashpots.twisting =
            twisting.modulus(dashpots.tangential, double(twisting.given.viscosity), place);
    }

    template <class Law, class Force>
    RVE_INLINE Answer advance(const Law &law, const Force &force, const History &history,
                              const ContactGeometry<Real, D> &contact,
                              const GrainContact<Real, D> &moving, const GrainMotion<Real, D> &i,
                              const GrainMotion<Real, D> &j, Real limiting_force, Real dt) const
    {
      const Vec<Real, D> &n = contact.normal;
      const Real reduced_radius = reduced(i.radius, j.radius);
      const Spin<Real, D> turning = j.spin - i.spin;
      Answer answer;
      if constexpr (D == 2)
        answer.velocity = reduced_radius * turning;
      else
        answer.velocity = reduced_radius * cross(turning, n);
      const auto rolled = rolling.advance(moving.turned(history.rolling, n, dt), answer.velocity,
                                          limiting_force, dt);
      answer.force = rolled.force;
      answer.history.rolling = rolled.spring;
      answer.slipped = rolled.slipped;
      if constexpr (D == 2) {
        answer.moment = reduced_radius * rolled.force;
      } else {
        answer.twisted = twisting.advance(law, force, history.twisting, contact.overlap,
                                          reduced_radius, dot(turning, n), limiting_force, dt);
        answer.history.twisting = answer.twisted.history;
        answer.moment = reduced_radius * cross(n, rolled.force) + answer.twisted.moment * n;
      }
      return answer;
    }

    /// A component of the moment, with reduced radii that are below half an internal length: of disks at most this, of spheres twice this.
    static RVE_INLINE Real largest(const Answer &turned)
    {
      const Real rolling = Real(Spring(0.5) * magnitude(turned.history.rolling));
      if constexpr (D == 3) return larger(rolling, Real(fabs(turned.twisted.moment)));
      return rolling;
    }

    template <class Law>
    RVE_INLINE void dissipate(const Law &law, const ContactGeometry<Real, D> &contact,
                              const Answer &turned, double normal_velocity, double dt,
                              Dissipation &heat) const
    {
      dissipate_spring(turned.force, turned.history.rolling, turned.slipped, turned.velocity,
                       double(rolling.stiffness), double(rolling.viscosity), dt, heat);
      if constexpr (D == 3)
        twisting.dissipate(law, double(contact.overlap), turned.twisted, normal_velocity, dt, heat);
    }

    RVE_INLINE double elastic_energy(const Answer &turned) const
    {
      const double of_rolling = energy_of_rolling(turned.history);
      if constexpr (D == 3) return of_rolling + twisting.elastic_energy(turned.twisted);
      return of_rolling;
    }
    RVE_INLINE double released(const History &h) const
    {
      if constexpr (D == 3) return energy_of_rolling(h) + twisting.released(h.twisting);
      return energy_of_rolling(h);
    }

   private:
    RVE_INLINE double energy_of_rolling(const History &h) const
    {
      return energy_of_spring(h.rolling, double(rolling.stiffness));
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
      TurningConstants<typename Contact::Numbers::Scalar, Contact::D> {
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Of = MaterialNumbers;
      Contact::Constants::set(parameters, units, arm);
      this->rolling.set(units.internal<&Of::rolling_stiffness>(parameters),
                        units.internal<&Of::rolling_friction>(parameters),
                        units.internal<&Of::rolling_viscosity>(parameters));
      if constexpr (Contact::D == 3) {
        this->twisting.set(units.internal<&Of::twisting_stiffness>(parameters),
                           units.internal<&Of::twisting_friction>(parameters),
                           units.internal<&Of::twisting_viscosity>(parameters));
        this->twists_by_friction = parameters.twisting_marshall;
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
    static RVE_INLINE History seen_from_partner(const History &h)
    {
      return {Contact::seen_from_partner(h.contact), Resistance::seen_from_partner(h.turning)};
    }
    /// As of LinearFrictionLaw.
    static RVE_INLINE History turned(const History &h, const Tensor3 &rotation)
    {
      return {Contact::turned(h.contact, rotation), Resistance::turned(h.turning, rotation)};
    }
    static RVE_INLINE History between_looks(const History &h)
    {
      return {Contact::between_looks(h.contact), h.turning};
    }
    static RVE_INLINE Along<Spring, D> tangential_force(const History &h)
    {
      return Contact::tangential_force(h.contact);
    }
    static RVE_INLINE History in_units(const History &h, double force, double length)
    {
      return {Contact::in_units(h.contact, force, length),
              Resistance::in_units(h.turning, force, length)};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {Contact::of_pair(pair), Resistance::of_pair(pair)};
    }
    template <class Pair> static void to_pair(const History &h, Pair &pair)
    {
      Contact::to_pair(h.contact, pair);
      Resistance::to_pair(h.turning, pair);
    }

    Resistance resistance;

    RVE_INLINE void take(const Constants &given)
    {
      Contact::take(given);
      resistance.take(given);
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

    RVE_INLINE void dissipate(const ContactGeometry<Real, D> &contact, const Force &force, Real dt,
                              Dissipation &heat) const
    {
      Contact::dissipate(contact, force, dt, heat);
      resistance.dissipate(static_cast<const Contact &>(*this), contact, force.turned,
                           double(force.normal_velocity), double(dt), heat);
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      return Contact::elastic_energy(contact, force) + resistance.elastic_energy(force.turned);
    }
    RVE_INLINE double released(const History &h) const
    {
      return Contact::released(h.contact) + resistance.released(h.turning);
    }
    RVE_INLINE double twisting_share(const ContactPlace &place) const
    {
      return resistance.twisting.by_friction > Real(0)
          ? Contact::share_at(place.overlap / reduced(place.radius_i, place.radius_j))
          : 1.0;
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
