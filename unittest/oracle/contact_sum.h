// SPDX-License-Identifier: GPL-2.0-only
// Oracle: all results of an RVE and, for each result, a bound of the rounding error of the engine
// in a number format. The oracle sums over all pairs and all near images in long double. Unlike the
// engine, it uses no Verlet list, no minimum image and no integer sums.
//
// The bounds count roundings. They use these symbols:
//   u   unit roundoff of forces and normals in the format
//   w   unit roundoff of branch vectors and radii in the format
//   s   resolution of a fractional coordinate in the format
//   H   matrix of the cell vectors; |H| is the sum of the magnitudes of its components
//   W_b distance between the two cell faces that cell vector b connects
//   d   sum of two radii
//   b   branch vector
//   f   contact force
//   q   unit of the integer sums of forces
// The errors are:
//   branch   4 w S + s |H|. The branch is the sum of the products H_ab ds_b with the differences
//            ds_b of fractional coordinates. |ds_b| is at most d / W_b for touching grains, so that
//            S = sum_ab |H_ab| d / W_b bounds the sum of the magnitudes of the products. Each
//            product has four roundings: of H, of ds, of the product and of the sum.
//   gap      The error of the branch, and eight roundings of d: two radii and their sum, two
//            squares and their sum, a root and a difference.
//   normal   The error of the branch divided by |b|, and six roundings: a root, a quotient, two
//            products and two conversions.
//   force    k_n (1 + mu) times the error of the gap, since the Coulomb limit is proportional to
//            the normal force; |f| times the error of the normal; sixteen roundings of the law and
//            its constants; 0.75 q.
//   energy   The effect of the errors of gap and force on the energy of each spring, and half a
//            unit of the integer sum of energies. With this unit, the sum over 2^17 contacts with
//            the largest force fits in 62 bits.
//   stress   |b| times the error of the force, |f| times the error of the branch, and half a unit
//            of the integer sums of f b.
// The bounds count about twice as many roundings as the engine makes. No bound is fitted to
// measured errors.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/state.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace rve_test {

/// Resolution of a number format.
struct Resolution {
  double force;       ///< u, unit roundoff
  double branch;      ///< w, unit roundoff
  double fraction;    ///< s, resolution of the difference of two fractional coordinates
  int sum_bits;       ///< bits of the integer sums of forces

  static Resolution of(rve::Format format)
  {
    switch (format) {
      case rve::Format::Fast:
        return {0x1p-24, 0x1p-24, 0x1p-32, 31};    // one coordinate is truncated to 2^-32
      case rve::Format::Single:
        return {0x1p-24, 0x1p-24, 0x1p-24, 31};    // each coordinate is rounded to 2^-25
      case rve::Format::Mixed:
        return {0x1p-24, 0x1p-53, 0x1p-64, 31};
      default:
        return {0x1p-53, 0x1p-53, 0x1p-64, 55};
    }
  }
};

/// A result of the oracle, and the bound of the error of the engine in this result.
struct Bounded {
  long double value = 0.0L, error = 0.0L;
};

struct ContactSum {
  Bounded stress[4], fabric[4];
  Bounded elastic_energy, kinetic_energy, void_ratio;
  Bounded largest_overlap, mean_overlap, largest_contact_force, unbalanced_ratio;
  std::vector<Bounded> force, torque;    ///< shapes (N, 2) and (N)
  /// Bounds of the number of contacts. A pair whose gap is smaller than the error of the gap is in
  /// the upper bound only.
  int least_contacts = 0, most_contacts = 0;
  /// Sum of k_n d |b| / V over the contacts: the stress if each overlap were as large as the sum of
  /// radii.
  long double stress_of_full_overlap = 0.0L;
};

/// Returns the results of a state without dashpots. Tangential and rolling forces beyond their
/// Coulomb limits are reduced to the limits. The forces that the state has for pairs without
/// contact are ignored.
inline ContactSum contact_sum(const rve::RveState &state, const Resolution &format)
{
  using Real = long double;
  const rve::Material &material = state.material;
  const int n = state.num_grains();
  const Real k_n = material.normal_stiffness, mu = material.friction;
  const bool rolls = rve::resists_rolling(material);
  const Real u = format.force, w = format.branch;

  Real h[2][2];
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) h[a][b] = state.cell(a, b);
  const Real area = h[0][0] * h[1][1] - h[0][1] * h[1][0];
  const Real volume = area * material.thickness;
  Real cell_size = 0.0L, reach = 0.0L;    // |H| and S/d
  for (int b = 0; b < 2; ++b) {
    const Real column = std::fabs(h[0][b]) + std::fabs(h[1][b]);
    const Real width = area / std::hypot(h[0][1 - b], h[1][1 - b]);
    cell_size += column;
    reach += column / width;
  }
  const double largest_radius = *std::max_element(state.radius.begin(), state.radius.end()),
               smallest_radius = *std::min_element(state.radius.begin(), state.radius.end());
  // upper bound of the length unit of the integer sums
  const Real length_unit = 4.0L * largest_radius;

  std::map<std::pair<int, int>, rve::Pair> springs;
  for (const rve::Pair &pair : state.pairs) springs[std::minmax(pair.first, pair.second)] = pair;

  struct Contact {
    int i, j;
    Real branch[2], normal[2], distance, overlap, tangential, rolling, force[2], size;
    Real gap_error, branch_error, normal_error, force_error;
  };
  std::vector<Contact> contacts;
  ContactSum sum;
  Real largest_force = 0.0L;
  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j)
      for (int p = -3; p <= 3; ++p)
        for (int q = -3; q <= 3; ++q) {
          Contact c{};
          c.i = i;
          c.j = j;
          Real ds[2];
          for (int a = 0; a < 2; ++a)
            ds[a] = (static_cast<Real>(state.fractional[2 * j + a]) -
                     static_cast<Real>(state.fractional[2 * i + a])) *
                    0x1p-64L +
                (a == 0 ? p : q);
          for (int a = 0; a < 2; ++a) c.branch[a] = h[a][0] * ds[0] + h[a][1] * ds[1];
          c.distance = std::hypot(c.branch[0], c.branch[1]);
          const Real d = static_cast<Real>(state.radius[i]) + static_cast<Real>(state.radius[j]);
          c.overlap = d - c.distance;
          c.branch_error = 4.0L * w * reach * d + format.fraction * cell_size;
          c.gap_error = c.branch_error + 8.0L * w * d;
          if (c.overlap <= -c.gap_error) continue;
          ++sum.most_contacts;
          if (c.overlap > c.gap_error) ++sum.least_contacts;
          c.overlap = std::max(c.overlap, 0.0L);
          const Real normal_force = k_n * c.overlap;
          const auto spring = springs.find({i, j});
          if (spring != springs.end()) {
            const auto cut = [&](Real trial, Real limit) {
              return std::max(-limit, std::min(limit, trial));
            };
            c.tangential = cut(spring->second.tangential_force, mu * normal_force);
            if (rolls) {
              const Real seen_from_i = spring->second.first == i ? 1.0L : -1.0L;
              c.rolling = cut(seen_from_i * spring->second.rolling_force,
                              material.rolling_friction * normal_force);
            }
          }
          for (int a = 0; a < 2; ++a) c.normal[a] = c.branch[a] / c.distance;
          c.force[0] = -normal_force * c.normal[0] - c.tangential * c.normal[1];
          c.force[1] = -normal_force * c.normal[1] + c.tangential * c.normal[0];
          c.size = std::hypot(c.force[0], c.force[1]);
          c.normal_error = c.branch_error / c.distance + 6.0L * u;
          largest_force = std::max(largest_force, k_n * (c.overlap + c.gap_error));
          sum.stress_of_full_overlap += k_n * d * c.distance / volume;
          contacts.push_back(c);
        }

  // The integer sum of a grain must hold the forces of all its neighbours. Each force can be eight
  // times the expected force, which is at least the force at an overlap of 1e-9 radii. The engine
  // rounds the number of neighbours and the unit up to powers of two, which can double both.
  const Real side_by_side =
      M_PIl / std::asin(static_cast<Real>(smallest_radius) / (smallest_radius + largest_radius));
  const Real neighbors = 2.0L * 1.2L * side_by_side;
  const Real expected = std::max(largest_force, k_n * 1e-9L * largest_radius) *
      std::hypot(1.0L, std::max(mu, static_cast<Real>(rolls ? material.rolling_friction : 0.0)));
  const Real limit =
      2.0L * 8.0L * expected;    // eight times the expected force, rounded up to a power of two
  const Real unit = neighbors * limit * std::ldexp(1.0L, -format.sum_bits);
  // Unit of the sums of |f|. This unit times the length unit is the unit of energies.
  const Real unit_of_sizes = limit * 0x1p-44L;

  std::vector<Real> grain_force(2 * n, 0.0L), force_error(n, 0.0L), torque(n, 0.0L),
      torque_error(n, 0.0L);
  Real force_sum = 0.0L, force_sum_error = 0.0L;
  for (Contact &c : contacts) {
    c.force_error =
        k_n * (1.0L + mu) * c.gap_error + c.size * (c.normal_error + 16.0L * u) + 0.75L * unit;
    const Real stress_error = (c.force_error * c.distance + c.size * c.branch_error +
                               4.0L * u * c.size * c.distance + 0.5L * unit * length_unit) /
        volume;
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) {
        sum.stress[2 * a + b].value += c.force[a] * c.branch[b] / volume;
        sum.stress[2 * a + b].error += stress_error;
        sum.fabric[2 * a + b].value += c.normal[a] * c.normal[b];
        sum.fabric[2 * a + b].error += 2.0L * c.normal_error + 0x1p-40L;
      }
      grain_force[2 * c.i + a] += c.force[a];
      grain_force[2 * c.j + a] -= c.force[a];
    }
    force_error[c.i] += c.force_error;
    force_error[c.j] += c.force_error;
    const Real ri = state.radius[c.i], rj = state.radius[c.j], reduced = ri * rj / (ri + rj);
    torque[c.i] += (ri - 0.5L * c.overlap) * c.tangential + reduced * c.rolling;
    torque[c.j] += (rj - 0.5L * c.overlap) * c.tangential - reduced * c.rolling;
    for (const int k : {c.i, c.j}) {
      const Real arm = state.radius[k];
      torque_error[k] += arm *
              (k_n * (mu + material.rolling_friction) * c.gap_error +
               16.0L * u * (std::fabs(c.tangential) + std::fabs(c.rolling))) +
          0.5L * std::fabs(c.tangential) * c.gap_error + 0.5L * unit * length_unit;
    }
    force_sum += c.size;
    force_sum_error += c.force_error + 0.5L * unit_of_sizes;
    sum.elastic_energy.error += 0.5L * unit_of_sizes * length_unit;
    const auto energy = [&](Real force, double stiffness, Real friction) {
      if (stiffness <= 0.0) return;
      sum.elastic_energy.value += 0.5L * force * force / stiffness;
      const Real change = friction * k_n * c.gap_error + 8.0L * u * std::fabs(force);
      sum.elastic_energy.error += (std::fabs(force) + change) * change / stiffness;
    };
    energy(k_n * c.overlap, material.normal_stiffness, 1.0L);
    energy(c.tangential, material.tangential_stiffness, mu);
    if (rolls) energy(c.rolling, material.rolling_stiffness, material.rolling_friction);
    const Real d = ri + rj, relative = c.overlap / d;
    const Real relative_error = c.gap_error / d + 8.0L * u * relative + 0x1p-40L;
    sum.mean_overlap.value += relative;
    sum.mean_overlap.error += relative_error;
    if (relative >= sum.largest_overlap.value) sum.largest_overlap.value = relative;
    sum.largest_overlap.error = std::max(sum.largest_overlap.error, relative_error);
    if (c.size >= sum.largest_contact_force.value) sum.largest_contact_force.value = c.size;
    sum.largest_contact_force.error = std::max(sum.largest_contact_force.error, c.force_error);
  }

  // The engine can miss contacts whose gap is smaller than the error of the gap. `doubt` is the
  // largest share of such contacts in a mean over contacts.
  const Real count = std::max<Real>(sum.most_contacts, 1.0L);
  const Real doubt = (sum.most_contacts - sum.least_contacts) / count;
  for (Bounded &component : sum.fabric) {
    component.value /= count;
    component.error = component.error / count + 2.0L * doubt;
  }
  sum.mean_overlap.value /= count;
  sum.mean_overlap.error =
      sum.mean_overlap.error / count + doubt * (sum.mean_overlap.value + sum.mean_overlap.error);

  Real grain_force_sum = 0.0L, grain_force_error = 0.0L, solid = 0.0L;
  for (int i = 0; i < n; ++i) {
    grain_force_sum += std::hypot(grain_force[2 * i], grain_force[2 * i + 1]) / n;
    grain_force_error += (1.5L * force_error[i] + 0.5L * unit_of_sizes) / n;    // two components
    for (int a = 0; a < 2; ++a) sum.force.push_back({grain_force[2 * i + a], force_error[i]});
    sum.torque.push_back({torque[i], torque_error[i]});
    const Real r = state.radius[i], cx = state.velocity[2 * i], cy = state.velocity[2 * i + 1],
               spin = state.spin[i];
    const Real mass = material.density * M_PIl * r * r * material.mass_depth;
    sum.kinetic_energy.value += 0.5L * mass * (cx * cx + cy * cy + 0.5L * r * r * spin * spin);
    solid += M_PIl * r * r;
  }
  // Velocities, spins and radii have the precision of the format; the sum is in double.
  sum.kinetic_energy.error = 8.0L * std::max<Real>(u, n * 0x1p-53L) * sum.kinetic_energy.value;
  sum.void_ratio.value = area / solid - 1.0L;
  sum.void_ratio.error = (2.0L * w + (n + 8.0L) * 0x1p-53L) * (area / solid) +
      8.0L * 0x1p-53L * cell_size * cell_size / solid;
  const Real mean_force = force_sum / count,
             mean_error = force_sum_error / count + doubt * mean_force;
  sum.unbalanced_ratio.value = mean_force > 0.0L ? grain_force_sum / mean_force : 0.0L;
  sum.unbalanced_ratio.error = mean_force > mean_error
      ? (grain_force_error + sum.unbalanced_ratio.value * mean_error) / (mean_force - mean_error)
      : HUGE_VALL;
  return sum;
}

}    // namespace rve_test
