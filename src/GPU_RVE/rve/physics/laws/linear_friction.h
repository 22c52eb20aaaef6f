// SPDX-License-Identifier: GPL-2.0-only
// Linear springs with friction: f_n = k_n d - gamma_n v_n, |f_t| <= mu |f_n|, df_t = k_t v_t dt,
// with the overlap d and the normal and tangential velocities v_n and v_t. A dashpot gamma_t v_t is
// parallel to the tangential spring.

#pragma once

#include "rve/physics/laws/grain_contact.h"
#include "rve/physics/laws/rolling_friction.h"
#include "rve/physics/material.h"

namespace rve {
inline namespace RVE_ISA {

  /// Parameters of the linear laws in internal units. All linear laws have the same struct, so that
  /// the same code prepares their calls.
  template <class Numbers> struct alignas(16) LinearConstants {
    typename Numbers::Spring tangential_stiffness;
    typename Numbers::Real normal_stiffness, friction;
    typename Numbers::Real dt;    ///< time step; if zero, the history is not advanced [time]
    typename Numbers::Real normal_viscosity, tangential_viscosity, velocity_arm;

    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Real = typename Numbers::Real;
      using Of = MaterialNumbers;
      normal_stiffness = Real(units.internal<&Of::normal_stiffness>(parameters));
      normal_viscosity = Real(units.internal<&Of::normal_viscosity>(parameters));
      tangential_stiffness =
          typename Numbers::Spring(units.internal<&Of::tangential_stiffness>(parameters));
      friction = Real(units.internal<&Of::friction>(parameters));
      tangential_viscosity = Real(units.internal<&Of::tangential_viscosity>(parameters));
      velocity_arm = Real(arm);
    }
  };

  /// Linear springs and Coulomb friction, for disks or spheres, in a number format.
  ///
  /// With Damped the law has dashpots, and its own lever arm for the surface velocity
  /// (VelocityArms). With Frictional the law has friction; otherwise the friction coefficient is
  /// zero.
  template <class NumberFormat, bool Damped, bool Frictional = true, int Dimension = 2>
  struct LinearFrictionLaw : TouchingGrains {
    using Numbers = NumberFormat;
    static constexpr int D = Dimension;
    using Real = typename Numbers::Real;
    using Spring = typename Numbers::Spring;
    using History = Along<Spring, D>;    ///< tangential force
    using Force = ContactForce<Real, Spring, D>;
    using Constants = LinearConstants<typename Numbers::Scalar>;
    static constexpr ContactLaw contact_law = ContactLaw::Linear;
    static constexpr bool has_friction = Frictional;
    static constexpr bool has_rolling = false;
    static constexpr bool is_damped = Damped;
    static constexpr bool has_rescaling = false;
    static constexpr bool has_constant_moduli = true;
    static constexpr bool bounds_tangential_forces = true;

    /// The same law in another number format.
    template <class OtherNumbers> using In = LinearFrictionLaw<OtherNumbers, Damped, Frictional, D>;

    static RVE_INLINE History seen_from_partner(const History &h) { return along_from_partner(h); }
    /// Returns the history of a pair after a rigid rotation of the RVE, in space.
    static RVE_INLINE History turned(const History &h, const Tensor3 &rotation)
    {
      return along_turned(h, rotation);
    }
    /// Returns the stored tangential force on the first grain [force].
    static RVE_INLINE History tangential_force(const History &h) { return h; }
    static RVE_INLINE History in_units(const History &h, double force, double)
    {
      return Spring(force) * h;
    }
    static RVE_INLINE const History &history_for_steps(const History &h) { return h; }
    template <class Pair> static History of_pair(const Pair &pair)
    {
      return in_numbers<Spring>(pair.tangential_force);
    }
    template <class Pair> static void to_pair(const History &h, Pair &pair)
    {
      pair.tangential_force = in_numbers<double>(h);
    }

    Constants constants;

    RVE_INLINE void take(const Constants &given) { constants = given; }

    RVE_INLINE double spring_force(const ContactSite &site) const
    {
      return double(constants.normal_stiffness) * site.overlap;
    }
    RVE_INLINE double force_scale(const ContactSite &site) const { return spring_force(site); }
    RVE_INLINE double limiting_force(const ContactSite &site) const { return spring_force(site); }
    static RVE_INLINE Real limiting_force(const Force &force) { return force.normal_force; }
    RVE_INLINE ContactModuli stiffness(const ContactSite &) const
    {
      return {double(constants.normal_stiffness), slides() ? double(shear().stiffness) : 0.0, 0.0};
    }
    RVE_INLINE ContactModuli viscosity(const ContactSite &) const
    {
      if constexpr (!Damped) return {0.0, 0.0, 0.0};
      return {double(constants.normal_viscosity), slides() ? double(shear().viscosity) : 0.0, 0.0};
    }
    template <class Parameters>
    static RVE_INLINE bool has_normal_dashpot(const Parameters &parameters)
    {
      return parameters.normal_viscosity != 0.0;
    }

    RVE_INLINE Force answer(const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &,
                            const GrainMotion<Real, D> &, const GrainContact<Real, D> &moving,
                            const History &held, Real dt) const
    {
      Real normal_force = Real(constants.normal_stiffness) * contact.overlap;
      if constexpr (Damped)
        normal_force = normal_force - Real(constants.normal_viscosity) * moving.normal_velocity;
      Force result;
      if constexpr (Frictional) {
        const auto before = moving.turned(held, contact.normal, dt);
        moving.apply(contact.normal, normal_force,
                     shear().advance(before, moving.tangential_velocity, normal_force, dt), result);
      } else {
        result.normal_velocity = moving.normal_velocity;
        result.tangential_velocity = moving.tangential_velocity;
        result.normal_force = normal_force;
        result.force = -normal_force * contact.normal;
        result.tangential = result.torque_i = result.torque_j = Along<Real, D>();
        result.spring = result.slipped = History();
        result.sliding = Spring(0) >= Spring(0);    // at the limit, which is zero
      }
      return result;
    }

    static RVE_INLINE Real largest(const Force &force, Real so_far)
    {
      return larger(so_far, magnitude(force.tangential));
    }

    RVE_INLINE void dissipate(const ContactGeometry<Real, D> &, const Force &force, Real dt,
                              Dissipation &dissipated) const
    {
      const double vn = force.normal_velocity;
      if constexpr (Damped)
        dissipated.viscous += double(constants.normal_viscosity) * vn * vn * double(dt);
      if constexpr (Frictional)
        dissipate_spring(force.tangential, force.spring, force.slipped, force.tangential_velocity,
                         double(shear().stiffness), Damped ? double(shear().viscosity) : 0.0,
                         double(dt), dissipated);
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      return double(Real(0.5) * constants.normal_stiffness * contact.overlap * contact.overlap) +
          released(force.spring);
    }
    RVE_INLINE double released(const History &h) const
    {
      return energy_of_spring(h, double(shear().stiffness));
    }

    RVE_INLINE SlidingResistance<Real> sliding_resistance(const Force &) const
    {
      return {Real(shear().stiffness), shear().viscosity, shear().friction};
    }
    /// Returns the product of the tangential stiffness and a^2 at a relative depth d/R, divided by
    /// its value at d/R = 1. a is the radius of the contact area, a^2 = R d.
    template <class Number> static RVE_INLINE Number share_at(Number depth) { return depth; }

   private:
    using Shear = TangentialSpring<Real, Spring, Damped, D>;

    RVE_INLINE Shear shear() const
    {
      return {decltype(Shear::stiffness)(constants.tangential_stiffness), Real(constants.friction),
              Real(constants.tangential_viscosity)};
    }
    /// Returns false without friction: no tangential force acts then.
    RVE_INLINE bool slides() const { return Frictional && constants.friction > 0; }
  };

  /// Laws that kernels are compiled for (engine/kernel_variants.h).
  template <class Numbers> using NormalSprings = LinearFrictionLaw<Numbers, false, false>;
  template <class Numbers> using FrictionalSprings = LinearFrictionLaw<Numbers, false>;
  template <class Numbers> using DampedSprings = LinearFrictionLaw<Numbers, true>;
  template <class Numbers> using RollingSprings = WithRolling<DampedSprings<Numbers>>;
  template <class Numbers>
  using FrictionalSphereSprings = LinearFrictionLaw<Numbers, false, true, 3>;
  template <class Numbers> using SphereSprings = LinearFrictionLaw<Numbers, true, true, 3>;
  template <class Numbers> using SphereRollingSprings = WithRolling<SphereSprings<Numbers>>;

}    // namespace RVE_ISA
}    // namespace rve
