// What an RVE answers to a strain that is too small to be worth DEM steps.

#ifndef RVE_ENGINE_AFFINE_STIFFNESS_H
#define RVE_ENGINE_AFFINE_STIFFNESS_H

#include "rve/core/tensor.h"

namespace rve {

/// Tangent of Love's stress for grains that move with the mean field and do not spin, all contacts sticking, without dashpots:
///     d sigma = 1/V sum (df (x) b + f (x) db) - sigma tr(eps),    db = eps b,
///     df = (k_n l eps_nn - f_t eps_nt) n + (k_t l - f_n) eps_nt t,    f = -f_n n + f_t t the force on `first`,
/// with l = |b|, eps_nn = n.eps n, eps_nt = t.eps n: springs, turning contact forces, stretching branches, changing volume. It is
/// Voigt's upper bound of the elastic stiffness, exact for the first step of an RVE at rest.
struct AffineStiffness {
  double component[4][3] =
      {};    ///< d(sigma_xx, sigma_xy, sigma_yx, sigma_yy) / d(eps_xx, eps_yy, eps_xy) [stress]

  /// Stress increment of a symmetric strain [stress].
  Tensor2 operator()(const Tensor2 &strain) const
  {
    Tensor2 stress;
    for (int k = 0; k < 4; ++k)
      stress.component[k] = component[k][0] * strain(0, 0) + component[k][1] * strain(1, 1) +
          component[k][2] * strain(0, 1);
    return stress;
  }
};

}    // namespace rve

#endif
