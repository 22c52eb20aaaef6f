// SPDX-License-Identifier: GPL-2.0-only
// What a contact law is, and what all laws share.
//
// A law is a struct in a number format, in the internal units of a call (algorithm/call_state.h). It holds its parameters and nothing
// else: what a pair remembers comes in and goes out. The block program is compiled for it (engine/programs.h). It has
//
//   Numbers                    the number format; In<OtherNumbers>: the same law in another one, for packs of grains
//   D                          the dimension of space: 2 for disks, 3 for spheres
//   Constants                  its parameters in the units of a call, single numbers also in a law for packs; set(parameters, units, arm)
//                              makes them from the material of an RVE, with the powers of the units that each one has
//   take(constants)            fills the law from them
//   History                    what a pair remembers, as its first grain sees it: a number, or a struct of numbers, which is zero as it is
//                              made. seen_from_partner(history): as its other grain sees it; in_units(history, force, length): with each
//                              number multiplied by its unit; of_pair, to_pair: what a Pair of engine/state.h has of it; of
//                              spheres turned(history, rotation): after a rigid rotation of the RVE
//   between_looks(history)     what has to be remembered from step to step: a part that no step asks for is zero, until the last look of a
//                              call
//   tangential_force(history)  on the first grain
//   contact_law                of which materials it is (physics/material.h)
//   has_friction, has_rolling, has_rescaling, is_damped
//                              what it has, so that programs leave out what needs it
//   has_reach, reach(parameters), acts(contact)
//                              how far beyond touching there are forces [length], and whether there are any: TouchingGrains for laws whose
//                              forces end where the grains part. What a pair remembers always ends there
//   answer(contact, i, j, moving, history, dt)
//                              the force: a ContactForce or a struct that begins as one; `moving` is how the grains move at their
//                              contact. dt of zero evaluates again without advancing the history. Exchanging the grains changes signs
//                              and nothing else, to the last bit. evaluate() of grain_contact.h calls it
//   largest(force, so_far)     the largest of its forces, where the normal one does not bound the others
//   dissipate(contact, force, dt, heat)
//                              adds the energy that a step of the contact turned into heat
//   elastic_energy(contact, force)
//                              energy that its springs hold
//   released(history)          what is lost of it when the contact opens: that of the springs that a pair remembers
//   spring_force(place)        normal force of its springs alone: for the least force of a crushed contact, and whoever looks at a state
//                              without an engine
//   force_scale(place)         the size of the forces that make it up, which may cancel: for the unit of forces
//   limiting_force(place), limiting_force(force)
//                              of which friction allows a share: at rest, and where evaluate answered with that force
//   stiffness(place), viscosity(place)
//                              of its springs and dashpots for small motions about where it is: for the time step and the affine
//                              stiffness; has_constant_moduli where they depend on no place
//   bounds_tangential_forces   whether they are at most friction times the normal force; else all forces count for the unit of forces
//   has_normal_dashpot(parameters)
//
// No transcendental function is called, since the libraries of CPU and GPU differ in the last bit; sums of two products that are
// symmetric in the grains are written as such, not as fused operations, whose rounding has an order.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"
#include "rve/physics/material.h"

namespace rve {
inline namespace RVE_ISA {

  /// Motion of one grain as a contact sees it.
  template <class Real, int D> struct GrainMotion {
    Vec<Real, D> velocity;    ///< peculiar [length/time]
    Spin<Real, D> spin;       ///< counter-clockwise [1/time]
    Real radius;              ///< [length]
  };
  template <class Real> using DiskMotion = GrainMotion<Real, 2>;
  template <class Real> using SphereMotion = GrainMotion<Real, 3>;

  /// What lies along a contact: in the plane a number along t = (-n_y, n_x), in space a vector across the normal.
  template <class T, int D> using Along = Spin<T, D>;

  /// What a law answers. A contact with more springs has a struct that begins with this one.
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

  /// Units of a call in those of the script: one length [length], and forces of it in one [1/force]. Times are those of the script.
  struct LawUnits {
    double length, per_force;

    /// Of the script.
    static RVE_INLINE constexpr LawUnits same() { return {1.0, 1.0}; }

    /// A parameter of a material in these units. Which powers of them it has, the table of parameters says.
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

  /// Of a law whose grains act on each other while they touch.
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

  /// Where two grains are to each other, as far as the moduli of a contact depend on it [length].
  struct ContactPlace {
    double overlap, radius_i, radius_j;
  };

  /// Guess of the deepest contact that a packing without contacts will have, as an overlap over the mean radius. A wrong guess costs
  /// accuracy of the first contacts or a repeat of the call, never a wrong force.
  constexpr double kGasOverlapShare = 1e-3;

  /// Springs of a contact [force/length], or dashpots [force time/length]: along the normal, along the contact, against the rolling
  /// displacement, and of spheres against the twisting one, the angle times the reduced radius. Those that can carry nothing are zero.
  struct ContactModuli {
    double normal, tangential, rolling, twisting = 0.0;

    RVE_INLINE double largest() const
    {
      const double most = larger(normal, tangential);
      return larger(most, larger(rolling, twisting));
    }
  };

  /// x y / (x + y), of radii or masses.
  template <class Number> RVE_INLINE Number reduced(Number x, Number y)
  {
    return x * y * reciprocal(x + y);
  }

  /// What lies along a contact in another number format.
  template <class To, class T> RVE_INLINE To in_numbers(T x)
  {
    return static_cast<To>(x);
  }
  template <class To, class T> RVE_INLINE Vec<To, 3> in_numbers(const Vec<T, 3> &x)
  {
    return x.template as<To>();
  }

  /// Magnitude of what lies along a contact, and of a vector its largest component: sums are kept by components.
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

  /// Energy that contacts turned into heat [internal force length].
  struct Dissipation {
    double friction, viscous;
  };

  /// Energy of a spring under a force [force length]; zero without stiffness.
  template <class Force> RVE_INLINE double energy_of_spring(const Force &spring, double stiffness)
  {
    const auto force = in_numbers<double>(spring);
    return stiffness > 0.0 ? 0.5 * product(force, force) / stiffness : 0.0;
  }

  /// Adds that of a spring with a limit, and of the dashpot beside it, in a step of dt: of the force, the part that the spring carries, and what
  /// the limit took. What slides dissipates as much as the limit took from the spring, and the dashpot; without a spring, what the
  /// velocity says. A dashpot that helps a spring over the limit, or stops to, lets it jump: then its energy changes by more than what the
  /// force now does on the way.
  template <class Force, class Spring>
  RVE_INLINE void dissipate_spring(const Force &force_now, const Spring &spring_now,
                                   const Spring &slipped_now, const Force &velocity_now,
                                   double stiffness, double viscosity, double dt, Dissipation &heat)
  {
    const auto force = in_numbers<double>(force_now), spring = in_numbers<double>(spring_now),
               slipped = in_numbers<double>(slipped_now),
               velocity = in_numbers<double>(velocity_now);
    if (stiffness > 0.0) {
      heat.friction += product(spring, slipped) / stiffness;
      heat.viscous += product(viscosity * velocity, velocity) * dt;
      if (viscosity > 0.0 && product(slipped, slipped) > 0.0) {
        const auto jump = (stiffness * dt) * velocity - slipped;
        heat.friction += 0.5 * product(jump, jump) / stiffness;
      }
    } else {
      heat.friction += product(force, velocity) * dt;
    }
  }

  /// What resists the sliding of a contact: a spring and a dashpot, up to a share of the limiting force.
  template <class Real> struct SlidingResistance {
    Real stiffness;    ///< [force/length]
    Real viscosity;    ///< [force time/length]
    Real friction;     ///< [-]
  };

}    // namespace RVE_ISA
}    // namespace rve
