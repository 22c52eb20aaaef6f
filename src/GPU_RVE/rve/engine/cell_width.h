// SPDX-License-Identifier: GPL-2.0-only
// Required width of a periodic cell for its grains and its neighbour list. Host only.

#pragma once

#include "rve/engine/state.h"

#include <array>

namespace rve {

/// Returns how far the cell can be compressed: for each pair of opposite faces, x first, the
/// smallest allowed ratio of the compressed width to the present width [-]. Below that ratio half
/// of the width is smaller than the largest distance of a listed pair. A grain could then touch two
/// images of another grain, so the RVE would fail. `skin` as in Options [length].
template <int D>
std::array<double, D> least_share_of_widths(const RveStateOf<D> &state, double skin);

/// Returns the gap up to which the list contains pairs: the reach of the law plus the skin
/// [length]. `skin` as in Options.
template <int D> double list_margin_of(const RveStateOf<D> &state, double skin);

/// Returns the smallest width of the cell over the mean grain size [-]. The mean size is that of
/// disks of the mean area or of spheres of the mean volume.
template <int D> double grains_across(const RveStateOf<D> &state);

}    // namespace rve
