// SPDX-License-Identifier: GPL-2.0-only
// Mean velocity of the grains of a packing that comes from elsewhere.

#pragma once

#include "rve/engine/state.h"

#include <string>

namespace rve {

/// Mean peculiar velocity by mass [length/time] if it is most of the motion of the grains, otherwise zero. A periodic packing has no use for it, and
/// local damping acts on it in place of the fluctuations. It is zero, too, where it moves a grain in a stable time step by less than 1e-7 of the smallest
/// radius: the grains are at rest but for rounding. Runs leave a mean velocity of a few percent of the fluctuations. The state must be sound.
template <int D> Vec<double, D> drift_of(const RveStateOf<D> &state);

/// Subtracts a velocity from that of all grains.
template <int D> void remove_drift(RveStateOf<D> &state, const Vec<double, D> &drift);

/// "mean velocity (10, -5) [length/time]"; empty without a drift.
template <int D> std::string describe_drift(const Vec<double, D> &drift);

}    // namespace rve
