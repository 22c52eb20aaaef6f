// The same bits for any number of ranks and threads and any order of the points.

#include "scene.h"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <random>

using mpm::MpmSolver;
using mpm::Scheme;
using mpm_test::Scene;

namespace {

constexpr double CELL = 0.05;    // so many points and nodes that threads share them
constexpr double STEP = 2.5e-4;
constexpr int STEPS = 40;

/// Everything that a step changes, as bytes.
struct PointState {
  double position[3], velocity[3], volume;
  rve::Tensor2 deformation_gradient, stress, velocity_gradient;
};

struct Outcome {
  std::map<std::int64_t, PointState> point;
  double numbers[9];
};

/// A footing that is pressed into a layer, with surcharge and gravity, and 9 points of irregular velocity per unit.
Scene footing()
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.2, 0.8}}, 0.5 * CELL, 2000.0);
  const int first = scene.size();
  scene.add_block({{0.0, 0.8}}, {{0.3, 0.9}}, CELL, 2000.0);
  for (int p = 0; p < scene.size(); ++p) {
    if (p >= first) scene.rigid_body[p] = 0;
    scene.velocity[3 * p] = 0.01 * std::sin(1.7 * p);
    scene.velocity[3 * p + 1] = 0.01 * std::cos(0.9 * p);
    scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
    scene.stress[p] = {{-20e3, 0.0, 0.0, -20e3}};
  }
  return scene;
}

Outcome run(Scene &scene, Scheme scheme, int threads, const mpm::Communication &communication)
{
  mpm::SolverOptions options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL);
  options.scheme = scheme;
  options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Fixed,
                   mpm::SideKind::Free};
  options.damping = 0.1;
  options.flip = 0.99;
  options.rigid_bodies.resize(1);
  options.threads = threads;
  mpm::LinearElastic law(10e6, 0.3);
  MpmSolver solver(options, communication);
  solver.set_models({&law});
  solver.set_body_velocity(0, {{0.0, -0.1}});

  std::vector<mpm::TractionLoad> loads(1);
  loads[0].traction = {{0.0, -20e3}};
  for (int p = 0; p < scene.size(); ++p)
    if (scene.rigid_body[p] < 0 && scene.position[3 * p + 1] > 0.8 - 0.5 * CELL &&
        scene.position[3 * p] > 0.3)
      loads[0].point_index.push_back(p);
  for (int step = 0; step < STEPS; ++step) solver.step(scene.view(), loads, STEP);

  Outcome outcome;
  for (int p = 0; p < scene.size(); ++p) {
    PointState &state = outcome.point[scene.id[p]];
    std::copy_n(&scene.position[3 * p], 3, state.position);
    std::copy_n(&scene.velocity[3 * p], 3, state.velocity);
    state.volume = scene.volume[p];
    state.deformation_gradient = scene.deformation_gradient[p];
    state.stress = scene.stress[p];
    state.velocity_gradient = scene.velocity_gradient[p];
  }
  const mpm::Totals totals = solver.totals(scene.view());
  const double numbers[9] = {solver.body_reaction(0)[0],
                             solver.body_reaction(0)[1],
                             solver.side_reaction(mpm::Face::YLo)[1],
                             solver.max_unbalanced_force(),
                             totals.mass,
                             totals.momentum[0],
                             totals.momentum[1],
                             totals.kinetic_energy,
                             solver.cfl_number(scene.view(), STEP)};
  std::copy_n(numbers, 9, outcome.numbers);
  return outcome;
}

void expect_same_bits(const Outcome &a, const Outcome &b)
{
  EXPECT_EQ(std::memcmp(a.numbers, b.numbers, sizeof(a.numbers)), 0);
  int different = 0;
  for (const auto &[id, state] : b.point)
    different += std::memcmp(&a.point.at(id), &state, sizeof(state)) != 0;
  EXPECT_EQ(different, 0) << "points of " << b.point.size();
}

class Bits : public testing::TestWithParam<Scheme> {
 protected:
  void SetUp() override
  {
    Scene scene = footing();
    reference_ = run(scene, GetParam(), 1, {});
    ASSERT_GT(std::abs(reference_.numbers[1]), 1e3) << "the footing feels something";
  }
  Outcome reference_;
};

}    // namespace

TEST_P(Bits, DoNotDependOnTheOrderOfThePoints)
{
  Scene scene = footing();
  std::vector<int> order(scene.size());
  for (int p = 0; p < scene.size(); ++p) order[p] = p;
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  Scene shuffled = scene.selected(order);

  expect_same_bits(reference_, run(shuffled, GetParam(), 1, {}));
}

TEST_P(Bits, DoNotDependOnTheNumberOfThreads)
{
  for (const int threads : {2, 3, 7}) {
    Scene scene = footing();
    expect_same_bits(reference_, run(scene, GetParam(), threads, {}));
  }
}

TEST_P(Bits, DoNotDependOnTheNumberOfRanks)
{
  const Scene all = footing();
  for (const int ranks : {2, 4}) {
    std::vector<std::vector<int>> mine(ranks);
    for (int p = 0; p < all.size(); ++p) mine[(p * 7 / 3) % ranks].push_back(p);
    mine[0].insert(mine[0].end(), mine[ranks - 1].begin(), mine[ranks - 1].end());
    mine[ranks - 1].clear();    // a rank without points takes part all the same
    std::vector<Outcome> outcome(ranks);

    mpm_test::RankTeam(ranks).run([&](int rank, const mpm::Communication &communication) {
      Scene part = all.selected(mine[rank]);
      outcome[rank] = run(part, GetParam(), 1, communication);
    });

    for (int rank = 0; rank < ranks; ++rank) expect_same_bits(reference_, outcome[rank]);
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, Bits, testing::Values(Scheme::Musl, Scheme::Usavg));
