// How two disks move at their contact, and what forces there do to them: the same for every contact law.

#ifndef RVE_PHYSICS_LAWS_DISK_CONTACT_H
#define RVE_PHYSICS_LAWS_DISK_CONTACT_H

#include "rve/physics/contact_geometry.h"
#include "rve/physics/laws/law.h"
#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Arms: torque r - overlap/2, the distance to the contact point of equation (11), and the same for the surface velocity: the arms add
  /// up to |b|, so that a rigid rotation of the pair gives no slip. With an arm of its own the velocity is taken at r - velocity_arm *
  /// overlap: 1/2, or 0 as LAMMPS has it (not objective, for cross-checks).
  template <class Real> struct DiskContact {
    Real normal_velocity;        ///< of j relative to i, separation positive [length/time]
    Real tangential_velocity;    ///< along t = (-n_y, n_x) [length/time]
    Real arm_i, arm_j;           ///< of torques [length]

    template <bool OwnVelocityArm>
    static RVE_INLINE DiskContact of(const ContactGeometry<Real, 2> &contact,
                                     const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                                     const Tensor<Real, 2> &velocity_gradient, Real velocity_arm,
                                     Real = Real(0))
    {
      // relative velocity c_j - c_i + L b: equation (20a) without any counting of periods
      const Vec<Real, 2> velocity = (j.velocity - i.velocity) + velocity_gradient * contact.branch;
      const Vec<Real, 2> &n = contact.normal;

      DiskContact moving;
      moving.arm_i = fma(Real(-0.5), contact.overlap, i.radius);
      moving.arm_j = fma(Real(-0.5), contact.overlap, j.radius);
      Real velocity_arm_i = moving.arm_i, velocity_arm_j = moving.arm_j;
      if constexpr (OwnVelocityArm) {
        velocity_arm_i = fma(-velocity_arm, contact.overlap, i.radius);
        velocity_arm_j = fma(-velocity_arm, contact.overlap, j.radius);
      }
      moving.normal_velocity = dot(velocity, n);
      // a sum of two products, not fma: it must not depend on the order of the grains
      moving.tangential_velocity =
          cross(n, velocity) - (velocity_arm_i * i.spin + velocity_arm_j * j.spin);
      return moving;
    }

    /// What a pair remembers, in the plane of the contact now: a number along t turns with it.
    template <class History>
    RVE_INLINE const History &turned(const History &history, const Vec<Real, 2> &, Real) const
    {
      return history;
    }

    /// The answer of a law with friction.
    template <class Force, class Shear>
    RVE_INLINE void apply(const Vec<Real, 2> &n, Real normal_force, const Shear &shear,
                          Force &result) const
    {
      result.normal_velocity = normal_velocity;
      result.tangential_velocity = tangential_velocity;
      result.normal_force = normal_force;
      result.tangential = shear.force;
      result.spring = shear.spring;
      result.slipped = shear.slipped;
      result.sliding = shear.sliding;
      // force on i: -f_n n + f_t t with t = (-n_y, n_x)
      result.force[0] = fma(-shear.force, n[1], -(normal_force * n[0]));
      result.force[1] = fma(shear.force, n[0], -(normal_force * n[1]));
      result.torque_i = arm_i * shear.force;
      result.torque_j = arm_j * shear.force;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
