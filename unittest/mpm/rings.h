// SPDX-License-Identifier: GPL-2.0-only
// Axisymmetric points and laws for tests: x is the radius, y the coordinate along the axis.

#pragma once

#include "mpm/axisymmetric_law.h"
#include "mpm/linear_elastic.h"
#include "mpm/mohr_coulomb.h"
#include "rve/core/pi.h"
#include "scene.h"

#include <cmath>
#include <memory>
#include <vector>

namespace mpm_test {

constexpr double TURN = 2.0 * rve::kPi;

/// Makes all points of a plane scene rings: volumes and masses become those of a full turn.
inline void make_rings(Scene &scene)
{
  for (int p = 0; p < scene.size(); ++p) {
    const double turn = TURN * scene.position[3 * p];
    scene.mass[p] *= turn;
    scene.initial_volume[p] *= turn;
    scene.volume[p] *= turn;
  }
}

inline mpm::AxisymmetricLaw elastic_rings(double young, double poisson)
{
  return mpm::AxisymmetricLaw(std::make_shared<mpm::LinearElastic<3>>(young, poisson));
}

inline mpm::SolverOptions<2> ring_options(Vec2 lo, Vec2 hi, double cell_size)
{
  mpm::SolverOptions<2> options = grid_options(lo, hi, cell_size);
  options.axisymmetric = true;
  if (!(lo[0] > 0.0)) options.sides[0] = mpm::SideKind::Roller;
  return options;
}

struct RingMethod {
  mpm::Scheme scheme;
  mpm::ShapeFunction shape;
  bool mean_dilation;
};

/// Returns the fields of all points after some steps of ground under weight and a pressure, into
/// which a disk with friction is pressed. Ranks and threads share the points.
inline std::vector<double> pressed_ground(const RingMethod &method, int ranks, int threads,
                                          mpm::Device device)
{
  Scene whole;
  whole.add_block({{0.0, 0.0}}, {{1.2, 0.8}}, 0.05, 2000.0);
  const int ground = whole.size();
  whole.add_block({{0.0, 0.8}}, {{0.4, 0.9}}, 0.1, 2000.0);
  make_rings(whole);
  for (int p = 0; p < whole.size(); ++p) {
    if (p >= ground) whole.rigid_body[p] = 0;
    whole.velocity[3 * p] = 0.01 * whole.position[3 * p] * std::sin(1.7 * p);
    whole.velocity[3 * p + 1] = 0.01 * std::cos(0.9 * p);
    whole.body_force[3 * p + 1] = -9.81 * whole.mass[p];
    whole.stress[p] = {{-10e3, 0.0, 0.0, -20e3}};
    whole.hoop_stress[p] = -10e3;
  }
  mpm::AxisymmetricLaw law(std::make_shared<mpm::MohrCoulomb<3>>(2e7, 0.3, 5e3, 25.0, 0.0));
  whole.begin_memory(law);
  mpm::SolverOptions<2> options = ring_options({{0.0, 0.0}}, {{1.5, 1.2}}, 0.1);
  options.scheme = method.scheme;
  options.shape = method.shape;
  options.mean_dilation = method.mean_dilation;
  options.flip = 0.99;
  options.threads = threads;
  options.device = device;
  options.sides[static_cast<int>(mpm::Face::YLo)] = mpm::SideKind::Fixed;
  options.dashpots[static_cast<int>(mpm::Face::XHi)] = {100.0, 50.0};
  options.rigid_bodies.resize(1);
  options.rigid_bodies[0].form = mpm::BodyForm::Box;
  options.rigid_bodies[0].rough = false;
  options.rigid_bodies[0].friction = 0.3;
  std::vector<double> fields(14 * whole.size());
  RankTeam team(ranks);
  team.run([&](int rank, const mpm::Communication &communication) {
    std::vector<int> mine;
    for (int p = 0; p < whole.size(); ++p)
      if ((p / 7) % ranks == rank) mine.push_back(p);
    Scene scene = whole.selected(mine);
    mpm::AxisymmetricLaw own = law;
    mpm::MpmSolver<2> solver(options, communication);
    solver.set_models({&own});
    std::vector<mpm::TractionLoad<2>> loads(1);
    loads[0].face = mpm::Face::XHi;
    loads[0].follows = true;
    loads[0].traction = {{-10e3, 0.0}};
    for (int p = 0; p < scene.size(); ++p)
      if (scene.rigid_body[p] < 0 && scene.position[3 * p] > 1.15)
        loads[0].point_index.push_back(p);
    const double rates[] = {0.0, -0.2, 0.0};
    solver.rigid_bodies().set_rates(0, rates);
    for (int step = 0; step < 20; ++step) solver.step(scene.view(), loads, 2e-4);
    solver.fetch(scene.view());
    for (int p = 0; p < scene.size(); ++p) {
      double *to = fields.data() + 14 * (scene.id[p] - 1);
      for (int a = 0; a < 2; ++a) {
        *to++ = scene.position[3 * p + a];
        *to++ = scene.velocity[3 * p + a];
      }
      *to++ = scene.volume[p];
      *to++ = scene.hoop_stress[p];
      for (const double component : scene.stress[p].component) *to++ = component;
      for (const double component : scene.deformation_gradient[p].component) *to++ = component;
    }
  });
  return fields;
}

constexpr RingMethod RING_METHODS[] = {{mpm::Scheme::Musl, mpm::ShapeFunction::Gimp, false},
                                       {mpm::Scheme::Usavg, mpm::ShapeFunction::Cpgimp, true},
                                       {mpm::Scheme::Musl, mpm::ShapeFunction::Cpgimp, false},
                                       {mpm::Scheme::Usavg, mpm::ShapeFunction::Gimp, true}};

}    // namespace mpm_test
