// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the elastic tangent of disks by linear algebra, without dynamics and finite strains. It
// solves the equations of equilibrium of all grains with sticking contacts, linearised about a
// state at rest.

#pragma once

#include "macro/tangent.h"
#include "rve/engine/contact_network.h"

#include <cmath>
#include <utility>
#include <vector>

namespace rve_test {

/// Solves a x = b for several right-hand sides b, by Gaussian elimination with row pivots.
inline std::vector<std::vector<double>> solve(std::vector<std::vector<double>> a,
                                              std::vector<std::vector<double>> b)
{
  const std::size_t n = a.size();
  for (std::size_t p = 0; p < n; ++p) {
    std::size_t best = p;
    for (std::size_t r = p + 1; r < n; ++r)
      if (std::fabs(a[r][p]) > std::fabs(a[best][p])) best = r;
    std::swap(a[p], a[best]);
    std::swap(b[p], b[best]);
    for (std::size_t r = p + 1; r < n; ++r) {
      const double factor = a[r][p] / a[p][p];
      if (factor == 0.0) continue;
      for (std::size_t c = p; c < n; ++c) a[r][c] -= factor * a[p][c];
      for (std::size_t c = 0; c < b[p].size(); ++c) b[r][c] -= factor * b[p][c];
    }
  }
  for (std::size_t p = n; p-- > 0;)
    for (std::size_t c = 0; c < b[p].size(); ++c) {
      for (std::size_t k = p + 1; k < n; ++k) b[p][c] -= a[p][k] * b[k][c];
      b[p][c] /= a[p][p];
    }
  return b;
}

/// Changes of force, torques and branch vector of a contact with linear springs. Both grains move
/// with the strain. In addition, they move by the displacements u and rotations w in `moved` =
/// (u_i, w_i, u_j, w_j). The formulas are those of AffineStiffnessOf, extended by rotations and by
/// torques with the lever arms r - overlap/2.
struct ContactChange {
  double force[2], torque[2];    ///< force on i; torques on i and j [force], [force length]
  double branch[2];              ///< [length]

  ContactChange(const rve::RveState &state, const rve::SpringContact &contact,
                const rve::Tensor2 &strain, const double *moved)
  {
    const rve::TouchingPair &pair = contact.geometry;
    const double *n = pair.normal.component;
    const double t[2] = {-n[1], n[0]};
    const double l = std::hypot(pair.branch[0], pair.branch[1]);
    const double arm[2] = {state.radius[pair.first] - 0.5 * pair.overlap,
                           state.radius[pair.second] - 0.5 * pair.overlap};
    for (int a = 0; a < 2; ++a)
      branch[a] =
          strain(a, 0) * pair.branch[0] + strain(a, 1) * pair.branch[1] + moved[3 + a] - moved[a];
    const double x = n[0] * branch[0] + n[1] * branch[1], y = t[0] * branch[0] + t[1] * branch[1];
    const double f_n = contact.normal_force, f_t = contact.springs.tangential;
    const double sheared =
        state.material.tangential_stiffness * (y - arm[0] * moved[2] - arm[1] * moved[5]);
    const double along_n = state.material.normal_stiffness * x - f_t * y / l,
                 along_t = sheared - f_n * y / l;
    for (int a = 0; a < 2; ++a) {
      force[a] = along_n * n[a] + along_t * t[a];
      torque[a] = arm[a] * sheared + 0.5 * x * f_t;    // arms grow as the overlap shrinks
    }
  }
};

/// Returns the tangent. Weak springs of 1e-11 k_n hold all grains. Without them the matrix would be
/// singular, since nothing else holds grains without contacts or prevents a translation of all
/// grains.
inline macro::TangentOf<2> network_stiffness(const rve::RveState &state)
{
  using rve::Tensor2;
  const Tensor2 strains[3] = {{{1, 0, 0, 0}}, {{0, 0, 0, 1}}, {{0, 0.5, 0.5, 0}}};
  const double still[6] = {};
  const std::size_t n = 3 * state.radius.size();
  const auto contacts = rve::find_spring_contacts(state);

  std::vector<std::vector<double>> stiffness(n, std::vector<double>(n, 0.0)),
      load(n, std::vector<double>(3, 0.0));
  const auto index = [](const rve::SpringContact &contact, int k) {
    return static_cast<std::size_t>(k < 3 ? 3 * contact.geometry.first + k
                                          : 3 * contact.geometry.second + k - 3);
  };
  for (const rve::SpringContact &contact : contacts) {
    const auto add = [&](const ContactChange &change, double sign, auto &matrix,
                         std::size_t column) {
      for (int a = 0; a < 2; ++a) {
        matrix[index(contact, a)][column] += sign * change.force[a];
        matrix[index(contact, 3 + a)][column] -= sign * change.force[a];
        matrix[index(contact, 2 + 3 * a)][column] += sign * change.torque[a];
      }
    };
    for (int k = 0; k < 6; ++k) {
      double moved[6] = {};
      moved[k] = 1.0;
      add(ContactChange(state, contact, Tensor2::zero(), moved), 1.0, stiffness, index(contact, k));
    }
    for (int e = 0; e < 3; ++e)
      add(ContactChange(state, contact, strains[e], still), -1.0, load, e);
  }
  for (std::size_t k = 0; k < n; ++k)
    stiffness[k][k] -= 1e-11 * state.material.normal_stiffness *
        (k % 3 == 2 ? state.radius[k / 3] * state.radius[k / 3] : 1.0);
  const auto moved = solve(stiffness, load);

  const double volume = state.cell_volume() * state.material.thickness;
  macro::TangentOf<2> tangent;
  for (int e = 0; e < 3; ++e) {
    Tensor2 change = Tensor2::zero();
    for (const rve::SpringContact &contact : contacts) {
      double of_pair[6];
      for (int k = 0; k < 6; ++k) of_pair[k] = moved[index(contact, k)][e];
      const ContactChange by(state, contact, strains[e], of_pair);
      const double *b = contact.geometry.branch.component, *f = contact.force_on_first.component;
      for (int a = 0; a < 2; ++a)
        for (int c = 0; c < 2; ++c)
          change(a, c) +=
              (by.force[a] * b[c] + f[a] * by.branch[c] - rve::trace(strains[e]) * f[a] * b[c]) /
              volume;
    }
    tangent.component[0][e] = change(0, 0);
    tangent.component[1][e] = change(1, 1);
    tangent.component[2][e] = 0.5 * (change(0, 1) + change(1, 0));
  }
  return tangent;
}

}    // namespace rve_test
