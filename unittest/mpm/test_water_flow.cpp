// SPDX-License-Identifier: GPL-2.0-only
// Pore water that flows: consolidation of a column, layers at rest, conservation of water,
// downward seepage, the limit of the time step, and messages for wrong options.

#include "scene.h"
#include "still_water.h"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <string>

using mpm::PoreWater;
using mpm::SideKind;
using mpm_test::Scene;
using mpm_test::StillLayers;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double YOUNG = 10e6, POROSITY = 0.4, GRAVITY = 9.81, WATER = 1000.0;
constexpr int BASE = 1 << static_cast<int>(mpm::Face::YLo);
constexpr int WALLS = 1 << static_cast<int>(mpm::Face::XLo) | 1 << static_cast<int>(mpm::Face::XHi);

/// Returns water with the modulus K_w/n = ratio M' and the conductivity k [length/time].
PoreWater water_of(double ratio, double conductivity)
{
  PoreWater water;
  water.modulus = ratio * YOUNG * POROSITY;
  water.mobility = conductivity / (WATER * GRAVITY);
  water.density = WATER;
  water.impervious = BASE | WALLS;
  return water;
}

/// Returns the largest time step that the limits of waves and of the flow allow, times `share`.
double stable_step(const mpm::MpmSolver<2> &solver, Scene &scene, double share)
{
  const double courant = solver.cfl_number(scene.view(), 1.0);
  const double flow = solver.flow_number(scene.view(), 1.0);
  // the positive root of (courant dt)² + flow dt = 1
  return share * 2.0 / (flow + std::sqrt(flow * flow + 4.0 * courant * courant));
}

/// Terzaghi's series for the excess pressure over p0 at the depth z below the drained surface, in
/// parts of the height, at the time factor T = c_v t/H².
double terzaghi(double z, double T)
{
  double sum = 0.0;
  for (int m = 0; m < 200; ++m) {
    const double M = 0.5 * PI * (2 * m + 1);
    sum += 2.0 / M * std::sin(M * z) * std::exp(-M * M * T);
  }
  return sum;
}

/// Largest error of p/p0 over a column of `cells` cells, and error of the settlement over the last
/// one, at some time factors.
struct Error {
  double pressure = 0.0, settlement = 0.0;
};

Error consolidation_error(int cells, double conductivity_factor = 1.0)
{
  constexpr double RATIO = 50.0, CONDUCTIVITY = 1e-4, LOAD = 10e3, DENSITY = 2000.0;
  const double h = 1.0 / cells;
  const PoreWater water = water_of(RATIO, conductivity_factor * CONDUCTIVITY);
  const double p0 = LOAD * RATIO / (RATIO + 1.0);
  const double diffusivity =
      CONDUCTIVITY / (WATER * GRAVITY) / (1.0 / YOUNG + 1.0 / (RATIO * YOUNG));
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{h, 1.0}}, 0.5 * h, DENSITY);
  scene.fill_pores(water, POROSITY, [&](int) { return p0; });
  mpm::TractionLoad<2> load;
  load.traction = {{0.0, -LOAD}};
  for (int p = 0; p < scene.size(); ++p) {
    scene.stress[p](1, 1) = p0 - LOAD;
    if (scene.position[3 * p + 1] > 1.0 - 0.5 * h) load.point_index.push_back(p);
  }
  const std::vector<double> start = scene.position;
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{h, 1.0 + 2.0 * h}}, h);
  options.sides = mpm_test::box_open_above();
  options.water = water;
  mpm::LinearElastic<2> law(YOUNG, 0.0);
  mpm::MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double dt = stable_step(solver, scene, 0.95);

  Error error;
  double time = 0.0;
  for (const double T : {0.05, 0.1, 0.2}) {
    for (; time * diffusivity < T; time += dt) solver.step(scene.view(), {load}, dt);
    // the points of a cell get the same changes of pressure: their mean is that of its middle
    std::vector<double> means(cells, 0.0);
    for (int p = 0; p < scene.size(); ++p)
      means[static_cast<int>(start[3 * p + 1] / h)] += 0.25 * scene.pore_pressure(water, p) / p0;
    for (int k = 0; k < cells; ++k) {
      const double exact = terzaghi(1.0 - (k + 0.5) * h, time * diffusivity);
      error.pressure = std::max(error.pressure, std::abs(means[k] - exact));
    }
    // the mean of p over the column gives the settlement since the undrained start
    double mean = 0.0, settlement = 0.0;
    for (int k = 0; k < 1000; ++k) mean += 1e-3 * terzaghi(1e-3 * (k + 0.5), time * diffusivity);
    for (int p = 0; p < scene.size(); ++p)
      settlement += (1.0 - scene.deformation_gradient[p](1, 1)) / scene.size();
    error.settlement = std::max(error.settlement, std::abs(settlement * YOUNG / p0 - (1.0 - mean)));
  }
  return error;
}

}    // namespace

/// A column under a sudden load, drained at its surface (Terzaghi).
TEST(Consolidation, ColumnFollowsTerzaghi)
{
  const Error coarse = consolidation_error(10), fine = consolidation_error(20);
  EXPECT_LT(coarse.pressure, 0.010);
  EXPECT_LT(fine.pressure, 0.002);
  EXPECT_LT(fine.pressure, 0.5 * coarse.pressure) << "converges at the second order";
  EXPECT_LT(fine.settlement, 0.002);
  EXPECT_GT(consolidation_error(10, 3.0).pressure, 0.1) << "the control has another conductivity";
}

namespace {

/// Returns points between y = 0 and `height` in a box of width 1, with cells of 0.25. `jitter`
/// moves them at random by parts of their width.
Scene ground(double height, double jitter)
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.0, height}}, 0.125, 2000.0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-0.125 * jitter, 0.125 * jitter);
  for (int p = 0; p < scene.size(); ++p)
    for (int a = 0; a < 2; ++a) scene.position[3 * p + a] += shift(random);
  return scene;
}

mpm::SolverOptions<2> box_with(const PoreWater &water, double height)
{
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.0, height}}, 0.25);
  options.sides = mpm_test::box_open_above();
  options.water = water;
  return options;
}

double total_water(const Scene &scene)
{
  double sum = 0.0;
  for (const double volume : scene.water_volume) sum += volume;
  return sum;
}

/// Fills the pores with water whose pressure is random in [-1, 1] Pa.
void fill_at_random(Scene &scene, const PoreWater &water)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> pressure(-1.0, 1.0);
  scene.fill_pores(water, POROSITY, [&](int) { return pressure(random); });
}

/// Largest pore pressure after some steps from random pressures up to 1 Pa [Pa].
double largest_pressure(double share, double jitter, double conductivity, double height)
{
  const PoreWater water = water_of(10.0, conductivity);
  Scene scene = ground(height, jitter);
  fill_at_random(scene, water);
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::MpmSolver<2> solver(box_with(water, 1.5));
  solver.set_models({&law});
  const double dt = stable_step(solver, scene, share);
  double largest = 0.0;
  for (int step = 0; step < 400; ++step) solver.step(scene.view(), {}, dt);
  for (int p = 0; p < scene.size(); ++p)
    largest = std::max(largest, std::abs(scene.pore_pressure(water, p)));
  return largest;
}

}    // namespace

/// Random pressures do not grow at the limit of the time step, for points in and out of order and
/// surfaces at any place in a cell. At twice the limit they grow without bound.
TEST(Flow, IsStableUpToItsLimitForAllConductivities)
{
  for (const double conductivity : {1e-1, 1e-2, 1e-3, 1e-5})
    for (const double jitter : {0.0, 0.3})
      for (const double height : {1.0, 1.125})
        EXPECT_LT(largest_pressure(0.99, jitter, conductivity, height), 1.1)
            << conductivity << " " << jitter << " " << height;
  double beyond = 0.0;
  try {
    beyond = largest_pressure(2.0, 0.3, 1e-2, 1.0);
  } catch (const mpm::PointError &) {
    beyond = HUGE_VAL;
  }
  EXPECT_GT(beyond, 1e3) << "the control";
}

/// Water between impervious sides keeps its volume while its pressures level out.
TEST(Flow, ConservesWaterBetweenImperviousSides)
{
  PoreWater water = water_of(10.0, 1e-3);
  water.impervious = 15;
  Scene scene = ground(1.0, 0.0);
  scene.fill_pores(water, POROSITY, [&](int p) { return scene.position[3 * p] < 0.5 ? 1e3 : 0.0; });
  mpm::SolverOptions<2> options = box_with(water, 1.0);
  options.sides.fill(SideKind::Roller);
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double before = total_water(scene), dt = stable_step(solver, scene, 0.9);

  for (int step = 0; step < 2000; ++step) solver.step(scene.view(), {}, dt);

  // strains of 1e-5 shift the points against the cells, by which the fluxes add up to 0
  EXPECT_NEAR(total_water(scene), before, 1e-9 * before);
  double least = 1e3, most = 0.0;
  for (int p = 0; p < scene.size(); ++p) {
    least = std::min(least, scene.pore_pressure(water, p));
    most = std::max(most, scene.pore_pressure(water, p));
  }
  EXPECT_NEAR(least, 500.0, 5.0);
  EXPECT_NEAR(most, 500.0, 5.0);
}

/// Still water in layers of two porosities does not flow, and its ground stays at rest. With an
/// open base the water flows down under a gradient of one and loses its pressure.
TEST(Flow, LayersStayAtRestUntilTheirBaseIsOpened)
{
  const StillLayers layers = {1.0};
  for (const bool is_open : {false, true}) {
    PoreWater water = water_of(20.0, 1e-3);
    if (is_open) water.impervious &= ~BASE;
    Scene scene = ground(layers.height, 0.0);
    layers.fill(scene, water, 0.0);
    const std::vector<double> full = scene.water_volume;
    mpm::SolverOptions<2> options = box_with(water, 1.5);
    options.damping = 0.3;
    mpm::LinearElastic<2> law(YOUNG, 0.0);
    mpm::MpmSolver<2> solver(options);
    solver.set_models({&law});
    const double dt = stable_step(solver, scene, 0.9);
    const Scene start = scene;

    for (int step = 0; step < (is_open ? 20000 : 1000); ++step) solver.step(scene.view(), {}, dt);

    constexpr int ROW = 8;    // points of a row, two rows per cell
    for (int p = 0; p < scene.size(); ++p) {
      const double still = layers.pressure(start.position[3 * p + 1]);
      if (is_open && p / ROW % 2 == 0) {
        const double mean =
            0.5 * (scene.pore_pressure(water, p) + scene.pore_pressure(water, p + ROW));
        EXPECT_LT(std::abs(mean), 0.01 * layers.pressure(0.0));
      } else if (!is_open) {
        EXPECT_NEAR(scene.pore_pressure(water, p), still, 1e-9 * WATER * GRAVITY);
        EXPECT_LT(std::abs(scene.velocity[3 * p + 1]), 1e-9 * GRAVITY * 1000 * dt);
        EXPECT_NEAR(scene.water_volume[p], full[p], 1e-13 * full[p]);
      }
    }
  }
}

TEST(FlowErrors, AreNamed)
{
  const auto message_with = [](const std::function<void(mpm::SolverOptions<2> &)> &change) {
    mpm::SolverOptions<2> options = box_with(water_of(10.0, 1e-3), 1.5);
    change(options);
    try {
      mpm::MpmSolver<2> solver(options);
    } catch (const std::exception &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  using Options = mpm::SolverOptions<2>;
  EXPECT_EQ(message_with([](Options &) {}), "");
  EXPECT_EQ(message_with([](Options &some) { some.water.mobility = -1.0; }),
            "mobility of the pore water must be at least 0 and finite, got -1 "
            "[length^4/(force time)]");
  EXPECT_EQ(message_with([](Options &some) { some.water.density = -1.0; }),
            "density of the pore water must be at least 0 and finite, got -1 [mass/length^3]");
  EXPECT_EQ(message_with([](Options &some) { some.water.modulus = 0.0; }),
            "water that flows needs a bulk modulus above 0");
  EXPECT_EQ(message_with([](Options &some) { some.scheme = mpm::Scheme::Usavg; }),
            "water that flows needs the scheme musl");
  EXPECT_EQ(message_with([](Options &some) { some.mean_dilation = true; }),
            "water that flows does not support means of the dilation over cells");
  EXPECT_EQ(message_with([](Options &some) { some.shape = mpm::ShapeFunction::Linear; }),
            "water that flows needs the shape functions gimp or cpgimp");

  // the weight of water without pressure empties points below an impervious side
  PoreWater water = water_of(10.0, 1e-1);
  water.impervious = 15;
  water.cavitation = 0.0;
  Scene scene = ground(1.0, 0.0);
  scene.fill_pores(water, POROSITY, [](int) { return 0.0; });
  for (int p = 0; p < scene.size(); ++p) {
    scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
    if (scene.position[3 * p + 1] > 0.75) scene.water_volume[p] = 1e-12;
  }
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::MpmSolver<2> solver(box_with(water, 1.0));
  solver.set_models({&law});
  std::string dry;
  try {
    solver.step(scene.view(), {}, 1e-5);
  } catch (const mpm::PointError &problem) {
    dry = problem.what();
  }
  EXPECT_NE(dry.find("has lost all of its water"), std::string::npos) << dry;
}
