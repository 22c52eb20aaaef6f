// SPDX-License-Identifier: GPL-2.0-only
// Functions that depend only on a recipe, for the source files of the preparation
// (engine/packing.h).

#pragma once

#include "rve/engine/packing.h"

#include <cmath>
#include <numeric>

namespace rve {

inline double mean_radius(const PackingRecipe &recipe)
{
  if (recipe.radii.empty()) return 0.5 * (recipe.radius_min + recipe.radius_max);
  return std::accumulate(recipe.radii.begin(), recipe.radii.end(), 0.0) /
      static_cast<double>(recipe.radii.size());
}

/// Returns the pressure before the anisotropic stress is applied [stress].
inline double isotropic_pressure(const PackingRecipe &recipe)
{
  return recipe.at_rest ? START_AT_REST * recipe.pressure : recipe.pressure;
}

/// Returns the edge of a square of this area, or of a cube of this volume [length].
template <int D> double edge_of_volume(double volume)
{
  return D == 2 ? std::sqrt(volume) : std::cbrt(volume);
}

}    // namespace rve
