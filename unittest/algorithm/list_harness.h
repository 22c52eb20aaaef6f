// SPDX-License-Identifier: GPL-2.0-only
// Builds Verlet lists by a block program of its own, without the step loop, so that tests can read
// the lists.

#pragma once

#include "rve/algorithm/verlet_list.h"
#include "rve/engine/variant_configs.h"
#include "support/block_runner.h"
#include "support/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace rve_test {

/// Block program that builds a new list from the old list of the device state. It stores the new
/// list in the device state if the list has at most pair_capacity pairs.
template <class Config> struct BuildList {
  char *image, *workspace;
  rve::MotionOf<Config> *motion;
  int num_grains, extra_capacity, pair_capacity;
  rve::Tensor2 cell;
  double largest_radius, skin;
  int *num_pairs;

  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    using Item = typename Block::Item;
    const int n = num_grains;
    const auto view = rve::carve_device_state<Config>(image, n, extra_capacity);
    const auto work = rve::carve_workspace<Config>(workspace, n, pair_capacity);
    const rve::PairView<Config> old{view.partner, view.history, view.extra_first, view.extra_second,
                                    view.extra_history};
    block.for_each(n, [&](Item i) { motion[i].position = view.position[i]; });

    const rve::Vec<double, 2> width{
        {rve::perpendicular_width(cell, 0), rve::perpendicular_width(cell, 1)}};
    const rve::SearchGrid<2> grid(width, 2.0 * largest_radius + skin, work.cell_capacity);
    const rve::ListSizes sizes = rve::build_list(
        block, motion, view.radius, work, n, cell, grid, 0.0, skin, old, view.header->num_extra,
        [&](const rve::ListSizes &known) { view.header->num_extra = known.num_extra; });

    block.once([&] { *num_pairs = sizes.num_pairs; });
    if (sizes.num_pairs > pair_capacity) return;
    const rve::PairView<Config> &fresh = work.fresh;
    block.for_each(rve::PairCounts<2>::owned * n, [&](Item m) {
      view.partner[m] = fresh.partner[m];
      view.history[m] = fresh.history[m];
    });
    block.for_each(sizes.num_extra, [&](Item m) {
      view.extra_first[m] = fresh.extra_first[m];
      view.extra_second[m] = fresh.extra_second[m];
      view.extra_history[m] = fresh.extra_history[m];
    });
  }
};

struct ListedPair {
  int owner, partner;
  double history;
  bool extra;    ///< true for an extra pair, which is in no slot of its owner
};

/// Grains with a Verlet list in a device state. At the start no pair has a contact history. Each
/// call of build() replaces the list.
template <class Numbers> class ListHarness {
  using Config = rve::VariantConfig<rve::KernelVariant::Plain, Numbers>;

 public:
  using Coordinate = typename Config::Coordinate;
  using History = typename Config::History;

  ListHarness(const rve::Tensor2 &cell_in, const std::vector<double> &radius_in,
              const std::vector<std::uint64_t> &fractional_in, double skin_in) :
      cell(cell_in),
      skin(skin_in), num_grains(static_cast<int>(radius_in.size())),
      pair_capacity(40 * num_grains + 40), extra_capacity(pair_capacity)
  {
    image.assign(rve::device_state_size<Config>(num_grains, extra_capacity), 0);
    const auto view = this->view();
    for (int i = 0; i < num_grains; ++i) {
      view.radius[i] = static_cast<typename Config::Wide>(radius_in[i]);
      for (int k = 0; k < rve::PairCounts<2>::owned; ++k) view.partner[k * num_grains + i] = i;
    }
    move_to(fractional_in);
  }

  void move_to(const std::vector<std::uint64_t> &fractional)
  {
    const auto view = this->view();
    for (int k = 0; k < 2 * num_grains; ++k)
      view.position[k / 2][k % 2] =
          static_cast<Coordinate>(fractional[k] >> (64 - 8 * sizeof(Coordinate)));
  }

  void set_pair_capacity(int capacity) { pair_capacity = capacity; }

  /// Builds the list and returns its number of pairs.
  int build(int threads)
  {
    BlockArray<char> memory(image), workspace(std::vector<char>(workspace_size(), 0));
    BlockArray<rve::MotionOf<Config>> motion{std::vector<rve::MotionOf<Config>>(num_grains)};
    BlockArray<int> count(std::vector<int>{-1});
    run_block(threads, variant(memory.data(), workspace.data(), motion.data(), count.data()));
    image = memory.values();
    return count.values()[0];
  }

  /// Builds the list in one CPU thread. A Cuda test uses it too.
  int build_serial()
  {
    std::vector<char> workspace(workspace_size());
    std::vector<rve::MotionOf<Config>> motion(num_grains);
    int count = -1;
    run_serial(variant(image.data(), workspace.data(), motion.data(), &count));
    return count;
  }

  std::vector<ListedPair> pairs()
  {
    const auto view = this->view();
    std::vector<ListedPair> result;
    for (int i = 0; i < num_grains; ++i)
      for (int k = 0; k < rve::PairCounts<2>::owned; ++k)
        if (view.partner[k * num_grains + i] != i)
          result.push_back({i, view.partner[k * num_grains + i],
                            static_cast<double>(view.history[k * num_grains + i]), false});
    for (int m = 0; m < view.header->num_extra; ++m)
      result.push_back({view.extra_first[m], view.extra_second[m],
                        static_cast<double>(view.extra_history[m]), true});
    return result;
  }

  /// Sets the history of every listed pair to `value(i, j)`.
  template <class Value> void set_histories(Value value)
  {
    const auto view = this->view();
    for (int i = 0; i < num_grains; ++i)
      for (int k = 0; k < rve::PairCounts<2>::owned; ++k)
        view.history[k * num_grains + i] =
            static_cast<History>(value(i, view.partner[k * num_grains + i]));
    for (int m = 0; m < view.header->num_extra; ++m)
      view.extra_history[m] =
          static_cast<History>(value(view.extra_first[m], view.extra_second[m]));
  }

  /// Returns the radii in the precision of the format.
  std::vector<double> radii()
  {
    const auto view = this->view();
    return std::vector<double>(view.radius, view.radius + num_grains);
  }
  std::vector<std::uint64_t> fractions()
  {
    const auto view = this->view();
    std::vector<std::uint64_t> result(2 * num_grains);
    for (int k = 0; k < 2 * num_grains; ++k)
      result[k] = static_cast<std::uint64_t>(view.position[k / 2][k % 2])
          << (64 - 8 * sizeof(Coordinate));
    return result;
  }

  rve::Tensor2 cell;
  double skin;
  std::vector<char> image;    ///< device state

 private:
  rve::DeviceStateView<Config> view()
  {
    return rve::carve_device_state<Config>(image.data(), num_grains, extra_capacity);
  }

  std::size_t workspace_size() const
  {
    return rve::workspace_size<Config>(num_grains, pair_capacity);
  }

  BuildList<Config> variant(char *memory, char *workspace, rve::MotionOf<Config> *motion,
                            int *count)
  {
    const auto radius = radii();
    const double largest = *std::max_element(radius.begin(), radius.end());
    return {memory,        workspace, motion,  num_grains, extra_capacity,
            pair_capacity, cell,      largest, skin,       count};
  }

  const int num_grains;
  int pair_capacity;
  const int extra_capacity;
};

/// Grains at random positions in a cell of the given shape, with any overlaps.
struct Throw {
  rve::Tensor2 cell;
  std::vector<double> radius;
  std::vector<std::uint64_t> fractional;
};

/// Returns grains with radii from 1 to `size_ratio`. The cell is `shape`, scaled until the disks
/// cover `solid_fraction` of it or until it is wide enough for the minimum image.
inline Throw throw_grains(const rve::Tensor2 &shape, int num_grains, double size_ratio,
                          double solid_fraction, double skin, std::uint64_t seed)
{
  Random random(seed);
  Throw grains;
  double area = 0.0;
  for (int i = 0; i < num_grains; ++i) {
    const double r = random.uniform(1.0, size_ratio);
    grains.radius.push_back(r);
    area += 3.14159265358979 * r * r;
    grains.fractional.push_back(random.bits());
    grains.fractional.push_back(random.bits());
  }
  const double by_area = std::sqrt(area / solid_fraction / std::fabs(rve::determinant(shape)));
  const double by_width = 2.01 * (2.0 * size_ratio + skin) / rve::smallest_width(shape);
  grains.cell = std::max(by_area, by_width) * shape;
  return grains;
}

}    // namespace rve_test
