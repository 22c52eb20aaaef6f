// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the affine stiffness of a state, from contacts that the host finds in double precision.

#pragma once

#include "rve/engine/affine_stiffness.h"
#include "rve/engine/contact_network.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

namespace rve_test {

inline rve::AffineStiffness affine_stiffness(const rve::RveState &state)
{
  // The histories are sorted like the contacts of find_contacts(). If the grains of a pair are
  // exchanged, its tangential force stays the same: the force and the tangent vector both change
  // sign.
  std::vector<rve::Pair> pairs = state.pairs;
  for (rve::Pair &pair : pairs)
    if (pair.second < pair.first) std::swap(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end(), [](const rve::Pair &x, const rve::Pair &y) {
    return std::tie(x.first, x.second) < std::tie(y.first, y.second);
  });
  auto history = pairs.begin();

  const rve::Material &material = state.material;
  const double k_n = material.normal_stiffness;
  const double k_t = material.friction > 0.0 ? material.tangential_stiffness : 0.0;
  const double volume = state.cell_volume() * material.thickness;
  const rve::Tensor2 unit_strains[3] = {
      {{1.0, 0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0, 1.0}}, {{0.0, 1.0, 1.0, 0.0}}};

  rve::AffineStiffness stiffness;
  for (const rve::TouchingPair &contact : rve::find_contacts(state)) {
    const auto &n = contact.normal;
    const rve::Vec<double, 2> t{{-n[1], n[0]}};
    const double l = std::hypot(contact.branch[0], contact.branch[1]);
    const double f_n = k_n * contact.overlap;
    while (history != pairs.end() &&
           std::tie(history->first, history->second) < std::tie(contact.first, contact.second))
      ++history;
    const bool has_history = history != pairs.end() && history->first == contact.first &&
        history->second == contact.second;
    const double f_t = has_history ? history->tangential_force : 0.0;
    for (int e = 0; e < 3; ++e) {
      const rve::Vec<double, 2> stretched = unit_strains[e] * n;
      const double eps_nn = n[0] * stretched[0] + n[1] * stretched[1];
      const double eps_nt = t[0] * stretched[0] + t[1] * stretched[1];
      const double along_n = k_n * l * eps_nn - f_t * eps_nt;
      const double along_t = (k_t * l - f_n) * eps_nt;
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) {
          const double force = -f_n * n[a] + f_t * t[a];
          const double change = along_n * n[a] + along_t * t[a];
          const double dilation = unit_strains[e](0, 0) + unit_strains[e](1, 1);
          stiffness.component[2 * a + b][e] +=
              l * (change * n[b] + force * stretched[b] - dilation * force * n[b]) / volume;
        }
    }
  }
  return stiffness;
}

}    // namespace rve_test
