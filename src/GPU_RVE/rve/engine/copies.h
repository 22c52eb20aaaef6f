// SPDX-License-Identifier: GPL-2.0-only
// Enlargement of a periodic cell by copies of its grains, side by side. Host only.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Largest relative difference between the velocities of a grain and its copy [-]. It is a few
/// rounding units of fp32, the narrowest format.
constexpr double PARTING = 1.0 / (1 << 21);

/// Returns the same medium in a cell of twice the width along its narrowest axis. The lattice is
/// reduced, and each grain i of N has a copy with the number i + N. Pairs keep their history, and
/// the list must be rebuilt. Intensive quantities such as stresses are unchanged; sums over grains
/// double. Positions lose at most one bit of the format.
///
/// Velocities of a grain and of its copy differ by up to PARTING. Arithmetic with wrapping
/// coordinates gives the same bits anywhere in the cell. Without the difference no rounding would
/// ever separate the copies, and the medium would keep the period of half a cell.
template <int D> RveStateOf<D> side_by_side(const RveStateOf<D> &state);

/// Returns true if a medium that was enlarged by side_by_side() is only one grain wide in some
/// direction. The medium has `copies` times the original grains, a power of two. The test: most
/// grains have the same offset from their copies, and the length of this offset is at most 1.5
/// times the largest diameter. A grain that is its own neighbour moves with the mean field in that
/// direction, and a wider cell adds no information. Copies that have diverged are ordinary grains.
template <int D> bool is_one_grain_across(const RveStateOf<D> &state, int copies);

}    // namespace rve
