// SPDX-License-Identifier: GPL-2.0-only
// Local damping: Cundall's, and one that knows no axes.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Equation (4) on one component of an acceleration, or of the velocity increment that it makes: a - alpha |a| sign(v), v the
  /// velocity at the full step, sign(0) = 0. The signs are never multiplied as numbers: a product could underflow and change
  /// the answer with the units. Without a branch.
  ///
  /// BySign: of a velocity of exactly zero the sign bit decides. What rests without a force stays at rest all the same.
  template <bool BySign = false, class Real>
  RVE_INLINE Real locally_damped(Real alpha, Real increment, Real velocity)
  {
    const Real loss = copysign(alpha * fabs(increment), velocity);
    if constexpr (BySign) return increment - loss;
    return difference_where(velocity != Real(0), increment, loss);
  }

  /// The same of a whole vector: a (1 - alpha sign(a . v)), which damps the part along the velocity as above and turns with the axes. It
  /// takes alpha |F . v| of the power, Cundall's alpha sum |F_k v_k|.
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
