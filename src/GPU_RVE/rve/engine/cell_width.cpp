// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/cell_width.h"

#include "rve/algorithm/device_state.h"
#include "rve/engine/contact_laws.h"
#include "rve/physics/cell.h"
#include "rve/physics/solid_cell.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rve {

template <int D> double list_margin_of(const RveStateOf<D> &state, double skin)
{
  const double mean =
      std::accumulate(state.radius.begin(), state.radius.end(), 0.0) / state.num_grains();
  return reach_of(state.material) + (skin > 0.0 ? skin : kDefaultSkinShare<D> * mean);
}

template <int D>
std::array<double, D> least_share_of_widths(const RveStateOf<D> &state, double skin)
{
  const double largest = *std::max_element(state.radius.begin(), state.radius.end());
  const double cutoff = 2.0 * largest + list_margin_of(state, skin);
  std::array<double, D> shares;
  for (int a = 0; a < D; ++a) shares[a] = 2.0 * cutoff / perpendicular_width(state.cell, a);
  return shares;
}

template <int D> double grains_across(const RveStateOf<D> &state)
{
  double sum = 0.0, least = perpendicular_width(state.cell, 0);
  for (const double r : state.radius) sum += times_power<D>(1.0, r);
  for (int a = 1; a < D; ++a) least = std::min(least, perpendicular_width(state.cell, a));
  const double mean = sum / state.num_grains();    // mean of r^D
  return least / (2.0 * (D == 2 ? std::sqrt(mean) : std::cbrt(mean)));
}

template double list_margin_of(const RveStateOf<2> &, double);
template double list_margin_of(const RveStateOf<3> &, double);
template std::array<double, 2> least_share_of_widths<2>(const RveStateOf<2> &, double);
template std::array<double, 3> least_share_of_widths<3>(const RveStateOf<3> &, double);
template double grains_across(const RveStateOf<2> &);
template double grains_across(const RveStateOf<3> &);

}    // namespace rve
