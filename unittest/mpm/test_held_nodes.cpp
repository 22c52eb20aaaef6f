// SPDX-License-Identifier: GPL-2.0-only
// Nodes that a side or a body holds: forces still act on points near them, and walls and bodies
// receive the momentum that points lose.

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <string>

using mpm::Face;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::Scheme;
using mpm::SideKind;
using mpm::Vec2;
using mpm_test::Scene;
using rve::Tensor2;

namespace {

constexpr double CELL = 0.1;
constexpr double DENSITY = 2000.0;
constexpr double GRAVITY = 9.81;
constexpr double YOUNG = 10e6;

enum class Wall { Roller, Body, BodyThatSeparates };

struct Strip {
  Wall wall;
  Scheme scheme;
  int points;     ///< along the edge of a cell
  double part;    ///< fraction of the usual time step
};

/// Returns how far the top of a strip of sand next to a wall falls while a free body falls by 0.8.
/// The strip is `cells` cells wide and 2 high.
double fall_beside_a_wall(const Strip &strip, int cells)
{
  const double left = 2.0 * CELL, height = 2.0, time = 0.4;
  mpm::MohrCoulomb<2> sand(YOUNG, 0.3, 0.0, 26.0, 0.0);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{6.0, 3.0}}, CELL);
  options.sides = {SideKind::Roller, SideKind::Roller, SideKind::Fixed, SideKind::Free};
  options.scheme = strip.scheme;
  Scene scene;
  if (strip.wall == Wall::Roller) {
    options.lo[0] = left;
  } else {
    mpm::RigidBodyOptions wall;
    wall.face = Face::XHi;
    wall.rough = false;
    wall.separation = strip.wall == Wall::BodyThatSeparates;
    options.rigid_bodies = {wall};
  }
  scene.add_block({{left, 0.0}}, {{left + cells * CELL, height}}, CELL / strip.points, DENSITY);
  const int sand_points = scene.size();
  for (int p = 0; p < sand_points; ++p) scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
  if (strip.wall != Wall::Roller) {
    scene.add_block({{left - CELL, 0.0}}, {{left, 3.0}}, CELL, DENSITY);
    for (int p = sand_points; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  }
  scene.begin_memory(sand);
  MpmSolver solver(options);
  solver.set_models({&sand});
  const double dt = strip.part * 0.3 * CELL / std::sqrt(sand.p_wave_modulus(0) / DENSITY);
  const int steps = static_cast<int>(std::lround(time / dt));
  const auto top = [&] {
    double highest = 0.0;
    for (int p = 0; p < sand_points; ++p) highest = std::max(highest, scene.position[3 * p + 1]);
    return highest;
  };
  const double start = top();
  for (int step = 0; step < steps; ++step) solver.step(scene.view(), {}, dt);
  return start - top();
}

class StripOfSand : public testing::TestWithParam<Strip> {};

/// Returns the strain energy of the points in plane strain with a thickness of 1.
double strain_energy(const Scene &scene, double young, double poisson)
{
  double sum = 0.0;
  for (int p = 0; p < scene.size(); ++p) {
    if (scene.rigid_body[p] >= 0) continue;
    const Tensor2 &s = scene.stress[p];
    const double trace = s(0, 0) + s(1, 1);
    const double squares = s(0, 0) * s(0, 0) + s(1, 1) * s(1, 1) + 2.0 * s(0, 1) * s(1, 0);
    sum += 0.5 * scene.volume[p] * (1.0 + poisson) / young * (squares - poisson * trace * trace);
  }
  return sum;
}

}    // namespace

// Sand without cohesion and lateral support has no strength, so the material above falls freely.
// Some lateral stress accelerates the foot of the strip outwards. This delays the fall by less than
// 1/20, in strips of one cell and in wider ones. A strip next to a body with separation needs two
// points across, because one point cannot represent the widening of the strip.
TEST_P(StripOfSand, FallsFreely)
{
  const double free_fall = 0.5 * GRAVITY * 0.4 * 0.4;

  EXPECT_NEAR(fall_beside_a_wall(GetParam(), 1), free_fall, 0.05 * free_fall);
  EXPECT_NEAR(fall_beside_a_wall(GetParam(), 2), free_fall, 0.05 * free_fall);
}

INSTANTIATE_TEST_SUITE_P(, StripOfSand,
                         testing::Values(Strip{Wall::Roller, Scheme::Musl, 1, 1.0},
                                         Strip{Wall::Roller, Scheme::Musl, 1, 0.25},
                                         Strip{Wall::Roller, Scheme::Usavg, 1, 1.0},
                                         Strip{Wall::Roller, Scheme::Musl, 2, 1.0},
                                         Strip{Wall::Body, Scheme::Musl, 1, 1.0},
                                         Strip{Wall::Body, Scheme::Usavg, 2, 1.0},
                                         Strip{Wall::BodyThatSeparates, Scheme::Musl, 2, 1.0}));

// An elastic block that falls on a smooth side rebounds, since the side does no work. FLIP and the
// finite time step cost 1 to 2 % of its energy.
TEST(HeldNodes, TakeNoEnergyFromAnElasticBlock)
{
  for (const int points : {1, 2})
    for (const Scheme scheme : {Scheme::Musl, Scheme::Usavg}) {
      mpm::LinearElastic<2> law(YOUNG, 0.3);
      mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.6, 2.4}}, CELL);
      options.sides = {SideKind::Free, SideKind::Free, SideKind::Roller, SideKind::Free};
      options.scheme = scheme;
      Scene scene;
      scene.add_block({{0.4, 0.2}}, {{1.2, 1.0}}, CELL / points, DENSITY);
      for (int p = 0; p < scene.size(); ++p) scene.velocity[3 * p + 1] = -1.0;
      MpmSolver solver(options);
      solver.set_models({&law});
      const double start = solver.totals(scene.view()).kinetic_energy;

      for (int step = 0; step < 2500; ++step) solver.step(scene.view(), {}, 2e-4);

      const mpm::Totals<2> end = solver.totals(scene.view());
      EXPECT_GT(end.momentum[1], 0.5 * end.mass) << "it has bounced";
      EXPECT_NEAR(end.kinetic_energy + strain_energy(scene, YOUNG, 0.3), start, 0.02 * start)
          << points << " points along a cell";
    }
}

// Reactions, body forces and damping equal the change of momentum of all points, for any kind of
// held nodes and any share of PIC.
TEST(HeldNodes, ReactionsAndForcesAreTheChangeOfMomentum)
{
  for (const double flip : {1.0, 0.9, 0.0})
    for (const double damping : {0.0, 0.1})
      for (const bool separation : {false, true})
        for (const bool rough : {false, true})
          for (const Scheme scheme : {Scheme::Musl, Scheme::Usavg}) {
            SCOPED_TRACE("flip " + std::to_string(flip) + ", damping " + std::to_string(damping) +
                         (separation ? ", separation" : "") + (rough ? ", rough" : ""));
            const double dt = 5e-4;
            mpm::LinearElastic<2> law(YOUNG, 0.3);
            mpm::SolverOptions<2> options =
                mpm_test::grid_options({{0.0, 0.0}}, {{0.8, 1.6}}, CELL);
            options.sides = {SideKind::Roller, SideKind::Roller, SideKind::Fixed, SideKind::Free};
            options.scheme = scheme;
            options.flip = flip;
            options.damping = damping;
            mpm::RigidBodyOptions punch;
            punch.rough = rough;
            punch.separation = separation;
            options.rigid_bodies = {punch};
            Scene scene;
            scene.add_block({{0.0, 0.0}}, {{0.8, 0.8}}, 0.5 * CELL, DENSITY);
            const int ground = scene.size();
            scene.add_block({{0.0, 0.8}}, {{0.4, 1.0}}, CELL, DENSITY);
            Vec2 force = Vec2::zero();
            for (int p = 0; p < scene.size(); ++p) {
              if (p >= ground) {
                scene.rigid_body[p] = 0;
                continue;
              }
              scene.body_force[3 * p] = 0.5 * GRAVITY * scene.mass[p];
              scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
              scene.velocity[3 * p] = 0.3 * std::sin(7.0 * p);
              scene.velocity[3 * p + 1] = 0.3 * std::cos(5.0 * p);
              for (int c = 0; c < 2; ++c) force[c] += scene.body_force[3 * p + c];
            }
            MpmSolver solver(options);
            solver.set_models({&law});

            for (int step = 0; step < 60; ++step) {
              // The body moves down and sideways, and away again.
              solver.set_body_velocity(
                  0, {{0.2 * std::sin(0.1 * step), 0.4 * std::sin(0.2 * step) - 0.1}});
              const mpm::Totals<2> before = solver.totals(scene.view());
              solver.step(scene.view(), {}, dt);
              const mpm::Totals<2> after = solver.totals(scene.view());
              for (int c = 0; c < 2; ++c) {
                double sum = force[c] + solver.damping_force()[c] - solver.body_reaction(0)[c];
                for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi})
                  sum -= solver.side_reaction(side)[c];
                EXPECT_NEAR(after.momentum[c] - before.momentum[c], dt * sum, 1e-11 * before.mass)
                    << "round-off times velocity 1; component " << c << ", step " << step;
              }
            }
          }
}

TEST(HeldNodes, AcceleratingBodyMovesItsMaterial)
{
  // A smooth plate moves a block upwards with a constant acceleration; its mean force is m a.
  const double dt = 5e-4, acceleration = 5.0;
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.6, 4.8}}, CELL);
  options.flip = 0.95;
  mpm::RigidBodyOptions plate;
  plate.face = Face::YHi;
  plate.rough = false;
  options.rigid_bodies = {plate};
  Scene scene;
  scene.add_block({{0.4, 0.4}}, {{1.2, 1.2}}, 0.5 * CELL, DENSITY);
  const int block = scene.size();
  scene.add_block({{0.2, 0.2}}, {{1.4, 0.4}}, CELL, DENSITY);
  for (int p = block; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  MpmSolver solver(options);
  solver.set_models({&law});
  const int steps = 2000;
  double impulse = 0.0;

  for (int step = 1; step <= steps; ++step) {
    solver.set_body_velocity(0, {{0.0, acceleration * (step - 0.5) * dt}});
    solver.step(scene.view(), {}, dt);
    impulse -= dt * solver.body_reaction(0)[1];
  }

  const mpm::Totals<2> end = solver.totals(scene.view());
  const double velocity = acceleration * steps * dt;
  EXPECT_NEAR(impulse, end.mass * velocity, 0.01 * end.mass * velocity);
  for (int p = 0; p < block; ++p) EXPECT_NEAR(scene.velocity[3 * p + 1], velocity, 0.05 * velocity);
}

TEST(HeldNodes, BlockThatMovesWithABodyHasNoForce)
{
  // Block and body move with the same constant velocity, so no force acts between them.
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.6, 2.4}}, CELL);
  options.rigid_bodies.resize(1);
  Scene scene;
  scene.add_block({{0.4, 0.4}}, {{1.2, 1.2}}, 0.5 * CELL, DENSITY);
  const int block = scene.size();
  scene.add_block({{0.4, 1.2}}, {{1.2, 1.4}}, CELL, DENSITY);
  for (int p = 0; p < scene.size(); ++p) {
    if (p >= block) scene.rigid_body[p] = 0;
    scene.velocity[3 * p] = 0.2;
    scene.velocity[3 * p + 1] = 0.7;
  }
  MpmSolver solver(options);
  solver.set_models({&law});
  solver.set_body_velocity(0, {{0.2, 0.7}});

  for (int step = 0; step < 1000; ++step) {
    solver.step(scene.view(), {}, 5e-4);
    for (int c = 0; c < 2; ++c) ASSERT_NEAR(solver.body_reaction(0)[c], 0.0, 1e-6) << step;
  }

  for (int p = 0; p < block; ++p) {
    EXPECT_NEAR(scene.velocity[3 * p], 0.2, 1e-12);
    EXPECT_NEAR(scene.velocity[3 * p + 1], 0.7, 1e-12);
  }
}
