// SPDX-License-Identifier: GPL-2.0-only
// RVEs on their way to a stress: a servo steers each of them in calls of some DEM steps, all that are under way together.
//
// Why: RVEs are brought to the stresses in the ground before anything happens (in_situ), and fresh ones to those of the RVEs that they replace (fresh_rves).

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/servo_modes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace macro {

/// The stress that an RVE shall have, in the axes of the continuum: those of disks have the first two. What is not steered keeps its strain.
struct StressGoal {
  rve::Tensor3 stress = rve::Tensor3::zero();    ///< Cauchy, tension positive [stress]
  bool steered[3][3] = {};                       ///< on and above the diagonal

  /// Earth at rest: the vertical stress along `vertical` (1 in the plane, 2 in space), `k0` times it along the others, no shear; without
  /// `lateral` the sides are held, and the lateral stresses are what the grains make of it.
  static StressGoal at_rest(int vertical, double vertical_stress, double k0, bool lateral);

  /// Components of the symmetric tensor in the leading `dimension` axes.
  template <int D> static StressGoal of(const rve::Tensor<double, D> &stress);
};

/// Of one RVE.
template <int D> struct WayToStress {
  std::size_t place;          ///< among those that are led
  int slot;                   ///< in the engine
  rve::DriveOf<D> drive;      ///< of a call; without a servo the grains are left to themselves
  double tolerance;           ///< of each steered component [stress]
  double unbalanced_ratio;    ///< of forces, at rest [-]
  std::int64_t steps = 0;     ///< DEM steps so far

  /// A servo for the goal, `steps_per_call` steps at a time; time step, gain and largest rate are still to be chosen.
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

/// Call after call until each way has ended.
///   drives(ways, slots)             what the RVEs do in the next call
///   advance(slots, drives)          does it
///   has_ended(way, k)               after it, of the k-th of them; one that goes on is in the next call
/// An RVE makes the same steps whichever others are under way.
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
