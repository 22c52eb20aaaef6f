// SPDX-License-Identifier: GPL-2.0-only
// Rotating bodies for tests: a body on a layer, and a scene with all features of rotating bodies.

#pragma once

#include "scene.h"

#include <cmath>
#include <map>
#include <memory>
#include <vector>

namespace mpm_test::turning {

using mpm::BodyForm;
using mpm::MpmSolver;
using mpm::Vec;

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

/// A layer with a body of points on it. The layer fills a box with rollers on its sides and a fixed
/// or smooth bottom.
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

/// Returns the corners of a box.
template <int D> std::vector<Vec<D>> corners_of_box(const Vec<D> &lo, const Vec<D> &hi)
{
  std::vector<Vec<D>> corners;
  for (int corner = 0; corner < 1 << D; ++corner) {
    Vec<D> place;
    for (int a = 0; a < D; ++a) place[a] = corner >> a & 1 ? hi[a] : lo[a];
    corners.push_back(place);
  }
  return corners;
}

/// Returns the middles of the faces of a box, which are the corners of a rhombus or an octahedron.
template <int D> std::vector<Vec<D>> middles_of_faces(const Vec<D> &lo, const Vec<D> &hi)
{
  std::vector<Vec<D>> middles;
  for (int face = 0; face < 2 * D; ++face) {
    middles.push_back(0.5 * (lo + hi));
    middles.back()[face / 2] = face % 2 == 0 ? lo[face / 2] : hi[face / 2];
  }
  return middles;
}

template <int D> struct RankOutcome {
  std::map<std::int64_t, std::vector<double>> point;
  std::vector<double> numbers;
};

/// A tilted and spinning ball or box with friction that falls on ground and is moved by forces. The
/// ground has an inclined rough wall, which rotates.
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
    options.rigid_body_vertices = {middles_of_faces(corner<D>(0.45, 0.35), corner<D>(0.95, 0.9)),
                                   {}};
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < ground ? -1 : p < end ? 0 : 1;
      for (int a = 0; a < D; ++a) scene.velocity[3 * p + a] = 0.05 * std::sin(1.7 * p + a);
      scene.body_force[3 * p + D - 1] = -GRAVITY * scene.mass[p];
    }
  }

  RankOutcome<D> run(SceneOf<D> &points, int steps, int threads,
                     const mpm::Communication &communication,
                     mpm::Device device = mpm::Device::Cpu) const
  {
    mpm::SolverOptions<D> own = options;
    own.threads = threads;
    own.device = device;
    mpm::LinearElastic<D> law(YOUNG, 0.3);
    const auto solver = make_solver(law, own, communication);
    RankOutcome<D> outcome;
    for (int step = 0; step < steps; ++step) {
      solver->step(points.view(), {}, TIME_STEP);
      for (const int b : {0, 1}) {
        const std::vector<double> record = solver->rigid_bodies().record(b);
        outcome.numbers.insert(outcome.numbers.end(), record.begin(), record.end());
        for (int a = 0; a < D; ++a) outcome.numbers.push_back(solver->body_reaction(b)[a]);
      }
    }
    solver->fetch(points.view());
    for (int p = 0; p < points.size(); ++p) {
      std::vector<double> &row = outcome.point[points.id[p]];
      row.assign(&points.position[3 * p], &points.position[3 * p] + 3);
      row.insert(row.end(), &points.velocity[3 * p], &points.velocity[3 * p] + 3);
      row.insert(row.end(), points.stress[p].component, points.stress[p].component + D * D);
    }
    return outcome;
  }

  std::unique_ptr<MpmSolver<D>> solver(mpm::LinearElastic<D> &law) const
  {
    return make_solver(law, options, {});
  }

 private:
  static std::unique_ptr<MpmSolver<D>> make_solver(mpm::LinearElastic<D> &law,
                                                   const mpm::SolverOptions<D> &options,
                                                   const mpm::Communication &communication)
  {
    auto solver = std::make_unique<MpmSolver<D>>(options, communication);
    solver->set_models({&law});
    double rates[mpm::FREEDOMS<D>] = {0.05};
    rates[D == 2 ? 2 : 4] = 0.2;
    solver->rigid_bodies().set_rates(1, rates);
    return solver;
  }
};

}    // namespace mpm_test::turning
