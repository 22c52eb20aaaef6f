// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/convex_hull.h"

#include "rve/core/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mpm {

using rve::require;

namespace {

  /// Tolerance of flatness relative to the size of the body. Coordinates in scripts are more
  /// accurate than this, and cells are much larger.
  constexpr double FLAT = 1e-6;

  template <int D> double length_of(const Vec<D> &vector)
  {
    return std::sqrt(dot(vector, vector));
  }

  /// D vertices that can lie on a common face.
  template <int D> struct Candidate {
    std::array<int, D> corner;
    Vec<D> across;     ///< normal of their plane, with the length `measure`
    double measure;    ///< distance of two vertices, or twice the area of three
  };

  template <int D> std::vector<Candidate<D>> candidates(const std::vector<Vec<D>> &vertices)
  {
    std::vector<Candidate<D>> all;
    const int count = static_cast<int>(vertices.size());
    const auto add = [&](const std::array<int, D> &corner, const Vec<D> &across) {
      all.push_back({corner, across, length_of(across)});
    };
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j) {
        const Vec<D> edge = vertices[j] - vertices[i];
        if constexpr (D == 2)
          add({i, j}, {{edge[1], -edge[0]}});
        else
          for (int k = j + 1; k < count; ++k)
            add({i, j, k}, cross(edge, vertices[k] - vertices[i]));
      }
    // the widest candidates come first, since they have the most accurate normals
    std::stable_sort(all.begin(), all.end(),
                     [](const Candidate<D> &one, const Candidate<D> &other) {
                       return one.measure > other.measure;
                     });
    return all;
  }

  /// Removes round-off from a unit normal, since the choice of the nearest axis must not depend on
  /// round-off. Components below 1e-12 become zero. Magnitudes that differ by less than 1e-12
  /// become equal.
  template <int D> Vec<D> without_noise(Vec<D> normal)
  {
    constexpr double NOISE = 1e-12;
    for (int a = 0; a < D; ++a) {
      if (std::abs(normal[a]) < NOISE) normal[a] = 0.0;
      for (int b = a + 1; b < D; ++b)
        if (std::abs(std::abs(normal[a]) - std::abs(normal[b])) < NOISE)
          normal[b] = std::copysign(normal[a], normal[b]);
    }
    return normal;
  }

  /// Largest coordinate of the vertices along a normal [length].
  template <int D> double support(const std::vector<Vec<D>> &vertices, const Vec<D> &normal)
  {
    double largest = -std::numeric_limits<double>::infinity();
    for (const Vec<D> &vertex : vertices) largest = std::max(largest, dot(normal, vertex));
    return largest;
  }

}    // namespace

template <int D> double ConvexHull<D>::least_width() const
{
  double least = std::numeric_limits<double>::infinity();
  for (const Side &side : sides)
    least = std::min(least, side.plane.distance + support(vertices, -1.0 * side.plane.normal));
  return least;
}

template <int D> void ConvexHull<D>::extend(std::size_t moved, double distance)
{
  const Side end = sides[moved];
  sides[moved].plane.distance += distance;
  const std::size_t count = sides.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Side other = sides[k];
    const double lean = dot(other.plane.normal, end.plane.normal);
    const Side edge = {{}, other.on & end.on, other.sweeps + 1};
    // adjacent sides share D - 1 vertices, or fewer if extend() has lengthened the other side
    const int least = std::max(1, D - 1 - other.sweeps);
    if (k == moved || static_cast<int>(edge.on.count()) < least) continue;
    if (std::abs(lean) <= FLAT) sides[k].sweeps += 1;
    if (!(lean < -FLAT)) continue;
    const Vec<D> across = other.plane.normal - lean * end.plane.normal;
    const double length = length_of(across);
    if (!(length > FLAT)) continue;    // the opposite side
    sides.push_back(edge);
    sides.back().plane = {without_noise((1.0 / length) * across),
                          (other.plane.distance - lean * end.plane.distance) / length};
  }
  // the box grows on both sides: it must contain the body but need not be the smallest box
  for (int a = 0; a < D; ++a) half[a] += distance * std::abs(end.plane.normal[a]);
}

template <int D>
ConvexHull<D> convex_hull(const std::vector<Vec<D>> &vertices, const std::string &name)
{
  const int count = static_cast<int>(vertices.size());
  require(count > D && count <= MOST_VERTICES, name, " must have ", D + 1, " to ", MOST_VERTICES,
          " vertices, got ", count);
  Vec<D> lo = vertices[0], hi = vertices[0];
  for (int k = 0; k < count; ++k)
    for (int a = 0; a < D; ++a) {
      require(std::isfinite(vertices[k][a]), "vertex ", k + 1, " of ", name,
              " must have finite coordinates, got ", vertices[k][a], " [length]");
      lo[a] = std::min(lo[a], vertices[k][a]);
      hi[a] = std::max(hi[a], vertices[k][a]);
    }
  ConvexHull<D> hull;
  hull.middle = 0.5 * (lo + hi);
  hull.half = 0.5 * (hi - lo);
  for (const Vec<D> &vertex : vertices) hull.vertices.push_back(vertex - hull.middle);
  const double size = 2.0 * length_of(hull.half), flat = FLAT * size;

  const double least_measure = D == 2 ? flat : flat * size;
  for (const Candidate<D> &candidate : candidates(hull.vertices)) {
    if (!(candidate.measure > least_measure)) break;
    const auto is_known = [&](const typename ConvexHull<D>::Side &side) {
      return std::all_of(candidate.corner.begin(), candidate.corner.end(),
                         [&](int corner) { return side.on[corner]; });
    };
    if (std::any_of(hull.sides.begin(), hull.sides.end(), is_known)) continue;
    for (const double sign : {-1.0, 1.0}) {
      typename ConvexHull<D>::Side side;
      HalfSpace<D> &plane = side.plane;
      plane.normal = without_noise((sign / candidate.measure) * candidate.across);
      plane.distance = support(hull.vertices, plane.normal);
      if (plane.distance - dot(plane.normal, hull.vertices[candidate.corner[0]]) > flat) continue;
      for (int k = 0; k < count; ++k)
        side.on[k] = plane.distance - dot(plane.normal, hull.vertices[k]) <= 2.0 * flat;
      hull.sides.push_back(side);
    }
  }
  require(static_cast<int>(hull.sides.size()) > D && hull.least_width() > 4.0 * flat, name,
          " has vertices in one ", D == 2 ? "line" : "plane", ", within ", 4.0 * flat,
          " [length]: they must enclose ", D == 2 ? "an area" : "a volume");
  require(hull.sides.size() <= MOST_HALF_SPACES, name, " must have at most ", MOST_HALF_SPACES,
          " faces, got ", hull.sides.size());
  return hull;
}

template struct ConvexHull<2>;
template struct ConvexHull<3>;
template ConvexHull<2> convex_hull<2>(const std::vector<Vec<2>> &, const std::string &);
template ConvexHull<3> convex_hull<3>(const std::vector<Vec<3>> &, const std::string &);

}    // namespace mpm
