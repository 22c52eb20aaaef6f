// SPDX-License-Identifier: GPL-2.0-only
// PassingGrains gives the phases of a step access to spheres that fit neither into the registers
// nor into the shared memory of a block (InMemory). It has the functions of GrainItems
// (algorithm/grain_items.h): loads, stores and sums. Each step streams all data from memory. The
// data are therefore kept small:
//
//   - all forces on a grain are added up in one array
//   - a sphere has two records, of which only the first one is read for a partner that does not
//     touch
//   - the radius of a partner is read from its record
//   - a history that is zero is neither read nor written
//   - each number of a history has its own row, so that a warp reads whole cache lines

#pragma once

#include "rve/algorithm/grain_items.h"

namespace rve {
inline namespace RVE_ISA {

  /// Owned pairs of the grains during steps. The word of a slot has the index of the partner, and a
  /// bit that is set if the history of the pair is not zero.
  template <class Config> class PassingPairs {
    static_assert(Config::has_friction, "pairs have a history");
    using History = typename Config::History;
    using Rows = StreamedHistory<History, typename Config::Spring>;
    static constexpr int kSlots = Config::owned_pairs;
    static constexpr std::int32_t kHasHistory = 1 << 30;

    SharedView<Config> shared;
    std::int32_t word[kSlots];    ///< words of the current grain
    History before;               ///< history of the current pair

   public:
    RVE_INLINE explicit PassingPairs(const SharedView<Config> &view) : shared(view) {}

    // ---- loads and saves ------------------------------------------------------------------------

    RVE_INLINE void load(int k, int i)
    {
      const History stored = shared.history[place(k, i)];
      const bool has_history = Rows::is_nonzero(stored);
      if (has_history) rows(k).keep(i, stored);
      const std::int32_t partner = shared.partner[place(k, i)];
      shared.partner_word[place(k, i)] = has_history ? partner | kHasHistory : partner;
    }

    RVE_INLINE void save(int k, int i) const { shared.history[place(k, i)] = saved_history(k, i); }

    RVE_INLINE History saved_history(int k, int i) const
    {
      return stored_history(k, i, shared.partner_word[place(k, i)]);
    }

    /// Returns the partner in slot k, or i if the slot is free.
    RVE_INLINE std::int32_t in_slot(int k, int i) const
    {
      return shared.partner_word[place(k, i)] & ~kHasHistory;
    }

    // ---- the current grain ----------------------------------------------------------------------

    /// Reads all words of a grain before its first pair.
    RVE_INLINE void load_words(int i)
    {
      for (int k = 0; k < kSlots; ++k) word[k] = shared.partner_word[place(k, i)];
    }
    RVE_INLINE int partner(int k) const { return word[k] & ~kHasHistory; }
    RVE_INLINE History stored_history(int k, int i) const { return stored_history(k, i, word[k]); }
    RVE_INLINE void set_current(const History &history) { before = history; }

    /// History of the pair in slot k, for reading and writing. After a write it returns the new
    /// value.
    struct Memory {
      PassingPairs &pairs;
      int k, i;

      RVE_INLINE operator const History &() const { return pairs.before; }
      RVE_INLINE void operator=(const History &x) const { pairs.keep_history(k, i, x); }
    };

   private:
    RVE_INLINE int place(int k, int i) const { return k * shared.capacity + i; }

    RVE_INLINE Rows rows(int k) const { return Rows(shared, k, shared.capacity); }

    RVE_INLINE History stored_history(int k, int i, std::int32_t its_word) const
    {
      return (its_word & kHasHistory) != 0 ? rows(k)[i] : History();
    }

    RVE_INLINE void keep_history(int k, int i, const History &x)
    {
      const bool nonzero = Rows::is_nonzero(x);
      if (nonzero) rows(k).keep(i, x);
      before = x;
      if (nonzero != ((word[k] & kHasHistory) != 0)) {
        word[k] ^= kHasHistory;
        shared.partner_word[place(k, i)] = word[k];
      }
    }
  };

  template <class Block, class Config> class PassingGrains {
    using Item = typename Block::Item;
    using Numbers = typename Config::Numbers;
    using Real = typename Config::Real;
    using Shared = SharedView<Config>;

    SpheresInParts<Numbers> sphere;
    PassingPairs<Config> pairs;
    Real *largest_of_grain;
    /// Largest force on any grain of a thread. No code needs the largest force on a single grain.
    Real largest;

   public:
    using Sums = Vec<typename Config::Sum, Config::freedoms>;
    template <class SomeItem> using ConfigOf = Config;

    RVE_INLINE PassingGrains(Block &, const Shared &shared, const WorkspaceView<Config> &, int) :
        sphere(shared.motion), pairs(shared), largest_of_grain(shared.largest_force), largest(0)
    {
    }

    // ---- loads and saves ------------------------------------------------------------------------

    RVE_INLINE void load(const Shared &shared, Item i)
    {
      load_itself(i);
      for (int k = 0; k < Config::owned_pairs; ++k) load_pair(shared, k, i);
    }
    RVE_INLINE void load_itself(Item i) { largest = larger(largest, largest_of_grain[i]); }
    RVE_INLINE void load_pair(const Shared &, int k, Item i) { pairs.load(k, i); }
    RVE_INLINE void save(Item i)
    {
      save_with_forces(i);
      save_pairs(i);
    }
    RVE_INLINE void save_pairs(Item i)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) pairs.save(k, i);
    }
    /// Forces and pairs are in memory already.
    RVE_INLINE void load_forces(Item) {}
    RVE_INLINE void load_with_forces(Item i) { load_itself(i); }
    RVE_INLINE void save_with_forces(Item i) { largest_of_grain[i] = largest; }

    // ---- access during the phases of a step -----------------------------------------------------

    RVE_INLINE ViewOf<Config> view(int i) const
    {
      const auto place = Block::read_whole(sphere.place[i]);
      const auto course = Block::read_whole(sphere.course[i]);
      return {{place.position, course.velocity}, course.spin, place.radius};
    }

    RVE_INLINE ViewOf<Config> view_partner(const Shared &, int k, Item i) const
    {
      const int j = pairs.partner(k);
      ViewOf<Config> other = view(j);
      if (j == i)
        other.radius = Config::Law::has_reach ? kRadiusWithoutContact<Config> : -other.radius;
      return other;
    }

    RVE_INLINE GrainResponseOf<Config> response(const Shared &shared, Item i) const
    {
      const auto course = Block::read_whole(sphere.course[i]);
      return {course.velocity_unit, course.spin_unit, shared.list_position[i]};
    }

    RVE_INLINE auto history_of(int k, Item i)
    {
      return typename PassingPairs<Config>::Memory{pairs, k, i};
    }
    RVE_INLINE typename Config::History saved_history(int k, Item i) const
    {
      return pairs.saved_history(k, i);
    }
    RVE_INLINE std::int32_t partner_in_slot(int k, Item i) const { return pairs.in_slot(k, i); }

    RVE_INLINE Real largest_of(Item) const { return largest; }
    RVE_INLINE void keep_largest(Item, Real force) { largest = force; }

    /// Visits the slots as in GrainItems. A history is read while the previous pair is computed.
    /// Partners are not read ahead: the reads of partners that do not touch would take more time
    /// than they save (measured on an H200).
    template <class Step, class View, class Geometry, class Act, class IsTaken>
    RVE_INLINE void for_slots(Item i, Step step, View view, Geometry geometry, Act act, IsTaken)
    {
      pairs.load_words(i);
      typename Config::History next = pairs.stored_history(0, i);
      RVE_UNROLL
      for (int k = 0; k < Config::owned_pairs; ++k) {
        pairs.set_current(next);
        if (k + 1 < Config::owned_pairs) next = pairs.stored_history(k + 1, i);
        const auto other = view(k);
        const auto here = step();
        act(k, here, other, geometry(here, other));
      }
    }

    template <class F> RVE_INLINE void for_parts(Item i, F f) { f(i); }
    template <class F> RVE_INLINE void for_each_grain(Item i, int end, F f)
    {
      if (i < end) f(i);
    }

    RVE_INLINE void add_to_partner(Block &block, const Shared &shared, int k, Item,
                                   const Sums &force)
    {
      add_force(block, shared, pairs.partner(k), force);
    }
    RVE_INLINE void keep_forces(Block &block, const Shared &shared, Item i, const Sums &force,
                                Real largest_now)
    {
      add_force(block, shared, i, force);
      largest = largest_now;
    }
    RVE_INLINE Sums collect(Block &block, const Shared &shared, Item i) const
    {
      return collect_force(block, shared, Sums(), i);
    }

    /// Writes both records of a sphere after a kick and a drift.
    RVE_INLINE void publish(const Shared &, Item i, const ViewOf<Config> &grain,
                            const GrainResponseOf<Config> &response)
    {
      Block::write_whole(sphere.place[i],
                         SpherePlace<Numbers>{grain.motion.position, grain.radius});
      Block::write_whole(sphere.course[i],
                         SphereCourse<Numbers>{grain.motion.velocity, grain.spin,
                                               response.velocity_unit, response.spin_unit});
    }
    RVE_INLINE void publish_spin(Item, const Spin<Real, Config::D> &) {}    // publish() writes it
  };

  /// Access to single grains in a kernel configuration.
  template <class Block, class Config>
  using GrainsOf = std::conditional_t<Config::in_memory, PassingGrains<Block, Config>,
                                      GrainItems<Block, Config>>;

}    // namespace RVE_ISA
}    // namespace rve
