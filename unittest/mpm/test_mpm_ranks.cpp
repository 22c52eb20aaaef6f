// SPDX-License-Identifier: GPL-2.0-only
// Results do not depend, to the bit, on the number of ranks and threads and the order of the
// points.

#include "mpm/rank_devices.h"
#include "scene.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <random>

using mpm::Face;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::Scheme;
using mpm::ShapeFunction;
using mpm::Vec2;
using mpm_test::Scene;

namespace {

constexpr double CELL = 0.05;    // so small that several threads share the points and nodes
constexpr double STEP = 2.5e-4;
constexpr double BOTTOM = -0.02;    // lower side of the grid; faces of bodies are between its rows

struct Method {
  Scheme scheme;
  ShapeFunction shape;
  double damping;
  bool rough, separation;
  bool absorbing = false;
  bool wet = false;    ///< a part of the points has pore water
  bool mean_dilation = false;
  bool flows = false;    ///< the water flows
};

/// All numbers of a point that a step changes, compared as bytes.
struct PointState {
  double position[3], velocity[3], volume, water;
  rve::Tensor2 deformation_gradient, stress, velocity_gradient;
};

struct Outcome {
  std::map<std::int64_t, PointState> point;
  std::vector<double> numbers;
};

enum Body { ANVIL, FOOTING, PLATE };

/// Returns ground around three bodies, with gravity, stress and irregular velocities. A footing is
/// pressed down. The face of an anvil is one cell below it, so that both bodies have a condition on
/// the row of nodes between them. A plate pushes to the right.
Scene ground()
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.2, 0.95}}, 0.5 * CELL, 2000.0);
  const int anvil = scene.size();
  scene.add_block({{0.1, 0.7}}, {{0.3, 0.75}}, CELL, 2000.0);
  const int footing = scene.size();
  scene.add_block({{0.0, 0.8}}, {{0.3, 0.85}}, CELL, 2000.0);
  const int plate = scene.size();
  scene.add_block({{0.62, 0.4}}, {{0.67, 0.75}}, CELL, 2000.0);
  for (int p = 0; p < scene.size(); ++p) {
    if (p >= anvil) scene.rigid_body[p] = p < footing ? ANVIL : p < plate ? FOOTING : PLATE;
    scene.velocity[3 * p] = 0.01 * std::sin(1.7 * p);
    scene.velocity[3 * p + 1] = 0.01 * std::cos(0.9 * p);
    scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
    scene.stress[p] = {{-20e3, 0.0, 0.0, -20e3}};
  }
  return scene;
}

Outcome run(Scene &scene, const Method &method, int steps, int threads,
            const mpm::Communication &communication)
{
  mpm::SolverOptions<2> options =
      mpm_test::grid_options({{0.0, BOTTOM}}, {{1.2, 1.0 + BOTTOM}}, CELL);
  options.scheme = method.scheme;
  options.shape = method.shape;
  options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Fixed,
                   mpm::SideKind::Free};
  // Dashpots are next to a roller. An absorbing side has one corner with a fixed side and one with
  // another absorbing side.
  if (method.absorbing) {
    options.sides[1] = options.sides[3] = mpm::SideKind::Free;
    options.dashpots = {{{0.0, 40.0}, {80.0, 40.0}, {}, {80.0, 0.0}}};
  }
  options.damping = method.damping;
  options.mean_dilation = method.mean_dilation;
  if (method.wet) {
    options.water = {4e6, 10e3};
    scene.fill_pores(options.water, 0.4,
                     [&](int p) { return 1e4 * (0.9 - scene.position[3 * p + 1]); });
    for (int p = 0; p < scene.size(); ++p)
      if (scene.id[p] % 5 == 0) scene.water_volume[p] = 0.0;
  }
  if (method.flows) {
    options.water.mobility = 1e-8;
    options.water.density = 1000.0;
    options.water.impervious = 0b0101;
  }
  options.flip = 0.99;
  options.rigid_bodies.resize(3);
  options.rigid_bodies[ANVIL].face = Face::YHi;
  options.rigid_bodies[PLATE].face = Face::XHi;
  for (mpm::RigidBodyOptions &body : options.rigid_bodies) {
    body.rough = method.rough;
    body.separation = method.separation;
  }
  options.threads = threads;
  mpm::LinearElastic<2> law(10e6, 0.3);
  MpmSolver solver(options, communication);
  solver.set_models({&law});
  solver.set_body_velocity(ANVIL, {{0.01, 0.02}});
  solver.set_body_velocity(FOOTING, {{0.0, -0.1}});
  solver.set_body_velocity(PLATE, {{0.05, 0.0}});

  std::vector<mpm::TractionLoad<2>> loads(2);
  loads[0].traction = {{1e3, -20e3}};
  loads[1].traction = {{-5e3, 0.0}};
  loads[1].face = Face::XHi;
  for (int p = 0; p < scene.size(); ++p) {
    if (scene.rigid_body[p] >= 0) continue;
    if (scene.position[3 * p + 1] > 0.95 - 0.5 * CELL) loads[0].point_index.push_back(p);
    if (scene.position[3 * p] > 1.2 - 0.5 * CELL) loads[1].point_index.push_back(p);
  }

  Outcome outcome;
  const auto note = [&](const Vec2 &value) {
    outcome.numbers.insert(outcome.numbers.end(), {value[0], value[1]});
  };
  const auto ask = [&] {
    for (const int body : {FOOTING, ANVIL, PLATE}) note(solver.body_reaction(body));
    for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi})
      note(solver.side_reaction(side));
    note(solver.damping_force());
    outcome.numbers.push_back(solver.max_unbalanced_force());
  };
  solver.evaluate(scene.view(), loads, STEP);
  ask();
  for (int step = 0; step < steps; ++step) {
    solver.step(scene.view(), loads, STEP);
    if (step % 7 == 3) ask();
  }
  ask();

  for (int p = 0; p < scene.size(); ++p) {
    PointState &state = outcome.point[scene.id[p]];
    std::copy_n(&scene.position[3 * p], 3, state.position);
    std::copy_n(&scene.velocity[3 * p], 3, state.velocity);
    state.volume = scene.volume[p];
    state.water = method.wet ? scene.water_volume[p] : 0.0;
    state.deformation_gradient = scene.deformation_gradient[p];
    state.stress = scene.stress[p];
    state.velocity_gradient = scene.velocity_gradient[p];
  }
  const mpm::Totals<2> totals = solver.totals(scene.view());
  note(totals.momentum);
  note({{totals.mass, totals.kinetic_energy}});
  outcome.numbers.push_back(solver.cfl_number(scene.view(), STEP));
  const mpm::Grid<2> &grid = solver.grid();
  for (int j = -1; j <= grid.cells(1) + 1; ++j)
    for (int i = -1 + (j + 5) % 4; i <= grid.cells(0) + 1;
         i += 4) {    // each query synchronises the ranks
      note(solver.node_force({{i, j}}));
      outcome.numbers.push_back(solver.node_mass({{i, j}}));
    }
  return outcome;
}

void expect_same_bits(const Outcome &a, const Outcome &b)
{
  ASSERT_EQ(a.numbers.size(), b.numbers.size());
  EXPECT_EQ(std::memcmp(a.numbers.data(), b.numbers.data(), a.numbers.size() * sizeof(double)), 0);
  int different = 0;
  for (const auto &[id, state] : b.point)
    different += std::memcmp(&a.point.at(id), &state, sizeof(state)) != 0;
  EXPECT_EQ(different, 0) << "points of " << b.point.size();
}

/// Returns the indices of the points of each rank. rank_of(x, y) returns the rank of a point.
template <class RankOf>
std::vector<std::vector<int>> divided(const Scene &all, int ranks, const RankOf &rank_of)
{
  std::vector<std::vector<int>> mine(ranks);
  for (int p = 0; p < all.size(); ++p)
    mine.at(rank_of(all.position[3 * p], all.position[3 * p + 1])).push_back(p);
  return mine;
}

class Bits : public testing::TestWithParam<Method> {
 protected:
  static constexpr int STEPS = 20;

  Outcome alone(int steps)
  {
    Scene scene = ground();
    return run(scene, GetParam(), steps, 1, {});
  }

  /// Expects the reference result if rank r has the points mine[r].
  void expect_of_ranks(const Outcome &reference, const std::vector<std::vector<int>> &mine,
                       int steps)
  {
    const Scene all = ground();
    std::vector<Outcome> outcome(mine.size());
    mpm_test::RankTeam team(static_cast<int>(mine.size()));
    team.run([&](int rank, const mpm::Communication &communication) {
      Scene part = all.selected(mine[rank]);
      outcome[rank] = run(part, GetParam(), steps, 1, communication);
    });
    for (const Outcome &one : outcome) expect_same_bits(reference, one);
  }
};

}    // namespace

TEST_P(Bits, DoNotDependOnTheOrderOfThePoints)
{
  const Scene scene = ground();
  std::vector<int> order(scene.size());
  for (int p = 0; p < scene.size(); ++p) order[p] = p;
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  Scene shuffled = scene.selected(order);
  const Outcome reference = alone(STEPS);
  ASSERT_GT(std::abs(reference.numbers[1]), 1e3) << "the footing feels something";

  expect_same_bits(reference, run(shuffled, GetParam(), STEPS, 1, {}));
}

TEST_P(Bits, DoNotDependOnTheNumberOfThreads)
{
  const Outcome reference = alone(STEPS);
  for (const int threads : {2, 3, 7}) {
    Scene scene = ground();
    expect_same_bits(reference, run(scene, GetParam(), STEPS, threads, {}));
  }
}

TEST_P(Bits, DoNotDependOnRanksWithScatteredPoints)
{
  const Outcome reference = alone(STEPS);
  const int size = ground().size();
  for (const int ranks : {1, 2, 4}) {
    std::vector<std::vector<int>> mine(ranks);
    for (int p = 0; p < size; ++p) mine[(p * 7 / 3) % ranks].push_back(p);
    if (ranks > 1) {    // a rank without points takes part
      mine[0].insert(mine[0].end(), mine[ranks - 1].begin(), mine[ranks - 1].end());
      mine[ranks - 1].clear();
    }
    expect_of_ranks(reference, mine, STEPS);
  }
}

TEST_P(Bits, DoNotDependOnRanksWithPartsOfTheGround)
{
  const Outcome reference = alone(STEPS);
  const Scene all = ground();
  const auto share = [](double place, double size, int parts) {
    return std::min(parts - 1, static_cast<int>(place / size * parts));
  };
  for (const int ranks : {2, 3, 8})
    expect_of_ranks(reference,
                    divided(all, ranks, [&](double x, double) { return share(x, 1.2, ranks); }),
                    STEPS);
  for (const int ranks : {3, 8})
    expect_of_ranks(reference,
                    divided(all, ranks, [&](double, double y) { return share(y, 0.95, ranks); }),
                    STEPS);
  for (const int half : {2, 4})
    expect_of_ranks(
        reference,
        divided(all, 2 * half,
                [&](double x, double y) { return half * share(x, 1.2, 2) + share(y, 0.95, half); }),
        STEPS);
}

/// A face of a body ties two nodes together. The border between two ranks is near a face, so that
/// one rank has only one of the two tied nodes.
TEST_P(Bits, DoNotDependOnBordersNearFacesOfBodies)
{
  constexpr int FEW = 4;
  const Outcome reference = alone(FEW);
  const Scene all = ground();
  for (double border = 0.60; border < 0.94; border += 0.5 * CELL)
    expect_of_ranks(reference,
                    divided(all, 2, [&](double, double y) { return y < border ? 0 : 1; }), FEW);
  for (double border = 0.55; border < 0.8; border += 0.5 * CELL)
    expect_of_ranks(reference,
                    divided(all, 2, [&](double x, double) { return x < border ? 0 : 1; }), FEW);
}

INSTANTIATE_TEST_SUITE_P(
    Methods, Bits,
    testing::Values(Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, true, false},
                    Method{Scheme::Usavg, ShapeFunction::Gimp, 0.1, true, true},
                    Method{Scheme::Musl, ShapeFunction::Gimp, 0.0, false, true},
                    Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, true, false, true},
                    Method{Scheme::Musl, ShapeFunction::Linear, 0.1, true, true},
                    Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, true, true, false, true, true},
                    Method{Scheme::Usavg, ShapeFunction::Gimp, 0.0, true, false, false, true},
                    Method{Scheme::Usavg, ShapeFunction::Linear, 0.0, false, false},
                    Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, true, false, false, true, false,
                           true}));

TEST(Exchange, OfTwoHalvesIsThatOfTheColumnsBetween)
{
  // The halves share four columns of nodes. The plate ties columns together, which adds one column
  // on either side.
  const Scene all = ground();
  const auto mine = divided(all, 2, [](double x, double) { return x < 0.3 ? 0 : 1; });
  const auto words_of = [&](int steps) {
    mpm_test::RankTeam team(2);
    team.run([&](int rank, const mpm::Communication &communication) {
      Scene part = all.selected(mine[rank]);
      mpm::SolverOptions<2> options =
          mpm_test::grid_options({{0.0, BOTTOM}}, {{1.2, 1.0 + BOTTOM}}, CELL);
      options.rigid_bodies.resize(3);
      options.rigid_bodies[PLATE].face = Face::XHi;
      mpm::LinearElastic<2> law(10e6, 0.3);
      MpmSolver solver(options, communication);
      solver.set_models({&law});
      for (int step = 0; step < steps; ++step) solver.step(part.view(), {}, STEP);
    });
    return std::array<std::size_t, 3>{team.words_summed(), team.words_sent(), team.calls()};
  };

  const auto one = words_of(1), two = words_of(2);

  // In a step, each rank contributes the number of its points and two boxes to global sums.
  // The messages in each direction have seven sums for every node: five at the start of the step
  // and two at its end. They cover the columns of nodes that the sender has touched and the
  // receiver needs.
  constexpr int COLUMNS = 4 + 1, ROWS = 23;
  EXPECT_EQ(two[0] - one[0], 1u + 4 * 2);
  EXPECT_EQ(two[1] - one[1], 2u * 7u * COLUMNS * ROWS);
  EXPECT_EQ(two[2] - one[2], 5u) << "boxes, bounds, sums, bounds, sums";
}

TEST(Exchange, EndsWithTheErrorOfARankWithAPointOutside)
{
  for (const double place : {std::nan(""), HUGE_VAL, 7.0}) {
    const Scene all = ground();
    const auto mine = divided(all, 3, [](double x, double) { return static_cast<int>(x / 0.41); });
    const auto spoilt_run = [&] {
      mpm_test::RankTeam(3).run([&](int rank, const mpm::Communication &communication) {
        Scene part = all.selected(mine[rank]);
        if (rank == 1) part.position[3 * 4] = place;
        run(part, {Scheme::Musl, ShapeFunction::Gimp, 0.0, true, false}, 2, 1, communication);
      });
    };
    EXPECT_THROW(spoilt_run(), mpm::PointError);
  }
}

// GPUs of ranks synchronise directly only if each rank has its own GPU.
TEST(RankDevices, AreExclusiveIfEachRankHasAnotherOne)
{
  const auto answer_of = [](const std::vector<mpm::DeviceName> &names) {
    std::vector<char> answers(names.size());
    mpm_test::RankTeam(static_cast<int>(names.size()))
        .run([&](int rank, const mpm::Communication &communication) {
          answers[rank] = mpm::each_rank_has_its_device(communication, names[rank]);
        });
    for (const char answer : answers) EXPECT_EQ(answer, answers[0]) << "all ranks know the same";
    return answers[0] != 0;
  };
  const mpm::DeviceName one = {3, -5}, another = {3, 7}, none = {};
  EXPECT_TRUE(answer_of({one, another}));
  EXPECT_TRUE(answer_of({one}));
  EXPECT_FALSE(answer_of({one, another, one}));
  EXPECT_FALSE(answer_of({one, none, another}));
  EXPECT_FALSE(answer_of({none, none}));
}
