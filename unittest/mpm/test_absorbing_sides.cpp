// SPDX-License-Identifier: GPL-2.0-only
// Tests sides with dashpots after Lysmer & Kuhlemeyer. Waves leave through these sides, no energy
// returns, and the solver records the absorbed impulse.

#include "scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

using mpm::Face;
using mpm::SideKind;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double CELL = 0.5;
constexpr double DENSITY = 2000.0, YOUNG = 50e6, POISSON = 0.25;
constexpr double SHEAR = YOUNG / (2.0 * (1.0 + POISSON));
constexpr double P_WAVE = 2.0 * SHEAR * (1.0 - POISSON) / (1.0 - 2.0 * POISSON);
const double P_SPEED = std::sqrt(P_WAVE / DENSITY), S_SPEED = std::sqrt(SHEAR / DENSITY);

constexpr int CELLS = 60;    // number along the bar
constexpr int WIDTH = 20;    // cells of the pulse
constexpr double STRAIN = 1e-5;

// Largest share of the stress of a pulse that a dashpot reflects because the grid is discrete [-].
// A chain of lumped masses ρ A h has the impedance ρ c A cos(kh/2), with the density ρ, the wave
// speed c, the cross-section A, the cell edge h and the wave number k. The dashpot has the
// impedance ρ c A and reflects the share tan²(kh/4). A pulse sin²(π x/w) of the width w has 99.9 %
// of its energy below k = 4π/w. The limit is the share at this wave number.
const double DISCRETISATION = std::pow(std::tan(PI / WIDTH), 2);

enum class End { Free, Fixed, Absorbing, RollerAndDashpots };

/// Sends a plane pulse along a bar to a side. Returns the stress of the reflected pulse divided by
/// the stress of the initial pulse [-]. The ratio is 1 for a fixed side and -1 for a free side. If
/// the axis `polarisation` is the axis of the bar, the pulse is a compression wave, otherwise a
/// shear wave. `misjudged` is the ratio of the wave speeds of the dashpots of an absorbing side to
/// the wave speeds of the bar. The bar is two cells thick.
template <int D> double reflected(End end, Face side, int polarisation, double misjudged = 1.0)
{
  const int along = mpm::axis_of(side);
  const bool is_shear = polarisation != along;
  const double c = is_shear ? S_SPEED : P_SPEED;
  const double towards = mpm::outward(side);
  mpm::Vec<D> lo = mpm::Vec<D>::zero(), hi = mpm::Vec<D>::zero();
  for (int a = 0; a < D; ++a) hi[a] = (a == along ? CELLS : 2) * CELL;

  mpm_test::SceneOf<D> scene;
  scene.add_block(lo, hi, 0.5 * CELL, DENSITY);
  const double middle = 0.5 * CELLS * CELL, width = WIDTH * CELL;
  for (int p = 0; p < scene.size(); ++p) {
    const double x = scene.position[3 * p + along] - middle;
    if (std::abs(x) > 0.5 * width) continue;
    const double strain = STRAIN * std::pow(std::cos(PI * x / width), 2);
    scene.velocity[3 * p + polarisation] = c * strain;
    const double stress = -DENSITY * c * c * strain * towards;
    mpm::Tensor<D> &sigma = scene.stress[p];
    sigma(along, polarisation) = sigma(polarisation, along) = stress;
    for (int a = 0; !is_shear && a < D; ++a)
      if (a != along) sigma(a, a) = POISSON / (1.0 - POISSON) * stress;
  }
  const std::vector<mpm::Tensor<D>> initial = scene.stress;

  mpm::SolverOptions<D> options = mpm_test::grid_options_of<D>(lo, hi, CELL);
  options.sides.fill(SideKind::Roller);
  const auto face = static_cast<int>(side);
  if (is_shear) {
    // The bar stands for a piece of a wide body. Its sides normal to the polarisation must move
    // with the wave, but not along the bar. Tangential dashpots for a million times the wave speed
    // prevent motion along the bar.
    for (const int of_wave : {2 * polarisation, 2 * polarisation + 1}) {
      options.sides[of_wave] = SideKind::Free;
      options.dashpots[of_wave].tangential = 1e6 * c;
    }
  }
  options.sides[face] = end == End::Fixed ? SideKind::Fixed
      : end == End::RollerAndDashpots     ? SideKind::Roller
                                          : SideKind::Free;
  if (end == End::Absorbing) options.dashpots[face] = {misjudged * P_SPEED, misjudged * S_SPEED};
  if (end == End::RollerAndDashpots) options.dashpots[face] = {0.0, S_SPEED};
  mpm::MpmSolver<D> solver(options);
  mpm::LinearElastic<D> law(YOUNG, POISSON);
  solver.set_models({&law});
  const double time = CELLS * CELL / c;    // to the side and back
  const int steps = static_cast<int>(std::ceil(time / (0.3 * CELL / P_SPEED)));
  for (int step = 0; step < steps; ++step) solver.step(scene.view(), {}, time / steps);

  double product = 0.0, square = 0.0;
  for (int p = 0; p < scene.size(); ++p) {
    product += initial[p](along, polarisation) * scene.stress[p](along, polarisation);
    square += initial[p](along, polarisation) * initial[p](along, polarisation);
  }
  return product / square;
}

/// Returns the elastic and kinetic energy [energy].
double energy(mpm::MpmSolver<2> &solver, mpm_test::Scene &scene)
{
  double sum = solver.totals(scene.view()).kinetic_energy;
  for (int p = 0; p < scene.size(); ++p) {
    const rve::Tensor2 &s = scene.stress[p];
    const double in_plane = s(0, 0) + s(1, 1);
    // plane strain: σ:ε/2 = (σ:σ - ν tr²)/4μ in the plane
    sum += scene.volume[p] *
        (s(0, 0) * s(0, 0) + s(1, 1) * s(1, 1) + 2.0 * s(0, 1) * s(0, 1) -
         POISSON * in_plane * in_plane) /
        (4.0 * SHEAR);
  }
  return sum;
}

/// A square of 16 x 16 cells with waves in all directions and dashpots on all sides.
struct Square {
  static constexpr int CELLS = 16;
  mpm_test::Scene scene;
  mpm::LinearElastic<2> law{YOUNG, POISSON};
  mpm::SolverOptions<2> options =
      mpm_test::grid_options({{0.0, 0.0}}, {{CELLS * CELL, CELLS *CELL}}, CELL);

  Square()
  {
    scene.add_block(options.lo, options.hi, 0.5 * CELL, DENSITY);
    for (int p = 0; p < scene.size(); ++p) {
      const double x = scene.position[3 * p] / options.hi[0];
      const double y = scene.position[3 * p + 1] / options.hi[1];
      scene.velocity[3 * p] = STRAIN * P_SPEED * (std::sin(5.0 * x + 3.0 * y) + 0.3);
      scene.velocity[3 * p + 1] = STRAIN * P_SPEED * std::cos(4.0 * x - 6.0 * y);
    }
    options.dashpots.fill({P_SPEED, S_SPEED});
  }
};

}    // namespace

TEST(AbsorbingSide, LetsACompressionWaveLeave)
{
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi}) {
    const double back = reflected<2>(End::Absorbing, side, mpm::axis_of(side));
    printf("side %d: %.4f\n", static_cast<int>(side), back);
    EXPECT_LT(std::abs(back), DISCRETISATION);
  }
  for (const Face side : {Face::XLo, Face::YHi, Face::ZLo, Face::ZHi})
    EXPECT_LT(std::abs(reflected<3>(End::Absorbing, side, mpm::axis_of(side))), DISCRETISATION);
}

TEST(AbsorbingSide, LetsAShearWaveLeave)
{
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi}) {
    const double back = reflected<2>(End::Absorbing, side, 1 - mpm::axis_of(side));
    printf("side %d: %.4f\n", static_cast<int>(side), back);
    EXPECT_LT(std::abs(back), DISCRETISATION);
  }
  for (const Face side : {Face::XHi, Face::ZLo})
    for (int a = 0; a < 3; ++a) {
      if (a == mpm::axis_of(side)) continue;
      EXPECT_LT(std::abs(reflected<3>(End::Absorbing, side, a)), DISCRETISATION);
    }
}

/// Free and fixed sides reflect the same pulses completely.
TEST(AbsorbingSide, FreeAndFixedSidesReflectTheSamePulses)
{
  for (const int polarisation : {0, 1}) {
    EXPECT_NEAR(reflected<2>(End::Free, Face::XHi, polarisation), -1.0, DISCRETISATION);
    EXPECT_NEAR(reflected<2>(End::Fixed, Face::XHi, polarisation), 1.0, DISCRETISATION);
  }
  EXPECT_NEAR(reflected<3>(End::Free, Face::ZHi, 2), -1.0, DISCRETISATION);
  EXPECT_NEAR(reflected<3>(End::Fixed, Face::ZHi, 1), 1.0, DISCRETISATION);
}

TEST(AbsorbingSide, DashpotsAtARollerAbsorbOnlyShearWaves)
{
  EXPECT_NEAR(reflected<2>(End::RollerAndDashpots, Face::YLo, 1), 1.0, DISCRETISATION);
  EXPECT_LT(std::abs(reflected<2>(End::RollerAndDashpots, Face::YLo, 0)), DISCRETISATION);
}

TEST(AbsorbingSide, WrongSpeedsReflectByTheRatioOfImpedances)
{
  // Dashpots of n times the impedance of the bar reflect (n - 1)/(n + 1) of the stress.
  for (const double n : {0.5, 2.0, 4.0}) {
    EXPECT_NEAR(reflected<2>(End::Absorbing, Face::XHi, 0, n), (n - 1.0) / (n + 1.0),
                DISCRETISATION);
    EXPECT_NEAR(reflected<2>(End::Absorbing, Face::XHi, 1, n), (n - 1.0) / (n + 1.0),
                DISCRETISATION);
  }
}

TEST(AbsorbingSides, AbsorbEnergyAndReturnNone)
{
  Square square;
  square.options.scheme = mpm::Scheme::Usavg;
  mpm::MpmSolver<2> solver(square.options);
  solver.set_models({&square.law});
  const double dt = 0.1 * CELL / P_SPEED;
  const int crossing = Square::CELLS * 10;    // steps of a compression wave across the square

  const double initial = energy(solver, square.scene);
  double before = initial;
  for (int step = 1; step <= 4 * crossing; ++step) {
    solver.step(square.scene.view(), {}, dt);
    if (step % 10 != 0) continue;    // a compression wave crosses a cell in 10 steps
    const double now = energy(solver, square.scene);
    EXPECT_LT(now, before) << "step " << step;
    before = now;
    if (step % crossing != 0) continue;
    printf("%d crossings: %.1e of the energy is left\n", step / crossing, now / initial);
    // In the time of a crossing, every wave reaches a side with an angle of incidence of at most 45
    // degrees. This side reflects less than half of the energy.
    EXPECT_LT(now, initial * std::pow(0.5, step / crossing));
  }
}

TEST(AbsorbingSides, ReceiveTheMomentumThatTheMaterialLoses)
{
  for (const bool beside_others : {false, true}) {
    Square square;
    // corners between a roller with dashpots, a fixed side and an absorbing side
    if (beside_others) {
      square.options.sides[0] = SideKind::Roller;
      square.options.dashpots[0] = {0.0, S_SPEED};
      square.options.sides[2] = SideKind::Fixed;
      square.options.dashpots[2] = {};
    }
    mpm::MpmSolver<2> solver(square.options);
    solver.set_models({&square.law});
    const double dt = 0.3 * CELL / P_SPEED;
    // The tolerance is the round-off of sums over a thousand points. It is far below the impulse of
    // any node.
    const double tolerance =
        1e-11 * DENSITY * square.options.hi[0] * square.options.hi[1] * STRAIN * P_SPEED;
    for (int step = 0; step < 20; ++step) {
      const mpm::Vec2 before = solver.totals(square.scene.view()).momentum;
      solver.step(square.scene.view(), {}, dt);
      mpm::Vec2 change = solver.totals(square.scene.view()).momentum - before;
      for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi})
        change = change + dt * solver.side_reaction(side);
      for (int a = 0; a < 2; ++a) EXPECT_NEAR(change[a], 0.0, tolerance);
    }
  }
}

TEST(AbsorbingSides, AreStableUpToACourantNumberOfOneForTheirSpeeds)
{
  for (const mpm::Scheme scheme : {mpm::Scheme::Musl, mpm::Scheme::Usavg}) {
    Square square;
    square.options.scheme = scheme;
    const double dt = 0.5 * CELL / P_SPEED;
    square.options.dashpots.fill({CELL / dt, CELL / dt});
    mpm::MpmSolver<2> solver(square.options);
    solver.set_models({&square.law});
    EXPECT_DOUBLE_EQ(solver.cfl_number(square.scene.view(), dt), 1.0);
    const double initial = energy(solver, square.scene);
    double before = initial;
    for (int step = 1; step <= 600; ++step) {
      solver.step(square.scene.view(), {}, dt);
      if (step % 50 != 0) continue;
      const double now = energy(solver, square.scene);
      EXPECT_LT(now, before) << "step " << step;
      before = now;
    }
    // The dashpots have 2 times the impedance of compression waves and 3.5 times the impedance of
    // shear waves. They reflect 1/3 of the stress of compression waves and 0.55 of the stress of
    // shear waves.
    EXPECT_LT(before, 0.1 * initial);
  }
}

/// An absorbing side exerts no static force. A traction that balances the stress keeps the ground
/// at rest.
TEST(AbsorbingSides, LeaveGroundAtRestUnderTheReactionOfItsStress)
{
  constexpr double PRESSURE = 20e3;
  Square square;
  std::vector<mpm::TractionLoad<2>> loads;
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi}) {
    mpm::TractionLoad<2> load{{{0.0, 0.0}}, side, false, {}};
    load.traction[mpm::axis_of(side)] = -mpm::outward(side) * PRESSURE;
    for (int p = 0; p < square.scene.size(); ++p) {
      const double x = square.scene.position[3 * p + mpm::axis_of(side)];
      const double edge = mpm::outward(side) < 0.0 ? 0.0 : square.options.hi[0];
      if (std::abs(x - edge) < 0.5 * CELL) load.point_index.push_back(p);
    }
    loads.push_back(load);
  }
  for (int p = 0; p < square.scene.size(); ++p)
    square.scene.stress[p] = {{-PRESSURE, 0.0, 0.0, -PRESSURE}};
  std::fill(square.scene.velocity.begin(), square.scene.velocity.end(), 0.0);
  mpm::MpmSolver<2> solver(square.options);
  solver.set_models({&square.law});
  const double dt = 0.3 * CELL / P_SPEED;
  for (int step = 0; step < 100; ++step) solver.step(square.scene.view(), loads, dt);

  // Velocity after 100 steps if round-off causes a force of 1e-12 of the nodal force.
  const double speed = 1e-12 * PRESSURE * CELL / (0.25 * DENSITY * CELL * CELL) * 100 * dt;
  for (const double v : square.scene.velocity) EXPECT_LT(std::abs(v), 10.0 * speed);
}

/// A traction of 2 ρ c v on an absorbing side sends a wave of the velocity v into the ground. The
/// other half of the traction acts on the dashpots.
TEST(AbsorbingSide, TractionOfTwiceTheStressSendsAWaveIntoTheGround)
{
  mpm_test::Scene scene;
  scene.add_block({{0.0, 0.0}}, {{CELLS * CELL, CELL}}, 0.5 * CELL, DENSITY);
  mpm::SolverOptions<2> options =
      mpm_test::grid_options({{0.0, 0.0}}, {{CELLS * CELL, CELL}}, CELL);
  options.sides = {SideKind::Free, SideKind::Free, SideKind::Roller, SideKind::Roller};
  options.dashpots[0] = options.dashpots[1] = {P_SPEED, S_SPEED};
  mpm::MpmSolver<2> solver(options);
  mpm::LinearElastic<2> law(YOUNG, POISSON);
  solver.set_models({&law});
  const double velocity = STRAIN * P_SPEED;
  std::vector<mpm::TractionLoad<2>> loads(1);
  loads[0].face = Face::XLo;
  for (int p = 0; p < scene.size(); ++p)
    if (scene.position[3 * p] < 0.5 * CELL) loads[0].point_index.push_back(p);
  const double dt = 0.3 * CELL / P_SPEED;
  const double rise = WIDTH * CELL / P_SPEED;    // the traction rises smoothly and is then constant
  const double time = 3.0 * CELLS * CELL / P_SPEED;
  for (double t = 0.0; t < time; t += dt) {
    const double share = std::pow(std::sin(0.5 * PI * std::min(1.0, t / rise)), 2);
    loads[0].traction = {{2.0 * DENSITY * P_SPEED * velocity * share, 0.0}};
    solver.step(scene.view(), loads, dt);
  }
  // The front of the wave has left through the other side. All points have the velocity of the
  // wave.
  for (int p = 0; p < scene.size(); ++p)
    EXPECT_NEAR(scene.velocity[3 * p], velocity, DISCRETISATION * velocity);
}

TEST(AbsorbingSide, RefusesInvalidOptions)
{
  const auto message = [](SideKind kind, const mpm::Dashpots &dashpots) {
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.0, 1.0}}, CELL);
    options.sides[0] = kind;
    options.dashpots[0] = dashpots;
    try {
      mpm::MpmSolver<2> solver(options);
    } catch (const rve::InputError &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  EXPECT_NE(message(SideKind::Free, {-1.0, 0.0}).find("at least 0, got -1 [length/time]"),
            std::string::npos);
  EXPECT_NE(message(SideKind::Roller, {1.0, 0.0}).find("cannot absorb compression waves"),
            std::string::npos);
  EXPECT_NE(message(SideKind::Fixed, {0.0, 1.0}).find("prescribes all velocities"),
            std::string::npos);
  EXPECT_EQ(message(SideKind::Roller, {0.0, 1.0}), "");
}
