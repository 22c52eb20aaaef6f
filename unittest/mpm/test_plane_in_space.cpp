// SPDX-License-Identifier: GPL-2.0-only
// Compares a scene in space with the same scene in plane strain. The scene in space is one cell
// thick and lies between smooth walls. The normal of the walls is along each axis in turn. The
// results must not depend on this axis.

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <gtest/gtest.h>

using mpm::Face;
using mpm::Scheme;
using mpm::ShapeFunction;
using mpm::SideKind;
using mpm_test::Scene;
using SceneInSpace = mpm_test::SceneOf<3>;

namespace {

constexpr double CELL = 0.05, STEP = 2.5e-4;
enum Body { FOOTING, PLATE, NUM_BODIES };

struct Method {
  Scheme scheme;
  ShapeFunction shape;
  double damping;
  bool rough, separation;
};

const Method METHODS[] = {{Scheme::Musl, ShapeFunction::Gimp, 0.1, true, false},
                          {Scheme::Usavg, ShapeFunction::Gimp, 0.0, false, true},
                          {Scheme::Musl, ShapeFunction::Linear, 0.0, true, true}};

mpm::RigidBodyOptions body_options(int body, const Method &method)
{
  mpm::RigidBodyOptions options;
  options.face = body == FOOTING ? Face::YLo : Face::XHi;
  options.rough = method.rough;
  options.separation = method.separation;
  return options;
}

/// Elastic ground with a frictional layer on it, with gravity, stress and irregular velocities. A
/// footing is on it, a plate pushes to the right, and two tractions act. The faces of the bodies
/// are between rows of nodes.
struct PlaneGround {
  Scene scene;
  std::vector<mpm::TractionLoad<2>> loads;
  mpm::LinearElastic<2> elastic{10e6, 0.3};
  mpm::MohrCoulomb<2> frictional{10e6, 0.3, 2e3, 30.0, 5.0};

  PlaneGround()
  {
    scene.add_block({{0.01, 0.01}}, {{0.61, 0.51}}, 0.5 * CELL, 2000.0);
    const int ground = scene.size();
    scene.add_block({{0.0, 0.51}}, {{0.2, 0.61}}, CELL, 2000.0);
    const int footing = scene.size();
    scene.add_block({{0.38, 0.2}}, {{0.43, 0.4}}, CELL, 2000.0);
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < ground ? -1 : p < footing ? FOOTING : PLATE;
      scene.model[p] = scene.position[3 * p + 1] > 0.25 ? 1 : 0;
      scene.velocity[3 * p] = 0.05 * std::sin(1.7 * p);
      scene.velocity[3 * p + 1] = 0.05 * std::cos(0.9 * p);
      scene.body_force[3 * p] = 2.0 * scene.mass[p];
      scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
      scene.stress[p] = {{-18e3, 1e3, 1e3, -22e3}};
    }
    scene.begin_memory(frictional);
    loads.resize(2);
    loads[0].traction = {{1e3, -20e3}};
    loads[1].traction = {{-5e3, 0.5e3}};
    loads[1].face = Face::XHi;
    for (int p = 0; p < ground; ++p) {
      if (scene.position[3 * p + 1] > 0.51 - 0.5 * CELL) loads[0].point_index.push_back(p);
      if (scene.position[3 * p] > 0.61 - 0.5 * CELL) loads[1].point_index.push_back(p);
    }
  }
};

/// Maps x and y of the plane to two axes of space, in ascending order. `out` is the axis normal to
/// the plane.
struct Embedding {
  int in[2], out;

  explicit Embedding(int out_in) : in{out_in == 0 ? 1 : 0, out_in == 2 ? 1 : 2}, out(out_in) {}

  Face face(Face plane) const
  {
    const int side = static_cast<int>(plane);
    return static_cast<Face>(2 * in[side / 2] + side % 2);
  }
  mpm::Vec<3> vector(const mpm::Vec2 &plane, double across = 0.0) const
  {
    mpm::Vec<3> v;
    v[in[0]] = plane[0];
    v[in[1]] = plane[1];
    v[out] = across;
    return v;
  }
};

/// Runs the scene. Returns the reactions on bodies and sides along two axes, the damping force
/// along both, and the CFL number.
template <int D>
std::vector<double> run(mpm_test::SceneOf<D> &scene, const mpm::SolverOptions<D> &options,
                        const std::vector<mpm::TractionLoad<D>> &loads,
                        const mpm::Vec<D> *body_velocity,
                        std::vector<mpm::Constitutive<D> *> models, int steps, const int *axes,
                        const std::vector<Face> &sides)
{
  mpm::MpmSolver<D> solver(options);
  solver.set_models(std::move(models));
  for (int b = 0; b < NUM_BODIES; ++b) solver.set_body_velocity(b, body_velocity[b]);
  for (int step = 0; step < steps; ++step) solver.step(scene.view(), loads, STEP);
  std::vector<double> result;
  for (int k = 0; k < 2; ++k) {
    for (int b = 0; b < NUM_BODIES; ++b) result.push_back(solver.body_reaction(b)[axes[k]]);
    for (const Face side : sides) result.push_back(solver.side_reaction(side)[axes[k]]);
    result.push_back(solver.damping_force()[axes[k]]);
  }
  result.push_back(solver.cfl_number(scene.view(), STEP));
  return result;
}

class PlaneInSpace : public testing::TestWithParam<Method> {};

}    // namespace

TEST_P(PlaneInSpace, OneCellBetweenSmoothWallsIsPlaneStrainAlongEachAxis)
{
  const Method &method = GetParam();
  const int steps = 60;
  mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, -0.02}}, {{0.7, 0.73}}, CELL);
  options.scheme = method.scheme;
  options.shape = method.shape;
  options.damping = method.damping;
  options.flip = 0.99;
  options.thickness = CELL;
  options.sides = {SideKind::Roller, SideKind::Free, SideKind::Fixed, SideKind::Free};
  for (int b = 0; b < NUM_BODIES; ++b) options.rigid_bodies.push_back(body_options(b, method));
  const mpm::Vec2 velocity[NUM_BODIES] = {{{0.02, -0.2}}, {{0.1, 0.03}}};
  const int plane_axes[] = {0, 1};
  const std::vector<Face> plane_sides = {Face::XLo, Face::XHi, Face::YLo, Face::YHi};

  PlaneGround plane;
  Scene flat = plane.scene;
  for (std::vector<double> *of : {&flat.mass, &flat.volume, &flat.initial_volume, &flat.body_force})
    for (double &value : *of) value *= CELL;
  const Scene start = flat;
  const std::vector<double> expected =
      run<2>(flat, options, plane.loads, velocity, {&plane.elastic, &plane.frictional}, steps,
             plane_axes, plane_sides);

  double plastic = 0.0;
  for (int p = 0; p < flat.size(); ++p)
    plastic = std::max(plastic, flat.row(p)[mpm::MohrCoulomb<2>::PlasticStrain]);
  ASSERT_GT(plastic, 1e-4) << "the layer yields";

  mpm::LinearElastic<3> elastic(10e6, 0.3);
  mpm::MohrCoulomb<3> frictional(10e6, 0.3, 2e3, 30.0, 5.0);
  for (int out = 0; out < 3; ++out) {
    const Embedding to(out);
    // There are two layers of points; rigid bodies extend beyond the walls.
    SceneInSpace scene;
    scene.memory_width = 1;
    std::vector<int> first_of(start.size());
    for (int p = 0; p < start.size(); ++p) {
      first_of[p] = scene.size();
      for (int layer = 0; layer < 2; ++layer) {
        const bool rigid = start.rigid_body[p] >= 0;
        const double place =
            (layer + 0.5) * 0.5 * CELL + (rigid ? (layer - 0.5) * 6.0 * CELL : 0.0);
        const int q =
            scene.add(to.vector({{start.position[3 * p], start.position[3 * p + 1]}}, place),
                      to.vector(start.half_size[p], 0.25 * CELL), 2000.0);
        for (int k = 0; k < 2; ++k) {
          scene.velocity[3 * q + to.in[k]] = start.velocity[3 * p + k];
          scene.body_force[3 * q + to.in[k]] = 0.5 * start.body_force[3 * p + k];
          for (int l = 0; l < 2; ++l) scene.stress[q](to.in[k], to.in[l]) = start.stress[p](k, l);
        }
        scene.stress[q](out, out) = plane.scene.row(p)[mpm::MohrCoulomb<2>::OutOfPlaneStress];
        scene.rigid_body[q] = start.rigid_body[p];
        scene.model[q] = start.model[p];
      }
    }
    mpm::SolverOptions<3> in_space =
        mpm_test::grid_options_of<3>(to.vector(options.lo, 0.0), to.vector(options.hi, CELL), CELL);
    in_space.scheme = method.scheme;
    in_space.shape = method.shape;
    in_space.damping = method.damping;
    in_space.flip = options.flip;
    in_space.sides.fill(SideKind::Roller);
    std::vector<Face> sides;
    for (int side = 0; side < 4; ++side) {
      sides.push_back(to.face(static_cast<Face>(side)));
      in_space.sides[static_cast<int>(sides.back())] = options.sides[side];
    }
    mpm::Vec<3> body_velocity[NUM_BODIES];
    for (int b = 0; b < NUM_BODIES; ++b) {
      in_space.rigid_bodies.push_back(options.rigid_bodies[b]);
      in_space.rigid_bodies[b].face = to.face(options.rigid_bodies[b].face);
      body_velocity[b] = to.vector(velocity[b]);
    }
    std::vector<mpm::TractionLoad<3>> loads(plane.loads.size());
    for (std::size_t k = 0; k < loads.size(); ++k) {
      loads[k].traction = to.vector(plane.loads[k].traction);
      loads[k].face = to.face(plane.loads[k].face);
      for (const int p : plane.loads[k].point_index)
        for (int layer = 0; layer < 2; ++layer) loads[k].point_index.push_back(first_of[p] + layer);
    }

    const std::vector<double> found =
        run<3>(scene, in_space, loads, body_velocity, {&elastic, &frictional}, steps, to.in, sides);

    // round-off of 60 steps of velocities of order 0.1, stresses of order 1e5 and forces of order
    // 100
    for (int p = 0; p < flat.size(); ++p)
      for (int layer = 0; layer < 2; ++layer) {
        const int q = first_of[p] + layer;
        for (int k = 0; k < 2; ++k) {
          ASSERT_NEAR(scene.position[3 * q + to.in[k]], flat.position[3 * p + k], 1e-12);
          ASSERT_NEAR(scene.velocity[3 * q + to.in[k]], flat.velocity[3 * p + k], 1e-9);
          if (flat.rigid_body[p] >= 0) continue;
          for (int l = 0; l < 2; ++l) {
            ASSERT_NEAR(scene.stress[q](to.in[k], to.in[l]), flat.stress[p](k, l), 1e-3);
            ASSERT_NEAR(scene.deformation_gradient[q](to.in[k], to.in[l]),
                        flat.deformation_gradient[p](k, l), 1e-10);
          }
        }
        if (flat.rigid_body[p] >= 0) continue;
        ASSERT_NEAR(scene.velocity[3 * q + out], 0.0, 1e-9);
        ASSERT_NEAR(scene.volume[q], 0.5 * flat.volume[p], 1e-12 * CELL * CELL);
        if (flat.model[p] != 1) continue;
        ASSERT_NEAR(scene.stress[q](out, out), flat.row(p)[mpm::MohrCoulomb<2>::OutOfPlaneStress],
                    1e-3);
        ASSERT_NEAR(scene.row(q)[mpm::MohrCoulomb<3>::PlasticStrain],
                    flat.row(p)[mpm::MohrCoulomb<2>::PlasticStrain], 1e-10);
      }
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k + 1 < found.size(); ++k)
      EXPECT_NEAR(found[k], expected[k], 1e-6) << "across " << out;
    EXPECT_NEAR(found.back(), expected.back(), 1e-9) << "wave and speed";
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, PlaneInSpace, testing::ValuesIn(METHODS));
