// SPDX-License-Identifier: GPL-2.0-only
// Closed forms of axisymmetric elasticity: Lame's thick cylinder and sphere, a spinning cylinder,
// and a ring that expands and contracts.

#include "rings.h"

#include "convergence.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <utility>

using mpm::Face;
using mpm::SideKind;
using mpm::Vec2;
using mpm_test::order;
using mpm_test::Rms;
using mpm_test::Scene;
using mpm_test::TURN;
using Solver = mpm::MpmSolver<2>;

namespace {

constexpr double YOUNG = 10e6, POISSON = 0.3, DENSITY = 2000.0;
constexpr double SHEAR = YOUNG / (2.0 * (1.0 + POISSON));
const double WAVE =
    std::sqrt(YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON) * DENSITY));
constexpr double SMALL = 1e-5 * YOUNG;    // strains are so small that their squares do not matter

/// Stress and displacement at a place, and a body force per volume along the radius.
struct Field {
  std::function<Vec2(double, double)> displacement;
  std::function<rve::Tensor2(double, double)> stress;
  std::function<double(double, double)> hoop_stress;
  std::function<double(double, double)> radial_force = [](double, double) { return 0.0; };
};

struct Error {
  double displacement, stress, hoop_stress;    ///< root mean squares
};

/// Block from `lo` to `hi` with rollers below and, if `closed`, above. Its other faces off the axis
/// have the tractions of the field.
struct Block {
  Vec2 lo, hi;
  bool closed;
};

/// Brings a block to rest by local damping, with two points per cell along each axis. Returns the
/// errors of the displacements of points and of the mean stresses of cells.
Error at_rest(const Block &block, const Field &field, double cell, double seconds)
{
  const double width = 0.5 * cell;
  Scene scene;
  scene.add_block(block.lo, block.hi, width, DENSITY);
  mpm_test::make_rings(scene);
  const Vec2 beyond = {{2.0 * cell, block.closed ? 0.0 : 2.0 * cell}};
  const Vec2 inner = {{block.lo[0] > 0.0 ? block.lo[0] - 2.0 * cell : 0.0, block.lo[1]}};
  mpm::SolverOptions<2> options = mpm_test::ring_options(inner, block.hi + beyond, cell);
  options.sides[static_cast<int>(Face::YLo)] = SideKind::Roller;
  if (block.closed) options.sides[static_cast<int>(Face::YHi)] = SideKind::Roller;
  options.damping = 0.2;
  options.flip = 0.98;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(YOUNG, POISSON);
  Solver solver(options);
  solver.set_models({&law});

  std::vector<mpm::TractionLoad<2>> loads;
  for (const Face face : {Face::XLo, Face::XHi, Face::YHi}) {
    const int normal = mpm::axis_of(face);
    if ((face == Face::XLo && !(block.lo[0] > 0.0)) || (face == Face::YHi && block.closed))
      continue;
    mpm::TractionLoad<2> load;
    load.face = face;
    load.traction = {{0.0, 0.0}};
    const double at = mpm::outward(face) < 0.0 ? block.lo[normal] : block.hi[normal];
    for (int p = 0; p < scene.size(); ++p) {
      Vec2 x = {{scene.position[3 * p], scene.position[3 * p + 1]}};
      if (std::abs(x[normal] - at) > 0.6 * width) continue;
      x[normal] = at;
      const rve::Tensor2 stress = field.stress(x[0], x[1]);
      load.point_index.push_back(p);
      load.of_point.push_back(mpm::outward(face) * Vec2{{stress(0, normal), stress(1, normal)}});
    }
    loads.push_back(load);
  }
  for (int p = 0; p < scene.size(); ++p)
    scene.body_force[3 * p] =
        field.radial_force(scene.position[3 * p], scene.position[3 * p + 1]) * scene.volume[p];

  const std::vector<double> before = scene.position;
  const double dt = 0.4 * cell / WAVE;
  for (double time = 0.0; time < seconds; time += dt) solver.step(scene.view(), loads, dt);

  Rms moved, stress, hoop;
  std::map<std::pair<int, int>, Vec2> of_cell;    // sums over four points
  for (int p = 0; p < scene.size(); ++p) {
    const double r = before[3 * p], z = before[3 * p + 1];
    const Vec2 u = field.displacement(r, z);
    for (int a = 0; a < 2; ++a) moved.add(scene.position[3 * p + a] - before[3 * p + a] - u[a]);
    Vec2 &sums = of_cell.try_emplace({int(r / cell), int(z / cell)}, Vec2::zero()).first->second;
    sums = sums +
        Vec2{{scene.stress[p](0, 0) - field.stress(r, z)(0, 0),
              scene.hoop_stress[p] - field.hoop_stress(r, z)}};
  }
  for (const auto &[place, sums] : of_cell) {
    stress.add(0.25 * sums[0]);
    hoop.add(0.25 * sums[1]);
  }
  return {moved.value(), stress.value(), hoop.value()};
}

Error report(const char *name, int cells, const Error &error, double displacement, double stress)
{
  const Error relative = {error.displacement / displacement, error.stress / stress,
                          error.hoop_stress / stress};
  printf("%s, %d cells: displacement %.2e, radial stress %.2e, hoop stress %.2e\n", name, cells,
         relative.displacement, relative.stress, relative.hoop_stress);
  return relative;
}

}    // namespace

TEST(ThickCylinder, UnderInnerPressureConvergesToLame)
{
  // plane strain, radii a = 1 and b = 2: σ_rr = C - D/r², σ_θθ = C + D/r²
  const double a = 1.0, b = 2.0, C = SMALL * a * a / (b * b - a * a), D = C * b * b;
  Field lame;
  lame.displacement = [=](double r, double) {
    return Vec2{{(C * (1.0 - 2.0 * POISSON) * r + D / r) / (2.0 * SHEAR), 0.0}};
  };
  lame.stress = [=](double r, double) {
    return rve::Tensor2{{C - D / (r * r), 0.0, 0.0, 2.0 * POISSON * C}};
  };
  lame.hoop_stress = [=](double r, double) { return C + D / (r * r); };
  Error errors[3];
  for (int k = 0; k < 3; ++k) {
    const int cells = 4 << k;
    const double cell = 1.0 / cells;
    errors[k] = report("thick cylinder", cells,
                       at_rest({{{a, 0.0}}, {{b, 2.0 * cell}}, true}, lame, cell, 1.0),
                       lame.displacement(a, 0.0)[0], SMALL);
  }
  EXPECT_GT(order(errors[1].displacement, errors[2].displacement), 1.6);
  EXPECT_LT(errors[2].displacement, 5e-4);
  EXPECT_GT(order(errors[1].hoop_stress, errors[2].hoop_stress), 1.8);
  EXPECT_LT(errors[2].stress, 1e-3);
}

TEST(ThickSphere, ConvergesToLame)
{
  // A square cut out of the meridian plane of a sphere with a cavity of radius 1 under pressure:
  // σ_RR = -2 B/R³ and σ_tt = B/R³ in spherical coordinates, u_R = B/(2 μ R²).
  const double B = 0.5 * SMALL;
  Field lame;
  lame.displacement = [=](double r, double z) {
    const double R = std::hypot(r, z), u = B / (2.0 * SHEAR * R * R);
    return Vec2{{u * r / R, u * z / R}};
  };
  lame.stress = [=](double r, double z) {
    const double R = std::hypot(r, z), t = B / (R * R * R), c = r / R, s = z / R;
    return rve::Tensor2{
        {t - 3.0 * t * c * c, -3.0 * t * c * s, -3.0 * t * c * s, t - 3.0 * t * s * s}};
  };
  lame.hoop_stress = [=](double r, double z) { return B / std::pow(std::hypot(r, z), 3.0); };
  Error errors[3];
  for (int k = 0; k < 3; ++k) {
    const int cells = 4 << k;
    errors[k] = report("thick sphere", cells,
                       at_rest({{{1.0, 0.0}}, {{2.0, 1.0}}, false}, lame, 1.0 / cells, 1.0),
                       lame.displacement(1.0, 0.0)[0], SMALL);
  }
  EXPECT_GT(order(errors[1].displacement, errors[2].displacement), 1.8);
  EXPECT_LT(errors[2].displacement, 1e-3);
  EXPECT_GT(order(errors[1].hoop_stress, errors[2].hoop_stress), 1.8);
}

TEST(SpinningCylinder, ConvergesToTheClosedFormFromTheAxisToItsFace)
{
  // plane strain, radius 1, under the force ρω² r per volume
  const double R = 1.0, load = SMALL, nu = POISSON, K = load / (8.0 * (1.0 - nu));
  Field spinning;
  spinning.radial_force = [=](double r, double) { return load * r; };
  spinning.displacement = [=](double r, double) {
    const double factor = (1.0 + nu) * (1.0 - 2.0 * nu) / (8.0 * YOUNG * (1.0 - nu));
    return Vec2{{factor * load * r * ((3.0 - 2.0 * nu) * R * R - r * r), 0.0}};
  };
  spinning.stress = [=](double r, double) {
    return rve::Tensor2{{K * (3.0 - 2.0 * nu) * (R * R - r * r), 0.0, 0.0, 0.0}};
  };
  spinning.hoop_stress = [=](double r, double) {
    return K * ((3.0 - 2.0 * nu) * R * R - (1.0 + 2.0 * nu) * r * r);
  };
  Error errors[3];
  for (int k = 0; k < 3; ++k) {
    const int cells = 4 << k;
    const double cell = R / cells;
    errors[k] = report("spinning cylinder", cells,
                       at_rest({{{0.0, 0.0}}, {{R, 2.0 * cell}}, true}, spinning, cell, 0.7),
                       spinning.displacement(0.7, 0.0)[0], spinning.hoop_stress(0.0, 0.0));
  }
  EXPECT_GT(order(errors[1].displacement, errors[2].displacement), 1.8);
  EXPECT_LT(errors[2].displacement, 1e-3);
  EXPECT_GT(order(errors[1].hoop_stress, errors[2].hoop_stress), 1.8);
}

namespace {

/// Largest relative error of the radius and of the energy of a free ring of the radius 1 that
/// starts with a radial velocity, over 1 1/4 periods of its breathing.
struct RingError {
  double motion, energy;
};

RingError breathing(int cells_across, mpm::Scheme scheme)
{
  const double width = 0.05, cell = width / cells_across, speed = 1e-3;
  Scene scene;
  scene.add_block({{1.0 - 0.5 * width, 0.0}}, {{1.0 + 0.5 * width, width}}, 0.5 * cell, DENSITY);
  mpm_test::make_rings(scene);
  for (int p = 0; p < scene.size(); ++p) scene.velocity[3 * p] = speed;
  mpm::SolverOptions<2> options =
      mpm_test::ring_options({{1.0 - width, -width}}, {{1.0 + width, 2.0 * width}}, cell);
  options.scheme = scheme;
  mpm::AxisymmetricLaw law = mpm_test::elastic_rings(YOUNG, 0.0);
  Solver solver(options);
  solver.set_models({&law});
  const double omega = std::sqrt(YOUNG / DENSITY), dt = 0.25 * cell / WAVE;
  const std::vector<double> before = scene.position;
  RingError error = {0.0, 0.0};
  double first = 0.0;
  for (double time = dt; time < 1.25 * TURN / omega; time += dt) {
    solver.step(scene.view(), {}, dt);
    double moved = 0.0, energy = 0.0;
    for (int p = 0; p < scene.size(); ++p) {
      moved += (scene.position[3 * p] - before[3 * p]) / scene.size();
      energy += 0.5 * scene.hoop_stress[p] * scene.hoop_stress[p] / YOUNG * scene.volume[p];
    }
    energy += solver.totals(scene.view()).kinetic_energy;
    if (!(first > 0.0)) first = energy;
    error.motion = std::max(error.motion, std::abs(moved * omega / speed - std::sin(omega * time)));
    error.energy = std::max(error.energy, std::abs(energy / first - 1.0));
  }
  return error;
}

}    // namespace

TEST(ExpandingRing, BreathesWithTheFrequencyOfItsHoopStiffness)
{
  // ω = sqrt(E/ρ)/R; the thickness of a twentieth of the radius changes it by 1e-4
  for (const mpm::Scheme scheme : {mpm::Scheme::Musl, mpm::Scheme::Usavg}) {
    const RingError error = breathing(2, scheme);
    printf("expanding ring, %s: motion %.2e, energy %.2e\n",
           scheme == mpm::Scheme::Musl ? "musl" : "usavg", error.motion, error.energy);
    EXPECT_LT(error.motion, 1e-2);
    EXPECT_LT(error.energy, 1e-2);
  }
}
