// SPDX-License-Identifier: GPL-2.0-only
// Compares the grid nodes that ranks share with the nodes that points and loads actually reach.

#include "scene.h"

#include "mpm/shared_nodes.h"

#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <set>

using mpm::Communication;
using mpm::Face;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::ShapeFunction;
using SharedNodes = mpm::SharedNodes<2>;
using mpm::Vec2;
using mpm_test::RankTeam;
using mpm_test::Scene;

namespace {

constexpr double H = 0.1;
const Face ALL_FACES[] = {Face::XLo, Face::XHi, Face::YLo, Face::YHi};

mpm::SolverOptions<2> options_for(ShapeFunction shape)
{
  mpm::SolverOptions<2> options = mpm_test::grid_options({{-0.3, 0.2}}, {{0.4, 0.7}}, H);
  options.shape = shape;
  return options;
}

mpm::Grid<2> grid_of(const mpm::SolverOptions<2> &options)
{
  return {options.lo, options.hi, options.cell_size};
}

/// Returns the nodes that get mass from one point or force from tractions on its four faces, as
/// found by the solver.
std::set<int> reached_nodes(Scene scene, ShapeFunction shape)
{
  MpmSolver solver(options_for(shape));
  mpm::LinearElastic<2> law(1e6, 0.3);
  solver.set_models({&law});
  std::vector<mpm::TractionLoad<2>> loads;
  for (const Face face : ALL_FACES) loads.push_back({{{7.0, 1.0}}, face, false, {0}});
  solver.evaluate(scene.view(), loads, 1e-4);
  std::set<int> reached;
  const mpm::Grid<2> &grid = solver.grid();
  for (int j = -1; j <= grid.cells(1) + 1; ++j)
    for (int i = -1; i <= grid.cells(0) + 1; ++i) {
      const Vec2 force = solver.node_force({{i, j}});
      if (solver.node_mass({{i, j}}) != 0.0 || force[0] != 0.0 || force[1] != 0.0)
        reached.insert(grid.node({{i, j}}));
    }
  return reached;
}

/// Returns critical coordinates in cells: sides, nodes, middles of cells, and positions close to
/// them.
std::vector<double> places(int cells)
{
  std::vector<double> list;
  for (const double at : {0.0, 0.5, 1.0, 1.3, 1.5, cells - 1.0, cells - 0.5, double(cells)})
    for (const double beside : {-1e-12, 0.0, 1e-12})
      if (at + beside >= 0.0 && at + beside <= cells) list.push_back(at + beside);
  return list;
}

/// Returns, for each rank, the nodes whose sums it shares, as indices in the whole grid. Checks
/// that sent and received nodes match.
std::vector<std::set<int>> shared_nodes(const mpm::Grid<2> &grid, const std::vector<Scene> &points,
                                        const std::vector<mpm::RigidBodyOptions> &bodies = {})
{
  std::vector<std::set<int>> found(points.size());
  std::vector<std::vector<std::int64_t>> given(points.size() * points.size()), taken(given);
  RankTeam(static_cast<int>(points.size())).run([&](int rank, const Communication &communication) {
    Scene mine = points[rank];
    SharedNodes shared(grid, communication, bodies, 1);
    shared.find(mine.view(), mpm::ShapeFunction::Gimp);
    std::size_t gives = 0, takes = 0;
    const auto move = [&](const std::vector<int> &from, std::size_t &next, std::size_t count,
                          std::vector<std::int64_t> &to) {
      for (const std::size_t end = next + count; next < end; ++next) {
        to.push_back(grid.id(shared.part().place(from.at(next))));
        found[rank].insert(static_cast<int>(to.back()));
      }
    };
    for (const mpm::Neighbour &other : shared.neighbours()) {
      move(shared.given(), gives, other.given, given[rank * points.size() + other.rank]);
      move(shared.taken(), takes, other.taken, taken[other.rank * points.size() + rank]);
    }
    EXPECT_EQ(gives, shared.given().size());
    EXPECT_EQ(takes, shared.taken().size());
  });
  EXPECT_EQ(given, taken);
  return found;
}

bool are_empty(const std::vector<std::set<int>> &all)
{
  return std::all_of(all.begin(), all.end(), [](const std::set<int> &one) { return one.empty(); });
}

Scene points_at(const std::vector<Vec2> &places)
{
  Scene scene;
  for (const Vec2 &place : places) scene.add(place[0], place[1], {{0.5 * H, 0.5 * H}}, 1.0);
  return scene;
}

}    // namespace

TEST(SharedNodes, BoxHoldsAllNodesOfAPointAndItsLoads)
{
  for (const ShapeFunction shape : {ShapeFunction::Linear, ShapeFunction::Gimp}) {
    const mpm::Grid<2> grid = grid_of(options_for(shape));
    for (const double xi : places(grid.cells(0)))
      for (const double eta : places(grid.cells(1)))
        for (const double half : {0.1 * H, 0.5 * H * (1.0 + 0.9e-6)}) {
          Scene scene;
          const double x = std::min(grid.lo(0) + xi * H, grid.hi(0));
          const double y = std::min(grid.lo(1) + eta * H, grid.hi(1));
          scene.add(x, y, {{half, half}}, 1.0);
          scene.stress[0] = {{3.0, 1.0, 1.0, 2.0}};
          std::vector<mpm::NodeBox<2>> box(2);
          RankTeam(2).run([&](int rank, const Communication &communication) {
            Scene mine = rank == 0 ? scene : Scene();
            SharedNodes shared(grid, communication, {}, 1);
            shared.find(mine.view(), mpm::ShapeFunction::Gimp);
            box[rank] = shared.touched();
            EXPECT_EQ(shared.point_total(), 1);
          });

          const std::set<int> reached = reached_nodes(scene, shape);

          EXPECT_GE(reached.size(), 4u);
          for (const int node : reached) EXPECT_TRUE(box[0].contains(grid, node));
          EXPECT_TRUE(box[1].is_empty());
          EXPECT_FALSE(box[1].contains(grid, grid.node({{0, 0}})));
        }
  }
}

TEST(SharedNodes, BoxOfTheLargestPointHoldsThoseOfAllPoints)
{
  // If only a device has the deformation, the box follows from the largest half size of all points.
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{60 * H, 60 * H}}, H);
  Scene scene = points_at({{{20.3 * H, 25.1 * H}}, {{27.5 * H, 30.9 * H}}, {{0.2 * H, 28.0 * H}}});
  scene.deformation_gradient = {
      {{7.0, 0.5, 0.2, 0.3}}, {{0.4, 0.0, 3.0, 9.0}}, {{4.0, 0.0, 0.0, 1.0}}};
  double largest = 0.0;
  for (int p = 0; p < scene.size(); ++p)
    for (int a = 0; a < 2; ++a)
      largest = std::max(
          largest, mpm::deformed_half(grid, scene.half_size[p], scene.deformation_gradient[p], a));
  const auto box_of = [&](double half_boxes) {
    SharedNodes shared(grid, {}, {}, 1);
    shared.find(scene.view(), ShapeFunction::Cpgimp, half_boxes);
    return shared.touched();
  };
  const mpm::NodeBox<2> exact = box_of(SharedNodes::FROM_POINTS), safe = box_of(largest),
                        small = box_of(0.5);

  EXPECT_EQ(common(exact, safe).count(), exact.count());
  EXPECT_LT(common(exact, small).count(), exact.count());
  EXPECT_EQ(small.end[0], 27 + 4);
  EXPECT_GE(exact.end[1], 30 + 4 + 4) << "a box of nine cells";
  EXPECT_EQ(safe.first[0], -1) << "no box reaches beyond the ghosts";
}

TEST(SharedNodes, AreAFewColumnsBetweenTwoHalves)
{
  // Points are at centres of the cells (6, j) and (7, j). The points of the halves reach the
  // columns 5 to 8 and 6 to 9, and their loads reach one column more.
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const std::vector<Scene> halves = {points_at({{{0.5 * H, 0.5 * H}}, {{6.5 * H, 9.5 * H}}}),
                                     points_at({{{7.5 * H, 0.5 * H}}, {{19.5 * H, 9.5 * H}}})};
  mpm::RigidBodyOptions across_y, across_x;
  across_x.face = Face::XHi;

  const auto nodes = shared_nodes(grid, halves);

  std::set<int> expected;
  for (int j = -1; j <= 11; ++j)
    for (int i = 6; i <= 9; ++i) expected.insert(grid.node({{i, j}}));
  EXPECT_EQ(nodes, std::vector<std::set<int>>(2, expected));
  EXPECT_EQ(shared_nodes(grid, halves, {across_y}), nodes)
      << "both have all rows: a face between rows adds none";
  for (const auto &of_rank : shared_nodes(grid, halves, {across_x, across_y, across_x}))
    EXPECT_EQ(of_rank.size(), 13u * (4 + 4)) << "two bodies tie three columns together";
}

TEST(SharedNodes, AreThoseOfNeighboursOnly)
{
  // Four ranks in a row: the first one shares nothing with the last two.
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{80 * H, 10 * H}}, H);
  std::vector<Scene> parts;
  for (int rank = 0; rank < 4; ++rank)
    parts.push_back(
        points_at({{{(20 * rank + 0.5) * H, 0.5 * H}}, {{(20 * rank + 19.5) * H, 9.5 * H}}}));
  const auto nodes = shared_nodes(grid, parts);

  for (int rank = 0; rank < 4; ++rank) {
    EXPECT_EQ(nodes[rank].size(), 13u * 4 * (rank == 0 || rank == 3 ? 1 : 2));
    for (const int node : nodes[rank]) {
      EXPECT_GE(grid.place(node)[0], 20 * rank - 1);
      EXPECT_LE(grid.place(node)[0], 20 * rank + 22);
    }
  }
}

TEST(SharedNodes, DoNotExistForOneRankOrDistantRanks)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const Scene left = points_at({{{0.5 * H, 0.5 * H}}}), right = points_at({{{15.5 * H, 9.5 * H}}});
  Scene rigid = left;
  rigid.rigid_body[0] = 0;

  EXPECT_TRUE(are_empty(shared_nodes(grid, {left})));
  EXPECT_TRUE(are_empty(shared_nodes(grid, {left, right})));
  EXPECT_TRUE(are_empty(shared_nodes(grid, {left, Scene(), rigid})));
  EXPECT_FALSE(are_empty(shared_nodes(grid, {left, Scene(), left})));
}

TEST(SharedNodes, AreFoundForPointsWithoutAPlace)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const double nan = std::nan("");
  const Scene good = points_at({{{0.5 * H, 0.5 * H}}});

  EXPECT_TRUE(are_empty(shared_nodes(grid, {good, points_at({{{nan, 0.0}}})})));
  EXPECT_EQ(shared_nodes(grid, {good, points_at({{{0.5 * H, 0.5 * H}}, {{nan, nan}}})}),
            shared_nodes(grid, {good, good}));
  EXPECT_TRUE(are_empty(
      shared_nodes(grid, {good, points_at({{{-HUGE_VAL, 1e300}}, {{HUGE_VAL, -1e300}}})})))
      << "what is outside of the grid ends the step, and touches nothing";
}

TEST(SharedNodes, ValuesComeFromTheFirstRankThatTouches)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const std::vector<Scene> points = {points_at({{{1.5 * H, 1.5 * H}}}), Scene(),
                                     points_at({{{3.5 * H, 1.5 * H}}})};
  std::vector<std::vector<mpm::NodeValue<2, Vec2>>> all(points.size());
  std::vector<Vec2> between(points.size());
  RankTeam(3).run([&](int rank, const Communication &communication) {
    Scene mine = points[rank];
    SharedNodes shared(grid, communication, {}, 1);
    shared.find(mine.view(), mpm::ShapeFunction::Gimp);
    const std::vector<Vec2> own(shared.part().node_count(), {{rank + 1.0, -0.0}});
    all[rank] = shared.everywhere(own.data(), grid.all());
    between[rank] = shared.at(own.data(), {{3, 2}});
    EXPECT_EQ(shared.at(own.data(), {{12, 2}})[0], 0.0) << "nobody is there";
    std::size_t pieces = 0;
    shared.each_layer(
        [&](const mpm::NodeBox<2> &box) { pieces += shared.everywhere(own.data(), box).size(); });
    EXPECT_EQ(pieces, all[rank].size());
  });

  for (const auto &values : all) {
    ASSERT_EQ(values.size(), 7u * 5u) << "columns 0 to 4 of rank 0, 2 to 6 of rank 2";
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int i = static_cast<int>(k % 7), j = static_cast<int>(k / 7);
      EXPECT_EQ(values[k].place[0], i);
      EXPECT_EQ(values[k].place[1], j);
      EXPECT_EQ(values[k].value[0], i <= 4 ? 1.0 : 3.0);
      EXPECT_TRUE(std::signbit(values[k].value[1])) << "bits, not numbers";
    }
  }
  for (const Vec2 &value : between) {
    EXPECT_EQ(value[0], 1.0);
    EXPECT_TRUE(std::signbit(value[1]));
  }
}
