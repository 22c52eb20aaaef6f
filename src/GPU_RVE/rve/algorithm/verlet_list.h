// SPDX-License-Identifier: GPL-2.0-only
// Verlet list of a periodic, deformable cell: test for a new list, and its construction.

#pragma once

#include "rve/algorithm/pair_ownership.h"
#include "rve/algorithm/search_grid.h"
#include "rve/algorithm/system_view.h"
#include "rve/physics/cell.h"
#include "rve/physics/contact_geometry.h"
#include "rve/physics/solid_cell.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns how far a grain can move relative to the mean field before a new list is needed
  /// [length].
  ///
  /// The result is the largest u with 2 u <= s skin - (1 - s) R. R is the largest distance at which
  /// a pair acts, and s is the smallest stretch of G = H H_list^-1. The branch b of a pair that is
  /// not listed had |b| >= R + skin when the list was built. It is now b' = G b + u_j - u_i, with
  /// displacements u_i and u_j of magnitude at most u, so that |b'| >= s (R + skin) - 2 u. The pair
  /// cannot act while |b'| >= R. In compression the pair with the largest R decides. In expansion
  /// the pair with the smallest R would decide. The term with R is then omitted, which is safe. A
  /// negative result means that the strain alone requires a new list.
  template <int D>
  RVE_INLINE double allowed_displacement(const Tensor<double, D> &cell,
                                         const Tensor<double, D> &list_inverse,
                                         double contact_range, double skin)
  {
    const double stretch = smallest_stretch(cell * list_inverse);
    const double lost = stretch < 1.0 ? (1.0 - stretch) * contact_range : 0.0;
    return 0.5 * (stretch * skin - lost);
  }

  /// Sorts the grains into the grid: cell_start, cell_grain (ascending within a cell), cell_of. One
  /// thread calls aside() at the same time.
  template <class Block, class Config, class Aside>
  RVE_HD void sort_into_grid(Block &block, const SeenMotions<Config> &motion,
                             const WorkspaceView<Config> &work, int num_grains,
                             const SearchGrid<Config::D> &grid, Aside aside)
  {
    using Item = typename Block::Item;
    const int num_cells = grid.size();
    // These arrays are not used now.
    std::int32_t *const arrival = work.accepted, *const arrived = work.overloaded;
    block.for_each(
        num_cells, [&](Item c) { work.cell_start[c] = 0; }, aside);
    block.for_each(num_grains, [&](Item i) {
      const int c = grid.index(motion[i].position);
      work.cell_of[i] = c;
      arrival[i] = block.fetch_add(&work.cell_start[c], 1);
    });
    block.scan_to_starts(work.cell_start, num_cells);
    block.for_each(num_grains,
                   [&](Item i) { arrived[work.cell_start[work.cell_of[i]] + arrival[i]] = i; });
    // The order of arrival is not reproducible, so that the grains of a cell are sorted by index.
    block.for_each(num_grains, [&](Item i) {
      const int c = work.cell_of[i], first = work.cell_start[c], end = work.cell_start[c + 1];
      int place = first;
      for (int m = first; m < end; ++m) place += arrived[m] < i ? 1 : 0;
      work.cell_grain[place] = i;
    });
  }

  /// Indices at which an old list stores the pair of two grains: among the slots of the first
  /// grain, and among the slots of the second grain. -1: not among these slots.
  struct OldSlot {
    int mine, others;
  };
  template <class Config>
  RVE_INLINE OldSlot old_slot(const PairView<Config> &old, int num_grains, int i, int j)
  {
    OldSlot slot{-1, -1};
    for (int k = 0; k < Config::owned_pairs; ++k) {
      const int of_mine = old.partner[k * num_grains + i],
                of_other = old.partner[k * num_grains + j];
      if (of_mine == j) slot.mine = k * num_grains + i;
      if (of_other == i) slot.others = k * num_grains + j;
    }
    return slot;
  }

  /// Returns the history of the pair of i and j in the old list, as i sees it, or zero.
  template <class Config>
  RVE_INLINE typename Config::History old_history(const PairView<Config> &old, OldSlot slot,
                                                  int num_old_extra, int i, int j)
  {
    if (slot.mine >= 0) return old.history[slot.mine];
    if (slot.others >= 0) return Config::Law::seen_from_partner(old.history[slot.others]);
    for (int m = 0; m < num_old_extra; ++m) {
      if (old.extra_first[m] == i && old.extra_second[m] == j) return old.extra_history[m];
      if (old.extra_first[m] == j && old.extra_second[m] == i)
        return Config::Law::seen_from_partner(old.extra_history[m]);
    }
    return typename Config::History();
  }

  /// Sizes of a list. If num_pairs is above work.pair_capacity, num_extra is not valid.
  struct ListSizes {
    int num_pairs, num_extra;
  };

  /// Grains of a new list, and tests of their distances. Until the owners of pairs are known a
  /// grain is identified by its index in the grid: neighbouring threads then read the same other
  /// grains.
  template <class Block, class Config> struct NearGrains {
    using Wide = typename Config::Wide;
    using Point = Vec<typename Config::Coordinate, Config::D>;

    const SeenMotions<Config> &motion;
    SeenArray<Config, Wide> radius;
    const WorkspaceView<Config> &work;
    int num_grains;
    Tensor<Wide, Config::D> to_length;
    const SearchGrid<Config::D> &grid;
    Wide margin;       ///< reach plus skin [internal length]
    bool has_sides;    ///< SearchGrid::has_sides() of the grid

    /// Returns whether grain j is nearer to a point than its radius plus `within`.
    RVE_INLINE bool is_within(const Point &here, Wide within, int j) const
    {
      const auto branch =
          to_length * fractional_difference<typename Config::Numbers>(motion[j].position, here);
      return gap_squared(branch, within + radius[j]) > Wide(0);
    }

    /// Calls take(q) for each pair that the grain at index p owns before ownership is balanced. q
    /// is the index of the partner.
    template <class Take> RVE_INLINE void for_each_owned(int p, Take take) const
    {
      const int i = work.cell_grain[p];
      const Wide within = radius[i] + margin;
      const Point here = motion[i].position;
      grid.rows_around(here, has_sides, [&](int layer, int first, int reach, bool own) {
        // The grains of a row of cells have consecutive indices.
        const std::int32_t *const start = work.cell_start + layer;
        const int end = start[grid.count[0]], length = end - start[0], beyond = first + reach;
        const int last = beyond <= grid.count[0] ? start[beyond]
                                                 : length + start[beyond - grid.count[0]];
        constexpr int together = Block::kOnTheWay;
        for (int m = own ? p + 1 : start[first]; m < last; m += together) {
          int index[together];
          bool is_near[together];
          for (int t = 0; t < together; ++t) {
            const int q = m + t < end ? m + t : m + t - length;
            index[t] = m + t < last ? q : p;
          }
          for (int t = 0; t < together; ++t)
            is_near[t] = is_within(here, within, work.cell_grain[index[t]]) && m + t < last;
          if (!has_sides)
            for (int t = 0; t < together; ++t)
              is_near[t] = is_near[t] && owns_first(p, index[t], num_grains);
          for (int t = 0; t < together; ++t)
            if (is_near[t]) take(index[t]);
        }
      });
    }
  };

  /// Pairs that grains own before ownership is balanced, and their total number.
  struct FoundPairs {
    PairRows rows;
    int num_pairs;
  };
  /// Finds the pairs. Rows are interleaved in work.scratch if all of them fit. Otherwise they
  /// follow each other in work.row_partner, which has space for work.pair_capacity pairs.
  template <class Block, class Config>
  RVE_INLINE FoundPairs find_pairs(Block &block, const NearGrains<Block, Config> &near)
  {
    using Item = typename Block::Item;
    const WorkspaceView<Config> &work = near.work;
    const int n = near.num_grains;
    std::int32_t *const side_by_side = reinterpret_cast<std::int32_t *>(work.scratch);
    constexpr int capacity =
        kScratch<Config::D> * static_cast<int>(sizeof(double) / sizeof(std::int32_t));
    enum { Pairs, TooLong, Count };
    const auto found = block.template sum_integers<Count>(n, [&](Item p, std::int64_t *term) {
      int count = 0;
      std::int32_t *next = side_by_side + p;
      near.for_each_owned(p, [&](int q) {
        if (count < capacity) *next = q;
        next += n;
        ++count;
      });
      begin_ownership(block, work, p, count);
      term[Pairs] += count;
      term[TooLong] += count > capacity ? 1 : 0;
    });
    const int num_pairs = static_cast<int>(found[Pairs]);
    if (found[TooLong] == 0 || num_pairs > work.pair_capacity)
      return {PairRows{side_by_side, nullptr, n}, num_pairs};
    block.for_each(n, [&](Item p) { work.row_start[p] = work.count[p].in_row(); });
    block.exclusive_scan(work.row_start, n);
    block.for_each(n, [&](Item p) {
      std::int32_t *next = work.row_partner + work.row_start[p];
      near.for_each_owned(p, [&](int q) { *next++ = q; });
    });
    return {PairRows{work.row_partner, work.row_start, 1}, num_pairs};
  }

  /// Sorts partners by rank. Ranks ascend with the distance ahead in the grid, so that neighbouring
  /// threads read neighbouring grains. Free slots are last. In space touching partners come first,
  /// so that many threads have no work in the last slots (ListRenewal::order_grains).
  template <int slots> RVE_INLINE void sort_by_rank(int (&rank)[slots], int (&partner)[slots])
  {
    for (int k = 1; k < slots; ++k)
      for (int m = k; m > 0; --m) {
        const bool swaps = rank[m] < rank[m - 1];
        const int first_rank = rank[m - 1], first = partner[m - 1];
        rank[m - 1] = swaps ? rank[m] : first_rank;
        partner[m - 1] = swaps ? partner[m] : first;
        rank[m] = swaps ? first_rank : rank[m];
        partner[m] = swaps ? first : partner[m];
      }
  }

  /// Writes the pairs of the grain at index p of the grid to work.fresh, with the histories of the
  /// old pairs.
  template <class Block, class Config>
  RVE_INLINE void write_pairs(const NearGrains<Block, Config> &near, const PairRows &rows, int p,
                              const PairView<Config> &old, int num_old_extra)
  {
    constexpr int slots = Config::owned_pairs;
    const WorkspaceView<Config> &work = near.work;
    const PairView<Config> &fresh = work.fresh;
    const int num_grains = near.num_grains;
    const int i = work.cell_grain[p];
    const int received = work.count[p].received(), owned = work.count[p].owned();
    const PairRow row = rows.of(p);
    const auto index_of_partner = [&](int m) {
      return m < received ? work.received[m * num_grains + p] : row[m - received];
    };
    // Here and below, all values are read before the first one is used.
    int partner[slots], rank[slots];
    for (int k = 0; k < slots; ++k) partner[k] = k < owned ? index_of_partner(k) : p;
    for (int k = 0; k < slots; ++k) {
      rank[k] = k < owned ? ahead(p, partner[k], num_grains) : 0x7fffffff;
      partner[k] = k < owned ? work.cell_grain[partner[k]] : i;
    }
    int touching = 0;
    // Without these braces NVRTC 13.0 loses the next declaration.
    if constexpr (Config::D == 3) {
      const auto here = near.motion[i].position;
      for (int k = 0; k < slots; ++k) {
        const bool touches = k < owned && near.is_within(here, near.radius[i], partner[k]);
        touching += touches ? 1 : 0;
        rank[k] += k < owned && !touches ? num_grains : 0;
      }
    }
    sort_by_rank(rank, partner);
    OldSlot old_slots[slots];
    for (int k = 0; k < slots; ++k) old_slots[k] = old_slot(old, num_grains, i, partner[k]);
    for (int k = 0; k < slots; ++k) {
      const int j = partner[k];
      fresh.partner[k * num_grains + i] = j;
      fresh.history[k * num_grains + i] =
          j == i ? typename Config::History() : old_history(old, old_slots[k], num_old_extra, i, j);
    }
    for (int m = slots; m < owned; ++m) {
      const int j = work.cell_grain[index_of_partner(m)], extra = work.excess_start[p] + m - slots;
      fresh.extra_first[extra] = i;
      fresh.extra_second[extra] = j;
      fresh.extra_history[extra] =
          old_history(old, old_slot(old, num_grains, i, j), num_old_extra, i, j);
    }
    if constexpr (Config::D == 2)
      work.load[p] = owned < slots ? owned : slots;
    else
      work.load[i] = touching;
  }

  /// Builds the list of all pairs with |b| < r_i + r_j + reach + skin, assigns owners and copies
  /// the contact history from `old` to work.fresh. For disks work.load has the number of owned
  /// pairs, by index in the grid. For spheres work.load has the number of touching pairs, by index
  /// of the grain. Lengths have the unit of `cell` and `radius`; the cells of `grid` are at least
  /// as wide as the largest distance of a listed pair. One thread calls aside(sizes) when the sizes
  /// are known, while all others write the pairs.
  template <class Block, class Config, class Aside>
  RVE_HD ListSizes build_list(Block &block, const SeenMotions<Config> &motion,
                              SeenArray<Config, typename Config::Wide> radius,
                              const WorkspaceView<Config> &work, int num_grains,
                              const Tensor<double, Config::D> &cell,
                              const SearchGrid<Config::D> &grid, double reach, double skin,
                              const PairView<Config> &old, int num_old_extra, Aside aside)
  {
    using Item = typename Block::Item;
    using Wide = typename Config::Wide;
    sort_into_grid(block, motion, work, num_grains, grid, [&] { work.num_overloaded[0] = 0; });
    const NearGrains<Block, Config> near{motion,
                                         radius,
                                         work,
                                         num_grains,
                                         fraction_to_length<typename Config::Numbers>(cell),
                                         grid,
                                         static_cast<Wide>(reach + skin),
                                         grid.has_sides()};
    const FoundPairs found = find_pairs(block, near);
    if (found.num_pairs > work.pair_capacity) return ListSizes{found.num_pairs, 0};
    int num_extra = 0;
    if (!balance_ownership(block, work, found.rows, num_grains, 64)) {
      block.for_each(num_grains, [&](Item p) {
        const int owned = work.count[p].owned();
        work.excess_start[p] = owned > Config::owned_pairs ? owned - Config::owned_pairs : 0;
      });
      num_extra = block.exclusive_scan(work.excess_start, num_grains);
    }
    const ListSizes sizes{found.num_pairs, num_extra};
    block.for_each(
        num_grains, [&](Item p) { write_pairs(near, found.rows, p, old, num_old_extra); },
        [&] { aside(sizes); });
    return sizes;
  }

}    // namespace RVE_ISA
}    // namespace rve
