// Cundall's local damping.

#ifndef RVE_PHYSICS_DAMPING_H
#define RVE_PHYSICS_DAMPING_H

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

/// Factor on an acceleration component, equation (4): 1 - alpha sign(a v), v the velocity at the full step, sign(0) = 0.
/// Signs are compared one by one: a product could underflow and change the answer with the units.
template <class Real> RVE_INLINE Real local_damping_factor(Real alpha, Real acceleration, Real velocity)
{
  const bool same = (acceleration > Real(0) && velocity > Real(0)) || (acceleration < Real(0) && velocity < Real(0));
  const bool opposite = (acceleration > Real(0) && velocity < Real(0)) || (acceleration < Real(0) && velocity > Real(0));
  return same ? Real(1) - alpha : (opposite ? Real(1) + alpha : Real(1));
}

}    // namespace RVE_ISA
}    // namespace rve

#endif
