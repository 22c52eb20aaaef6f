// SPDX-License-Identifier: GPL-2.0-only
// Local damping: Cundall's, and an objective form.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Applies equation (4) to one component of an acceleration or of its velocity increment: a -
  /// alpha |a| sign(v), with the velocity v at the full step and sign(0) = 0. The signs are not
  /// multiplied as numbers, since a product could underflow, and the result would depend on the
  /// units. The formula has no branch.
  ///
  /// With BySign the sign bit of a zero velocity counts. A grain at rest without a force stays at
  /// rest.
  template <bool BySign = false, class Real>
  RVE_INLINE Real locally_damped(Real alpha, Real increment, Real velocity)
  {
    const Real loss = copysign(alpha * fabs(increment), velocity);
    if constexpr (BySign) return increment - loss;
    return difference_where(velocity != Real(0), increment, loss);
  }

  /// Applies objective damping to a vector: a (1 - alpha sign(a . v)). It damps the part along the
  /// velocity as above and turns with the axes. It takes alpha |F . v| of the power, where
  /// Cundall's damping takes alpha sum |F_k v_k|.
  template <class Real, int D>
  RVE_INLINE Vec<Real, D> objectively_damped(Real alpha, const Vec<Real, D> &increment,
                                             const Vec<Real, D> &velocity)
  {
    const Real power = dot(increment, velocity);
    const Real share = select(power != Real(0), copysign(alpha, power), Real(0));
    return (Real(1) - share) * increment;
  }

}    // namespace RVE_ISA
}    // namespace rve
