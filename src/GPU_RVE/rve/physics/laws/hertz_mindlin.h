// SPDX-License-Identifier: GPL-2.0-only
// Hertz' normal contact and Mindlin's tangential contact of spheres, and of disks that touch like
// spheres of their radii.
//
// The law is that of LAMMPS' `pair granular hertz ... tangential mindlin`, `mindlin/force` and
// their variants `mindlin_rescale`. A contact of overlap d has the contact radius a = sqrt(R d),
// with the reduced radius R = r_i r_j / (r_i + r_j). Its normal force f_n and tangential force f_t
// are
//
//     f_n = k_n a d - gamma v_n,    |f_t| <= mu |f_n|,    df_t = k_t a v_t dt,
//
// with the normal velocity v_n, the tangential velocity v_t, and k_n = 4/3 E*, k_t = 8 G* of the
// effective elastic moduli (Johnson, Contact Mechanics, 1985, chapters 4 and 7). The dashpot is
//
//     gamma = gamma_n + eta m a + c sqrt(m k_n a),
//
// with the reduced mass m = m_i m_j / (m_i + m_j). Its three terms are LAMMPS' damping `velocity`,
// `viscoelastic` (Brilliantov et al. 1996, Phys. Rev. E 53, 5382) and `coeff_restitution`. With the
// third term alone, the restitution does not depend on the velocity (Tsuji et al. 1992, Powder
// Technol. 71, 239).

#pragma once

#include "rve/physics/grain_shape.h"
#include "rve/physics/laws/grain_contact.h"
#include "rve/physics/laws/rolling_friction.h"
#include "rve/physics/material.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// History of a pair.
  template <class Number, int D = 2> struct MindlinHistory {
    Along<Number, D> tangential;    ///< tangential force on the first grain [force]
    Number contact_radius;          ///< contact radius a at that force [length]
  };

  template <class Numbers, int D = 2> struct alignas(16) HertzConstants {
    typename Numbers::Spring tangential_stiffness;    ///< k_t [force/length^2]
    typename Numbers::Real normal_stiffness;          ///< k_n [force/length^2]
    typename Numbers::Real friction;
    typename Numbers::Real dt;    ///< time step; if zero, the history is not advanced [time]
    /// Coefficients of the dashpot gamma = velocity_damping + viscoelastic_damping m a +
    /// restitution_damping sqrt(m a). The unit of m is the mass of a grain of radius one.
    typename Numbers::Real velocity_damping, viscoelastic_damping, restitution_damping;
    typename Numbers::Real tangential_damping;    ///< gamma_t / gamma [-]
    typename Numbers::Real velocity_arm;
    typename Numbers::Real keeps_displacement;    ///< 1: mindlin, 0: mindlin/force
    typename Numbers::Real rescales;              ///< 1: mindlin_rescale, 0: not

    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Real = typename Numbers::Real;
      using Of = MaterialNumbers;
      normal_stiffness = Real(units.internal<&Of::hertz_stiffness>(parameters));
      tangential_stiffness =
          typename Numbers::Spring(units.internal<&Of::mindlin_stiffness>(parameters));
      friction = Real(units.internal<&Of::friction>(parameters));
      tangential_damping = Real(units.internal<&Of::mindlin_damping>(parameters));
      velocity_arm = Real(arm);
      const int kept = static_cast<int>(parameters.mindlin_displacement);
      keeps_displacement = Real(kept & 1);
      rescales = Real(kept >> 1);

      // These coefficients depend on the mass, which has no internal unit.
      const double length = units.length, viscosity_unit = length * units.per_force;
      const double mass_unit = times_power<D>(
          GrainShape<D>::volume * parameters.density * parameters.mass_depth, length);
      velocity_damping = Real(units.internal<&Of::normal_viscosity>(parameters));
      viscoelastic_damping =
          Real(parameters.viscoelastic_damping * mass_unit * length * viscosity_unit);
      restitution_damping =
          Real(parameters.restitution_damping *
               std::sqrt(mass_unit * parameters.hertz_stiffness * length) * viscosity_unit);
    }
  };

  template <class Real, class Spring, int D>
  struct MindlinContactForce : ContactForce<Real, Spring, D> {
    Real contact_radius;    ///< [length]
    Spring stiffness;       ///< k_t a [force/length]
    Real viscosity;         ///< gamma [force time/length]
    Real limiting_force;    ///< force that limits friction [force]
    /// Energy that the spring lost while the contact radius changed [force length].
    Real taken_by_area;

    RVE_INLINE MindlinHistory<Spring, D> history() const
    {
      return {this->spring, static_cast<Spring>(contact_radius)};
    }
  };

  /// Hertz-Mindlin contact. With Damped the law has dashpots, and its own lever arm for the surface
  /// velocity (VelocityArms). With Rescaling the springs change with the contact radius, as in all
  /// variants except `mindlin/force`. Without Rescaling, steps do not read the contact radius of
  /// the history, and only the last force evaluation of a call stores it.
  template <class NumberFormat, int Dimension = 2, bool Damped = true, bool Rescaling = true>
  struct HertzMindlin : TouchingGrains {
    using Numbers = NumberFormat;
    static constexpr int D = Dimension;
    using Real = typename Numbers::Real;
    using Spring = typename Numbers::Spring;
    using History = MindlinHistory<Spring, D>;
    using Force = MindlinContactForce<Real, Spring, D>;
    using Constants = HertzConstants<typename Numbers::Scalar, D>;
    static constexpr ContactLaw contact_law = ContactLaw::Hertz;
    static constexpr bool has_friction = true;
    static constexpr bool has_rolling = false;
    static constexpr bool is_damped = Damped;
    static constexpr bool has_rescaling = Rescaling;
    static constexpr bool has_constant_moduli = false;
    static constexpr bool bounds_tangential_forces = true;

    template <class OtherNumbers> using In = HertzMindlin<OtherNumbers, D, Damped, Rescaling>;

    static RVE_INLINE History seen_from_partner(const History &h)
    {
      return {along_from_partner(h.tangential), h.contact_radius};
    }
    /// Rotates a history as LinearFrictionLaw::turned() does.
    static RVE_INLINE History turned(const History &h, const Tensor3 &rotation)
    {
      return {along_turned(h.tangential, rotation), h.contact_radius};
    }
    static RVE_INLINE Along<Spring, D> tangential_force(const History &h) { return h.tangential; }
    static RVE_INLINE History in_units(const History &h, double force, double length)
    {
      return {Spring(force) * h.tangential, Spring(length) * h.contact_radius};
    }
    static RVE_INLINE History history_for_steps(const History &h)
    {
      return {h.tangential, Rescaling ? h.contact_radius : Spring(0)};
    }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return {in_numbers<Spring>(pair.tangential_force), Spring(pair.contact_radius)};
    }
    template <class Pair> static void to_pair(const History &h, Pair &pair)
    {
      pair.tangential_force = in_numbers<double>(h.tangential);
      pair.contact_radius = double(h.contact_radius);
    }

    Constants constants;

    RVE_INLINE void take(const Constants &given) { constants = given; }

    /// Returns the force of a contact without adhesion.
    RVE_INLINE Force answer(const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &i,
                            const GrainMotion<Real, D> &j, const GrainContact<Real, D> &moving,
                            const History &history, Real dt) const
    {
      Force result;
      Real normal_force = press(contact.overlap, i.radius, j.radius, result);
      if constexpr (Damped) normal_force = normal_force - result.viscosity * moving.normal_velocity;
      shear(contact, moving, normal_force, fabs(normal_force), history, dt, result);
      return result;
    }

    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(so_far, magnitude(force.tangential));
    }

    /// Adds the dissipation of a step. If a contact grows or shrinks, the energy of its spring
    /// changes. The loss of this energy counts as friction; it can be negative.
    RVE_INLINE void dissipate(const ContactGeometry<Real, D> &, const Force &force, Real dt,
                              Dissipation &dissipated) const
    {
      const double vn = force.normal_velocity;
      double tangential_viscosity = 0.0;
      if constexpr (Damped) {
        const double viscosity = double(force.viscosity);
        dissipated.viscous += viscosity * vn * vn * double(dt);
        tangential_viscosity = double(constants.tangential_damping) * viscosity;
      }
      dissipated.friction += double(force.taken_by_area);
      dissipate_spring(force.tangential, force.spring, force.slipped, force.tangential_velocity,
                       double(force.stiffness), tangential_viscosity, double(dt), dissipated);
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      const double k_n = double(constants.normal_stiffness), a = double(force.contact_radius),
                   d = double(contact.overlap);
      return 0.4 * k_n * a * d * d + energy_of_spring(force.spring, double(force.stiffness));
    }

    RVE_INLINE double released(const History &h) const
    {
      return energy_of_spring(h.tangential, k_t() * double(h.contact_radius));
    }

    RVE_INLINE SlidingResistance<Real> sliding_resistance(const Force &force) const
    {
      return {Real(force.stiffness), constants.tangential_damping * force.viscosity,
              constants.friction};
    }
    /// Returns the product of the tangential stiffness and a^2 at a relative depth d/R, divided by
    /// its value at d/R = 1. In this law the tangential stiffness also grows with the contact
    /// radius a.
    template <class Number> static RVE_INLINE Number share_at(Number depth)
    {
      return depth * std::sqrt(depth);
    }

    RVE_INLINE double spring_force(const ContactSite &site) const
    {
      return double(constants.normal_stiffness) * radius_at(site) * site.overlap;
    }
    RVE_INLINE double force_scale(const ContactSite &site) const { return spring_force(site); }
    RVE_INLINE double limiting_force(const ContactSite &site) const { return spring_force(site); }
    static RVE_INLINE Real limiting_force(const Force &force) { return force.limiting_force; }
    RVE_INLINE ContactModuli stiffness(const ContactSite &site) const
    {
      const double a = radius_at(site);
      return {1.5 * double(constants.normal_stiffness) * a, slides() ? k_t() * a : 0.0, 0.0};
    }
    RVE_INLINE ContactModuli viscosity(const ContactSite &site) const
    {
      if constexpr (!Damped) return {0.0, 0.0, 0.0};
      const double gamma = damping<double>(radius_at(site), site.radius_i, site.radius_j);
      return {gamma, slides() ? double(constants.tangential_damping) * gamma : 0.0, 0.0};
    }
    template <class Parameters>
    static RVE_INLINE bool has_normal_dashpot(const Parameters &parameters)
    {
      return parameters.normal_viscosity != 0.0 || parameters.viscoelastic_damping != 0.0 ||
          parameters.restitution_damping != 0.0;
    }

   protected:
    RVE_INLINE double radius_at(const ContactSite &site) const
    {
      return std::sqrt(reduced(site.radius_i, site.radius_j) * larger(site.overlap, 0.0));
    }

    RVE_INLINE bool slides() const { return constants.friction > 0; }

    RVE_INLINE double k_t() const { return double(constants.tangential_stiffness); }

    /// Returns gamma at a contact radius.
    template <class Number>
    RVE_INLINE Number damping(Number contact_radius, Number radius_i, Number radius_j) const
    {
      const Number mass = reduced(power<D>(radius_i), power<D>(radius_j));
      const Number product = mass * contact_radius;
      return Number(constants.velocity_damping) +
          (Number(constants.viscoelastic_damping) * product +
           Number(constants.restitution_damping) * std::sqrt(product));
    }

    /// Sets the contact radius and the numbers that depend on it. Returns the normal force of the
    /// spring.
    RVE_INLINE Real press(Real overlap, Real radius_i, Real radius_j, Force &result) const
    {
      const Real a = root(reduced(radius_i, radius_j) * overlap);
      result.contact_radius = a;
      result.stiffness = Spring(constants.tangential_stiffness) * Spring(a);
      if constexpr (Damped) result.viscosity = damping(a, radius_i, radius_j);
      return Real(constants.normal_stiffness) * a * overlap;
    }

    /// Computes the friction of a pressed contact: at most mu times `limiting_force`.
    RVE_INLINE void shear(const ContactGeometry<Real, D> &contact,
                          const GrainContact<Real, D> &moving, Real normal_force,
                          Real limiting_force, const History &history, Real dt, Force &result) const
    {
      const Spring before = history.contact_radius, a = Spring(result.contact_radius);
      // A kept displacement carries a larger force if the contact has grown; a kept force does not
      // change.
      Along<Spring, D> spring =
          sum_of_turned(moving.turned(history.tangential, contact.normal, dt));
      const bool keeps = Rescaling && constants.keeps_displacement > 0,
                 rescales = Rescaling && constants.rescales > 0;
      if (keeps || rescales) {
        const Spring growth = quotient(a, before);
        if (keeps) spring = select(before > Spring(0), growth, Spring(1)) * spring;
        if (rescales) spring = select(a < before, growth, Spring(1)) * spring;
      }
      // Energy bookkeeping evaluates single contacts, not packs.
      if constexpr (std::is_same_v<Truth<Real>, bool>) {
        const double stiffness_before = double(constants.tangential_stiffness * before);
        result.taken_by_area = Real(energy_of_spring(history.tangential, stiffness_before) -
                                    energy_of_spring(spring, double(result.stiffness)));
      }

      result.limiting_force = limiting_force;
      TangentialSpring<Real, Spring, Damped, D> tangential;
      tangential.stiffness = decltype(tangential.stiffness)(result.stiffness);
      tangential.friction = Real(constants.friction);
      if constexpr (Damped)
        tangential.viscosity = Real(constants.tangential_damping) * result.viscosity;
      moving.apply(contact.normal, normal_force,
                   tangential.advance(spring, moving.tangential_velocity, limiting_force, dt),
                   result);
    }
  };

  /// Laws that kernels are compiled for, in addition to HertzMindlin of disks.
  template <class Numbers> using UndampedHertz = HertzMindlin<Numbers, 2, false>;
  template <class Numbers> using RollingHertz = WithRolling<HertzMindlin<Numbers>>;
  template <class Numbers> using SphereHertzMindlin = HertzMindlin<Numbers, 3>;
  template <class Numbers> using SphereUndampedHertz = HertzMindlin<Numbers, 3, false>;
  template <class Numbers> using SphereMindlinForce = HertzMindlin<Numbers, 3, false, false>;
  template <class Numbers> using SphereRollingHertz = WithRolling<SphereHertzMindlin<Numbers>>;

}    // namespace RVE_ISA
}    // namespace rve
