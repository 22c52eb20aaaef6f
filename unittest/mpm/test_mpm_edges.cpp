// SPDX-License-Identifier: GPL-2.0-only
// Positions at which a weight is zero: a point on a cell edge, and a footing over an empty cell.

#include "scene.h"

#include <gtest/gtest.h>

using MpmSolver = mpm::MpmSolver<2>;
using mpm::ShapeFunction;
using mpm_test::Scene;
using rve::Tensor2;

namespace {

constexpr double CELL = 0.25;    // a power of two, so that points are exactly on edges

class OnACellEdge : public testing::TestWithParam<ShapeFunction> {
 protected:
  static mpm::SolverOptions<2> options()
  {
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{4.0, 4.0}}, CELL);
    options.shape = GetParam();
    return options;
  }
};

}    // namespace

TEST_P(OnACellEdge, PointMovesWithItsVelocityWithoutStrain)
{
  // The positions are a node, the middle of an edge along x and along y, and the corners of the
  // grid.
  for (const mpm::Vec2 &place :
       {mpm::Vec2{{1.0, 1.0}}, mpm::Vec2{{1.125, 1.0}}, mpm::Vec2{{1.0, 1.125}},
        mpm::Vec2{{0.0, 0.0}}, mpm::Vec2{{4.0, 4.0}}}) {
    Scene scene;
    const int p = scene.add(place[0], place[1], {{0.5 * CELL, 0.5 * CELL}}, 3.0);
    const double sign = place[0] > 2.0 ? -1.0 : 1.0;
    scene.velocity[0] = sign * 0.5;
    scene.velocity[1] = sign * 0.25;
    mpm::LinearElastic<2> law(100.0, 0.3);
    MpmSolver solver(options());
    solver.set_models({&law});

    const double dt = 1.0 / 64.0;
    solver.step(scene.view(), {}, dt);

    EXPECT_NEAR(scene.position[0], place[0] + sign * 0.5 * dt, 1e-12);
    EXPECT_NEAR(scene.velocity[0], sign * 0.5, 1e-9);
    EXPECT_NEAR(scene.velocity[1], sign * 0.25, 1e-9);
    // The tolerance is the velocity round-off at nodes with hardly any mass, divided by the cell
    // edge. Linear weights are evaluated at least 2^-24 cells away from nodes.
    for (const double l : scene.velocity_gradient[p].component) EXPECT_NEAR(l, 0.0, 1e-5);
    EXPECT_EQ(solver.totals(scene.view()).mass, scene.mass[0]);
  }
}

TEST_P(OnACellEdge, NodesHaveTheMassAndForceOfAPointNextToTheEdge)
{
  // Across a cell edge, nodal masses are continuous with both shape functions, but internal forces
  // only with gimp. With linear functions, a point on the edge has the forces of the cell above.
  const double aside = 1e-9;
  const auto nodes_at = [&](double x) {
    Scene scene;
    scene.add(x, 1.125, {{0.5 * CELL, 0.5 * CELL}}, 3.0);
    scene.stress[0] = {{-2.0, 0.5, 0.5, -1.0}};
    mpm::LinearElastic<2> law(100.0, 0.3);
    MpmSolver solver(options());
    solver.set_models({&law});
    solver.evaluate(scene.view(), {}, 1e-3);
    std::vector<double> values;
    for (int j = 3; j <= 6; ++j)
      for (int i = 2; i <= 6; ++i) {
        values.push_back(solver.node_mass({{i, j}}));
        for (int c = 0; c < 2; ++c) values.push_back(solver.node_force({{i, j}})[c]);
      }
    return values;
  };
  const auto below = nodes_at(1.0 - aside), on = nodes_at(1.0), above = nodes_at(1.0 + aside);
  const double mass_scale = 3.0 * CELL * CELL, force_scale = 2.0 * CELL;
  for (std::size_t k = 0; k < on.size(); ++k) {
    const bool force = k % 3 > 0;
    const double scale = force ? force_scale : mass_scale;
    EXPECT_NEAR(on[k], above[k], 1e-6 * scale) << k;
    if (force && GetParam() == ShapeFunction::Linear) continue;
    EXPECT_NEAR(on[k], below[k], 1e-6 * scale) << k;
  }
}

TEST_P(OnACellEdge, StressOfAPointMovesItNoFasterThanTheCellAllows)
{
  // A node with force but hardly any mass must not accelerate the point strongly. In a step of dt,
  // |Δv| <= 4 |σ| V dt/(m h) with the volume V, the mass m and the cell edge h.
  Scene scene;
  const int p = scene.add(1.0, 1.0, {{0.5 * CELL, 0.5 * CELL}}, 3.0);
  scene.stress[p] = {{-2.0, 0.5, 0.5, -1.0}};
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options());
  solver.set_models({&law});
  const double dt = 1e-3;
  const double bound = 4.0 * 2.5 * scene.volume[p] * dt / (scene.mass[p] * CELL);

  solver.step(scene.view(), {}, dt);

  for (int c = 0; c < 2; ++c) EXPECT_LT(std::abs(scene.velocity[3 * p + c]), bound);
  for (const double l : scene.velocity_gradient[p].component)
    EXPECT_LT(std::abs(l), 4.0 * bound / CELL);
  EXPECT_NEAR(solver.totals(scene.view()).momentum[0], scene.mass[p] * scene.velocity[3 * p],
              1e-15);
}

TEST_P(OnACellEdge, BlockOfPointsOnEdgesStaysInBalanceUnderItsStress)
{
  // There is one point per cell, each on a node; the surface of the outermost boxes is in the
  // middle of cells.
  Scene scene;
  scene.add_block({{1.125, 1.125}}, {{2.875, 2.625}}, CELL, 3.0);
  const double pressure = 2.0;
  std::vector<mpm::TractionLoad<2>> loads(4);
  const mpm::Face faces[4] = {mpm::Face::XLo, mpm::Face::XHi, mpm::Face::YLo, mpm::Face::YHi};
  for (int k = 0; k < 4; ++k) {
    loads[k].face = faces[k];
    loads[k].traction = {{0.0, 0.0}};
    loads[k].traction[mpm::axis_of(faces[k])] = -mpm::outward(faces[k]) * pressure;
  }
  for (int p = 0; p < scene.size(); ++p) {
    EXPECT_EQ(std::fmod(scene.position[3 * p], CELL), 0.0);
    scene.stress[p] = {{-pressure, 0.0, 0.0, -pressure}};
    if (p % 7 == 0) loads[0].point_index.push_back(p);
    if (p % 7 == 6) loads[1].point_index.push_back(p);
    if (p / 7 == 0) loads[2].point_index.push_back(p);
    if (p / 7 == 5) loads[3].point_index.push_back(p);
  }
  mpm::LinearElastic<2> law(100.0, 0.3);
  MpmSolver solver(options());
  solver.set_models({&law});

  solver.evaluate(scene.view(), loads, 1e-3);

  // With linear functions, a box that extends over an edge is not integrated over its cells. The
  // surface is then out of balance by half its load.
  const double allowed = GetParam() == ShapeFunction::Gimp ? 1e-9 : 0.5 + 1e-6;
  EXPECT_LT(solver.max_unbalanced_force(), allowed * pressure * CELL);
}

INSTANTIATE_TEST_SUITE_P(, OnACellEdge, testing::Values(ShapeFunction::Gimp, ShapeFunction::Linear),
                         [](const auto &shape) {
                           return shape.param == ShapeFunction::Gimp ? "Gimp" : "Linear";
                         });

namespace {

/// Ground, 4 x 2, in a box, with a rigid footing over x < 1 whose face is at `face`.
struct Footing {
  Scene scene;
  mpm::LinearElastic<2> law{1e6, 0.3};
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{4.0, 4.0}}, CELL);
  int ground;

  template <class Inside> Footing(ShapeFunction shape, double face, const Inside &inside)
  {
    options.shape = shape;
    options.sides = mpm_test::box_open_above();
    options.rigid_bodies.resize(1);
    scene.add_block({{0.0, 0.0}}, {{4.0, 2.0}}, CELL, 2000.0, inside);
    ground = scene.size();
    scene.add_block({{0.0, face}}, {{1.0, face + CELL}}, CELL, 2000.0);
    for (int p = ground; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  }
};

}    // namespace

TEST(EmptyCellUnderTheFooting, GapExertsNoForceUntilItIsClosed)
{
  for (const auto shape : {ShapeFunction::Gimp, ShapeFunction::Linear}) {
    const double gap = 3.0 * CELL, dt = 2e-3, speed = 0.5;
    Footing set(shape, 2.0 + gap, [](double, double) { return true; });
    MpmSolver solver(set.options);
    solver.set_models({&set.law});
    solver.set_body_velocity(0, {{0.0, -speed}});

    double touched = 0.0;    // settlement at which the reaction begins
    for (int step = 0; step < 1200 && touched == 0.0; ++step) {
      solver.step(set.scene.view(), {}, dt);
      if (solver.body_reaction(0)[1] != 0.0) {
        touched = (step + 1) * dt * speed;
      } else {
        EXPECT_EQ(solver.body_reaction(0)[0], 0.0);
        for (int p = 0; p < set.ground; ++p) ASSERT_EQ(set.scene.velocity[3 * p + 1], 0.0) << p;
      }
    }

    // On the grid, body and ground touch when they share a row of nodes. The gap is then less than
    // the width of a cell plus the width of a box.
    EXPECT_GT(touched, gap - 1.5 * CELL - dt * speed);
    // Held nodes do not change the velocity of their points. The velocity of the points changes by
    // the stress, one step after the contact.
    EXPECT_LT(touched, gap + 3.0 * dt * speed);
    for (int step = 0; step < 100; ++step) solver.step(set.scene.view(), {}, dt);
    EXPECT_GT(solver.body_reaction(0)[1], 0.0) << "then it pushes";
  }
}

TEST(EmptyCellUnderTheFooting, AHoleIsBridged)
{
  // In the upper half of the ground, three columns of cells below the footing have no points. Nodes
  // without mass must take no part.
  for (const auto shape : {ShapeFunction::Gimp, ShapeFunction::Linear}) {
    const auto pressed = [&](bool hole) {
      Footing set(shape, 2.0, [&](double x, double y) {
        return !(hole && x > CELL && x < 4.0 * CELL && y > 1.0);
      });
      MpmSolver solver(set.options);
      solver.set_models({&set.law});
      solver.set_body_velocity(0, {{0.0, -0.05}});
      double momentum = 0.0;
      for (int step = 0; step < 200; ++step) {
        const double before = solver.totals(set.scene.view()).momentum[1];
        solver.step(set.scene.view(), {}, 2e-3);
        const double after = solver.totals(set.scene.view()).momentum[1];
        momentum = after - before +
            2e-3 * (solver.body_reaction(0)[1] + solver.side_reaction(mpm::Face::YLo)[1]);
        EXPECT_NEAR(momentum, 0.0, 1e-9 * 2000.0 * 8.0) << "step " << step;
      }
      for (int p = 0; p < set.ground; ++p) EXPECT_TRUE(std::isfinite(set.scene.stress[p](1, 1)));
      return solver.body_reaction(0)[1];
    };

    const double whole = pressed(false);
    const double bridged = pressed(true);

    EXPECT_GT(bridged, 0.1 * whole) << "the column of points at the side carries";
    EXPECT_LT(bridged, 0.9 * whole) << "and the hole does not";
  }
}
