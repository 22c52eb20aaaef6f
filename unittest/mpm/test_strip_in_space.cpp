// SPDX-License-Identifier: GPL-2.0-only
// A strip footing on Tresca ground, which must keep its volume under plastic flow. The model is a
// slice of space with eight points per cell.

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

using mpm::Face;
using mpm::SideKind;

namespace {

struct Capacity {
  double factor;    ///< mean pressure in the last quarter of the settlement / cohesion
  double gain;      ///< relative increase of the mean pressure from the third to the last quarter
};

/// Returns the capacity of a rough strip with a half width of 1 m, or `half` cells, on a slice one
/// cell thick, 3 m wide and deep.
Capacity capacity_of_strip(int half, int points_along_cell, bool mean_dilation)
{
  constexpr double YOUNG = 2e7, COHESION = 1e4, DENSITY = 2000.0, EXTENT = 3.0;
  const double h = 1.0 / half, width = h / points_along_cell;
  mpm_test::SceneOf<3> scene;
  scene.add_block({{0.0, 0.0, 0.0}}, {{EXTENT, h, EXTENT}}, width, DENSITY);
  const int ground = scene.size();
  scene.add_block({{0.0, 0.0, EXTENT}}, {{1.0, h, EXTENT + h}}, h, DENSITY);
  for (int p = ground; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  mpm::MohrCoulomb<3> law(YOUNG, 0.3, COHESION, 0.0, 0.0);
  scene.begin_memory(law);
  mpm::SolverOptions<3> options =
      mpm_test::grid_options_of<3>({{0.0, 0.0, 0.0}}, {{EXTENT, h, EXTENT + 4.0 * h}}, h);
  options.sides.fill(SideKind::Roller);
  options.sides[static_cast<int>(Face::ZLo)] = SideKind::Fixed;
  options.sides[static_cast<int>(Face::ZHi)] = SideKind::Free;
  options.flip = 1.0 - 0.01 * half;
  options.mean_dilation = mean_dilation;
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].face = Face::ZLo;
  mpm::MpmSolver<3> solver(options);
  solver.set_models({&law});
  const double dt = 6e-3 * h, ramp = 0.5, speed = 0.1, end = 0.06;
  double settlement = 0.0, sum[4] = {};
  int count[4] = {};
  for (int step = 0; settlement < end; ++step) {
    const double v = speed * std::min(1.0, (step + 0.5) * dt / ramp);
    settlement += v * dt;
    solver.set_body_velocity(0, {{0.0, 0.0, -v}});
    solver.step(scene.view(), {}, dt);
    const int quarter = std::min(3, static_cast<int>(4.0 * settlement / end));
    sum[quarter] += solver.body_reaction(0)[2] / (h * COHESION);
    ++count[quarter];
  }
  const double last = sum[3] / count[3], before = sum[2] / count[2];
  printf(
      "strip in space, %d cells, %d points along each, %s: N_c %.3f, of the third quarter %.3f\n",
      half, points_along_cell, mean_dilation ? "dilation cell" : "dilation point", last, before);
  return {last, last / before - 1.0};
}

}    // namespace

TEST(TrescaStripInSpace, LocksWithEightPointsPerCellUnlessMeanDilationIsUsed)
{
  // The capacity is (2 + π) c (Prandtl). A footing that holds the nodes of its edge acts as if it
  // were half a cell wider. With twice as many cells the factor is 6.16 with locking and 5.71 with
  // mean dilation.
  constexpr int HALF = 4;
  const double prandtl = 2.0 + 3.14159265358979323846, wider = 1.0 + 0.5 / HALF;
  const Capacity one = capacity_of_strip(HALF, 1, false),
                 locked = capacity_of_strip(HALF, 2, false),
                 mended = capacity_of_strip(HALF, 2, true);
  EXPECT_GT(locked.factor, 1.3 * prandtl) << "eight points want eight times no change of volume";
  EXPECT_GT(mended.factor, prandtl);
  EXPECT_LT(mended.factor, 1.05 * wider * prandtl) << "3 % above what the edge explains";
  EXPECT_NEAR(mended.factor, one.factor, 0.03 * one.factor)
      << "one point in a cell, whose volumetric part is its mean: 1.3 %";
  EXPECT_LT(mended.gain, 0.01) << "0.6 %: a limit load";
  EXPECT_GT(locked.gain, 2.0 * mended.gain) << "1.9 %: still rising";
}
