// SPDX-License-Identifier: GPL-2.0-only
// Path of the cell matrix H through one macro increment dF: a straight line from H to dF H, or a
// polygon if the increment rotates by more than 0.01 rad. On a straight segment that turns the cell
// by the angle theta, the area of the cell is at most theta^2/4 too small, as a fraction. The end
// point is exact.

#pragma once

#include "rve/core/tensor.h"

namespace rve {
inline namespace RVE_ISA {

  /// Increment dF = R U of the deformation gradient, as prepared by the host, with the rotation R
  /// and the stretch U. `deformation` is dF, `rotation` is R^(1/segments), `stretch` is U - I.
  template <int D> struct CellIncrement {
    using Matrix = Tensor<double, D>;
    Matrix deformation;
    Matrix rotation;
    Matrix stretch;
    int segments;
  };

  template <int D> class CellPath {
   public:
    using Matrix = Tensor<double, D>;

    CellPath() = default;
    RVE_INLINE CellPath(const Matrix &cell, const CellIncrement<D> &increment, int substeps,
                        double dt) :
        start(cell),
        path(increment), num_substeps(substeps), time(dt * substeps), segment(0),
        left(Matrix::identity()), turn(Matrix::identity())
    {
      right = knot(1);
    }

    /// Returns H after substep number `step`, which is 1-based. Calls must be in ascending order.
    RVE_INLINE Matrix cell(int step)
    {
      while (static_cast<long long>(step) * path.segments >
             static_cast<long long>(segment + 1) * num_substeps) {
        ++segment;
        left = right;
        right = knot(segment + 1);
      }
      if (step == num_substeps) return end();
      const double along = static_cast<double>(step) * path.segments / num_substeps - segment;
      return (left + along * (right - left)) * start;
    }

    /// Calls cell() out of line, for kernels that have no registers to spare.
    RVE_COLD Matrix cell_apart(int step) { return cell(step); }

    /// Index of the segment that cell() used last.
    RVE_INLINE int present_segment() const { return segment; }

    /// Returns H after all substeps.
    RVE_INLINE Matrix end() const { return path.deformation * start; }

    /// Returns dH/dt on the current segment.
    RVE_INLINE Matrix cell_rate() const
    {
      return (path.segments / time) * ((right - left) * start);
    }

    /// Applies a lattice reduction to the initial cell matrix H, as H M; all other members are
    /// relative to this matrix.
    template <class Map> RVE_INLINE void map_start(const Map &map) { start = map(start); }

   private:
    /// Returns the deformation at the end of the first j segments: R^(j/m) (I + j/m (U - I)) for a
    /// path of m segments. Calls must be in ascending order of j, one by one.
    RVE_INLINE Matrix knot(int j)
    {
      if (j >= path.segments) return path.deformation;
      turn = path.rotation * turn;
      return turn * (Matrix::identity() + (static_cast<double>(j) / path.segments) * path.stretch);
    }

    Matrix start;
    CellIncrement<D> path;
    int num_substeps;
    double time;
    int segment;
    Matrix left, right, turn;
  };

}    // namespace RVE_ISA
}    // namespace rve
