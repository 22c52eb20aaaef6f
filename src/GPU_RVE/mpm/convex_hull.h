// SPDX-License-Identifier: GPL-2.0-only
// Convex hulls of a few vertices as intersections of half spaces. The host computes a hull once for
// each body.

#pragma once

#include "mpm/rigid_shape.h"

#include <bitset>
#include <cstddef>
#include <string>
#include <vector>

namespace mpm {

/// Largest number of vertices. With this number, trying all triples of vertices takes a tenth of a
/// second.
constexpr int MOST_VERTICES = 128;

template <int D> struct ConvexHull {
  struct Side {
    HalfSpace<D> plane;
    std::bitset<MOST_VERTICES> on;    ///< vertices on the side
    int sweeps = 0;                   ///< number of directions in which extend() lengthened it
  };

  Vec<D> middle = Vec<D>::zero();    ///< centre of the axis-aligned bounding box [length]
  Vec<D> half = Vec<D>::zero();      ///< half sizes of this box [length]
  std::vector<Vec<D>> vertices;      ///< positions relative to `middle` [length]
  std::vector<Side> sides;           ///< planes at distances from `middle`

  /// Smallest distance between a side and the vertex farthest from it [length].
  double least_width() const;

  /// Extends the body beyond a side by `distance` [length] along its normal. The extension is not
  /// wider than this side. If an adjacent side leans outwards, a new side bounds the extension
  /// there. The new side contains the common edge and is parallel to the normal.
  void extend(std::size_t side, double distance);
};

/// Returns the hull of vertices [length] in their frame. Vertices inside the hull are ignored.
/// Faces that lie in one plane to within 1e-6 of the size of the body are merged. Throws
/// rve::InputError, with `name` as the name of the body, if there are too few or too many vertices
/// or faces, if a vertex is not finite, or if all vertices lie in one plane (3D) or line (2D).
template <int D>
ConvexHull<D> convex_hull(const std::vector<Vec<D>> &vertices, const std::string &name);

}    // namespace mpm
