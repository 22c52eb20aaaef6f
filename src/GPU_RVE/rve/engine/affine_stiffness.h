// SPDX-License-Identifier: GPL-2.0-only
// What an RVE answers to a strain that is too small to be worth DEM steps.

#pragma once

#include "rve/core/tensor.h"

namespace rve {

/// Tangent of Love's stress for grains that move with the mean field and do not spin, all contacts sticking, without dashpots:
///     d sigma = 1/V sum (df (x) b + f (x) db) - sigma tr(eps),    db = eps b,
///     df = (k_n l eps_nn - f_t eps_nt) n + (k_t l - f_n) eps_nt t,    f = -f_n n + f_t t the force on `first`,
/// with l = |b|, eps_nn = n.eps n, eps_nt = t.eps n: springs, turning contact forces, stretching branches, changing volume. It is
/// Voigt's upper bound of the elastic stiffness, exact for the first step of an RVE at rest.
template <int D> struct AffineStiffnessOf {
  /// d(sigma_xx, sigma_xy, sigma_yx, sigma_yy) / d(eps_xx, eps_yy, eps_xy): rows of sigma, the diagonal of eps first [stress]
  double component[Space<D>::components][Space<D>::strains] = {};

  /// Stress increment of a symmetric strain [stress].
  RVE_HD Tensor<double, D> operator()(const Tensor<double, D> &strain) const
  {
    Tensor<double, D> stress;
    for (int k = 0; k < Space<D>::components; ++k) {
      double sum = component[k][0] * strain(0, 0);
      for (int a = 1; a < D; ++a) sum += component[k][a] * strain(a, a);
      int shear = D;
      for (int a = 0; a < D; ++a)
        for (int b = a + 1; b < D; ++b) sum += component[k][shear++] * strain(a, b);
      stress.component[k] = sum;
    }
    return stress;
  }
};
using AffineStiffness = AffineStiffnessOf<2>;

/// Mean unbalanced force over mean contact force below which an RVE is at rest and may be skipped [-].
constexpr double QUIET_UNBALANCED_RATIO = 1e-2;

/// What a look at an RVE finds, at the end of DEM steps.
template <int D> struct LookOf {
  bool is_at_rest = false;
  double mean_overlap = 0.0;    ///< over contacts, overlap / sum of radii [-]
  AffineStiffnessOf<D> stiffness;
};

}    // namespace rve
