// SPDX-License-Identifier: GPL-2.0-only
// Servo modes: the directions in which a stress servo changes the velocity gradient. The modes
// follow from conditions on rates and on stresses. Each condition prescribes a weighted sum of
// tensor components.
//
// Tensors are written as vectors of their components on and above the diagonal: the stress as sigma
// = (s_xx, ..., s_xy, ...), the velocity gradient as l = (L_xx, ..., L_xy, ...). Each component of
// l is work conjugate to the same component of sigma, since the servo shears along x. The
// conditions on rates are E l = r with the prescribed sums r. The conditions on stresses are C
// sigma = g with the goals g. The number of all conditions equals the number of components. E^+ and
// C^+ are the pseudo-inverses of E and C. The servo uses l = E^+ r + sum_k a_k w_k with amplitudes
// a_k [1/time]. The modes w_k are the columns of W = P C^+. C^+ e is the smallest stress change
// that removes the error e of the stress conditions. P projects on the free motions, those with E l
// = 0.
//
// Let S be the stiffness of the material. If the controlled stresses are work conjugate to the free
// motions (P C^T = C^T), the stiffness C S W of the modes has positive eigenvalues for every
// positive definite S. The servo then oscillates about its goal, and it needs no property of the
// material. A single controlled component is its own mode.

#pragma once

#include "rve/engine/engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace rve {

/// Weighted sum of tensor components: the factor of each component, the diagonal first, then xy,
/// xz, yz [-].
template <int D> using ComponentSum = std::array<double, Space<D>::strains>;

/// strain_row() and strain_column() return the row and the column of component c.
template <int D> constexpr int strain_row(int c)
{
  return c < D ? c : D == 2 || c < 5 ? 0 : 1;
}
template <int D> constexpr int strain_column(int c)
{
  return c < D ? c : D == 2 || c == 3 ? 1 : 2;
}
/// Returns "xx", "xy", ...
template <int D> std::string strain_name(int c)
{
  return {"xyz"[strain_row<D>(c)], "xyz"[strain_column<D>(c)]};
}

/// Returns the weighted sum of the components of the symmetric part of a tensor.
template <int D> double sum_of(const ComponentSum<D> &factors, const Tensor<double, D> &symmetric)
{
  double sum = 0.0;
  for (int c = 0; c < Space<D>::strains; ++c) {
    const int a = strain_row<D>(c), b = strain_column<D>(c);
    sum += factors[c] * (a == b ? symmetric(a, a) : 0.5 * (symmetric(a, b) + symmetric(b, a)));
  }
  return sum;
}

template <int D> struct ServoModesOf {
  std::vector<ServoModeOf<D>> modes;    ///< one for each stress condition
  /// Columns of E^+. Column k is the velocity gradient with E_k l = 1 for rate condition k, zero
  /// for the other rate conditions, and zero amplitudes.
  std::vector<Tensor<double, D>> unit_rates;
  /// Columns of C^+. Column k is the stress with C_k sigma = 1 for stress condition k and zero for
  /// the others.
  std::vector<Tensor<double, D>> unit_stresses;

  /// Throws InputError unless the number of conditions equals the number of components, and the
  /// conditions determine the motion.
  ServoModesOf(const std::vector<ComponentSum<D>> &rates,
               const std::vector<ComponentSum<D>> &stresses);
};

/// Returns the largest difference between a controlled stress and its goal [stress]. With servo
/// modes the controlled stresses are the weighted sums of the modes in `drive`, otherwise the
/// single components.
template <int D> double servo_error(const DriveOf<D> &drive, const Tensor<double, D> &stress)
{
  double largest = 0.0;
  const auto see = [&](double error) { largest = std::max(largest, std::fabs(error)); };
  const Tensor<double, D> lack = drive.stress_goal - stress;
  for (int k = 0; k < drive.num_modes; ++k) {
    double error = 0.0;
    for (int c = 0; c < Space<D>::components; ++c)
      error += drive.modes[k].stress.component[c] * lack.component[c];
    see(error);
  }
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b)
      if (drive.num_modes == 0 && drive.controlled[a][b])
        see(drive.stress_goal(a, b) - 0.5 * (stress(a, b) + stress(b, a)));
  return largest;
}

}    // namespace rve
