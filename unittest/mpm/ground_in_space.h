// SPDX-License-Identifier: GPL-2.0-only
// Ground in space with all features of a step: two laws, a square footing, a plate in the ground,
// two tractions, gravity, initial stress, irregular velocities and all kinds of sides. The scene
// has no symmetry.

#pragma once

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <array>
#include <utility>
#include <vector>

namespace mpm_test {

struct GroundInSpace {
  static constexpr double CELL = 0.1, STEP = 4e-4;
  static constexpr int FOOTING = 0, PLATE = 1, NUM_BODIES = 2;
  static constexpr mpm::Vec<3> LO = {{0.0, 0.0, -0.03}}, HI = {{0.9, 0.8, 0.77}};
  static constexpr double SURFACE = 0.5;

  struct Method {
    mpm::Scheme scheme = mpm::Scheme::Musl;
    mpm::ShapeFunction shape = mpm::ShapeFunction::Gimp;
    double damping = 0.0, flip = 1.0;
    bool rough = true, separation = false, round = false;
  };

  SceneOf<3> scene;
  mpm::SolverOptions<3> options = grid_options_of<3>(LO, HI, CELL);
  std::vector<mpm::TractionLoad<3>> loads;
  std::vector<mpm::Vec<3>> body_velocity = {{{0.03, -0.02, -0.3}}, {{0.1, 0.05, 0.04}}};
  mpm::LinearElastic<3> elastic{10e6, 0.3};
  mpm::MohrCoulomb<3> frictional{10e6, 0.3, 2e3, 30.0, 5.0};

  explicit GroundInSpace(const Method &method)
  {
    using mpm::Face;
    using mpm::SideKind;
    // Faces of bodies are between rows of nodes, and the sides of bodies are on rows of nodes.
    scene.add_block({{0.02, 0.0, 0.0}}, {{0.82, 0.7, SURFACE}}, 0.5 * CELL, 2000.0);
    const int ground = scene.size();
    scene.add_block({{0.2, 0.2, SURFACE}}, {{0.5, 0.5, SURFACE + CELL}}, CELL, 2000.0);
    const int footing = scene.size();
    scene.add_block({{0.35, 0.2, 0.17}}, {{0.65, 0.5, 0.37}}, CELL, 2000.0);
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < ground ? -1 : p < footing ? FOOTING : PLATE;
      scene.model[p] = scene.position[3 * p + 2] > 0.3 ? 1 : 0;
      scene.velocity[3 * p] = 0.05 * std::sin(1.7 * p);
      scene.velocity[3 * p + 1] = 0.05 * std::cos(0.9 * p);
      scene.velocity[3 * p + 2] = 0.05 * std::sin(2.3 * p + 0.5);
      scene.body_force[3 * p] = 2.0 * scene.mass[p];
      scene.body_force[3 * p + 2] = -9.81 * scene.mass[p];
      scene.stress[p] = {{-18e3, 1e3, -0.5e3, 1e3, -20e3, 0.3e3, -0.5e3, 0.3e3, -24e3}};
    }
    scene.begin_memory(frictional);
    options.scheme = method.scheme;
    options.shape = method.shape;
    options.damping = method.damping;
    options.flip = method.flip;
    options.sides = {SideKind::Roller, SideKind::Free,  SideKind::Fixed,
                     SideKind::Free,   SideKind::Fixed, SideKind::Free};
    options.rigid_bodies.resize(NUM_BODIES);
    options.rigid_bodies[FOOTING].face = Face::ZLo;
    options.rigid_bodies[PLATE].face = Face::XHi;
    for (mpm::RigidBodyOptions &body : options.rigid_bodies) {
      body.rough = method.rough;
      body.separation = method.separation;
      body.round = method.round;
    }
    find_loads();
  }

  /// Finds the loads of the points that are in the scene now.
  void find_loads()
  {
    loads.assign(2, {});
    loads[0].traction = {{1e3, -2e3, -20e3}};
    loads[0].face = mpm::Face::ZHi;
    loads[1].traction = {{-5e3, 0.0, 0.5e3}};
    loads[1].face = mpm::Face::XHi;
    for (int p = 0; p < scene.size(); ++p) {
      if (scene.rigid_body[p] >= 0) continue;
      const double *x = &scene.position[3 * p];
      if (x[2] > SURFACE - 0.5 * CELL && x[1] > 0.55) loads[0].point_index.push_back(p);
      if (x[0] > 0.82 - 0.5 * CELL && x[2] > 0.2) loads[1].point_index.push_back(p);
    }
  }

  /// Returns a solver with the laws and the velocities of the bodies. The ground must not be moved
  /// in memory afterwards.
  mpm::MpmSolver<3> solver(const mpm::Communication &communication = {})
  {
    mpm::MpmSolver<3> made(options, communication);
    made.set_models({&elastic, &frictional});
    for (int b = 0; b < NUM_BODIES; ++b) made.set_body_velocity(b, body_velocity[b]);
    return made;
  }

  /// Returns all forces and masses of a solver. All ranks must call it together.
  std::vector<double> numbers(mpm::MpmSolver<3> &of)
  {
    std::vector<double> list = {of.max_unbalanced_force(), of.cfl_number(scene.view(), STEP)};
    const auto note = [&](const mpm::Vec<3> &v) { list.insert(list.end(), {v[0], v[1], v[2]}); };
    for (int body = 0; body < NUM_BODIES; ++body) note(of.body_reaction(body));
    for (int side = 0; side < 6; ++side) note(of.side_reaction(static_cast<mpm::Face>(side)));
    note(of.damping_force());
    const mpm::Totals<3> totals = of.totals(scene.view());
    note(totals.momentum);
    list.insert(list.end(), {totals.mass, totals.kinetic_energy});
    for (int n = 0; n < of.grid().node_count(); n += 17) {    // each query synchronises the ranks
      note(of.node_force(of.grid().place(n)));
      list.push_back(of.node_mass(of.grid().place(n)));
    }
    return list;
  }
};

}    // namespace mpm_test
