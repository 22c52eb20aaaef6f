// SPDX-License-Identifier: GPL-2.0-only
// Bins of grains for the search of neighbours. Host only.

#pragma once

#include "rve/engine/state.h"
#include "rve/physics/solid_cell.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rve {

/// Bins of grains by fractional coordinates. Each bin is at least `contact_distance` wide. A cell
/// that is too narrow for three bins along each axis has a single bin.
template <int D> class GrainBins {
 public:
  GrainBins(const Tensor<double, D> &cell, double contact_distance)
  {
    // Largest number of bins per axis. More bins would mostly be empty.
    constexpr int MOST_BINS = D == 2 ? 1024 : 64;
    int least = MOST_BINS;
    std::size_t bins = 1;
    for (int a = 0; a < D; ++a) {
      const double width = std::floor(perpendicular_width(cell, a) / contact_distance);
      count_[a] = static_cast<int>(std::min<double>(MOST_BINS, width));
      least = std::min(least, count_[a]);
      bins *= static_cast<std::size_t>(std::max(count_[a], 1));
    }
    // With fewer than three bins along an axis, the bins on both sides of a bin would be the same
    // one.
    if (least < 3) {
      is_single_ = true;
      bins = 1;
      for (int a = 0; a < D; ++a) count_[a] = 1;
    }
    grains_.resize(bins);
  }

  void add(const RveStateOf<D> &state, int i) { grains_[index(site(state, i))].push_back(i); }

  /// Calls work(other) for the grains in the bin of grain i and in the bins around it, until work
  /// returns true. Returns true if it did.
  template <class Work> bool any_near(const RveStateOf<D> &state, int i, const Work &work) const
  {
    const int around = is_single_ ? 1 : D == 2 ? 9 : 27;
    const Vec<int, D> here = site(state, i);
    for (int k = 0; k < around; ++k) {
      Vec<int, D> there = here;
      for (int a = 0, rest = k; a < D && !is_single_; ++a, rest /= 3) there[a] += rest % 3 - 1;
      for (const int other : grains_[index(there)])
        if (work(other)) return true;
    }
    return false;
  }

 private:
  Vec<int, D> count_;
  bool is_single_ = false;
  std::vector<std::vector<int>> grains_;

  Vec<int, D> site(const RveStateOf<D> &state, int i) const
  {
    Vec<int, D> at;
    for (int a = 0; a < D; ++a)
      at[a] = static_cast<int>(((state.fractional[D * i + a] >> 32) * count_[a]) >> 32);
    return at;
  }

  std::size_t index(const Vec<int, D> &at) const
  {
    std::size_t bin = 0;
    for (int a = D - 1; a >= 0; --a) bin = bin * count_[a] + (at[a] + count_[a]) % count_[a];
    return bin;
  }
};

}    // namespace rve
