// SPDX-License-Identifier: GPL-2.0-only
// Common parts of the contact of two disks and of two spheres.

#pragma once

#include "rve/physics/contact_geometry.h"
#include "rve/physics/laws/law.h"

namespace rve {
inline namespace RVE_ISA {

  /// Lever arms of the surface velocities of grains i and j [length]. Without OwnVelocityArm they
  /// are the lever arms of torques, r - overlap/2, the distance from the centre to the contact
  /// point of equation (11). The sum of both arms is then |b|, so that a rigid rotation of the pair
  /// gives no slip. With OwnVelocityArm they are r - velocity_arm * overlap. velocity_arm is 1/2,
  /// or 0 as in LAMMPS (not objective, for cross-checks).
  template <class Real> struct VelocityArms {
    Real i, j;
  };

  template <class Real, int D> struct ContactMotion {
    Real normal_velocity;    ///< of j relative to i, separation positive [length/time]
    Along<Real, D> tangential_velocity;    ///< of j relative to i, along the contact [length/time]
    Real arm_i, arm_j;                     ///< lever arms of torques [length]

    /// Returns the velocity of grain j relative to grain i, c_j - c_i + L b, equation (20a), with
    /// the peculiar velocities c, the velocity gradient L and the branch b. The number of cell
    /// periods between the grains is not needed.
    static RVE_INLINE Vec<Real, D> relative_velocity(const ContactGeometry<Real, D> &contact,
                                                     const GrainMotion<Real, D> &i,
                                                     const GrainMotion<Real, D> &j,
                                                     const Tensor<Real, D> &velocity_gradient)
    {
      const Vec<Real, D> difference = j.velocity - i.velocity;
      if constexpr (kIsRelaxed && D == 3) return fma(velocity_gradient, contact.branch, difference);
      return difference + velocity_gradient * contact.branch;
    }

    /// Sets the lever arms of torques and returns those of the surface velocity.
    template <bool OwnVelocityArm>
    RVE_INLINE VelocityArms<Real> set_arms(Real overlap, Real radius_i, Real radius_j,
                                           Real velocity_arm)
    {
      arm_i = fma(Real(-0.5), overlap, radius_i);
      arm_j = fma(Real(-0.5), overlap, radius_j);
      VelocityArms<Real> arms{arm_i, arm_j};
      if constexpr (OwnVelocityArm) {
        arms.i = fma(-velocity_arm, overlap, radius_i);
        arms.j = fma(-velocity_arm, overlap, radius_j);
      }
      return arms;
    }

    /// Writes the result of a law with friction, except force and torques.
    template <class Force, class Shear>
    RVE_INLINE void answer(Real normal_force, const Shear &shear, Force &result) const
    {
      result.normal_velocity = normal_velocity;
      result.tangential_velocity = tangential_velocity;
      result.normal_force = normal_force;
      result.tangential = shear.force;
      result.spring = shear.spring;
      result.slipped = shear.slipped;
      result.sliding = shear.sliding;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
