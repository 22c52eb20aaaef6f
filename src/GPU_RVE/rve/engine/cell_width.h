// SPDX-License-Identifier: GPL-2.0-only
// How wide a periodic cell must be for its grains, and a list of neighbours. Host only.

#pragma once

#include "rve/engine/state.h"

#include <array>

namespace rve {

/// Shares of the widths across the faces of the cell, first that along x, down to which a cell can be compressed before half of it is
/// no wider than two largest grains that touch and the skin: then a grain could meet two images of another one, and the RVE fails.
/// `skin` as in Options [length].
template <int D>
std::array<double, D> least_share_of_widths(const RveStateOf<D> &state, double skin);

/// How far apart, beyond touching, grains are that a list has: the reach of the law and the skin, as in Options [length].
template <int D> double list_margin_of(const RveStateOf<D> &state, double skin);

/// The least width of the cell over the mean size of its grains, that of disks with their mean area or of spheres with their mean volume [-].
template <int D> double grains_across(const RveStateOf<D> &state);

}    // namespace rve
