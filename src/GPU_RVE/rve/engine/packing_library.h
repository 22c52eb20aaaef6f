// SPDX-License-Identifier: GPL-2.0-only
// Packing library: many packings of one material with an index, and the choice among them for a
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
  std::uint64_t seed = 0;                  ///< of positions and radii
  double void_ratio = 0.0;                 ///< void ratio of the packing [-]
  double preparation_friction = 0.0;       ///< mu during compression [-]
  double overconsolidation_ratio = 1.0;    ///< highest pressure of the preparation / pressure [-]
  double pressure = 0.0;                   ///< [stress]
  int num_grains = 0;
};

/// Packings, numbered from 0, with their rows.
template <int D> struct PackingLibraryOf {
  std::vector<LibraryRow> index;
  std::vector<RveStateOf<D>> packings;

  void add(const LibraryRow &row, RveStateOf<D> packing);

  /// Throws InputError unless there is at least one packing, each packing has a row, and the
  /// numbers of grains and the void ratios (to 1e-9) of rows and packings agree.
  void check() const;
};
using PackingLibrary = PackingLibraryOf<2>;

/// Returns a number from 0 to count-1 with equal probability for the point `id`. It depends only on
/// the arguments, and neither on the number of ranks nor on the order of points. Draws for
/// different `purpose` are independent. The mixing function is SplitMix64 (Steele, Lea & Flood,
/// OOPSLA 2014), chained over the arguments.
int draw(std::uint64_t seed, std::int64_t id, int count, std::uint64_t purpose = 0);

/// Search of packings by their void ratios.
class VoidRatioIndex {
 public:
  /// Takes the void ratios of packings 0, 1, ... [-]. Throws InputError if there are none or one is
  /// not finite.
  explicit VoidRatioIndex(const std::vector<double> &void_ratios);

  double least() const { return sorted.front().first; }
  double most() const { return sorted.back().first; }

  /// Returns the packing with the nearest void ratio. Of equally near packings it returns the one
  /// with the lower void ratio, then the one with the lower number. Returns nothing if that void
  /// ratio differs from `wanted` by more than `tolerance` [-], or if `wanted` is not finite.
  std::optional<int> nearest(double wanted, double tolerance) const;

  /// Returns one of the packings whose void ratios differ from `wanted` by at most `tolerance` [-],
  /// drawn for point `id`, or nothing if there is none.
  std::optional<int> draw_within(double wanted, double tolerance, std::uint64_t seed,
                                 std::int64_t id) const;

 private:
  std::vector<std::pair<double, int>> sorted;    // void ratio, number
};

/// Search of packings by the stress that they bear. Packings of similar stress form a level: a
/// packing joins the level of the packing with the next lower stress if the stresses differ by at
/// most the share SAME_LEVEL of the lower one.
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

  /// Returns the level whose stress is nearest by ratio; of two equally near ones the lower.
  /// Returns nothing unless `wanted` is a number above 0.
  std::optional<int> nearest(double wanted) const;

 private:
  struct Level {
    double stress;
    std::vector<int> packings;
  };
  std::vector<Level> levels;
};

}    // namespace rve
