// SPDX-License-Identifier: GPL-2.0-only
// Interpolation of a field between the nodes of its grid.

#pragma once

#include "field/covariance.h"
#include "field/grid.h"

#include <algorithm>
#include <array>
#include <vector>

namespace field {

/// Indices (Grid::index()) of the four nodes of a cell and their interpolation weights. Order of
/// (x, y): (low, low), (high, low), (low, high), (high, high).
struct Stencil {
  std::array<std::int64_t, 4> node;
  std::array<double, 4> weight;
};

/// Bilinear shape functions of the cell that contains the position.
inline Stencil linear_stencil(const Grid &grid, const Vec &position)
{
  Size lo;
  Vec s;    // coordinates in the cell, 0 to 1
  for (int a = 0; a < AXES; ++a) {
    const double cells = static_cast<double>(grid.nodes[a] - 1);
    const double scaled = std::clamp((position[a] - grid.origin[a]) / grid.spacing[a], 0.0, cells);
    const double cell = std::min(std::floor(scaled), cells - 1.0);
    lo[a] = static_cast<std::int64_t>(cell);
    s[a] = scaled - cell;
  }
  const std::int64_t first = grid.index(lo), row = grid.nodes[0];
  return {{first, first + 1, first + row, first + row + 1},
          {(1.0 - s[0]) * (1.0 - s[1]), s[0] * (1.0 - s[1]), (1.0 - s[0]) * s[1], s[0] * s[1]}};
}

/// Index of the nearest node. Half way between two nodes it is the upper one.
inline std::int64_t nearest_node(const Grid &grid, const Vec &position)
{
  Size node;
  for (int a = 0; a < AXES; ++a) {
    const double near = std::floor((position[a] - grid.origin[a]) / grid.spacing[a] + 0.5);
    node[a] =
        static_cast<std::int64_t>(std::clamp(near, 0.0, static_cast<double>(grid.nodes[a] - 1)));
  }
  return grid.index(node);
}

enum class InterpolationKind { Linear, Nearest };

/// Interpolates a field of variance 1 at positions between the nodes. Linear interpolation reduces
/// the variance to sum_ab w_a w_b C_ab <= 1, where w_a is the weight of node a of the cell and C_ab
/// is the covariance between nodes a and b. The interpolated value is divided by the square root of
/// this variance. It then has the variance 1 and the given distribution at any position.
class Interpolation {
 public:
  Interpolation(InterpolationKind kind, const Grid &grid, const Covariance &covariance) :
      kind_(kind), grid_(grid)
  {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        covariance_[a][b] = covariance(
            Vec{((b & 1) - (a & 1)) * grid.spacing[0], ((b >> 1) - (a >> 1)) * grid.spacing[1]});
  }

  /// Precondition: the grid contains the position (Grid::contains()).
  double value(const std::vector<double> &field, const Vec &position) const
  {
    if (kind_ == InterpolationKind::Nearest) return field[nearest_node(grid_, position)];
    const Stencil stencil = linear_stencil(grid_, position);
    double sum = 0.0, variance = 0.0;
    for (int a = 0; a < 4; ++a) {
      sum += stencil.weight[a] * field[stencil.node[a]];
      for (int b = 0; b < 4; ++b)
        variance += stencil.weight[a] * stencil.weight[b] * covariance_[a][b];
    }
    return sum / std::sqrt(variance);
  }

 private:
  InterpolationKind kind_;
  Grid grid_;
  double covariance_[4][4];    ///< between the nodes of a cell
};

}    // namespace field
