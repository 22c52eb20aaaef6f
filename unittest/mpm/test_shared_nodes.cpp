// Which nodes of the grid the ranks share, against what points and loads really reach.

#include "scene.h"

#include "mpm/shared_nodes.h"

#include <cstring>
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

/// Nodes on which one point puts mass, or a force of tractions on its four faces, by the solver itself.
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

/// Coordinates in cells where something may change: sides, nodes, middles of cells, and a little beside them.
std::vector<double> places(int cells)
{
  std::vector<double> list;
  for (const double at : {0.0, 0.5, 1.0, 1.3, 1.5, cells - 1.0, cells - 0.5, double(cells)})
    for (const double beside : {-1e-12, 0.0, 1e-12})
      if (at + beside >= 0.0 && at + beside <= cells) list.push_back(at + beside);
  return list;
}

/// The shared nodes of boxes of points [lo x, hi x] x [lo y, hi y], one box per rank, as rank 0 finds them.
std::vector<int> shared_nodes(const mpm::Grid<2> &grid, const std::vector<Scene> &points,
                              const std::vector<mpm::RigidBodyOptions> &bodies = {})
{
  std::vector<std::vector<int>> found(points.size());
  RankTeam(static_cast<int>(points.size())).run([&](int rank, const Communication &communication) {
    Scene mine = points[rank];
    SharedNodes shared(grid, communication, bodies, 1);
    shared.find(mine.view(), mpm::ShapeFunction::Gimp);
    found[rank] = shared.nodes();
  });
  for (const std::vector<int> &other : found) EXPECT_EQ(other, found[0]);
  return found[0];
}

Scene points_at(const std::vector<Vec2> &places)
{
  Scene scene;
  for (const Vec2 &place : places) scene.add(place[0], place[1], {{0.5 * H, 0.5 * H}}, 1.0);
  return scene;
}

}    // namespace

TEST(SharedNodes, BoxHoldsAllThatAPointAndItsLoadsReach)
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

TEST(SharedNodes, AreAFewColumnsBetweenTwoHalves)
{
  // centres of the cells (6, j) and (7, j); their points reach columns 5 to 8 and 6 to 9, and loads one more
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const std::vector<Scene> halves = {points_at({{{0.5 * H, 0.5 * H}}, {{6.5 * H, 9.5 * H}}}),
                                     points_at({{{7.5 * H, 0.5 * H}}, {{19.5 * H, 9.5 * H}}})};
  mpm::RigidBodyOptions across_y, across_x;
  across_x.face = Face::XHi;

  const std::vector<int> nodes = shared_nodes(grid, halves);

  std::vector<int> expected;
  for (int j = -1; j <= 11; ++j)
    for (int i = 6; i <= 9; ++i) expected.push_back(grid.node({{i, j}}));
  EXPECT_EQ(nodes, expected);
  EXPECT_EQ(shared_nodes(grid, halves, {across_y}), expected)
      << "both have all rows: a face between rows adds none";
  EXPECT_EQ(shared_nodes(grid, halves, {across_x, across_y, across_x}).size(), 13u * (4 + 4))
      << "two bodies tie three columns together";
}

TEST(SharedNodes, AreNoneOfOneRankOrFarApart)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const Scene left = points_at({{{0.5 * H, 0.5 * H}}}), right = points_at({{{15.5 * H, 9.5 * H}}});
  Scene rigid = left;
  rigid.rigid_body[0] = 0;

  EXPECT_TRUE(shared_nodes(grid, {left}).empty());
  EXPECT_TRUE(shared_nodes(grid, {left, right}).empty());
  EXPECT_TRUE(shared_nodes(grid, {left, Scene(), rigid}).empty());
  EXPECT_FALSE(shared_nodes(grid, {left, Scene(), left}).empty());
}

TEST(SharedNodes, AreFoundForPointsWithoutAPlace)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const double nan = std::nan("");
  const Scene good = points_at({{{0.5 * H, 0.5 * H}}});

  EXPECT_TRUE(shared_nodes(grid, {good, points_at({{{nan, 0.0}}})}).empty());
  EXPECT_EQ(shared_nodes(grid, {good, points_at({{{0.5 * H, 0.5 * H}}, {{nan, nan}}})}),
            shared_nodes(grid, {good, good}));
  EXPECT_FALSE(
      shared_nodes(grid, {good, points_at({{{-HUGE_VAL, 1e300}}, {{HUGE_VAL, -1e300}}})}).empty());
}

TEST(SharedNodes, ValuesComeFromTheFirstRankThatTouches)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{20 * H, 10 * H}}, H);
  const std::vector<Scene> points = {points_at({{{1.5 * H, 1.5 * H}}}), Scene(),
                                     points_at({{{3.5 * H, 1.5 * H}}})};
  std::vector<std::vector<Vec2>> all(points.size());
  RankTeam(3).run([&](int rank, const Communication &communication) {
    Scene mine = points[rank];
    SharedNodes shared(grid, communication, {}, 1);
    shared.find(mine.view(), mpm::ShapeFunction::Gimp);
    const std::vector<Vec2> own(grid.node_count(), {{rank + 1.0, -0.0}});
    shared.everywhere(own.data(), all[rank]);
  });

  for (const std::vector<Vec2> &values : all)
    for (int j = -1; j <= grid.cells(1) + 1; ++j)
      for (int i = -1; i <= grid.cells(0) + 1; ++i) {
        // columns 0 to 4 of rank 0, 2 to 6 of rank 2
        const bool touched = j >= 0 && j <= 4 && i >= 0 && i <= 6;
        const Vec2 &value = values[grid.node({{i, j}})];
        EXPECT_EQ(value[0], !touched ? 0.0 : i <= 4 ? 1.0 : 3.0);
        EXPECT_EQ(std::signbit(value[1]), touched) << "bits, not numbers";
      }
}
