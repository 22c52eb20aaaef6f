// Rigid bodies with a prescribed velocity: what they do to the material, and what they feel.

#include "scene.h"

#include "rve/core/error.h"

#include <gtest/gtest.h>

using mpm::Face;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::ShapeFunction;
using TractionLoad = mpm::TractionLoad<2>;
using mpm_test::Scene;

namespace {

constexpr double CELL = 0.1;
constexpr double DENSITY = 2000.0;
constexpr double YOUNG = 10e6;
constexpr double TIME_STEP = 5e-4;    // CFL 0.41

void make_rigid(Scene &scene, int first)
{
  for (int p = first; p < scene.size(); ++p) scene.rigid_body[p] = 0;
}

/// Stiffness against uniaxial strain for ν = 0.3.
double confined_modulus()
{
  return mpm::LinearElastic<2>(YOUNG, 0.3).p_wave_modulus(0);
}

/// A layer, 0.4 wide and 0.8 high, between rollers, with a rigid punch of full width on it.
struct PunchOnLayer {
  Scene scene;
  mpm::LinearElastic<2> law{YOUNG, 0.3};
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{0.4, 1.2}}, CELL);

  PunchOnLayer(double start, bool rough)
  {
    options.sides = mpm_test::box_open_above();
    options.damping = 0.2;
    options.rigid_bodies.resize(1);
    options.rigid_bodies[0].rough = rough;
    scene.add_block({{0.0, 0.0}}, {{0.4, 0.8}}, CELL, DENSITY);
    const int first = scene.size();
    scene.add_block({{0.0, 0.8}}, {{0.4, 0.9}}, CELL, DENSITY);
    make_rigid(scene, first);
    for (int p = 0; p < scene.size(); ++p) scene.position[3 * p + 1] += start;
  }
};

}    // namespace

TEST(RigidPunch, FullWidthCompressionGivesTheConfinedModulus)
{
  PunchOnLayer set(0.0, true);
  MpmSolver solver(set.options);
  solver.set_models({&set.law});
  const double settlement = 0.8e-3;    // strain 1e-3
  const int steps = 400;
  solver.set_body_velocity(0, {{0.0, -settlement / (steps * TIME_STEP)}});
  for (int step = 0; step < steps; ++step) solver.step(set.scene.view(), {}, TIME_STEP);
  solver.set_body_velocity(0, {{0.0, 0.0}});

  for (int step = 0; step < 1500; ++step) solver.step(set.scene.view(), {}, TIME_STEP);

  const double force = confined_modulus() * 1e-3 * 0.4;
  EXPECT_NEAR(solver.body_reaction(0)[1], force, 0.005 * force)
      << "finite strain 1e-3, damped waves";
  EXPECT_NEAR(solver.side_reaction(Face::YLo)[1], -force, 0.005 * force);
  EXPECT_NEAR(solver.body_reaction(0)[0], 0.0, 1e-9 * force);
  for (int p = 0; p < 32; ++p)
    EXPECT_NEAR(set.scene.stress[p](1, 1), -force / 0.4, 0.01 * force / 0.4) << "point " << p;
}

TEST(RigidPunch, ReactionAndStressDoNotJumpWhenTheFacePassesARowOfNodes)
{
  // 20 % compression: the face passes two rows of nodes
  PunchOnLayer set(0.0, true);
  set.law = mpm::LinearElastic<2>(YOUNG, 0.0);
  MpmSolver solver(set.options);
  solver.set_models({&set.law});
  const double speed = 0.16;
  solver.set_body_velocity(0, {{0.0, -speed}});
  double previous = 0.0;
  double largest_jump = 0.0;
  const int steps = 2000;

  for (int step = 1; step <= steps; ++step) {
    solver.step(set.scene.view(), {}, TIME_STEP);
    if (step % 50 == 0) {
      const double force = solver.body_reaction(0)[1];
      largest_jump = std::max(largest_jump, std::abs(force - previous));
      previous = force;
    }
  }

  // Hughes-Winget in one dimension integrates dσ = E dL/L: the stress is E ln(1 - 0.2)
  const double force = -YOUNG * std::log(0.8) * 0.4;
  EXPECT_NEAR(previous, force, 0.05 * force);
  EXPECT_LT(largest_jump, 0.06 * force)
      << "the mean growth over 50 steps is 0.025 of it, plus waves";
}

TEST(RigidPunch, BalancesUniformStressWhereverItsFaceIs)
{
  // the rest of the surface, outside of the footing, carries the traction
  const double pressure = 20e3;
  for (const double start : {0.0, -0.02, -0.05, -0.09}) {
    Scene scene;
    mpm::LinearElastic<2> law(YOUNG, 0.3);
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.2}}, CELL);
    options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Free,
                     mpm::SideKind::Free};
    options.rigid_bodies.resize(1);
    scene.add_block({{0.0, 0.2}}, {{1.2, 0.8}}, CELL, DENSITY);
    const int first = scene.size();
    scene.add_block({{0.0, 0.8}}, {{0.4, 1.0}}, CELL, DENSITY);
    make_rigid(scene, first);
    std::vector<TractionLoad> loads(2);
    loads[0].traction = {{0.0, -pressure}};
    loads[1].traction = {{0.0, pressure}};
    loads[1].face = Face::YLo;
    for (int p = 0; p < first; ++p) {
      scene.stress[p] = {{-pressure, 0.0, 0.0, -pressure}};
      if (p >= first - 12 && scene.position[3 * p] > 0.4) loads[0].point_index.push_back(p);
      if (p < 12) loads[1].point_index.push_back(p);
    }
    for (int p = 0; p < scene.size(); ++p) scene.position[3 * p + 1] += start;
    MpmSolver solver(options);
    solver.set_models({&law});

    solver.evaluate(scene.view(), loads, TIME_STEP);

    // the nodes of the column under the edge share between footing and traction
    EXPECT_LT(solver.max_unbalanced_force(), 1e-6 * pressure * CELL) << "start " << start;
    EXPECT_NEAR(solver.body_reaction(0)[0], 0.0, 1e-9 * pressure);
    EXPECT_NEAR(solver.body_reaction(0)[1], pressure * 0.4, 1e-9 * pressure) << start;

    for (int step = 0; step < 100; ++step) solver.step(scene.view(), loads, TIME_STEP);
    EXPECT_NEAR(solver.body_reaction(0)[1], pressure * 0.4, 1e-6 * pressure) << "start " << start;
    for (int p = 0; p < first; ++p) EXPECT_LT(std::abs(scene.velocity[3 * p + 1]), 1e-6) << p;
  }
}

TEST(RigidPunch, SeparatingFaceDoesNotPull)
{
  PunchOnLayer glued(0.0, true);
  PunchOnLayer loose(0.0, true);
  loose.options.rigid_bodies[0].separation = true;
  MpmSolver pulling(glued.options);
  MpmSolver leaving(loose.options);
  pulling.set_models({&glued.law});
  leaving.set_models({&loose.law});
  pulling.set_body_velocity(0, {{0.0, 0.1}});
  leaving.set_body_velocity(0, {{0.0, 0.1}});

  for (int step = 0; step < 10; ++step) {    // then the face is too far away
    pulling.step(glued.scene.view(), {}, TIME_STEP);
    leaving.step(loose.scene.view(), {}, TIME_STEP);
    EXPECT_LT(pulling.body_reaction(0)[1], 0.0);
    EXPECT_EQ(leaving.body_reaction(0)[1], 0.0);
  }
  for (int p = 0; p < 32; ++p) EXPECT_EQ(loose.scene.velocity[3 * p + 1], 0.0);
}

TEST(RigidPunch, SmoothFaceLetsTheMaterialSlideAndRoughFaceDoesNot)
{
  for (const bool rough : {false, true}) {
    PunchOnLayer set(0.0, rough);
    set.options.sides = {mpm::SideKind::Free, mpm::SideKind::Free, mpm::SideKind::Roller,
                         mpm::SideKind::Free};
    MpmSolver solver(set.options);
    solver.set_models({&set.law});
    solver.set_body_velocity(0, {{0.05, 0.0}});

    for (int step = 0; step < 10; ++step) solver.step(set.scene.view(), {}, TIME_STEP);

    if (rough)
      EXPECT_LT(solver.body_reaction(0)[0], 0.0);
    else
      EXPECT_EQ(solver.body_reaction(0)[0], 0.0);
  }
}

TEST(RigidBody, ImpulseBalanceIsExact)
{
  // change of the points' momentum = -(reactions) dt: no other force acts on a free block that is hit
  Scene scene;
  scene.add_block({{0.4, 0.4}}, {{0.8, 0.8}}, 0.5 * CELL, DENSITY);
  const int first = scene.size();
  scene.add_block({{0.4, 0.8}}, {{0.8, 0.9}}, CELL, DENSITY);
  make_rigid(scene, first);
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.2}}, CELL);
  options.rigid_bodies.resize(1);
  MpmSolver solver(options);
  solver.set_models({&law});
  solver.set_body_velocity(0, {{0.3, -1.0}});

  for (int step = 0; step < 100; ++step) {
    const mpm::Totals<2> before = solver.totals(scene.view());
    solver.step(scene.view(), {}, TIME_STEP);
    const mpm::Totals<2> after = solver.totals(scene.view());
    for (int c = 0; c < 2; ++c)
      EXPECT_NEAR(after.momentum[c] - before.momentum[c], -TIME_STEP * solver.body_reaction(0)[c],
                  1e-10 * before.mass)
          << "round-off times velocity 1; step " << step;
  }
}

TEST(RigidBody, WithoutPointsIsRefused)
{
  Scene scene;
  scene.add_block({{0.4, 0.4}}, {{0.8, 0.8}}, CELL, DENSITY);
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.2}}, CELL);
  options.rigid_bodies.resize(1);
  MpmSolver solver(options);
  solver.set_models({&law});

  EXPECT_THROW(solver.step(scene.view(), {}, TIME_STEP), rve::InputError);
}
