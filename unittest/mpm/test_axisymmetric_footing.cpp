// SPDX-License-Identifier: GPL-2.0-only
// Circular footings as axisymmetric models: a flexible and a rigid one on elastic ground, and limit
// loads on Tresca's ground.

#include "rings.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

using mpm::Face;
using mpm::SideKind;
using mpm_test::Scene;
using mpm_test::TURN;
using Solver = mpm::MpmSolver<2>;

namespace {

constexpr double YOUNG = 10e6, POISSON = 0.3, DENSITY = 2000.0;

/// Ground of the radius and depth `extent` below y = 0 with one point per cell, and a rigid body on
/// it from the axis to `radius` if that is above 0.
struct Ground {
  Scene scene;
  mpm::SolverOptions<2> options;
  int points;    ///< of the ground

  Ground(double extent, double cell, double radius)
  {
    scene.add_block({{0.0, -extent}}, {{extent, 0.0}}, cell, DENSITY);
    points = scene.size();
    for (const double x : {0.5 * cell, radius - 0.5 * cell}) {
      if (!(radius > 0.0)) break;
      const int p = scene.add(x, 0.5 * cell, {{0.5 * cell, 0.5 * cell}}, DENSITY);
      scene.rigid_body[p] = 0;
    }
    mpm_test::make_rings(scene);
    options = mpm_test::ring_options({{0.0, -extent}}, {{extent, 4.0 * cell}}, cell);
    options.sides[static_cast<int>(Face::XHi)] = SideKind::Roller;
    options.sides[static_cast<int>(Face::YLo)] = SideKind::Fixed;
    if (radius > 0.0) options.rigid_bodies.resize(1);
  }
};

}    // namespace

TEST(FlexibleCircle, HasTheStressAndTheSettlementOfBoussinesq)
{
  // R = 1, q on ground of 8 R by 8 R. Half space: σ_z(R) = (1 - 2^-3/2) q = 0.6464 q on the axis,
  // settlement 2 q R (1 - ν²)/E of the centre. Ground of a finite depth settles less, by the
  // strains of the half space below it.
  constexpr double EXTENT = 8.0, CELL = 0.25, LOAD = 1e-5 * YOUNG;
  Ground ground(EXTENT, CELL, 0.0);
  ground.options.damping = 0.2;
  ground.options.flip = 0.98;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(YOUNG, POISSON);
  Solver solver(ground.options);
  solver.set_models({&law});
  std::vector<mpm::TractionLoad<2>> loads(1);
  loads[0].traction = {{0.0, -LOAD}};
  Scene &scene = ground.scene;
  int top = -1, deep = -1;
  for (int p = 0; p < scene.size(); ++p) {
    const double r = scene.position[3 * p], y = scene.position[3 * p + 1];
    if (y > -CELL && r < 1.0) loads[0].point_index.push_back(p);
    if (r > CELL) continue;
    if (y > -CELL) top = p;
    if (y > -1.0 - CELL && y < -1.0) deep = p;
  }
  const double before = scene.position[3 * top + 1];
  const double dt = 0.5 * CELL / 82.0;
  for (double time = 0.0; time < 2.0; time += dt) solver.step(scene.view(), loads, dt);
  const double depth = -scene.position[3 * deep + 1], R = 1.0;
  // on the axis at the depth z: σ_z = q (1 - (z²/(R² + z²))^3/2)
  const double exact = 1.0 - std::pow(depth * depth / (R * R + depth * depth), 1.5);
  const double stress = -scene.stress[deep](1, 1) / LOAD;
  const double settlement =
      (before - scene.position[3 * top + 1]) / (2.0 * LOAD * R * (1.0 - POISSON * POISSON) / YOUNG);
  printf("flexible circle: stress %.4f (%.4f), settlement %.3f of that of the half space\n", stress,
         exact, settlement);
  EXPECT_NEAR(stress, exact, 0.02);
  EXPECT_GT(settlement, 0.80);
  EXPECT_LT(settlement, 1.0);
}

namespace {

/// Presses a rigid circle down to the settlement `end`. Returns the mean pressure over the last
/// quarter of the settlement.
double pressed(Ground &ground, mpm::AxisymmetricLaw &law, bool rough, double end, double speed,
               double radius, double dt)
{
  ground.scene.begin_memory(law);
  ground.options.rigid_bodies[0].rough = rough;
  Solver solver(ground.options);
  solver.set_models({&law});
  double settlement = 0.0, sum = 0.0;
  int count = 0;
  const double ramp = 0.3 * end / speed;
  for (int step = 0; settlement < end; ++step) {
    const double v = speed * std::min(1.0, (step + 0.5) * dt / ramp);
    settlement += v * dt;
    solver.set_body_velocity(0, {{0.0, -v}});
    solver.step(ground.scene.view(), {}, dt);
    if (settlement < 0.75 * end) continue;
    sum += solver.body_reaction(0)[1] / (0.5 * TURN * radius * radius);
    ++count;
  }
  return sum / count;
}

}    // namespace

TEST(SmoothPunch, HasTheStiffnessOfARigidCircle)
{
  constexpr double CELL = 0.25, RADIUS = 1.0 + 0.5 * CELL, EXTENT = 8.0, END = 1e-5;
  Ground ground(EXTENT, CELL, RADIUS);
  ground.options.damping = 0.1;
  ground.options.flip = 0.98;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(YOUNG, POISSON);
  const double pressure = pressed(ground, law, false, END, END / 2.0, RADIUS, 0.5 * CELL / 82.0);
  const double force = pressure * 0.5 * TURN * RADIUS * RADIUS;
  const double factor = force * (1.0 - POISSON * POISSON) / (YOUNG * RADIUS * 0.875 * END);
  printf("smooth punch: force %.3f E a u/(1 - nu^2)\n", factor);
  EXPECT_GT(factor, 2.0) << "the ground ends at 7 radii";
  EXPECT_LT(factor, 2.3);
}

TEST(RoughPunch, TakesTheGroundUnderItDownEvenly)
{
  // The first points are half a cell below the nodes that the footing holds. Strain of that half
  // cell is 4 % of the settlement, and all points have the same within 2 %.
  constexpr double CELL = 0.125, RADIUS = 1.0 + 0.5 * CELL, END = 0.02;
  Ground ground(2.5, CELL, RADIUS);
  ground.options.flip = 0.999;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(YOUNG, POISSON);
  const std::vector<double> before = ground.scene.position;
  pressed(ground, law, true, END, 0.05, RADIUS, 6e-3 * CELL);
  int count = 0;
  for (int p = 0; p < ground.points; ++p) {
    if (before[3 * p] > 0.5 || before[3 * p + 1] < -CELL) continue;
    const double settlement = before[3 * p + 1] - ground.scene.position[3 * p + 1];
    EXPECT_NEAR(settlement, 0.96 * END, 0.02 * END) << "r = " << before[3 * p];
    ++count;
  }
  EXPECT_EQ(count, 4);
}

TEST(TrescaCircle, HasTheLimitLoadsOfASmoothAndARoughFooting)
{
  // N_c = 5.69 and 6.05 (Eason & Shield 1960)
  constexpr double CELL = 0.125, RADIUS = 1.0 + 0.5 * CELL, COHESION = 1e4;
  double factor[2];
  for (const bool rough : {false, true}) {
    Ground ground(2.5, CELL, RADIUS);
    ground.options.flip = 0.995;
    mpm::AxisymmetricLaw law(std::make_shared<mpm::MohrCoulomb<3>>(2e7, 0.3, COHESION, 0.0, 0.0));
    factor[rough] = pressed(ground, law, rough, 0.03, 0.05, RADIUS, 6e-3 * CELL) / COHESION;
    printf("%s circle on Tresca's ground: N_c %.3f\n", rough ? "rough" : "smooth", factor[rough]);
  }
  EXPECT_NEAR(factor[0], 5.69, 0.06 * 5.69);
  EXPECT_NEAR(factor[1], 6.05, 0.06 * 6.05);
  EXPECT_GT(factor[1], factor[0]);
}
