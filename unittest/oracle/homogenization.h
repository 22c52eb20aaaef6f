// SPDX-License-Identifier: GPL-2.0-only
// Oracle: homogenised quantities of a state. It sums over all pairs one after the other, in double
// precision.

#pragma once

#include "oracle/all_pairs.h"
#include "rve/engine/state.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace rve_test {

struct OracleResult {
  rve::Tensor2 stress = rve::Tensor2::zero(), fabric = rve::Tensor2::zero();
  int num_contacts = 0, num_rattlers = 0;
  double coordination_number = 0.0, mechanical_coordination_number = 0.0;
  double sliding_fraction = 0.0, unbalanced_ratio = 0.0, void_ratio = 0.0;
  double kinetic_energy = 0.0, elastic_energy = 0.0;
  double largest_overlap = 0.0, mean_overlap = 0.0, largest_contact_force = 0.0;
};

/// Returns the quantities, without forces of dashpots. A contact counts as sliding if its
/// tangential spring force exceeds the Coulomb limit minus `sliding_tolerance` times the mean
/// contact force.
inline OracleResult homogenize_all_pairs(const rve::RveState &state, double sliding_tolerance)
{
  const rve::Material &material = state.material;
  const int n = state.num_grains();
  std::map<std::pair<int, int>, double> spring;
  for (const rve::Pair &pair : state.pairs)    // exchanging the grains keeps the sign
    spring[std::minmax(pair.first, pair.second)] = pair.tangential_force;

  OracleResult result;
  std::vector<double> grain_force(2 * n, 0.0);
  std::vector<int> contacts(n, 0);
  std::vector<double> below_limit;
  double contact_force_sum = 0.0, solid = 0.0;
  for (const OraclePair &pair : all_pairs(state.cell, state.radius, state.fractional, 0.0)) {
    const double overlap = -pair.gap, distance = std::sqrt(dot(pair.branch, pair.branch));
    const double nx = pair.branch[0] / distance, ny = pair.branch[1] / distance;
    const double normal = material.normal_stiffness * overlap;
    const double limit = material.friction * normal;
    const auto history = spring.find({pair.first, pair.second});
    const double trial = history == spring.end() ? 0.0 : history->second;
    const double tangential = std::max(-limit, std::min(limit, trial));
    const rve::Vec<double, 2> force{
        // force on the first grain
        {-normal * nx - tangential * ny, -normal * ny + tangential * nx}};
    const double size = std::sqrt(dot(force, force));

    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) result.stress(a, b) += force[a] * pair.branch[b];
      grain_force[2 * pair.first + a] += force[a];
      grain_force[2 * pair.second + a] -= force[a];
    }
    result.fabric = result.fabric + rve::Tensor2{{nx * nx, nx * ny, ny * nx, ny * ny}};
    ++contacts[pair.first];
    ++contacts[pair.second];
    ++result.num_contacts;
    below_limit.push_back(limit - std::fabs(trial));
    contact_force_sum += size;
    const double relative = overlap / (state.radius[pair.first] + state.radius[pair.second]);
    result.mean_overlap += relative;
    result.largest_overlap = std::max(result.largest_overlap, relative);
    result.largest_contact_force = std::max(result.largest_contact_force, size);
    result.elastic_energy += 0.5 * material.normal_stiffness * overlap * overlap +
        0.5 * tangential * tangential / material.tangential_stiffness;
  }

  double grain_force_sum = 0.0;
  int carrying = 0, contacts_of_carrying = 0;
  for (int i = 0; i < n; ++i) {
    grain_force_sum += std::hypot(grain_force[2 * i], grain_force[2 * i + 1]);
    const double r = state.radius[i];
    solid += M_PI * r * r;
    const double mass = material.density * M_PI * r * r * material.mass_depth;
    const double cx = state.velocity[2 * i], cy = state.velocity[2 * i + 1], w = state.spin[i];
    result.kinetic_energy += 0.5 * mass * (cx * cx + cy * cy) + 0.5 * (0.5 * mass * r * r) * w * w;
    if (contacts[i] < 2) {
      ++result.num_rattlers;
    } else {
      ++carrying;
      contacts_of_carrying += contacts[i];
    }
  }
  const double count = std::max(result.num_contacts, 1);
  const double area =
      std::fabs(state.cell(0, 0) * state.cell(1, 1) - state.cell(0, 1) * state.cell(1, 0));
  result.stress = (1.0 / (area * material.thickness)) * result.stress;
  result.fabric = (1.0 / count) * result.fabric;
  result.mean_overlap /= count;
  result.void_ratio = area / solid - 1.0;
  result.coordination_number = 2.0 * result.num_contacts / n;
  result.mechanical_coordination_number =
      carrying ? static_cast<double>(contacts_of_carrying) / carrying : 0.0;
  const double tolerance = sliding_tolerance * contact_force_sum / count;
  const auto slides = [&](double force) { return force <= tolerance; };
  result.sliding_fraction = std::count_if(below_limit.begin(), below_limit.end(), slides) / count;
  result.unbalanced_ratio =
      contact_force_sum > 0.0 ? (grain_force_sum / n) / (contact_force_sum / count) : 0.0;
  return result;
}

}    // namespace rve_test
