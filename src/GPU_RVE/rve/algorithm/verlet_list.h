// SPDX-License-Identifier: GPL-2.0-only
// Verlet list of a periodic, deformable cell: when it must be built anew, and how.

#pragma once

#include "rve/algorithm/pair_ownership.h"
#include "rve/algorithm/search_grid.h"
#include "rve/algorithm/system_view.h"
#include "rve/physics/cell.h"
#include "rve/physics/contact_geometry.h"
#include "rve/physics/solid_cell.h"

namespace rve {
inline namespace RVE_ISA {

  /// How far a grain may have moved relative to the mean field since the list was built [length].
  ///
  /// A pair that is not listed had |b| >= R + skin then, R the distance at which it acts. Now b' = G b + u_j - u_i with G = H H_list^-1, so
  /// that |b'| >= s (R + skin) - 2 u with s the smallest stretch of G. It cannot act while 2 u <= s skin - (1 - s) R. In
  /// compression the largest R decides; in expansion the smallest, for which nothing is counted on.
  /// Negative: the strain alone demands a new list.
  template <int D>
  RVE_INLINE double allowed_displacement(const Tensor<double, D> &cell,
                                         const Tensor<double, D> &list_inverse,
                                         double contact_range, double skin)
  {
    const double stretch = smallest_stretch(cell * list_inverse);
    const double lost = stretch < 1.0 ? (1.0 - stretch) * contact_range : 0.0;
    return 0.5 * (stretch * skin - lost);
  }

  /// Sorts the grains into the grid: cell_start, cell_grain (ascending within a cell), cell_of. aside() by one thread meanwhile.
  template <class Block, class Scene, class Aside>
  RVE_HD void sort_into_grid(Block &block, const SeenMotions<Scene> &motion,
                             const WorkspaceView<Scene> &work, int num_grains,
                             const SearchGrid<Scene::D> &grid, Aside aside)
  {
    using Item = typename Block::Item;
    const int num_cells = grid.size();
    // nobody needs them now
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
    // the order of arrival is chance, the order of numbers is not
    block.for_each(num_grains, [&](Item i) {
      const int c = work.cell_of[i], first = work.cell_start[c], end = work.cell_start[c + 1];
      int place = first;
      for (int m = first; m < end; ++m) place += arrived[m] < i ? 1 : 0;
      work.cell_grain[place] = i;
    });
  }

  /// Where an old list has the pair of two grains: a slot of the one that asks, or of the other one. -1: in none.
  struct OldSlot {
    int mine, others;
  };
  template <class Scene>
  RVE_INLINE OldSlot old_slot(const PairView<Scene> &old, int num_grains, int i, int j)
  {
    OldSlot slot{-1, -1};
    for (int k = 0; k < Scene::owned_pairs; ++k) {
      const int of_mine = old.partner[k * num_grains + i],
                of_other = old.partner[k * num_grains + j];
      if (of_mine == j) slot.mine = k * num_grains + i;
      if (of_other == i) slot.others = k * num_grains + j;
    }
    return slot;
  }

  /// The history that the old list holds for the pair of i and j, as i sees it, or zero.
  template <class Scene>
  RVE_INLINE typename Scene::History old_history(const PairView<Scene> &old, OldSlot slot,
                                                 int num_old_extra, int i, int j)
  {
    if (slot.mine >= 0) return old.history[slot.mine];
    if (slot.others >= 0) return Scene::Law::seen_from_partner(old.history[slot.others]);
    for (int m = 0; m < num_old_extra; ++m) {
      if (old.extra_first[m] == i && old.extra_second[m] == j) return old.extra_history[m];
      if (old.extra_first[m] == j && old.extra_second[m] == i)
        return Scene::Law::seen_from_partner(old.extra_history[m]);
    }
    return typename Scene::History();
  }

  /// What build_list found. Beyond work.pair_capacity `num_pairs` is all that holds.
  struct ListSizes {
    int num_pairs, num_extra;
  };

  /// Builds the list of all pairs with |b| < r_i + r_j + reach + skin, assigns owners and carries the contact history over: `old` pairs in,
  /// work.fresh out. work.load has how many pairs a disk owns, by its place in the grid; of spheres how many of these touch, by their numbers.
  /// Lengths in the units of `cell` and `radius`; the cells of `grid` are as wide as the list reaches. aside(sizes) by one thread when they are
  /// known, and all others do something.
  ///
  /// Until the owners are known a grain is called by its place in the grid: those of neighbouring threads look at the same others.
  template <class Block, class Scene, class Aside>
  RVE_HD ListSizes build_list(Block &block, const SeenMotions<Scene> &motion,
                              SeenArray<Scene, typename Scene::Wide> radius,
                              const WorkspaceView<Scene> &work, int num_grains,
                              const Tensor<double, Scene::D> &cell,
                              const SearchGrid<Scene::D> &grid, double reach, double skin,
                              const PairView<Scene> &old, int num_old_extra, Aside aside)
  {
    const PairView<Scene> fresh = work.fresh;
    using Item = typename Block::Item;
    using Wide = typename Scene::Wide;
    const Tensor<Wide, Scene::D> to_length = fraction_to_length<typename Scene::Numbers>(cell);
    const Wide margin = static_cast<Wide>(reach + skin);
    sort_into_grid(block, motion, work, num_grains, grid, [&] { clear_overloaded(work); });

    using Point = Vec<typename Scene::Coordinate, Scene::D>;
    const auto branch_between = [&](const Point &here, int j) {
      return to_length * fractional_difference<typename Scene::Numbers>(motion[j].position, here);
    };
    // take(q) for the places q of the grains whose pairs with the one at place p are its own at first
    const bool has_sides = grid.has_sides();
    const auto for_each_owned = [&](int p, auto take) {
      const int i = work.cell_grain[p];
      const Wide within = radius[i] + margin;
      const Point here = motion[i].position;
      grid.rows_around(here, has_sides, [&](int layer, int first, int reach, bool own) {
        // the grains of a row of cells lie one behind the other
        const std::int32_t *const start = work.cell_start + layer;
        const int end = start[grid.count[0]], length = end - start[0], beyond = first + reach;
        const int last = beyond <= grid.count[0] ? start[beyond]
                                                 : length + start[beyond - grid.count[0]];
        constexpr int together = Block::kOnTheWay;
        for (int m = own ? p + 1 : start[first]; m < last; m += together) {
          int place[together];
          bool is_near[together];
          for (int t = 0; t < together; ++t) {
            const int q = m + t < end ? m + t : m + t - length;
            place[t] = m + t < last ? q : p;
          }
          for (int t = 0; t < together; ++t) {
            const int j = work.cell_grain[place[t]];
            is_near[t] =
                gap_squared(branch_between(here, j), within + radius[j]) > Wide(0) && m + t < last;
          }
          if (!has_sides)
            for (int t = 0; t < together; ++t)
              is_near[t] = is_near[t] && owns_first(p, place[t], num_grains);
          for (int t = 0; t < together; ++t)
            if (is_near[t]) take(place[t]);
        }
      });
    };

    // side by side where all have room for theirs, in memory that nobody needs now
    std::int32_t *const side_by_side = reinterpret_cast<std::int32_t *>(work.scratch);
    constexpr int room =
        kScratch<Scene::D> * static_cast<int>(sizeof(double) / sizeof(std::int32_t));
    enum { Pairs, WithoutRoom, Count };
    const auto found =
        block.template sum_integers<Count>(num_grains, [&](Item p, std::int64_t *term) {
          int count = 0;
          std::int32_t *next = side_by_side + p;
          for_each_owned(p, [&](int q) {
            if (count < room) *next = q;
            next += num_grains;
            ++count;
          });
          begin_ownership(block, work, p, count);
          term[Pairs] += count;
          term[WithoutRoom] += count > room ? 1 : 0;
        });
    const int num_pairs = static_cast<int>(found[Pairs]);
    if (num_pairs > work.pair_capacity) return ListSizes{num_pairs, 0};
    PairRows rows{side_by_side, nullptr, num_grains};
    if (found[WithoutRoom] > 0) {
      block.for_each(num_grains, [&](Item p) { work.row_start[p] = work.count[p].in_row(); });
      block.exclusive_scan(work.row_start, num_grains);
      rows = PairRows{work.row_partner, work.row_start, 1};
      block.for_each(num_grains, [&](Item p) {
        std::int32_t *next = work.row_partner + work.row_start[p];
        for_each_owned(p, [&](int q) { *next++ = q; });
      });
    }

    int num_extra = 0;
    if (!balance_ownership(block, work, rows, num_grains, 64)) {
      block.for_each(num_grains, [&](Item p) {
        const int owned = work.count[p].owned();
        work.excess_start[p] = owned > Scene::owned_pairs ? owned - Scene::owned_pairs : 0;
      });
      num_extra = block.exclusive_scan(work.excess_start, num_grains);
    }
    const ListSizes sizes{num_pairs, num_extra};
    const auto settle = [&](Item p) {
      const int i = work.cell_grain[p];
      const int received = work.count[p].received(), owned = work.count[p].owned();
      const PairRow row = rows.of(p);
      const auto place_of_partner = [&](int m) {
        return m < received ? work.received[m * num_grains + p] : row[m - received];
      };
      // all are on their way before the first one is looked at: here, and with each of what follows
      int partner[Scene::owned_pairs], rank[Scene::owned_pairs];
      for (int k = 0; k < Scene::owned_pairs; ++k) partner[k] = k < owned ? place_of_partner(k) : p;
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        rank[k] = k < owned ? ahead(p, partner[k], num_grains) : 0x7fffffff;
        partner[k] = k < owned ? work.cell_grain[partner[k]] : i;
      }
      int touching = 0;
      // without these braces NVRTC 13.0 forgets the next declaration
      if constexpr (Scene::D == 3) {
        const Point here = motion[i].position;
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          const int j = partner[k];
          const bool touches =
              k < owned && gap_squared(branch_between(here, j), radius[i] + radius[j]) > Wide(0);
          touching += touches ? 1 : 0;
          rank[k] += k < owned && !touches ? num_grains : 0;
        }
      }
      // ascending in how far ahead they are in the grid, free slots last: neighbouring threads then read neighbouring grains. In space those
      // that touch first, so that many threads have nothing to do in the last slots (ListRenewal::order_grains)
      for (int k = 1; k < Scene::owned_pairs; ++k)
        for (int m = k; m > 0; --m) {
          const bool swaps = rank[m] < rank[m - 1];
          const int first_rank = rank[m - 1], first = partner[m - 1];
          rank[m - 1] = swaps ? rank[m] : first_rank;
          partner[m - 1] = swaps ? partner[m] : first;
          rank[m] = swaps ? first_rank : rank[m];
          partner[m] = swaps ? first : partner[m];
        }
      OldSlot slots[Scene::owned_pairs];
      for (int k = 0; k < Scene::owned_pairs; ++k)
        slots[k] = old_slot(old, num_grains, i, partner[k]);
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        const int j = partner[k];
        fresh.partner[k * num_grains + i] = j;
        fresh.history[k * num_grains + i] =
            j == i ? typename Scene::History() : old_history(old, slots[k], num_old_extra, i, j);
      }
      for (int m = Scene::owned_pairs; m < owned; ++m) {
        const int j = work.cell_grain[place_of_partner(m)],
                  extra = work.excess_start[p] + m - Scene::owned_pairs;
        fresh.extra_first[extra] = i;
        fresh.extra_second[extra] = j;
        fresh.extra_history[extra] =
            old_history(old, old_slot(old, num_grains, i, j), num_old_extra, i, j);
      }
      if constexpr (Scene::D == 2)
        work.load[p] = owned < Scene::owned_pairs ? owned : Scene::owned_pairs;
      else
        work.load[i] = touching;
    };
    block.for_each(num_grains, settle, [&] { aside(sizes); });
    return sizes;
  }

}    // namespace RVE_ISA
}    // namespace rve
