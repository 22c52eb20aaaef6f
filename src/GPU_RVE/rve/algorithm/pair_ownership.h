// Balanced ownership of the pairs of a Verlet list.
//
// Every pair is computed once, by one of its two grains. A grain that owns many pairs would keep its thread busy while the
// others wait, so ownership is passed on until (nearly) no grain owns more than Scene::owned_pairs; what cannot be placed goes to a
// list of extra pairs. Who owns a pair has no influence on the motion (forces are summed as integers and a contact looks the
// same from both sides), but the procedure is deterministic all the same: offers and their acceptance are arbitrated by
// number.

#ifndef RVE_ALGORITHM_PAIR_OWNERSHIP_H
#define RVE_ALGORITHM_PAIR_OWNERSHIP_H

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// How many places behind i the grain j lies, on the round of all n of them.
  RVE_INLINE int ahead(int i, int j, int n)
  {
    return j > i ? j - i : j - i + n;
  }

  /// Whether i is the first owner of its pair with j, where neither lies ahead of the other in the grid: the one from whom the way to the other, on
  /// the round, is the shorter one.
  RVE_INLINE bool owns_first(int i, int j, int n)
  {
    const int there = 2 * ahead(i, j, n);
    return i != j && (there < n || (there == n && i < j));
  }

  /// The partners in the pairs that grains own at first, less those that are given away: work.row_count of them for each.
  struct PairRows {
    std::int32_t *partner;
    const std::int32_t *start;    ///< (N) entry of a grain's first partner; null: its number
    int stride;                   ///< from one to the next
    RVE_INLINE int entry(int i, int m) const { return (start ? start[i] : i) + m * stride; }
  };

  /// Before begin_ownership. By one thread.
  template <class Scene> RVE_INLINE void clear_overloaded(const WorkspaceView<Scene> &work)
  {
    work.num_overloaded[0] = 0;
  }

  /// Grain i owns `count` pairs, and none is given or received yet.
  template <class Block, class Scene>
  RVE_INLINE void begin_ownership(Block &block, const WorkspaceView<Scene> &work, int i, int count)
  {
    work.row_count[i] = work.load[i] = count;
    work.received_count[i] = 0;
    work.accepted[i] = 0x7fffffff;
    if (count > Scene::owned_pairs)
      work.overloaded[block.fetch_add(&work.num_overloaded[0], 1)] = i;
  }

  /// One grain's offer in a round: which of its row's partners has the smallest load, and who that is, or -1. The search starts at another one
  /// in each round, so that a surplus pair wanders instead of bouncing.
  struct Offer {
    int which, partner;
  };
  template <class Scene>
  RVE_INLINE Offer offer(const WorkspaceView<Scene> &work, const PairRows &rows, int i, int round)
  {
    const int count = work.row_count[i];
    Offer best{-1, -1};
    int best_load = Scene::owned_pairs + 1;
    // some at a time: all others wait, and what is read is far away
    constexpr int together = 4;
    int which = round < count || count == 0 ? round : round % count;
    for (int m = 0; m < count; m += together) {
      Offer next[together];
      int load[together], received[together];
      for (int t = 0; t < together; ++t) {
        next[t] = Offer{which, m + t < count ? rows.partner[rows.entry(i, which)] : i};
        which = which + 1 < count ? which + 1 : 0;
      }
      for (int t = 0; t < together; ++t) {
        load[t] = work.load[next[t].partner];
        received[t] = work.received_count[next[t].partner];
      }
      // the grain itself is overloaded
      for (int t = 0; t < together; ++t)
        if (received[t] < Scene::owned_pairs && load[t] < best_load) {
          best = next[t];
          best_load = load[t];
        }
    }
    return best;
  }

  /// Rounds of offers until no grain is overloaded, at most `max_rounds`. In: the rows, and what begin_ownership has left. Out: the rows,
  /// received, received_count, load. Returns whether no grain is overloaded.
  ///
  /// Only overloaded grains do something, and few are. In what order they are listed is chance, and has no influence: who gets an offer is not
  /// overloaded, and has one offer taken at most.
  template <class Block, class Scene>
  RVE_HD bool balance_ownership(Block &block, const WorkspaceView<Scene> &work,
                                const PairRows &rows, int num_grains, int max_rounds)
  {
    // the grid is not needed any more, nor are contacts counted now
    std::int32_t *const asked = work.cell_of;
    std::int32_t *overloaded = work.overloaded, *next = work.contact_count;
    int count = work.num_overloaded[0];
    for (int round = 0; count > 0 && round < max_rounds; ++round) {
      // offers of later rounds are smaller: what has been taken needs not be cleared
      const int sooner = (max_rounds - 1 - round) * num_grains;
      std::int32_t *const num_next = work.num_overloaded + (round + 1) % 2;
      block.for_each(
          count,
          [&](int m) {
            const int i = overloaded[m];
            const Offer mine = offer(work, rows, i, round);
            work.proposal[i] = mine.which;
            asked[i] = mine.partner;
            if (mine.which >= 0) block.fetch_min(&work.accepted[mine.partner], sooner + i);
          },
          [&] {
            *num_next = 0;
          });
      block.for_each(count, [&](int m) {
        const int i = overloaded[m], which = work.proposal[i], j = asked[i];
        int load = work.load[i];
        if (which >= 0 && work.accepted[j] == sooner + i) {
          const int received = work.received_count[j], its_load = work.load[j] + 1,
                    left = work.row_count[i] - 1;
          // the last one takes its place
          rows.partner[rows.entry(i, which)] = rows.partner[rows.entry(i, left)];
          work.received[received * num_grains + j] = i;
          work.received_count[j] = received + 1;
          work.load[j] = its_load;
          work.row_count[i] = left;
          work.load[i] = --load;
          if (its_load > Scene::owned_pairs) next[block.fetch_add(num_next, 1)] = j;
        }
        if (load > Scene::owned_pairs) next[block.fetch_add(num_next, 1)] = i;
      });
      count = *num_next;
      std::int32_t *const now = next;
      next = overloaded;
      overloaded = now;
    }
    return count == 0;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
