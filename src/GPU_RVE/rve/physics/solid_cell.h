// SPDX-License-Identifier: GPL-2.0-only
// The deformable periodic cell in space: widths, strain since a reference, lattice reduction.
// cell.h has the functions for the plane.

#pragma once

#include "rve/physics/cell.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns the distance between the two cell faces that cell vector `axis` connects [length].
  RVE_INLINE double perpendicular_width(const Tensor3 &cell, int axis)
  {
    const Vec<double, 3> face = cross(column(cell, (axis + 1) % 3), column(cell, (axis + 2) % 3));
    return std::fabs(dot(column(cell, axis), face)) / std::sqrt(dot(face, face));
  }

  /// Returns a lower bound of the smallest singular value of G [-], the smallest factor by which G
  /// changes the length of a vector. The bound is sqrt(q - 2 p), or 0, with C = G^T G, the mean q
  /// of its eigenvalues and p^2 = tr((C - q I)^2)/6. No eigenvalue of C is below q - 2 p; the
  /// smallest one equals q - 2 p if the other two are equal. The closed form of the singular value
  /// would need a transcendental function.
  RVE_INLINE double smallest_stretch(const Tensor3 &g)
  {
    const Tensor3 c = transpose(g) * g;
    const double q = trace(c) * (1.0 / 3.0);
    double squares = 0.0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const double part = a == b ? c(a, b) - q : c(a, b);
        squares = std::fma(part, part, squares);
      }
    const double least = q - 2.0 * std::sqrt(squares * (1.0 / 6.0));
    return least > 0.0 ? std::sqrt(least) : 0.0;
  }

  /// Returns a step of lattice reduction. It is due when the projection of a vector on a shorter
  /// one exceeds 0.6 of the length of the shorter one, as in the plane. It is also due when a sum
  /// of all three vectors, a +- b +- c, is shorter than 0.8 of the longest one: three vectors can
  /// be nearly coplanar although all projections are small. In a Minkowski-reduced lattice no
  /// projection exceeds 0.5 of the length, and no sum is shorter than the longest vector. The
  /// margins keep a cell at the border from flipping back and forth.
  RVE_INLINE LatticeStep<3> lattice_step(const Tensor3 &cell)
  {
    double gram[3][3];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) gram[a][b] = dot(column(cell, a), column(cell, b));

    for (int a = 0; a < 3; ++a)
      for (int b = a + 1; b < 3; ++b) {
        const int longer = gram[a][a] <= gram[b][b] ? b : a, shorter = a + b - longer;
        if (!(std::fabs(gram[a][b]) > 0.6 * gram[shorter][shorter])) continue;
        const double lean = gram[a][b] / gram[shorter][shorter];
        LatticeStep<3> step{longer, {0, 0, 0}};
        step.multiple[shorter] = static_cast<std::int64_t>(lean > 0.0 ? lean + 0.5 : lean - 0.5);
        return step;
      }

    int longest = gram[0][0] >= gram[1][1] ? 0 : 1;
    longest = gram[longest][longest] >= gram[2][2] ? longest : 2;
    const int b = (longest + 1) % 3, c = (longest + 2) % 3;
    for (const int sign_b : {-1, 1})
      for (const int sign_c : {-1, 1}) {
        const double squared = gram[0][0] + gram[1][1] + gram[2][2] +
            2.0 *
                (sign_b * gram[longest][b] + sign_c * gram[longest][c] +
                 sign_b * sign_c * gram[b][c]);
        if (!(squared < 0.64 * gram[longest][longest])) continue;
        LatticeStep<3> step{longest, {0, 0, 0}};
        step.multiple[b] = -sign_b;
        step.multiple[c] = -sign_c;
        return step;
      }
    return LatticeStep<3>{-1, {0, 0, 0}};    // a NaN ends here too
  }

  /// Returns whether lattice_step() would change the cell.
  RVE_INLINE bool is_lattice_step_due(const Tensor3 &cell)
  {
    return lattice_step(cell).axis >= 0;
  }

}    // namespace RVE_ISA
}    // namespace rve
