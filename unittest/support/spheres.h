// SPDX-License-Identifier: GPL-2.0-only
// RVEs of spheres that several tests start from, and an engine with one of them.

#pragma once

#include "engine/test_states.h"
#include "rve/core/pi.h"
#include "rve/engine/engine.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace rve_test {

using Spheres = rve::RveStateOf<3>;

inline rve::Options sphere_options(rve::Format format = rve::Format::Double)
{
  rve::Options options;
  options.contacts.dimension = 3;
  options.format = format;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  return options;
}

inline Spheres spheres(const rve::Material &material, const rve::Tensor3 &cell,
                       const std::vector<double> &radius, const std::vector<double> &xyz)
{
  Spheres state;
  state.material = material;
  state.cell = cell;
  state.radius = radius;
  state.velocity.assign(3 * radius.size(), 0.0);
  state.spin.assign(3 * radius.size(), 0.0);
  state.set_positions(xyz);
  return state;
}

/// Returns the material of the disks with a thickness of one, as spheres need it.
inline rve::Material spheres_material()
{
  rve::Material material = paper_material();
  material.thickness = 1.0;
  return material;
}

inline double sphere_mass(const rve::Material &material, double radius)
{
  return material.density * material.mass_depth * 4.0 / 3.0 * rve::kPi * radius * radius * radius;
}

/// Returns a face-centred cubic array of m^3 unit cells with four spheres each. Neighbours have the
/// given overlap [length].
inline Spheres face_centred_cubic(const rve::Material &material, int m, double r, double overlap)
{
  const double edge = std::sqrt(2.0) * (2.0 * r - overlap);
  std::vector<double> x;
  const double corner[4][3] = {{0, 0, 0}, {0.5, 0.5, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k)
        for (const auto &c : corner)
          x.insert(x.end(),
                   {edge * (i + c[0] + 0.25), edge * (j + c[1] + 0.25), edge * (k + c[2] + 0.25)});
  return spheres(material, (m * edge) * rve::Tensor3::identity(),
                 std::vector<double>(x.size() / 3, r), x);
}

/// Returns the pressure of face_centred_cubic(), p = 2 sqrt(2) k_n overlap / l^2 [stress]. A sphere
/// has six contacts and the volume l^3/sqrt(2); l is the distance of neighbours.
inline double face_centred_pressure(const rve::Material &material, double r, double overlap)
{
  const double distance = 2.0 * r - overlap;
  return 2.0 * std::sqrt(2.0) * material.normal_stiffness * overlap / (distance * distance);
}

/// Elastic constants of a cubic crystal, along the axes of the cube [stress].
struct CubicConstants {
  double c11, c12, c44;
};

/// Returns the elastic constants of face_centred_cubic() without overlap.
inline CubicConstants face_centred_constants(const rve::Material &material, double r)
{
  const double kn = material.normal_stiffness, kt = material.tangential_stiffness;
  const double factor = std::sqrt(2.0) / (2.0 * r);
  return {factor * (kn + kt), 0.5 * factor * (kn - kt), 0.5 * factor * (kn + kt)};
}

/// Returns m^3 spheres of radius r in a simple cubic array; a negative overlap is a gap.
inline Spheres simple_cubic(const rve::Material &material, int m, double r, double overlap)
{
  const double spacing = 2.0 * r - overlap;
  std::vector<double> x;
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k)
        for (const int number : {i, j, k}) x.push_back(spacing * (number + 0.5));
  return spheres(material, (m * spacing) * rve::Tensor3::identity(),
                 std::vector<double>(m * m * m, r), x);
}

/// Returns a disturbed cubic array of m^3 moving spheres, some of which touch.
inline Spheres disordered_spheres(const rve::Material &material, int m, unsigned seed)
{
  Random random(seed);
  const double r = 0.005, spacing = 1.9 * r;
  std::vector<double> x, radius;
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k) {
        for (const int number : {i, j, k})
          x.push_back(spacing * (number + 0.5) + random.uniform(-0.05, 0.05) * r);
        radius.push_back(random.uniform(0.85, 1.0) * r);
      }
  Spheres state = spheres(material, (m * spacing) * rve::Tensor3::identity(), radius, x);
  for (double &v : state.velocity) v = random.uniform(-0.05, 0.05);
  for (double &w : state.spin) w = random.uniform(-5.0, 5.0);
  return state;
}

/// Reads a LAMMPS data file of atom_style sphere in an orthogonal box at the origin.
inline Spheres read_spheres(const std::string &path, const rve::Material &material)
{
  std::ifstream file(path);
  rve::Tensor3 cell = rve::Tensor3::zero();
  std::vector<double> radius, xyz;
  int sides = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    double low, high, diameter, density, x[3];
    int id, type;
    if (line.find("lo ") != std::string::npos && words >> low >> high) {
      cell(sides, sides) = high - low;
      ++sides;
    } else if (words >> id >> type >> diameter >> density >> x[0] >> x[1] >> x[2]) {
      radius.push_back(0.5 * diameter);
      xyz.insert(xyz.end(), x, x + 3);
    }
  }
  return spheres(material, cell, radius, xyz);
}

class SphereRig {
 public:
  explicit SphereRig(const Spheres &state, const rve::Options &options = sphere_options()) :
      engine(rve::make_engine<3>(options)), number(engine->add(state))
  {
  }
  rve::ResultOf<3> advance(const rve::DriveOf<3> &drive)
  {
    std::vector<rve::ResultOf<3>> results;
    engine->advance({number}, {drive}, results);
    EXPECT_EQ(results[0].status & rve::status::Fatal, 0u)
        << rve::describe_status(results[0].status);
    return results[0];
  }
  rve::ResultOf<3> strain(const rve::Tensor3 &gradient, double dt, int substeps)
  {
    return advance(rve::DriveOf<3>::constant_velocity_gradient(gradient, dt, substeps));
  }
  rve::ElasticResultOf<3> stiffness()
  {
    std::vector<rve::ElasticResultOf<3>> results;
    engine->advance({number}, {rve::DriveOf<3>()}, results);
    return results[0];
  }
  Spheres state() const { return engine->state(number); }

 private:
  std::unique_ptr<rve::EngineOf<3>> engine;
  int number;
};

}    // namespace rve_test
