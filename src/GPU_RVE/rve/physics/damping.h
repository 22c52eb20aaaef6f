// Cundall's local damping.

#ifndef RVE_PHYSICS_DAMPING_H
#define RVE_PHYSICS_DAMPING_H

#include "rve/core/arithmetic.h"

namespace rve {
inline namespace RVE_ISA {

  /// Equation (4) on one component of an acceleration, or of the velocity increment that it makes: a - alpha |a| sign(v), v the
  /// velocity at the full step, sign(0) = 0. The signs are never multiplied as numbers: a product could underflow and change
  /// the answer with the units. Without a branch.
  template <class Real> RVE_INLINE Real locally_damped(Real alpha, Real increment, Real velocity)
  {
    const Real loss = copysign(alpha * fabs(increment), velocity);
    return increment - select(velocity != Real(0), loss, Real(0));
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
