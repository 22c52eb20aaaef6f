// SPDX-License-Identifier: GPL-2.0-only
// CPU threads and a CUDA device give the same bits. Skipped without a device, unless
// GPU_RVE_REQUIRE_CUDA=1.

#include "rings.h"
#include "scene.h"
#include "turning_bodies.h"

#include "ground_in_space.h"
#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <string>

using mpm::Communication;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::Scheme;
using mpm::ShapeFunction;
using mpm_test::Scene;

namespace {

constexpr double CELL = 0.05, DT = 2e-4;

struct Case {
  Scheme scheme;
  ShapeFunction shape;
  double damping;
  bool separation;
  bool absorbing = false;
  bool wet = false;    ///< the points have pore water
  bool mean_dilation = false;
  bool flows = false;    ///< the water flows
};

constexpr mpm::PoreWater WATER = {4e6, 10e3};

mpm::SolverOptions<2> options_for(const Case &what, mpm::Device device)
{
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL);
  options.scheme = what.scheme;
  options.shape = what.shape;
  options.damping = what.damping;
  options.mean_dilation = what.mean_dilation;
  if (what.wet) options.water = WATER;
  if (what.flows) {
    options.water.mobility = 1e-8;
    options.water.density = 1000.0;
    options.water.impervious = 0b0101;
  }
  options.flip = 0.99;
  options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Fixed,
                   mpm::SideKind::Free};
  // Dashpots are next to a roller. An absorbing side has one corner with a fixed side and one with
  // another absorbing side.
  if (what.absorbing) {
    options.sides[1] = mpm::SideKind::Free;
    options.dashpots = {{{0.0, 40.0}, {80.0, 40.0}, {}, {80.0, 0.0}}};
  }
  options.rigid_bodies.resize(2);
  options.rigid_bodies[0].separation = what.separation;
  options.rigid_bodies[1].face = mpm::Face::XHi;
  options.rigid_bodies[1].rough = false;
  options.threads = 2;
  options.device = device;
  return options;
}

/// Returns ground of two laws with a footing at the roller and a plate on its surface, which pushes
/// to the right.
Scene scene_with_two_bodies()
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.2, 0.8}}, 0.5 * CELL, 2000.0);
  const int ground = scene.size();
  scene.add_block({{0.0, 0.8}}, {{0.3, 0.85}}, CELL, 2000.0);
  const int footing = scene.size();
  scene.add_block({{0.5, 0.8}}, {{0.55, 0.95}}, CELL, 2000.0);
  for (int p = 0; p < scene.size(); ++p) {
    scene.rigid_body[p] = p < ground ? -1 : p < footing ? 0 : 1;
    scene.model[p] = scene.position[3 * p + 1] > 0.4 ? 1 : 0;
    scene.velocity[3 * p] = 0.01 * std::sin(1.7 * p);
    scene.velocity[3 * p + 1] = 0.01 * std::cos(0.9 * p);
    scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
    scene.stress[p] = {{-20e3, 0.0, 0.0, -20e3}};
  }
  return scene;
}

/// A solver with its points and laws.
struct Ground {
  Scene scene;
  mpm::LinearElastic<2> elastic{10e6, 0.3};
  mpm::MohrCoulomb<2> frictional{10e6, 0.3, 2e3, 30.0, 5.0};
  MpmSolver solver;
  std::vector<mpm::TractionLoad<2>> loads;

  Ground(const Case &what, mpm::Device device, Scene scene_in,
         const Communication &communication = {}) :
      scene(std::move(scene_in)),
      solver(options_for(what, device), communication)
  {
    scene.begin_memory(frictional);
    if (what.wet) scene.fill_pores(WATER, 0.4, [this](int p) { return 100.0 * (scene.id[p] % 7); });
    solver.set_models({&elastic, &frictional});
    solver.set_body_velocity(0, {{0.0, -0.2}});
    solver.set_body_velocity(1, {{0.05, 0.0}});
    find_loads();
  }

  void find_loads()
  {
    loads.assign(2, {});
    loads[0].traction = {{1e3, -20e3}};
    loads[1].traction = {{-5e3, 0.0}};
    loads[1].face = mpm::Face::XHi;
    for (int p = 0; p < scene.size(); ++p) {
      if (scene.rigid_body[p] >= 0) continue;
      const double x = scene.position[3 * p], y = scene.position[3 * p + 1];
      if (y > 0.8 - 0.5 * CELL && x > 0.6) loads[0].point_index.push_back(p);
      if (x > 1.2 - 0.5 * CELL && y > 0.5) loads[1].point_index.push_back(p);
    }
  }

  void steps(int number)
  {
    for (int step = 0; step < number; ++step) {
      const double change = 0.01 * std::sin(0.3 * ++steps_made);
      solver.set_body_velocity(0, {{change, -0.2 + change}});
      solver.step(scene.view(), loads, DT);
    }
  }

  int steps_made = 0;
};

template <class T> bool same_bits(const std::vector<T> &a, const std::vector<T> &b)
{
  return a.size() == b.size() &&
      (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Returns forces and masses of a solver. All ranks must call it together.
std::vector<double> numbers(Ground &run)
{
  std::vector<double> list = {run.solver.max_unbalanced_force(),
                              run.solver.cfl_number(run.scene.view(), DT)};
  for (int body = 0; body < 2; ++body)
    for (int a = 0; a < 2; ++a) list.push_back(run.solver.body_reaction(body)[a]);
  for (const mpm::Face side : {mpm::Face::XLo, mpm::Face::XHi, mpm::Face::YLo, mpm::Face::YHi})
    for (int a = 0; a < 2; ++a) list.push_back(run.solver.side_reaction(side)[a]);
  for (int a = 0; a < 2; ++a) list.push_back(run.solver.damping_force()[a]);
  const mpm::Grid<2> &grid = run.solver.grid();
  for (int j = -1; j <= grid.cells(1) + 1; ++j)
    for (int i = -1; i <= grid.cells(0) + 1; ++i) {
      list.push_back(run.solver.node_mass({{i, j}}));
      for (int a = 0; a < 2; ++a) list.push_back(run.solver.node_force({{i, j}})[a]);
    }
  return list;
}

template <class Points> void expect_same_points(const Points &a, const Points &b)
{
  EXPECT_TRUE(same_bits(a.position, b.position));
  EXPECT_TRUE(same_bits(a.velocity, b.velocity));
  EXPECT_TRUE(same_bits(a.volume, b.volume));
  EXPECT_TRUE(same_bits(a.deformation_gradient, b.deformation_gradient));
  EXPECT_TRUE(same_bits(a.velocity_gradient, b.velocity_gradient));
  EXPECT_TRUE(same_bits(a.stress, b.stress));
  EXPECT_TRUE(same_bits(a.memory, b.memory));
  EXPECT_TRUE(same_bits(a.water_volume, b.water_volume));
}

void expect_same_bits(Ground &cpu, Ground &cuda)
{
  cuda.solver.fetch(cuda.scene.view());
  expect_same_points(cpu.scene, cuda.scene);
  EXPECT_TRUE(same_bits(numbers(cpu), numbers(cuda)));
}

const Case MUSL{Scheme::Musl, ShapeFunction::Gimp, 0.05, false};

class OnDevice : public testing::Test {
 protected:
  /// Auto selects a device if there is one, and fails without one if GPU_RVE_REQUIRE_CUDA=1.
  void SetUp() override
  {
    std::string obstacle;
    MpmSolver probe(options_for(MUSL, mpm::Device::Auto), {}, &obstacle);
    if (probe.description().find("CPU") != std::string::npos)
      GTEST_SKIP() << (obstacle.empty() ? "GPU_RVE was built without CUDA" : obstacle);
  }
};

class Backends : public OnDevice, public testing::WithParamInterface<Case> {};

}    // namespace

TEST_P(Backends, GiveTheSameBits)
{
  Ground cpu(GetParam(), mpm::Device::Cpu, scene_with_two_bodies());
  Ground cuda(GetParam(), mpm::Device::Cuda, scene_with_two_bodies());
  cpu.solver.evaluate(cpu.scene.view(), cpu.loads, DT);
  cuda.solver.evaluate(cuda.scene.view(), cuda.loads, DT);
  expect_same_bits(cpu, cuda);

  cpu.steps(60);
  cuda.steps(60);

  EXPECT_GT(std::abs(cpu.solver.body_reaction(0)[1]), 1e3) << "the footing feels something";
  expect_same_bits(cpu, cuda);
}

INSTANTIATE_TEST_SUITE_P(
    , Backends,
    testing::Values(MUSL, Case{Scheme::Musl, ShapeFunction::Linear, 0.0, true},
                    Case{Scheme::Usavg, ShapeFunction::Gimp, 0.1, true},
                    Case{Scheme::Usavg, ShapeFunction::Linear, 0.0, false},
                    Case{Scheme::Musl, ShapeFunction::Gimp, 0.1, false, true},
                    Case{Scheme::Musl, ShapeFunction::Gimp, 0.1, false, false, true},
                    Case{Scheme::Usavg, ShapeFunction::Cpgimp, 0.0, true, false, true, true},
                    Case{Scheme::Musl, ShapeFunction::Gimp, 0.1, false, false, true, false, true},
                    Case{Scheme::Musl, ShapeFunction::Cpgimp, 0.0, true, false, true, false,
                         true}));

TEST_F(OnDevice, OrderOfThePointsHasNoInfluence)
{
  const Scene scene = scene_with_two_bodies();
  std::vector<int> order(scene.size()), back(scene.size());
  for (int p = 0; p < scene.size(); ++p) order[p] = p;
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  for (int p = 0; p < scene.size(); ++p) back[order[p]] = p;
  Ground cpu(MUSL, mpm::Device::Cpu, scene);
  Ground cuda(MUSL, mpm::Device::Cuda, scene.selected(order));

  cpu.steps(20);
  cuda.steps(20);

  cuda.solver.fetch(cuda.scene.view());
  cuda.scene = cuda.scene.selected(back);
  expect_same_bits(cpu, cuda);
}

TEST_F(OnDevice, UsesChangesBetweenSteps)
{
  Ground cpu(MUSL, mpm::Device::Cpu, scene_with_two_bodies());
  Ground cuda(MUSL, mpm::Device::Cuda, scene_with_two_bodies());
  for (Ground *run : {&cpu, &cuda}) {
    run->steps(5);
    // A caller is allowed to change velocities, positions, body forces, laws and bodies without a
    // call of points_changed().
    for (int p = 0; p < run->scene.size(); ++p) {
      run->scene.velocity[3 * p] *= 0.5;
      run->scene.position[3 * p + 1] += 1e-5;
      run->scene.body_force[3 * p] = 0.1 * run->scene.mass[p];
    }
    run->scene.model[7] = 1;
    run->steps(5);
    // After fetch() and points_changed() a caller is allowed to change everything, including the
    // number of points.
    run->solver.fetch(run->scene.view());
    run->solver.points_changed();
    std::vector<int> fewer;
    for (int p = 0; p < run->scene.size(); ++p)
      if (p % 11 != 3 || run->scene.rigid_body[p] >= 0) fewer.push_back(p);
    run->scene = run->scene.selected(fewer);
    run->scene.stress[5](0, 0) -= 100.0;
    run->find_loads();
    run->steps(5);
  }
  expect_same_bits(cpu, cuda);
}

TEST_P(Backends, GiveTheSameBitsOnSeveralRanks)
{
  const Scene all = scene_with_two_bodies();
  Ground alone(GetParam(), mpm::Device::Cpu, all);
  alone.solver.evaluate(alone.scene.view(), alone.loads, DT);
  const std::vector<double> at_rest = numbers(alone);
  alone.steps(10);
  const std::vector<double> at_end = numbers(alone);

  // The points of a rank are scattered, in columns, or in layers with a border right below the
  // footing; the last rank has no points.
  constexpr int RANKS = 3;
  const std::vector<std::function<int(int, double, double)>> divisions = {
      [](int p, double, double) { return p * 7 / 3 % 2; },
      [](int, double x, double) { return x < 0.52 ? 0 : 1; },
      [](int, double, double y) { return y < 0.8 - 0.5 * CELL ? 0 : 1; },
  };
  for (const auto &rank_of : divisions)
    for (const bool all_on_device : {true, false}) {
      std::vector<std::vector<int>> mine(RANKS);
      for (int p = 0; p < all.size(); ++p)
        mine[rank_of(p, all.position[3 * p], all.position[3 * p + 1])].push_back(p);
      std::vector<Scene> parts(RANKS);
      std::vector<std::vector<double>> rest(RANKS), end(RANKS);

      mpm_test::RankTeam(RANKS).run([&](int rank, const Communication &communication) {
        const bool on_device = all_on_device || rank == 1;
        Ground run(GetParam(), on_device ? mpm::Device::Cuda : mpm::Device::Cpu,
                   all.selected(mine[rank]), communication);
        run.solver.evaluate(run.scene.view(), run.loads, DT);
        rest[rank] = numbers(run);
        run.steps(10);
        end[rank] = numbers(run);
        run.solver.fetch(run.scene.view());
        parts[rank] = run.scene;
      });

      for (int rank = 0; rank < RANKS; ++rank) {
        expect_same_points(alone.scene.selected(mine[rank]), parts[rank]);
        EXPECT_TRUE(same_bits(rest[rank], at_rest));
        EXPECT_TRUE(same_bits(end[rank], at_end));
      }
    }
}

TEST_F(OnDevice, ReportsErrorsAsTheCpuDoes)
{
  const auto message = [](mpm::Device device, const std::function<void(Ground &)> &spoil) {
    Ground run(MUSL, device, scene_with_two_bodies());
    run.steps(2);
    run.solver.fetch(run.scene.view());
    run.solver.points_changed();
    spoil(run);
    try {
      run.steps(3);
    } catch (const std::exception &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  const std::vector<std::function<void(Ground &)>> faults = {
      [](Ground &run) {
        run.scene.position[3 * 100] = 7.0;
        run.scene.position[3 * 90] = 8.0;
      },
      [](Ground &run) { run.scene.velocity[3 * 100] = std::nan(""); },
      [](Ground &run) {
        run.scene.half_size[50] = {{CELL, CELL}};
      },
      [](Ground &run) { run.scene.velocity[3 * 100 + 1] = 1e4; },
      [](Ground &run) { run.scene.mass[100] = 1e300; },
      [](Ground &run) { run.scene.model[60] = 5; },
      [](Ground &run) { run.loads[0].traction[0] = HUGE_VAL; }};
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const std::string of_cpu = message(mpm::Device::Cpu, faults[k]);
    EXPECT_NE(of_cpu, "") << "fault " << k;
    EXPECT_EQ(message(mpm::Device::Cuda, faults[k]), of_cpu) << "fault " << k;
  }
}

TEST_F(OnDevice, GivesTheSameBitsInSpace)
{
  using mpm_test::GroundInSpace;
  for (const bool absorbing : {false, true})
    for (const GroundInSpace::Method &method :
         {GroundInSpace::Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, 0.99, true, false},
          GroundInSpace::Method{Scheme::Usavg, ShapeFunction::Gimp, 0.0, 1.0, false, true},
          GroundInSpace::Method{Scheme::Usavg, ShapeFunction::Linear, 0.1, 0.99, true, true}}) {
      std::vector<double> numbers[2];
      mpm_test::SceneOf<3> scene[2];
      for (const bool on_device : {false, true}) {
        GroundInSpace ground(method);
        ground.options.device = on_device ? mpm::Device::Cuda : mpm::Device::Cpu;
        ground.options.threads = 2;
        if (absorbing) {    // next to the roller in x, instead of the fixed side in y
          ground.options.sides[2] = mpm::SideKind::Free;
          ground.options.dashpots[0] = {0.0, 40.0};
          ground.options.dashpots[2] = {80.0, 40.0};
        }
        mpm::MpmSolver<3> solver = ground.solver();
        solver.evaluate(ground.scene.view(), ground.loads, GroundInSpace::STEP);
        for (int step = 0; step < 30; ++step)
          solver.step(ground.scene.view(), ground.loads, GroundInSpace::STEP);
        solver.fetch(ground.scene.view());
        numbers[on_device] = ground.numbers(solver);
        scene[on_device] = ground.scene;
      }
      expect_same_points(scene[0], scene[1]);
      EXPECT_TRUE(same_bits(numbers[0], numbers[1]));
    }
}

namespace {

template <int D> void expect_same_bits_of_turning_bodies(mpm::BodyForm form, int steps)
{
  const mpm_test::turning::TwoBodies<D> set(form);
  using Outcome = mpm_test::turning::RankOutcome<D>;
  mpm_test::SceneOf<D> of_cpu = set.scene, of_device = set.scene;
  const Outcome cpu = set.run(of_cpu, steps, 2, {});
  const Outcome cuda = set.run(of_device, steps, 2, {}, mpm::Device::Cuda);
  const std::string name =
      "form " + std::to_string(static_cast<int>(form)) + ", D = " + std::to_string(D);
  ASSERT_NE(cpu.numbers.back(), 0.0) << name;
  EXPECT_TRUE(same_bits(cpu.numbers, cuda.numbers)) << name;
  EXPECT_TRUE(cpu.point == cuda.point) << name;

  // The first of two ranks is on the CPU, the other one on the device.
  std::vector<Outcome> of_rank(2);
  mpm_test::RankTeam(2).run([&](int rank, const Communication &communication) {
    std::vector<int> mine;
    for (int p = 0; p < set.scene.size(); ++p)
      if ((set.scene.position[3 * p] < 0.7 ? 0 : 1) == rank) mine.push_back(p);
    mpm_test::SceneOf<D> part = set.scene.selected(mine);
    of_rank[rank] =
        set.run(part, steps, 1, communication, rank == 0 ? mpm::Device::Cpu : mpm::Device::Cuda);
  });
  of_rank[0].point.merge(of_rank[1].point);
  EXPECT_TRUE(cpu.point == of_rank[0].point) << name;
  for (const Outcome &one : of_rank) EXPECT_TRUE(same_bits(cpu.numbers, one.numbers)) << name;
}

}    // namespace

TEST_F(OnDevice, GivesTheSameBitsInAxisymmetry)
{
  for (const mpm_test::RingMethod &method : mpm_test::RING_METHODS)
    for (const int ranks : {1, 2})
      EXPECT_TRUE(same_bits(mpm_test::pressed_ground(method, 1, 2, mpm::Device::Cpu),
                            mpm_test::pressed_ground(method, ranks, 2, mpm::Device::Cuda)));
}

TEST_F(OnDevice, GivesTheSameBitsWithRotatingBodies)
{
  for (const mpm::BodyForm form : {mpm::BodyForm::Box, mpm::BodyForm::Ball, mpm::BodyForm::Convex})
    expect_same_bits_of_turning_bodies<2>(form, 60);
  for (const mpm::BodyForm form :
       {mpm::BodyForm::Box, mpm::BodyForm::Ball, mpm::BodyForm::Cylinder, mpm::BodyForm::Convex})
    expect_same_bits_of_turning_bodies<3>(form, 20);
}

/// Blocks are stretched until their boxes extend over several cells, on a grid of 1.6 billion
/// nodes.
TEST_F(OnDevice, HoldsTheNodesOfBoxesThatFollowTheDeformation)
{
  constexpr double MIDDLE = 400.0, RATE = 30.0;
  for (const Scheme scheme : {Scheme::Musl, Scheme::Usavg})
    for (const int ranks : {1, 2}) {
      mpm::SolverOptions<2> options =
          mpm_test::grid_options({{0.0, 0.0}}, {{2000.0, 2000.0}}, CELL);
      options.scheme = scheme;
      options.shape = ShapeFunction::Cpgimp;
      options.mean_dilation = true;
      options.threads = 2;
      Scene all;
      for (const double x : {MIDDLE, MIDDLE + 1.0})
        all.add_block({{x - 0.3, 5.0}}, {{x + 0.3, 5.3}}, 0.5 * CELL, 2000.0);
      for (int p = 0; p < all.size(); ++p)
        all.velocity[3 * p] =
            RATE * (all.position[3 * p] - (p < all.size() / 2 ? MIDDLE : MIDDLE + 1.0));
      std::vector<Scene> parts[2];
      std::vector<int> held[2];
      for (const bool on_device : {false, true}) {
        options.device = on_device ? mpm::Device::Cuda : mpm::Device::Cpu;
        parts[on_device].resize(ranks);
        held[on_device].resize(ranks);
        mpm_test::RankTeam(ranks).run([&](int rank, const Communication &communication) {
          std::vector<int> mine;
          for (int p = 0; p < all.size(); ++p)
            if (ranks == 1 || rank == (p < all.size() / 2 ? 0 : 1)) mine.push_back(p);
          Scene scene = all.selected(mine);
          mpm::LinearElastic<2> law(1e5, 0.0);
          MpmSolver solver(options, communication);
          solver.set_models({&law});
          for (int step = 0; step < 300; ++step) {
            solver.step(scene.view(), {}, DT);
            if (step % 50 == 7) solver.evaluate(scene.view(), {}, DT);
            if (step % 100 == 60) solver.fetch(scene.view());
          }
          held[on_device][rank] = solver.held_nodes();
          solver.fetch(scene.view());
          parts[on_device][rank] = scene;
        });
      }
      double stretch = 0.0;
      for (int rank = 0; rank < ranks; ++rank) {
        expect_same_points(parts[0][rank], parts[1][rank]);
        for (const auto &F : parts[0][rank].deformation_gradient)
          stretch = std::max(stretch, F(0, 0));
        EXPECT_GE(held[1][rank], held[0][rank]) << "the device knows the largest box only";
        EXPECT_LT(held[1][rank], 20000);
      }
      EXPECT_GT(stretch, 2.0) << "boxes of several parts";
    }
}
