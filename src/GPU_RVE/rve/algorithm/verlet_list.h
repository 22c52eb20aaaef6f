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

    RVE_INLINE SearchGrid(const Tensor<double, D> &cell, double cutoff, int capacity)
    {
      for (int a = 0; a < D; ++a) {
        const double fit = perpendicular_width(cell, a) / (cutoff * (1.0 + 1e-6));
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

    /// Calls visit(layer, first, count) for the rows of cells that may hold neighbours of the points in `home`: `count` cells of the row whose
    /// first cell is `layer`, from the cell `first` of it on, and behind its last cell from its first one on.
    template <class Visit> RVE_INLINE void rows_around(int home, Visit visit) const
    {
      int place[D];
      for (int a = 0; a + 1 < D; ++a) {
        place[a] = home % count[a];
        home /= count[a];
      }
      place[D - 1] = home;
      rows_along<D - 1>(place, 0, visit);
    }

   private:
    /// Of the cells in layer `layer` of the axes after this one.
    template <int Axis, class Visit>
    RVE_INLINE void rows_along(const int (&place)[D], int layer, Visit &visit) const
    {
      const int n = count[Axis], reach = n < 3 ? n : 3;
      // modulo n, without a division
      const int before = place[Axis] == 0 ? n - 1 : place[Axis] - 1;
      if constexpr (Axis == 0) {
        visit(layer * n, before, reach);
      } else {
        for (int d = 0, next = before; d < reach; ++d, next = next + 1 < n ? next + 1 : 0)
          rows_along<Axis - 1>(place, layer * n + next, visit);
      }
    }
  };

  /// Sorts the grains into the grid: cell_start, cell_grain (ascending within a cell), cell_of.
  template <class Block, class Scene>
  RVE_HD void sort_into_grid(Block &block, const SeenMotions<Scene> &motion,
                             const WorkspaceView<Scene> &work, int num_grains,
                             const SearchGrid<Scene::D> &grid)
  {
    using Item = typename Block::Item;
    const int num_cells = grid.size();
    block.for_each(num_cells, [&](Item c) {
      work.cell_start[c] = 0;
      work.cell_fill[c] = 0;
    });
    block.for_each(num_grains, [&](Item i) {
      work.cell_of[i] = grid.index(motion[i].position);
      block.add(&work.cell_start[work.cell_of[i]], 1);
    });
    block.scan_to_starts(work.cell_start, num_cells);
    block.for_each(num_grains, [&](Item i) {
      const int c = work.cell_of[i];
      work.cell_grain[work.cell_start[c] + block.fetch_add(&work.cell_fill[c], 1)] = i;
    });
    // the order of arrival is chance, the order of numbers is not
    block.for_each(num_cells, [&](Item c) {
      for (int m = work.cell_start[c] + 1; m < work.cell_start[c + 1]; ++m) {
        const int grain = work.cell_grain[m];
        int hole = m;
        for (; hole > work.cell_start[c] && work.cell_grain[hole - 1] > grain; --hole)
          work.cell_grain[hole] = work.cell_grain[hole - 1];
        work.cell_grain[hole] = grain;
      }
    });
  }

  /// The history that the old list holds for the pair of i and j, as i sees it, or zero. All partners are read before the first look at one.
  template <class Scene>
  RVE_INLINE typename Scene::History old_history(const PairView<Scene> &old, int num_grains,
                                                 int num_old_extra, int i, int j)
  {
    int mine = -1, others = -1;
    for (int k = 0; k < Scene::owned_pairs; ++k) {
      const int of_mine = old.partner[k * num_grains + i],
                of_other = old.partner[k * num_grains + j];
      if (of_mine == j) mine = k * num_grains + i;
      if (of_other == i) others = k * num_grains + j;
    }
    if (mine >= 0) return old.history[mine];
    if (others >= 0) return Scene::Law::seen_from_partner(old.history[others]);
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
  /// work.fresh out; work.load has how many pairs a grain owns, of spheres how many of these touch. Lengths in the units of `cell` and `radius`.
  template <class Block, class Scene>
  RVE_HD ListSizes build_list(Block &block, const SeenMotions<Scene> &motion,
                              SeenArray<Scene, typename Scene::Wide> radius,
                              const WorkspaceView<Scene> &work, int num_grains,
                              const Tensor<double, Scene::D> &cell, double contact_range,
                              double reach, double skin, const PairView<Scene> &old,
                              int num_old_extra)
  {
    const PairView<Scene> fresh = work.fresh;
    using Item = typename Block::Item;
    using Wide = typename Scene::Wide;
    const SearchGrid<Scene::D> grid(cell, contact_range + skin, work.cell_capacity);
    const Tensor<Wide, Scene::D> to_length = fraction_to_length<typename Scene::Numbers>(cell);
    const Wide margin = static_cast<Wide>(reach + skin);
    sort_into_grid(block, motion, work, num_grains, grid);

    const auto for_each_owned = [&](int i, auto take) {
      grid.rows_around(work.cell_of[i], [&](int layer, int first, int reach) {
        // the grains of a row of cells lie one behind the other
        const std::int32_t *const start = work.cell_start + layer;
        const int end = start[grid.count[0]], length = end - start[0], beyond = first + reach;
        const int begin = start[first];
        const int candidates = beyond <= grid.count[0]
            ? start[beyond] - begin
            : end - begin + start[beyond - grid.count[0]] - start[0];
        for (int m = begin; m < begin + candidates; ++m) {
          const int j = work.cell_grain[m < end ? m : m - length];
          if (j == i || !owns_first(i, j)) continue;
          const Vec<Wide, Scene::D> branch = to_length *
              fractional_difference<typename Scene::Numbers>(motion[j].position,
                                                             motion[i].position);
          if (gap_squared(branch, radius[i] + radius[j] + margin) > Wide(0)) take(j);
        }
      });
    };

    // the partners that a grain finds while it counts them, as many as there is room for: nobody needs it now
    auto *const found = reinterpret_cast<std::int32_t *>(work.scratch);
    constexpr int kFound =
        kScratch<Scene::D> * static_cast<int>(sizeof(double) / sizeof(std::int32_t));
    block.for_each(num_grains, [&](Item i) {
      int count = 0;
      for_each_owned(i, [&](int j) {
        if (count < kFound) found[count * num_grains + i] = j;
        ++count;
      });
      work.row_start[i] = count;
    });
    const int num_pairs = block.scan_to_starts(work.row_start, num_grains);
    if (num_pairs > work.pair_capacity) return ListSizes{num_pairs, 0};
    block.for_each(num_grains, [&](Item i) {
      int entry = work.row_start[i];
      const int count = work.row_start[i + 1] - entry;
      if (count <= kFound)
        for (int m = 0; m < count; ++m) work.row_partner[entry + m] = found[m * num_grains + i];
      else
        for_each_owned(i, [&](int j) {
          work.row_partner[entry++] = j;
        });
    });

    int num_extra = 0;
    if (!balance_ownership(block, work, num_grains, 64)) {
      block.for_each(num_grains, [&](Item i) {
        work.excess_start[i] = work.load[i] > Scene::owned_pairs ? work.load[i] - Scene::owned_pairs
                                                                 : 0;
      });
      num_extra = block.exclusive_scan(work.excess_start, num_grains);
    }
    block.for_each(num_grains, [&](Item i) {
      // ascending in the distance of the numbers, free slots last: neighbouring threads then read neighbouring grains. In space those that
      // touch first, so that many threads have nothing to do in the last slots (ListRenewal::order_grains)
      int partner[Scene::owned_pairs], rank[Scene::owned_pairs];
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        partner[k] = i;
        rank[k] = 0x7fffffff;
      }
      int owned = 0, touching = 0, extra = num_extra > 0 ? work.excess_start[i] : 0;
      const auto place = [&](int j) {
        if (owned++ < Scene::owned_pairs) {
          int other = j, its_rank = j > i ? j - i : j - i + num_grains;
          if constexpr (Scene::D == 3) {
            const Vec<Wide, Scene::D> branch = to_length *
                fractional_difference<typename Scene::Numbers>(motion[j].position,
                                                               motion[i].position);
            const bool touches = gap_squared(branch, radius[i] + radius[j]) > Wide(0);
            touching += touches ? 1 : 0;
            its_rank += touches ? 0 : num_grains;
          }
          // into its place among those that are there
          for (int k = 0; k < Scene::owned_pairs; ++k)
            if (its_rank < rank[k]) {
              const int next_rank = rank[k], next = partner[k];
              rank[k] = its_rank;
              partner[k] = other;
              its_rank = next_rank;
              other = next;
            }
        } else {
          fresh.extra_first[extra] = i;
          fresh.extra_second[extra] = j;
          fresh.extra_history[extra] = old_history(old, num_grains, num_old_extra, i, j);
          ++extra;
        }
      };
      for (int m = 0; m < work.received_count[i]; ++m) place(work.received[m * num_grains + i]);
      for (int entry = work.row_start[i]; entry < work.row_start[i + 1]; ++entry)
        if (!work.row_given[entry]) place(work.row_partner[entry]);
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        const int j = partner[k];
        fresh.partner[k * num_grains + i] = j;
        fresh.history[k * num_grains + i] =
            j == i ? typename Scene::History() : old_history(old, num_grains, num_old_extra, i, j);
      }
      work.load[i] = Scene::D == 3 ? touching
                                   : (owned < Scene::owned_pairs ? owned : Scene::owned_pairs);
    });
    return ListSizes{num_pairs, num_extra};
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
