// SPDX-License-Identifier: GPL-2.0-only
// Access of the phases of a step to single grains: loads, stores and sums.
// algorithm/packed_grains.h has the same functions for packs of grains. The computations are
// written once for both.

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
  template <class Scene> using ViewOf = GrainView<typename Scene::Numbers, Scene::D>;

  /// Returns grain i from the arrays of all grains.
  template <class Scene> RVE_INLINE ViewOf<Scene> view_grain(const SharedView<Scene> &shared, int i)
  {
    return {shared.motion[i], shared.spin[i], shared.radius[i]};
  }

  /// Adds force and torque to the sums of grain i over pairs of other owners.
  template <class Block, class Scene>
  RVE_INLINE void add_force(Block &block, const SharedView<Scene> &shared, int i,
                            const Vec<typename Scene::Sum, Scene::freedoms> &force)
  {
    constexpr int count = Scene::has_friction ? Scene::freedoms : Scene::D;
    for (int k = 0; k < count; ++k) block.accumulate(shared.force[k], shared.capacity, i, force[k]);
  }

  /// Returns force and torque on grain i from its own pairs and from those of other owners, and
  /// sets the sums of the latter to zero.
  template <class Block, class Scene>
  RVE_INLINE Vec<typename Scene::Sum, Scene::freedoms>
  collect_force(Block &block, const SharedView<Scene> &shared,
                const Vec<typename Scene::Sum, Scene::freedoms> &own, int i)
  {
    using Sum = typename Scene::Sum;
    Vec<Sum, Scene::freedoms> sum;
    for (int k = 0; k < Scene::freedoms; ++k)
      sum[k] = k < Scene::D || Scene::has_friction
          ? wrapping_sum(own[k], block.collect(shared.force[k], shared.capacity, i))
          : Sum(0);
    return sum;
  }

  /// Partners of grains and their radii, in registers of a thread or in arrays.
  template <class Block, class Scene> struct PartnersInSlots {
    template <class T> using Resident = typename Block::template Resident<T>;
    using Item = typename Block::Item;

    Resident<std::int32_t> slot[Scene::owned_pairs];
    Resident<typename Scene::Wide> radius_in[Scene::owned_pairs];

    RVE_INLINE PartnersInSlots(Block &block, const SharedView<Scene> &shared, int n)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        slot[k] = block.resident(shared.partner + k * n);
        radius_in[k] = block.resident(shared.partner_radius + k * n);
      }
    }

    RVE_INLINE void load(Item) {}
    RVE_INLINE void load_slot(const SharedView<Scene> &shared, int k, Item i)
    {
      slot[k].load(i);
      if (Block::kInRegisters) load_radius(shared, k, i);
    }
    RVE_INLINE void publish(Item i, const std::int32_t *partner)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) slot[k].publish(i, partner[k]);
    }
    /// Reads the radii of partners after all grains have been stored.
    RVE_INLINE void load_radii(const SharedView<Scene> &shared, Item i)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) load_radius(shared, k, i);
    }

    /// Sets all slots free.
    RVE_INLINE void clear_slots(Item i)
    {
      const typename Scene::Wide no_contact = kRadiusWithoutContact<Scene>;
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        slot[k].keep(i, i);
        radius_in[k].keep(i, no_contact);
      }
    }

    /// Makes the compiler compute the addresses of a partner's data again: kept through all steps
    /// they would take too many registers.
    RVE_INLINE void recompute_addresses(int k, Item i)
    {
      slot[k].keep(i, Block::opaque(slot[k][i]));
    }

    /// Returns the partner in slot k, or the own number if the slot is free.
    RVE_INLINE std::int32_t in_slot(int k, Item i) { return slot[k][i]; }
    /// Returns the grain whose data are read for the partner in slot k.
    RVE_INLINE int seen(int k, Item i) { return slot[k][i]; }
    RVE_INLINE typename Scene::Wide radius(const SharedView<Scene> &, int k, Item i)
    {
      return radius_in[k][i];
    }

   private:
    RVE_INLINE void load_radius(const SharedView<Scene> &shared, int k, Item i)
    {
      radius_in[k].keep(i, radius_of_partner(shared, i, slot[k][i]));
    }
  };

  /// Partners of a grain in a thread's registers, two per word. A free slot refers to the hidden
  /// grain after the last one.
  template <class Block, class Scene> class PackedPartners {
    static constexpr int kWords = (Scene::owned_pairs + 1) / 2;
    struct Words {
      std::uint32_t word[kWords];
    };
    typename Block::template Resident<Words> packed;
    std::int32_t *array;
    int num_grains;

   public:
    using Item = typename Block::Item;

    RVE_INLINE PackedPartners(Block &block, const SharedView<Scene> &shared, int n) :
        packed(block.template resident<Words>(nullptr)), array(shared.partner), num_grains(n)
    {
    }

    RVE_INLINE void load(Item i)
    {
      std::int32_t partner[Scene::owned_pairs];
      for (int k = 0; k < Scene::owned_pairs; ++k) partner[k] = array[k * num_grains + i];
      pack(i, partner);
    }
    RVE_INLINE void load_slot(const SharedView<Scene> &, int, Item) {}
    RVE_INLINE void publish(Item i, const std::int32_t *partner)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) array[k * num_grains + i] = partner[k];
      pack(i, partner);
    }
    RVE_INLINE void load_radii(const SharedView<Scene> &, Item) {}

    RVE_INLINE std::int32_t in_slot(int k, Item i)
    {
      const int j = seen(k, i);
      return j == num_grains ? static_cast<int>(i) : j;
    }
    RVE_INLINE int seen(int k, Item i)
    {
      return static_cast<int>((packed[i].word[k / 2] >> (16 * (k % 2))) & 0xffffu);
    }
    RVE_INLINE typename Scene::Wide radius(const SharedView<Scene> &shared, int k, Item i)
    {
      return shared.radius[seen(k, i)];
    }

   private:
    RVE_INLINE void pack(Item i, const std::int32_t *partner)
    {
      Words words = {};
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        const int j = partner[k] == static_cast<int>(i) ? num_grains : partner[k];
        words.word[k / 2] |= static_cast<std::uint32_t>(j) << (16 * (k % 2));
      }
      packed.keep(i, words);
    }
  };

  /// Histories of the pairs of one slot in memory. Each number has a row of its own, of which a
  /// warp reads whole lines.
  template <class History, class Number> class StreamedHistory {
    static constexpr int kNumbers = sizeof(History) / sizeof(Number);
    static_assert(kNumbers * sizeof(Number) == sizeof(History), "numbers and nothing else");
    Number *first;
    int next;    ///< distance of rows
    History *array;

   public:
    StreamedHistory() = default;
    /// Histories of slot k of `num_grains` grains.
    template <class Scene>
    RVE_INLINE StreamedHistory(const SharedView<Scene> &shared, int k, int num_grains) :
        first(shared.passing + k * shared.capacity), next(Scene::owned_pairs * shared.capacity),
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

  /// Streamed history of one pair, which was read ahead. After it is written it returns the new
  /// value.
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
  template <class Block, class Scene> struct GrainItems {
    template <class T> using Resident = typename Block::template Resident<T>;
    using Item = typename Block::Item;
    using Numbers = typename Scene::Numbers;
    using Traits = KernelTraits<Block, Scene>;
    using Sums = Vec<typename Scene::Sum, Scene::freedoms>;
    using History = typename Scene::History;
    /// Data of a grain that other grains read. For disks a thread also has a copy.
    template <class T, class Array>
    using Seen = std::conditional_t<Scene::D == 2, Resident<T>, ItemsInArray<T, Array>>;
    template <class T, class Array> static RVE_INLINE Seen<T, Array> seen(Block &block, Array array)
    {
      if constexpr (Scene::D == 2)
        return block.resident(array);
      else
        return {array};
    }
    /// The kernel configuration in the numbers of an item: here an item is one grain.
    template <class SomeItem> using SceneOf = Scene;

    Seen<MotionOf<Scene>, SeenMotion<Scene> *> motion;    ///< published
    Seen<Spin<typename Scene::Real, Scene::D>,
         SeenArray<Scene, Spin<typename Scene::Real, Scene::D>>>
        spin;    ///< published
    Seen<typename Scene::Wide, SeenArray<Scene, typename Scene::Wide>> radius;
    Resident<Sums> own;
    Resident<typename Scene::Real> largest_force;
    std::conditional_t<Traits::spheres_in_registers, PackedPartners<Block, Scene>,
                       PartnersInSlots<Block, Scene>>
        partners;
    using HistoryOfSlot =
        std::conditional_t<Traits::streams_history,
                           StreamedHistory<History, typename Scene::Spring>, Resident<History>>;
    HistoryOfSlot history[Scene::owned_pairs];
    /// History of the current slot, with streams_history.
    History read_ahead;

    /// Packs of grains need the workspace; single grains do not.
    RVE_INLINE GrainItems(Block &block, const SharedView<Scene> &shared,
                          const WorkspaceView<Scene> &, int n) :
        motion(seen<MotionOf<Scene>>(block, shared.motion)),
        spin(seen<Spin<typename Scene::Real, Scene::D>>(block, shared.spin)),
        radius(seen<typename Scene::Wide>(block, shared.radius)), own(block.resident(shared.own)),
        largest_force(block.resident(shared.largest_force)), partners(block, shared, n)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k)
        if constexpr (Traits::streams_history)
          history[k] = HistoryOfSlot(shared, k, n);
        else
          history[k] = block.resident(shared.history + k * n);
    }

    // ---- loads and saves ------------------------------------------------------------------------

    /// Loads all data but `own`, which is not kept from one segment of steps to the next.
    RVE_INLINE void load(const SharedView<Scene> &shared, Item i)
    {
      load_itself(i);
      for (int k = 0; k < Scene::owned_pairs; ++k) load_pair(shared, k, i);
    }

    /// Loads a grain for steps, without history that no step reads.
    RVE_INLINE void load_for_steps(const SharedView<Scene> &shared, Item i)
    {
      load(shared, i);
      if constexpr (Scene::has_friction && !Traits::streams_history)
        for (int k = 0; k < Scene::owned_pairs; ++k)
          history[k].keep(i, Scene::Law::history_for_steps(history[k][i]));
    }

    RVE_INLINE void load_itself(Item i)
    {
      motion.load(i);
      spin.load(i);
      radius.load(i);
      largest_force.load(i);
      partners.load(i);
    }

    RVE_INLINE void load_pair(const SharedView<Scene> &shared, int k, Item i)
    {
      if (Scene::has_friction) history[k].load_whole(i);
      partners.load_slot(shared, k, i);
    }

    /// Sets a disk that has no contacts and stays at rest, for a thread without a grain. The thread
    /// then makes the same steps as all others.
    RVE_INLINE void set_resting_grain(const SharedView<Scene> &shared, Item i)
    {
      const typename Scene::Wide no_contact = kRadiusWithoutContact<Scene>;
      motion.keep(i, MotionOf<Scene>());
      spin.keep(i, Spin<typename Scene::Real, Scene::D>());
      radius.keep(i, no_contact);
      own.keep(i, Sums());
      largest_force.keep(i, typename Scene::Real(0));
      partners.clear_slots(i);
      for (int k = 0; k < Scene::owned_pairs; ++k) history[k].keep(i, History());
      clear_sums<Block>(shared, i);
      set_response(shared, i, GrainResponseOf<Scene>());
    }

    /// Saves all data but `own`; published data are saved already.
    RVE_INLINE void save(Item i)
    {
      save_itself(i);
      for (int k = 0; k < Scene::owned_pairs; ++k) save_pair(k, i);
    }
    RVE_INLINE void save_itself(Item i) { largest_force.save(i); }
    RVE_INLINE void save_pair(int k, Item i)
    {
      if (Scene::has_friction) history[k].save_whole(i);
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

    RVE_INLINE ViewOf<Scene> view(Item i) { return {motion[i], spin[i], radius[i]}; }

    /// Returns the partner in slot k.
    RVE_INLINE ViewOf<Scene> view_partner(const SharedView<Scene> &shared, int k, Item i)
    {
      if constexpr (Traits::disks_in_registers) partners.recompute_addresses(k, i);
      const int j = partners.seen(k, i);
      return {shared.motion[j], shared.spin[j], partners.radius(shared, k, i)};
    }

    RVE_INLINE GrainResponseOf<Scene> response(const SharedView<Scene> &shared, Item i)
    {
      return response_of(shared, i);
    }

    /// Returns the history of the pair in slot k, for reading and writing.
    RVE_INLINE decltype(auto) history_of(int k, Item i)
    {
      if constexpr (Traits::streams_history)
        return StreamedPair<History, typename Scene::Spring>{read_ahead, history[k], i};
      else
        return history[k][i];
    }

    RVE_INLINE History saved_history(int k, Item i) { return history[k][i]; }
    /// Clears the history of a free slot.
    RVE_INLINE void clear_history(int k, Item i) { history[k].keep(i, History()); }
    RVE_INLINE std::int32_t partner_in_slot(int k, Item i) { return partners.in_slot(k, i); }
    RVE_INLINE bool is_taken(int k, Item i) { return partner_in_slot(k, i) != i; }

    RVE_INLINE typename Scene::Real largest_of(Item i) { return largest_force[i]; }
    RVE_INLINE void keep_largest(Item i, typename Scene::Real force)
    {
      largest_force.keep(i, force);
    }

    /// Calls act(k, step, other, geometry(step, other)) for the slots of grain i with the partners
    /// view(k). step() reads the constants of a step: once for disks in registers, otherwise once
    /// per pair. Constants that are read once occupy registers; constants that are read after the
    /// branch of touching pairs delay them. The last slot is skipped if is_taken(slot) is false:
    /// for disks it is free in whole warps, which are numbered in that order (ListRenewal). Other
    /// slots are rarely free, and the test would cost more than it saves.
    template <class Step, class View, class Geometry, class Act, class IsTaken>
    RVE_INLINE void for_slots(Item i, Step step, View view, Geometry geometry, Act act,
                              IsTaken is_taken)
    {
      if constexpr (Traits::disks_in_registers) {
        const auto here = step();
        RVE_UNROLL
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          if (k + 1 == Scene::owned_pairs && !is_taken(k)) continue;
          const auto other = view(k);
          act(k, here, other, geometry(here, other));
        }
      } else {
        // A streamed history is read while the previous pair is computed.
        [[maybe_unused]] History next;
        if constexpr (Traits::streams_history) next = history[0][i];
        RVE_UNROLL
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          if (k + 1 == Scene::owned_pairs && !is_taken(k)) continue;
          if constexpr (Traits::streams_history) {
            read_ahead = next;
            if (k + 1 < Scene::owned_pairs) next = history[k + 1][i];
          }
          const auto other = view(k);
          const auto here = step();
          act(k, here, other, geometry(here, other));
        }
      }
    }

    /// Calls f(part) for the parts of an item that are computed at once.
    template <class F> RVE_INLINE void for_parts(Item i, F f) { f(i); }

    /// Calls f(i) for each grain of an item with a number below `end`.
    template <class F> RVE_INLINE void for_each_grain(Item i, int end, F f)
    {
      if (i < end) f(i);
    }

    RVE_INLINE void add_to_partner(Block &block, const SharedView<Scene> &shared, int k, Item i,
                                   const Sums &force)
    {
      add_force(block, shared, partners.seen(k, i), force);
    }

    /// Stores the forces of the pairs that grain i owns.
    RVE_INLINE void keep_forces(Block &block, const SharedView<Scene> &shared, Item i,
                                const Sums &force, typename Scene::Real largest)
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
    RVE_INLINE Sums collect(Block &block, const SharedView<Scene> &shared, Item i)
    {
      return collect_force(block, shared, own[i], i);
    }

    /// Writes the record of a sphere after a kick and a drift, in pieces of 16 bytes.
    RVE_INLINE void publish(const SharedView<Scene> &shared, Item i, const ViewOf<Scene> &grain,
                            const GrainResponseOf<Scene> &response)
    {
      SpherePieces<Numbers> &pieces = shared.motion[i];
      pieces = SpherePieces<Numbers>{grain.motion.position,  grain.radius,
                                     grain.motion.velocity,  grain.spin,
                                     response.velocity_unit, response.spin_unit};
    }

    RVE_INLINE void publish_motion(Item i, const MotionOf<Scene> &x) { motion.publish(i, x); }

    /// Publishes the spin. Without friction no other grain reads it.
    RVE_INLINE void publish_spin(Item i, const Spin<typename Scene::Real, Scene::D> &x)
    {
      if constexpr (Traits::spheres_in_registers) return;    // publish() writes it
      if constexpr (Scene::has_friction)
        spin.publish(i, x);
      else
        spin.keep(i, x);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
