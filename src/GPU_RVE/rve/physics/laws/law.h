// What a contact law is, and what all laws share.
//
// A law is a struct in a number format, in the internal units of a call (algorithm/call_state.h). It holds its parameters and nothing
// else: what a pair remembers comes in and goes out. The block program is compiled for it (engine/programs.h). It has
//
//   Numbers                    the number format; In<OtherNumbers>: the same law in another one, for packs of grains
//   Constants                  its parameters in internal units, as a call begins with them; set(parameters, ...) makes them from the
//                              material of an RVE, with the power of the units that each one has
//   take(constants)            fills the law from them
//   History                    what a pair remembers, as its first grain sees it: a number, or a struct of numbers, that can be
//                              multiplied by a number and is zero as it is made. seen_from_partner(history): as its other grain sees it
//   contact_law                of which materials it is (physics/material.h)
//   has_friction, has_rolling, is_damped
//                              what it has, so that programs leave out what needs it
//   evaluate(contact, i, j, velocity_gradient, history, dt)
//                              the force: a ContactForce or a struct that begins as one. dt of zero evaluates again without advancing
//                              the history. Exchanging the grains changes signs and nothing else, to the last bit
//   largest(force, so_far)     the largest of its forces, where the normal one does not bound the others
//   dissipate(force, dt, heat) adds the energy that a step of the contact turned into heat
//   elastic_energy(contact, force)
//                              energy that its springs hold
//   normal_force_at(parameters, overlap)
//                              in units of the script: for the unit of forces, and the least force of a crushed contact
//
// No transcendental function is called, since the libraries of CPU and GPU differ in the last bit; sums of two products that are
// symmetric in the grains are written as such, not as fused operations, whose rounding has an order.

#ifndef RVE_PHYSICS_LAWS_LAW_H
#define RVE_PHYSICS_LAWS_LAW_H

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Motion of one disk as a contact sees it.
  template <class Real> struct DiskMotion {
    Vec<Real, 2> velocity;    ///< peculiar [length/time]
    Real spin;                ///< counter-clockwise [1/time]
    Real radius;              ///< [length]
  };

  /// What a law answers. A contact with more springs has a struct that begins with this one.
  template <class Real, class History> struct ContactForce {
    Vec<Real, 2> force;          ///< on grain i; grain j gets the opposite [force]
    Real torque_i;               ///< on grain i [force length]
    Real torque_j;               ///< on grain j [force length]
    Real normal_force;           ///< repulsion positive [force]
    Real tangential;             ///< along t = (-n_y, n_x) [force]
    History spring;              ///< new history [force]
    History slipped;             ///< see TangentialForce
    Real tangential_velocity;    ///< [length/time]
    Real normal_velocity;        ///< [length/time]
    Truth<History> sliding;

    RVE_INLINE History history() const { return spring; }
  };

  /// Energy that contacts turned into heat [internal force length].
  struct Dissipation {
    double friction, viscous;
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
