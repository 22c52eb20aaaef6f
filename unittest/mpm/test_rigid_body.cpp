// SPDX-License-Identifier: GPL-2.0-only
// Rigid bodies with a prescribed velocity: their effect on the material, and the forces on them.

#include "scene.h"

#include "mpm/mohr_coulomb.h"
#include "rve/core/error.h"

#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <string>

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

/// Returns the stiffness in uniaxial strain for ν = 0.3.
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
  // At 20 % compression the face passes two rows of nodes.
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

TEST(RigidPunch, BalancesUniformStressAtEveryPositionOfItsFace)
{
  // The traction acts on the part of the surface outside of the footing.
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

    // Footing and traction share the load of the column of nodes below the edge.
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

  for (int step = 0; step < 10; ++step) {    // after these steps the face is too far away
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
  // The change of the points' momentum is -(reactions) dt, since no other force acts on a free
  // block that is hit.
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

// ---- nodes that several bodies touch ----

namespace {

/// Ground below a plate that is pressed into it, next to a plate at rest. The pressed plate
/// consists of `parts` bodies: 1 or 2 in the plane, 1 or 4 in space. `is_reversed` reverses the
/// order of these bodies in the script, but not the order of their names.
template <int D> struct PlateOnGround {
  static constexpr double PRESS_SPEED = 0.5;
  mpm_test::SceneOf<D> scene;
  mpm::SolverOptions<D> options;
  mpm::LinearElastic<D> law{1e6, 0.2};
  std::vector<int> pressed;    ///< indices of the bodies
  int at_rest = 0;

  static mpm::Vec<D> corner(double x, double between, double top)
  {
    mpm::Vec<D> place;
    for (int a = 0; a < D; ++a) place[a] = a == 0 ? x : a == D - 1 ? top : between;
    return place;
  }

  PlateOnGround(int parts, bool is_reversed, bool rough, bool separation,
                mpm::BodyForm form = mpm::BodyForm::Face)
  {
    const double depth = D == 2 ? 0.0 : 0.6;
    options = mpm_test::grid_options_of<D>(corner(0.0, 0.0, 0.0), corner(1.2, depth, 0.8), CELL);
    options.sides.fill(mpm::SideKind::Roller);
    options.sides[2 * D - 1] = mpm::SideKind::Free;
    options.flip = 0.99;
    const int bodies = parts + 1;
    options.rigid_bodies.resize(bodies);
    const auto number = [&](int body) { return is_reversed ? bodies - 1 - body : body; };
    scene.add_block(corner(0.0, 0.0, 0.0), corner(1.2, depth, 0.4), 0.5 * CELL, DENSITY);
    const int first = scene.size();
    scene.add_block(corner(0.2, D == 2 ? 0.0 : 0.1, 0.4), corner(1.0, D == 2 ? 0.0 : 0.5, 0.7),
                    CELL, DENSITY);
    at_rest = number(parts);
    for (int p = 0; p < scene.size(); ++p) {
      scene.body_force[3 * p + D - 1] = -9.81 * scene.mass[p];
      if (p < first) continue;
      const double *x = &scene.position[3 * p];
      const int part = parts == 1 ? 0 : (x[0] > 0.4) + (D == 3 && x[1] > 0.3 ? 2 : 0);
      scene.rigid_body[p] = x[0] > 0.6 ? at_rest : number(part);
    }
    for (int part = 0; part < parts; ++part) pressed.push_back(number(part));
    for (mpm::RigidBodyOptions &body : options.rigid_bodies) {
      body.face = D == 2 ? Face::YLo : Face::ZLo;
      body.rough = rough;
      body.separation = separation;
      body.form = form;
    }
    // Impulses are added in the order of the names of the bodies, not in their order in the script.
    options.rigid_body_names.resize(bodies);
    for (int body = 0; body < bodies; ++body)
      options.rigid_body_names[number(body)] = std::string(1, static_cast<char>('a' + body));
  }

  static void press(mpm::MpmSolver<D> &solver, int body)
  {
    if (!solver.rigid_bodies().can_turn(body)) {
      solver.set_body_velocity(body, corner(0.0, 0.0, -PRESS_SPEED));
      return;
    }
    double rates[mpm::FREEDOMS<D>] = {};
    rates[D - 1] = -PRESS_SPEED;
    solver.rigid_bodies().set_rates(body, rates);
  }

  /// Returns loads of the pressed plate and of the plate at rest after each step.
  std::vector<std::array<mpm::Vec<D>, 2>> loads_in(int steps)
  {
    mpm::MpmSolver<D> solver(options);
    solver.set_models({&law});
    std::vector<std::array<mpm::Vec<D>, 2>> loads;
    for (int step = 0; step < steps; ++step) {
      for (const int body : pressed) press(solver, body);
      solver.step(scene.view(), {}, TIME_STEP);
      mpm::Vec<D> sum = mpm::Vec<D>::zero();
      for (const int body : pressed) sum = sum + solver.body_reaction(body);
      loads.push_back({sum, solver.body_reaction(at_rest)});
    }
    return loads;
  }
};

/// Expects that a plate made of several bodies has the load of a plate made of one. The plate
/// passes two rows of nodes next to a plate at rest.
template <int D> void expect_parts_bear_what_the_whole_bears(bool rough, bool separation)
{
  const int steps = D == 2 ? 500 : 100, parts = D == 2 ? 2 : 4;    // 1.25 cells
  PlateOnGround<D> whole(1, false, rough, separation), divided(parts, false, rough, separation),
      reversed(parts, true, rough, separation);

  const auto of_whole = whole.loads_in(steps), of_parts = divided.loads_in(steps),
             of_reversed = reversed.loads_in(steps);

  double largest = 0.0, deviation = 0.0;
  for (int step = 0; step < steps; ++step)
    for (int plate = 0; plate < 2; ++plate)
      for (int a = 0; a < D; ++a) {
        largest = std::max(largest, std::abs(of_whole[step][plate][a]));
        deviation =
            std::max(deviation, std::abs(of_parts[step][plate][a] - of_whole[step][plate][a]));
        if (plate == 1) {
          EXPECT_EQ(of_parts[step][plate][a], of_reversed[step][plate][a]) << "step " << step;
        }
      }
  EXPECT_GT(largest, 1e3);
  EXPECT_LT(deviation, 1e-10 * largest) << "round-off of " << steps << " steps";
  EXPECT_EQ(divided.scene.position, reversed.scene.position) << "to the last bit";
}

/// A trapdoor that sinks below the surrounding floor under dry sand, as half of a symmetric
/// problem.
struct Trapdoor {
  static constexpr double WIDTH = 0.5, HEIGHT = 2.0, WEIGHT = 2240.0 * 9.81;
  double cell;
  int door, floor;
  Scene scene;
  mpm::SolverOptions<2> options;
  mpm::MohrCoulomb<2> sand{2e7, 0.2, 0.0, 28.0, 0.0};

  Trapdoor(double cell_size, bool door_first) :
      cell(cell_size), door(door_first ? 0 : 1), floor(door_first ? 1 : 0),
      options(mpm_test::grid_options({{0.0, -0.75}}, {{2.5, HEIGHT + 2.0 * cell_size}}, cell_size))
  {
    options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Free,
                     mpm::SideKind::Free};
    options.flip = 0.99;
    options.rigid_bodies.resize(2);
    for (mpm::RigidBodyOptions &body : options.rigid_bodies) body.face = Face::YHi;
    scene.add_block({{0.0, 0.0}}, {{2.5, HEIGHT}}, cell, 2240.0);
    const int first = scene.size();
    for (int p = 0; p < first; ++p) {
      const double stress = -WEIGHT * (HEIGHT - scene.position[3 * p + 1]);
      scene.stress[p] = {{0.5 * stress, 0.0, 0.0, stress}};
      scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
    }
    scene.begin_memory(sand);
    scene.add_block({{0.0, -cell}}, {{2.5, 0.0}}, cell, 2240.0);
    for (int p = first; p < scene.size(); ++p)
      scene.rigid_body[p] = scene.position[3 * p] < WIDTH ? door : floor;
    scene.begin_memory(sand);
  }
};

}    // namespace

TEST(BodiesOnTheSameNodes, PartsOfARoughPlateBearItsLoad)
{
  expect_parts_bear_what_the_whole_bears<2>(true, false);
}

TEST(BodiesOnTheSameNodes, PartsOfASmoothPlateBearItsLoad)
{
  expect_parts_bear_what_the_whole_bears<2>(false, true);
}

TEST(BodiesOnTheSameNodes, QuartersOfAPlateInSpaceBearItsLoad)
{
  expect_parts_bear_what_the_whole_bears<3>(true, true);
}

TEST(BodiesOnTheSameNodes, DistantPlatesHaveTheBitsOfSeparateImposition)
{
  // A third body in the air exerts no force. If it touches the left plate, nodes are divided among
  // bodies; otherwise they are not.
  std::vector<double> velocities[2], loads[2];
  for (const bool touches : {true, false}) {
    Scene scene;
    scene.add_block({{0.0, 0.0}}, {{1.2, 0.4}}, 0.5 * CELL, DENSITY);
    const int ground = scene.size();
    scene.add_block({{0.0, 0.4}}, {{0.3, 0.6}}, CELL, DENSITY);
    const int left = scene.size();
    scene.add_block({{0.7, 0.4}}, {{1.0, 0.6}}, CELL, DENSITY);
    const int right = scene.size();
    const double height = touches ? 0.6 : 1.1;
    scene.add_block({{0.0, height}}, {{0.3, height + 0.2}}, CELL, DENSITY);
    for (int p = ground; p < scene.size(); ++p)
      scene.rigid_body[p] = p < left ? 0 : p < right ? 1 : 2;
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.4}}, CELL);
    options.sides.fill(mpm::SideKind::Roller);
    options.rigid_bodies.resize(3);
    for (mpm::RigidBodyOptions &body : options.rigid_bodies) body.face = Face::YLo;
    mpm::LinearElastic<2> law(1e6, 0.2);
    MpmSolver solver(options);
    solver.set_models({&law});

    for (int step = 0; step < 200; ++step) {
      solver.set_body_velocity(0, {{0.0, -0.5}});
      solver.set_body_velocity(1, {{0.1, -0.2}});
      solver.step(scene.view(), {}, TIME_STEP);
      for (const int body : {0, 1}) loads[touches].push_back(solver.body_reaction(body)[1]);
    }
    velocities[touches].assign(scene.velocity.begin(), scene.velocity.begin() + 3 * ground);
  }

  EXPECT_GT(loads[0].back(), 1e3);
  EXPECT_EQ(loads[0], loads[1]);
  EXPECT_EQ(velocities[0], velocities[1]);
}

// The loads of two halves of a box do not add up to the load of the whole box, since each half has
// corners where the halves touch.
TEST(BodiesOnTheSameNodes, LoadsOfBoxesDoNotDependOnTheirOrder)
{
  constexpr int STEPS = 300;    // three quarters of a cell
  PlateOnGround<2> named(2, false, true, false, mpm::BodyForm::Box),
      reversed(2, true, true, false, mpm::BodyForm::Box);

  const auto of_named = named.loads_in(STEPS), of_reversed = reversed.loads_in(STEPS);

  for (int step = 0; step < STEPS; ++step)
    for (int a = 0; a < 2; ++a)
      EXPECT_EQ(of_named[step][1][a], of_reversed[step][1][a]) << "step " << step;
  EXPECT_EQ(named.scene.position, reversed.scene.position) << "to the last bit";
  EXPECT_GT(of_named.back()[0][1], 1e3);
}

TEST(BodiesOnTheSameNodes, DoorAndFloorAtRestBearTheWeightAboveThem)
{
  for (const bool door_first : {true, false}) {
    Trapdoor set(0.125, door_first);
    MpmSolver solver(set.options);
    solver.set_models({&set.sand});

    solver.evaluate(set.scene.view(), {}, 1e-3);

    const double pressure = Trapdoor::WEIGHT * Trapdoor::HEIGHT;
    EXPECT_NEAR(solver.body_reaction(set.door)[1], -0.5 * pressure, 1e-10 * pressure);
    EXPECT_NEAR(solver.body_reaction(set.floor)[1], -2.0 * pressure, 1e-10 * pressure);
  }
}

TEST(BodiesOnTheSameNodes, LoadOfATrapdoorHasNoJumpInOneAndAHalfCells)
{
  std::vector<double> of_order[2];
  for (const bool door_first : {true, false}) {
    Trapdoor set(0.0625, door_first);
    MpmSolver solver(set.options);
    solver.set_models({&set.sand});
    const double dt = set.cell / 140.0, speed = 0.05;
    const int steps = static_cast<int>(0.1 / speed / dt);
    for (int step = 0; step < steps; ++step) {
      const double time = (step + 0.5) * dt;
      solver.set_body_velocity(set.door, {{0.0, -speed * std::min(1.0, time / 0.2)}});
      solver.step(set.scene.view(), {}, dt);
      of_order[door_first].push_back(-solver.body_reaction(set.door)[1] / Trapdoor::WIDTH);
    }
  }

  EXPECT_EQ(of_order[0], of_order[1]) << "to the last bit";
  // The active state is reached after 0.2 cells. Then the load is constant except for waves. Each
  // of the eight points on the door bears an eighth of the load. A point that enters a cell, or a
  // face that passes a row of nodes, disturbs one of these eighths. The limit of a quarter of the
  // load is twice this disturbance.
  const std::vector<double> &load = of_order[0];
  const std::size_t first = load.size() / 5;
  double mean = 0.0;
  for (std::size_t k = first; k < load.size(); ++k) mean += load[k] / (load.size() - first);
  EXPECT_NEAR(mean, 14e3, 2e3) << "a third of the weight";
  for (std::size_t k = first; k < load.size(); ++k)
    ASSERT_NEAR(load[k], mean, 0.25 * mean) << "after " << 1.6 * k / load.size() << " cells";
}
