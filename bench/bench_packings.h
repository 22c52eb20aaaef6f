// Packings of any number of grains, made from one that is given.

#ifndef BENCH_PACKINGS_H
#define BENCH_PACKINGS_H

#include "rve/engine/engine.h"
#include "rve/engine/packing.h"

#include <algorithm>
#include <cmath>

namespace bench {

/// What a call without steps says of a state: its stress, in particular.
inline rve::Result look_at(const rve::RveState &state)
{
  rve::Options options;
  options.format = rve::Format::Double;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  const auto engine = rve::make_engine(options);
  std::vector<rve::Result> results;
  engine->advance({engine->add(state)}, {rve::Drive()}, results);
  return results[0];
}

/// nx by ny copies side by side, without list and contact history. Coordinates stay exact to 2^-64 of the cell.
inline rve::RveState tiled(const rve::RveState &tile, int nx, int ny)
{
  const int copies[2] = {nx, ny};
  rve::RveState state = tile;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) state.cell(a, b) *= copies[b];
  state.radius.clear();
  state.fractional.clear();
  state.velocity.clear();
  state.spin.clear();
  state.pairs.clear();
  state.order.clear();
  state.list_cell = rve::Tensor2::zero();
  state.list_fractional.clear();
  for (int k = 0; k < nx * ny; ++k)
    for (int i = 0; i < tile.num_grains(); ++i) {
      const std::uint64_t place[2] = {std::uint64_t(k % nx), std::uint64_t(k / nx)};
      state.radius.push_back(tile.radius[i]);
      state.spin.push_back(tile.spin[i]);
      for (int a = 0; a < 2; ++a) {
        const std::uint64_t width = ~std::uint64_t(0) / copies[a];
        state.fractional.push_back(tile.fractional[2 * i + a] / copies[a] + place[a] * width);
        state.velocity.push_back(tile.velocity[2 * i + a]);
      }
    }
  return state;
}

/// The divisor of n that is nearest to its root from below.
inline int near_root(int n)
{
  int divisor = static_cast<int>(std::sqrt(static_cast<double>(n)));
  while (n % divisor != 0) --divisor;
  return divisor;
}

/// A packing of the same material and radii at the same pressure, prepared without friction, to a hundredth of the pressure.
inline rve::RveState prepared_like(const rve::RveState &model, int num_grains)
{
  rve::PackingRecipe recipe;
  recipe.material = model.material;
  recipe.pressure = look_at(model).mean_stress();
  recipe.num_grains = num_grains;
  recipe.radius_min = *std::min_element(model.radius.begin(), model.radius.end());
  recipe.radius_max = *std::max_element(model.radius.begin(), model.radius.end());
  recipe.stress_tolerance = recipe.unbalanced_tolerance = 1e-2;
  rve::Options options;
  options.format = rve::Format::Mixed;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  const auto engine = rve::make_engine(options);
  return rve::generate_packing(recipe, *engine);
}

/// A packing of `num_grains` like `model`: copies of it where the number is a multiple of its own, and otherwise copies of the
/// largest packing up to its size that fits, which is prepared first.
inline rve::RveState packing_of(const rve::RveState &model, int num_grains)
{
  int copies = 1;
  while (num_grains % copies != 0 || num_grains / copies > model.num_grains()) ++copies;
  const int grains = num_grains / copies;
  const rve::RveState tile = grains == model.num_grains() ? model : prepared_like(model, grains);
  return copies == 1 ? tile : tiled(tile, copies / near_root(copies), near_root(copies));
}

}    // namespace bench

#endif
