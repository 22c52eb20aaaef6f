// SPDX-License-Identifier: GPL-2.0-only
// Packings of a few grains, whose cells soon become too narrow when stretched.

#pragma once

#include "rve/engine/packing.h"
#include "support/on_device.h"
#include "support/spheres.h"

namespace rve_test {

/// Returns options for the device of the test, with energy bookkeeping.
inline rve::Options options_of_dimension(int dimension, rve::Format format = rve::Format::Double)
{
  rve::Options options = device_options(format);
  options.contacts.dimension = dimension;
  options.track_energy = true;
  return options;
}

/// Returns 30 disks or 60 spheres of 4 to 5 mm at 100 kPa. More friction during preparation gives a
/// looser packing.
template <int D> rve::RveStateOf<D> small_packing(double preparation_friction = 0.0)
{
  rve::PackingRecipe recipe;
  recipe.material = D == 2 ? paper_material() : spheres_material();
  recipe.pressure = 1e5;
  recipe.num_grains = D == 2 ? 30 : 60;
  recipe.radius_min = 0.004;
  recipe.radius_max = 0.005;
  recipe.preparation_friction = preparation_friction;
  return rve::generate_packing(recipe, *rve::make_engine<D>(options_of_dimension(D)));
}

/// Stable time step of small_packing() [time]. Disks have a mass depth of one.
template <int D> constexpr double DT_OF_SMALL_PACKINGS = D == 2 ? 2e-5 : 4e-6;

}    // namespace rve_test
