// SPDX-License-Identifier: GPL-2.0-only
// A periodic medium in a larger cell: the same grains, and copies of them side by side. Host only.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// As little as the narrowest format keeps: some roundings of 32 bits [-].
constexpr double PARTING = 1.0 / (1 << 21);

/// The same medium in a cell that is twice as wide where it is narrowest: its lattice is reduced, and each grain i of N has a copy with
/// the number i + N. Pairs go on with what they remember, from grain to grain as they are in space, and their list is to be built anew.
/// What is per volume, stresses for one, stays; sums over grains are twice as large. Positions lose one bit of the format at most, and
/// velocities of a grain and of its copy differ by PARTING of themselves: coordinates that wrap are the same to the bit wherever a grain is, so that no
/// rounding would ever part the copies, and they would go on as a medium that is half as wide as its cell.
template <int D> RveStateOf<D> side_by_side(const RveStateOf<D> &state);

/// Whether the medium of such a state, of `copies` as many grains as there were (a power of two), is one grain across: most grains are still
/// where their copies are, and these no farther apart than one and a half of the largest diameters. A grain that is its own neighbour moves with
/// the mean field in that direction, and a wider cell would tell no more. Copies whose ways have parted are grains like the others.
template <int D> bool is_one_grain_across(const RveStateOf<D> &state, int copies);

}    // namespace rve
