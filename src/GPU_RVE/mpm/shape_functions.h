// SPDX-License-Identifier: GPL-2.0-only
// Shape functions of the background grid along one axis. The shape function of a node in D
// dimensions is the product of its shape functions along the D axes.
//
// Coordinates are distances from the low side of the grid in cell widths; slopes are per cell
// width.

#pragma once

#include "rve/core/config.h"

#include <cmath>

namespace mpm {

/// Kind of shape functions. Linear: hat functions. Gimp: averaged over the initial box of the
/// point. Cpgimp: averaged over a box that follows the deformation of the point.
enum class ShapeFunction { Linear, Gimp, Cpgimp };

/// Values and slopes at three successive nodes.
struct AxisWeights {
  int first;          ///< index of the first node
  double value[3];    ///< values, whose sum is 1
  double slope[3];    ///< slopes, whose sum is 0 [1/cell]

  RVE_HD int heaviest() const
  {
    const int of_two = value[1] > value[0] ? 1 : 0;
    return value[2] > value[of_two] ? 2 : of_two;
  }
};

/// Hat functions at coordinate xi in [0, cells]. A point on a node belongs to the cell above the
/// node. A point on the high side of the grid belongs to the last cell. The third node has the
/// weight 0.
///
/// A point is kept 2⁻²⁴ cells away from the nodes of its cell. If the point were on a node, the
/// other end of the cell would have a slope but no mass. Without mass this end would have no
/// velocity and no response to forces.
RVE_HD inline AxisWeights linear_weights(double xi, int cells)
{
  constexpr double MARGIN = 0x1p-24;
  const int floor = static_cast<int>(std::floor(xi));
  const int cell = floor < cells - 1 ? floor : cells - 1;
  const double place = xi - cell;
  const double above = place < MARGIN ? MARGIN : place > 1.0 - MARGIN ? 1.0 - MARGIN : place;
  return {cell, {1.0 - above, above, 0.0}, {-1.0, 1.0, 0.0}};
}

/// uGIMP: the hat function averaged over [xi - half, xi + half], 0 < half <= 1/2, and its
/// derivative (Bardenhagen & Kober 2004, CMES 5, 477, contiguous particles of fixed size). At the
/// distance d from the node [cells] its value is S:
///   d < half              S = 1 - (d² + half²) / (2 half)
///   half <= d < 1 - half  S = 1 - d
///   d < 1 + half          S = (1 + half - d)² / (4 half)
/// Only the nearest node and its two neighbours can have a value above 0.
RVE_HD inline AxisWeights gimp_weights(double xi, double half)
{
  const int nearest = static_cast<int>(std::floor(xi + 0.5));
  AxisWeights weights;
  weights.first = nearest - 1;
  for (int k = 0; k < 3; ++k) {
    const double offset = xi - (weights.first + k);
    const double d = std::abs(offset);
    const double sign = offset < 0.0 ? -1.0 : 1.0;
    if (d < half) {
      weights.value[k] = 1.0 - (offset * offset + half * half) / (2.0 * half);
      weights.slope[k] = -offset / half;
    } else if (d < 1.0 - half) {
      weights.value[k] = 1.0 - d;
      weights.slope[k] = -sign;
    } else if (d < 1.0 + half) {
      const double reach = 1.0 + half - d;
      weights.value[k] = reach * reach / (4.0 * half);
      weights.slope[k] = -sign * reach / (2.0 * half);
    } else {
      weights.value[k] = 0.0;
      weights.slope[k] = 0.0;
    }
  }
  return weights;
}

/// GIMP weights of a ring about the axis r = 0: the hat function N and its derivative, averaged
/// over [xi - half, xi + half] with the weight r. `radius` is the radius of the middle of the ring,
/// at least `half` [cells]. The averages are those of gimp_weights() plus corrections, which are
/// odd in xi - xi_I for the value and even for the slope (Nairn & Guilkey 2015, Int. J. Numer.
/// Meth. Engng 101, 127). At the distance d from the node, with e = 1 - d, they are
///   d < half              value d (d² - 3 half²) / (6 half r)
///                         slope (d² - half²) / (2 half r)
///   half <= d < 1 - half  value -half² / (3 r)
///                         slope 0
///   d < 1 + half          value (e + half)² (e - 2 half) / (12 half r)
///                         slope (half² - e²) / (4 half r)
/// The mean of N/r with the same weight, for hoop strains, is the value of gimp_weights() divided
/// by r.
RVE_HD inline AxisWeights ring_weights(double xi, double half, double radius)
{
  AxisWeights weights = gimp_weights(xi, half);
  for (int k = 0; k < 3; ++k) {
    const double offset = xi - (weights.first + k);
    const double d = std::abs(offset);
    const double sign = offset < 0.0 ? -1.0 : 1.0;
    if (d < half) {
      weights.value[k] += offset * (d * d - 3.0 * half * half) / (6.0 * half * radius);
      weights.slope[k] += (d * d - half * half) / (2.0 * half * radius);
    } else if (d < 1.0 - half) {
      weights.value[k] -= sign * half * half / (3.0 * radius);
    } else if (d < 1.0 + half) {
      const double e = 1.0 - d;
      weights.value[k] +=
          sign * (e + half) * (e + half) * (e - 2.0 * half) / (12.0 * half * radius);
      weights.slope[k] += (half * half - e * e) / (4.0 * half * radius);
    }
  }
  return weights;
}

}    // namespace mpm
