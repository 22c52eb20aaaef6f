// SPDX-License-Identifier: GPL-2.0-only
// Removal of the mean velocity of all grains (drift) from a packing that was read from a file.

#pragma once

#include "rve/core/error.h"
#include "rve/engine/stability.h"
#include "rve/engine/state.h"
#include "rve/physics/grain_shape.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace rve {

/// Returns the drift [length/time]: the mean peculiar velocity, weighted by mass, if it exceeds the
/// root mean square of the fluctuations about it; otherwise zero. A mean velocity has no effect on
/// a periodic packing, but local damping would act on it instead of on the fluctuations. The result
/// is also zero if the mean velocity moves a grain by less than 1e-7 of the smallest radius in a
/// stable time step. The grains are then at rest except for rounding. The small mean velocity that
/// a run produces, a few percent of the fluctuations, is no drift. The state must have passed
/// check().
template <int D> Vec<double, D> drift_of(const RveStateOf<D> &state)
{
  constexpr double AT_REST =
      1e-7;    // displacement in a stable time step over the smallest radius [-]
  const int n = state.num_grains();
  double mass = 0.0;
  Vec<double, D> mean = Vec<double, D>::zero();
  for (int i = 0; i < n; ++i) {
    const double of_grain = grain_volume<D>(state.radius[i]);
    mass += of_grain;
    // The velocity of the first grain is subtracted from all velocities before they are summed, so
    // that the mean of equal velocities is exact.
    for (int a = 0; a < D; ++a)
      mean[a] += of_grain * (state.velocity[D * i + a] - state.velocity[a]);
  }
  for (int a = 0; a < D; ++a) mean[a] = state.velocity[a] + mean[a] / mass;
  double fluctuation = 0.0;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < D; ++a) {
      const double difference = state.velocity[D * i + a] - mean[a];
      fluctuation += grain_volume<D>(state.radius[i]) / mass * difference * difference;
    }
  const double squared = dot(mean, mean);
  if (!(squared > fluctuation)) return Vec<double, D>::zero();
  const double smallest = *std::min_element(state.radius.begin(), state.radius.end());
  const bool is_at_rest = std::sqrt(squared) * stable_time_step(state) <= AT_REST * smallest;
  return is_at_rest ? Vec<double, D>::zero() : mean;
}

/// Subtracts the drift from the velocities of all grains.
template <int D> void remove_drift(RveStateOf<D> &state, const Vec<double, D> &drift)
{
  for (int i = 0; i < state.num_grains(); ++i)
    for (int a = 0; a < D; ++a) state.velocity[D * i + a] -= drift[a];
}

/// Returns a text such as "mean velocity (10, -5) [length/time]"; empty without a drift.
template <int D> std::string describe_drift(const Vec<double, D> &drift)
{
  if (dot(drift, drift) == 0.0) return "";
  std::string text = "mean velocity (";
  for (int a = 0; a < D; ++a) text += (a ? ", " : "") + number(drift[a]);
  return text + ") [length/time]";
}

}    // namespace rve
