// Cundall's local damping.

#ifndef RVE_PHYSICS_DAMPING_H
#define RVE_PHYSICS_DAMPING_H

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// -1, 0 or 1, without a branch.
  template <class Real> RVE_INLINE int sign(Real x)
  {
    return (x > Real(0)) - (x < Real(0));
  }

  /// Factor on an acceleration component, equation (4): 1 - alpha sign(a v), v the velocity at the full step, sign(0) = 0.
  /// Signs are taken one by one: a product could underflow and change the answer with the units.
  template <class Real>
  RVE_INLINE Real local_damping_factor(Real alpha, Real acceleration, Real velocity)
  {
    return Real(1) - alpha * static_cast<Real>(sign(acceleration) * sign(velocity));
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
