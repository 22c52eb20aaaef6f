// SPDX-License-Identifier: GPL-2.0-only
// Rotating bodies in space against closed forms: blocks on inclines, a wall that rotates about its
// foot, and footings that are pressed by forces.

#include "turning_bodies.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <utility>
#include <vector>

using namespace mpm_test::turning;
using mpm::Face;
using mpm::SideKind;
using Vec3 = mpm::Vec<3>;
using Scene = mpm_test::SceneOf<3>;
using rve::Tensor3;

namespace {

void set(std::vector<double> &rows, int p, const Vec3 &value)
{
  for (int c = 0; c < 3; ++c) rows[3 * p + c] = value[c];
}

Vec3 at(const std::vector<double> &rows, int p)
{
  return {{rows[3 * p], rows[3 * p + 1], rows[3 * p + 2]}};
}

/// Frame of an inclined face. The third axis is the normal, inclined by `slope` to the vertical.
/// The first axis points down the slope; its direction seen from above is `azimuth`.
struct Incline {
  double slope, azimuth;

  Vec3 down() const
  {
    return {{std::cos(slope) * std::cos(azimuth), std::cos(slope) * std::sin(azimuth),
             -std::sin(slope)}};
  }
  Vec3 across() const { return {{-std::sin(azimuth), std::cos(azimuth), 0.0}}; }
  Vec3 normal() const { return cross(down(), across()); }
  Vec3 place(const Vec3 &local) const
  {
    return local[0] * down() + local[1] * across() + local[2] * normal();
  }
  /// Sets the rotation vector of a body to the axes of this frame by the inverse of Rodrigues'
  /// formula.
  void turn(mpm::RigidBodyOptions &body) const
  {
    const Vec3 x = down(), y = across(), z = normal();
    const double angle = std::acos(0.5 * (x[0] + y[1] + z[2] - 1.0));
    const double factor = angle / (2.0 * std::sin(angle));
    const double axis[] = {y[2] - z[1], z[0] - x[2], x[1] - y[0]};
    for (int k = 0; k < 3; ++k) body.turned[k] = factor * axis[k];
  }
};

/// An elastic block that slides on a body with an inclined upper face of 1.2 by 0.8.
struct BlockOnInclinedBody {
  static constexpr double YOUNG = 10e6;
  Incline incline;
  Vec3 acceleration;    ///< mean acceleration of the block

  BlockOnInclinedBody(double friction, double slope, double speed, BodyForm form) :
      incline{slope, 0.5}
  {
    const Vec3 middle = {{0.8, 0.8, 0.5}};    // middle of the face
    const Vec3 lo = {{-0.6, -0.4, -0.3}}, hi = {{0.6, 0.4, 0.0}};
    Scene local, scene;
    local.add_block({{-0.5, -0.2, 0.0}}, {{-0.1, 0.2, 0.2}}, 0.5 * CELL, DENSITY);
    const int block = local.size();
    local.add_block(lo, hi, CELL, DENSITY);
    for (int p = 0; p < local.size(); ++p) {
      scene.add(middle + incline.place(at(local.position, p)), local.half_size[p], DENSITY);
      scene.rigid_body[p] = p < block ? -1 : 0;
      if (p >= block) continue;
      set(scene.velocity, p, speed * incline.down());
      scene.body_force[3 * p + 2] = -GRAVITY * scene.mass[p];
    }
    mpm::SolverOptions<3> options =
        mpm_test::grid_options_of<3>({{0.0, 0.0, 0.0}}, {{1.6, 1.6, 1.2}}, CELL);
    options.flip = 0.9;
    options.rigid_bodies.resize(1);
    options.rigid_body_vertices.resize(1);
    mpm::RigidBodyOptions &body = options.rigid_bodies[0];
    body.form = form;
    body.rough = false;
    body.friction = friction;
    body.separation = true;
    incline.turn(body);
    for (const Vec3 &corner : corners_of_box<3>(lo, hi))
      options.rigid_body_vertices[0].push_back(middle + incline.place(corner));
    mpm::LinearElastic<3> law(YOUNG, 0.3);
    MpmSolver<3> solver(options);
    solver.set_models({&law});
    const int synchronise = 100, steps = 200;
    Vec3 start = Vec3::zero();
    for (int step = 0; step < synchronise + steps; ++step) {
      if (step == synchronise) start = solver.totals(scene.view()).momentum;
      solver.step(scene.view(), {}, TIME_STEP);
    }
    const mpm::Totals<3> end = solver.totals(scene.view());
    acceleration = (1.0 / (end.mass * steps * TIME_STEP)) * (end.momentum - start);
  }
  double down() const { return dot(acceleration, incline.down()); }
};

}    // namespace

TEST(InclinedBody, ElasticBlockSlidesOrSticksByCoulombFriction)
{
  // The face is inclined by 0.4 about an axis oblique to the grid.
  const double slope = 0.4, along = GRAVITY * std::sin(slope), across = GRAVITY * std::cos(slope);
  const double slippery = 0.2, sticky = 0.6;    // tan 0.4 = 0.42
  for (const BodyForm form : {BodyForm::Box, BodyForm::Convex}) {
    const BlockOnInclinedBody slides(slippery, slope, 0.5, form), sticks(sticky, slope, 0.0, form),
        smooth(0.0, slope, 0.5, form);
    printf("elastic block on an inclined body: %.4f (%.4f), sticks %.1e, smooth %.6f (%.6f)\n",
           slides.down(), along - slippery * across, sticks.down(), smooth.down(), along);
    EXPECT_NEAR(slides.down(), along - slippery * across, 0.01 * slippery * across)
        << "it bounces a little: the mean of the normal force is not quite the weight";
    EXPECT_NEAR(sticks.down(), 0.0, 1e-3 * along);
    EXPECT_NEAR(smooth.down(), along, 1e-10 * along)
        << "normals are those of the face, not of the grid";
    for (const BlockOnInclinedBody *block : {&slides, &sticks, &smooth}) {
      EXPECT_NEAR(dot(block->acceleration, block->incline.across()), 0.0, 1e-3 * along);
      EXPECT_NEAR(dot(block->acceleration, block->incline.normal()), 0.0, 0.01 * across)
          << "it neither sinks in nor takes off";
    }
  }
}

namespace {

/// Returns the mean acceleration of a block that is thrown along a layer. `form` is the form of the
/// block as a body. Gravity is inclined by `slope` towards `along`.
Vec3 acceleration_on_layer(BodyForm form, double friction, double slope, const Vec3 &along,
                           double speed, double damping = 0.0)
{
  BodyOnLayer<3> set_up(1.2, 0.3, 0.5);
  set_up.options.damping = damping;
  mpm::RigidBodyOptions &body = set_up.options.rigid_bodies[0];
  body.form = form;
  body.rough = false;
  body.friction = friction;
  body.free = 7;    // prevents tipping
  set_up.options.flip = 0.9;
  for (int side = 0; side < 5; ++side) set_up.options.sides[side] = SideKind::Fixed;
  const Vec3 lo = {{0.2, 0.2, 0.3}}, hi = {{0.8, 0.8, 0.6}};
  set_up.options.rigid_body_vertices = {corners_of_box<3>(lo, hi)};
  set_up.add_body(lo, hi, 8000.0);
  set_up.set_gravity(GRAVITY * std::sin(slope) * along - GRAVITY * std::cos(slope) * up<3>());
  for (int p = set_up.num_deformable; p < set_up.scene.size(); ++p)
    set(set_up.scene.velocity, p, speed * along);
  MpmSolver<3> solver(set_up.options);
  solver.set_models({&set_up.law});
  const auto velocity = [&] {
    const double *rates = solver.rigid_bodies().rates(0);
    return Vec3{{rates[0], rates[1], rates[2]}};
  };
  const int synchronise = 100, steps = 200;
  Vec3 start = Vec3::zero();
  for (int step = 0; step < synchronise + steps; ++step) {
    if (step == synchronise) start = velocity();
    solver.step(set_up.scene.view(), {}, TIME_STEP);
  }
  return (1.0 / (steps * TIME_STEP)) * (velocity() - start);
}

}    // namespace

TEST(DrivenBlockInSpace, SlidesDownAnInclineInAnyDirectionByCoulombFriction)
{
  const double slope = 0.4;
  const Vec3 along = {{std::cos(0.6), std::sin(0.6), 0.0}}, aside = {{-along[1], along[0], 0.0}};
  const double down = GRAVITY * std::sin(slope), weight = GRAVITY * std::cos(slope);
  for (const BodyForm form : {BodyForm::Box, BodyForm::Cylinder, BodyForm::Convex}) {
    const Vec3 slides = acceleration_on_layer(form, 0.2, slope, along, 1.0);
    const Vec3 sticks = acceleration_on_layer(form, 0.6, slope, along, 0.0, 0.3);
    printf("driven block: %.4f (%.4f), sticks %.3f of %.3f\n", dot(slides, along),
           down - 0.2 * (weight + slides[2]), dot(sticks, along), down);
    // The block still oscillates vertically, so that its normal force is its weight plus its mass
    // times the vertical acceleration.
    EXPECT_NEAR(dot(slides, along), down - 0.2 * (weight + slides[2]), 1e-3 * down);
    EXPECT_NEAR(dot(slides, aside), 0.0, 1e-3 * down);
    EXPECT_NEAR(dot(sticks, along), 0.0, 0.05 * down)
        << "it swings on the elastic layer, on which its weight is all at once";
    EXPECT_NEAR(dot(sticks, aside), 0.0, 3e-3 * down);
  }
}

namespace {

/// A wall that rotates about its foot and compresses the end of an elastic bar between two smooth
/// walls. The foot is a line through `origin` along an axis of the grid. The other end of the bar
/// is on a plane of symmetry; its top and bottom are free.
struct WallThatTurns {
  static constexpr double LENGTH = 1.0, HEIGHT = 1.0, YOUNG = 1e6, ANGLE = 1e-3;
  double moment, force, work, energy;    ///< ratios to the closed form
  double
      along_foot;    ///< moment about the other axes through the middle of the wall, over `moment`

  /// Runs the test; `hinge` is the axis of the grid along the foot.
  WallThatTurns(int cells, int hinge, BodyForm form)
  {
    // axes of the grid: x of the bar, along the foot, up
    const int x = (hinge + 2) % 3, y = hinge, z = (hinge + 1) % 3;
    const auto place = [&](double along, double width, double height) {
      Vec3 p;
      p[x] = along;
      p[y] = width;
      p[z] = height;
      return p;
    };
    const double h = HEIGHT / cells, width = 2.0 * h, foot = 2.0 * h;
    Scene scene;
    scene.add_block(place(0.0, 0.0, foot), place(LENGTH, width, foot + HEIGHT), 0.5 * h, DENSITY);
    const int bar = scene.size();
    const Vec3 lo = place(LENGTH, 0.0, 0.0),
               hi = place(LENGTH + 2.0 * h, width, HEIGHT + 2.0 * foot);
    scene.add_block(lo, hi, h, DENSITY);
    for (int p = bar; p < scene.size(); ++p) scene.rigid_body[p] = 0;
    mpm::SolverOptions<3> options = mpm_test::grid_options_of<3>(
        Vec3::zero(), place(LENGTH + 4.0 * h, width, HEIGHT + 2.0 * foot), h);
    options.sides.fill(SideKind::Roller);
    options.sides[2 * x + 1] = options.sides[2 * z] = options.sides[2 * z + 1] = SideKind::Free;
    options.damping = 0.1;
    options.rigid_bodies.resize(1);
    options.rigid_body_vertices = {corners_of_box<3>(lo, hi)};
    mpm::RigidBodyOptions &body = options.rigid_bodies[0];
    body.form = form;
    body.rough = false;
    body.has_pivot = true;
    std::copy_n(place(LENGTH, 0.5 * width, foot).component, 3, body.pivot);
    mpm::LinearElastic<3> law(YOUNG, 0.0);
    MpmSolver<3> solver(options);
    solver.set_models({&law});
    const double dt = 0.4 * h / std::sqrt(YOUNG / DENSITY);
    const int steps = 60 * cells;    // 24 passages of a wave, half of them while the wall turns
    double done = 0.0;
    for (int step = 0; step < steps; ++step) {
      double rates[6] = {};
      rates[3 + y] = step < steps / 2 ? -ANGLE / (0.5 * steps * dt) : 0.0;
      solver.rigid_bodies().set_rates(0, rates);
      solver.step(scene.view(), {}, dt);
      done -= dt * rates[3 + y] * solver.body_torque(0)[y];
    }
    double stored = 0.0;    // ν = 0
    for (int p = 0; p < bar; ++p)
      for (const double s : scene.stress[p].component)
        stored += 0.5 * scene.volume[p] * s * s / YOUNG;
    const double exact = YOUNG * ANGLE / LENGTH * width * HEIGHT * HEIGHT * HEIGHT / 3.0;
    const Vec3 torque = solver.body_torque(0), reaction = solver.body_reaction(0);
    moment = torque[y] / exact;
    force = reaction[x] / (YOUNG * ANGLE / LENGTH * width * HEIGHT * HEIGHT / 2.0);
    work = done / (0.5 * exact * ANGLE);
    energy = stored / (0.5 * exact * ANGLE);
    along_foot = std::max(std::abs(torque[x]), std::abs(torque[z])) / exact;
  }
};

}    // namespace

TEST(WallThatTurnsAboutItsFoot, HasTheMomentOfABentBar)
{
  // For ν = 0 bending is exact. The wall rotates by θ about the edge of the bar's end, so that ε =
  // θ z/L and σ = E θ z/L, without shear. With the width b, the height H and the length L of the
  // bar, the force is F = E θ b H²/(2L), and the moment about the foot is M = E θ b H³/(3L). The
  // work of the wall, M θ/2, is the energy of the bar.
  const WallThatTurns coarse(5, 1, BodyForm::Box), fine(10, 1, BodyForm::Box);
  for (const WallThatTurns *wall : {&coarse, &fine}) {
    printf("wall that turns: moment %.4f, force %.4f, work %.4f, energy %.4f of the closed form\n",
           wall->moment, wall->force, wall->work, wall->energy);
    EXPECT_NEAR(wall->work, wall->energy, 0.015) << "1 %: what damping took";
    EXPECT_GT(wall->work, wall->energy);
    EXPECT_NEAR(wall->along_foot, 0.0, 1e-9);
  }
  EXPECT_NEAR(coarse.moment, 1.0, 0.02) << "1.3 %, 0.1 % with ten cells";
  EXPECT_NEAR(coarse.force, 1.0, 0.02);
  EXPECT_NEAR(fine.moment, 1.0, 0.003);
  EXPECT_NEAR(fine.force, 1.0, 0.003);
  EXPECT_NEAR(fine.energy, 1.0, 0.003);
  // The foot is along the other axes, and the wall has vertices.
  for (const auto &[hinge, form] :
       {std::pair(0, BodyForm::Box), {2, BodyForm::Box}, {1, BodyForm::Convex}}) {
    const WallThatTurns other(5, hinge, form);
    EXPECT_NEAR(other.moment, coarse.moment, 1e-9);
    EXPECT_NEAR(other.force, coarse.force, 1e-9);
  }
}

namespace {

/// Water in front of a smooth wall. The wall is inclined by `slope` about its foot, away from the
/// water. The members are ratios to the closed form, with the specific weight γ, the width b and
/// the depth H of the water. The horizontal force is γ b H²/2. The vertical force is tan(slope) γ b
/// H²/2, downwards on the wall. The moment about the foot is γ b H³/(6 cos²(slope)).
struct WaterBehindWall {
  double across, upwards, moment;

  WaterBehindWall(int cells, double slope)
  {
    const double depth = 1.0, foot = 1.0, weight = 1e4, h = depth / cells, width = 2.0 * h;
    Scene scene;
    scene.add_block({{0.0, 0.0, 0.0}}, {{foot + 0.5 * depth, width, depth}}, 0.5 * h,
                    weight / GRAVITY,
                    [&](double x, double, double z) { return x < foot + std::tan(slope) * z; });
    const int water = scene.size();
    const Vec3 out = {{std::cos(slope), 0.0, -std::sin(slope)}},
               up_wall = {{std::sin(slope), 0.0, std::cos(slope)}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 2; ++j)
        for (int k = -cells / 2; k < 2 * cells; ++k)
          scene.add(Vec3{{foot, (j + 0.5) * h, 0.0}} + (i + 0.5) * h * out +
                        (k + 0.5) * h * up_wall,
                    {{0.5 * h, 0.5 * h, 0.5 * h}}, DENSITY);
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < water ? -1 : 0;
      if (p >= water) continue;
      scene.stress[p] = (-weight * (depth - scene.position[3 * p + 2])) * Tensor3::identity();
      scene.body_force[3 * p + 2] = -GRAVITY * scene.mass[p];
    }
    mpm::SolverOptions<3> options = mpm_test::grid_options_of<3>(
        Vec3::zero(), {{foot + depth + 4.0 * h, width, depth + 4.0 * h}}, h);
    options.sides.fill(SideKind::Roller);
    options.sides[1] = options.sides[5] = SideKind::Free;
    options.damping = 0.3;
    options.rigid_bodies.resize(1);
    mpm::RigidBodyOptions &body = options.rigid_bodies[0];
    body.form = BodyForm::Box;
    body.rough = false;
    body.separation = true;
    body.has_pivot = true;
    body.pivot[0] = foot;
    body.turned[1] = slope;
    mpm::LinearElastic<3> law(1e7, 0.3);
    MpmSolver<3> solver(options);
    solver.set_models({&law});
    const double dt = 0.3 * h / std::sqrt(1.4e7 / (weight / GRAVITY));
    for (int step = 0; step < 100; ++step) solver.step(scene.view(), {}, dt);
    const double c = std::cos(slope), force = weight * depth * depth * width / 2.0;
    across = solver.body_reaction(0)[0] / force;
    upwards = slope == 0.0 ? -solver.body_reaction(0)[2] / force
                           : -solver.body_reaction(0)[2] / (force * std::tan(slope));
    moment = solver.body_torque(0)[1] / (force * depth / (3.0 * c * c));
  }
};

}    // namespace

TEST(InclinedWall, HasTheForceAndTheMomentOfWaterAboutItsFoot)
{
  // Pressures γ (H - z) on a face inclined by β have the resultants γ H²/2 horizontally, tan β γ
  // H²/2 downwards, and the moment γ H³/(6 cos² β) about the foot.
  const WaterBehindWall vertical(6, 0.0);
  EXPECT_NEAR(vertical.across, 1.0, 1e-9);
  EXPECT_NEAR(vertical.upwards, 0.0, 1e-9);
  EXPECT_NEAR(vertical.moment, 1.0, 0.005) << "pressures of points vary by steps: 1/8 n²";
  const WaterBehindWall coarse(6, 0.3), fine(12, 0.3);
  for (const WaterBehindWall *wall : {&coarse, &fine})
    printf("water behind an inclined wall: force %.4f, vertical %.4f, moment %.4f\n", wall->across,
           wall->upwards, wall->moment);
  EXPECT_NEAR(coarse.across, 1.0, 0.01);
  EXPECT_NEAR(fine.across, 1.0, 0.01);
  EXPECT_NEAR(fine.moment, 1.0, 0.01) << "2.4 % with half as many cells";
  // At the lowest nodes, the lower side of the grid bears a part of the load of the wall. The wall
  // lacks the load of about half a cell under the full pressure, which is 1/cells of its load.
  for (const auto &[wall, cells] : {std::pair(&coarse, 6), {&fine, 12}}) {
    EXPECT_LT(wall->upwards, 1.0);
    EXPECT_GT(wall->upwards, 1.0 - 1.1 / cells);
  }
}

namespace {

/// A smooth rigid footing of the half width or radius `half` [cells], pressed on ground by an
/// eccentric force. The ground is 9 cells deep and ends at a plane of symmetry through the footing.
struct PressedFooting {
  static constexpr double YOUNG = 1e6, POISSON = 0.25;
  static constexpr int DEPTH = 9;
  /// reactions of the footing and of the ground, divided by the applied force and moment
  double force, moment, ground;
  double vertical, rocking;    ///< F/(E a u) (1 - ν²) and M/(E a³ θ) (1 - ν²)

  PressedFooting(BodyForm form, double half, int steps)
  {
    Scene scene;
    scene.add_block({{-DEPTH, 0.0, 0.0}}, {{DEPTH, DEPTH, DEPTH}}, 1.0, DENSITY);
    const int soil = scene.size();
    const double r = half - 0.5, load = 8000.0, eccentricity = 0.5;
    for (const double x : {-r, r})
      for (const double y : {-r, r})    // one half is beyond the plane of symmetry
        for (const double z : {0.5, 1.5})
          scene.add({{x, y, DEPTH + z}}, {{0.5, 0.5, 0.5}}, 5.0 * DENSITY);
    for (int p = soil; p < scene.size(); ++p) {
      scene.rigid_body[p] = 0;
      scene.body_force[3 * p + 2] =
          -0.125 * load * (1.0 + scene.position[3 * p] / r * eccentricity / r);
    }
    mpm::SolverOptions<3> options =
        mpm_test::grid_options_of<3>({{-DEPTH, 0.0, 0.0}}, {{DEPTH, DEPTH, DEPTH + 3.0}}, 1.0);
    options.sides.fill(SideKind::Roller);
    options.sides[5] = SideKind::Free;
    options.damping = 0.3;
    options.rigid_bodies.resize(1);
    options.rigid_body_vertices = {
        corners_of_box<3>({{-half, -half, DEPTH}}, {{half, half, DEPTH + 2.0}})};
    mpm::RigidBodyOptions &body = options.rigid_bodies[0];
    body.form = form;
    body.rough = false;
    body.free = 1 << 2 | 1 << 4;    // can sink and tilt about y
    mpm::LinearElastic<3> law(YOUNG, POISSON);
    MpmSolver<3> solver(options);
    solver.set_models({&law});
    const double dt = 0.4 / std::sqrt(1.2 * YOUNG / DENSITY);
    for (int step = 0; step < steps; ++step) solver.step(scene.view(), {}, dt);
    force = solver.body_reaction(0)[2] / load;
    moment = -solver.body_torque(0)[1] / (load * eccentricity);
    ground = -solver.side_reaction(Face::ZLo)[2] / load;
    const double modulus = 0.5 * YOUNG / (1.0 - POISSON * POISSON);    // modulus for one half
    vertical = load / (modulus * half * (DEPTH + 1.0 - solver.rigid_bodies().origin(0)[2]));
    rocking =
        load * eccentricity / (modulus * half * half * half * solver.rigid_bodies().turned(0)[1]);
  }
};

}    // namespace

TEST(PressedFooting, SettlesAndTiltsUnderAnEccentricForce)
{
  // On a half space a square has F (1 - ν²)/(E a u) = 2.31 and M (1 - ν²)/(E a³ θ) = 2.0, with the
  // half width a, the settlement u and the rotation θ (Pais & Kausel 1988). On ground of the depth
  // d, both values increase by the factors 1 + 1.28 a/d and 1 + 0.17 a/d (for a circle: Kausel
  // 1974). A line of nodes touches the footing if it is more than a quarter of a cell inside its
  // edge.
  const double half = 3.26;
  const PressedFooting square(BodyForm::Box, half, 600);
  printf("square footing: force %.5f, moment %.5f, ground %.4f, vertical %.3f, rocking %.3f\n",
         square.force, square.moment, square.ground, square.vertical, square.rocking);
  EXPECT_NEAR(square.force, 1.0, 1e-3) << "at rest";
  EXPECT_NEAR(square.moment, 1.0, 1e-3);
  EXPECT_NEAR(square.ground, 1.0, 0.02) << "damping holds what is on its way";
  const double least = (half - 0.26) / half;    // as if the footing ended at its last nodes
  const double vertical = 2.31 * (1.0 + 1.28 * half / PressedFooting::DEPTH);
  const double rocking = 2.0 * (1.0 + 0.17 * half / PressedFooting::DEPTH);
  EXPECT_LT(square.vertical, vertical);
  EXPECT_GT(square.vertical, least * vertical);
  EXPECT_LT(square.rocking, rocking);
  EXPECT_GT(square.rocking, least * least * least * rocking);
  for (const BodyForm form : {BodyForm::Cylinder, BodyForm::Convex}) {
    const PressedFooting other(form, half, 300);
    printf("pressed footing: force %.5f, moment %.5f, vertical %.3f, rocking %.3f\n", other.force,
           other.moment, other.vertical, other.rocking);
    EXPECT_NEAR(other.force, 1.0, 0.005);
    EXPECT_NEAR(other.moment, 1.0, 0.005);
  }
}

TEST(PressedFooting, BoxAndCylinderAgreeWithBodiesWithAFace)
{
  // A line of nodes touches a box if it is more than a quarter of a cell inside the edge. It
  // touches a body with a face if it is at the edge or inside.
  constexpr int DEPTH = 9, HALF = 3;
  for (const bool round : {false, true}) {
    double force[2];
    for (const bool turns : {false, true}) {
      const double half = turns ? HALF + 0.26 : HALF;
      Scene scene;
      scene.add_block({{0.0, 0.0, 0.0}}, {{DEPTH, DEPTH, DEPTH}}, 1.0, DENSITY);
      const int soil = scene.size();
      for (const double place : {0.5 - half, half - 0.5})
        for (const double height : {0.5, 1.5})
          scene.add({{place, place, DEPTH + height}}, {{0.5, 0.5, 0.5}}, DENSITY);
      for (int p = soil; p < scene.size(); ++p) scene.rigid_body[p] = 0;
      mpm::SolverOptions<3> options =
          mpm_test::grid_options_of<3>(Vec3::zero(), {{DEPTH, DEPTH, DEPTH + 3.0}}, 1.0);
      options.sides.fill(SideKind::Roller);
      options.sides[5] = SideKind::Free;
      options.damping = 0.1;
      options.rigid_bodies.resize(1);
      mpm::RigidBodyOptions &body = options.rigid_bodies[0];
      body.face = Face::ZLo;
      body.rough = false;
      if (turns)
        body.form = round ? BodyForm::Cylinder : BodyForm::Box;
      else
        body.round = round;
      mpm::LinearElastic<3> law(1e6, 0.25);
      MpmSolver<3> solver(options);
      solver.set_models({&law});
      const double rates[6] = {0.0, 0.0, -1e-3};
      if (turns)
        solver.rigid_bodies().set_rates(0, rates);
      else
        solver.set_body_velocity(0, {{0.0, 0.0, rates[2]}});
      for (int step = 0; step < 100; ++step) solver.step(scene.view(), {}, 0.015);
      force[turns] = solver.body_reaction(0)[2];
    }
    EXPECT_GT(force[0], 1e3);
    EXPECT_NEAR(force[1], force[0], 1e-9 * force[0]) << (round ? "round" : "square");
  }
}

namespace {

/// A ball with a radius of four cells on a layer, with gravity inclined by `slope` once it rests.
struct BallOnLayer {
  static constexpr double RADIUS = 0.4;
  /// mean acceleration of its centre [m/s²] and about the axis of rolling [1/s²]
  double acceleration, spin;
  double normal;     ///< mean normal force, divided by the mass [m/s²]
  double inertia;    ///< moment of inertia, divided by m R² [-]

  BallOnLayer(double friction, double slope)
  {
    const double half = 0.5 * CELL;
    const Vec3 middle = {{1.5 * RADIUS, 0.0, 0.3 + RADIUS}};
    Scene scene;
    scene.add_block({{0.0, 0.0, 0.0}}, {{2.0, 0.5, 0.3}}, CELL, DENSITY);
    const int layer = scene.size();
    const Vec3 corner = {{RADIUS, RADIUS, RADIUS}};
    scene.add_block(middle - corner, middle + corner, half, 6000.0,
                    [&](double x, double y, double z) {
                      const Vec3 arm = Vec3{{x, y, z}} - middle;
                      return dot(arm, arm) < RADIUS * RADIUS;
                    });
    double mass = 0.0, moment = 0.0;
    for (int p = layer; p < scene.size(); ++p) {
      scene.rigid_body[p] = 0;
      const Vec3 arm = at(scene.position, p) - middle;
      mass += scene.mass[p];
      moment += scene.mass[p] * (arm[0] * arm[0] + arm[2] * arm[2] + half * half / 6.0);
    }
    inertia = moment / (mass * RADIUS * RADIUS);
    const auto pull = [&](double along) {
      for (int p = layer; p < scene.size(); ++p)
        set(scene.body_force, p, GRAVITY * scene.mass[p] * Vec3{{along, 0.0, -std::cos(slope)}});
    };
    mpm::SolverOptions<3> options =
        mpm_test::grid_options_of<3>(Vec3::zero(), {{2.0, 0.5, 1.6}}, CELL);
    options.sides.fill(SideKind::Roller);    // y = 0 is a plane of symmetry
    options.sides[4] = SideKind::Fixed;
    options.sides[5] = SideKind::Free;
    options.flip = 0.9;
    options.damping = 0.7;
    options.rigid_bodies.resize(1);
    mpm::RigidBodyOptions &body = options.rigid_bodies[0];
    body.form = BodyForm::Ball;
    body.rough = false;
    body.friction = friction;
    body.free = 1 | 1 << 2 | 1 << 4;    // in the plane
    mpm::LinearElastic<3> law(YOUNG, 0.3);
    pull(0.0);
    MpmSolver<3> damped(options);
    damped.set_models({&law});
    for (int step = 0; step < 300; ++step) damped.step(scene.view(), {}, TIME_STEP);

    options.damping = 0.0;
    MpmSolver<3> solver(options);
    solver.set_models({&law});
    solver.rigid_bodies().set_record(0, damped.rigid_bodies().record(0).data());
    pull(std::sin(slope));
    const int synchronise = 100, steps = 300;
    double sum = 0.0, before[2] = {};
    const double *rates = nullptr;
    for (int step = 0; step < synchronise + steps; ++step) {
      solver.step(scene.view(), {}, TIME_STEP);
      rates = solver.rigid_bodies().rates(0);
      if (step < synchronise) {
        before[0] = rates[0];
        before[1] = rates[4];
      } else {
        sum += solver.body_reaction(0)[2];
      }
    }
    acceleration = (rates[0] - before[0]) / (steps * TIME_STEP);
    spin = (rates[4] - before[1]) / (steps * TIME_STEP);
    normal = sum / (steps * mass);
  }
};

}    // namespace

TEST(Ball, GlidesSlidesOrRollsDownAnInclineByCoulombFriction)
{
  // Without friction the acceleration is g sin β. With sliding friction it is g sin β - μ N/m, and
  // the spin grows by μ N R/I. A rolling ball has g sin β/(1 + I/m R²).
  const double slope = 0.3, down = GRAVITY * std::sin(slope);
  const BallOnLayer glides(0.0, slope), slides(0.06, slope), rolls(0.6, slope);
  const double sliding = down - 0.06 * slides.normal;
  const double spinning = 0.06 * slides.normal / (slides.inertia * BallOnLayer::RADIUS);
  const double rolling = down / (1.0 + rolls.inertia);
  printf("ball: glides %.3f (%.3f), slides %.3f (%.3f) spin %.3f (%.3f), rolls %.3f (%.3f) spin "
         "%.3f\n",
         glides.acceleration, down, slides.acceleration, sliding, slides.spin, spinning,
         rolls.acceleration, rolling, rolls.spin);
  EXPECT_NEAR(glides.spin, 0.0, 1e-9);
  EXPECT_NEAR(glides.acceleration, down, 0.03 * down) << "it rests on a few lines of nodes";
  EXPECT_NEAR(slides.acceleration, sliding, 0.03 * sliding);
  EXPECT_NEAR(slides.spin, spinning, 0.03 * spinning);
  EXPECT_NEAR(rolls.acceleration, rolling, 0.15 * rolling) << "on its way of half a cell";
  EXPECT_GT(rolls.spin, 1.1 * slides.spin);
}
