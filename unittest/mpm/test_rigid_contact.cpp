// Rigid bodies that can turn, and those that forces drive: geometry, motion, contact and exchange of momentum.

#include "scene.h"

#include "mpm/rigid_contact.h"

#include "rve/core/error.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <random>

using mpm::BodyForm;
using mpm::MpmSolver;
using mpm::Vec;
using mpm_test::SceneOf;

namespace {

constexpr double CELL = 0.1;
constexpr double DENSITY = 2000.0;
constexpr double YOUNG = 10e6;
constexpr double TIME_STEP = 5e-4;    // CFL 0.41
constexpr double GRAVITY = 9.81;

template <int D> constexpr int ALL_FREE = (1 << mpm::FREEDOMS<D>) -1;

template <int D> Vec<D> up()
{
  Vec<D> axis = Vec<D>::zero();
  axis[D - 1] = 1.0;
  return axis;
}

template <int D> Vec<D> corner(double across, double height)
{
  Vec<D> place;
  for (int a = 0; a < D; ++a) place[a] = a == D - 1 ? height : across;
  return place;
}

/// A layer that fills a box with rollers on its sides and a fixed or smooth bottom, and a body of points on it.
template <int D> struct BodyOnLayer {
  SceneOf<D> scene;
  mpm::LinearElastic<D> law{YOUNG, 0.3};
  mpm::SolverOptions<D> options;
  int num_deformable = 0;

  BodyOnLayer(double width, double height, double room)
  {
    options =
        mpm_test::grid_options_of<D>(corner<D>(0.0, 0.0), corner<D>(width, height + room), CELL);
    for (int side = 0; side < mpm::FACES<D> - 1; ++side)
      options.sides[side] = mpm::SideKind::Roller;
    options.rigid_bodies.resize(1);
    options.rigid_bodies[0].form = BodyForm::Box;
    scene.add_block(corner<D>(0.0, 0.0), corner<D>(width, height), CELL, DENSITY);
    num_deformable = scene.size();
  }
  void add_body(const Vec<D> &lo, const Vec<D> &hi, double density)
  {
    scene.add_block(lo, hi, CELL, density);
    for (int p = num_deformable; p < scene.size(); ++p) scene.rigid_body[p] = 0;
  }
  void set_gravity(const Vec<D> &gravity)
  {
    for (int p = num_deformable; p < scene.size(); ++p)
      for (int a = 0; a < D; ++a) scene.body_force[3 * p + a] = scene.mass[p] * gravity[a];
  }
};

/// Directions and places at random.
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
      // a convex body is on one side of the plane through a point of its surface
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

TEST(RigidShape, LinesEnterAndLeaveAConvexBodyThroughSupportingPlanes)
{
  expect_lines_meet_the_surface<2>(BodyForm::Box);
  expect_lines_meet_the_surface<2>(BodyForm::Ball);
  expect_lines_meet_the_surface<3>(BodyForm::Box);
  expect_lines_meet_the_surface<3>(BodyForm::Ball);
  expect_lines_meet_the_surface<3>(BodyForm::Cylinder);
}

namespace {

/// Material that a rough body encloses, with the given rates of the body about a point that is not its centre.
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

TEST(TurningBody, NodesInARoughBodyHaveItsVelocityAndItsSpin)
{
  const double in_plane[] = {0.05, -0.02, 0.4};
  const double in_space[] = {0.05, -0.02, 0.03, 0.4, -0.3, 0.2};
  expect_enclosed_material_moves_with_body<2>(in_plane);
  expect_enclosed_material_moves_with_body<3>(in_space);
}

TEST(TurningBody, BoxOnTheWholeWidthPressesAsTheBodyWithAFaceDoes)
{
  for (const bool rough : {false, true}) {
    double reaction[2], stress[2];
    for (const BodyForm form : {BodyForm::Face, BodyForm::Box}) {
      BodyOnLayer<2> set(0.4, 0.8, 0.4);
      set.options.rigid_bodies[0].form = form;
      set.options.rigid_bodies[0].rough = rough;
      set.add_body({{0.0, 0.8}}, {{0.4, 1.0}}, DENSITY);
      MpmSolver<2> solver(set.options);
      solver.set_models({&set.law});
      const double rates[] = {0.0, -0.016, 0.0};
      if (form == BodyForm::Face)
        solver.set_body_velocity(0, {{0.0, rates[1]}});
      else
        solver.rigid_bodies().set_rates(0, rates);
      for (int step = 0; step < 300; ++step) solver.step(set.scene.view(), {}, TIME_STEP);
      const int k = form == BodyForm::Face ? 0 : 1;
      reaction[k] = solver.body_reaction(0)[1];
      stress[k] = set.scene.stress[0](1, 1);
    }
    EXPECT_GT(reaction[0], 0.0);
    EXPECT_NEAR(reaction[1], reaction[0], 1e-9 * reaction[0]);
    EXPECT_NEAR(stress[1], stress[0], -1e-9 * stress[0]);
  }
}

namespace {

/// A free body of the layer's width comes to rest on it: M g = E_c A ln(H / (H - u)) for ν = 0 (Hughes-Winget in one dimension).
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

  double least = 1.0;    // force over weight, after the first steps
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

TEST(FreeBody, LighterThanTheMaterialBelowItIsStableToo)
{
  expect_settlement<2>(
      200.0);    // 0.4 high: as heavy as 0.04 of the layer, less than half of the nodes that it rests on
}

namespace {

/// A block on a stiff layer, thrown along it, under a gravity that is inclined by `slope`.
template <int D>
double deceleration_on_plane(double friction, double slope, double speed, bool slides = true)
{
  BodyOnLayer<D> set(1.6, 0.3, 0.5);
  set.options.rigid_bodies[0].rough = false;
  set.options.rigid_bodies[0].friction = friction;
  set.options.rigid_bodies[0].free = D == 2 ? 3 : 7;    // does not tip
  set.options.damping = 0.0;
  set.options.flip = 0.9;
  for (int side = 0; side < mpm::FACES<D> - 1; ++side)
    set.options.sides[side] = mpm::SideKind::Fixed;
  Vec<D> lo = corner<D>(0.6, 0.3), hi = corner<D>(1.0, 0.6);
  lo[0] = 0.2;
  hi[0] = 0.6;
  set.add_body(lo, hi, 8000.0);
  Vec<D> gravity = (-GRAVITY * std::cos(slope)) * up<D>();
  gravity[0] = GRAVITY * std::sin(slope);
  set.set_gravity(gravity);
  for (int p = set.num_deformable; p < set.scene.size(); ++p) set.scene.velocity[3 * p] = speed;
  MpmSolver<D> solver(set.options);
  solver.set_models({&set.law});

  const int settle = 100, steps = 300;
  double start = 0.0;
  for (int step = 0; step < settle + steps; ++step) {
    if (step == settle) start = solver.rigid_bodies().rates(0)[0];
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

TEST(FrictionalContact, BlockOnAnInclineSlidesOrSticksAsCoulombSays)
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

/// A free body that turns flies into a free block.
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
}

TEST(FreeBody, FallsFreelyAndPrecessesWithoutContact)
{
  // torque-free: the angular momentum keeps its direction and size, I ω turns with the body
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
      const double own = 2.0 / 3.0 * 0.05 * 0.05;    // of a cube about any axis, over its mass
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
  // explicit, of the first order: half of (ω dt)² in each step
  for (int a = 0; a < 3; ++a)
    EXPECT_NEAR(after[a], before[a], 1e-3 * std::sqrt(dot(before, before)));
  EXPECT_GT(std::abs(rates[3] - spin[0]), 0.1) << "it precesses";
}

TEST(FreeBody, HingedAtItsFootSwingsLikeAPhysicalPendulum)
{
  // a rod hangs from a pivot at its upper end: small swings have the period 2π sqrt(I / m g d)
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

template <int D> struct RankOutcome {
  std::map<std::int64_t, std::vector<double>> point;
  std::vector<double> numbers;
};

/// A frictional ball or box that forces drive, spinning and tilted, falls on ground with an inclined rough wall, which turns.
template <int D> struct TwoBodies {
  SceneOf<D> scene;
  mpm::SolverOptions<D> options;

  explicit TwoBodies(BodyForm form)
  {
    options = mpm_test::grid_options_of<D>(corner<D>(0.0, 0.0), corner<D>(1.2, 1.2), CELL);
    for (int side = 0; side < mpm::FACES<D> - 1; ++side)
      options.sides[side] = mpm::SideKind::Roller;
    options.damping = 0.05;
    options.flip = 0.99;
    options.rigid_bodies.resize(2);
    mpm::RigidBodyOptions &free = options.rigid_bodies[0], &wall = options.rigid_bodies[1];
    free.form = form;
    free.rough = false;
    free.friction = 0.4;
    free.free = ALL_FREE<D>;
    free.turned[0] = 0.3;
    wall.form = BodyForm::Box;
    wall.separation = true;
    wall.has_pivot = true;
    wall.turned[D == 2 ? 0 : 1] = -0.2;
    scene.add_block(corner<D>(0.0, 0.0), corner<D>(1.2, 0.5), 0.5 * CELL, DENSITY);
    const int ground = scene.size();
    scene.add_block(corner<D>(0.5, 0.5), corner<D>(0.9, 0.8), 0.5 * CELL, DENSITY);
    const int end = scene.size();
    Vec<D> lo = corner<D>(0.2, 0.2), hi = corner<D>(1.0, 0.7);
    lo[0] = 0.1;
    hi[0] = 0.3;
    scene.add_block(lo, hi, CELL, DENSITY);
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < ground ? -1 : p < end ? 0 : 1;
      for (int a = 0; a < D; ++a) scene.velocity[3 * p + a] = 0.05 * std::sin(1.7 * p + a);
      scene.body_force[3 * p + D - 1] = -GRAVITY * scene.mass[p];
    }
  }

  RankOutcome<D> run(SceneOf<D> &points, int steps, int threads,
                     const mpm::Communication &communication) const
  {
    mpm::SolverOptions<D> own = options;
    own.threads = threads;
    mpm::LinearElastic<D> law(YOUNG, 0.3);
    MpmSolver<D> solver(own, communication);
    solver.set_models({&law});
    double rates[mpm::FREEDOMS<D>] = {0.05};
    rates[D == 2 ? 2 : 4] = 0.2;
    solver.rigid_bodies().set_rates(1, rates);
    RankOutcome<D> outcome;
    for (int step = 0; step < steps; ++step) {
      solver.step(points.view(), {}, TIME_STEP);
      for (const int b : {0, 1}) {
        const std::vector<double> record = solver.rigid_bodies().record(b);
        outcome.numbers.insert(outcome.numbers.end(), record.begin(), record.end());
        for (int a = 0; a < D; ++a) outcome.numbers.push_back(solver.body_reaction(b)[a]);
      }
    }
    for (int p = 0; p < points.size(); ++p) {
      std::vector<double> &row = outcome.point[points.id[p]];
      row.assign(&points.position[3 * p], &points.position[3 * p] + 3);
      row.insert(row.end(), &points.velocity[3 * p], &points.velocity[3 * p] + 3);
      row.insert(row.end(), points.stress[p].component, points.stress[p].component + D * D);
    }
    return outcome;
  }
};

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
      std::vector<int> mine;    // slabs in x, in another order
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
}

TEST(TurningBody, ContinuesFromItsRecordToTheBit)
{
  const TwoBodies<2> set(BodyForm::Ball);
  const auto make = [&](mpm::LinearElastic<2> &law) {
    auto solver = std::make_unique<MpmSolver<2>>(set.options);
    solver->set_models({&law});
    const double rates[] = {0.05, 0.0, 0.2};
    solver->rigid_bodies().set_rates(1, rates);
    return solver;
  };
  mpm::LinearElastic<2> law(YOUNG, 0.3);
  mpm_test::Scene whole = set.scene;
  const auto one = make(law);
  for (int step = 0; step < 40; ++step) one->step(whole.view(), {}, TIME_STEP);
  mpm_test::Scene again = set.scene;
  auto first = make(law);
  for (int step = 0; step < 25; ++step) first->step(again.view(), {}, TIME_STEP);

  const auto second = make(law);
  for (const int b : {0, 1})
    second->rigid_bodies().set_record(b, first->rigid_bodies().record(b).data());
  for (int step = 25; step < 40; ++step) second->step(again.view(), {}, TIME_STEP);

  EXPECT_EQ(whole.position, again.position);
  EXPECT_EQ(whole.velocity, again.velocity);
  EXPECT_EQ(one->rigid_bodies().record(0), second->rigid_bodies().record(0));
}

TEST(TurningBody, RefusesWhatItCannotBe)
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
  EXPECT_EQ(message(body), "rigid body block is a cylinder, which needs space");
  body.form = BodyForm::Box;
  body.friction = 0.3;
  EXPECT_EQ(message(body),
            "rigid body block is rough and has a coefficient of friction: one of the two");
  body.rough = false;
  body.friction = -0.1;
  EXPECT_EQ(message(body),
            "rigid body block must have a coefficient of friction of at least 0, got -0.1");
  body.friction = 0.0;
  body.form = BodyForm::Face;
  body.free = 1;
  EXPECT_EQ(message(body),
            "rigid body block presses with one face: forces, friction and turning are for other "
            "forms");
}
