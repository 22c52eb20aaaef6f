// SPDX-License-Identifier: GPL-2.0-only
// Square and round punches that are pressed into an elastic half space.

#include "scene.h"

#include <gtest/gtest.h>

using mpm::Face;
using mpm::SideKind;

namespace {

constexpr double YOUNG = 1e6, POISSON = 0.25;

/// Returns F (1 - ν²)/(E a u) of a smooth punch with the force F and the settlement u. a is the
/// half width or the radius of the punch, `half` cells. The model is a quarter of punch and ground.
double stiffness_of_punch(int half, bool round)
{
  constexpr int WIDTH = 14, DEPTH = 14;
  mpm_test::SceneOf<3> scene;
  scene.add_block({{0, 0, 0}}, {{WIDTH, WIDTH, DEPTH}}, 1.0, 2000.0);
  const int ground = scene.size();
  // Two points mark opposite corners; the rest of the body is beyond the planes of symmetry.
  for (const double corner : {0.5 - half, half - 0.5})
    scene.add({{corner, corner, DEPTH + 0.5}}, {{0.5, 0.5, 0.5}}, 2000.0);
  for (int p = ground; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  mpm::LinearElastic<3> law(YOUNG, POISSON);
  mpm::SolverOptions<3> options =
      mpm_test::grid_options_of<3>({{0, 0, 0}}, {{WIDTH, WIDTH, DEPTH + 2}}, 1.0);
  options.sides.fill(SideKind::Roller);
  options.sides[static_cast<int>(Face::ZHi)] = SideKind::Free;
  options.damping = 0.1;
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].face = Face::ZLo;
  options.rigid_bodies[0].rough = false;
  options.rigid_bodies[0].round = round;
  mpm::MpmSolver<3> solver(options);
  solver.set_models({&law});
  const double dt = 0.4 / std::sqrt(1.2 * YOUNG / 2000.0);
  const int steps = 240;    // seven passages of a wave through the ground
  const double settlement = 1e-3;
  for (int step = 0; step < steps; ++step) {
    const double rate = step < steps / 2 ? settlement / (0.5 * steps * dt) : 0.0;
    solver.set_body_velocity(0, {{0.0, 0.0, -rate}});
    solver.step(scene.view(), {}, dt);
  }
  const double force = 4.0 * solver.body_reaction(0)[2];
  return force / (YOUNG / (1.0 - POISSON * POISSON) * half * settlement);
}

}    // namespace

TEST(PunchInSpace, IsAsStiffAsTheClosedFormsOfASquareAndARoundOne)
{
  // On a half space, the result is 2 for a round punch (Boussinesq; Johnson 1985, Contact
  // Mechanics, section 3.4) and 2.31 for a square one (Pais & Kausel 1988, Soil Dyn. Earthq. Eng.
  // 7, 213). A rigid base at a depth of 3.5 half widths increases the result by the factor 1 +
  // 1.28/3.5. A square punch acts as if it were half a cell wider.
  const double square = stiffness_of_punch(4, false), round = stiffness_of_punch(4, true);
  printf("punch: square %.3f, round %.3f, ratio %.3f\n", square, round, round / square);
  EXPECT_GT(square, 2.31);
  EXPECT_LT(square, 2.31 * (1.0 + 1.28 / 3.5) * 4.5 / 4.0);
  EXPECT_GT(round, 2.0);
  EXPECT_LT(round, 2.0 * (1.0 + 1.28 / 3.5));
  // The ratio of round to square is between two limits: independent springs under 49 and 81 columns
  // of nodes, and the half space.
  EXPECT_GT(round / square, 49.0 / 81.0);
  EXPECT_LT(round / square, 2.0 / 2.31);
}

TEST(RoundBody, StopsMaterialThatMovesTowardsItsAxisOnly)
{
  // Dust flows past a smooth cylinder. The cylinder stops the dust in front of it, but not the dust
  // behind it.
  const double radius = 3.0, centre = 6.0;
  for (const double angle : {0.0, 0.25 * 3.14159265358979323846}) {
    mpm_test::SceneOf<3> scene;
    scene.add_block({{0, 0, 0}}, {{12, 12, 4}}, 0.5, 1000.0, [&](double x, double y, double) {
      return std::hypot(x - centre, y - centre) > radius;
    });
    const int dust = scene.size();
    for (const double end : {-1.0, 1.0})
      scene.add({{centre + end * (radius - 0.5), centre + end * (radius - 0.5), 2.0 + end}},
                {{0.5, 0.5, 0.5}}, 1000.0);
    const double flow[] = {std::cos(angle), std::sin(angle)};
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < dust ? -1 : 0;
      for (int a = 0; a < 2; ++a) scene.velocity[3 * p + a] = p < dust ? flow[a] : 0.0;
    }
    mpm::LinearElastic<3> law(1e-6, 0.0);
    mpm::SolverOptions<3> options = mpm_test::grid_options_of<3>({{0, 0, 0}}, {{12, 12, 4}}, 1.0);
    options.flip = 0.0;
    options.rigid_bodies.resize(1);
    options.rigid_bodies[0].face = Face::ZLo;
    options.rigid_bodies[0].rough = false;
    options.rigid_bodies[0].separation = true;
    options.rigid_bodies[0].round = true;
    mpm::MpmSolver<3> solver(options);
    solver.set_models({&law});
    const double before = solver.totals(scene.view()).kinetic_energy;

    solver.step(scene.view(), {}, 1e-3);

    EXPECT_LT(solver.totals(scene.view()).kinetic_energy, before);
    const mpm::Vec<3> force = solver.body_reaction(0);
    EXPECT_GT(force[0] * flow[0] + force[1] * flow[1], 1e3) << "it is pushed along";
    EXPECT_NEAR(force[0] * flow[1] - force[1] * flow[0], 0.0, 1e-6) << "and not aside";
    int in_front = 0, behind = 0;
    for (int p = 0; p < dust; ++p) {
      const double x = scene.position[3 * p] - centre, y = scene.position[3 * p + 1] - centre;
      const double along = x * flow[0] + y * flow[1], aside = x * flow[1] - y * flow[0];
      if (std::abs(scene.position[3 * p + 2] - 2.0) > 0.5)
        continue;    // the height of the cylinder is 1 to 3
      const double speed = scene.velocity[3 * p] * flow[0] + scene.velocity[3 * p + 1] * flow[1];
      EXPECT_LT(speed, 1.0 + 1e-9);
      if (std::abs(aside) < 0.5 && along < 0.0 && along > -radius - 0.3) {
        ++in_front;
        EXPECT_LT(speed, 0.9);
      }
      if (along > 0.5) {
        ++behind;
        EXPECT_NEAR(speed, 1.0, 1e-9);
      }
    }
    EXPECT_GT(in_front, 0);
    EXPECT_GT(behind, 50);
  }
}
