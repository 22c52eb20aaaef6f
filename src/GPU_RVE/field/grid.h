// SPDX-License-Identifier: GPL-2.0-only
// The regular grid that a random field is generated on. All code of this room is for the plane; what loops over AXES does not mind a third one.

#pragma once

#include "rve/core/error.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>

namespace field {

constexpr int AXES = 2;                            ///< x (horizontal), y (vertical)
using Vec = std::array<double, AXES>;              ///< position or lag [length]
using Size = std::array<std::int64_t, AXES>;       ///< number of points along each axis
constexpr std::int64_t MAX_POINTS = 2147483647;    ///< along one axis, which FFTW counts in int

/// Product of the numbers of points.
inline std::int64_t total(const Size &size)
{
  std::int64_t product = 1;
  for (const std::int64_t points : size) product *= points;
  return product;
}

/// "240 x 120", for messages.
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

  /// The smallest grid whose cells cover the rectangle from lo to hi.
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
      // an extent of whole cells but for rounding is one of whole cells
      const double cells = std::ceil(extent / spacing[a] * (1.0 - 1e-12));
      rve::require(cells < static_cast<double>(MAX_POINTS), "grid would have ", cells, " cells in ",
                   axis, ", allowed are 2147483646");
      grid.nodes[a] = static_cast<std::int64_t>(cells) + 1;
    }
    return grid;
  }

  double extent(int axis) const { return static_cast<double>(nodes[axis] - 1) * spacing[axis]; }

  /// Place of a node in an array of all nodes: x runs fastest.
  std::int64_t index(const Size &node) const
  {
    std::int64_t place = 0;
    for (int a = AXES - 1; a >= 0; --a) place = place * nodes[a] + node[a];
    return place;
  }

  /// Whether the cells hold this position, with an allowance for its rounding.
  bool contains(const Vec &position) const
  {
    for (int a = 0; a < AXES; ++a) {
      const double s = (position[a] - origin[a]) / spacing[a];
      const double cells = static_cast<double>(nodes[a] - 1);
      // 1e-9 cells: far more than the rounding of a position, far less than a field can vary over
      if (!(s >= -1e-9 && s <= cells + 1e-9)) return false;
    }
    return true;
  }
};

}    // namespace field
