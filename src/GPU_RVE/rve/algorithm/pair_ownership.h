// Balanced ownership of the pairs of a Verlet list.
//
// Every pair is computed once, by one of its two grains. A grain that owns many pairs would keep its thread busy while the
// others wait, so ownership is passed on until (nearly) no grain owns more than Scene::owned_pairs; what cannot be placed goes to a
// list of extra pairs. Who owns a pair has no influence on the motion (forces are summed as integers and a contact looks the
// same from both sides), but the procedure is deterministic all the same: offers and their acceptance are arbitrated by
// grain number.

#ifndef RVE_ALGORITHM_PAIR_OWNERSHIP_H
#define RVE_ALGORITHM_PAIR_OWNERSHIP_H

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// First owner of a pair: the grain with the lower number. Grains are numbered row by row, so that all own what lies ahead of
  /// them, and the k-th pairs of a row of threads have partners in a row.
  RVE_INLINE bool owns_first(int i, int j)
  {
    return i < j;
  }

  /// One grain's offer in a round: the entry of its row whose partner has the smallest load, or -1. The search starts at
  /// another entry in each round, so that a surplus pair wanders instead of bouncing.
  template <class Scene> RVE_INLINE int offer(const WorkspaceView<Scene> &work, int i, int round)
  {
    if (work.load[i] <= Scene::owned_pairs) return -1;
    const int first = work.row_start[i], end = work.row_start[i + 1];
    int best = -1, best_load = Scene::owned_pairs + 1;
    for (int m = first, entry = first + round % (end - first); m < end; ++m) {
      const int j = work.row_partner[entry], load = work.load[j];
      if (!work.row_given[entry] && work.received_count[j] < Scene::owned_pairs &&
          load < best_load) {
        best = entry;
        best_load = load;
      }
      entry = entry + 1 < end ? entry + 1 : first;
    }
    return best;
  }

  /// Rounds of offers until no grain is overloaded, at most `max_rounds`. In: row_start, row_partner. Out: row_given, received,
  /// received_count, load. Returns whether no grain is overloaded.
  template <class Block, class Scene>
  RVE_HD bool balance_ownership(Block &block, const WorkspaceView<Scene> &work, int num_grains,
                                int max_rounds)
  {
    using Item = typename Block::Item;
    const int nobody = 0x7fffffff;
    // whose offers are taken in a round, and what the next round will need: so a round has two phases. The grid is not needed any more
    std::int32_t *accepted = work.accepted, *next = work.cell_fill;
    bool overloaded = block.any(num_grains, [&](Item i) {
      accepted[i] = nobody;
      work.load[i] = work.row_start[i + 1] - work.row_start[i];
      work.received_count[i] = 0;
      for (int entry = work.row_start[i]; entry < work.row_start[i + 1]; ++entry)
        work.row_given[entry] = 0;
      return work.load[i] > Scene::owned_pairs;
    });
    for (int round = 0; overloaded && round < max_rounds; ++round) {
      block.for_each(num_grains, [&](Item i) {
        next[i] = nobody;
        work.proposal[i] = offer(work, i, round);
        if (work.proposal[i] >= 0)
          block.fetch_min(&accepted[work.row_partner[work.proposal[i]]], i);
      });
      overloaded = block.any(num_grains, [&](Item i) {
        if (accepted[i] != nobody) {
          work.received[work.received_count[i] * num_grains + i] = accepted[i];
          ++work.received_count[i];
          ++work.load[i];
        }
        const int entry = work.proposal[i];
        if (entry >= 0 && accepted[work.row_partner[entry]] == i) {
          work.row_given[entry] = 1;
          --work.load[i];
        }
        return work.load[i] > Scene::owned_pairs;
      });
      std::int32_t *const now = next;
      next = accepted;
      accepted = now;
    }
    return !overloaded;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
