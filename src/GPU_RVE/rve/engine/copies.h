// SPDX-License-Identifier: GPL-2.0-only
// Enlargement of a periodic cell: a copy of the cell with its grains is placed next to it. Host
// only.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Largest relative difference between the velocities of a grain and its copy [-]. It is a few
/// rounding units of fp32, the narrowest format.
constexpr double PARTING = 1.0 / (1 << 21);

/// Returns the state of the same medium in a cell of twice the width along its narrowest axis.
/// Lattice reduction comes first. Grain i of N then gets a copy with the number i + N. Pairs keep
/// their history; the result has no list, so the engine builds one. Stresses and other intensive
/// quantities are unchanged; sums over grains double. Positions lose at most one bit of the format.
///
/// The velocities of a grain and of its copy differ by up to a share PARTING. Equal velocities
/// would stay equal, since arithmetic with wrapping coordinates gives the same bits anywhere in the
/// cell. The medium would then keep the period of half a cell.
template <int D> RveStateOf<D> side_by_side(const RveStateOf<D> &state);

/// Returns true if a medium that side_by_side() has enlarged is still periodic with a period of
/// about one grain in some direction. The number of grains is `copies` times the original number,
/// and `copies` is a power of two. The function tests if most grains have the same offset to their
/// copies, and if this offset is at most 1.5 times the largest diameter long. In such a medium a
/// grain is its own neighbour and moves with the mean field in that direction, so a wider cell adds
/// no information. Copies that have moved apart count as different grains.
template <int D> bool is_one_grain_across(const RveStateOf<D> &state, int copies);

}    // namespace rve
