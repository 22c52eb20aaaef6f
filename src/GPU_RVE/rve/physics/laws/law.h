// SPDX-License-Identifier: GPL-2.0-only
// Interface of contact laws, and code that all laws share.
//
// A law is a struct of parameters in one number format and in the internal units of a call
// (algorithm/call_state.h). It stores no other data: the history of a pair is an argument and part
// of the result. Kernels are compiled for each law (engine/kernel_variants.h). A law has these
// members:
//
//   Numbers                    number format; In<OtherNumbers> is the same law in another format,
//                              for packs of grains
//   D                          dimension of space: 2 for disks, 3 for spheres
//   Constants                  parameters in the units of a call, as single numbers even if the law
//                              has packs of numbers; set(parameters, units, arm) converts the
//                              material of an RVE, by the powers of force and length in the unit
//                              of each parameter
//   take(constants)            sets the parameters of the law
//   History                    history of a pair as its first grain sees it: a number, or a struct
//                              of numbers, which is initially zero
//   seen_from_partner(history) history as the second grain sees it
//   in_units(history, force, length)
//                              history with each number multiplied by its unit
//   of_pair, to_pair           conversion of a history from and to a Pair of engine/state.h
//   turned(history, rotation)  history after a rigid rotation of the RVE, for spheres
//   history_for_steps(history) history in which the numbers that no step reads are zero; the last
//                              force evaluation of a call sets them
//   tangential_force(history)  tangential force on the first grain
//   contact_law                ContactLaw of the materials for this law (physics/material.h)
//   has_friction, has_rolling, has_rescaling, is_damped
//                              properties of the law, so that kernels omit unneeded code
//   has_reach, reach(parameters), acts(contact)
//                              has_reach is true if forces act at a distance; reach() is the
//                              largest such distance [length]; acts() is true if forces act on a
//                              pair. Laws whose forces end where the grains separate take all three
//                              from TouchingGrains. With all laws the history of a pair is cleared
//                              where the grains separate
//   answer(contact, i, j, moving, history, dt)
//                              force: a ContactForce or a struct that begins with one; `moving` is
//                              the motion of the grains at their contact. dt = 0 evaluates without
//                              advancing the history. Exchanging the grains changes signs only, to
//                              the last bit. evaluate() of grain_contact.h calls it
//   largest(force, so_far)     maximum of so_far, the tangential force and the rolling force;
//                              needed if the normal force does not bound the other two
//   dissipate(contact, force, dt, dissipated)
//                              adds the energy that the contact dissipates in a step
//   elastic_energy(contact, force)
//                              elastic energy of the springs
//   released(history)          elastic energy of the springs in the history, which is lost when
//                              the contact opens
//   sliding_resistance(force)  SlidingResistance of the contact with this force. WithRolling of
//                              rolling_friction.h needs it and share_at() for spheres, and calls
//                              both with `twisting marshall`
//   share_at(depth)            product of the tangential stiffness and d R at a relative depth d/R,
//                              divided by its value at d/R = 1, where d is the overlap and R the
//                              reduced radius. The argument is a Real or a double
//   spring_force(site)        normal force of the springs alone: for the overlap limit, and for
//                              states without an engine
//   force_scale(site)         sum of the magnitudes of spring force and attraction, which have
//                              opposite signs: for the unit of forces
//   limiting_force(site), limiting_force(force)
//                              force that limits friction: of a site at rest, or of a result of
//                              evaluate()
//   stiffness(site), viscosity(site)
//                              moduli of springs and dashpots for small motions about a site: for
//                              the time step and the affine stiffness
//   has_constant_moduli        true if the moduli do not depend on the site
//   bounds_tangential_forces   true if tangential forces are at most friction times the normal
//                              force; otherwise all forces count for the unit of forces
//   has_normal_dashpot(parameters)
//                              true if the material has a normal dashpot
//
// Laws call no transcendental function, since the libraries of CPU and GPU differ in the last bit.
// A sum of two products, one for each grain, is not fused: fma() rounds only one of the products,
// so that the result would depend on the order of the grains.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"
#include "rve/physics/material.h"

namespace rve {
inline namespace RVE_ISA {

  /// Motion of one grain, for its contacts.
  template <class Real, int D> struct GrainMotion {
    Vec<Real, D> velocity;    ///< peculiar [length/time]
    Spin<Real, D> spin;       ///< counter-clockwise [1/time]
    Real radius;              ///< [length]
  };
  template <class Real> using DiskMotion = GrainMotion<Real, 2>;
  template <class Real> using SphereMotion = GrainMotion<Real, 3>;

  /// Tangential quantity of a contact: in the plane a number along t = (-n_y, n_x), in space a
  /// vector perpendicular to the normal.
  template <class T, int D> using Along = Spin<T, D>;

  /// Result of a law. The struct of a contact with more springs begins with this one.
  template <class Real, class Spring, int D = 2> struct ContactForce {
    Vec<Real, D> force;                    ///< on grain i; grain j gets the opposite [force]
    Spin<Real, D> torque_i;                ///< on grain i [force length]
    Spin<Real, D> torque_j;                ///< on grain j [force length]
    Real normal_force;                     ///< repulsion positive [force]
    Along<Real, D> tangential;             ///< on grain i [force]
    Along<Spring, D> spring;               ///< new history [force]
    Along<Spring, D> slipped;              ///< see LimitedForce
    Along<Real, D> tangential_velocity;    ///< [length/time]
    Real normal_velocity;                  ///< [length/time]
    Truth<Spring> sliding;

    RVE_INLINE Along<Spring, D> history() const { return spring; }
  };

  /// Internal units of a call, in units of the script: length [length], and reciprocal force
  /// [1/force]. Times have the unit of the script.
  struct LawUnits {
    double length, per_force;

    /// Returns the units of the script.
    static RVE_INLINE constexpr LawUnits same() { return {1.0, 1.0}; }

    /// Returns a parameter of a material in internal units. The table of parameters
    /// (physics/material.h) gives its powers of force and length.
    template <MaterialMember member, class Parameters>
    RVE_INLINE double internal(const Parameters &parameters) const
    {
      using Unit = UnitOf<member>;
      return parameters.*member *
          (times_integer_power<Unit::force>(per_force) *
           times_integer_power<-Unit::length>(length));
    }

   private:
    template <int exponent> static RVE_INLINE double times_integer_power(double x)
    {
      double product = 1.0;
      for (int k = 0; k < (exponent < 0 ? -exponent : exponent); ++k) product *= x;
      return exponent < 0 ? 1.0 / product : product;
    }
  };

  /// Base of laws whose grains act on each other only while they touch.
  struct TouchingGrains {
    static constexpr bool has_reach = false;

    template <class Parameters> static RVE_INLINE constexpr double reach(const Parameters &)
    {
      return 0.0;
    }
    template <class Contact> static RVE_INLINE auto acts(const Contact &contact)
    {
      return contact.overlap > decltype(contact.overlap)(0);
    }
  };

  /// Overlap and radii of two grains, on which the moduli of a contact depend [length].
  struct ContactSite {
    double overlap, radius_i, radius_j;
  };

  /// Estimate of the largest overlap in a packing that has no contacts yet, divided by the mean
  /// radius [-]. A wrong estimate costs accuracy of the first contacts or a repeat of the call, but
  /// gives no wrong force.
  constexpr double kGasOverlapShare = 1e-3;

  /// Moduli of the springs [force/length] or of the dashpots [force time/length] of a contact: in
  /// normal and tangential direction, against rolling, and for spheres against twisting. The
  /// twisting displacement is the twisting angle times the reduced radius. Directions without
  /// resistance have a modulus of zero.
  struct ContactModuli {
    double normal, tangential, rolling, twisting = 0.0;

    RVE_INLINE double largest() const
    {
      const double most = larger(normal, tangential);
      return larger(most, larger(rolling, twisting));
    }
  };

  /// Returns x y / (x + y) of two radii or masses.
  template <class Number> RVE_INLINE Number reduced(Number x, Number y)
  {
    return x * y * reciprocal(x + y);
  }

  /// Converts a tangential quantity to another number format.
  template <class To, class T> RVE_INLINE To in_numbers(T x)
  {
    return static_cast<To>(x);
  }
  template <class To, class T> RVE_INLINE Vec<To, 3> in_numbers(const Vec<T, 3> &x)
  {
    return x.template as<To>();
  }

  /// Returns the magnitude of a tangential number, or of the largest component of a vector, since
  /// the range of integer sums applies to each component.
  template <class T> RVE_INLINE T magnitude(T x)
  {
    return fabs(x);
  }
  template <class T> RVE_INLINE T magnitude(const Vec<T, 3> &x)
  {
    return larger(larger(fabs(x[0]), fabs(x[1])), fabs(x[2]));
  }

  RVE_INLINE double product(double x, double y)
  {
    return x * y;
  }
  RVE_INLINE double product(const Vec<double, 3> &x, const Vec<double, 3> &y)
  {
    return dot(x, y);
  }

  /// Energy that contacts dissipated [internal force length].
  struct Dissipation {
    double friction, viscous;
  };

  /// Returns the energy of a spring under a force [force length]; zero without stiffness.
  template <class Force> RVE_INLINE double energy_of_spring(const Force &spring, double stiffness)
  {
    const auto force = in_numbers<double>(spring);
    return stiffness > 0.0 ? 0.5 * product(force, force) / stiffness : 0.0;
  }

  /// Adds the dissipation of a limited spring with a parallel dashpot in a step of dt. `spring_now`
  /// is the part of the force in the spring and `slipped_now` the part above the limit. A sliding
  /// spring dissipates the product of its force and the slip, slipped_now / stiffness. The dashpot
  /// dissipates as well. If the stiffness is zero, the dissipation is force times velocity times
  /// dt. The spring force jumps when the dashpot begins or ceases to raise the total force above
  /// the limit. The energy of the spring then changes by more than the work of the current force.
  /// The last term is the difference.
  template <class Force, class Spring>
  RVE_INLINE void dissipate_spring(const Force &force_now, const Spring &spring_now,
                                   const Spring &slipped_now, const Force &velocity_now,
                                   double stiffness, double viscosity, double dt,
                                   Dissipation &dissipated)
  {
    const auto force = in_numbers<double>(force_now), spring = in_numbers<double>(spring_now),
               slipped = in_numbers<double>(slipped_now),
               velocity = in_numbers<double>(velocity_now);
    if (stiffness > 0.0) {
      dissipated.friction += product(spring, slipped) / stiffness;
      dissipated.viscous += product(viscosity * velocity, velocity) * dt;
      if (viscosity > 0.0 && product(slipped, slipped) > 0.0) {
        const auto jump = (stiffness * dt) * velocity - slipped;
        dissipated.friction += 0.5 * product(jump, jump) / stiffness;
      }
    } else {
      dissipated.friction += product(force, velocity) * dt;
    }
  }

  /// Resistance of a contact to sliding: spring, dashpot and friction coefficient.
  template <class Real> struct SlidingResistance {
    Real stiffness;    ///< [force/length]
    Real viscosity;    ///< [force time/length]
    Real friction;     ///< [-]
  };

}    // namespace RVE_ISA
}    // namespace rve
