// SPDX-License-Identifier: GPL-2.0-only
// Local damping: Cundall's, and an objective form.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns a - alpha |a| sign(v), Cundall's damping of one component, equation (4). a is an
  /// acceleration or its velocity increment, v the velocity at the full step, and sign(0) = 0. The
  /// sign is not taken from a product of force and velocity, since the product could underflow and
  /// the result would then depend on the units. The formula has no branch.
  ///
  /// With BySign the sign bit of the velocity is used even if the velocity is zero. A grain at rest
  /// without a force still stays at rest.
  template <bool BySign = false, class Real>
  RVE_INLINE Real locally_damped(Real alpha, Real increment, Real velocity)
  {
    const Real loss = copysign(alpha * fabs(increment), velocity);
    if constexpr (BySign) return increment - loss;
    return difference_where(velocity != Real(0), increment, loss);
  }

  /// Returns a (1 - alpha sign(a . v)), the objective damping of a vector. Objective damping does
  /// not depend on the orientation of the axes; along the velocity it acts like Cundall's damping.
  /// It dissipates the power alpha |F . v|, whereas Cundall's damping dissipates alpha sum |F_k
  /// v_k|.
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
