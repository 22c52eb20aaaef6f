// SPDX-License-Identifier: GPL-2.0-only
// Love's formula.

#pragma once

#include "rve/core/tensor.h"

namespace rve {
inline namespace RVE_ISA {

  /// Contribution of one contact to V sigma, equation (24), tension positive: force on i times branch from i to j. The same for
  /// both grains of the pair, since both factors change sign. No kinetic term: with c' = F/m the energy closes without it.
  template <class Real, int D>
  RVE_INLINE Tensor<Real, D> love_term(const Vec<Real, D> &force_on_i, const Vec<Real, D> &branch)
  {
    return dyad(force_on_i, branch);
  }

}    // namespace RVE_ISA
}    // namespace rve
