// SPDX-License-Identifier: GPL-2.0-only
// Motion of two disks at their contact, and effect of the contact force on them, for all contact
// laws.

#pragma once

#include "rve/physics/laws/contact_motion.h"
#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Contact of two disks. The tangential velocity is a number along t = (-n_y, n_x).
  template <class Real> struct DiskContact : ContactMotion<Real, 2> {
    template <bool OwnVelocityArm>
    static RVE_INLINE DiskContact of(const ContactGeometry<Real, 2> &contact,
                                     const DiskMotion<Real> &i, const DiskMotion<Real> &j,
                                     const Tensor<Real, 2> &velocity_gradient, Real velocity_arm,
                                     Real = Real(0))
    {
      const Vec<Real, 2> velocity =
          DiskContact::relative_velocity(contact, i, j, velocity_gradient);
      const Vec<Real, 2> &n = contact.normal;

      DiskContact moving;
      const VelocityArms<Real> arms = moving.template set_arms<OwnVelocityArm>(
          contact.overlap, i.radius, j.radius, velocity_arm);
      moving.normal_velocity = dot(velocity, n);
      // This is a sum of two products, not fma: it must not depend on the order of the grains.
      moving.tangential_velocity = cross(n, velocity) - (arms.i * i.spin + arms.j * j.spin);
      return moving;
    }

    /// Returns the history unchanged: a number along t turns with the contact.
    template <class History>
    RVE_INLINE const History &turned(const History &history, const Vec<Real, 2> &, Real) const
    {
      return history;
    }

    /// Writes the result of a law with friction.
    template <class Force, class Shear>
    RVE_INLINE void apply(const Vec<Real, 2> &n, Real normal_force, const Shear &shear,
                          Force &result) const
    {
      this->answer(normal_force, shear, result);
      // The force on i is -f_n n + f_t t with t = (-n_y, n_x).
      result.force[0] = fma(-shear.force, n[1], -(normal_force * n[0]));
      result.force[1] = fma(shear.force, n[0], -(normal_force * n[1]));
      result.torque_i = this->arm_i * shear.force;
      result.torque_j = this->arm_j * shear.force;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
