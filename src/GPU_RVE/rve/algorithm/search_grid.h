// SPDX-License-Identifier: GPL-2.0-only
// Search grid of a Verlet list.

#pragma once

#include "rve/core/config.h"
#include "rve/core/fixed_point.h"
#include "rve/core/vec.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Regular grid in fractional space whose cells are at least `cutoff` wide. If an axis has fewer
  /// than three cells, all of them are neighbours.
  template <int D> struct SearchGrid {
    int count[D];

    SearchGrid() = default;
    /// Chooses the numbers of grid cells along the axes for a periodic cell with perpendicular
    /// widths `width`. The grid has at most `capacity` cells.
    RVE_INLINE SearchGrid(const Vec<double, D> &width, double cutoff, int capacity)
    {
      for (int a = 0; a < D; ++a) {
        const double fit = width[a] / (cutoff * (1.0 + 1e-6));
        count[a] = fit < 1.0 ? 1 : (fit > 1024.0 ? 1024 : static_cast<int>(fit));
      }
      // In space the product of the counts can exceed 31 bits.
      while (size<std::int64_t>() > capacity) {
        int most = count[0];
        for (int a = 1; a < D; ++a) most = count[a] > most ? count[a] : most;
        // The last of the axes with the most cells gets one cell fewer. No index is computed, so
        // that the counts can be in registers.
        bool is_less = false;
        for (int a = D - 1; a >= 0; --a) {
          const bool is_this = !is_less && count[a] == most;
          count[a] -= is_this ? 1 : 0;
          is_less = is_less || is_this;
        }
      }
    }

    template <class Integer = int> RVE_INLINE Integer size() const
    {
      Integer product = 1;
      for (int a = 0; a < D; ++a) product *= count[a];
      return product;
    }

    /// Returns the index of the cell along axis a that contains a point.
    template <class Coordinate> RVE_INLINE int place(const Vec<Coordinate, D> &s, int a) const
    {
      return static_cast<int>((static_cast<std::uint64_t>(leading_bits(s[a])) * count[a]) >> 32);
    }

    /// Returns the index of a cell; x runs fastest.
    template <class Coordinate> RVE_INLINE int index(const Vec<Coordinate, D> &s) const
    {
      int cell = 0;
      for (int a = D - 1; a >= 0; --a) cell = cell * count[a] + place(s, a);
      return cell;
    }

    /// Returns true if every axis has at least three cells. No cell is then a neighbour of another
    /// cell on both sides, and of two neighbours exactly one is ahead of the other.
    RVE_INLINE bool has_sides() const
    {
      bool wide = true;
      for (int a = 0; a < D; ++a) wide = wide && count[a] >= 3;
      return wide;
    }

    /// Calls visit(layer, first, count, own) for each row of cells that can contain neighbours of a
    /// point. The row begins with the cell of index `layer`. `count` of its cells are to be
    /// visited, from cell `first` of the row on, cyclically. With `ahead`, which requires
    /// has_sides(), only the cell of the point and cells ahead of it are visited. The first cell of
    /// the first row is then the cell of the point, and `own` is true for this row only.
    template <class Coordinate, class Visit>
    RVE_INLINE void rows_around(const Vec<Coordinate, D> &point, bool ahead, Visit visit) const
    {
      int home[D];
      for (int a = 0; a < D; ++a) home[a] = place(point, a);
      rows_along<D - 1>(home, 0, ahead, visit);
    }

   private:
    /// Visits the cells in layer `layer` of the axes after this one.
    template <int Axis, class Visit>
    RVE_INLINE void rows_along(const int (&home)[D], int layer, bool ahead, Visit &visit) const
    {
      const int n = count[Axis], reach = n < 3 ? n : 3;
      // The index is taken modulo n, without a division.
      const int before = home[Axis] == 0 ? n - 1 : home[Axis] - 1;
      if constexpr (Axis == 0) {
        visit(layer * n, ahead ? home[0] : before, ahead ? 2 : reach, ahead);
      } else {
        const int first = ahead ? 1 : 0;
        for (int d = first, next = ahead ? home[Axis] : before; d < reach;
             ++d, next = next + 1 < n ? next + 1 : 0)
          rows_along<Axis - 1>(home, layer * n + next, ahead && d == first, visit);
      }
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
