// SPDX-License-Identifier: GPL-2.0-only
// Small states that several tests start from.

#pragma once

#include "rve/engine/contact_model.h"
#include "rve/engine/state.h"

#include <cmath>
#include <random>
#include <vector>

namespace rve_test {

inline rve::Material paper_material()
{
  rve::Material material;
  material.normal_stiffness = 1e6;
  material.tangential_stiffness = 1e6;
  material.friction = 0.5;
  material.density = 2650.0;
  material.local_damping = 0.3;
  material.thickness = 0.075;
  return material;
}

/// Returns grains at rest at the given positions in a cell.
inline rve::RveState state_of(const rve::Material &material, const rve::Tensor2 &cell,
                              const std::vector<double> &radius, const std::vector<double> &xy)
{
  rve::RveState state;
  state.material = material;
  state.cell = cell;
  state.radius = radius;
  state.velocity.assign(2 * radius.size(), 0.0);
  state.spin.assign(radius.size(), 0.0);
  state.set_positions(xy);
  return state;
}

/// Returns two touching disks of radius 5 mm and 4 mm, far from their images.
inline rve::RveState two_disks(double overlap)
{
  const rve::Tensor2 cell = 0.2 * rve::Tensor2::identity();
  const double distance = 0.009 - overlap;
  return state_of(paper_material(), cell, {0.005, 0.004},
                  {0.05, 0.05, 0.05 + 0.6 * distance, 0.05 + 0.8 * distance});
}

/// Returns disks whose members differ from their defaults. Most numbers are random and need all
/// digits.
inline rve::RveState crowded_state(int num_grains, unsigned seed)
{
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  rve::RveState state;
  for (const rve::MaterialMember member : rve::parameters_of(state.material.law))
    state.material.*member = 0.1 + 0.8 * uniform();
  state.cell.component[0] = 1.0 + uniform();
  state.cell.component[1] = 0.2 * uniform();
  state.cell.component[2] = -0.3 * uniform();
  state.cell.component[3] = 1.0 + uniform();
  state.list_cell = 1.001 * state.cell;
  state.deformation = rve::Tensor2{{1.1, 0.03 * uniform(), -0.01, 0.9}};
  state.servo_velocity_gradient = rve::Tensor2{{uniform(), uniform(), 0.0, -uniform()}};
  for (int i = 0; i < num_grains; ++i) {
    state.radius.push_back(0.05 + 0.05 * uniform());
    state.spin.push_back(uniform() - 0.5);
    for (int a = 0; a < 2; ++a) {
      state.fractional.push_back(random());
      state.list_fractional.push_back(random());
      state.velocity.push_back(uniform() - 0.5);
    }
  }
  for (int i = 0; i + 1 < num_grains; ++i)
    state.pairs.push_back({i, i + 1, uniform() - 0.5, uniform() - 0.5});
  state.largest_contact_force = uniform();
  state.counters = {11, 7, 3, 2};
  state.energy = {uniform(), uniform(), uniform(), uniform()};
  return state;
}

/// Returns spheres whose members differ from their defaults. Most numbers are random and need all
/// digits.
inline rve::RveStateOf<3> crowded_spheres(int num_grains, unsigned seed)
{
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  rve::RveStateOf<3> state;
  for (const rve::MaterialMember member : rve::parameters_of(state.material.law, 3))
    state.material.*member = 0.1 + 0.8 * uniform();
  state.material.thickness = 1.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      state.cell(a, b) = a == b ? 1.0 + uniform() : 0.2 * uniform() - 0.1;
      state.deformation(a, b) = (a == b) + 0.03 * uniform();
      state.servo_velocity_gradient(a, b) = a <= b ? uniform() : 0.0;
    }
  state.list_cell = 1.001 * state.cell;
  for (int i = 0; i < num_grains; ++i) {
    state.radius.push_back(0.05 + 0.05 * uniform());
    for (int a = 0; a < 3; ++a) {
      state.fractional.push_back(random());
      state.list_fractional.push_back(random());
      state.velocity.push_back(uniform() - 0.5);
      state.spin.push_back(uniform() - 0.5);
    }
  }
  for (int i = 0; i + 1 < num_grains; ++i) {
    rve::PairOf<3> pair{};
    pair.first = i;
    pair.second = i + 1;
    for (const rve::RememberedNumber<3> &number : rve::SPATIAL_PAIR_MEMORY)
      number.of(pair) = uniform() - 0.5;
    state.pairs.push_back(pair);
  }
  state.largest_contact_force = uniform();
  state.counters = {11, 7, 3, 2};
  state.energy = {uniform(), uniform(), uniform(), uniform()};
  return state;
}

/// Returns two equal disks that just touch along the x axis and approach each other with opposite
/// tangential velocities.
inline rve::RveState approaching_disks(double radius, const rve::Material &material,
                                       double normal_velocity, double tangential_velocity = 0.0)
{
  rve::RveState state =
      state_of(material, 20.0 * radius * rve::Tensor2::identity(), {radius, radius},
               {9.0 * radius, 10.0 * radius, 11.0 * radius, 10.0 * radius});
  state.velocity = {0.5 * normal_velocity, 0.5 * tangential_velocity, -0.5 * normal_velocity,
                    -0.5 * tangential_velocity};
  return state;
}

}    // namespace rve_test
