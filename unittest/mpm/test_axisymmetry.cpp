// SPDX-License-Identifier: GPL-2.0-only
// Axisymmetric points: weights of rings, uniform stress in balance, balance of momentum, bits and
// errors. Closed forms of cylinders, spheres and rings are in test_axisymmetric_elasticity.cpp.

#include "rings.h"

#include "mpm/drucker_prager.h"
#include "mpm/mohr_coulomb.h"
#include "rve/core/error.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

using mpm::Face;
using mpm::ShapeFunction;
using mpm::Vec2;
using mpm_test::pressed_ground;
using mpm_test::RingMethod;
using mpm_test::Scene;
using mpm_test::TURN;
using Solver = mpm::MpmSolver<2>;

namespace {

double hat(double distance)
{
  return std::max(0.0, 1.0 - std::abs(distance));
}

/// Integral from `low` to `high` of a function that is a polynomial of degree 3 at most between
/// whole numbers, by Simpson's rule.
template <class F> double integral(double low, double high, const F &f)
{
  double sum = 0.0;
  for (double from = low; from < high;) {
    const double to = std::min(high, std::floor(from) + 1.0);
    sum += (to - from) / 6.0 * (f(from) + 4.0 * f(0.5 * (from + to)) + f(to));
    from = to;
  }
  return sum;
}

}    // namespace

TEST(RingWeights, AreMeansWithTheWeightOfTheRadius)
{
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> number(0.0, 1.0);
  for (int trial = 0; trial < 2000; ++trial) {
    const double half = 0.01 + 0.49 * number(generator);
    const double xi = trial < 100 ? half : half + 5.0 * number(generator);
    const mpm::AxisWeights weights = mpm::ring_weights(xi, half, xi);
    const double low = xi - half, high = xi + half, whole = 2.0 * half * xi;
    double sum = 0.0, slopes = 0.0;
    for (int k = 0; k < 3; ++k) {
      const int node = weights.first + k;
      const double value = integral(low, high, [&](double r) { return hat(r - node) * r; });
      // ∫ N' r dr = [N r] - ∫ N dr
      const double slope = hat(high - node) * high - hat(low - node) * low -
          integral(low, high, [&](double r) { return hat(r - node); });
      EXPECT_NEAR(weights.value[k], value / whole, 1e-12);
      EXPECT_NEAR(weights.slope[k], slope / whole, 1e-11);
      sum += weights.value[k];
      slopes += weights.slope[k];
    }
    EXPECT_NEAR(sum, 1.0, 1e-13);
    EXPECT_NEAR(slopes, 0.0, 1e-12);
  }
}

namespace {

constexpr double CELL = 0.1;
constexpr double PRESSURE = 20e3;

struct Case {
  ShapeFunction shape;
  int per_cell;            ///< points per cell along an axis
  double inner;            ///< inner radius
  double stretch = 1.0;    ///< radial stretch of the boxes from their initial size
  bool mean_dilation = false;
};

/// A block of rings from an inner radius to about 1.2, 0.8 high, under an isotropic pressure. Its
/// outer face, its upper face and, if there is a hole, its inner face have tractions.
struct LoadedRings {
  Scene scene;
  std::vector<mpm::TractionLoad<2>> loads;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(10e6, 0.3);
  mpm::SolverOptions<2> options = mpm_test::ring_options({{0.0, 0.0}}, {{1.5, 1.0}}, CELL);
  double inner, outer;

  explicit LoadedRings(const Case &c) : inner(c.inner)
  {
    options.shape = c.shape;
    options.mean_dilation = c.mean_dilation;
    options.sides[static_cast<int>(Face::YLo)] = mpm::SideKind::Roller;
    const double height = CELL / c.per_cell, width = height * c.stretch;
    const int columns = static_cast<int>(std::lround((1.2 - inner) / width));
    const int rows = static_cast<int>(std::lround(0.8 / height));
    outer = inner + columns * width;
    const Face faces[] = {Face::XHi, Face::YHi, Face::XLo};
    loads.resize(inner > 0.0 ? 3 : 2);
    for (std::size_t k = 0; k < loads.size(); ++k) {
      loads[k].face = faces[k];
      loads[k].traction = {{0.0, 0.0}};
      loads[k].traction[mpm::axis_of(faces[k])] = -mpm::outward(faces[k]) * PRESSURE;
      loads[k].follows = true;
    }
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const double r = inner + (column + 0.5) * width;
        const int p =
            scene.add(r, (row + 0.5) * height, {{0.5 * width / c.stretch, 0.5 * height}}, 2000.0);
        scene.deformation_gradient[p](0, 0) = c.stretch;
        scene.volume[p] *= c.stretch;
        scene.stress[p] = {{-PRESSURE, 0.0, 0.0, -PRESSURE}};
        scene.hoop_stress[p] = -PRESSURE;
        if (column == columns - 1) loads[0].point_index.push_back(p);
        if (row == rows - 1) loads[1].point_index.push_back(p);
        if (inner > 0.0 && column == 0) loads[2].point_index.push_back(p);
      }
    mpm_test::make_rings(scene);
  }
};

class UniformStress : public testing::TestWithParam<Case> {};

}    // namespace

TEST_P(UniformStress, IsInBalanceAtEveryNodeFromTheAxisToTheOuterFace)
{
  LoadedRings rings(GetParam());
  Solver solver(rings.options);
  solver.set_models({&rings.law});

  solver.evaluate(rings.scene.view(), rings.loads, 1e-3);

  const double of_cell = PRESSURE * CELL * TURN * 1.2;
  EXPECT_LT(solver.max_unbalanced_force(), 1e-9 * of_cell) << "round-off is far below";
  const double area = 0.5 * TURN * (rings.outer * rings.outer - rings.inner * rings.inner);
  EXPECT_NEAR(solver.side_reaction(Face::YLo)[1], -PRESSURE * area, 1e-9 * PRESSURE);
}

TEST_P(UniformStress, StaysInBalanceAsTimeGoesOn)
{
  LoadedRings rings(GetParam());
  Solver solver(rings.options);
  solver.set_models({&rings.law});

  for (int step = 0; step < 50; ++step) solver.step(rings.scene.view(), rings.loads, 1e-4);

  const double speed = PRESSURE / (2000.0 * CELL) * 50 * 1e-4;    // under the pressure alone
  for (const double v : rings.scene.velocity) EXPECT_LT(std::abs(v), 1e-9 * speed);
}

INSTANTIATE_TEST_SUITE_P(
    Rings, UniformStress,
    testing::Values(Case{ShapeFunction::Gimp, 1, 0.0}, Case{ShapeFunction::Gimp, 2, 0.0},
                    Case{ShapeFunction::Gimp, 2, 0.3}, Case{ShapeFunction::Gimp, 1, 0.37},
                    Case{ShapeFunction::Gimp, 2, 0.0, 1.0, true},
                    Case{ShapeFunction::Cpgimp, 1, 0.0}, Case{ShapeFunction::Cpgimp, 2, 0.37},
                    Case{ShapeFunction::Cpgimp, 1, 0.3, 3.0},
                    Case{ShapeFunction::Cpgimp, 1, 0.0, 4.0},
                    Case{ShapeFunction::Cpgimp, 1, 0.0, 4.0, true}));

TEST(UniformStress, WithoutHoopStressIsOutOfBalance)
{
  LoadedRings rings({ShapeFunction::Gimp, 1, 0.0});
  rings.scene.hoop_stress.assign(rings.scene.size(), 0.0);
  Solver solver(rings.options);
  solver.set_models({&rings.law});
  solver.evaluate(rings.scene.view(), rings.loads, 1e-3);
  EXPECT_GT(solver.max_unbalanced_force(), 0.5 * PRESSURE * CELL * CELL * TURN);
}

TEST(Rings, FallWithTheirWeightFreely)
{
  LoadedRings rings({ShapeFunction::Gimp, 2, 0.0});
  rings.options.sides.fill(mpm::SideKind::Free);
  rings.options.sides[0] = mpm::SideKind::Roller;
  rings.options.lo = {{0.0, -1.0}};
  rings.scene.stress.assign(rings.scene.size(), rve::Tensor2::zero());
  rings.scene.hoop_stress.assign(rings.scene.size(), 0.0);
  for (int p = 0; p < rings.scene.size(); ++p)
    rings.scene.body_force[3 * p + 1] = -9.81 * rings.scene.mass[p];
  Solver solver(rings.options);
  solver.set_models({&rings.law});
  for (int step = 0; step < 200; ++step) solver.step(rings.scene.view(), {}, 1e-3);
  for (int p = 0; p < rings.scene.size(); ++p) {
    EXPECT_NEAR(rings.scene.velocity[3 * p + 1], -9.81 * 0.2, 1e-9);
    EXPECT_NEAR(rings.scene.velocity[3 * p], 0.0, 1e-9);
  }
}

TEST(Rings, MoveTheirCentreOfMassAlongTheAxisWithTheMomentum)
{
  // No force acts from outside, so the momentum along the axis is constant.
  for (const ShapeFunction shape : {ShapeFunction::Gimp, ShapeFunction::Cpgimp}) {
    Scene scene;
    scene.add_block({{0.0, 0.0}}, {{0.8, 0.4}}, CELL, 2000.0);
    mpm_test::make_rings(scene);
    std::mt19937 generator(5);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    double mass = 0.0, momentum = 0.0, before = 0.0;
    for (int p = 0; p < scene.size(); ++p) {
      scene.velocity[3 * p + 1] = number(generator);
      mass += scene.mass[p];
      momentum += scene.mass[p] * scene.velocity[3 * p + 1];
      before += scene.mass[p] * scene.position[3 * p + 1];
    }
    mpm::SolverOptions<2> options = mpm_test::ring_options({{0.0, -1.0}}, {{2.0, 1.4}}, CELL);
    options.shape = shape;
    mpm::AxisymmetricLaw law = mpm_test::elastic_rings(1e7, 0.3);
    Solver solver(options);
    solver.set_models({&law});
    constexpr int STEPS = 200;
    constexpr double DT = 2e-4;
    for (int step = 0; step < STEPS; ++step) solver.step(scene.view(), {}, DT);
    double after = 0.0;
    for (int p = 0; p < scene.size(); ++p) after += scene.mass[p] * scene.position[3 * p + 1];
    EXPECT_NEAR((after - before) / mass, STEPS * DT * momentum / mass, 1e-12);
  }
}

TEST(Rings, HaveTheRadiusOfTheirHoopStretchAndTheVolumeOfTheirBox)
{
  // Points have the velocity ε̇ r along the radius in every step. The disk becomes wider by a half,
  // or narrower by a third, so that rings come nearer to the axis than their initial half size.
  for (const ShapeFunction shape : {ShapeFunction::Gimp, ShapeFunction::Cpgimp})
    for (const double rate : {1.0, -1.0}) {
      Scene scene;
      scene.add_block({{0.0, 0.0}}, {{1.0, 0.4}}, 0.05, 2000.0);
      mpm_test::make_rings(scene);
      mpm::SolverOptions<2> options = mpm_test::ring_options({{0.0, 0.0}}, {{2.0, 0.4}}, CELL);
      options.shape = shape;
      options.sides[2] = options.sides[3] = mpm::SideKind::Roller;
      mpm::AxisymmetricLaw law = mpm_test::elastic_rings(1e-6, 0.0);    // too soft to move points
      Solver solver(options);
      solver.set_models({&law});
      const std::vector<double> before = scene.position;
      constexpr int STEPS = 400;
      constexpr double DT = 1e-3;
      for (int step = 0; step < STEPS; ++step) {
        for (int p = 0; p < scene.size(); ++p) scene.velocity[3 * p] = rate * scene.position[3 * p];
        solver.step(scene.view(), {}, DT);
      }
      const double stretch = std::pow(1.0 + rate * DT, STEPS);
      for (int p = 0; p < scene.size(); ++p) {
        const double r = before[3 * p];
        if (r > 0.8) continue;    // nodes beyond the free face have the velocity of its last points
        const rve::Tensor2 &F = scene.deformation_gradient[p];
        const double hoop = scene.volume[p] / (scene.initial_volume[p] * determinant(F));
        EXPECT_NEAR(scene.position[3 * p] / r, hoop, 2e-3);
        EXPECT_NEAR(scene.hoop_stress[p], 1e-6 * std::log(hoop), 1e-9) << "E ln λ";
        // the velocity on a node at r is h²/6r² too large
        EXPECT_NEAR(hoop, stretch, stretch * (2e-3 + CELL * CELL / (4.0 * r * r)));
      }
    }
}

TEST(RingLoads, GrowWithTheRadiusOfTheirFace)
{
  constexpr double RADIUS = 1.03, HALF = 0.05;
  for (const bool follows : {false, true})
    for (const Face face : {Face::XLo, Face::XHi, Face::YHi}) {
      Scene scene;
      scene.add(RADIUS, 0.5, {{HALF, HALF}}, 2000.0);
      mpm_test::make_rings(scene);
      mpm::SolverOptions<2> options = mpm_test::ring_options({{0.0, 0.0}}, {{2.0, 1.0}}, CELL);
      mpm::AxisymmetricLaw law = mpm_test::elastic_rings(1e6, 0.0);
      Solver solver(options);
      solver.set_models({&law});
      mpm::TractionLoad<2> load;
      load.face = face;
      load.follows = follows;
      load.traction = {{0.0, 0.0}};
      load.traction[mpm::axis_of(face)] = PRESSURE;
      load.point_index = {0};
      solver.evaluate(scene.view(), {load}, 1e-3);
      Vec2 sum = {{0.0, 0.0}};
      for (int x = -1; x <= 21; ++x)
        for (int y = -1; y <= 11; ++y) sum = sum + solver.node_force({{x, y}});
      const double radius = face == Face::YHi ? RADIUS : RADIUS + mpm::outward(face) * HALF;
      const double force = PRESSURE * TURN * radius * 2.0 * HALF;
      EXPECT_NEAR(sum[mpm::axis_of(face)], force, 1e-9 * force);
      EXPECT_NEAR(sum[1 - mpm::axis_of(face)], 0.0, 1e-9 * force);
    }
}

TEST(AxisymmetricLaws, HaveTheBitsOfTheLawsInSpace)
{
  mpm::MohrCoulomb<3> in_space(2e7, 0.3, 1e3, 25.0, 5.0);
  mpm::AxisymmetricLaw rings(std::make_shared<mpm::MohrCoulomb<3>>(2e7, 0.3, 1e3, 25.0, 5.0));
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> number(-1e-3, 1e-3);
  rve::Tensor2 stress = {{-1e4, 0.0, 0.0, -2e4}};
  rve::Tensor3 full = {{-1e4, 0.0, 0.0, 0.0, -2e4, 0.0, 0.0, 0.0, -1e4}};
  double hoop_stress = -1e4, memory[2] = {}, memory_in_space[1] = {};
  rings.begin_memory(stress, memory);
  for (int step = 0; step < 200; ++step) {
    rve::Tensor2 increment = rve::Tensor2::identity();
    for (double &component : increment.component) component += number(generator);
    const double hoop = 1.0 + number(generator);
    const rve::Tensor3 whole = {{increment(0, 0), increment(0, 1), 0.0, increment(1, 0),
                                 increment(1, 1), 0.0, 0.0, 0.0, hoop}};
    const int point = 0;
    rings.set_hoop({&hoop, &hoop_stress});
    rings.update(1, &point, &increment, 1.0, &stress, {memory, 2});
    in_space.update(1, &point, &whole, 1.0, &full, {memory_in_space, 1});
    EXPECT_EQ(hoop_stress, full(2, 2));
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) EXPECT_EQ(stress(a, b), full(a, b));
    EXPECT_EQ(memory[0], memory_in_space[0]);
  }
  EXPECT_GT(memory[0], 1e-3) << "the path must yield";
}

namespace {

class BitsOfRings : public testing::TestWithParam<RingMethod> {};

}    // namespace

TEST_P(BitsOfRings, DoNotDependOnRanksAndThreads)
{
  const std::vector<double> one = pressed_ground(GetParam(), 1, 1, mpm::Device::Cpu);
  for (const double field : one) ASSERT_TRUE(std::isfinite(field));
  for (const int ranks : {1, 2, 3})
    for (const int threads : {1, 3}) {
      const std::vector<double> other =
          pressed_ground(GetParam(), ranks, threads, mpm::Device::Cpu);
      EXPECT_EQ(std::memcmp(one.data(), other.data(), one.size() * sizeof(double)), 0)
          << ranks << " ranks, " << threads << " threads";
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, BitsOfRings, testing::ValuesIn(mpm_test::RING_METHODS));

namespace {

/// Returns the message of the error that a solver with these options throws, or "".
std::string error_of(const mpm::SolverOptions<2> &options)
{
  try {
    const Solver solver(options);
  } catch (const rve::InputError &error) {
    return error.what();
  }
  return "";
}

void expect_text(const std::string &message, const std::string &text)
{
  EXPECT_NE(message.find(text), std::string::npos) << message;
}

}    // namespace

TEST(AxisymmetricErrors, NameWhatTheAxisExcludes)
{
  const mpm::SolverOptions<2> sound = mpm_test::ring_options({{0.0, 0.0}}, {{1.0, 1.0}}, 0.1);
  EXPECT_EQ(error_of(sound), "");
  mpm::SolverOptions<2> wrong = sound;
  wrong.lo[0] = -0.5;
  expect_text(error_of(wrong), "lower limit in x must be at least 0, got -0.5");
  wrong = sound;
  wrong.sides[0] = mpm::SideKind::Free;
  expect_text(error_of(wrong), "is the axis, so it must be a roller");
  wrong = sound;
  wrong.shape = ShapeFunction::Linear;
  expect_text(error_of(wrong), "gimp or cpgimp");
  wrong = sound;
  wrong.rigid_bodies.resize(1);
  wrong.rigid_bodies[0].form = mpm::BodyForm::Ball;
  wrong.rigid_bodies[0].rough = false;
  expect_text(error_of(wrong), "is a ball");
  wrong.rigid_bodies[0].form = mpm::BodyForm::Box;
  wrong.rigid_bodies[0].free = 1;
  expect_text(error_of(wrong), "moves along y only");
  wrong.rigid_bodies[0].free = 0;
  wrong.rigid_bodies[0].turned[0] = 0.1;
  expect_text(error_of(wrong), "is turned");
  wrong.rigid_bodies[0].turned[0] = 0.0;
  wrong.rigid_bodies[0].form = mpm::BodyForm::Convex;
  wrong.rigid_body_vertices = {{{{-0.2, 0.0}}, {{0.2, 0.0}}, {{0.2, 0.2}}}};
  expect_text(error_of(wrong), "vertex at the radius -0.2");

  mpm::SolverOptions<3> in_space =
      mpm_test::grid_options_of<3>({{0.0, 0.0, 0.0}}, {{1.0, 1.0, 1.0}}, 0.1);
  in_space.axisymmetric = true;
  EXPECT_THROW(mpm::MpmSolver<3>{in_space}, rve::InputError);
}

TEST(AxisymmetricErrors, NamePointsLawsAndVelocities)
{
  mpm::SolverOptions<2> options = mpm_test::ring_options({{0.0, 0.0}}, {{1.0, 1.0}}, 0.1);
  options.rigid_bodies.resize(2);
  options.rigid_bodies[1].form = mpm::BodyForm::Box;
  options.rigid_bodies[1].rough = false;
  Solver solver(options);
  mpm::LinearElastic<2> plane(1e6, 0.3);
  EXPECT_THROW(solver.set_models({&plane}), rve::InputError);
  EXPECT_THROW(solver.set_body_velocity(0, {{0.1, 0.0}}), rve::InputError);
  const double outwards[] = {0.1, 0.0, 0.0}, spin[] = {0.0, 0.0, 0.1}, down[] = {0.0, -0.1, 0.0};
  EXPECT_THROW(solver.rigid_bodies().set_rates(1, outwards), rve::InputError);
  EXPECT_THROW(solver.rigid_bodies().set_rates(1, spin), rve::InputError);
  EXPECT_NO_THROW(solver.rigid_bodies().set_rates(1, down));

  options.rigid_bodies.clear();
  Solver other(options);
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(1e6, 0.3);
  other.set_models({&law});
  Scene scene;
  scene.add(0.3, 0.5, {{0.05, 0.05}}, 2000.0);
  mpm_test::make_rings(scene);
  scene.position[0] = 0.0;
  try {
    other.evaluate(scene.view(), {}, 1e-3);
    FAIL() << "a point on the axis has no volume";
  } catch (const mpm::PointError &error) {
    expect_text(error.what(), "has the radius 0");
  }
}
