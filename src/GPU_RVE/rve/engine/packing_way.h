// SPDX-License-Identifier: GPL-2.0-only
// Ways to prepare a packing. A way is a sequence of legs, and a leg ends when the packing is at
// rest at the pressure of the leg. If a recipe requires a void ratio, a search finds a way that
// reaches it.

#pragma once

#include "rve/core/error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/packing_recipe.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace rve {

/// Leg of a preparation: the packing comes to rest at a pressure, with a friction.
struct Leg {
  double pressure;    // [stress]
  double friction;    // [-]
  const char *phase;
  double k0 = 1.0;         // lateral stress over the vertical stress `pressure` [-]
  bool at_rest = false;    // true: zero lateral strain, and only the vertical stress has a goal

  template <int D> bool has_goal(int axis) const { return !at_rest || axis + 1 == D; }
  /// Returns the goal of the stress along an axis; the vertical axis is the last [stress].
  template <int D> double goal(int axis) const { return axis + 1 < D ? k0 * pressure : pressure; }
};

/// Complete preparation: the initial state, the legs, the preparation friction and the highest
/// pressure `peak`.
template <int D> struct Way {
  const RveStateOf<D> *start;
  std::vector<Leg> legs;
  double friction;    // [-]
  double peak;        // [stress]
};

/// Packing at rest at the end of a leg, and its void ratio.
template <int D> struct Specimen {
  RveStateOf<D> state;
  double void_ratio;
};

/// Search of the way of a recipe. A recipe without a required void ratio has a single way.
/// Otherwise ways are tried until one reaches the void ratio.
///
/// A packing is a discontinuous function of its preparation x. Bisection finds the x at which the
/// void ratio passes the goal, possibly by a jump. If no packing of the bisection is within the
/// tolerance, the search tries values in a growing neighbourhood of x, where other jumps lead to
/// other void ratios.
template <int D> class WaySearch {
 public:
  WaySearch(const PackingRecipe &_recipe, const RveStateOf<D> &_cloud) :
      recipe(_recipe), cloud(_cloud)
  {
  }

  Way<D> first() const
  {
    return with_friction(recipe.void_ratio ? 0.0 : recipe.preparation_friction);
  }

  /// Returns the way to try after the last one, which made `made`; nothing if `made` meets the
  /// recipe. Throws InputError if no way is left.
  std::optional<Way<D>> after(const Specimen<D> &made)
  {
    if (!recipe.void_ratio) return {};
    const double goal = *recipe.void_ratio;
    const double error = std::fabs(made.void_ratio - goal);
    if (error <= recipe.void_ratio_tolerance) return {};
    switch (stage) {
      case Stage::Frictionless:
        frictionless = made;
        looser = goal > made.void_ratio;
        most = looser ? std::sqrt(LARGEST_FRICTION) : largest_log_ratio();
        stage = Stage::Extreme;
        return at(most);
      case Stage::Extreme:
        if (looser ? goal > made.void_ratio : goal < made.void_ratio) unreachable(made);
        high = most;
        stage = Stage::Between;
        x = 0.5 * (low + high);
        return at(x);
      case Stage::Between:
        break;
    }
    if (error < least_error) {
      least_error = error;
      best = made.void_ratio;
    }
    if (attempt + 1 < MOST_HALVINGS) ((made.void_ratio < goal) == looser ? low : high) = x;
    while (++attempt < MOST_HALVINGS + MOST_SAMPLES) {
      x = 0.5 * (low + high);
      if (attempt < MOST_HALVINGS) return at(x);
      const int k = attempt - MOST_HALVINGS;
      const double spacing = most / 500;
      // The samples are on both sides of x in turn, at growing distance.
      x += (k % 2 ? 1.0 : -1.0) * (k / 2 + 1) * spacing;
      if (x > 0.0 && x < most) return at(x);
    }
    throw InputError(concat("no packing with void ratio ", goal, " within ",
                            recipe.void_ratio_tolerance,
                            " was found for this seed; the closest has ", best,
                            ": use another seed or a larger tolerance of the void ratio"));
  }

 private:
  // Largest preparation friction. Above it hardly any contact slides, and the packing does not
  // change.
  static constexpr double LARGEST_FRICTION = 1.0;
  // Overlap over diameter at the highest pressure that the search tries.
  static constexpr double LARGEST_PEAK_STRAIN = 0.04;
  static constexpr int MOST_HALVINGS = 8, MOST_SAMPLES = 60;

  enum class Stage { Frictionless, Extreme, Between };

  const PackingRecipe &recipe;
  const RveStateOf<D> &cloud;
  Stage stage = Stage::Frictionless;
  Specimen<D> frictionless{};
  bool looser = true;                       // looser than the frictionless packing
  double x = 0.0, low = 0.0, high = 0.0;    // variable of the search: see at()
  double most = 0.0;
  int attempt = 0;
  double best = 0.0, least_error = 1e300;    // best void ratio and its error

  /// Returns the way for a value of the search variable. For packings looser than the frictionless
  /// one the variable is the square root of the friction. The void ratio grows mostly below a
  /// friction of 0.2, and it is nearly a linear function of the root. For denser packings the
  /// variable is the logarithm of the overconsolidation ratio.
  Way<D> at(double value) const
  {
    return looser ? with_friction(value * value) : overconsolidated(value);
  }

  /// Returns a way with this preparation friction. If it exceeds the final friction, the way has a
  /// second leg that equilibrates the packing with the final friction.
  Way<D> with_friction(double friction) const
  {
    const double pressure = isotropic_pressure(recipe);
    Way<D> way{&cloud, {{pressure, friction, "compression"}}, friction, recipe.pressure};
    if (friction > recipe.material.friction)
      way.legs.push_back({pressure, recipe.material.friction, "settling"});
    add_anisotropy(way);
    return way;
  }

  Way<D> overconsolidated(double log_ratio) const
  {
    const double peak = recipe.pressure * std::exp(log_ratio);
    Way<D> way{&frictionless.state,
               {{peak, 0.0, "overconsolidation"}, {isotropic_pressure(recipe), 0.0, "unloading"}},
               0.0,
               peak};
    add_anisotropy(way);
    return way;
  }

  /// Adds a leg for anisotropic stress. It is the last leg. It has the final friction, since
  /// frictionless grains bear only an isotropic pressure.
  void add_anisotropy(Way<D> &way) const
  {
    if (recipe.at_rest)
      way.legs.push_back({recipe.pressure, recipe.material.friction, "load at rest", 1.0, true});
    else if (recipe.k0 != 1.0)
      way.legs.push_back(
          {recipe.pressure, recipe.material.friction, "anisotropic load", recipe.k0});
  }

  double largest_log_ratio() const
  {
    const double largest_pressure =
        contact_pressure<D>(LARGEST_PEAK_STRAIN, recipe.material, mean_radius(recipe));
    return std::log(std::max(1.0, largest_pressure / recipe.pressure));
  }

  [[noreturn]] void unreachable(const Specimen<D> &extreme) const
  {
    const double reached = extreme.void_ratio, other_end = frictionless.void_ratio;
    throw InputError(
        concat("void ratio ", *recipe.void_ratio, " cannot be reached at this pressure: the ",
               looser ? "loosest (preparation friction 1)" : "densest (overconsolidated)",
               " packing of this recipe has void ratio ", reached, "; use a void ratio from ",
               std::min(reached, other_end), " to ", std::max(reached, other_end),
               ", the range between this packing and the frictionless one"));
  }
};

}    // namespace rve
