#include "rve/engine/cell_width.h"

#include "rve/algorithm/image.h"
#include "rve/physics/cell.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rve {

std::array<double, 2> least_share_of_widths(const RveState &state, double skin)
{
  const double largest = *std::max_element(state.radius.begin(), state.radius.end());
  const double mean =
      std::accumulate(state.radius.begin(), state.radius.end(), 0.0) / state.num_grains();
  const double cutoff = 2.0 * largest + (skin > 0.0 ? skin : kDefaultSkinShare * mean);
  return {2.0 * cutoff / perpendicular_width(state.cell, 0),
          2.0 * cutoff / perpendicular_width(state.cell, 1)};
}

double grains_across(const RveState &state)
{
  double squares = 0.0;
  for (const double r : state.radius) squares += r * r;
  return std::min(perpendicular_width(state.cell, 0), perpendicular_width(state.cell, 1)) /
      (2.0 * std::sqrt(squares / state.num_grains()));
}

}    // namespace rve
