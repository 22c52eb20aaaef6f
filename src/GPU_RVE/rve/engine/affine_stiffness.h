// SPDX-License-Identifier: GPL-2.0-only
// Elastic response of an RVE to a strain that is too small for DEM steps.

#pragma once

#include "rve/core/tensor.h"

namespace rve {

/// Affine stiffness: the tangent of Love's stress sigma for a small symmetric strain eps. Grains
/// move with the mean field and do not spin, contacts stick, and dashpots are neglected:
///     d sigma = 1/V sum (df (x) b + f (x) db) - sigma tr(eps),    db = eps b,
///     df = (k_n l eps_nn - f_t eps_nt) n + (k_t l - f_n) eps_nt t,
/// V is the volume of the cell. A contact has the branch vector b of length l, the normal n, the
/// tangent t, the force f = -f_n n + f_t t on its grain `first`, and the spring stiffnesses k_n and
/// k_t. Its strains are eps_nn = n.eps n and eps_nt = t.eps n. The terms describe the springs, the
/// rotation of contact forces, the stretch of branch vectors and the change of volume. The tangent
/// is Voigt's upper bound of the elastic stiffness. It is exact for the first step of an RVE at
/// rest.
template <int D> struct AffineStiffnessOf {
  /// d sigma / d eps [stress], with one row for each component of sigma and one column for each
  /// strain, the diagonal of eps first. For disks: d(sigma_xx, sigma_xy, sigma_yx, sigma_yy) /
  /// d(eps_xx, eps_yy, eps_xy).
  double component[Space<D>::components][Space<D>::strains] = {};

  /// Returns the stress increment of a symmetric strain [stress].
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

/// Largest ratio of the mean unbalanced force to the mean contact force at which an RVE counts as
/// at rest and may become quiescent [-].
constexpr double QUIET_UNBALANCED_RATIO = 1e-2;

/// Diagnostic evaluation of an RVE at the end of its DEM steps.
template <int D> struct EvaluationOf {
  bool is_at_rest = false;
  double mean_overlap = 0.0;    ///< mean over contacts, overlap / sum of radii [-]
  AffineStiffnessOf<D> stiffness;
};

}    // namespace rve
