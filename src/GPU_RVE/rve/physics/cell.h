// SPDX-License-Identifier: GPL-2.0-only
// The deformable periodic cell: widths, strain since a reference, lattice reduction. This file has
// the functions for two dimensions and the functions for any dimension. solid_cell.h has the
// functions for three dimensions.

#pragma once

#include "rve/core/fixed_point.h"

#include <cmath>
#include <cstdint>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Returns the distance between the two cell faces that cell vector `axis` connects [length].
  /// Neighbour search and the minimum image need this distance, not the length of the edge: a
  /// sheared cell is narrow between long edges.
  RVE_INLINE double perpendicular_width(const Tensor2 &cell, int axis)
  {
    const int other = 1 - axis;
    const double edge =
        std::sqrt(cell(0, other) * cell(0, other) + cell(1, other) * cell(1, other));
    return std::fabs(determinant(cell)) / edge;
  }

  template <int D> RVE_INLINE double smallest_width(const Tensor<double, D> &cell)
  {
    double smallest = perpendicular_width(cell, 0);
    for (int axis = 1; axis < D; ++axis) {
      const double width = perpendicular_width(cell, axis);
      smallest = width < smallest ? width : smallest;
    }
    return smallest;
  }

  /// Returns the smallest singular value of G [-]: the smallest factor by which G changes the
  /// length of a vector.
  RVE_INLINE double smallest_stretch(const Tensor2 &g)
  {
    const double sum =
        g(0, 0) * g(0, 0) + g(0, 1) * g(0, 1) + g(1, 0) * g(1, 0) + g(1, 1) * g(1, 1);
    const double det = std::fabs(determinant(g));
    const double difference = (sum - 2.0 * det) > 0.0 ? std::sqrt(sum - 2.0 * det) : 0.0;
    return 0.5 * (std::sqrt(sum + 2.0 * det) - difference);    // (s1 + s2) - (s1 - s2), halved
  }

  /// One step of lattice reduction, H <- H M. It subtracts integer multiples of the other cell
  /// vectors from the cell vector `axis`.
  template <int D> struct LatticeStep {
    int axis;                    ///< the vector that changes; -1: the cell is reduced well enough
    std::int64_t multiple[D];    ///< multiple of vector k to subtract; 0 for the axis itself
  };

  /// Returns whether lattice_step() would change the cell, at a lower cost than lattice_step().
  RVE_INLINE bool is_lattice_step_due(const Tensor2 &cell)
  {
    const double aa = cell(0, 0) * cell(0, 0) + cell(1, 0) * cell(1, 0);
    const double bb = cell(0, 1) * cell(0, 1) + cell(1, 1) * cell(1, 1);
    const double ab = cell(0, 0) * cell(0, 1) + cell(1, 0) * cell(1, 1);
    return std::fabs(ab) > 0.6 * (aa <= bb ? aa : bb);
  }

  /// Returns the step of Lagrange's reduction. It subtracts the multiple of the shorter vector from
  /// the longer one that minimises the projection of the longer vector on the shorter one. A step
  /// is due when the projection exceeds 0.6 times the length of the shorter vector. In a reduced
  /// lattice the projection is at most 0.5 times this length. The margin keeps a cell near the
  /// limit from flipping back and forth.
  RVE_INLINE LatticeStep<2> lattice_step(const Tensor2 &cell)
  {
    const double aa = cell(0, 0) * cell(0, 0) + cell(1, 0) * cell(1, 0);
    const double bb = cell(0, 1) * cell(0, 1) + cell(1, 1) * cell(1, 1);
    const double ab = cell(0, 0) * cell(0, 1) + cell(1, 0) * cell(1, 1);
    LatticeStep<2> step{-1, {0, 0}};
    if (!is_lattice_step_due(cell)) return step;    // a NaN ends here too
    step.axis = aa <= bb ? 1 : 0;                   // the longer one changes
    const double lean = ab / (step.axis == 1 ? aa : bb);
    step.multiple[1 - step.axis] = static_cast<std::int64_t>(lean > 0.0 ? lean + 0.5 : lean - 0.5);
    return step;
  }

  /// Returns H M of the step.
  template <int D>
  RVE_INLINE Tensor<double, D> apply_lattice_step(const Tensor<double, D> &cell,
                                                  const LatticeStep<D> &step)
  {
    Tensor<double, D> reduced = cell;
    for (int a = 0; a < D; ++a)
      for (int k = 0; k < D; ++k)
        if (k != step.axis)
          reduced(a, step.axis) =
              std::fma(-static_cast<double>(step.multiple[k]), cell(a, k), reduced(a, step.axis));
    return reduced;
  }

  /// Returns M^-1 s, the coordinates of the same point in the reduced cell. The result is exact if
  /// coordinates are wrapping integers.
  template <class Coordinate, int D>
  RVE_INLINE Vec<Coordinate, D> apply_lattice_step(const Vec<Coordinate, D> &s,
                                                   const LatticeStep<D> &step)
  {
    Vec<Coordinate, D> t = s;
    for (int k = 0; k < D; ++k)
      if (k != step.axis) {
        if constexpr (std::is_same_v<Coordinate, FloatFraction>)
          t[k] = wrapped(s[k].value + static_cast<float>(step.multiple[k]) * s[step.axis].value);
        else
          t[k] = s[k] + static_cast<Coordinate>(step.multiple[k]) * s[step.axis];
      }
    return t;
  }

}    // namespace RVE_ISA
}    // namespace rve
