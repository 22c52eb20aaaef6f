// SPDX-License-Identifier: GPL-2.0-only
// Servo control that brings RVEs to given stresses. Each call of the engine makes some DEM steps of
// all RVEs that have not reached their stress. Two files use this control: in_situ for stresses in
// situ, and fresh_rves for fresh RVEs, which get the stresses of the RVEs that they replace.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/servo_modes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace macro {

/// Goal of the stress of an RVE in the axes of the continuum; disks use the first two. Components
/// that are not steered keep their strain.
struct StressGoal {
  rve::Tensor3 stress = rve::Tensor3::zero();    ///< Cauchy, tension positive [stress]
  bool steered[3][3] = {};                       ///< set on and above the diagonal

  /// Goal for ground at rest: `vertical_stress` along the axis `vertical` (1 in the plane, 2 in
  /// space), `k0` times this stress along the other axes, no shear. Without `lateral` the lateral
  /// strains are held, and the lateral stresses follow from the grains.
  static StressGoal at_rest(int vertical, double vertical_stress, double k0, bool lateral);

  /// Goal with all components of a symmetric tensor in the first D axes.
  template <int D> static StressGoal of(const rve::Tensor<double, D> &stress);
};

/// State of one RVE on its way to its goal.
template <int D> struct WayToStress {
  std::size_t index;          ///< index among the goals
  int slot;                   ///< number in the engine
  rve::DriveOf<D> drive;      ///< drive of a call; without a servo the cell is held
  double tolerance;           ///< largest error of a steered component [stress]
  double unbalanced_ratio;    ///< largest unbalanced force ratio at rest [-]
  std::int64_t steps = 0;     ///< DEM steps so far

  /// Servo for the goal with `steps_per_call` DEM steps. The caller sets time step, gain and
  /// largest rate.
  static rve::DriveOf<D> servo(const StressGoal &goal, int steps_per_call);

  /// Largest error of a steered component [stress].
  double error(const rve::ResultOf<D> &result) const
  {
    return rve::servo_error(drive, result.stress);
  }
  bool has_stress(const rve::ResultOf<D> &result) const { return error(result) <= tolerance; }
  bool is_at_rest(const rve::ResultOf<D> &result) const
  {
    return has_stress(result) && result.unbalanced_ratio <= unbalanced_ratio;
  }
};

/// Advances RVEs call by call until each way has ended.
///   drives(ways, slots)       returns the drives of the next call
///   advance(slots, drives)    makes the call
///   has_ended(way, k)         returns true if the k-th way of the call has ended
/// The steps of an RVE do not depend on the other ways.
template <class Way, class Drives, class Advance, class HasEnded>
void lead(std::vector<Way> ways, const Drives &drives, const Advance &advance,
          const HasEnded &has_ended)
{
  while (!ways.empty()) {
    std::vector<int> slots;
    for (const Way &way : ways) slots.push_back(way.slot);
    const auto calls = drives(ways, slots);
    advance(slots, calls);
    std::size_t left = 0;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      ways[k].steps += calls[k].substeps;
      if (!has_ended(ways[k], k)) ways[left++] = ways[k];
    }
    ways.resize(left, ways.front());
  }
}

}    // namespace macro
