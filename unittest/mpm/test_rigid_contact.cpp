// SPDX-License-Identifier: GPL-2.0-only
// Rigid bodies that rotate or are moved by forces: geometry, motion, contact and exchange of
// momentum.

#include "turning_bodies.h"

#include "mpm/rigid_contact.h"

#include "rve/core/error.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

using namespace mpm_test::turning;
using mpm_test::SceneOf;

namespace {

/// Sets the half spaces of a shape from vertices relative to its centre and along its axes.
template <int D> void set_vertices(mpm::RigidShape<D> &shape, const std::vector<Vec<D>> &vertices)
{
  const mpm::ConvexHull<D> hull = mpm::convex_hull(vertices, "body");
  shape.form = BodyForm::Convex;
  shape.centre = shape.centre + shape.orientation * hull.middle;
  shape.half = hull.half;
  shape.num_half_spaces = static_cast<int>(hull.sides.size());
  for (int k = 0; k < shape.num_half_spaces; ++k) shape.half_space[k] = hull.sides[k].plane;
}

/// Returns random directions and positions.
template <int D> struct Random {
  std::mt19937 generator{11};
  std::uniform_real_distribution<double> number{-1.0, 1.0};
  Vec<D> vector()
  {
    Vec<D> v;
    for (int a = 0; a < D; ++a) v[a] = number(generator);
    return v;
  }
  mpm::RigidShape<D> shape(BodyForm form)
  {
    mpm::RigidShape<D> shape;
    shape.form = form;
    shape.centre = vector();
    for (int a = 0; a < D; ++a) shape.half[a] = 1.0 + 0.5 * number(generator);
    double rates[mpm::FREEDOMS<D>];
    for (double &rate : rates) rate = 2.0 * number(generator);
    shape.orientation = mpm::turn_of<D>(rates, 1.0);
    if (form == BodyForm::Convex) {
      std::vector<Vec<D>> vertices;
      for (int k = 0; k < 12; ++k) vertices.push_back(1.5 * vector());
      set_vertices(shape, vertices);
    }
    return shape;
  }
};

template <int D> void expect_lines_meet_the_surface(BodyForm form)
{
  Random<D> random;
  int met = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const mpm::RigidShape<D> shape = random.shape(form);
    const Vec<D> start = shape.centre + random.vector();
    const int axis = trial % D;
    typename mpm::RigidShape<D>::Crossing crossing;
    if (!shape.cross(start, axis, 1e-9, crossing)) continue;
    ++met;
    for (int end = 0; end < 2; ++end) {
      const Vec<D> &normal = crossing.normal[end];
      Vec<D> on_surface = start, inside = start;
      on_surface[axis] += crossing.place[end];
      inside[axis] += crossing.place[end] + (end == 0 ? 1e-7 : -1e-7);
      EXPECT_NEAR(dot(normal, normal), 1.0, 1e-12);
      EXPECT_LE((end == 0 ? 1.0 : -1.0) * normal[axis], 0.0) << "the line enters and leaves";
      // A convex body is on one side of the plane through a point of its surface.
      for (int k = 0; k < 20; ++k) {
        const Vec<D> other = shape.centre + 2.0 * random.vector();
        typename mpm::RigidShape<D>::Crossing far;
        if (!shape.cross(other, axis, 1e-9, far)) continue;
        Vec<D> point = other;
        point[axis] += far.place[k % 2];
        EXPECT_LE(dot(point - on_surface, normal), 1e-9) << "trial " << trial;
      }
      const Vec<D> nearest = shape.normal_at(inside);
      EXPECT_NEAR(dot(nearest, nearest), 1.0, 1e-12);
      if (form == BodyForm::Ball) { EXPECT_NEAR(dot(nearest, normal), 1.0, 1e-6); }
    }
  }
  EXPECT_GT(met, 100);
}

}    // namespace

TEST(RigidShape, LinesIntersectAConvexBodyAtSupportingPlanes)
{
  expect_lines_meet_the_surface<2>(BodyForm::Box);
  expect_lines_meet_the_surface<2>(BodyForm::Ball);
  expect_lines_meet_the_surface<3>(BodyForm::Box);
  expect_lines_meet_the_surface<3>(BodyForm::Ball);
  expect_lines_meet_the_surface<3>(BodyForm::Cylinder);
  expect_lines_meet_the_surface<2>(BodyForm::Convex);
  expect_lines_meet_the_surface<3>(BodyForm::Convex);
}

namespace {

template <int D> void expect_corners_of_a_box_are_the_box()
{
  Random<D> random;
  int met = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    mpm::RigidShape<D> box = random.shape(BodyForm::Box), convex = box;
    if (trial % 4 == 0) box.orientation = convex.orientation = mpm::Tensor<D>::identity();
    set_vertices(convex, corners_of_box(-1.0 * box.half, box.half));
    EXPECT_EQ(convex.num_half_spaces, 2 * D);
    EXPECT_NEAR(convex.radius(), box.radius(), 1e-14);
    const Vec<D> start = box.centre + 1.2 * random.vector();
    typename mpm::RigidShape<D>::Crossing one, other;
    const bool meets = box.cross(start, trial % D, 1e-9, one);
    ASSERT_EQ(convex.cross(start, trial % D, 1e-9, other), meets);
    EXPECT_LE(std::sqrt(dot(box.normal_at(start) - convex.normal_at(start),
                            box.normal_at(start) - convex.normal_at(start))),
              1e-12);
    if (!meets) continue;
    ++met;
    for (int end = 0; end < 2; ++end) {
      // The error of an intersection is larger on a face nearly parallel to the line.
      const double steep = std::abs(one.normal[end][trial % D]);
      EXPECT_NEAR(other.place[end], one.place[end], 1e-13 / steep);
      for (int a = 0; a < D; ++a) EXPECT_NEAR(other.normal[end][a], one.normal[end][a], 1e-13);
      EXPECT_NEAR(other.depth[end], one.depth[end], 1e-13 / steep);
    }
  }
  EXPECT_GT(met, 500);
}

}    // namespace

TEST(RigidShape, OfTheCornersOfABoxIsTheBox)
{
  expect_corners_of_a_box_are_the_box<2>();
  expect_corners_of_a_box_are_the_box<3>();
}

TEST(RigidShape, PolygonOfManySidesIsADisk)
{
  constexpr int SIDES = 48;
  mpm::RigidShape<2> disk, polygon;
  disk.form = BodyForm::Ball;
  disk.half = {{1.0, 1.0}};
  std::vector<Vec<2>> vertices;
  for (int k = 0; k < SIDES; ++k) {
    const double angle = 2.0 * std::acos(-1.0) * (k + 0.5) / SIDES;
    vertices.push_back({{std::cos(angle), std::sin(angle)}});
  }
  set_vertices(polygon, vertices);
  const double half_side = std::acos(-1.0) / SIDES;
  for (double x : {std::sin(half_side), 0.0, 0.1, 0.217, 0.31, 0.422, -0.5, -0.64}) {
    mpm::RigidShape<2>::Crossing round, flat;
    ASSERT_TRUE(disk.cross({{x, 0.0}}, 1, 1e-9, round));
    ASSERT_TRUE(polygon.cross({{x, 0.0}}, 1, 1e-9, flat));
    for (int end = 0; end < 2; ++end) {
      EXPECT_NEAR(flat.place[end], round.place[end],
                  (1.0 - std::cos(half_side)) / std::abs(flat.normal[end][1]) + 1e-12);
      EXPECT_GE(dot(flat.normal[end], round.normal[end]), std::cos(1.1 * half_side));
      EXPECT_GT(flat.depth[end], 0.2) << "there are no edges, on a vertex neither";
    }
  }
}

namespace {

/// Expects that material enclosed by a rough body moves with it. The body has the given rates about
/// a pivot that is not its centre.
template <int D> void expect_enclosed_material_moves_with_body(const double *rates)
{
  mpm::SolverOptions<D> options =
      mpm_test::grid_options_of<D>(corner<D>(0.0, 0.0), corner<D>(1.6, 1.6), CELL);
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].form = BodyForm::Box;
  options.rigid_bodies[0].has_pivot = true;
  options.rigid_bodies[0].pivot[0] = options.rigid_bodies[0].pivot[1] = 0.3;
  SceneOf<D> scene;
  scene.add_block(corner<D>(0.7, 0.7), corner<D>(0.9, 0.9), 0.5 * CELL, DENSITY);
  const int inner = scene.size();
  scene.add_block(corner<D>(0.3, 0.3), corner<D>(1.3, 1.3), CELL, DENSITY);
  for (int p = inner; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  mpm::LinearElastic<D> law(YOUNG, 0.3);
  MpmSolver<D> solver(options);
  solver.set_models({&law});
  solver.rigid_bodies().set_rates(0, rates);
  const SceneOf<D> start = scene;
  const int steps = 20;
  mpm::Tensor<D> turn = mpm::Tensor<D>::identity();

  for (int step = 0; step < steps; ++step) {
    solver.step(scene.view(), {}, TIME_STEP);
    turn = mpm::turn_of<D>(rates, TIME_STEP) * turn;
  }

  Vec<D> pivot = Vec<D>::zero(), moved;
  pivot[0] = pivot[1] = 0.3;
  for (int a = 0; a < D; ++a) moved[a] = steps * TIME_STEP * rates[a];
  for (int p = 0; p < scene.size(); ++p) {
    Vec<D> arm;
    for (int a = 0; a < D; ++a) arm[a] = start.position[3 * p + a] - pivot[a];
    const Vec<D> place = pivot + moved + turn * arm;
    const Vec<D> velocity = mpm::velocity_at(rates, turn * arm);
    if (p >= inner)
      for (int a = 0; a < D; ++a) {
        EXPECT_NEAR(scene.position[3 * p + a], place[a], 1e-13);
        EXPECT_NEAR(scene.velocity[3 * p + a], velocity[a], 1e-12) << "ω × r";
      }
    else
      for (int i = 0; i < D; ++i) {
        Vec<D> axis = Vec<D>::zero();
        axis[i] = 1.0;
        const Vec<D> at_one = mpm::velocity_at(rates, axis);
        const Vec<D> at_none = mpm::velocity_at(rates, Vec<D>::zero());
        for (int a = 0; a < D; ++a)
          EXPECT_NEAR(scene.velocity_gradient[p](a, i), at_one[a] - at_none[a], 1e-10)
              << "nodes have ω × r, whose gradient shape functions reproduce";
      }
  }
}

}    // namespace

TEST(TurningBody, RotatesByTheSpinTimesTheTime)
{
  for (const double angle : {1e-9, 0.1, 1.0, 2.5, 6.0}) {
    const double in_plane[] = {0.0, 0.0, 2.0 * angle};
    const mpm::Tensor<2> plane = mpm::turn_of<2>(in_plane, 0.5);
    EXPECT_NEAR(plane(0, 0), std::cos(angle), 2e-15) << angle;
    EXPECT_NEAR(plane(1, 0), std::sin(angle), 2e-15) << angle;
    const double in_space[] = {0.0, 0.0, 0.0, 0.0, 2.0 * angle, 0.0};
    const mpm::Tensor<3> space = mpm::turn_of<3>(in_space, 0.5);
    EXPECT_NEAR(space(0, 0), std::cos(angle), 2e-15) << angle;
    EXPECT_NEAR(space(0, 2), std::sin(angle), 2e-15) << angle;
    EXPECT_EQ(space(1, 1), 1.0) << angle;
  }
  // The rotation is a whole turn in 100 steps.
  const double rates[] = {0.0, 0.0, 0.0, 0.02 * std::acos(-1.0), 0.0, 0.0};
  mpm::Tensor<3> turn = mpm::Tensor<3>::identity();
  for (int step = 0; step < 100; ++step) turn = mpm::turn_of<3>(rates, 1.0) * turn;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(turn(a, b), a == b ? 1.0 : 0.0, 1e-13);
}

TEST(TurningBody, NodesInARoughBodyHaveItsVelocityAndItsSpin)
{
  const double in_plane[] = {0.05, -0.02, 0.4};
  const double in_space[] = {0.05, -0.02, 0.03, 0.4, -0.3, 0.2};
  expect_enclosed_material_moves_with_body<2>(in_plane);
  expect_enclosed_material_moves_with_body<3>(in_space);
}

TEST(TurningBody, FullWidthBoxAgreesWithABodyWithAFace)
{
  for (const bool rough : {false, true}) {
    double reaction[3], stress[3];
    for (const BodyForm form : {BodyForm::Face, BodyForm::Box, BodyForm::Convex}) {
      BodyOnLayer<2> set(0.4, 0.8, 0.4);
      set.options.rigid_bodies[0].form = form;
      set.options.rigid_bodies[0].rough = rough;
      set.options.rigid_body_vertices = {corners_of_box<2>({{0.0, 0.8}}, {{0.4, 1.0}})};
      set.add_body({{0.0, 0.8}}, {{0.4, 1.0}}, DENSITY);
      MpmSolver<2> solver(set.options);
      solver.set_models({&set.law});
      const double rates[] = {0.0, -0.016, 0.0};
      if (form == BodyForm::Face)
        solver.set_body_velocity(0, {{0.0, rates[1]}});
      else
        solver.rigid_bodies().set_rates(0, rates);
      for (int step = 0; step < 300; ++step) solver.step(set.scene.view(), {}, TIME_STEP);
      const int k = form == BodyForm::Face ? 0 : form == BodyForm::Box ? 1 : 2;
      reaction[k] = solver.body_reaction(0)[1];
      stress[k] = set.scene.stress[0](1, 1);
    }
    EXPECT_GT(reaction[0], 0.0);
    for (const int k : {1, 2}) {
      EXPECT_NEAR(reaction[k], reaction[0], 1e-9 * reaction[0]);
      EXPECT_NEAR(stress[k], stress[0], -1e-9 * stress[0]);
    }
  }
}

namespace {

/// Expects the settlement u of a free body on a layer that is as wide as the body: M g = E A
/// ln(H/(H - u)), with the mass M of the body, and the height H, area A and modulus E of the layer.
/// This is the law of Hughes and Winget in one dimension, with ν = 0.
template <int D> void expect_settlement(double density)
{
  BodyOnLayer<D> set(0.4, 0.8, 0.6);
  set.law = mpm::LinearElastic<D>(YOUNG, 0.0);
  set.options.damping = 0.5;
  set.options.rigid_bodies[0].rough = false;
  set.options.rigid_bodies[0].separation = true;
  set.options.rigid_bodies[0].free = ALL_FREE<D>;
  set.add_body(corner<D>(0.0, 0.8), corner<D>(0.4, 1.2), density);
  set.set_gravity(-GRAVITY * up<D>());
  MpmSolver<D> solver(set.options);
  solver.set_models({&set.law});

  double least = 1.0;    // least ratio of force to weight after the first steps
  const double weight = density * 0.4 * GRAVITY * std::pow(0.4, D - 1);
  for (int step = 0; step < 1600; ++step) {
    solver.step(set.scene.view(), {}, TIME_STEP);
    if (step > 1400) least = std::min(least, solver.body_reaction(0)[D - 1] / weight);
  }

  const double pressure = weight / std::pow(0.4, D - 1);
  const double settlement = 0.8 * (1.0 - std::exp(-pressure / YOUNG));
  const double *rates = solver.rigid_bodies().rates(0);
  const double sunk = 1.0 - solver.rigid_bodies().origin(0)[D - 1];
  EXPECT_NEAR(solver.body_reaction(0)[D - 1], weight, 1e-3 * weight);
  EXPECT_GT(least, 0.99) << "at rest";
  EXPECT_NEAR(sunk, settlement, 0.02 * settlement) << "D = " << D;
  for (int k = 0; k < mpm::FREEDOMS<D>; ++k) EXPECT_NEAR(rates[k], 0.0, 1e-5);
}

}    // namespace

TEST(FreeBody, ComesToRestAtTheElasticSettlementUnderItsWeight)
{
  expect_settlement<2>(5000.0);
  expect_settlement<3>(5000.0);
}

TEST(FreeBody, LightBodyOnHeavyMaterialIsStable)
{
  // The body is 0.4 high and as heavy as 0.04 of the layer. It is therefore less than half as heavy
  // as the nodes below it.
  expect_settlement<2>(200.0);
}

namespace {

/// Returns the deceleration of a block that is thrown along a stiff layer, with gravity inclined by
/// `slope`. A block of the form Convex is a wedge on its longest face or has the corners of the
/// block.
template <int D>
double deceleration_on_plane(double friction, double slope, double speed, bool slides = true,
                             BodyForm form = BodyForm::Box, bool is_wedge = true)
{
  BodyOnLayer<D> set(1.6, 0.3, 0.5);
  set.options.rigid_bodies[0].rough = false;
  set.options.rigid_bodies[0].friction = friction;
  set.options.rigid_bodies[0].free = D == 2 ? 3 : 7;    // prevents tipping
  set.options.damping = 0.0;
  set.options.flip = 0.9;
  for (int side = 0; side < mpm::FACES<D> - 1; ++side)
    set.options.sides[side] = mpm::SideKind::Fixed;
  Vec<D> lo = corner<D>(0.6, 0.3), hi = corner<D>(1.0, 0.6);
  lo[0] = 0.2;
  hi[0] = 0.6;
  set.options.rigid_bodies[0].form = form;
  if (form == BodyForm::Convex && is_wedge) {
    if constexpr (D == 2) {    // width 0.7, height 0.35
      set.options.rigid_body_vertices = {{{{0.25, 0.3}}, {{0.95, 0.3}}, {{0.6, 0.65}}}};
      set.scene.add_block({{0.25, 0.3}}, {{0.95, 0.7}}, 0.05, 8000.0,
                          [](double x, double y) { return y - 0.3 + std::abs(x - 0.6) < 0.35; });
      for (int p = set.num_deformable; p < set.scene.size(); ++p) set.scene.rigid_body[p] = 0;
    }
  } else {
    set.options.rigid_body_vertices = {corners_of_box(lo, hi)};
    set.add_body(lo, hi, 8000.0);
  }
  Vec<D> gravity = (-GRAVITY * std::cos(slope)) * up<D>();
  gravity[0] = GRAVITY * std::sin(slope);
  set.set_gravity(gravity);
  for (int p = set.num_deformable; p < set.scene.size(); ++p) set.scene.velocity[3 * p] = speed;
  MpmSolver<D> solver(set.options);
  solver.set_models({&set.law});

  const int synchronise = 100, steps = 300;
  double start = 0.0;
  for (int step = 0; step < synchronise + steps; ++step) {
    if (step == synchronise) start = solver.rigid_bodies().rates(0)[0];
    solver.step(set.scene.view(), {}, TIME_STEP);
    const Vec<D> force = solver.body_reaction(0);
    if (slides && friction > 0.0) {
      EXPECT_NEAR(-force[0], friction * force[D - 1], 0.01 * friction * std::abs(force[D - 1]));
    }
  }
  return (start - solver.rigid_bodies().rates(0)[0]) / (steps * TIME_STEP);
}

}    // namespace

TEST(FrictionalContact, SlidingBlockDeceleratesByTheCoefficientTimesGravity)
{
  const double friction = 0.3;
  EXPECT_NEAR(deceleration_on_plane<2>(friction, 0.0, 2.0), friction * GRAVITY,
              0.05 * friction * GRAVITY)
      << "the mean of the normal force is the weight; it still swings a little";
  EXPECT_NEAR(deceleration_on_plane<3>(friction, 0.0, 2.0), friction * GRAVITY,
              0.05 * friction * GRAVITY);
}

TEST(FrictionalContact, BlockFromItsCornersSlidesAsTheBox)
{
  for (const double slope : {0.0, 0.3})
    EXPECT_NEAR(deceleration_on_plane<2>(0.3, slope, 2.0, true, BodyForm::Convex, false),
                deceleration_on_plane<2>(0.3, slope, 2.0), 1e-9 * GRAVITY)
        << "round-off of 400 steps";
  EXPECT_NEAR(deceleration_on_plane<3>(0.3, 0.0, 2.0, true, BodyForm::Convex, false),
              deceleration_on_plane<3>(0.3, 0.0, 2.0), 1e-9 * GRAVITY);
}

TEST(FrictionalContact, WedgeOnAnInclineSlidesOrSticksByCoulombFriction)
{
  const double slope = 0.4, along = GRAVITY * std::sin(slope), across = GRAVITY * std::cos(slope);
  const double slippery = 0.2, sticky = 0.6;    // tan 0.4 = 0.42
  EXPECT_NEAR(deceleration_on_plane<2>(slippery, slope, 1.0, true, BodyForm::Convex),
              slippery * across - along, 0.02 * slippery * across);
  EXPECT_NEAR(deceleration_on_plane<2>(sticky, slope, 0.0, false, BodyForm::Convex), 0.0,
              0.1 * along)
      << "it bounces in the beginning, by which it slips a little";
}

TEST(FrictionalContact, BlockOnAnInclineSlidesOrSticksByCoulombFriction)
{
  const double slope = 0.4, along = GRAVITY * std::sin(slope), across = GRAVITY * std::cos(slope);
  const double slippery = 0.2, sticky = 0.6;    // tan 0.4 = 0.42
  EXPECT_NEAR(deceleration_on_plane<2>(slippery, slope, 1.0), slippery * across - along,
              0.02 * slippery * across);
  EXPECT_NEAR(deceleration_on_plane<2>(sticky, slope, 0.0, false), 0.0, 0.01 * along);
  EXPECT_NEAR(deceleration_on_plane<2>(0.0, slope, 1.0), -along, 1e-4 * along)
      << "smooth; the layer bulges a little beside the block";
}

namespace {

/// Expects that momentum is conserved when a free rotating body hits a free block.
template <int D> void expect_momentum_is_conserved(BodyForm form, bool rough, double friction)
{
  mpm::SolverOptions<D> options =
      mpm_test::grid_options_of<D>(corner<D>(0.0, 0.0), corner<D>(1.6, 1.6), CELL);
  options.flip = 0.98;
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].form = form;
  options.rigid_bodies[0].rough = rough;
  options.rigid_bodies[0].friction = friction;
  options.rigid_bodies[0].free = ALL_FREE<D>;
  SceneOf<D> scene;
  scene.add_block(corner<D>(0.4, 0.4), corner<D>(0.9, 0.8), 0.5 * CELL, DENSITY);
  const int deformable = scene.size();
  Vec<D> lo = corner<D>(0.6, 0.85), hi = corner<D>(1.0, 1.15);
  options.rigid_body_vertices = {middles_of_faces(corner<D>(0.6, 0.75), hi)};
  scene.add_block(lo, hi, 0.5 * CELL, DENSITY);
  double mass = 0.0;
  for (int p = deformable; p < scene.size(); ++p) {
    scene.rigid_body[p] = 0;
    mass += scene.mass[p];
    scene.velocity[3 * p] = -0.5 - 2.0 * (scene.position[3 * p + D - 1] - 1.0);
    scene.velocity[3 * p + D - 1] = -2.0 + 2.0 * (scene.position[3 * p] - 0.8);
  }
  mpm::LinearElastic<D> law(YOUNG, 0.3);
  MpmSolver<D> solver(options);
  solver.set_models({&law});
  const double speed = 2.0;
  Vec<D> first = Vec<D>::zero();
  double gained = 0.0;

  for (int step = 0; step < 120; ++step) {
    solver.step(scene.view(), {}, TIME_STEP);
    const mpm::Totals<D> material = solver.totals(scene.view());
    Vec<D> total = material.momentum;
    for (int a = 0; a < D; ++a) total[a] += mass * solver.rigid_bodies().rates(0)[a];
    if (step == 0) first = total;
    for (int a = 0; a < D; ++a)
      EXPECT_NEAR(total[a], first[a], 1e-10 * mass * speed) << "step " << step;
    gained = std::max(gained, std::abs(material.momentum[D - 1]));
  }
  EXPECT_GT(gained, 0.05 * mass * speed) << "they met";
}

}    // namespace

TEST(FreeBody, ExchangesMomentumWithTheMaterialToRoundOff)
{
  expect_momentum_is_conserved<2>(BodyForm::Box, true, 0.0);
  expect_momentum_is_conserved<2>(BodyForm::Ball, false, 0.4);
  expect_momentum_is_conserved<3>(BodyForm::Box, false, 0.4);
  expect_momentum_is_conserved<3>(BodyForm::Cylinder, false, 0.0);
  expect_momentum_is_conserved<2>(BodyForm::Convex, false, 0.4);
  expect_momentum_is_conserved<3>(BodyForm::Convex, false, 0.4);
}

TEST(FreeBody, FallsFreelyAndPrecessesWithoutContact)
{
  // Without torque the angular momentum keeps its direction and size, and I ω rotates with the
  // body.
  SceneOf<3> scene;
  scene.add({{0.2, 0.2, 0.2}}, {{0.05, 0.05, 0.05}}, DENSITY);
  scene.add_block({{0.5, 0.6, 0.8}}, {{1.1, 1.0, 1.0}}, CELL, DENSITY);
  mpm::SolverOptions<3> options =
      mpm_test::grid_options_of<3>(corner<3>(0.0, 0.0), corner<3>(1.6, 1.6), CELL);
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].form = BodyForm::Box;
  options.rigid_bodies[0].free = ALL_FREE<3>;
  const Vec<3> centre = {{0.8, 0.8, 0.9}};
  const Vec<3> spin = {{1.0, 2.0, -1.5}};
  const auto angular_momentum = [&](const Vec<3> &middle, const Vec<3> &spin_now) {
    Vec<3> sum = Vec<3>::zero();
    for (int p = 1; p < scene.size(); ++p) {
      Vec<3> arm, velocity;
      for (int a = 0; a < 3; ++a) {
        arm[a] = scene.position[3 * p + a] - middle[a];
        velocity[a] = scene.velocity[3 * p + a];
      }
      sum = sum + scene.mass[p] * cross(arm, velocity);
      // moment of inertia of a cube about any axis, divided by its mass
      const double own = 2.0 / 3.0 * 0.05 * 0.05;
      for (int a = 0; a < 3; ++a) sum[a] += scene.mass[p] * own * spin_now[a];
    }
    return sum;
  };
  for (int p = 1; p < scene.size(); ++p) {
    scene.rigid_body[p] = 0;
    Vec<3> arm;
    for (int a = 0; a < 3; ++a) arm[a] = scene.position[3 * p + a] - centre[a];
    for (int a = 0; a < 3; ++a) scene.velocity[3 * p + a] = cross(spin, arm)[a];
    scene.body_force[3 * p + 2] = -GRAVITY * scene.mass[p];
  }
  const Vec<3> before = angular_momentum(centre, spin);
  mpm::LinearElastic<3> law(YOUNG, 0.3);
  MpmSolver<3> solver(options);
  solver.set_models({&law});
  const int steps = 400;

  for (int step = 0; step < steps; ++step) solver.step(scene.view(), {}, TIME_STEP);

  const double time = steps * TIME_STEP;
  EXPECT_NEAR(solver.rigid_bodies().rates(0)[2], -GRAVITY * time, 1e-10);
  EXPECT_NEAR(solver.rigid_bodies().origin(0)[2] - centre[2],
              -0.5 * GRAVITY * time * (time + TIME_STEP), 1e-11)
      << "symplectic Euler";
  const double *rates = solver.rigid_bodies().rates(0);
  const Vec<3> after =
      angular_momentum(solver.rigid_bodies().origin(0), {{rates[3], rates[4], rates[5]}});
  // The explicit step is of first order, so each step has an error of (ω dt)²/2.
  for (int a = 0; a < 3; ++a)
    EXPECT_NEAR(after[a], before[a], 1e-3 * std::sqrt(dot(before, before)));
  EXPECT_GT(std::abs(rates[3] - spin[0]), 0.1) << "it precesses";
}

TEST(FreeBody, HingedAtItsFootOscillatesLikeAPhysicalPendulum)
{
  // A rod hangs from a pivot at its upper end. Its small oscillations have the period 2π sqrt(I/(m
  // g d)), with the moment of inertia I about the pivot and the distance d of the centre from it.
  SceneOf<2> scene;
  scene.add(0.2, 0.2, {{0.05, 0.05}}, DENSITY);
  scene.add_block({{0.7, 0.4}}, {{0.8, 1.2}}, 0.05, DENSITY);
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.6, 1.6}}, CELL);
  options.rigid_bodies.resize(1);
  mpm::RigidBodyOptions &body = options.rigid_bodies[0];
  body.form = BodyForm::Box;
  body.free = 1 << 2;
  body.has_pivot = true;
  body.pivot[0] = 0.75;
  body.pivot[1] = 1.2;
  for (int p = 1; p < scene.size(); ++p) {
    scene.rigid_body[p] = 0;
    scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
    scene.velocity[3 * p] = -0.01 * (scene.position[3 * p + 1] - 1.2);    // spin 0.01
    scene.velocity[3 * p + 1] = 0.01 * (scene.position[3 * p] - 0.75);
  }
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  MpmSolver<2> solver(options);
  solver.set_models({&law});
  const double width = 0.1, length = 0.8;
  const double inertia_per_mass = (width * width + length * length) / 12.0 + 0.25 * length * length;
  const double frequency = std::sqrt(GRAVITY * 0.5 * length / inertia_per_mass);

  double time = 0.0;
  for (int step = 0; step < 1200; ++step) {
    solver.step(scene.view(), {}, TIME_STEP);
    time += TIME_STEP;
    EXPECT_NEAR(solver.rigid_bodies().rates(0)[2], 0.01 * std::cos(frequency * time), 1e-4)
        << "amplitude 0.0023, symplectic Euler";
  }
  EXPECT_NEAR(solver.rigid_bodies().origin(0)[1], 1.2, 0.0);
}

namespace {

/// Presses a body with the given vertices, filled with points, into the top of a layer of 1.6 by
/// 0.8.
struct Press {
  BodyOnLayer<2> set{1.6, 0.8, 0.8};
  std::unique_ptr<MpmSolver<2>> solver;

  Press(BodyForm form, std::vector<Vec<2>> vertices, const Vec<2> &lo, const Vec<2> &hi,
        double from = 0.0)
  {
    SceneOf<2> right;
    for (int p = 0; p < set.scene.size(); ++p)
      if (set.scene.position[3 * p] > from)
        right.add({{set.scene.position[3 * p], set.scene.position[3 * p + 1]}},
                  set.scene.half_size[p], DENSITY);
    set.scene = right;
    set.num_deformable = right.size();
    set.options.lo[0] = from;
    set.options.rigid_bodies[0].form = form;
    set.options.rigid_bodies[0].rough = false;
    set.options.rigid_bodies[0].separation = true;
    set.options.rigid_body_vertices = {std::move(vertices)};
    set.options.damping = 0.1;
    set.add_body(lo, hi, DENSITY);
    solver = std::make_unique<MpmSolver<2>>(set.options);
    solver->set_models({&set.law});
  }
  Vec<2> force_at(double speed, int steps)
  {
    const double rates[] = {0.0, -speed, 0.0};
    solver->rigid_bodies().set_rates(0, rates);
    for (int step = 0; step < steps; ++step) solver->step(set.scene.view(), {}, TIME_STEP);
    return solver->body_reaction(0);
  }
};

}    // namespace

TEST(ConvexBody, SymmetricWedgeHasNoHorizontalForceAndNoTorque)
{
  // angles of 56, 45 and 31 degrees to the vertical
  for (const double height : {0.2, 0.3, 0.5}) {
    Press press(BodyForm::Convex, {{{0.5, 0.8 + height}}, {{0.8, 0.8}}, {{1.1, 0.8 + height}}},
                {{0.6, 0.9}}, {{1.0, 1.1}});
    double largest = 0.0;
    for (int part = 0; part < 20; ++part) {
      const Vec<2> force = press.force_at(0.5, 30);
      largest = std::max(largest, force[1]);
      EXPECT_NEAR(force[0], 0.0, 1e-8 * largest) << "round-off grows with the steps";
      EXPECT_NEAR(press.solver->body_torque(0)[0], 0.0, 1e-8 * largest);
    }
    EXPECT_GT(largest, 1e4) << "it has sunk in by a cell and a half";
  }
}

TEST(ConvexBody, HalfAWedgeAtAPlaneOfSymmetryHasHalfTheForce)
{
  Press whole(BodyForm::Convex, {{{0.5, 1.0}}, {{0.8, 0.8}}, {{1.1, 1.0}}}, {{0.6, 0.9}},
              {{1.0, 1.0}});
  Press half(BodyForm::Convex, {{{0.8, 1.0}}, {{0.8, 0.8}}, {{1.1, 1.0}}}, {{0.8, 0.9}},
             {{1.0, 1.0}}, 0.8);
  for (int part = 0; part < 5; ++part) {    // one and a half cells deep at the end
    const double all = whole.force_at(0.2, 300)[1];
    EXPECT_GT(all, 1e4);
    // Points spread mass beyond the plane of symmetry, and this mass remains there.
    EXPECT_NEAR(half.force_at(0.2, 300)[1], 0.5 * all, 0.005 * all);
  }
}

TEST(ConvexBody, SharpTipHasNoLateralForceAnywhereOnTheGrid)
{
  // The angle to the vertical is 18 degrees: near the tip both faces have the same nodes.
  for (const double shift : {0.0, 0.02, 0.05, 0.08}) {
    const double x = 0.8 + shift;
    Press press(BodyForm::Convex, {{{x - 0.2, 1.4}}, {{x, 0.8}}, {{x + 0.2, 1.4}}},
                {{x - 0.1, 1.2}}, {{x + 0.1, 1.4}});
    double aside = 0.0, down = 0.0;
    for (int part = 0; part < 60; ++part) {
      const Vec<2> force = press.force_at(0.5, 20);
      aside += force[0] * force[0];
      down += force[1] * force[1];
    }
    EXPECT_LT(std::sqrt(aside), 0.02 * std::sqrt(down)) << shift;
  }
}

TEST(ConvexBody, PolygonOf24SidesHasTheForceOfADisk)
{
  const double radius = 0.4, pi = std::acos(-1.0), depth = 0.1;
  std::vector<Vec<2>> vertices;
  for (int k = 0; k < 24; ++k)    // with a vertex at the bottom
    vertices.push_back({{0.8 + radius * std::sin(2.0 * pi * k / 24),
                         0.8 + radius - radius * std::cos(2.0 * pi * k / 24)}});
  const double speed = 0.2;
  const int steps = static_cast<int>(std::lround(depth / speed / TIME_STEP));
  Press disk(BodyForm::Ball, {}, {{0.4, 0.8}}, {{1.2, 1.6}});
  Press polygon(BodyForm::Convex, vertices, {{0.4, 0.8}}, {{1.2, 1.6}});

  const double round = disk.force_at(speed, steps)[1];
  const double flat = polygon.force_at(speed, steps)[1];

  // The sides of the polygon are inside the circle by at most this length. The force increases with
  // the depth, so the forces of polygon and circle differ by at most the share inside/depth.
  const double inside = radius * (1.0 - std::cos(pi / 24));
  EXPECT_GT(round, 1e4);
  EXPECT_NEAR(flat, round, inside / depth * round);
}

TEST(ConvexBody, RefusesPointsOutsideAndThinBodies)
{
  const auto message = [](std::vector<Vec<2>> vertices) {
    try {
      Press(BodyForm::Convex, std::move(vertices), {{0.6, 0.8}}, {{1.0, 1.2}}).force_at(0.1, 1);
    } catch (const rve::InputError &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({{{0.6, 0.8}}, {{1.0, 0.8}}, {{0.8, 1.2}}}), "");
  EXPECT_EQ(message({{{0.6, 1.1}}, {{1.0, 1.1}}, {{0.8, 1.5}}}),
            "rigid body 0 has points whose center of mass, 0.8 1, is 0.1 [length] outside of its "
            "vertices; it must be at most half a cell, 0.05 [length]");
  EXPECT_EQ(message({{{0.6, 0.8}}, {{1.0, 1.2}}, {{0.95, 1.25}}, {{0.55, 0.85}}}),
            "rigid body 0 must be at least one cell wide from each face to the opposite vertex, "
            "0.1 [length], got 0.0707106781 [length]");
}

namespace {

template <int D> void expect_same_bits(BodyForm form, int steps)
{
  const TwoBodies<D> set(form);
  SceneOf<D> whole = set.scene;
  const RankOutcome<D> alone = set.run(whole, steps, 1, {});
  ASSERT_GT(std::abs(alone.numbers.back()), 0.0);
  SceneOf<D> shared = set.scene;
  const RankOutcome<D> threaded = set.run(shared, steps, 3, {});
  EXPECT_EQ(alone.numbers, threaded.numbers);
  EXPECT_EQ(alone.point, threaded.point);
  for (const int ranks : {2, 3}) {
    mpm_test::RankTeam team(ranks);
    std::vector<RankOutcome<D>> of_rank(ranks);
    team.run([&](int rank, const mpm::Communication &communication) {
      std::vector<int> mine;    // slabs in x in another order
      for (int p = set.scene.size() - 1; p >= 0; --p)
        if (std::min(ranks - 1, static_cast<int>(set.scene.position[3 * p] / 1.2 * ranks)) == rank)
          mine.push_back(p);
      SceneOf<D> part = set.scene.selected(mine);
      of_rank[rank] = set.run(part, steps, 1, communication);
    });
    std::map<std::int64_t, std::vector<double>> together;
    for (const RankOutcome<D> &one : of_rank) {
      EXPECT_EQ(alone.numbers, one.numbers) << ranks << " ranks";
      together.insert(one.point.begin(), one.point.end());
    }
    EXPECT_EQ(alone.point, together) << ranks << " ranks";
  }
}

}    // namespace

TEST(TurningBody, HasTheSameBitsForAnyNumberOfRanksAndThreads)
{
  expect_same_bits<2>(BodyForm::Ball, 60);
  expect_same_bits<2>(BodyForm::Box, 60);
  expect_same_bits<3>(BodyForm::Cylinder, 8);
  expect_same_bits<2>(BodyForm::Convex, 60);
  expect_same_bits<3>(BodyForm::Convex, 8);
}

namespace {

template <int D> void expect_to_continue_from_record(BodyForm form, int steps)
{
  const TwoBodies<D> set(form);
  mpm::LinearElastic<D> law(YOUNG, 0.3);
  bool touches[2] = {false, false};
  const auto advance = [&](MpmSolver<D> &solver, SceneOf<D> &scene, int count) {
    for (int step = 0; step < count; ++step) {
      solver.step(scene.view(), {}, TIME_STEP);
      for (const int b : {0, 1}) touches[b] = touches[b] || solver.body_reaction(b)[D - 1] != 0.0;
    }
  };
  SceneOf<D> whole = set.scene, again = set.scene;
  const auto one = set.solver(law), first = set.solver(law), second = set.solver(law);
  advance(*one, whole, 2 * steps);
  advance(*first, again, steps);

  for (const int b : {0, 1})
    second->rigid_bodies().set_record(b, first->rigid_bodies().record(b).data());
  touches[0] = touches[1] = false;
  advance(*second, again, steps);

  EXPECT_EQ(whole.position, again.position);
  EXPECT_EQ(whole.velocity, again.velocity);
  for (const int b : {0, 1}) {
    EXPECT_EQ(one->rigid_bodies().record(b), second->rigid_bodies().record(b));
    for (int a = 0; a < D; ++a)
      EXPECT_EQ(one->body_reaction(b)[a], second->body_reaction(b)[a]) << "body " << b;
    EXPECT_TRUE(touches[b]) << "body " << b << " of the form " << static_cast<int>(form)
                            << ", D = " << D;
  }
}

}    // namespace

TEST(TurningBody, ContinuesFromItsRecordToTheBit)
{
  expect_to_continue_from_record<2>(BodyForm::Ball, 20);
  expect_to_continue_from_record<2>(BodyForm::Convex, 20);
  for (const BodyForm form : {BodyForm::Box, BodyForm::Ball, BodyForm::Cylinder, BodyForm::Convex})
    expect_to_continue_from_record<3>(form, 5);
}

TEST(TurningBody, RefusesInvalidOptions)
{
  const auto message = [](const mpm::RigidBodyOptions &body) {
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.0, 1.0}}, CELL);
    options.rigid_bodies = {body};
    options.rigid_body_names = {"block"};
    try {
      MpmSolver<2> solver(options);
    } catch (const rve::InputError &problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  mpm::RigidBodyOptions body;
  body.form = BodyForm::Cylinder;
  EXPECT_EQ(message(body), "rigid body block is a cylinder, which requires three dimensions");
  body.form = BodyForm::Box;
  body.friction = 0.3;
  EXPECT_EQ(message(body),
            "rigid body block is rough and has a coefficient of friction; only one of the two "
            "is allowed");
  body.rough = false;
  body.friction = -0.1;
  EXPECT_EQ(message(body),
            "rigid body block must have a coefficient of friction of at least 0, got -0.1");
  body.friction = 0.0;
  body.form = BodyForm::Convex;
  EXPECT_EQ(message(body), "rigid body block must have 3 to 128 vertices, got 0");
  body.form = BodyForm::Face;
  body.free = 1;
  EXPECT_EQ(message(body),
            "rigid body block presses with one face, which supports no forces, friction or "
            "rotation: use another form");
}
