// SPDX-License-Identifier: GPL-2.0-only
// Convex hulls of vertices, given as intersections of half spaces.

#include "mpm/convex_hull.h"

#include "rve/core/error.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

using mpm::convex_hull;
using mpm::ConvexHull;
using mpm::HalfSpace;
using mpm::Vec;

namespace {

template <int D> std::vector<Vec<D>> random_points(int count, unsigned seed, double size = 1.0)
{
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> number(-size, size);
  std::vector<Vec<D>> points(count);
  for (Vec<D> &point : points)
    for (int a = 0; a < D; ++a) point[a] = number(generator);
  return points;
}

/// Returns true if the hull has a plane with this normal at this distance from the origin of the
/// vertices.
template <int D> bool has_plane(const ConvexHull<D> &hull, const Vec<D> &normal, double distance)
{
  return std::any_of(hull.sides.begin(), hull.sides.end(), [&](const auto &side) {
    const Vec<D> difference = side.plane.normal - normal;
    return dot(difference, difference) < 1e-24 &&
        std::abs(side.plane.distance + dot(side.plane.normal, hull.middle) - distance) < 1e-12;
  });
}

template <int D> int corners(const ConvexHull<D> &hull)
{
  std::bitset<mpm::MOST_VERTICES> on;
  for (const auto &side : hull.sides) on |= side.on;
  return static_cast<int>(on.count());
}

std::vector<Vec<2>> polygon(int count, double radius)
{
  std::vector<Vec<2>> vertices;
  for (int k = 0; k < count; ++k) {
    const double angle = 2.0 * std::acos(-1.0) * k / count;
    vertices.push_back({{radius * std::cos(angle), radius * std::sin(angle)}});
  }
  return vertices;
}

}    // namespace

TEST(ConvexHull, TriangleHasTheLinesThroughItsVertices)
{
  const ConvexHull<2> hull =
      convex_hull<2>({{{1.0, 1.0}}, {{4.0, 1.0}}, {{1.0, 5.0}}}, "rigid body wedge");

  ASSERT_EQ(hull.sides.size(), 3u);
  EXPECT_TRUE(has_plane<2>(hull, {{-1.0, 0.0}}, -1.0));
  EXPECT_TRUE(has_plane<2>(hull, {{0.0, -1.0}}, -1.0));
  EXPECT_TRUE(has_plane<2>(hull, {{0.8, 0.6}}, 3.8));
  EXPECT_DOUBLE_EQ(hull.middle[0], 2.5);
  EXPECT_DOUBLE_EQ(hull.half[1], 2.0);
  EXPECT_NEAR(hull.least_width(), 12.0 / 5.0, 1e-14) << "twice the area over the longest side";
}

TEST(ConvexHull, HasAllFacesOfRandomPointsAndNoOther)
{
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto in_plane = convex_hull<2>(random_points<2>(20, seed), "body");
    const auto in_space = convex_hull<3>(random_points<3>(20, seed), "body");
    EXPECT_EQ(static_cast<int>(in_plane.sides.size()), corners(in_plane));
    EXPECT_EQ(static_cast<int>(in_space.sides.size()), 2 * corners(in_space) - 4)
        << "Euler's formula for triangles";
    for (const auto &side : in_space.sides) {
      EXPECT_EQ(side.on.count(), 3u);
      EXPECT_NEAR(dot(side.plane.normal, side.plane.normal), 1.0, 1e-11);
      for (const Vec<3> &vertex : in_space.vertices)
        EXPECT_LE(dot(side.plane.normal, vertex), side.plane.distance + 1e-15);
    }
  }
}

TEST(ConvexHull, PointsInsideAndOnFacesDoNotChangeTheHull)
{
  std::vector<Vec<3>> vertices;
  for (int corner = 0; corner < 8; ++corner)
    vertices.push_back({{corner & 1 ? 0.9 : 0.2, corner & 2 ? 0.7 : 0.3, corner & 4 ? 1.4 : 0.1}});
  const auto box = convex_hull(vertices, "body");
  vertices.push_back({{0.5, 0.5, 0.5}});
  vertices.push_back({{0.2, 0.4, 0.6}});    // on a face
  vertices.push_back({{0.9, 0.7, 1.0}});    // on an edge
  vertices.push_back(vertices[3]);
  std::reverse(vertices.begin(), vertices.end());
  const auto more = convex_hull(vertices, "body");

  ASSERT_EQ(box.sides.size(), 6u);
  ASSERT_EQ(more.sides.size(), 6u);
  for (const auto &side : box.sides)
    EXPECT_TRUE(has_plane(more, side.plane.normal,
                          side.plane.distance + dot(side.plane.normal, box.middle)));
  EXPECT_TRUE(has_plane<3>(more, {{0.0, -1.0, 0.0}}, -0.3));
  EXPECT_NEAR(box.least_width(), 0.4, 1e-15);
}

TEST(ConvexHull, FacesWithManyVerticesAreOneFace)
{
  // The bodies are a dodecahedron and a prism of 24 sides. Their coordinates have six digits, as in
  // a script.
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  std::vector<Vec<3>> dodecahedron, prism;
  for (const double i : {-1.0, 1.0})
    for (const double j : {-1.0, 1.0}) {
      for (const double k : {-1.0, 1.0}) dodecahedron.push_back({{i, j, k}});
      dodecahedron.push_back({{0.0, i / golden, j * golden}});
      dodecahedron.push_back({{i / golden, j * golden, 0.0}});
      dodecahedron.push_back({{i * golden, 0.0, j / golden}});
    }
  for (const Vec<2> &vertex : polygon(24, 1.0))
    for (const double z : {0.0, 2.0})
      prism.push_back(
          {{1e-6 * std::round(1e6 * vertex[0]), 1e-6 * std::round(1e6 * vertex[1]), z}});

  EXPECT_EQ(convex_hull(dodecahedron, "body").sides.size(), 12u);
  EXPECT_EQ(convex_hull(prism, "body").sides.size(), 26u);
}

TEST(ConvexHull, ContinuesBeyondAPlaneWithTheWidthAtThePlane)
{
  // The half of a wedge that remains after a cut at x = 0 is extended by 0.2 beyond the cut. The
  // tip must continue as a horizontal edge and must not become longer.
  ConvexHull<2> half = convex_hull<2>({{{0.0, 0.0}}, {{1.0, 2.0}}, {{0.0, 2.0}}}, "body");
  const auto cut = std::find_if(half.sides.begin(), half.sides.end(),
                                [](const auto &side) { return side.plane.normal[0] == -1.0; });
  ASSERT_NE(cut, half.sides.end());
  half.extend(cut - half.sides.begin(), 0.2);

  EXPECT_EQ(half.sides.size(), 4u);
  EXPECT_TRUE(has_plane<2>(half, {{-1.0, 0.0}}, 0.2));
  EXPECT_TRUE(has_plane<2>(half, {{0.0, -1.0}}, 0.0));
  EXPECT_TRUE(has_plane<2>(half, {{0.0, 1.0}}, 2.0));

  // A pyramid stands on its tip. The quarter that remains after cuts at x = 0 and y = 0 is extended
  // beyond both cuts.
  ConvexHull<3> quarter = convex_hull<3>({{{0.0, 0.0, 0.0}},
                                          {{0.0, 0.0, 2.0}},
                                          {{1.0, 0.0, 2.0}},
                                          {{1.0, 1.0, 2.0}},
                                          {{0.0, 1.0, 2.0}}},
                                         "body");
  ASSERT_EQ(quarter.sides.size(), 5u);
  for (std::size_t k = 0; k < 5; ++k)
    if (quarter.sides[k].plane.normal[0] == -1.0 || quarter.sides[k].plane.normal[1] == -1.0)
      quarter.extend(k, 0.2);
  EXPECT_TRUE(has_plane<3>(quarter, {{-1.0, 0.0, 0.0}}, 0.2));
  EXPECT_TRUE(has_plane<3>(quarter, {{0.0, -1.0, 0.0}}, 0.2));
  EXPECT_TRUE(has_plane<3>(quarter, {{0.0, 0.0, -1.0}}, 0.0)) << "below the tip";
  for (const auto &side : quarter.sides)
    for (const double x : {-0.2, 0.0})
      for (const double y : {-0.2, 0.0}) {
        const Vec<3> place = Vec<3>{{x, y, 0.0}} - quarter.middle;
        EXPECT_LE(dot(side.plane.normal, place), side.plane.distance + 1e-12);
      }
}

TEST(ConvexHull, RefusesPointsWithoutVolume)
{
  const auto message = [](const auto &vertices) {
    try {
      convex_hull(vertices, "rigid body wedge");
    } catch (const rve::InputError &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  using Plane = std::vector<Vec<2>>;
  using Space = std::vector<Vec<3>>;
  EXPECT_EQ(message(Plane{{{0.0, 0.0}}, {{1.0, 0.0}}}),
            "rigid body wedge must have 3 to 128 vertices, got 2");
  EXPECT_EQ(message(Space(129, Vec<3>::zero())),
            "rigid body wedge must have 4 to 128 vertices, got 129");
  EXPECT_EQ(
      message(Plane{{{0.0, 0.0}}, {{1.0, std::numeric_limits<double>::quiet_NaN()}}, {{0.0, 1.0}}}),
      "vertex 2 of rigid body wedge must have finite coordinates, got nan [length]");
  EXPECT_EQ(message(Plane{{{0.0, 0.0}}, {{3.0, 4.0}}, {{1.5, 2.0}}}),
            "rigid body wedge has vertices in one line, within 2e-05 [length]: they must enclose "
            "an area");
  EXPECT_NE(message(Plane(3, Vec<2>::zero())).find("in one line"), std::string::npos);
  Space flat = random_points<3>(10, 5), straight = flat;
  for (Vec<3> &vertex : flat) vertex[2] = 0.3 * vertex[0] - vertex[1];
  for (Vec<3> &vertex : straight) vertex = vertex[0] * Vec<3>{{1.0, 2.0, 3.0}};
  EXPECT_NE(message(flat).find("in one plane"), std::string::npos);
  EXPECT_NE(message(straight).find("they must enclose a volume"), std::string::npos);
  Space sphere = random_points<3>(60, 5);
  for (Vec<3> &vertex : sphere) vertex = (1.0 / std::sqrt(dot(vertex, vertex))) * vertex;
  EXPECT_EQ(message(sphere), "rigid body wedge must have at most 64 faces, got 116");
}
