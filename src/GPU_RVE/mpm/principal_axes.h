// SPDX-License-Identifier: GPL-2.0-only
// A symmetric tensor in space along its principal axes. Numbers in, numbers out.

#pragma once

#include "rve/core/tensor.h"

#include <algorithm>
#include <cmath>

namespace mpm {

/// t = Σ value_i axis_i ⊗ axis_i, values in descending order, axes of unit length and at right angles to each other: also where
/// values are equal, which Jacobi's rotations do not notice (Golub & Van Loan 2013, Matrix Computations, section 8.5).
struct PrincipalAxes {
  double value[3];
  rve::Vec<double, 3> axis[3];

  explicit PrincipalAxes(rve::Tensor3 t)
  {
    rve::Tensor3 columns = rve::Tensor3::identity();
    // each sweep squares what is off the diagonal in comparison with the rest: four leave nothing as a rule
    constexpr int MOST_SWEEPS = 16;
    for (int sweep = 0; sweep < MOST_SWEEPS; ++sweep) {
      bool turned = false;
      for (int a = 0; a < 2; ++a)
        for (int b = a + 1; b < 3; ++b) turned = turn(t, columns, a, b) || turned;
      if (!turned) break;
    }
    int order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](int a, int b) { return t(a, a) > t(b, b); });
    for (int i = 0; i < 3; ++i) {
      value[i] = t(order[i], order[i]);
      axis[i] = column(columns, order[i]);
    }
  }

 private:
  /// The rotation in the plane of two axes that leaves nothing between them; false where there is nothing.
  static bool turn(rve::Tensor3 &t, rve::Tensor3 &columns, int a, int b)
  {
    const double between = t(a, b);
    const double scale = std::abs(t(a, a)) + std::abs(t(b, b));
    t(a, b) = t(b, a) = 0.0;
    if (scale + std::abs(between) == scale) return false;
    // tangent of the smaller angle of the two: t² + 2 t cot(2 angle) - 1 = 0
    const double cotangent = (t(b, b) - t(a, a)) / (2.0 * between);
    const double root = std::abs(cotangent) + std::sqrt(1.0 + cotangent * cotangent);
    const double tangent = cotangent < 0.0 ? -1.0 / root : 1.0 / root;
    const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
    const double sine = tangent * cosine;
    t(a, a) -= tangent * between;
    t(b, b) += tangent * between;
    const int c = 3 - a - b;
    const double to_a = t(a, c), to_b = t(b, c);
    t(a, c) = t(c, a) = cosine * to_a - sine * to_b;
    t(b, c) = t(c, b) = sine * to_a + cosine * to_b;
    for (int k = 0; k < 3; ++k) {
      const double along_a = columns(k, a), along_b = columns(k, b);
      columns(k, a) = cosine * along_a - sine * along_b;
      columns(k, b) = sine * along_a + cosine * along_b;
    }
    return true;
  }
};

}    // namespace mpm
