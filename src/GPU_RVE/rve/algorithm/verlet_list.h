// Verlet list of a periodic, deformable cell: when it must be built anew, and how.

#ifndef RVE_ALGORITHM_VERLET_LIST_H
#define RVE_ALGORITHM_VERLET_LIST_H

#include "rve/algorithm/pair_ownership.h"
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

  /// Regular grid in fractional space whose cells are at least `cutoff` wide. Along an axis with fewer than three cells every
  /// cell is a neighbour of every other.
  template <int D> struct SearchGrid {
    int count[D];

    /// width: of the periodic cell, perpendicular to its faces.
    RVE_INLINE SearchGrid(const Vec<double, D> &width, double cutoff, int capacity)
    {
      for (int a = 0; a < D; ++a) {
        const double fit = width[a] / (cutoff * (1.0 + 1e-6));
        count[a] = fit < 1.0 ? 1 : (fit > 1024.0 ? 1024 : static_cast<int>(fit));
      }
      // a product of large counts has more than 31 bits in space
      while (size<std::int64_t>() > capacity) {
        int most = count[0];
        for (int a = 1; a < D; ++a) most = count[a] > most ? count[a] : most;
        // the last of the axes with the most, without an index that is not known: the counts shall be in registers
        bool is_less = false;
        for (int a = D - 1; a >= 0; --a) {
          const bool is_this = !is_less && count[a] == most;
          count[a] -= is_this ? 1 : 0;
          is_less = is_less || is_this;
        }
      }
    }

    template <class Integer = int> RVE_INLINE Integer size() const
    {
      Integer product = 1;
      for (int a = 0; a < D; ++a) product *= count[a];
      return product;
    }

    /// x runs fastest.
    template <class Coordinate> RVE_INLINE int index(const Vec<Coordinate, D> &s) const
    {
      int cell = 0;
      for (int a = D - 1; a >= 0; --a)
        cell = cell * count[a] +
            static_cast<int>((static_cast<std::uint64_t>(leading_bits(s[a])) * count[a]) >> 32);
      return cell;
    }

    /// Whether no cell is twice a neighbour of another one, so that each of two neighbours lies either ahead of the other or behind it.
    RVE_INLINE bool has_sides() const
    {
      bool wide = true;
      for (int a = 0; a < D; ++a) wide = wide && count[a] >= 3;
      return wide;
    }

    /// Calls visit(layer, first, count, own) for the rows of cells that may hold neighbours of the points in `home`: `count` cells of the row whose
    /// first cell is `layer`, from the cell `first` of it on, and behind its last cell from its first one on. `ahead`: only of those that lie
    /// ahead of `home`, which is the first cell of the first row then, its `own`. With has_sides() alone.
    template <class Visit> RVE_INLINE void rows_around(int home, bool ahead, Visit visit) const
    {
      int place[D];
      for (int a = 0; a + 1 < D; ++a) {
        place[a] = home % count[a];
        home /= count[a];
      }
      place[D - 1] = home;
      rows_along<D - 1>(place, 0, ahead, visit);
    }

   private:
    /// Of the cells in layer `layer` of the axes after this one.
    template <int Axis, class Visit>
    RVE_INLINE void rows_along(const int (&place)[D], int layer, bool ahead, Visit &visit) const
    {
      const int n = count[Axis], reach = n < 3 ? n : 3;
      // modulo n, without a division
      const int before = place[Axis] == 0 ? n - 1 : place[Axis] - 1;
      if constexpr (Axis == 0) {
        visit(layer * n, ahead ? place[0] : before, ahead ? 2 : reach, ahead);
      } else {
        const int first = ahead ? 1 : 0;
        for (int d = first, next = ahead ? place[Axis] : before; d < reach;
             ++d, next = next + 1 < n ? next + 1 : 0)
          rows_along<Axis - 1>(place, layer * n + next, ahead && d == first, visit);
      }
    }
  };

  /// Sorts the grains into the grid: cell_start, cell_grain (ascending within a cell), cell_of. aside() by one thread meanwhile.
  template <class Block, class Scene, class Aside>
  RVE_HD void sort_into_grid(Block &block, const SeenMotions<Scene> &motion,
                             const WorkspaceView<Scene> &work, int num_grains,
                             const SearchGrid<Scene::D> &grid, Aside aside)
  {
    using Item = typename Block::Item;
    const int num_cells = grid.size();
    // nobody needs them now
    std::int32_t *const arrival = work.load, *const arrived = work.proposal;
    block.for_each(
        num_cells,
        [&](Item c) {
          work.cell_start[c] = 0;
        },
        aside);
    block.for_each(num_grains, [&](Item i) {
      const int c = grid.index(motion[i].position);
      work.cell_of[i] = c;
      arrival[i] = block.fetch_add(&work.cell_start[c], 1);
    });
    block.scan_to_starts(work.cell_start, num_cells);
    block.for_each(num_grains, [&](Item i) {
      arrived[work.cell_start[work.cell_of[i]] + arrival[i]] = i;
    });
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
  /// work.fresh out; work.load has how many pairs a grain owns, of spheres how many of these touch. Lengths in the units of `cell` and `radius`;
  /// the cells of `grid` are as wide as the list reaches. aside(sizes) by one thread when they are known, and all others do something.
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
    sort_into_grid(block, motion, work, num_grains, grid, [&] {
      clear_overloaded(work);
    });

    const auto branch_between = [&](int i, int j) {
      return to_length *
          fractional_difference<typename Scene::Numbers>(motion[j].position, motion[i].position);
    };
    // take(q) for the places q of the grains whose pairs with the one at place p are its own at first
    const bool has_sides = grid.has_sides();
    const auto for_each_owned = [&](int p, auto take) {
      const int i = work.cell_grain[p];
      const Wide within = radius[i] + margin;
      grid.rows_around(work.cell_of[i], has_sides, [&](int layer, int first, int reach, bool own) {
        // the grains of a row of cells lie one behind the other
        const std::int32_t *const start = work.cell_start + layer;
        const int end = start[grid.count[0]], length = end - start[0], beyond = first + reach;
        const int last = beyond <= grid.count[0] ? start[beyond]
                                                 : length + start[beyond - grid.count[0]];
        for (int m = own ? p + 1 : start[first]; m < last; ++m) {
          const int q = m < end ? m : m - length;
          if (!has_sides && !owns_first(p, q, num_grains)) continue;
          const int j = work.cell_grain[q];
          if (gap_squared(branch_between(i, j), within + radius[j]) > Wide(0)) take(q);
        }
      });
    };

    // side by side where all have room for theirs, in memory that nobody needs now
    PairRows rows{reinterpret_cast<std::int32_t *>(work.scratch), nullptr, num_grains};
    constexpr int room =
        kScratch<Scene::D> * static_cast<int>(sizeof(double) / sizeof(std::int32_t));
    enum { Pairs, WithoutRoom, Count };
    const auto found =
        block.template sum_integers<Count>(num_grains, [&](Item p, std::int64_t *term) {
          int count = 0;
          for_each_owned(p, [&](int q) {
            if (count < room) rows.partner[rows.entry(p, count)] = q;
            ++count;
          });
          begin_ownership(block, work, p, count);
          term[Pairs] += count;
          term[WithoutRoom] += count > room ? 1 : 0;
        });
    const int num_pairs = static_cast<int>(found[Pairs]);
    if (num_pairs > work.pair_capacity) return ListSizes{num_pairs, 0};
    if (found[WithoutRoom] > 0) {
      block.for_each(num_grains, [&](Item p) {
        work.row_start[p] = work.row_count[p];
      });
      block.exclusive_scan(work.row_start, num_grains);
      rows = PairRows{work.row_partner, work.row_start, 1};
      block.for_each(num_grains, [&](Item p) {
        int count = 0;
        for_each_owned(p, [&](int q) {
          rows.partner[rows.entry(p, count++)] = q;
        });
      });
    }

    int num_extra = 0;
    if (!balance_ownership(block, work, rows, num_grains, 64)) {
      block.for_each(num_grains, [&](Item p) {
        work.excess_start[p] = work.load[p] > Scene::owned_pairs ? work.load[p] - Scene::owned_pairs
                                                                 : 0;
      });
      num_extra = block.exclusive_scan(work.excess_start, num_grains);
    }
    const ListSizes sizes{num_pairs, num_extra};
    const auto settle = [&](Item p) {
      const int i = work.cell_grain[p];
      const int received = work.received_count[p], owned = received + work.row_count[p];
      const auto place_of_partner = [&](int m) {
        return m < received ? work.received[m * num_grains + p]
                            : rows.partner[rows.entry(p, m - received)];
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
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          const int j = partner[k];
          const bool touches =
              k < owned && gap_squared(branch_between(i, j), radius[i] + radius[j]) > Wide(0);
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
      work.load[i] = Scene::D == 3 ? touching
                                   : (owned < Scene::owned_pairs ? owned : Scene::owned_pairs);
    };
    block.for_each(num_grains, settle, [&] {
      aside(sizes);
    });
    return sizes;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
