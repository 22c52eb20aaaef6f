// SPDX-License-Identifier: GPL-2.0-only
// Packings for benchmarks: a given packing with another number of grains or another contact law.

#pragma once

#include "rve/core/error.h"
#include "rve/core/space.h"
#include "rve/engine/engine.h"
#include "rve/engine/packing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace bench {

/// Returns the result of a call without steps, which has the stress of the state.
template <int D> rve::ResultOf<D> evaluate(const rve::RveStateOf<D> &state)
{
  rve::Options options;
  options.contacts = rve::contacts_of(state);
  options.format = rve::Format::Double;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  const auto engine = rve::make_engine<D>(options);
  std::vector<rve::ResultOf<D>> results;
  engine->advance({engine->add(state)}, {rve::DriveOf<D>()}, results);
  return results[0];
}

template <int D> double mean_radius(const rve::RveStateOf<D> &state)
{
  double sum = 0.0;
  for (const double r : state.radius) sum += r;
  return sum / state.num_grains();
}

template <int D> void forget_tangential_forces(rve::RveStateOf<D> &state)
{
  for (rve::PairOf<D> &pair : state.pairs) pair.tangential_force = {};
}

/// Returns the packing with Hertz' and Mindlin's law and without its tangential forces. At the mean
/// overlap, the contact of two mean grains has the same normal force as with the linear law: the
/// secant stiffnesses are equal.
template <int D> rve::RveStateOf<D> with_hertz_contacts(rve::RveStateOf<D> state)
{
  rve::require(state.material.law == rve::ContactLaw::Linear,
               "a packing of the linear law is needed to make one of Hertz' law of it, got " +
                   std::string(word_of(state.material.law)));
  const double radius = mean_radius(state);
  const double overlap = evaluate(state).mean_overlap * 2.0 * radius;
  const double contact_radius = std::sqrt(0.5 * radius * overlap);    // sqrt(R* delta)
  rve::Material &material = state.material;
  material.law = rve::ContactLaw::Hertz;
  material.hertz_stiffness = material.normal_stiffness / contact_radius;
  material.mindlin_stiffness = material.tangential_stiffness / contact_radius;
  material.mindlin_displacement = 1.0;
  material.normal_stiffness = material.tangential_stiffness = 0.0;
  material.normal_viscosity = material.tangential_viscosity = 0.0;
  forget_tangential_forces(state);
  return state;
}

/// Returns a packing of copies of `tile` next to each other, `copies[a]` along cell vector a. It
/// has no pair list and no contact history. Coordinates are exact to 2^-64 of the cell.
template <int D>
rve::RveStateOf<D> tiled(const rve::RveStateOf<D> &tile, const std::array<int, D> &copies)
{
  constexpr int spins = rve::Space<D>::spins;
  rve::RveStateOf<D> state = tile;
  int tiles = 1;
  for (int b = 0; b < D; ++b) {
    tiles *= copies[b];
    for (int a = 0; a < D; ++a) state.cell(a, b) *= copies[b];
  }
  state.radius.clear();
  state.fractional.clear();
  state.velocity.clear();
  state.spin.clear();
  state.pairs.clear();
  state.order.clear();
  state.list_cell = rve::Tensor<double, D>::zero();
  state.list_fractional.clear();
  for (int k = 0; k < tiles; ++k)
    for (int i = 0; i < tile.num_grains(); ++i) {
      state.radius.push_back(tile.radius[i]);
      for (int a = 0; a < spins; ++a) state.spin.push_back(tile.spin[spins * i + a]);
      int rest = k;
      for (int a = 0; a < D; ++a) {
        const std::uint64_t width = ~std::uint64_t(0) / copies[a];
        const std::uint64_t place = rest % copies[a];
        rest /= copies[a];
        state.fractional.push_back(tile.fractional[D * i + a] / copies[a] + place * width);
        state.velocity.push_back(tile.velocity[D * i + a]);
      }
    }
  return state;
}

/// Returns D factors of a number that are nearly equal, the largest first.
template <int D> std::array<int, D> nearly_equal_factors(int number)
{
  std::array<int, D> factors;
  for (int a = D - 1; a > 0; --a) {
    int divisor = static_cast<int>(std::pow(number, 1.0 / (a + 1)) + 1e-9);
    while (number % divisor != 0) --divisor;
    factors[a] = divisor;
    number /= divisor;
  }
  factors[0] = number;
  return factors;
}

/// Returns a packing of the same material, radii and pressure, prepared without friction to a
/// tolerance of 1 % of the pressure.
template <int D> rve::RveStateOf<D> prepared_like(const rve::RveStateOf<D> &model, int num_grains)
{
  rve::PackingRecipe recipe;
  recipe.material = model.material;
  recipe.pressure = evaluate(model).mean_stress();
  recipe.num_grains = num_grains;
  recipe.radius_min = *std::min_element(model.radius.begin(), model.radius.end());
  recipe.radius_max = *std::max_element(model.radius.begin(), model.radius.end());
  recipe.stress_tolerance = recipe.unbalanced_tolerance = 1e-2;
  rve::Options options;
  options.contacts = rve::contacts_of(model);
  options.format = rve::Format::Mixed;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  const auto engine = rve::make_engine<D>(options);
  return rve::generate_packing(recipe, *engine);
}

/// Returns a packing of `num_grains` grains like `model`. It consists of copies of a tile. The
/// number of grains of the tile is the largest divisor of `num_grains` that is at most the number
/// of grains of `model`. The tile is `model` if the two numbers are equal. Otherwise
/// prepared_like() makes it.
template <int D> rve::RveStateOf<D> packing_of(const rve::RveStateOf<D> &model, int num_grains)
{
  int copies = 1;
  while (num_grains % copies != 0 || num_grains / copies > model.num_grains()) ++copies;
  const int grains = num_grains / copies;
  const rve::RveStateOf<D> tile = grains == model.num_grains() ? model
                                                               : prepared_like(model, grains);
  return copies == 1 ? tile : tiled<D>(tile, nearly_equal_factors<D>(copies));
}

}    // namespace bench
