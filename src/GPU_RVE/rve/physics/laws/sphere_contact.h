// How two spheres move at their contact, and what forces there do to them: the same for every contact law. Beside disk_contact.h.

#ifndef RVE_PHYSICS_LAWS_SPHERE_CONTACT_H
#define RVE_PHYSICS_LAWS_SPHERE_CONTACT_H

#include "rve/physics/contact_geometry.h"
#include "rve/physics/laws/law.h"
#include "rve/physics/vector_spring.h"

namespace rve {
inline namespace RVE_ISA {

  /// Arms as in DiskContact: r - overlap/2, which add up to |b|, so that a rigid rotation of the pair gives no slip. With an arm of its own
  /// the velocity is taken at r - velocity_arm * overlap: 1/2, or 0 as LAMMPS has it (not objective, for cross-checks).
  template <class Real> struct SphereContact {
    Real normal_velocity;    ///< of j relative to i, separation positive [length/time]
    Vec<Real, 3>
        tangential_velocity;     ///< of j relative to i, in the plane of the contact [length/time]
    Vec<Real, 3> normal_rate;    ///< dn/dt [1/time]
    Real twist_rate;             ///< mean spin of the grains about the normal [1/time]
    Real arm_i, arm_j;           ///< of torques [length]

    /// In a step of dt. Spins move the surfaces across the normal of the middle of the step, as the branch has moved: with that of its end a
    /// pair that turns as one would slip by the square of the angle of a step, always the same way where the axis leans to the normal. In
    /// the plane it never does.
    template <bool OwnVelocityArm>
    static RVE_INLINE SphereContact of(const ContactGeometry<Real, 3> &contact,
                                       const SphereMotion<Real> &i, const SphereMotion<Real> &j,
                                       const Tensor<Real, 3> &velocity_gradient, Real velocity_arm,
                                       Real dt)
    {
      // relative velocity c_j - c_i + L b: equation (20a) without any counting of periods
      const Vec<Real, 3> velocity = (j.velocity - i.velocity) + velocity_gradient * contact.branch;
      const Vec<Real, 3> &n = contact.normal;

      SphereContact moving;
      moving.arm_i = fma(Real(-0.5), contact.overlap, i.radius);
      moving.arm_j = fma(Real(-0.5), contact.overlap, j.radius);
      Real velocity_arm_i = moving.arm_i, velocity_arm_j = moving.arm_j;
      if constexpr (OwnVelocityArm) {
        velocity_arm_i = fma(-velocity_arm, contact.overlap, i.radius);
        velocity_arm_j = fma(-velocity_arm, contact.overlap, j.radius);
      }
      moving.normal_velocity = dot(velocity, n);
      const Vec<Real, 3> across = velocity - moving.normal_velocity * n;
      moving.normal_rate = reciprocal(contact.distance) * across;
      moving.twist_rate = Real(0.5) * dot(i.spin + j.spin, n);
      // sums of two products, not fma: they must not depend on the order of the grains
      const Vec<Real, 3> surface = velocity_arm_i * i.spin + velocity_arm_j * j.spin;
      const Vec<Real, 3> middle = n - (Real(0.5) * dt) * moving.normal_rate;
      const Vec<Real, 3> turning = cross(surface, middle);
      moving.tangential_velocity = across - (turning - dot(turning, n) * n);
      return moving;
    }

    /// What a pair remembers, in the plane of the contact after a step of dt.
    template <class Number>
    RVE_INLINE Vec<Number, 3> turned(const Vec<Number, 3> &history, const Vec<Real, 3> &n,
                                     Real dt) const
    {
      return turned_with_contact(history, n, {dt * normal_rate, dt * twist_rate}, dt > Real(0));
    }

    /// The answer of a law with friction.
    template <class Force, class Shear>
    RVE_INLINE void apply(const Vec<Real, 3> &n, Real normal_force, const Shear &shear,
                          Force &result) const
    {
      result.normal_velocity = normal_velocity;
      result.tangential_velocity = tangential_velocity;
      result.normal_force = normal_force;
      result.tangential = shear.force;
      result.spring = shear.spring;
      result.slipped = shear.slipped;
      result.sliding = shear.sliding;
      // force on i: -f_n n + f_t
      for (int a = 0; a < 3; ++a) result.force[a] = fma(-normal_force, n[a], shear.force[a]);
      const Vec<Real, 3> moment = cross(n, shear.force);    // of an arm of 1
      result.torque_i = arm_i * moment;
      result.torque_j = arm_j * moment;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
