// SPDX-License-Identifier: GPL-2.0-only
// Each rank stores only the nodes around its points, for any size of the grid. The results must be
// bitwise equal to those on a small grid.

#include "scene.h"

#include "mpm/shared_nodes.h"
#include "rve/core/error.h"

#include <array>
#include <cstring>
#include <gtest/gtest.h>
#include <map>

using mpm::BodyForm;
using mpm::Communication;
using mpm::Face;
using mpm::MpmSolver;
using mpm::ShapeFunction;
using mpm::SideKind;
using mpm::Vec;
using mpm_test::RankTeam;
using mpm_test::Scene;
using mpm_test::SceneOf;

namespace {

// The cell is a power of two, so that positions in cells are exact for any origin of the grid.
constexpr double CELL = 0.125;
constexpr double STEP = 1e-3;
constexpr double MIDDLE = 2500.0;    // middle of the large grid in x

struct Method {
  mpm::Scheme scheme = mpm::Scheme::Musl;
  ShapeFunction shape = ShapeFunction::Gimp;
  bool mean_dilation = false;
};

template <int D> Vec<D> corner(double x, double between, double top)
{
  Vec<D> place;
  for (int a = 0; a < D; ++a) place[a] = a == 0 ? x : a == D - 1 ? top : between;
  return place;
}

/// Ground under a surcharge on a fixed bottom. A footing is pressed into it, and a ball falls on
/// it. A block flies over several cells, so that the stored part of the grid changes in the run.
template <int D> struct Analysis {
  SceneOf<D> scene;
  mpm::SolverOptions<D> options;
  static constexpr double WIDTH = 2.0, DEPTH = 0.5, HEIGHT = 0.75;

  Analysis(const Method &method, bool is_large)
  {
    // The large grid has 40,000 x 40,000 cells in the plane and 40,000 x 400 x 400 in space: 1.6e9
    // and 6.4e9 nodes.
    const double far = D == 2 ? 5000.0 : 50.0;
    options = is_large
        ? mpm_test::grid_options_of<D>(corner<D>(0.0, 0.0, 0.0), corner<D>(5000.0, far, far), CELL)
        : mpm_test::grid_options_of<D>(corner<D>(MIDDLE - 1.0, 0.0, 0.0),
                                       corner<D>(MIDDLE + 5.0, 2.0, 3.0), CELL);
    options.scheme = method.scheme;
    options.shape = method.shape;
    options.mean_dilation = method.mean_dilation;
    options.damping = 0.05;
    options.flip = 0.99;
    options.sides[2 * (D - 1)] = SideKind::Fixed;
    if (D == 3) options.sides[2] = SideKind::Roller;
    options.dashpots[0] = {40.0, 20.0};    // a side without points near it
    options.rigid_bodies.resize(2);
    options.rigid_bodies[0].face = D == 2 ? Face::YLo : Face::ZLo;
    options.rigid_bodies[0].separation = true;
    options.rigid_bodies[1].form = BodyForm::Ball;
    options.rigid_bodies[1].rough = false;
    options.rigid_bodies[1].friction = 0.3;
    options.rigid_bodies[1].free = (1 << mpm::FREEDOMS<D>) -1;

    const auto block = [&](double x, double top, double width, double height, double spacing) {
      const int first = scene.size();
      scene.add_block(corner<D>(MIDDLE + x, 0.0, top),
                      corner<D>(MIDDLE + x + width, DEPTH, top + height), spacing, 2000.0);
      return first;
    };
    block(0.0, 0.0, WIDTH, HEIGHT, 0.5 * CELL);
    const int flying = block(2.5, 1.0, 0.25, 0.25, 0.5 * CELL);
    const int footing = block(0.25, HEIGHT, 0.5, CELL, CELL);
    const int ball = block(1.25, HEIGHT, 0.5, 0.5, CELL);
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < footing ? -1 : p < ball ? 0 : 1;
      scene.velocity[3 * p] = 0.01 * std::sin(1.7 * p) + (p >= flying && p < footing ? 8.0 : 0.0);
      scene.body_force[3 * p + D - 1] = -9.81 * scene.mass[p];
    }
  }

  static int part_of(double x, int ranks)
  {
    return std::min(ranks - 1, static_cast<int>((x - MIDDLE) / WIDTH * ranks));
  }

  /// Returns the points of each rank. The ranks have adjacent slabs.
  std::vector<std::vector<int>> divided(int ranks) const
  {
    std::vector<std::vector<int>> mine(ranks);
    for (int p = 0; p < scene.size(); ++p) mine[part_of(scene.position[3 * p], ranks)].push_back(p);
    return mine;
  }
};

struct Outcome {
  std::map<std::int64_t, std::vector<double>> point;
  std::vector<double> numbers;
  std::vector<int> held;    ///< number of nodes after each step

  void add(const Outcome &other) { point.insert(other.point.begin(), other.point.end()); }
};

template <int D>
Outcome run(const Analysis<D> &analysis, SceneOf<D> points, int steps,
            const Communication &communication)
{
  mpm::LinearElastic<D> law(1e6, 0.3);
  MpmSolver<D> solver(analysis.options, communication);
  solver.set_models({&law});
  solver.set_body_velocity(0, corner<D>(0.02, 0.0, -0.2));
  std::vector<mpm::TractionLoad<D>> loads(1);
  loads[0].traction = corner<D>(100.0, 0.0, -2e3);
  loads[0].face = D == 2 ? Face::YHi : Face::ZHi;
  for (int p = 0; p < points.size(); ++p) {
    const double *x = &points.position[3 * p];
    if (points.rigid_body[p] < 0 && x[D - 1] < Analysis<D>::HEIGHT &&
        x[D - 1] > Analysis<D>::HEIGHT - 0.5 * CELL && x[0] > MIDDLE + 1.75)
      loads[0].point_index.push_back(p);
  }
  Outcome outcome;
  const auto note = [&](const Vec<D> &vector) {
    outcome.numbers.insert(outcome.numbers.end(), vector.component, vector.component + D);
  };
  for (int step = 0; step < steps; ++step) {
    solver.step(points.view(), loads, STEP);
    outcome.held.push_back(solver.held_nodes());
    if (step % 10 != 9) continue;
    for (const int body : {0, 1}) note(solver.body_reaction(body));
    for (int side = 0; side < mpm::FACES<D>; ++side)
      note(solver.side_reaction(static_cast<Face>(side)));
    note(solver.damping_force());
    outcome.numbers.push_back(solver.max_unbalanced_force());
    const int column = static_cast<int>((MIDDLE + 0.5 - analysis.options.lo[0]) / CELL);
    mpm::NodeIndex<D> place;
    for (int a = 0; a < D; ++a) place[a] = a == 0 ? column : 2;
    note(solver.node_force(place));
    outcome.numbers.push_back(solver.node_mass(place));
  }
  for (int p = 0; p < points.size(); ++p) {
    std::vector<double> &row = outcome.point[points.id[p]];
    row.assign(&points.position[3 * p], &points.position[3 * p] + 3);
    row.insert(row.end(), &points.velocity[3 * p], &points.velocity[3 * p] + 3);
    row.insert(row.end(), points.stress[p].component, points.stress[p].component + D * D);
  }
  return outcome;
}

/// Runs the analysis on several ranks. Sets `held` to the largest number of nodes that each rank
/// stores.
template <int D>
Outcome run_on(int ranks, const Analysis<D> &analysis, int steps, std::vector<int> &held)
{
  const auto mine = analysis.divided(ranks);
  std::vector<Outcome> of_rank(ranks);
  RankTeam(ranks).run([&](int rank, const Communication &communication) {
    of_rank[rank] = run(analysis, analysis.scene.selected(mine[rank]), steps, communication);
  });
  Outcome all;
  all.numbers = of_rank[0].numbers;
  held.clear();
  for (const Outcome &one : of_rank) {
    EXPECT_EQ(one.numbers, all.numbers);
    all.add(one);
    held.push_back(*std::max_element(one.held.begin(), one.held.end()));
  }
  return all;
}

/// Returns the number of nodes of a box of cells with points, including its margins. On each side,
/// the margin has 3 nodes for the points, 3 for bodies, and 1 for the motion of points in three
/// steps.
double nodes_around(const std::vector<double> &cells)
{
  double nodes = 1.0;
  for (const double along : cells) nodes *= along + 1.0 + 2 * (3 + 3 + 1);
  return nodes;
}

template <int D> void expect_same_bits_as_on_a_small_grid(const Method &method, int steps)
{
  const Analysis<D> small(method, false), large(method, true);
  ASSERT_EQ(small.options.lo[1], large.options.lo[1]);
  std::vector<int> held;
  const Outcome expected = run(small, small.scene, steps, {});
  ASSERT_NE(expected.numbers.at(D - 1), 0.0) << "the footing feels something";
  ASSERT_NE(expected.numbers.back(), 0.0) << "there is mass at the node";
  for (const int ranks : {1, 2, 4}) {
    const Outcome found = run_on(ranks, large, steps, held);
    EXPECT_EQ(found.numbers, expected.numbers) << ranks << " ranks";
    EXPECT_EQ(found.point, expected.point) << ranks << " ranks";
    for (int rank = 0; rank < ranks; ++rank) {
      // The last rank has the block, which flies away.
      const double right = rank + 1 < ranks ? Analysis<D>::WIDTH / ranks * (rank + 1) : 4.5;
      std::vector<double> cells = {(right - Analysis<D>::WIDTH / ranks * rank) / CELL, 1.5 / CELL};
      if (D == 3) cells.push_back(Analysis<D>::DEPTH / CELL);
      EXPECT_LT(held[rank], nodes_around(cells)) << "rank " << rank << " of " << ranks;
    }
  }
}

}    // namespace

TEST(RankPart, OfAnEnormousGridHasTheBitsOfASmallOne)
{
  for (const mpm::Scheme scheme : {mpm::Scheme::Musl, mpm::Scheme::Usavg})
    for (const ShapeFunction shape : {ShapeFunction::Gimp, ShapeFunction::Linear})
      expect_same_bits_as_on_a_small_grid<2>({scheme, shape}, 120);
}

TEST(RankPart, OfAnEnormousGridHasTheBitsOfASmallOneInSpace)
{
  expect_same_bits_as_on_a_small_grid<3>({}, 60);
}

/// If boxes follow the deformation, the rounding of their ends depends on their position. Runs on
/// the large grid are therefore compared with each other and not with runs on the small one.
TEST(RankPart, HoldsBoxesThatFollowTheDeformation)
{
  const Analysis<2> analysis({mpm::Scheme::Musl, ShapeFunction::Cpgimp, true}, true);
  std::vector<int> held;
  const Outcome alone = run(analysis, analysis.scene, 60, {});
  for (const int ranks : {2, 4}) {
    const Outcome found = run_on(ranks, analysis, 60, held);
    EXPECT_EQ(found.numbers, alone.numbers);
    EXPECT_EQ(found.point, alone.point);
  }
}

TEST(RankPart, FollowsPointsThatMoveAndLeave)
{
  // One point moves across a thousand cells away from the ground.
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{500.0, 500.0}}, CELL);
  Scene scene;
  scene.add(1.0, 1.0, {{0.5 * CELL, 0.5 * CELL}}, 2000.0);
  scene.velocity[0] = 100.0;
  mpm::LinearElastic<2> law(1e3, 0.3);
  MpmSolver<2> solver(options);
  solver.set_models({&law});
  EXPECT_EQ(solver.held_nodes(), 0) << "no step has needed any";
  const auto most = [&] {
    int most = 0;
    for (int step = 0; step < 1000; ++step) {
      solver.step(scene.view(), {}, 1e-3);
      most = std::max(most, solver.held_nodes());
    }
    return most;
  };
  EXPECT_LE(most(), 7 * 7) << "five rows and columns, and a margin";
  EXPECT_NEAR(scene.position[0], 101.0, 1e-9);

  scene.add(401.0, 1.0, {{0.5 * CELL, 0.5 * CELL}}, 2000.0);
  solver.step(scene.view(), {}, 1e-3);
  const int together = solver.held_nodes();
  EXPECT_GT(together, 7 * 2000) << "all between two points";
  Scene one = scene.selected({1});
  solver.points_changed();
  solver.step(one.view(), {}, 1e-3);
  EXPECT_LE(solver.held_nodes(), 7 * 7) << "what nobody needs any more is given back";
}

TEST(RankPart, LimitIsReportedByAllRanksTogether)
{
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{5000.0, 5000.0}}, CELL);
  Scene scene;
  scene.add(100.0, 100.0, {{0.5 * CELL, 0.5 * CELL}}, 2000.0);
  scene.add(4900.0, 4900.0, {{0.5 * CELL, 0.5 * CELL}}, 2000.0);
  const auto step_on = [&](const std::vector<std::vector<int>> &mine) {
    const int ranks = static_cast<int>(mine.size());
    std::vector<std::string> message(ranks);
    RankTeam(ranks).run([&](int rank, const Communication &communication) {
      Scene part = scene.selected(mine[rank]);
      mpm::LinearElastic<2> law(1e6, 0.3);
      MpmSolver<2> solver(options, communication);
      solver.set_models({&law});
      for (int attempt = 0; attempt < 2; ++attempt) {
        message[rank].clear();
        try {
          solver.step(part.view(), {}, 1e-3);
        } catch (const rve::InputError &problem) {
          message[rank] = problem.what();
        }
      }
    });
    return message;
  };

  for (const std::string &message : step_on({{0}, {1}})) EXPECT_EQ(message, "");
  for (const std::string &message : step_on({{}, {0, 1}}))
    EXPECT_EQ(message,
              "rank 1 of 2 has points that need 38407 x 38407 nodes of the grid, x from 99.75 to "
              "4900.5, y from 99.75 to 4900.5 [length]; a rank can hold fewer than 200000000: use "
              "more ranks, divide the domain among them so that each has points in a smaller box, "
              "or use larger cells");
}
