// SPDX-License-Identifier: GPL-2.0-only
// Balanced ownership of the pairs of a Verlet list.
//
// Every pair is computed once, by one of its two grains. A grain with many pairs would keep its
// thread busy while the others wait. Ownership is therefore passed on until (nearly) no grain owns
// more than Config::owned_pairs; the remaining pairs form the list of extra pairs. The motion does
// not depend on the owners: forces are summed as integers, and the force of a contact has the same
// bits whichever grain owns the pair. The procedure is deterministic: a grain with several offers
// accepts the offer of the grain with the lowest index.

#pragma once

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns how many indices grain j is after i, cyclically among n grains.
  RVE_INLINE int ahead(int i, int j, int n)
  {
    return j > i ? j - i : j - i + n;
  }

  /// Returns whether i is the first owner of its pair with j, if the grid does not order the two
  /// grains. The first owner is the grain from which ahead() to the other grain is smaller.
  RVE_INLINE bool owns_first(int i, int j, int n)
  {
    const int there = 2 * ahead(i, j, n);
    return i != j && (there < n || (there == n && i < j));
  }

  /// Partners of the pairs that a grain owns at first, without the pairs that it has given away.
  struct PairRow {
    std::int32_t *first;
    int stride;    ///< distance between partners in the array
    RVE_INLINE std::int32_t &operator[](int m) const { return first[m * stride]; }
  };
  /// Rows of all grains: grain i has work.count[i].in_row() partners.
  struct PairRows {
    std::int32_t *partner;
    /// (N) Index of the first partner of a grain. If null, the first partner of grain i has index
    /// i.
    const std::int32_t *start;
    int stride;
    RVE_INLINE PairRow of(int i) const { return {partner + (start ? start[i] : i), stride}; }
  };

  /// Records that grain i owns `count` pairs, none of which is given away or received yet.
  template <class Block, class Config>
  RVE_INLINE void begin_ownership(Block &block, const WorkspaceView<Config> &work, int i, int count)
  {
    static_assert(Config::owned_pairs < (1 << PairCount::kReceivedBits),
                  "space for those received");
    work.count[i] = PairCount::of_row(count);
    work.accepted[i] = 0x7fffffff;
    if (count > Config::owned_pairs)
      work.overloaded[block.fetch_add(&work.num_overloaded[0], 1)] = i;
  }

  /// Offer of one grain in a round: it offers a pair to the partner in its row that owns the fewest
  /// pairs. `which` is the index of this partner in the row, and `partner` is its index among the
  /// grains; both are -1 without an offer. The search starts at another index in each round, so
  /// that a surplus pair does not bounce between two grains.
  struct Offer {
    int which, partner;
  };
  template <class Config>
  RVE_INLINE Offer offer(const WorkspaceView<Config> &work, const PairRows &rows, int i, int round)
  {
    const int count = work.count[i].in_row();
    const PairRow row = rows.of(i);
    Offer best{-1, -1};
    int best_load = Config::owned_pairs + 1;
    // Several partners are read at once, without a branch: all other threads wait for this one, and
    // the reads have a high latency.
    constexpr int together = 2 * Config::owned_pairs;
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
            m + t < count && its[t].received() < Config::owned_pairs && its[t].owned() < best_load;
        best.which = is_better ? next[t].which : best.which;
        best.partner = is_better ? next[t].partner : best.partner;
        best_load = is_better ? its[t].owned() : best_load;
      }
    }
    return best;
  }

  /// Makes rounds of offers, at most `max_rounds`, until no grain is overloaded, that is until no
  /// grain owns more than Config::owned_pairs. The rows and the data of begin_ownership() must be
  /// set. Updates the rows, `received` and `count`. Returns whether no grain is overloaded.
  ///
  /// Only overloaded grains take part, and they are few. The random order of their list has no
  /// influence: a grain that gets an offer is not overloaded, and at most one offer is accepted.
  template <class Block, class Config>
  RVE_HD bool balance_ownership(Block &block, const WorkspaceView<Config> &work,
                                const PairRows &rows, int num_grains, int max_rounds)
  {
    // The arrays of the grid are not needed any more.
    std::int32_t *const candidate = work.cell_start;
    std::int32_t *overloaded = work.overloaded, *next = work.cell_of;
    int count = work.num_overloaded[0];
    for (int round = 0; count > 0 && round < max_rounds; ++round) {
      // `accepted` has the smallest offer. Offers of later rounds are smaller numbers, so that
      // `accepted` need not be cleared.
      const int sooner = (max_rounds - 1 - round) * num_grains;
      std::int32_t *const num_next = work.num_overloaded + (round + 1) % 2;
      block.for_each(
          count,
          [&](int m) {
            const int i = overloaded[m];
            const Offer mine = offer(work, rows, i, round);
            work.proposal[i] = mine.which;
            candidate[i] = mine.partner;
            if (mine.which >= 0) block.fetch_min(&work.accepted[mine.partner], sooner + i);
          },
          [&] { *num_next = 0; });
      block.for_each(count, [&](int m) {
        const int i = overloaded[m], which = work.proposal[i], j = candidate[i];
        PairCount mine = work.count[i];
        if (which >= 0 && work.accepted[j] == sooner + i) {
          const PairCount its = work.count[j], its_next = its.with_one_more_received();
          mine = mine.with_one_less_in_row();
          // The last partner of the row moves to the index of the pair that is given away.
          const PairRow row = rows.of(i);
          row[which] = row[mine.in_row()];
          work.received[its.received() * num_grains + j] = i;
          work.count[j] = its_next;
          work.count[i] = mine;
          if (its_next.owned() > Config::owned_pairs) next[block.fetch_add(num_next, 1)] = j;
        }
        if (mine.owned() > Config::owned_pairs) next[block.fetch_add(num_next, 1)] = i;
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
