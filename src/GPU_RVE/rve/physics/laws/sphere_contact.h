// SPDX-License-Identifier: GPL-2.0-only
// Motion of two spheres at their contact, and effect of the contact force on them, for all contact
// laws. disk_contact.h has the same for disks.

#pragma once

#include "rve/physics/laws/contact_motion.h"
#include "rve/physics/vector_spring.h"

namespace rve {
inline namespace RVE_ISA {

  template <class Real> struct SphereContact : ContactMotion<Real, 3> {
    ContactTurn<Real> turn;    ///< rotation of the contact in the step
    Vec<Real, 3> middle;       ///< normal at the middle of the step

    /// Returns the motion in a step of dt. The surface velocity of the spins uses the normal at the
    /// middle of the step, which matches the motion of the branch. With the normal at the end of
    /// the step, a rigidly rotating pair would slip in each step by the square of its rotation
    /// angle. If the axis is inclined to the normal, the slip would always have the same direction.
    /// In the plane this slip does not occur.
    template <bool OwnVelocityArm>
    static RVE_INLINE SphereContact of(const ContactGeometry<Real, 3> &contact,
                                       const SphereMotion<Real> &i, const SphereMotion<Real> &j,
                                       const Tensor<Real, 3> &velocity_gradient, Real velocity_arm,
                                       Real dt)
    {
      const Vec<Real, 3> velocity =
          SphereContact::relative_velocity(contact, i, j, velocity_gradient);
      const Vec<Real, 3> &n = contact.normal;

      SphereContact moving;
      const VelocityArms<Real> arms = moving.template set_arms<OwnVelocityArm>(
          contact.overlap, i.radius, j.radius, velocity_arm);
      moving.normal_velocity = dot(velocity, n);
      const Vec<Real, 3> across = fma(-moving.normal_velocity, n, velocity);
      const Real angle = dt * contact.curvature;
      moving.turn.tilt = angle * across;
      if constexpr (kIsRelaxed)
        moving.middle = fma(-(Real(0.5) * angle), across, n);
      else
        moving.middle = middle_normal(n, moving.turn);
      moving.turn.twist = Real(0.5) * (dt * dot(i.spin + j.spin, n));
      // These are sums of two products, not fma: they must not depend on the order of the grains.
      const Vec<Real, 3> surface = arms.i * i.spin + arms.j * j.spin;
      const Vec<Real, 3> &middle = moving.middle;
      if constexpr (kIsRelaxed) {
        // The result has a component along the normal: half of the angle of the step times the
        // velocity perpendicular to the normal. This component is smaller than the rounding of the
        // result. The next step turns the history back into the contact plane.
        for (int a = 0; a < 3; ++a) {
          const int b = (a + 1) % 3, c = (a + 2) % 3;
          moving.tangential_velocity[a] =
              fma(surface[c], middle[b], fma(-surface[b], middle[c], across[a]));
        }
      } else {
        const Vec<Real, 3> turning = cross(surface, middle);
        moving.tangential_velocity = across - fma(-dot(turning, n), n, turning);
      }
      return moving;
    }

    /// Returns a history in the plane of the contact after a step of dt.
    template <class Number>
    RVE_INLINE TurnedForce<Real, Number> turned(const Vec<Number, 3> &history,
                                                const Vec<Real, 3> &n, Real dt) const
    {
      return turned_with_contact(history, n, middle, turn.twist, Truth<Real>(dt > Real(0)));
    }

    /// Writes the result of a law with friction.
    template <class Force, class Shear>
    RVE_INLINE void apply(const Vec<Real, 3> &n, Real normal_force, const Shear &shear,
                          Force &result) const
    {
      this->answer(normal_force, shear, result);
      // The force on i is -f_n n + f_t.
      for (int a = 0; a < 3; ++a) result.force[a] = fma(-normal_force, n[a], shear.force[a]);
      const Vec<Real, 3> moment = cross(n, shear.force);    // for a lever arm of 1
      result.torque_i = this->arm_i * moment;
      result.torque_j = this->arm_j * moment;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
