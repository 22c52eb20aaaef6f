// SPDX-License-Identifier: GPL-2.0-only
// Resistance to rolling and, for spheres, to twisting: moments against the relative rotation of two
// grains, in addition to any contact law.
//
// The law is that of LAMMPS' `pair granular ... rolling sds k_roll gamma_roll mu_roll twisting sds
// k_twist gamma_twist mu_twist`, after Luding (2008), "Cohesive, frictional powders: contact models
// for tension", Granular Matter 10, 235-246: a spring with a parallel dashpot and a limit for a
// "pseudo-force". Only the moment of this force acts on the grains. A second law of twisting is
// `twisting marshall`, after Marshall (2009), "Discrete-element modeling of particulate aerosol
// flows", J. Comput. Phys. 228, 1541-1561.

#pragma once

#include "rve/physics/laws/grain_contact.h"

namespace rve {
inline namespace RVE_ISA {

  /// Constants of a spring with a dashpot and a friction limit. If the stiffness is zero, the
  /// friction is set to zero; if the friction is zero, the viscosity is set to zero.
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

  /// Constants k_r, mu_r, gamma_r and, for spheres, k_q, mu_q, gamma_q.
  template <class Numbers, int D> struct TurningConstants {
    SpringConstants<Numbers> rolling;
  };
  template <class Numbers> struct TurningConstants<Numbers, 3> {
    SpringConstants<Numbers> rolling, twisting;
    typename Numbers::Real twists_by_friction;    ///< 1: after Marshall, 0: not
  };

  /// History of the rotation resistance of a pair.
  template <class Number, int D> struct TurningHistory {
    Number rolling;    ///< f_r [force]
  };
  template <class Number> struct TurningHistory<Number, 3> {
    Vec<Number, 3> rolling;    ///< f_r, across the normal [force]
    Number twisting;           ///< moment on the first grain along the normal [force length]
  };

  /// Twisting resistance of two spheres. The twisting velocity is w_q = (w_j - w_i) . n, with the
  /// spins w and the normal n. The moment m_q along the normal changes in a step by m_q <- m_q +
  /// k_q w_q dt, and a parallel dashpot adds gamma_q w_q. The moment is at most mu_q times the
  /// force that limits friction. If the grains are exchanged, m_q does not change.
  ///
  /// After Marshall, friction over the contact area of radius a resists twisting (equations 30, 32
  /// and 44): k_q = k_t a^2/2, gamma_q = gamma_t a^2/2 and mu_q = 2/3 mu a, with a^2 = R d for the
  /// reduced radius R and the overlap d. The current moment grows with k_t a^2. The history
  /// therefore stores the moment that the twisting angle would cause at a relative depth d/R of
  /// one; the current moment is `share` times the stored one.
  template <class Real, class Spring> struct TwistingResistance {
    using Moment = LinearTangential<Real, Spring, true>;

    /// Constants k_q [force length], mu_q [length] and gamma_q [force length time].
    Moment given;
    Real by_friction;    ///< 1: after Marshall

    struct Answer {
      Moment spring;            ///< spring of this contact
      Real share;               ///< current moment divided by the moment in the history
      Real moment, velocity;    ///< moment on grain i along n [force length], and w_q
      Spring history, slipped;
    };

    /// Returns the twisting modulus divided by the squared reduced radius. `tangential` is k_t or
    /// gamma_t of the contact, `twisting` is k_q or gamma_q.
    RVE_INLINE double modulus(double tangential, double twisting, const ContactSite &site) const
    {
      const double reduced_radius = reduced(site.radius_i, site.radius_j);
      if (by_friction > Real(0)) return 0.5 * tangential * (site.overlap / reduced_radius);
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

    /// Adds the dissipation of a step. If the contact area grows or shrinks, the energy of the
    /// spring changes. The loss of this energy counts as friction; it can be negative.
    template <class Law>
    RVE_INLINE void dissipate(const Law &law, double overlap, const Answer &twisted,
                              double normal_velocity, double dt, Dissipation &dissipated) const
    {
      Dissipation of_spring{0.0, 0.0};
      dissipate_spring(twisted.moment, twisted.history, twisted.slipped, twisted.velocity,
                       double(twisted.spring.stiffness), double(twisted.spring.viscosity), dt,
                       of_spring);
      dissipated.friction += double(twisted.share) * of_spring.friction;
      dissipated.viscous += double(twisted.share) * of_spring.viscous;
      if (by_friction > Real(0)) {
        const double before = larger(0.0, overlap + normal_velocity * dt);
        dissipated.friction += (law.share_at(before / overlap) - 1.0) * elastic_energy(twisted);
      }
    }
    RVE_INLINE double elastic_energy(const Answer &twisted) const
    {
      return double(twisted.share) *
          energy_of_spring(twisted.history, double(twisted.spring.stiffness));
    }
    /// Returns the energy that is lost when the contact opens. After Marshall the resistance
    /// vanishes with the contact area, and its energy has been dissipated before.
    RVE_INLINE double released(Spring history) const
    {
      return by_friction > Real(0) ? 0.0 : energy_of_spring(history, double(given.stiffness));
    }

   private:
    /// Returns the spring that advances the history: the current spring divided by `share`.
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

  /// Resistance of two grains to rolling, and of two spheres to twisting. For two disks, the
  /// rolling velocity is v_r = R (w_j - w_i), with the spins w and the reduced radius R = r_i r_j /
  /// (r_i + r_j). The rolling force f_r changes in a step by f_r <- f_r + k_r v_r dt, and a
  /// parallel dashpot adds gamma_r v_r. The force is at most mu_r times the force that limits
  /// friction; it is limited in the same way as the force of the tangential spring. The moments are
  /// R f_r on grain i and -R f_r on grain j; no force acts on the grains. A rigid rotation has
  /// equal spins and no rolling velocity. If the grains are exchanged, v_r and f_r change sign
  /// exactly.
  ///
  /// For two spheres, v_r = R (w_j - w_i) x n is perpendicular to the normal n, and f_r turns with
  /// the contact. The moment on grain i is the sum of R n x f_r and the moment of the twisting
  /// resistance. If the grains are exchanged, f_r does not change, since the relative spin and the
  /// normal both change sign.
  template <class Real, class Spring, int D> struct TurningResistance {
    using History = TurningHistory<Spring, D>;
    using Twisting = std::conditional_t<D == 3, TwistingResistance<Real, Spring>, NoTwisting>;

    /// Constants k_r [force/length], mu_r [-] and gamma_r [force time/length].
    TangentialSpring<Real, Spring, true, D> rolling;
    Twisting twisting;

    struct Answer {
      Spin<Real, D> moment;              ///< on grain i; grain j gets the opposite [force length]
      History history;                   ///< new history
      Along<Spring, D> slipped;          ///< see LimitedForce
      Along<Real, D> force, velocity;    ///< f_r with its dashpot, and v_r
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

    RVE_INLINE void add_stiffness(const ContactSite &site, ContactModuli &moduli) const
    {
      if (rolling.friction > Real(0)) moduli.rolling = double(rolling.stiffness);
      if constexpr (D == 3)
        moduli.twisting =
            twisting.modulus(moduli.tangential, double(twisting.given.stiffness), site);
    }
    /// Adds the viscosities of rolling and twisting to `dashpots`, which must have the tangential
    /// viscosity.
    RVE_INLINE void add_viscosity(const ContactSite &site, ContactModuli &dashpots) const
    {
      if (rolling.friction > Real(0)) dashpots.rolling = double(rolling.viscosity);
      if constexpr (D == 3)
        dashpots.twisting =
            twisting.modulus(dashpots.tangential, double(twisting.given.viscosity), site);
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

    /// Returns a number that bounds the components of the moment. For disks they are at most this
    /// number, and for spheres at most twice this number. Reduced radii are below half an internal
    /// length.
    static RVE_INLINE Real largest(const Answer &turned)
    {
      const Real rolling = Real(Spring(0.5) * magnitude(turned.history.rolling));
      if constexpr (D == 3) return larger(rolling, Real(fabs(turned.twisted.moment)));
      return rolling;
    }

    template <class Law>
    RVE_INLINE void dissipate(const Law &law, const ContactGeometry<Real, D> &contact,
                              const Answer &turned, double normal_velocity, double dt,
                              Dissipation &dissipated) const
    {
      dissipate_spring(turned.force, turned.history.rolling, turned.slipped, turned.velocity,
                       double(rolling.stiffness), double(rolling.viscosity), dt, dissipated);
      if constexpr (D == 3)
        twisting.dissipate(law, double(contact.overlap), turned.twisted, normal_velocity, dt,
                           dissipated);
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

  /// History of a pair with rolling resistance.
  template <class ContactHistory, class Turning> struct RollingHistory {
    ContactHistory contact;    ///< history of the law without rolling resistance
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

  /// Contact law with resistance to rolling, and to twisting in space. With coefficients of zero
  /// its results have the same bits as those of the law without resistance.
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

    /// Returns the history as the second grain sees it; the moments on the two grains are opposite.
    static RVE_INLINE History seen_from_partner(const History &h)
    {
      return {Contact::seen_from_partner(h.contact), Resistance::seen_from_partner(h.turning)};
    }
    /// Rotates a history as LinearFrictionLaw::turned() does.
    static RVE_INLINE History turned(const History &h, const Tensor3 &rotation)
    {
      return {Contact::turned(h.contact, rotation), Resistance::turned(h.turning, rotation)};
    }
    static RVE_INLINE History history_for_steps(const History &h)
    {
      return {Contact::history_for_steps(h.contact), h.turning};
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

    RVE_INLINE ContactModuli stiffness(const ContactSite &site) const
    {
      ContactModuli moduli = Contact::stiffness(site);
      if (touches(site)) resistance.add_stiffness(site, moduli);
      return moduli;
    }
    RVE_INLINE ContactModuli viscosity(const ContactSite &site) const
    {
      ContactModuli dashpots = Contact::viscosity(site);
      if (touches(site)) resistance.add_viscosity(site, dashpots);
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
                              Dissipation &dissipated) const
    {
      Contact::dissipate(contact, force, dt, dissipated);
      resistance.dissipate(static_cast<const Contact &>(*this), contact, force.turned,
                           double(force.normal_velocity), double(dt), dissipated);
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
    RVE_INLINE double twisting_share(const ContactSite &site) const
    {
      return resistance.twisting.by_friction > Real(0)
          ? Contact::share_at(site.overlap / reduced(site.radius_i, site.radius_j))
          : 1.0;
    }

   private:
    /// Returns whether the grains touch: only then they resist rotation.
    static RVE_INLINE bool touches(const ContactSite &site)
    {
      return !Contact::has_reach || site.overlap > 0.0;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
