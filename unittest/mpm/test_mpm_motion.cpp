// SPDX-License-Identifier: GPL-2.0-only
// Motion in closed form: free flight, rotation, patch test, a vibrating bar, and two colliding
// disks.

#include "scene.h"

#include <gtest/gtest.h>

using MpmSolver = mpm::MpmSolver<2>;
using mpm::Scheme;
using mpm::ShapeFunction;
using mpm_test::Scene;
using rve::Tensor2;

namespace {

constexpr double PI = 3.14159265358979323846;

struct Case {
  ShapeFunction shape;
  Scheme scheme;
};

class Motion : public testing::TestWithParam<Case> {
 protected:
  static mpm::SolverOptions<2> options(const mpm::Vec2 &hi, double cell)
  {
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, hi, cell);
    options.shape = GetParam().shape;
    options.scheme = GetParam().scheme;
    return options;
  }
};

/// Returns ½ σ : ε of linear elasticity in plane strain times the volume.
double strain_energy(const Scene &scene, int p, double young, double poisson)
{
  const Tensor2 &s = scene.stress[p];
  const double shear_modulus = young / (2.0 * (1.0 + poisson));
  const double sum = s(0, 0) + s(1, 1);
  const double square = s(0, 0) * s(0, 0) + s(1, 1) * s(1, 1) + 2.0 * s(0, 1) * s(0, 1);
  return scene.volume[p] * (square - poisson * sum * sum) / (4.0 * shear_modulus);
}

}    // namespace

TEST_P(Motion, FreeFlightKeepsVelocityMassAndMomentumAcrossCells)
{
  Scene scene;
  scene.add_block({{0.5, 0.5}}, {{1.5, 1.25}}, 0.125, 7.0);
  for (int p = 0; p < scene.size(); ++p) {
    scene.velocity[3 * p] = 0.75;
    scene.velocity[3 * p + 1] = 0.5;
  }
  const Scene start = scene;
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options({{4.0, 4.0}}, 0.25));
  solver.set_models({&law});

  const double mass = solver.totals(scene.view()).mass;
  const mpm::Vec2 momentum = solver.totals(scene.view()).momentum;
  for (int step = 0; step < 128; ++step) solver.step(scene.view(), {}, 1.0 / 64.0);

  EXPECT_EQ(solver.totals(scene.view()).mass, mass);
  EXPECT_NEAR(solver.totals(scene.view()).momentum[0], momentum[0], 1e-10 * momentum[0]);
  for (int p = 0; p < scene.size(); ++p) {
    // L is not exactly 0, since velocities of nodes are quotients of rounded sums; the error is
    // 1e-8 at nodes with hardly any mass.
    EXPECT_NEAR(scene.position[3 * p], start.position[3 * p] + 1.5, 1e-9);
    EXPECT_NEAR(scene.position[3 * p + 1], start.position[3 * p + 1] + 1.0, 1e-9);
    EXPECT_NEAR(scene.velocity[3 * p], 0.75, 1e-7);
    EXPECT_NEAR(scene.stress[p](0, 0), 0.0, 1e-5);
  }
}

TEST_P(Motion, InternalForcesGiveTheNodesNoMomentum)
{
  Scene scene;
  scene.add_block({{0.5, 0.5}}, {{1.5, 1.25}}, 0.125, 7.0);
  for (int p = 0; p < scene.size(); ++p)
    scene.stress[p] = {{std::sin(p), std::cos(p), std::cos(p), std::sin(2.0 * p)}};
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options({{4.0, 4.0}}, 0.25));
  solver.set_models({&law});

  solver.evaluate(scene.view(), {}, 0.01);

  double force[2] = {
      // the integer sums are exact (test_grid_transfer); their conversion to doubles rounds
      0.0, 0.0};
  for (int j = -1; j <= 17; ++j)
    for (int i = -1; i <= 17; ++i)
      for (int c = 0; c < 2; ++c) force[c] += solver.node_force({{i, j}})[c];
  EXPECT_NEAR(force[0], 0.0, 1e-15);
  EXPECT_NEAR(force[1], 0.0, 1e-15);
}

TEST_P(Motion, BodyForceAcceleratesEveryPointAlike)
{
  Scene scene;
  scene.add_block({{0.5, 2.5}}, {{1.5, 3.25}}, 0.125, 7.0);
  for (int p = 0; p < scene.size(); ++p) scene.body_force[3 * p + 1] = -2.0 * scene.mass[p];
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options({{4.0, 4.0}}, 0.25));
  solver.set_models({&law});

  for (int step = 0; step < 64; ++step) solver.step(scene.view(), {}, 1.0 / 64.0);

  for (int p = 0; p < scene.size(); ++p) {
    EXPECT_NEAR(scene.velocity[3 * p + 1], -2.0, 1e-9);
    EXPECT_NEAR(scene.velocity[3 * p], 0.0, 1e-9);
  }
}

TEST_P(Motion, RigidRotationRotatesTheStressWithoutStrain)
{
  // In one small step with v = ω × r, the velocity gradient is L = ω J at every point, with the
  // rotation J by a right angle. The stress rotates with constant invariants.
  Scene scene;
  scene.add_block({{1.0, 1.0}}, {{3.0, 3.0}}, 0.125, 7.0);
  const double spin = 0.3;
  const double dt = 1e-4;
  const Tensor2 initial = {{-2.0, 0.5, 0.5, -1.0}};
  for (int p = 0; p < scene.size(); ++p) {
    scene.velocity[3 * p] = -spin * (scene.position[3 * p + 1] - 2.0);
    scene.velocity[3 * p + 1] = spin * (scene.position[3 * p] - 2.0);
    scene.stress[p] = initial;
  }
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options({{4.0, 4.0}}, 0.25));
  solver.set_models({&law});

  solver.step(scene.view(), {}, dt);

  const double turn = spin * dt;
  int interior = 0;
  for (int p = 0; p < scene.size(); ++p) {
    const double x = scene.position[3 * p] - 2.0;
    const double y = scene.position[3 * p + 1] - 2.0;
    if (std::max(std::abs(x), std::abs(y)) > 0.2) continue;    // three cells from the surface
    ++interior;
    // Inside the block nothing accelerates. The tolerance of 1e-9 covers the round-off divided by
    // the cell edge and the error (ω dt)² of the explicit step.
    EXPECT_NEAR(scene.velocity_gradient[p](0, 0), 0.0, 1e-9);
    EXPECT_NEAR(scene.velocity_gradient[p](1, 0), spin, 1e-9);
    EXPECT_NEAR(scene.stress[p](0, 0), initial(0, 0) - 2.0 * turn * initial(0, 1), 1e-6);
    EXPECT_NEAR(scene.stress[p](0, 1), initial(0, 1) + turn * (initial(0, 0) - initial(1, 1)),
                1e-6);
  }
  EXPECT_EQ(interior, 16);
}

TEST_P(Motion, PatchUnderUniformVelocityGradientStrainsUniformly)
{
  Scene scene;
  scene.add_block({{1.0, 1.0}}, {{3.0, 3.0}}, 0.125, 7.0);
  const Tensor2 gradient = {{0.02, 0.01, -0.03, 0.04}};
  const double dt = 1e-3;
  for (int p = 0; p < scene.size(); ++p)
    for (int c = 0; c < 2; ++c)
      scene.velocity[3 * p + c] =
          gradient(c, 0) * scene.position[3 * p] + gradient(c, 1) * scene.position[3 * p + 1];
  mpm::LinearElastic<2> law(100.0, 0.0);
  MpmSolver solver(options({{4.0, 4.0}}, 0.25));
  solver.set_models({&law});

  solver.step(scene.view(), {}, dt);

  for (int p = 0; p < scene.size(); ++p) {
    if (std::abs(scene.position[3 * p] - 2.0) > 0.4 ||
        std::abs(scene.position[3 * p + 1] - 2.0) > 0.4)
      continue;
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(scene.velocity_gradient[p].component[k], gradient.component[k], 1e-6);
    EXPECT_NEAR(scene.stress[p](0, 0), 100.0 * 0.02 * dt, 1e-3 * 100.0 * 0.02 * dt) << "O(L dt)";
    EXPECT_NEAR(scene.stress[p](0, 1), 50.0 * (0.01 - 0.03) * dt, 1e-3 * 100.0 * 0.02 * dt);
    EXPECT_NEAR(scene.volume[p], scene.initial_volume[p] * (1.0 + 0.06 * dt),
                1e-8 * scene.initial_volume[p]);
  }
}

TEST_P(Motion, BarVibratesWithTheFrequencyOfItsFirstMode)
{
  // A bar fixed at x = 0 with E = 100, L = 25 and ρ = 1 starts with v = v0 sin(β x). Its mean
  // velocity is v_cm = v0/(β L) cos(ω t) with β = π/(2L) and ω = β sqrt(E/ρ).
  const double speed = 0.1;
  const double wave_number = PI / 50.0;
  const double omega = wave_number * 10.0;
  ASSERT_NEAR(omega, 0.6283, 1e-4);
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{25.0, 1.0}}, 0.5, 1.0);
  for (int p = 0; p < scene.size(); ++p)
    scene.velocity[3 * p] = speed * std::sin(wave_number * scene.position[3 * p]);
  mpm::LinearElastic<2> law(100.0, 0.0);
  mpm::SolverOptions<2> bar = options({{27.0, 1.0}}, 1.0);
  bar.sides = {mpm::SideKind::Roller, mpm::SideKind::Free, mpm::SideKind::Roller,
               mpm::SideKind::Roller};
  MpmSolver solver(bar);
  solver.set_models({&law});
  const double dt = 0.02;
  const int steps = 2500;    // 50 = five periods

  std::vector<double> crossing;    // times of v_cm = 0
  double last_extreme = 0.0;
  double previous = solver.totals(scene.view()).momentum[0] / 25.0;
  const double amplitude = previous;
  for (int step = 1; step <= steps; ++step) {
    solver.step(scene.view(), {}, dt);
    const double velocity = solver.totals(scene.view()).momentum[0] / 25.0;
    if (velocity * previous < 0.0)
      crossing.push_back(dt * (step - velocity / (velocity - previous)));
    if (step > steps - 250) last_extreme = std::max(last_extreme, std::abs(velocity));
    previous = velocity;
  }

  EXPECT_NEAR(amplitude, speed / (wave_number * 25.0), 1e-3 * amplitude);
  ASSERT_EQ(crossing.size(), 10u);
  const double measured = PI * 9.0 / (crossing.back() - crossing.front());
  EXPECT_NEAR(measured, omega, 0.01 * omega) << "25 cells in a quarter wave: discretisation";
  EXPECT_NEAR(last_extreme, amplitude, 0.03 * amplitude) << "last half period of five";
}

TEST_P(Motion, CollidingDisksKeepEnergyAndSymmetry)
{
  // E = 1000, ν = 0.3, ρ = 1000, R = 0.2, v = ±(0.1, 0.1) (Sulsky, Chen & Schreyer 1994)
  const double cell = 0.05;
  Scene scene;
  for (const double centre : {0.2, 0.8})
    scene.add_block({{centre - 0.2, centre - 0.2}}, {{centre + 0.2, centre + 0.2}}, 0.5 * cell,
                    1000.0,
                    [&](double x, double y) { return std::hypot(x - centre, y - centre) < 0.2; });
  const int half = scene.size() / 2;
  for (int p = 0; p < scene.size(); ++p)
    for (int c = 0; c < 2; ++c) scene.velocity[3 * p + c] = p < half ? 0.1 : -0.1;
  mpm::LinearElastic<2> law(1000.0, 0.3);
  MpmSolver solver(options({{1.0, 1.0}}, cell));
  solver.set_models({&law});
  const double dt = 5e-3;
  const double initial = solver.totals(scene.view()).kinetic_energy;
  ASSERT_LT(solver.cfl_number(scene.view(), dt), 0.2);

  double least_kinetic = initial;
  double most = initial;
  double least = initial;
  for (int step = 0; step < 640;
       ++step) {    // until t = 3.2; contact begins at 1.6 or slightly earlier
    solver.step(scene.view(), {}, dt);
    const mpm::Totals<2> totals = solver.totals(scene.view());
    double energy = totals.kinetic_energy;
    for (int p = 0; p < scene.size(); ++p) energy += strain_energy(scene, p, 1000.0, 0.3);
    least_kinetic = std::min(least_kinetic, totals.kinetic_energy);
    most = std::max(most, energy);
    least = std::min(least, energy);
    ASSERT_NEAR(totals.momentum[0], 0.0, 1e-9);
    ASSERT_NEAR(totals.momentum[1], 0.0, 1e-9);
  }

  EXPECT_LT(least_kinetic, 0.6 * initial) << "the disks did collide";
  EXPECT_LT(most, 1.01 * initial);
  EXPECT_GT(least, 0.91 * initial) << "8 cells per diameter; 0.92 to 0.93 for the three schemes";
  EXPECT_LT(scene.velocity[0], 0.0) << "they bounced";
  for (int p = 0; p < half;
       ++p) {    // point reflection at (0.5, 0.5); the blocks are filled in the same order
    const int mirror = scene.size() - 1 - p;
    for (int c = 0; c < 2; ++c)
      ASSERT_NEAR(scene.position[3 * p + c] + scene.position[3 * mirror + c], 1.0, 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, Motion,
                         testing::Values(Case{ShapeFunction::Gimp, Scheme::Musl},
                                         Case{ShapeFunction::Gimp, Scheme::Usavg},
                                         Case{ShapeFunction::Linear, Scheme::Musl}));

TEST(LocalDamping, BringsAColumnUnderItsWeightToRest)
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{0.2, 1.0}}, 0.1, 2000.0);
  for (int p = 0; p < scene.size(); ++p) scene.body_force[3 * p + 1] = -10.0 * scene.mass[p];
  mpm::LinearElastic<2> law(10e6, 0.0);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{0.2, 1.2}}, 0.1);
  options.sides = mpm_test::box_open_above();
  options.damping = 0.5;
  MpmSolver solver(options);
  solver.set_models({&law});

  for (int step = 0; step < 1000; ++step) solver.step(scene.view(), {}, 5e-4);

  const double weight = 2000.0 * 10.0 * 0.2;
  EXPECT_NEAR(solver.side_reaction(mpm::Face::YLo)[1], -weight, 1e-3 * weight)
      << "damping is no support";
  for (int p = 0; p < scene.size(); ++p)
    EXPECT_NEAR(scene.stress[p](1, 1), -2000.0 * 10.0 * (1.0 - scene.position[3 * p + 1]),
                0.03 * 2e4)
        << "depth, with the settlement of 1e-3";
}

TEST(Pic, UsesTheVelocityOfTheGrid)
{
  // One fast point is among slow ones. FLIP keeps the difference of velocities, PIC distributes it.
  for (const double flip : {0.0, 1.0}) {
    Scene scene;
    scene.add_block({{0.5, 0.5}}, {{1.5, 1.5}}, 0.125, 7.0);
    scene.velocity[3 * 27] = 1.0;
    mpm::LinearElastic<2> law(100.0, 0.3);
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{2.0, 2.0}}, 0.25);
    options.flip = flip;
    MpmSolver solver(options);
    solver.set_models({&law});

    solver.step(scene.view(), {}, 1e-6);

    if (flip == 1.0)
      EXPECT_NEAR(scene.velocity[3 * 27], 1.0, 1e-3);
    else
      EXPECT_LT(scene.velocity[3 * 27], 0.5);
    EXPECT_NEAR(solver.totals(scene.view()).momentum[0], 1.0 * scene.mass[27], 1e-9);
  }
}
