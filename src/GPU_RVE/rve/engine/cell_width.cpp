#include "rve/engine/cell_width.h"

#include "rve/algorithm/image.h"
#include "rve/physics/cell.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rve {

template <int D>
std::array<double, D> least_share_of_widths(const RveStateOf<D> &state, double skin)
{
  const double largest = *std::max_element(state.radius.begin(), state.radius.end());
  const double mean =
      std::accumulate(state.radius.begin(), state.radius.end(), 0.0) / state.num_grains();
  const double cutoff = 2.0 * largest + (skin > 0.0 ? skin : kDefaultSkinShare * mean);
  std::array<double, D> shares;
  for (int a = 0; a < D; ++a) shares[a] = 2.0 * cutoff / perpendicular_width(state.cell, a);
  return shares;
}

double grains_across(const RveState &state)
{
  double squares = 0.0;
  for (const double r : state.radius) squares += r * r;
  return std::min(perpendicular_width(state.cell, 0), perpendicular_width(state.cell, 1)) /
      (2.0 * std::sqrt(squares / state.num_grains()));
}

template std::array<double, 2> least_share_of_widths<2>(const RveStateOf<2> &, double);

}    // namespace rve
