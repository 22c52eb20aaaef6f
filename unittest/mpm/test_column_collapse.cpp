// SPDX-License-Identifier: GPL-2.0-only
// Collapse of a column of dry sand: run-out and height of the deposit against the range of
// experiments.

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>

using MpmSolver = mpm::MpmSolver<2>;
using mpm_test::Scene;

namespace {

constexpr double DEGREE = 180.0 / 3.14159265358979323846;
constexpr double DENSITY = 2000.0;
constexpr double GRAVITY = 10.0;
constexpr double HEIGHT = 2.0;                           ///< H0; L0 = 1
constexpr double WEIGHT = DENSITY * GRAVITY * HEIGHT;    ///< stress at the base
/// ratio of E to WEIGHT, for strains of 1 %
constexpr double STIFFNESS = 100.0;
constexpr double CELL = 0.1;

/// Deposit in units of the column's initial width L0.
struct Deposit {
  double run_out;    ///< (L∞ - L0)/L0
  double height;     ///< H∞/L0, at the wall
  double energy;     ///< ratio of the kinetic to the initial potential energy
};

/// Releases a plane column of the width L0 = 1 and the height H0 = 2 next to a smooth wall on a
/// rough base.
Deposit collapse(mpm::Constitutive<2> &law)
{
  Scene scene;
  scene.add_block({{0.0, 0.0}}, {{1.0, HEIGHT}}, 0.5 * CELL, DENSITY);
  for (int p = 0; p < scene.size(); ++p) {
    scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
    const double vertical = -DENSITY * GRAVITY * (HEIGHT - scene.position[3 * p + 1]);
    scene.stress[p] = {{0.5 * vertical, 0.0, 0.0, vertical}};
  }
  scene.begin_memory(law);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{6.0, 3.0}}, CELL);
  options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Fixed,
                   mpm::SideKind::Free};
  options.flip = 0.999;    // 0.1 % of PIC per step damps the noise of flowing points
  MpmSolver solver(options);
  solver.set_models({&law});
  const double dt = 0.3 * CELL / std::sqrt(law.p_wave_modulus(0) / DENSITY);
  const double time = 8.0 * std::sqrt(HEIGHT / GRAVITY);
  for (double t = 0.0; t < time; t += dt) solver.step(scene.view(), {}, dt);

  // The deposit ends at the first gap between points that is as wide as a cell.
  std::vector<double> x;
  double top = 0.0;
  for (int p = 0; p < scene.size(); ++p) {
    x.push_back(scene.position[3 * p]);
    if (scene.position[3 * p] < CELL) top = std::max(top, scene.position[3 * p + 1] + 0.25 * CELL);
  }
  std::sort(x.begin(), x.end());
  std::size_t last = 0;
  while (last + 1 < x.size() && x[last + 1] - x[last] < CELL) ++last;
  const double potential = 0.5 * WEIGHT * HEIGHT;
  return {x[last] + 0.25 * CELL - 1.0, top, solver.totals(scene.view()).kinetic_energy / potential};
}

}    // namespace

// For H0/L0 = 2 experiments have run-outs between 1.2 H0/L0 (Lube, Huppert, Sparks & Freundt 2005,
// Phys. Rev. E 72, 041301) and 1.8 H0/L0 (Lajeunesse, Monnier & Homsy 2005, Phys. Fluids 17,
// 103302), and heights of 0.83 to 1.32 L0.
TEST(ColumnCollapse, RunOutAndHeightOfSandAreWithinTheBandOfExperiments)
{
  mpm::MohrCoulomb<2> sand(STIFFNESS * WEIGHT, 0.3, 0.0, std::atan(0.5) * DEGREE, 0.0);

  const Deposit deposit = collapse(sand);

  printf("run-out %.2f, height %.2f\n", deposit.run_out, deposit.height);
  EXPECT_LT(deposit.energy, 1e-3) << "at rest";
  EXPECT_GT(deposit.run_out, 2.4);
  EXPECT_LT(deposit.run_out, 3.6);
  EXPECT_GT(deposit.height, 0.83);
  EXPECT_LT(deposit.height, 1.32);
}

TEST(ColumnCollapse, FrictionOfTwoIsOutsideTheBandOfExperiments)
{
  mpm::MohrCoulomb<2> rubble(STIFFNESS * WEIGHT, 0.3, 0.0, std::atan(2.0) * DEGREE, 0.0);

  const Deposit deposit = collapse(rubble);

  printf("run-out %.2f, height %.2f\n", deposit.run_out, deposit.height);
  EXPECT_LT(deposit.energy, 1e-3) << "at rest";
  EXPECT_LT(deposit.run_out, 2.0);
  EXPECT_GT(deposit.height, 1.4);
}
