// SPDX-License-Identifier: GPL-2.0-only
// Eigenvalues and principal axes of symmetric tensors, for host code.

#pragma once

#include "rve/core/tensor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rve {

/// Spectral decomposition t = Σ value_i axis_i ⊗ axis_i. The values are in descending order. The
/// axes are orthonormal, even if values are equal. Jacobi's method needs no special case for equal
/// values (Golub & Van Loan 2013, Matrix Computations, section 8.5).
template <int N> struct PrincipalAxes {
  double value[N];
  Vec<double, N> axis[N];

  explicit PrincipalAxes(Tensor<double, N> t)
  {
    auto columns = Tensor<double, N>::identity();
    // Each sweep roughly squares the ratio of off-diagonal to diagonal components, so that four
    // sweeps usually suffice.
    constexpr int MOST_SWEEPS = 16;
    for (int sweep = 0; sweep < MOST_SWEEPS; ++sweep) {
      bool turned = false;
      for (int a = 0; a < N; ++a)
        for (int b = a + 1; b < N; ++b) turned = turn(t, columns, a, b) || turned;
      if (!turned) break;
    }
    int order[N];
    std::iota(order, order + N, 0);
    std::sort(order, order + N, [&](int a, int b) { return t(a, a) > t(b, b); });
    for (int i = 0; i < N; ++i) {
      value[i] = t(order[i], order[i]);
      axis[i] = column(columns, order[i]);
    }
  }

 private:
  /// Rotates in the plane of axes a and b so that t(a, b) vanishes. Returns false if t(a, b) was
  /// negligible before: adding it to |t(a, a)| + |t(b, b)| does not change this sum.
  static bool turn(Tensor<double, N> &t, Tensor<double, N> &columns, int a, int b)
  {
    const double between = t(a, b);
    const double scale = std::abs(t(a, a)) + std::abs(t(b, b));
    t(a, b) = t(b, a) = 0.0;
    if (scale + std::abs(between) == scale) return false;
    // The tangents x of the two possible rotation angles solve x² + 2 c x - 1 = 0, where c is the
    // cotangent of twice the angle. The smaller angle is used.
    const double cotangent = (t(b, b) - t(a, a)) / (2.0 * between);
    const double root = std::abs(cotangent) + std::sqrt(1.0 + cotangent * cotangent);
    const double tangent = cotangent < 0.0 ? -1.0 / root : 1.0 / root;
    const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
    const double sine = tangent * cosine;
    t(a, a) -= tangent * between;
    t(b, b) += tangent * between;
    for (int c = 0; c < N; ++c) {
      if (c == a || c == b) continue;
      const double to_a = t(a, c), to_b = t(b, c);
      t(a, c) = t(c, a) = cosine * to_a - sine * to_b;
      t(b, c) = t(c, b) = sine * to_a + cosine * to_b;
    }
    for (int k = 0; k < N; ++k) {
      const double along_a = columns(k, a), along_b = columns(k, b);
      columns(k, a) = cosine * along_a - sine * along_b;
      columns(k, b) = sine * along_a + cosine * along_b;
    }
    return true;
  }
};

/// Returns the largest eigenvalue in closed form.
inline double largest_eigenvalue(const Tensor2 &symmetric)
{
  const double half_difference = 0.5 * (symmetric(0, 0) - symmetric(1, 1));
  return 0.5 * trace(symmetric) + std::hypot(half_difference, symmetric(0, 1));
}

/// Returns the largest eigenvalue of A = `symmetric`: m + 2 sqrt(p) cos(acos(q/p^1.5)/3), with m =
/// tr(A)/3, p = |A - m I|^2/6 and q = det(A - m I)/2 (Smith 1961, "Eigenvalues of a symmetric 3 x 3
/// matrix", Comm. ACM 4, 168).
inline double largest_eigenvalue(const Tensor3 &symmetric)
{
  const double mean = trace(symmetric) / 3.0;
  const Tensor3 deviator = symmetric - mean * Tensor3::identity();
  double squares = 0.0;
  for (const double x : deviator.component) squares += x * x;
  const double p = squares / 6.0, root = std::sqrt(p);
  if (root == 0.0) return mean;
  const double cosine = 0.5 * determinant(deviator) / (p * root);
  return mean + 2.0 * root * std::cos(std::acos(std::clamp(cosine, -1.0, 1.0)) / 3.0);
}

}    // namespace rve
