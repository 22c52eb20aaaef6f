// SPDX-License-Identifier: GPL-2.0-only
// Balanced ownership of the pairs of a Verlet list.
//
// Every pair is computed once, by one of its two grains. A grain that owns many pairs would keep its thread busy while the
// others wait, so ownership is passed on until (nearly) no grain owns more than Scene::owned_pairs; what cannot be placed goes to a
// list of extra pairs. Who owns a pair has no influence on the motion (forces are summed as integers and a contact looks the
// same from both sides), but the procedure is deterministic all the same: offers and their acceptance are arbitrated by
// number.

#pragma once

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

  /// The partners in the pairs that a grain owns at first, less those that are given away.
  struct PairRow {
    std::int32_t *first;
    int stride;    ///< from one to the next
    RVE_INLINE std::int32_t &operator[](int m) const { return first[m * stride]; }
  };
  /// Of all grains: work.count[i].in_row() for grain i.
  struct PairRows {
    std::int32_t *partner;
    const std::int32_t *start;    ///< (N) entry of a grain's first partner; null: its number
    int stride;
    RVE_INLINE PairRow of(int i) const { return {partner + (start ? start[i] : i), stride}; }
  };

  /// Grain i owns `count` pairs, and none is given or received yet.
  template <class Block, class Scene>
  RVE_INLINE void begin_ownership(Block &block, const WorkspaceView<Scene> &work, int i, int count)
  {
    static_assert(Scene::owned_pairs < (1 << PairCount::kReceivedBits), "room for those received");
    work.count[i] = PairCount::of_row(count);
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
    const int count = work.count[i].in_row();
    const PairRow row = rows.of(i);
    Offer best{-1, -1};
    int best_load = Scene::owned_pairs + 1;
    // some at a time, without a branch: all others wait, and what is read is far away
    constexpr int together = 2 * Scene::owned_pairs;
    int which = round < count || count == 0 ? round : round % count;
    for (int m = 0; m < count; m += together) {
      Offer next[together];
      PairCount its[together];
      for (int t = 0; t < together; ++t) {
        next[t] = Offer{which, row[m + t < count ? which : 0]};
        which = which + 1 < count ? which + 1 : 0;
      }
      for (int t = 0; t < together; ++t) its[t] = work.count[next[t].partner];
      for (int t = 0; t < together; ++t) {
        const bool is_better =
            m + t < count && its[t].received() < Scene::owned_pairs && its[t].owned() < best_load;
        best.which = is_better ? next[t].which : best.which;
        best.partner = is_better ? next[t].partner : best.partner;
        best_load = is_better ? its[t].owned() : best_load;
      }
    }
    return best;
  }

  /// Rounds of offers until no grain is overloaded, at most `max_rounds`. In: the rows, and what begin_ownership has left. Out: the rows,
  /// received, count. Returns whether no grain is overloaded.
  ///
  /// Only overloaded grains do something, and few are. In what order they are listed is chance, and has no influence: who gets an offer is not
  /// overloaded, and has one offer taken at most.
  template <class Block, class Scene>
  RVE_HD bool balance_ownership(Block &block, const WorkspaceView<Scene> &work,
                                const PairRows &rows, int num_grains, int max_rounds)
  {
    // the grid is not needed any more
    std::int32_t *const asked = work.cell_start;
    std::int32_t *overloaded = work.overloaded, *next = work.cell_of;
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
          [&] { *num_next = 0; });
      block.for_each(count, [&](int m) {
        const int i = overloaded[m], which = work.proposal[i], j = asked[i];
        PairCount mine = work.count[i];
        if (which >= 0 && work.accepted[j] == sooner + i) {
          const PairCount its = work.count[j], its_next = its.with_one_more_received();
          mine = mine.with_one_less_in_row();
          // the last one takes its place
          const PairRow row = rows.of(i);
          row[which] = row[mine.in_row()];
          work.received[its.received() * num_grains + j] = i;
          work.count[j] = its_next;
          work.count[i] = mine;
          if (its_next.owned() > Scene::owned_pairs) next[block.fetch_add(num_next, 1)] = j;
        }
        if (mine.owned() > Scene::owned_pairs) next[block.fetch_add(num_next, 1)] = i;
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
