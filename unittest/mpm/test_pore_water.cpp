// SPDX-License-Identifier: GPL-2.0-only
// Undrained pore water: its pressure as a function of the volume, Skempton's coefficient, the
// oedometer, a column at rest, the wave speed, cavitation, and sand that shears like a Tresca
// material.

#include "mpm/mohr_coulomb.h"
#include "scene.h"
#include "still_water.h"

#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <string>

using mpm::PoreWater;
using mpm::SideKind;
using mpm_test::Scene;
using mpm_test::SceneOf;
using mpm_test::StillLayers;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double YOUNG = 10e6, POISSON = 0.25, POROSITY = 0.4;

/// Moduli of an isotropic elastic material [stress].
const double SHEAR = YOUNG / (2.0 * (1.0 + POISSON));
const double P_WAVE = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
const double BULK = P_WAVE - 4.0 / 3.0 * SHEAR;

/// Relative error of small loads: 1e-16 of K_w/n over 1e-6 of the modulus of the ground.
constexpr double ROUNDING = 1e-7;

constexpr auto NO_PRESSURE = [](int) { return 0.0; };

/// Returns a cell of edge 1 with 2^D points, which can only move away from the origin.
template <int D> mpm::SolverOptions<D> one_cell(const PoreWater &water)
{
  mpm::Vec<D> lo = mpm::Vec<D>::zero(), hi;
  for (int a = 0; a < D; ++a) hi[a] = 3.0;
  mpm::SolverOptions<D> options = mpm_test::grid_options_of<D>(lo, hi, 1.0);
  for (int a = 0; a < D; ++a) options.sides[2 * a] = SideKind::Roller;
  options.water = water;
  options.damping = 0.3;
  return options;
}

template <int D> SceneOf<D> cell_of_points(const PoreWater &water, double density)
{
  SceneOf<D> scene;
  mpm::Vec<D> edge;
  for (int a = 0; a < D; ++a) edge[a] = 1.0;
  scene.add_block(mpm::Vec<D>::zero(), edge, 0.5, density);
  scene.fill_pores(water, POROSITY, NO_PRESSURE);
  return scene;
}

/// Returns a pressure [stress] on the faces of the cell that point along +axis.
template <int D>
mpm::TractionLoad<D> pressure_on(const SceneOf<D> &scene, int axis, double pressure)
{
  mpm::TractionLoad<D> load;
  load.traction = mpm::Vec<D>::zero();
  load.traction[axis] = -pressure;
  load.face = static_cast<mpm::Face>(2 * axis + 1);
  for (int p = 0; p < scene.size(); ++p)
    if (scene.position[3 * p + axis] > 0.5) load.point_index.push_back(p);
  return load;
}

}    // namespace

TEST(PorePressure, IsZeroWithoutStrainAndHasTheModulusOfTheWaterOverThePorosity)
{
  const PoreWater water = {2e9, 1e5};
  const double all = 0.25, grains = all - POROSITY * all;
  const double full = mpm::water_volume_at(water, all - grains, 0.0);

  EXPECT_EQ(mpm::pore_pressure(water, {full, grains, all}), 0.0);
  EXPECT_EQ(mpm::pore_pressure(water, {0.0, grains, 0.9 * all}), 0.0) << "a dry point";
  EXPECT_NEAR(mpm::pore_modulus(water, {full, grains, all}), 2e9 / POROSITY, 1e-5 * 2e9);
  // dp = -(K_w/n) dε_v, with the next term of the series: p = K_w (e/n + (e/n)²) for ε_v = -e
  const double strain = 1e-6, ratio = strain / POROSITY;
  EXPECT_NEAR(mpm::pore_pressure(water, {full, grains, all * (1.0 - strain)}),
              2e9 * (ratio + ratio * ratio), 1e-9 * 2e9 * ratio + 1e-6)
      << "round-off of the volumes is 1e-16 of K_w";
  const double deep = mpm::water_volume_at(water, all - grains, 3e5);
  EXPECT_NEAR(mpm::pore_pressure(water, {deep, grains, all}), 3e5, 1e-6);
}

TEST(PorePressure, IsLimitedByCavitationAndReturnsOnTheSamePath)
{
  const PoreWater water = {2e9, 1e5};
  const double all = 0.25, grains = 0.15;
  const double full = mpm::water_volume_at(water, all - grains, 0.0);
  const auto at = [&](double strain) {
    return mpm::pore_pressure(water, {full, grains, all * (1.0 + strain)});
  };

  const double before = at(1e-5);
  EXPECT_GT(before, -1e5);
  EXPECT_EQ(at(1e-3), -1e5);
  EXPECT_EQ(at(0.1), -1e5);
  EXPECT_EQ(at(1e-5), before) << "a function of the volume alone";
}

/// Under an equal pressure q on all sides the water carries B q, with Skempton's coefficient
/// B = (K_w/n)/(K' + K_w/n).
TEST(Undrained, IsotropicLoadIsSharedBySkemptonsCoefficient)
{
  for (const double stiffness : {10.0, 50.0}) {
    const PoreWater water = {stiffness * BULK * POROSITY};
    SceneOf<3> scene = cell_of_points<3>(water, 2000.0);
    mpm::LinearElastic<3> law(YOUNG, POISSON);
    mpm::MpmSolver<3> solver(one_cell<3>(water));
    solver.set_models({&law});
    const double load = 1e-6 * BULK;    // strains below 1e-7, so that the closed form is linear
    const std::vector<mpm::TractionLoad<3>> loads = {pressure_on<3>(scene, 0, load),
                                                     pressure_on<3>(scene, 1, load),
                                                     pressure_on<3>(scene, 2, load)};
    const double dt = 0.3 / solver.cfl_number(scene.view(), 1.0);

    for (int step = 0; step < 2000; ++step) solver.step(scene.view(), loads, dt);

    const double expected = stiffness / (1.0 + stiffness);
    for (int p = 0; p < scene.size(); ++p) {
      const double pressure = scene.pore_pressure(water, p);
      // the next term of p over the strain is 1e-7/n
      EXPECT_NEAR(pressure / load, expected, 1e-6) << "K_w/n = " << stiffness << " K'";
      EXPECT_NEAR(-trace(scene.stress[p]) / 3.0 + pressure, load, ROUNDING * load);
    }
  }
}

/// Without lateral strain the grains carry q M'/(M' + K_w/n) and the water the rest.
TEST(Undrained, OedometerSharesTheLoadByTheModuli)
{
  for (const double stiffness : {10.0, 50.0}) {
    const PoreWater water = {stiffness * P_WAVE * POROSITY};
    Scene scene = cell_of_points<2>(water, 2000.0);
    mpm::LinearElastic<2> law(YOUNG, POISSON);
    mpm::SolverOptions<2> options = one_cell<2>(water);
    options.hi[0] = 1.0;
    options.sides[1] = SideKind::Roller;
    mpm::MpmSolver<2> solver(options);
    solver.set_models({&law});
    const double load = 1e-6 * P_WAVE;
    const double dt = 0.3 / solver.cfl_number(scene.view(), 1.0);

    for (int step = 0; step < 2000; ++step)
      solver.step(scene.view(), {pressure_on<2>(scene, 1, load)}, dt);

    for (int p = 0; p < scene.size(); ++p) {
      const double pressure = scene.pore_pressure(water, p);
      EXPECT_NEAR(pressure / load, stiffness / (1.0 + stiffness), 1e-6);
      EXPECT_NEAR(pressure - scene.stress[p](1, 1), load, ROUNDING * load) << "total stress";
      EXPECT_NEAR(scene.stress[p](0, 0) / scene.stress[p](1, 1), POISSON / (1.0 - POISSON), 1e-6)
          << "the law has the effective stress";
    }
  }
}

/// Still water in layers of two porosities. The effective stress carries the submerged weight.
TEST(Undrained, LayeredColumnUnderItsWeightStaysAtRest)
{
  const StillLayers layers = {4.0};
  const PoreWater water = {2.2e9};
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.0, layers.height}}, 0.25, 1.0);
  layers.fill(scene, water, 0.5);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.0, 5.0}}, 0.5);
  options.sides = mpm_test::box_open_above();
  options.water = water;
  mpm::LinearElastic<2> law(YOUNG, POISSON);
  mpm::MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double weight_of_cell = StillLayers::GRAVITY * layers.density(1.0) * 0.25;
  const double dt = 0.5 / solver.cfl_number(scene.view(), 1.0);

  solver.evaluate(scene.view(), {}, dt);
  // a pressure is rounded to 1e-16 K_w/n, which is 1e-9 of the weight of a cell over its width
  EXPECT_LT(solver.max_unbalanced_force(), 1e-9 * weight_of_cell);
  for (int step = 0; step < 500; ++step) solver.step(scene.view(), {}, dt);

  for (int p = 0; p < scene.size(); ++p) {
    EXPECT_LT(std::abs(scene.velocity[3 * p + 1]), 1e-9 * StillLayers::GRAVITY * 500 * dt);
    EXPECT_NEAR(scene.pore_pressure(water, p), layers.pressure(scene.position[3 * p + 1]),
                1e-9 * 4e4);
  }
}

/// The first mode of a column that is fixed at its base has a quarter of a wave in the height, with
/// the undrained speed c² = (M' + K_w/n)/ρ of the mixture.
TEST(Undrained, ColumnVibratesWithTheUndrainedWaveSpeed)
{
  constexpr double HEIGHT = 20.0, DENSITY = 2000.0;
  const PoreWater water = {10.0 * P_WAVE * POROSITY};
  const double speed = std::sqrt(11.0 * P_WAVE / DENSITY);
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.0, HEIGHT}}, 0.5, DENSITY);
  scene.fill_pores(water, POROSITY, NO_PRESSURE);
  for (int p = 0; p < scene.size(); ++p)
    scene.velocity[3 * p + 1] =
        1e-6 * speed * std::sin(0.5 * PI * scene.position[3 * p + 1] / HEIGHT);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.0, 22.0}}, 1.0);
  options.sides = mpm_test::box_open_above();
  options.water = water;
  mpm::LinearElastic<2> law(YOUNG, POISSON);
  mpm::MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double dt = 0.2 / speed;

  EXPECT_NEAR(solver.cfl_number(scene.view(), dt), 0.2, 1e-5) << "the speed of points is 1e-6 c";
  double previous = solver.totals(scene.view()).momentum[1], first = 0.0, second = 0.0;
  for (int step = 1; second == 0.0 && step < 1000; ++step) {
    solver.step(scene.view(), {}, dt);
    const double now = solver.totals(scene.view()).momentum[1];
    if (now * previous < 0.0)
      (first == 0.0 ? first : second) = dt * (step - now / (now - previous));
    previous = now;
  }

  // twenty cells in a quarter of a wave: the frequency of the grid is low by some 0.1 %
  EXPECT_NEAR((second - first) / (2.0 * HEIGHT / speed), 1.0, 0.005);
}

/// At constant volume the mean effective stress of sand without dilation is constant, so that its
/// shear strength is p0' sin(phi): that of a Tresca material.
TEST(Undrained, SandWithoutDilationShearsLikeATrescaMaterial)
{
  constexpr double PRESSURE = 50e3, FRICTION = 30.0;
  const double strength = PRESSURE * std::sin(FRICTION * PI / 180.0);
  const PoreWater water = {1e8};
  mpm::MohrCoulomb<2> sand(YOUNG, POISSON, 0.0, FRICTION, 0.0);
  mpm::MohrCoulomb<2> clay(YOUNG, POISSON, strength, 0.0, 0.0);
  // a cell between a fixed side and a rough plate, which hold all of its nodes: simple shear
  const auto sheared = [&](mpm::Constitutive<2> &law, bool is_wet) {
    Scene scene = cell_of_points<2>(water, 2000.0);
    for (int p = 0; p < scene.size(); ++p) scene.stress[p] = {{-PRESSURE, 0.0, 0.0, -PRESSURE}};
    const int ground = scene.size();
    scene.add_block({{-1.0, 1.0}}, {{2.0, 2.0}}, 0.5, 2000.0);
    for (int p = ground; p < scene.size(); ++p) scene.rigid_body[p] = 0;
    scene.fill_pores(water, POROSITY, NO_PRESSURE);
    if (!is_wet) scene.water_volume.clear();
    scene.begin_memory(law);
    mpm::SolverOptions<2> options = mpm_test::grid_options({{-2.0, 0.0}}, {{4.0, 3.0}}, 1.0);
    options.shape = mpm::ShapeFunction::Linear;
    options.water = water;
    options.sides[2] = SideKind::Fixed;
    options.rigid_bodies.resize(1);
    options.rigid_bodies[0].face = mpm::Face::YLo;
    mpm::MpmSolver<2> solver(options);
    solver.set_models({&law});
    solver.set_body_velocity(0, {{1.0, 0.0}});
    for (int step = 0; step < 200; ++step) solver.step(scene.view(), {}, 1e-4);
    return scene.selected({0, 1, 2, 3});
  };
  const auto radius = [](const rve::Tensor2 &s) {
    return std::hypot(0.5 * (s(0, 0) - s(1, 1)), s(0, 1));
  };

  Scene of_sand = sheared(sand, true), of_clay = sheared(clay, true), dry = sheared(sand, false);

  for (int p = 0; p < of_sand.size(); ++p) {
    EXPECT_NEAR(of_sand.pore_pressure(water, p), 0.0, 1e-6) << "simple shear has no dilation";
    EXPECT_NEAR(-0.5 * trace(of_sand.stress[p]), PRESSURE, 1e-9 * PRESSURE);
    EXPECT_NEAR(radius(of_sand.stress[p]), strength, 1e-9 * strength);
    EXPECT_NEAR(radius(of_clay.stress[p]), strength, 1e-9 * strength);
  }
  // water without pressure changes no bit of a motion that is prescribed
  for (int p = 0; p < dry.size(); ++p)
    EXPECT_EQ(std::memcmp(&of_sand.stress[p], &dry.stress[p], sizeof(dry.stress[p])), 0);
}

/// A stretched cell has the suction of cavitation, and the total stress is that on its free face.
TEST(Undrained, StretchedCellCavitates)
{
  const PoreWater water = {10.0 * P_WAVE * POROSITY, 2e3};
  Scene scene = cell_of_points<2>(water, 2000.0);
  mpm::LinearElastic<2> law(YOUNG, POISSON);
  mpm::SolverOptions<2> options = one_cell<2>(water);
  options.hi[0] = 1.0;
  options.sides[1] = SideKind::Roller;
  mpm::MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double dt = 0.3 / solver.cfl_number(scene.view(), 1.0);

  for (int step = 0; step < 3000; ++step)
    solver.step(scene.view(), {pressure_on<2>(scene, 1, -10e3)}, dt);

  for (int p = 0; p < scene.size(); ++p) {
    EXPECT_EQ(scene.pore_pressure(water, p), -2e3);
    EXPECT_NEAR(scene.stress[p](1, 1), 8e3, 1e-3 * 8e3) << "strains are 7e-4";
  }
}

TEST(UndrainedErrors, AreNamed)
{
  const auto message_of = [](const std::function<void()> &work) {
    try {
      work();
    } catch (const std::exception &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  const PoreWater water = {1e8};
  const auto solver_with = [&](const PoreWater &some) {
    return message_of([&] { mpm::MpmSolver<2> solver(one_cell<2>(some)); });
  };
  EXPECT_EQ(solver_with({-1.0}),
            "bulk modulus of the pore water must be at least 0 and finite, got -1 [stress]");
  EXPECT_EQ(solver_with({1e8, -5.0}),
            "suction at which the pore water cavitates must be at least 0, got -5 [stress]");
  mpm::LinearElastic<2> law(YOUNG, POISSON);
  EXPECT_EQ(message_of([&] {
              Scene scene = cell_of_points<2>(water, 2000.0);
              mpm::MpmSolver<2> solver(one_cell<2>({}));
              solver.set_models({&law});
              solver.step(scene.view(), {}, 1e-5);
            }),
            "points have pore water, but its bulk modulus is 0");

  const std::string crushed = message_of([&] {
    Scene scene = cell_of_points<2>(water, 2000.0);
    scene.grain_volume[1] = 0.995 * scene.volume[1];
    mpm::MpmSolver<2> solver(one_cell<2>(water));
    solver.set_models({&law});
    solver.step(scene.view(), {}, 1e-5);
  });
  EXPECT_NE(crushed.find("has the porosity 0.005"), std::string::npos) << crushed;
  EXPECT_NE(crushed.find("below 0.01"), std::string::npos) << crushed;
}
