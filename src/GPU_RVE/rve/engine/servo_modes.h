// SPDX-License-Identifier: GPL-2.0-only
// Servo modes: the directions in which a stress servo changes the velocity gradient. They follow
// from conditions on rates and on stresses. Each condition prescribes a weighted sum of components.
//
// Tensors are written as vectors of their components on and above the diagonal: the stress as sigma
// = (s_xx, ..., s_xy, ...), the velocity gradient as l = (L_xx, ..., L_xy, ...). Each component of
// l is the work conjugate of that of sigma, since the servo shears along x. The conditions on rates
// are E l = r, the conditions on stresses C sigma = g. Together there are as many conditions as
// components. E^+ and C^+ are pseudo-inverses. The servo uses l = E^+ r + sum_k a_k w_k with
// amplitudes a_k [1/time]. The modes w_k are the columns of W = P C^+. C^+ e is the smallest stress
// change that removes the error e of the stress conditions. P projects on the motions with E l = 0,
// which the conditions on rates leave free.
//
// Let S be the stiffness of the material. If the controlled stresses are the work conjugates of the
// free motions, P C^T = C^T, the stiffness C S W of the modes has positive eigenvalues for every
// positive definite S. The servo then oscillates about its goal, and no property of the material is
// needed. A single controlled component is its own mode.

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

/// Return the row and column of component c.
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
  /// Columns of E^+: velocity gradients for which one rate of a condition is 1 and the other rates
  /// and all amplitudes are 0.
  std::vector<Tensor<double, D>> unit_rates;
  /// Columns of C^+: stresses for which one sum of a condition is 1 and the others are 0.
  std::vector<Tensor<double, D>> unit_stresses;

  /// Throws InputError unless there are as many conditions as components, and they determine the
  /// motion.
  ServoModesOf(const std::vector<ComponentSum<D>> &rates,
               const std::vector<ComponentSum<D>> &stresses);
};

/// Returns the largest difference between a controlled stress and its goal, for single components
/// or for modes, which the prescribed motion must contain [stress].
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
