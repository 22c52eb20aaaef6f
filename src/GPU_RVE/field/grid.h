// SPDX-License-Identifier: GPL-2.0-only
// Regular grid of a random field in the plane.

#pragma once

#include "rve/core/error.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>

namespace field {

constexpr int AXES = 2;                            ///< number of axes: x (horizontal), y (vertical)
using Vec = std::array<double, AXES>;              ///< position or lag [length]
using Size = std::array<std::int64_t, AXES>;       ///< number of points along each axis
constexpr std::int64_t MAX_POINTS = 2147483647;    ///< limit of FFTW along one axis, an int

/// Product of the numbers of points.
inline std::int64_t total(const Size &size)
{
  std::int64_t product = 1;
  for (const std::int64_t points : size) product *= points;
  return product;
}

/// Text such as "240 x 120" for messages.
inline std::string to_string(const Size &size)
{
  std::string text;
  for (const std::int64_t points : size)
    text += (text.empty() ? "" : " x ") + std::to_string(points);
  return text;
}

struct Grid {
  Vec origin{};     ///< position of the first node [length]
  Vec spacing{};    ///< [length]
  Size nodes{};

  /// Smallest grid whose cells cover the rectangle from `lo` to `hi`. Throws InputError if the
  /// extent or the spacing is not positive, the spacing exceeds the extent, or there are too many
  /// cells.
  static Grid covering(const Vec &lo, const Vec &hi, const Vec &spacing)
  {
    Grid grid;
    grid.origin = lo;
    grid.spacing = spacing;
    for (int a = 0; a < AXES; ++a) {
      const std::string axis = a == 0 ? "x" : "y";
      rve::require(spacing[a] > 0.0 && std::isfinite(spacing[a]), "grid spacing in ", axis,
                   " must be positive, got ", spacing[a]);
      const double extent = hi[a] - lo[a];
      rve::require(extent > 0.0 && std::isfinite(extent), "domain must have a positive extent in ",
                   axis, ", got ", lo[a], " to ", hi[a]);
      rve::require(spacing[a] <= extent, "grid spacing in ", axis,
                   " must be at most the extent of the domain, ", extent, ", got ", spacing[a]);
      // tolerance for the rounding of an extent that is a whole number of cells
      const double cells = std::ceil(extent / spacing[a] * (1.0 - 1e-12));
      rve::require(cells < static_cast<double>(MAX_POINTS), "grid would have ", cells, " cells in ",
                   axis, "; it must have at most 2147483646");
      grid.nodes[a] = static_cast<std::int64_t>(cells) + 1;
    }
    return grid;
  }

  double extent(int axis) const { return static_cast<double>(nodes[axis] - 1) * spacing[axis]; }

  /// Index of a node in an array of all nodes, in which x is the fastest index.
  std::int64_t index(const Size &node) const { return node[1] * nodes[0] + node[0]; }

  /// True if the cells contain the position, with a tolerance for rounding.
  bool contains(const Vec &position) const
  {
    for (int a = 0; a < AXES; ++a) {
      const double s = (position[a] - origin[a]) / spacing[a];
      const double cells = static_cast<double>(nodes[a] - 1);
      // 1e-9 cells are much more than the rounding of a position and much less than a correlation
      // length
      if (!(s >= -1e-9 && s <= cells + 1e-9)) return false;
    }
    return true;
  }
};

}    // namespace field
