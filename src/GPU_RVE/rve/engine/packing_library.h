// SPDX-License-Identifier: GPL-2.0-only
// Packing library: many packings of one material with an index. Functions choose a packing for a
// material point.

#pragma once

#include "rve/engine/state.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace rve {

/// Row of the index of a library: data of one packing.
struct LibraryRow {
  std::uint64_t seed = 0;                  ///< seed of positions and radii
  double void_ratio = 0.0;                 ///< void ratio of the packing [-]
  double preparation_friction = 0.0;       ///< mu during compression [-]
  double overconsolidation_ratio = 1.0;    ///< highest pressure of the preparation / pressure [-]
  double pressure = 0.0;                   ///< [stress]
  int num_grains = 0;
};

/// Packings, numbered from 0, and their rows of the index.
template <int D> struct PackingLibraryOf {
  std::vector<LibraryRow> index;
  std::vector<RveStateOf<D>> packings;

  void add(const LibraryRow &row, RveStateOf<D> packing);

  /// Throws InputError unless there is at least one packing, each packing has a row, and each row
  /// has the number of grains and the void ratio (to 1e-9) of its packing.
  void check() const;
};
using PackingLibrary = PackingLibraryOf<2>;

/// Returns a number from 0 to count-1 with equal probability for the point `id`. The number depends
/// only on the arguments, not on the number of ranks or the order of points. Draws for different
/// `purpose` are independent. The mixing function is SplitMix64 (Steele, Lea & Flood, OOPSLA 2014),
/// chained over the arguments.
int draw(std::uint64_t seed, std::int64_t id, int count, std::uint64_t purpose = 0);

/// Search of packings by their void ratios.
class VoidRatioIndex {
 public:
  /// Takes the void ratios of packings 0, 1, ... [-]. Throws InputError if there are none or one is
  /// not finite.
  explicit VoidRatioIndex(const std::vector<double> &void_ratios);

  double least() const { return sorted.front().first; }
  double most() const { return sorted.back().first; }

  /// Returns the packing whose void ratio is nearest to `wanted`. If two void ratios are equally
  /// near, it returns the lower one; if several packings have this void ratio, the one with the
  /// lowest number. Returns nothing if the nearest void ratio differs from `wanted` by more than
  /// `tolerance` [-], or if `wanted` is not finite.
  std::optional<int> nearest(double wanted, double tolerance) const;

  /// Draws a packing for point `id` among those whose void ratios differ from `wanted` by at most
  /// `tolerance` [-]. Returns nothing if there are none.
  std::optional<int> draw_within(double wanted, double tolerance, std::uint64_t seed,
                                 std::int64_t id) const;

 private:
  std::vector<std::pair<double, int>> sorted;    // void ratio, number
};

/// Search of packings by the stress that they bear. Packings of similar stress form a level. In the
/// order of stresses, a packing belongs to the level of its predecessor if its stress is higher by
/// at most the share SAME_LEVEL.
class StressLevels {
 public:
  static constexpr double SAME_LEVEL = 0.05;

  /// Takes the stresses of packings 0, 1, ..., compression positive [stress]. Throws InputError if
  /// there are none, or one is not a number above 0.
  explicit StressLevels(const std::vector<double> &stresses);

  int count() const { return static_cast<int>(levels.size()); }
  /// Returns the packings of a level, in ascending order; level 0 has the lowest stress.
  const std::vector<int> &packings(int level) const { return levels[level].packings; }
  /// Returns the mean stress of a level [stress].
  double stress(int level) const { return levels[level].stress; }

  /// Returns the level whose stress has the ratio to `wanted` that is closest to 1; of two equally
  /// close levels the lower one. Returns nothing unless `wanted` is a number above 0.
  std::optional<int> nearest(double wanted) const;

 private:
  struct Level {
    double stress;
    std::vector<int> packings;
  };
  std::vector<Level> levels;
};

}    // namespace rve
