// SPDX-License-Identifier: GPL-2.0-only
// GrainItems gives the phases of a step access to single grains: loads, stores and sums.
// algorithm/packed_grains.h has the same functions for packs of grains, so that the computations
// are written once for both.

#pragma once

#include "rve/algorithm/system_view.h"
#include "rve/core/integer_sums.h"
#include "rve/core/pack_item.h"

namespace rve {
inline namespace RVE_ISA {

  /// A grain in internal units, for its contacts.
  template <class Numbers, int D> struct GrainView {
    Motion<Numbers, D> motion;
    Spin<typename Numbers::Real, D> spin;
    typename Numbers::Wide radius;
  };
  template <class Config> using ViewOf = GrainView<typename Config::Numbers, Config::D>;

  /// Returns grain i from the arrays of all grains.
  template <class Config>
  RVE_INLINE ViewOf<Config> view_grain(const SharedView<Config> &shared, int i)
  {
    return {shared.motion[i], shared.spin[i], shared.radius[i]};
  }

  /// Adds a force and torque to the sums of grain i over the pairs that other grains own.
  template <class Block, class Config>
  RVE_INLINE void add_force(Block &block, const SharedView<Config> &shared, int i,
                            const Vec<typename Config::Sum, Config::freedoms> &force)
  {
    constexpr int count = Config::has_friction ? Config::freedoms : Config::D;
    for (int k = 0; k < count; ++k) block.accumulate(shared.force[k], shared.capacity, i, force[k]);
  }

  /// Returns the force and torque on grain i from all pairs: `own`, from the pairs that grain i
  /// owns, plus the sums over the pairs that other grains own. Sets these sums to zero.
  template <class Block, class Config>
  RVE_INLINE Vec<typename Config::Sum, Config::freedoms>
  collect_force(Block &block, const SharedView<Config> &shared,
                const Vec<typename Config::Sum, Config::freedoms> &own, int i)
  {
    using Sum = typename Config::Sum;
    Vec<Sum, Config::freedoms> sum;
    for (int k = 0; k < Config::freedoms; ++k)
      sum[k] = k < Config::D || Config::has_friction
          ? wrapping_sum(own[k], block.collect(shared.force[k], shared.capacity, i))
          : Sum(0);
    return sum;
  }

  /// Partners of grains and their radii, in registers of a thread or in arrays.
  template <class Block, class Config> struct PartnersInSlots {
    template <class T> using Resident = typename Block::template Resident<T>;
    using Item = typename Block::Item;

    Resident<std::int32_t> slot[Config::owned_pairs];
    Resident<typename Config::Wide> radius_in[Config::owned_pairs];

    RVE_INLINE PartnersInSlots(Block &block, const SharedView<Config> &shared, int n)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) {
        slot[k] = block.resident(shared.partner + k * n);
        radius_in[k] = block.resident(shared.partner_radius + k * n);
      }
    }

    RVE_INLINE void load(Item) {}
    RVE_INLINE void load_slot(const SharedView<Config> &shared, int k, Item i)
    {
      slot[k].load(i);
      if (Block::kInRegisters) load_radius(shared, k, i);
    }
    RVE_INLINE void publish(Item i, const std::int32_t *partner)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) slot[k].publish(i, partner[k]);
    }
    /// Reads the radii of partners after all grains have been stored.
    RVE_INLINE void load_radii(const SharedView<Config> &shared, Item i)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) load_radius(shared, k, i);
    }

    /// Marks all slots as free.
    RVE_INLINE void clear_slots(Item i)
    {
      const typename Config::Wide no_contact = kRadiusWithoutContact<Config>;
      for (int k = 0; k < Config::owned_pairs; ++k) {
        slot[k].keep(i, i);
        radius_in[k].keep(i, no_contact);
      }
    }

    /// Makes the compiler compute the addresses of a partner's data again. If the addresses were
    /// kept through all steps, they would take too many registers.
    RVE_INLINE void recompute_addresses(int k, Item i)
    {
      slot[k].keep(i, Block::opaque(slot[k][i]));
    }

    /// Returns the partner in slot k, or i if the slot is free.
    RVE_INLINE std::int32_t in_slot(int k, Item i) { return slot[k][i]; }
    /// Returns the grain whose data are read for the partner in slot k.
    RVE_INLINE int seen(int k, Item i) { return slot[k][i]; }
    RVE_INLINE typename Config::Wide radius(const SharedView<Config> &, int k, Item i)
    {
      return radius_in[k][i];
    }

   private:
    RVE_INLINE void load_radius(const SharedView<Config> &shared, int k, Item i)
    {
      radius_in[k].keep(i, radius_of_partner(shared, i, slot[k][i]));
    }
  };

  /// Partners of a grain in a thread's registers, two per word. A free slot refers to the hidden
  /// grain after the last one.
  template <class Block, class Config> class PackedPartners {
    static constexpr int kWords = (Config::owned_pairs + 1) / 2;
    struct Words {
      std::uint32_t word[kWords];
    };
    typename Block::template Resident<Words> packed;
    std::int32_t *array;
    int num_grains;

   public:
    using Item = typename Block::Item;

    RVE_INLINE PackedPartners(Block &block, const SharedView<Config> &shared, int n) :
        packed(block.template resident<Words>(nullptr)), array(shared.partner), num_grains(n)
    {
    }

    RVE_INLINE void load(Item i)
    {
      std::int32_t partner[Config::owned_pairs];
      for (int k = 0; k < Config::owned_pairs; ++k) partner[k] = array[k * num_grains + i];
      pack(i, partner);
    }
    RVE_INLINE void load_slot(const SharedView<Config> &, int, Item) {}
    RVE_INLINE void publish(Item i, const std::int32_t *partner)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) array[k * num_grains + i] = partner[k];
      pack(i, partner);
    }
    RVE_INLINE void load_radii(const SharedView<Config> &, Item) {}

    RVE_INLINE std::int32_t in_slot(int k, Item i)
    {
      const int j = seen(k, i);
      return j == num_grains ? static_cast<int>(i) : j;
    }
    RVE_INLINE int seen(int k, Item i)
    {
      return static_cast<int>((packed[i].word[k / 2] >> (16 * (k % 2))) & 0xffffu);
    }
    RVE_INLINE typename Config::Wide radius(const SharedView<Config> &shared, int k, Item i)
    {
      return shared.radius[seen(k, i)];
    }

   private:
    RVE_INLINE void pack(Item i, const std::int32_t *partner)
    {
      Words words = {};
      for (int k = 0; k < Config::owned_pairs; ++k) {
        const int j = partner[k] == static_cast<int>(i) ? num_grains : partner[k];
        words.word[k / 2] |= static_cast<std::uint32_t>(j) << (16 * (k % 2));
      }
      packed.keep(i, words);
    }
  };

  /// Histories of the pairs of one slot in memory. Each number of a history has its own row, so
  /// that a warp reads whole cache lines.
  template <class History, class Number> class StreamedHistory {
    static constexpr int kNumbers = sizeof(History) / sizeof(Number);
    static_assert(kNumbers * sizeof(Number) == sizeof(History), "numbers and nothing else");
    Number *first;
    int next;    ///< distance between rows, in numbers
    History *array;

   public:
    StreamedHistory() = default;
    /// Histories of slot k of `num_grains` grains.
    template <class Config>
    RVE_INLINE StreamedHistory(const SharedView<Config> &shared, int k, int num_grains) :
        first(shared.passing + k * shared.capacity), next(Config::owned_pairs * shared.capacity),
        array(shared.history + k * num_grains)
    {
    }

    static RVE_INLINE bool is_nonzero(const History &x)
    {
      bool nonzero = false;
      for (int m = 0; m < kNumbers; ++m)
        nonzero = nonzero || reinterpret_cast<const Number *>(&x)[m] != Number(0);
      return nonzero;
    }

    RVE_INLINE History operator[](int i) const
    {
      History x;
      for (int m = 0; m < kNumbers; ++m) reinterpret_cast<Number *>(&x)[m] = first[m * next + i];
      return x;
    }
    RVE_INLINE void keep(int i, const History &x)
    {
      for (int m = 0; m < kNumbers; ++m)
        first[m * next + i] = reinterpret_cast<const Number *>(&x)[m];
    }
    RVE_INLINE void load_whole(int i) { keep(i, array[i]); }
    RVE_INLINE void save_whole(int i) { array[i] = (*this)[i]; }
  };

  /// Streamed history of one pair, which was read ahead. After a write it returns the new value.
  template <class History, class Number> struct StreamedPair {
    History &before;
    StreamedHistory<History, Number> &rows;
    int i;

    RVE_INLINE operator const History &() const { return before; }
    RVE_INLINE void operator=(const History &x) const
    {
      before = x;
      rows.keep(i, x);
    }
  };

  /// Grains of a block. A thread of a GPU keeps its grains in registers from step to step.
  template <class Block, class Config> struct GrainItems {
    template <class T> using Resident = typename Block::template Resident<T>;
    using Item = typename Block::Item;
    using Numbers = typename Config::Numbers;
    using Traits = KernelTraits<Block, Config>;
    using Sums = Vec<typename Config::Sum, Config::freedoms>;
    using History = typename Config::History;
    /// Data of a grain that other grains read. For disks the thread of the grain also has a copy.
    template <class T, class Array>
    using Seen = std::conditional_t<Config::D == 2, Resident<T>, ItemsInArray<T, Array>>;
    template <class T, class Array> static RVE_INLINE Seen<T, Array> seen(Block &block, Array array)
    {
      if constexpr (Config::D == 2)
        return block.resident(array);
      else
        return {array};
    }
    /// The kernel configuration in the number format of an item; here an item is one grain.
    template <class SomeItem> using ConfigOf = Config;

    Seen<MotionOf<Config>, SeenMotion<Config> *> motion;    ///< published
    Seen<Spin<typename Config::Real, Config::D>,
         SeenArray<Config, Spin<typename Config::Real, Config::D>>>
        spin;    ///< published
    Seen<typename Config::Wide, SeenArray<Config, typename Config::Wide>> radius;
    Resident<Sums> own;
    Resident<typename Config::Real> largest_force;
    std::conditional_t<Traits::spheres_in_registers, PackedPartners<Block, Config>,
                       PartnersInSlots<Block, Config>>
        partners;
    using HistoryOfSlot =
        std::conditional_t<Traits::streams_history,
                           StreamedHistory<History, typename Config::Spring>, Resident<History>>;
    HistoryOfSlot history[Config::owned_pairs];
    /// History of the current slot, with streams_history.
    History read_ahead;

    /// The workspace is unused here; packs of grains need it.
    RVE_INLINE GrainItems(Block &block, const SharedView<Config> &shared,
                          const WorkspaceView<Config> &, int n) :
        motion(seen<MotionOf<Config>>(block, shared.motion)),
        spin(seen<Spin<typename Config::Real, Config::D>>(block, shared.spin)),
        radius(seen<typename Config::Wide>(block, shared.radius)), own(block.resident(shared.own)),
        largest_force(block.resident(shared.largest_force)), partners(block, shared, n)
    {
      for (int k = 0; k < Config::owned_pairs; ++k)
        if constexpr (Traits::streams_history)
          history[k] = HistoryOfSlot(shared, k, n);
        else
          history[k] = block.resident(shared.history + k * n);
    }

    // ---- loads and saves ------------------------------------------------------------------------

    /// Loads all data except the forces `own`, which are not kept from one segment of steps to the
    /// next.
    RVE_INLINE void load(const SharedView<Config> &shared, Item i)
    {
      load_itself(i);
      for (int k = 0; k < Config::owned_pairs; ++k) load_pair(shared, k, i);
    }

    /// Loads a grain for steps, without history that no step reads.
    RVE_INLINE void load_for_steps(const SharedView<Config> &shared, Item i)
    {
      load(shared, i);
      if constexpr (Config::has_friction && !Traits::streams_history)
        for (int k = 0; k < Config::owned_pairs; ++k)
          history[k].keep(i, Config::Law::history_for_steps(history[k][i]));
    }

    RVE_INLINE void load_itself(Item i)
    {
      motion.load(i);
      spin.load(i);
      radius.load(i);
      largest_force.load(i);
      partners.load(i);
    }

    RVE_INLINE void load_pair(const SharedView<Config> &shared, int k, Item i)
    {
      if (Config::has_friction) history[k].load_whole(i);
      partners.load_slot(shared, k, i);
    }

    /// Sets a disk that has no contacts and stays at rest, for a thread without a grain. The thread
    /// then makes the same steps as all others.
    RVE_INLINE void set_resting_grain(const SharedView<Config> &shared, Item i)
    {
      const typename Config::Wide no_contact = kRadiusWithoutContact<Config>;
      motion.keep(i, MotionOf<Config>());
      spin.keep(i, Spin<typename Config::Real, Config::D>());
      radius.keep(i, no_contact);
      own.keep(i, Sums());
      largest_force.keep(i, typename Config::Real(0));
      partners.clear_slots(i);
      for (int k = 0; k < Config::owned_pairs; ++k) history[k].keep(i, History());
      clear_sums<Block>(shared, i);
      set_response(shared, i, GrainResponseOf<Config>());
    }

    /// Saves all data except the forces `own`. Published data are saved already.
    RVE_INLINE void save(Item i)
    {
      save_itself(i);
      for (int k = 0; k < Config::owned_pairs; ++k) save_pair(k, i);
    }
    RVE_INLINE void save_itself(Item i) { largest_force.save(i); }
    RVE_INLINE void save_pair(int k, Item i)
    {
      if (Config::has_friction) history[k].save_whole(i);
    }

    /// Loads a grain with its forces and without pairs, for a move.
    RVE_INLINE void load_with_forces(Item i)
    {
      load_itself(i);
      own.load(i);
    }

    /// Loads the forces if they are not on chip.
    RVE_INLINE void load_forces(Item i)
    {
      if constexpr (Traits::uniform_constants)
        own.keep(i, Sums());
      else
        own.load(i);
    }

    /// Saves a grain with its forces, for a move that loads them.
    RVE_INLINE void save_with_forces(Item i)
    {
      save(i);
      own.save(i);
    }

    // ---- access during the phases of a step -----------------------------------------------------

    RVE_INLINE ViewOf<Config> view(Item i) { return {motion[i], spin[i], radius[i]}; }

    /// Returns the partner in slot k.
    RVE_INLINE ViewOf<Config> view_partner(const SharedView<Config> &shared, int k, Item i)
    {
      if constexpr (Traits::disks_in_registers) partners.recompute_addresses(k, i);
      const int j = partners.seen(k, i);
      return {shared.motion[j], shared.spin[j], partners.radius(shared, k, i)};
    }

    RVE_INLINE GrainResponseOf<Config> response(const SharedView<Config> &shared, Item i)
    {
      return response_of(shared, i);
    }

    /// Returns the history of the pair in slot k, for reading and writing.
    RVE_INLINE decltype(auto) history_of(int k, Item i)
    {
      if constexpr (Traits::streams_history)
        return StreamedPair<History, typename Config::Spring>{read_ahead, history[k], i};
      else
        return history[k][i];
    }

    RVE_INLINE History saved_history(int k, Item i) { return history[k][i]; }
    /// Clears the history of a free slot.
    RVE_INLINE void clear_history(int k, Item i) { history[k].keep(i, History()); }
    RVE_INLINE std::int32_t partner_in_slot(int k, Item i) { return partners.in_slot(k, i); }
    RVE_INLINE bool is_taken(int k, Item i) { return partner_in_slot(k, i) != i; }

    RVE_INLINE typename Config::Real largest_of(Item i) { return largest_force[i]; }
    RVE_INLINE void keep_largest(Item i, typename Config::Real force)
    {
      largest_force.keep(i, force);
    }

    /// Calls act(k, here, other, geometry(here, other)) for each slot k of grain i. `other` is the
    /// partner, from view(k), and `here` are the constants of the step, from step(). step() is
    /// called once for a disk in registers, and once per pair for other grains. Constants that are
    /// read once occupy registers. Constants that are read inside the branch for touching pairs
    /// delay these pairs. The last slot is skipped if is_taken(slot) is false: ListRenewal numbers
    /// disks so that whole warps have a free last slot. Other slots are rarely free, and the test
    /// would cost more than it saves.
    template <class Step, class View, class Geometry, class Act, class IsTaken>
    RVE_INLINE void for_slots(Item i, Step step, View view, Geometry geometry, Act act,
                              IsTaken is_taken)
    {
      if constexpr (Traits::disks_in_registers) {
        const auto here = step();
        RVE_UNROLL
        for (int k = 0; k < Config::owned_pairs; ++k) {
          if (k + 1 == Config::owned_pairs && !is_taken(k)) continue;
          const auto other = view(k);
          act(k, here, other, geometry(here, other));
        }
      } else {
        // A streamed history is read while the previous pair is computed.
        [[maybe_unused]] History next;
        if constexpr (Traits::streams_history) next = history[0][i];
        RVE_UNROLL
        for (int k = 0; k < Config::owned_pairs; ++k) {
          if (k + 1 == Config::owned_pairs && !is_taken(k)) continue;
          if constexpr (Traits::streams_history) {
            read_ahead = next;
            if (k + 1 < Config::owned_pairs) next = history[k + 1][i];
          }
          const auto other = view(k);
          const auto here = step();
          act(k, here, other, geometry(here, other));
        }
      }
    }

    /// Calls f(part) for each part of an item that is computed at once. A single grain is one part.
    template <class F> RVE_INLINE void for_parts(Item i, F f) { f(i); }

    /// Calls f(i) for each grain of an item with a number below `end`.
    template <class F> RVE_INLINE void for_each_grain(Item i, int end, F f)
    {
      if (i < end) f(i);
    }

    RVE_INLINE void add_to_partner(Block &block, const SharedView<Config> &shared, int k, Item i,
                                   const Sums &force)
    {
      add_force(block, shared, partners.seen(k, i), force);
    }

    /// Stores the forces of the pairs that grain i owns.
    RVE_INLINE void keep_forces(Block &block, const SharedView<Config> &shared, Item i,
                                const Sums &force, typename Config::Real largest)
    {
      if constexpr (Traits::spheres_in_registers) {
        add_force(block, shared, i, force);
        own.keep(i, Sums());
      } else {
        own.keep(i, force);
      }
      largest_force.keep(i, largest);
    }

    /// Returns force and torque from all pairs.
    RVE_INLINE Sums collect(Block &block, const SharedView<Config> &shared, Item i)
    {
      return collect_force(block, shared, own[i], i);
    }

    /// Writes the record of a sphere after a kick and a drift, in pieces of 16 bytes.
    RVE_INLINE void publish(const SharedView<Config> &shared, Item i, const ViewOf<Config> &grain,
                            const GrainResponseOf<Config> &response)
    {
      SpherePieces<Numbers> &pieces = shared.motion[i];
      pieces = SpherePieces<Numbers>{grain.motion.position,  grain.radius,
                                     grain.motion.velocity,  grain.spin,
                                     response.velocity_unit, response.spin_unit};
    }

    RVE_INLINE void publish_motion(Item i, const MotionOf<Config> &x) { motion.publish(i, x); }

    /// Publishes the spin. Without friction no other grain reads it.
    RVE_INLINE void publish_spin(Item i, const Spin<typename Config::Real, Config::D> &x)
    {
      if constexpr (Traits::spheres_in_registers) return;    // publish() writes it
      if constexpr (Config::has_friction)
        spin.publish(i, x);
      else
        spin.keep(i, x);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
