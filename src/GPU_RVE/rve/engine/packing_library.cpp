// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/packing_library.h"

#include "rve/core/error.h"
#include "rve/core/splitmix64.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace rve {

template <int D> void PackingLibraryOf<D>::add(const LibraryRow &row, RveStateOf<D> packing)
{
  index.push_back(row);
  packings.push_back(std::move(packing));
}

template <int D> void PackingLibraryOf<D>::check() const
{
  require(!packings.empty(), "the library is empty; it must have at least one packing");
  require(index.size() == packings.size(), "the index of the library has ", index.size(),
          " rows for ", packings.size(), " packings");
  constexpr double TOLERANCE = 1e-9;
  for (std::size_t k = 0; k < packings.size(); ++k) {
    require(index[k].num_grains == packings[k].num_grains(), "packing ", k, " of the library has ",
            packings[k].num_grains(), " grains, but its index gives ", index[k].num_grains);
    const double void_ratio = packings[k].void_ratio();
    require(std::fabs(index[k].void_ratio - void_ratio) <= TOLERANCE, "packing ", k,
            " of the library has void ratio ", void_ratio, ", but its index gives ",
            index[k].void_ratio);
  }
}

int draw(std::uint64_t seed, std::int64_t id, int count, std::uint64_t purpose)
{
  std::uint64_t bits = splitmix64(seed);
  bits = splitmix64(bits ^ purpose);
  bits = splitmix64(bits ^ static_cast<std::uint64_t>(id));
  // The upper 32 bits are an integer share of 2^32, so the relative difference of two probabilities
  // is below count / 2^32.
  return static_cast<int>(((bits >> 32) * static_cast<std::uint64_t>(count)) >> 32);
}

VoidRatioIndex::VoidRatioIndex(const std::vector<double> &void_ratios)
{
  require(!void_ratios.empty(), "there are no packings to choose from");
  for (std::size_t k = 0; k < void_ratios.size(); ++k) {
    require(std::isfinite(void_ratios[k]), "void ratio of packing ", k, " is ", void_ratios[k],
            "; it must be finite");
    sorted.emplace_back(void_ratios[k], static_cast<int>(k));
  }
  std::sort(sorted.begin(), sorted.end());
}

std::optional<int> VoidRatioIndex::nearest(double wanted, double tolerance) const
{
  const auto above = std::lower_bound(sorted.begin(), sorted.end(), std::make_pair(wanted, -1));
  auto found = above;
  if (above != sorted.begin()) {
    const double below = std::prev(above)->first;
    if (above == sorted.end() || wanted - below <= above->first - wanted)
      found = std::lower_bound(sorted.begin(), above, std::make_pair(below, -1));
  }
  if (!(std::fabs(found->first - wanted) <= tolerance)) return {};
  return found->second;
}

std::optional<int> VoidRatioIndex::draw_within(double wanted, double tolerance, std::uint64_t seed,
                                               std::int64_t id) const
{
  const auto within = [&](const std::pair<double, int> &one) {
    return std::fabs(one.first - wanted) <= tolerance;
  };
  const auto begin = std::find_if(sorted.begin(), sorted.end(), within);
  if (begin == sorted.end()) return {};
  const auto end = std::find_if_not(begin, sorted.end(), within);
  return begin[draw(seed, id, static_cast<int>(end - begin))].second;
}

StressLevels::StressLevels(const std::vector<double> &stresses)
{
  require(!stresses.empty(), "there are no packings to choose from");
  std::vector<std::pair<double, int>> sorted;
  for (std::size_t k = 0; k < stresses.size(); ++k) {
    require(std::isfinite(stresses[k]) && stresses[k] > 0.0, "stress of packing ", k, " is ",
            stresses[k], " [stress], compression positive; it must be greater than 0");
    sorted.emplace_back(stresses[k], static_cast<int>(k));
  }
  std::sort(sorted.begin(), sorted.end());
  double before = 0.0;
  for (const auto &[stress, packing] : sorted) {
    if (levels.empty() || stress > (1.0 + SAME_LEVEL) * before) levels.push_back({0.0, {}});
    levels.back().stress += stress;
    levels.back().packings.push_back(packing);
    before = stress;
  }
  for (Level &level : levels) {
    level.stress /= static_cast<double>(level.packings.size());
    std::sort(level.packings.begin(), level.packings.end());
  }
}

std::optional<int> StressLevels::nearest(double wanted) const
{
  if (!(std::isfinite(wanted) && wanted > 0.0)) return {};
  int found = 0;
  // The next level is nearer in ratio if `wanted` exceeds the geometric mean of both stresses.
  while (found + 1 < count() && stress(found) * stress(found + 1) < wanted * wanted) ++found;
  return found;
}

template struct PackingLibraryOf<2>;
template struct PackingLibraryOf<3>;

}    // namespace rve
