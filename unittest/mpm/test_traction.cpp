// SPDX-License-Identifier: GPL-2.0-only
// Tractions and pressures on faces of points. A traction on the free face balances a uniform stress
// at every node, for any number of points per cell. A pressure follows the deformation of its face.

#include "scene.h"

#include <gtest/gtest.h>

using mpm::Face;
using MpmSolver = mpm::MpmSolver<2>;
using mpm::ShapeFunction;
using TractionLoad = mpm::TractionLoad<2>;
using mpm_test::Scene;

namespace {

constexpr double CELL = 0.1;
constexpr double SURCHARGE = 20e3;    // q_s
constexpr double TIME_STEP = 1e-3;

struct Case {
  ShapeFunction shape;
  int per_cell;    ///< points per cell along an axis
};

/// A layer of 1.2 x 0.8 in a box with an open top, under the stress -q_s I and the traction q_s.
struct LoadedLayer {
  Scene scene;
  std::vector<TractionLoad> loads;
  mpm::LinearElastic<2> law{10e6, 0.3};
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL);

  explicit LoadedLayer(const Case &c)
  {
    options.shape = c.shape;
    options.sides = mpm_test::box_open_above();
    const double width = CELL / c.per_cell;
    scene.add_block({{0.0, 0.0}}, {{1.2, 0.8}}, width, 2000.0);
    loads.resize(1);
    loads[0].traction = {{0.0, -SURCHARGE}};
    loads[0].face = Face::YHi;
    for (int p = 0; p < scene.size(); ++p) {
      scene.stress[p] = {{-SURCHARGE, 0.0, 0.0, -SURCHARGE}};
      if (scene.position[3 * p + 1] > 0.8 - width) loads[0].point_index.push_back(p);
    }
  }
};

class Traction : public testing::TestWithParam<Case> {};

}    // namespace

TEST_P(Traction, BalancesUniformStressAtEveryFreeNode)
{
  LoadedLayer layer(GetParam());
  MpmSolver solver(layer.options);
  solver.set_models({&layer.law});

  solver.evaluate(layer.scene.view(), layer.loads, TIME_STEP);

  EXPECT_LT(solver.max_unbalanced_force(), 1e-6 * SURCHARGE * CELL) << "round-off is far below";
  EXPECT_NEAR(solver.side_reaction(Face::YLo)[1], -SURCHARGE * 1.2, 1e-9 * SURCHARGE);
  EXPECT_NEAR(solver.side_reaction(Face::XLo)[0], -SURCHARGE * 0.8, 1e-9 * SURCHARGE);
  EXPECT_NEAR(solver.side_reaction(Face::XHi)[0], SURCHARGE * 0.8, 1e-9 * SURCHARGE);
}

TEST_P(Traction, WithoutItTheSurfaceIsOutOfBalance)
{
  LoadedLayer layer(GetParam());
  MpmSolver solver(layer.options);
  solver.set_models({&layer.law});

  solver.evaluate(layer.scene.view(), {}, TIME_STEP);

  EXPECT_NEAR(solver.max_unbalanced_force(), SURCHARGE * CELL, 1e-6 * SURCHARGE * CELL);
}

TEST_P(Traction, LayerInBalanceStaysAtRest)
{
  LoadedLayer layer(GetParam());
  MpmSolver solver(layer.options);
  solver.set_models({&layer.law});

  for (int step = 0; step < 50; ++step) solver.step(layer.scene.view(), layer.loads, TIME_STEP);

  // The tolerance is a relative round-off of 1e-12 of the nodal force that accelerates points for
  // 50 steps.
  const double speed = 1e-12 * SURCHARGE * CELL / (2000.0 * CELL * CELL) * 50 * TIME_STEP;
  for (const double v : layer.scene.velocity) EXPECT_LT(std::abs(v), 10.0 * speed);
}

INSTANTIATE_TEST_SUITE_P(PointsPerCell, Traction,
                         testing::Values(Case{ShapeFunction::Linear, 1},
                                         Case{ShapeFunction::Linear, 2},
                                         Case{ShapeFunction::Gimp, 1},
                                         Case{ShapeFunction::Gimp, 2}));

TEST(GimpTraction, StaysInBalanceForAnyPositionOfTheSurface)
{
  // A free block with pressure on all four faces is shifted through a cell.
  for (const double shift : {0.0, 0.013, 0.05, 0.071, 0.0999}) {
    Scene scene;
    scene.add_block({{0.3 + shift, 0.3 + 0.5 * shift}}, {{0.8 + shift, 0.7 + 0.5 * shift}}, CELL,
                    2000.0);
    std::vector<TractionLoad> loads(4);
    const Face faces[4] = {Face::XLo, Face::XHi, Face::YLo, Face::YHi};
    for (int k = 0; k < 4; ++k) {
      loads[k].face = faces[k];
      loads[k].traction = {{0.0, 0.0}};
      loads[k].traction[mpm::axis_of(faces[k])] = -mpm::outward(faces[k]) * SURCHARGE;
    }
    for (int p = 0; p < scene.size(); ++p) {
      const int column = p % 5;
      const int row = p / 5;
      scene.stress[p] = {{-SURCHARGE, 0.0, 0.0, -SURCHARGE}};
      if (column == 0) loads[0].point_index.push_back(p);
      if (column == 4) loads[1].point_index.push_back(p);
      if (row == 0) loads[2].point_index.push_back(p);
      if (row == 3) loads[3].point_index.push_back(p);
    }
    mpm::LinearElastic<2> law(10e6, 0.3);
    MpmSolver solver(mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL));
    solver.set_models({&law});

    solver.evaluate(scene.view(), loads, TIME_STEP);

    EXPECT_LT(solver.max_unbalanced_force(), 1e-6 * SURCHARGE * CELL) << "shift " << shift;
  }
}

TEST(GimpTraction, ReachesTheGhostRowAboveTheGrid)
{
  // The upper face of the point is on the upper side of the grid, or slightly above it. The centre
  // of the point is inside the grid.
  for (const double lift : {0.0, 0.04}) {
    Scene scene;
    const int p = scene.add(0.55, 0.95 + lift, {{0.05, 0.05}}, 2000.0);
    TractionLoad load;
    load.traction = {{0.0, -SURCHARGE}};
    load.point_index = {p};
    mpm::LinearElastic<2> law(10e6, 0.3);
    MpmSolver solver(mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL));
    solver.set_models({&law});

    solver.evaluate(scene.view(), {load}, TIME_STEP);

    double total = 0.0;
    for (int j = -1; j <= 11; ++j)
      for (int i = -1; i <= 13; ++i) total += solver.node_force({{i, j}})[1];
    EXPECT_NEAR(total, -SURCHARGE * CELL, 1e-9 * SURCHARGE * CELL);
    EXPECT_NEAR(solver.node_force({{5, 11}})[1], -0.5 * SURCHARGE * lift, 1e-9 * SURCHARGE * CELL);
  }
}

namespace {

/// Returns the force of pressures on some faces of a point, from its momentum after a step.
template <int D>
mpm::Vec<D> force_of_pressures(const mpm::Tensor<D> &F, const std::vector<Face> &faces,
                               double pressure)
{
  mpm_test::SceneOf<D> scene;
  mpm::Vec<D> place, half, lo, hi;
  for (int a = 0; a < D; ++a) {
    place[a] = 0.53 + 0.01 * a;
    half[a] = 0.02 + 0.01 * a;
    lo[a] = 0.0;
    hi[a] = 1.0;
  }
  const int p = scene.add(place, half, 2000.0);
  scene.deformation_gradient[p] = F;
  std::vector<mpm::TractionLoad<D>> loads;
  for (const Face face : faces) {
    mpm::TractionLoad<D> load{mpm::Vec<D>::zero(), face, true, {p}};
    load.traction[mpm::axis_of(face)] = -mpm::outward(face) * pressure;
    loads.push_back(load);
  }
  mpm::LinearElastic<D> law(1e-6, 0.3);    // negligible compared with the pressure
  mpm::MpmSolver<D> solver(mpm_test::grid_options_of<D>(lo, hi, CELL));
  solver.set_models({&law});
  solver.step(scene.view(), loads, TIME_STEP);
  return (1.0 / TIME_STEP) * solver.totals(scene.view()).momentum;
}

/// Returns the area vector of a face by Nanson's formula, det(F) F^-T N A.
template <int D> mpm::Vec<D> present_area(const mpm::Tensor<D> &F, Face face)
{
  double area = 1.0;
  for (int a = 0; a < D; ++a)
    if (a != mpm::axis_of(face)) area *= 2.0 * (0.02 + 0.01 * a);
  mpm::Vec<D> initial = mpm::Vec<D>::zero();
  initial[mpm::axis_of(face)] = mpm::outward(face) * area;
  return rve::determinant(F) * (rve::transpose(rve::inverse(F)) * initial);
}

template <int D> void expect_that_pressures_follow(const mpm::Tensor<D> &F)
{
  const double tolerance = 1e-9 * SURCHARGE * CELL;
  std::vector<Face> faces;
  for (int k = 0; k < 2 * D; ++k) faces.push_back(static_cast<Face>(k));
  for (const Face face : faces) {
    const mpm::Vec<D> force = force_of_pressures<D>(F, {face}, SURCHARGE);
    const mpm::Vec<D> expected = -SURCHARGE * present_area<D>(F, face);
    for (int c = 0; c < D; ++c) EXPECT_NEAR(force[c], expected[c], tolerance);
  }
  const mpm::Vec<D> all_around = force_of_pressures<D>(F, faces, SURCHARGE);
  for (int c = 0; c < D; ++c) EXPECT_NEAR(all_around[c], 0.0, tolerance);
}

}    // namespace

TEST(Pressure, ActsOnThePresentAreaVectorOfADeformedFace)
{
  expect_that_pressures_follow<2>({{0.8, 0.5, -0.3, 1.1}});
  expect_that_pressures_follow<3>({{0.8, 0.5, -0.2, -0.3, 1.1, 0.4, 0.2, -0.1, 0.9}});
}

TEST(Pressure, OfAnUndeformedFaceIsTheTraction)
{
  const mpm::Tensor<2> F{{0.7, 0.0, 0.0, 1.2}};
  const mpm::Vec<2> force = force_of_pressures<2>(F, {Face::YHi}, SURCHARGE);
  EXPECT_NEAR(force[1], -SURCHARGE * 0.04 * 0.7, 1e-9 * SURCHARGE * CELL);
  EXPECT_EQ(force[0], 0.0);
}
