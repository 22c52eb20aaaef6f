// SPDX-License-Identifier: GPL-2.0-only
// The deformable periodic cell: widths, strain since a reference, lattice reduction. Plane cells.

#pragma once

#include "rve/core/fixed_point.h"

#include <cmath>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Distance between the two cell faces that cell vector `axis` connects [length]. Neighbour search and the minimum image
  /// need this, not the edge length: a sheared cell is narrow between long edges.
  RVE_INLINE double perpendicular_width(const Tensor2 &cell, int axis)
  {
    const int other = 1 - axis;
    const double edge =
        std::sqrt(cell(0, other) * cell(0, other) + cell(1, other) * cell(1, other));
    return std::fabs(determinant(cell)) / edge;
  }

  RVE_INLINE double smallest_width(const Tensor2 &cell)
  {
    const double x = perpendicular_width(cell, 0), y = perpendicular_width(cell, 1);
    return x < y ? x : y;
  }

  /// Smallest singular value of G: no vector shrinks more than this under G [-].
  RVE_INLINE double smallest_stretch(const Tensor2 &g)
  {
    const double sum =
        g(0, 0) * g(0, 0) + g(0, 1) * g(0, 1) + g(1, 0) * g(1, 0) + g(1, 1) * g(1, 1);
    const double det = std::fabs(determinant(g));
    const double difference = (sum - 2.0 * det) > 0.0 ? std::sqrt(sum - 2.0 * det) : 0.0;
    return 0.5 * (std::sqrt(sum + 2.0 * det) - difference);    // (s1 + s2) - (s1 - s2), halved
  }

  /// How often cell vector a fits into b, or b into a: one step of Lagrange's lattice reduction, H <- H M.
  struct LatticeStep {
    int axis;                 ///< the vector that changes; -1: the cell is reduced well enough
    std::int64_t multiple;    ///< of the other vector, which is subtracted
  };

  /// Whether lattice_step would change the cell; cheaper.
  RVE_INLINE bool is_lattice_step_due(const Tensor2 &cell)
  {
    const double aa = cell(0, 0) * cell(0, 0) + cell(1, 0) * cell(1, 0);
    const double bb = cell(0, 1) * cell(0, 1) + cell(1, 1) * cell(1, 1);
    const double ab = cell(0, 0) * cell(0, 1) + cell(1, 0) * cell(1, 1);
    return std::fabs(ab) > 0.6 * (aa <= bb ? aa : bb);
  }

  /// Reduction is due when one vector leans over the other by more than 0.6 of its length; 0.5 would be the reduced lattice,
  /// the margin keeps a cell at the border from flipping back and forth.
  RVE_INLINE LatticeStep lattice_step(const Tensor2 &cell)
  {
    const double aa = cell(0, 0) * cell(0, 0) + cell(1, 0) * cell(1, 0);
    const double bb = cell(0, 1) * cell(0, 1) + cell(1, 1) * cell(1, 1);
    const double ab = cell(0, 0) * cell(0, 1) + cell(1, 0) * cell(1, 1);
    const int axis = aa <= bb ? 1 : 0;                            // the longer one changes
    if (!is_lattice_step_due(cell)) return LatticeStep{-1, 0};    // a NaN ends here too
    const double lean = ab / (axis == 1 ? aa : bb);
    return LatticeStep{axis, static_cast<std::int64_t>(lean > 0.0 ? lean + 0.5 : lean - 0.5)};
  }

  /// H M of the step: the vector `axis` loses `multiple` of the other one.
  RVE_INLINE Tensor2 apply_lattice_step(const Tensor2 &cell, const LatticeStep &step)
  {
    Tensor2 reduced = cell;
    for (int a = 0; a < 2; ++a)
      reduced(a, step.axis) =
          std::fma(-static_cast<double>(step.multiple), cell(a, 1 - step.axis), cell(a, step.axis));
    return reduced;
  }

  /// M^-1 s, exact in wrapping integers: the point stays where it is.
  template <class Coordinate>
  RVE_INLINE Vec<Coordinate, 2> apply_lattice_step(const Vec<Coordinate, 2> &s,
                                                   const LatticeStep &step)
  {
    Vec<Coordinate, 2> t = s;
    t[1 - step.axis] = s[1 - step.axis] + static_cast<Coordinate>(step.multiple) * s[step.axis];
    return t;
  }
  RVE_INLINE Vec<FloatFraction, 2> apply_lattice_step(const Vec<FloatFraction, 2> &s,
                                                      const LatticeStep &step)
  {
    Vec<FloatFraction, 2> t = s;
    t[1 - step.axis] =
        wrapped(s[1 - step.axis].value + static_cast<float>(step.multiple) * s[step.axis].value);
    return t;
  }

}    // namespace RVE_ISA
}    // namespace rve
