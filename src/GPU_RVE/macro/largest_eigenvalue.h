// SPDX-License-Identifier: GPL-2.0-only
// Largest eigenvalue of a symmetric tensor, in closed form.

#pragma once

#include "rve/core/tensor.h"

#include <algorithm>
#include <cmath>

namespace macro {

inline double largest_eigenvalue(const rve::Tensor2 &symmetric)
{
  const double half_difference = 0.5 * (symmetric(0, 0) - symmetric(1, 1));
  return 0.5 * rve::trace(symmetric) + std::hypot(half_difference, symmetric(0, 1));
}

// Smith 1961, "Eigenvalues of a symmetric 3 x 3 matrix", Comm. ACM 4, 168: m + 2 sqrt(p) cos(acos(q/p^1.5)/3) with the mean m of the
// diagonal, 6 p = |A - m|^2 and 2 q = det(A - m)
inline double largest_eigenvalue(const rve::Tensor3 &symmetric)
{
  const double mean = rve::trace(symmetric) / 3.0;
  const rve::Tensor3 deviator = symmetric - mean * rve::Tensor3::identity();
  double squares = 0.0;
  for (const double x : deviator.component) squares += x * x;
  const double p = squares / 6.0, root = std::sqrt(p);
  if (root == 0.0) return mean;
  const double cosine = 0.5 * rve::determinant(deviator) / (p * root);
  return mean + 2.0 * root * std::cos(std::acos(std::clamp(cosine, -1.0, 1.0)) / 3.0);
}

}    // namespace macro
