// SPDX-License-Identifier: GPL-2.0-only
// Checks of recipes, and the cloud of grains at the beginning of a preparation.

#include "rve/core/error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/grain_bins.h"
#include "rve/engine/packing_recipe.h"

#include <algorithm>
#include <random>

namespace rve {

namespace {

  /// Default and largest solid fraction of a loose cloud. Random addition of grains jams at
  /// somewhat larger fractions.
  template <int D> struct CloudFraction;
  template <> struct CloudFraction<2> {
    static constexpr double usual = 0.4, most = 0.5;    // jams at 0.55
  };
  template <> struct CloudFraction<3> {
    static constexpr double usual = 0.25, most = 0.33;    // jams at 0.38
  };

  template <int D> double initial_solid_fraction(const PackingRecipe &recipe)
  {
    return recipe.initial_solid_fraction.value_or(CloudFraction<D>::usual);
  }

  template <int D> void check_recipe(const PackingRecipe &recipe)
  {
    const auto in_range = [](double value, double least, double most, const char *what) {
      require(value >= least && value <= most, what, " is ", value, "; it must lie between ", least,
              " and ", most);
    };
    constexpr double LARGEST = 1e300;
    constexpr double LEAST = 1e-300;
    require(recipe.pressure > 0.0, "pressure of the packing is ", recipe.pressure,
            " [stress]; it must be greater than 0: a pressure is positive in compression, where "
            "stresses are negative");
    in_range(recipe.pressure, LEAST, LARGEST, "pressure of the packing [stress]");
    in_range(recipe.preparation_friction, 0.0, LARGEST, "preparation friction [-]");
    in_range(recipe.preparation_damping, 0.0, 0.99, "preparation damping [-]");
    in_range(recipe.stress_tolerance, 1e-12, 0.5, "stress tolerance of the packing [-]");
    in_range(recipe.unbalanced_tolerance, 1e-12, 0.5,
             "unbalanced force tolerance of the packing [-]");
    in_range(initial_solid_fraction<D>(recipe), 0.01, CloudFraction<D>::most,
             "initial solid fraction [-]");
    in_range(recipe.k0, 0.01, 100.0, "ratio k0 of lateral to vertical stress [-]");
    in_range(static_cast<double>(recipe.max_steps), 1.0, LARGEST, "number of steps of the packing");
    in_range(recipe.void_ratio_tolerance, 1e-9, LARGEST, "void ratio tolerance [-]");
    if (recipe.void_ratio) in_range(*recipe.void_ratio, 1e-3, 10.0, "void ratio [-]");
    if (!recipe.radii.empty()) {
      for (const double r : recipe.radii) in_range(r, LEAST, LARGEST, "grain radius [length]");
      return;
    }
    in_range(recipe.num_grains, 1.0, INT32_MAX / 4, "number of grains");
    in_range(recipe.radius_min, LEAST, LARGEST, "smallest grain radius [length]");
    in_range(recipe.radius_max, recipe.radius_min, LARGEST, "largest grain radius [length]");
  }

  /// Checks material and radii. The search for the overlap at a pressure would not end if forces
  /// did not grow with overlaps.
  template <int D> void check_material(const PackingRecipe &recipe)
  {
    RveStateOf<D> grains;
    grains.material = recipe.material;
    grains.radius = recipe.radii;
    if (grains.radius.empty()) grains.radius = {recipe.radius_min, recipe.radius_max};
    grains.check_sizes();
  }

}    // namespace

template <int D> double contact_strain(const PackingRecipe &recipe)
{
  check_recipe<D>(recipe);
  check_material<D>(recipe);
  return contact_strain<D>(recipe.pressure, recipe.material, mean_radius(recipe));
}

template <int D> RveStateOf<D> loose_cloud(const PackingRecipe &recipe)
{
  check_recipe<D>(recipe);
  // The C++ standard fixes the output of the generator, but not that of the distributions.
  std::mt19937_64 random(recipe.seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };

  RveStateOf<D> state;
  state.material = recipe.material;
  state.radius = recipe.radii;
  if (state.radius.empty())
    for (int i = 0; i < recipe.num_grains; ++i)
      state.radius.push_back(recipe.radius_min +
                             (recipe.radius_max - recipe.radius_min) * uniform());
  const int n = state.num_grains();
  state.fractional.resize(D * n);
  state.velocity.resize(D * n, 0.0);
  state.spin.resize(Space<D>::spins * n, 0.0);
  const double side = edge_of_volume<D>(state.solid_volume() / initial_solid_fraction<D>(recipe));
  state.cell = side * Tensor<double, D>::identity();
  state.check();

  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int i, int j) { return state.radius[i] > state.radius[j]; });
  GrainBins<D> bins(state.cell, 2.0 * state.radius[order.front()]);
  const auto touches = [&](int grain, int other) {
    const Vec<double, D> branch = branch_vector(state, grain, other);
    const double contact_distance = state.radius[grain] + state.radius[other];
    return dot(branch, branch) <= contact_distance * contact_distance;
  };
  constexpr int MOST_ATTEMPTS = 1000000;
  for (const int grain : order) {
    int attempt = 0;
    do {
      require(attempt++ < MOST_ATTEMPTS, "grain ", grain + 1,
              " does not fit into the cell at initial solid fraction ",
              initial_solid_fraction<D>(recipe), "; use a smaller initial solid fraction");
      for (int a = 0; a < D; ++a) state.fractional[D * grain + a] = random();
    } while (bins.any_near(state, grain, [&](int other) { return touches(grain, other); }));
    bins.add(state, grain);
  }
  return state;
}

template double contact_strain<2>(const PackingRecipe &);
template double contact_strain<3>(const PackingRecipe &);
template RveStateOf<2> loose_cloud(const PackingRecipe &);
template RveStateOf<3> loose_cloud(const PackingRecipe &);

}    // namespace rve
