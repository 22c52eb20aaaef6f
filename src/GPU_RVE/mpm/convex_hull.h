// SPDX-License-Identifier: GPL-2.0-only
// The convex hull of a few vertices, as half spaces that have a body in common. On the host, once for each body.

#pragma once

#include "mpm/rigid_shape.h"

#include <bitset>
#include <cstddef>
#include <string>
#include <vector>

namespace mpm {

/// All triples of vertices are tried: this many take a tenth of a second.
constexpr int MOST_VERTICES = 128;

template <int D> struct ConvexHull {
  struct Side {
    HalfSpace<D> plane;
    std::bitset<MOST_VERTICES> on;    ///< vertices on it
    int sweeps = 0;                   ///< in how many directions `extend` made it longer
  };

  Vec<D> middle = Vec<D>::zero();    ///< of the box around the vertices along the axes [length]
  Vec<D> half = Vec<D>::zero();      ///< half sizes of this box [length]
  std::vector<Vec<D>> vertices;      ///< as given, from the middle [length]
  std::vector<Side> sides;           ///< distances of their planes are from the middle

  /// From one side to the vertex that is farthest from it, the least of all sides [length].
  double least_width() const;

  /// The body goes on behind one of its sides, by `distance` [length] along its normal. What would become wider there keeps its width:
  /// a side that leans outwards ends where it meets this one, and the hull of its edge and of the edge moved takes its place.
  void extend(std::size_t side, double distance);
};

/// In the frame of the vertices [length]. Vertices inside are of no account, and faces that are flat within 1e-6 of the size of the body
/// are one face. rve::InputError, which calls the body `name`: too few, too many, not finite, or all in one plane (in the plane, line).
template <int D>
ConvexHull<D> convex_hull(const std::vector<Vec<D>> &vertices, const std::string &name);

}    // namespace mpm
