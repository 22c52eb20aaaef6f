// Leapfrog in peculiar velocity and fractional coordinate: c' = F_damped/m, s' = H^-1 c. The mean field never enters
// (doc/theory: equations (19)-(23), (38), (39) of the paper reduce to this).

#ifndef RVE_PHYSICS_INTEGRATOR_H
#define RVE_PHYSICS_INTEGRATOR_H

#include "rve/physics/damping.h"

namespace rve {
inline namespace RVE_ISA {

  /// One velocity component after a step, equations (3a) and (4): `increment` is dt F/m, and damping looks at the velocity
  /// at the full step.
  template <class Real> RVE_INLINE Real kick(Real velocity, Real increment, Real alpha)
  {
    return velocity + locally_damped(alpha, increment, velocity + Real(0.5) * increment);
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
