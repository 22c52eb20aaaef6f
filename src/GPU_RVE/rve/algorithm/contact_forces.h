// SPDX-License-Identifier: GPL-2.0-only
// Forces of all pairs of an RVE. Every pair is computed once, by the one of its two grains that
// owns it. ContactForces visits the pairs and stores the sums for the next phase; pair_force.h
// computes one pair.

#pragma once

#include "rve/algorithm/pair_force.h"
#include "rve/algorithm/passing_grains.h"
#include "rve/core/integer_sums.h"
#include "rve/core/pack_item.h"

#include <limits>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  constexpr float kInfinity = std::numeric_limits<float>::infinity();

  /// Returns the largest force on a grain. If this force, the velocity or the spin of the grain is
  /// NaN, the result is infinity.
  template <class Numbers, int D>
  RVE_INLINE float soundness(const GrainView<Numbers, D> &grain,
                             typename Numbers::Real largest_force)
  {
    const float force = static_cast<float>(largest_force);
    return moves_soundly<D>(grain.motion.velocity, grain.spin) && force == force ? force
                                                                                 : kInfinity;
  }

  /// Constants of a step in uniform registers. They are read before the grains move. The place of
  /// the read matters: the compiler decides by the number of reads, and by the instructions between
  /// them, whether a number stays in uniform registers (CUDA 13.0).
  template <class Config> struct UniformConstants {
    StepConstants<Config> step;
    std::int32_t num_grains;
  };
  /// Replaces UniformConstants in kernels without uniform registers, where pairs read the constants
  /// from memory.
  struct PlainConstants {
    std::int32_t num_grains;
  };
  template <class Config, class Block, class LawConstants>
  RVE_INLINE auto hold_constants(Block &block, const LawConstants &law, const PlanOf<Config> &plan,
                                 std::int32_t num_grains)
  {
    if constexpr (KernelTraits<Block, Config>::uniform_constants)
      return block.uniform(UniformConstants<Config>{step_constants<Config>(law, plan), num_grains});
    else
      return PlainConstants{num_grains};
  }

  template <Wanted wanted, class Block, class Config, class Grains, class Held>
  struct ContactForces {
    using Item = typename Block::Item;
    using Traits = KernelTraits<Block, Config>;
    using Sums = StressSums<Config::D>;
    template <class SomeItem> using ConfigFor = typename Grains::template ConfigOf<SomeItem>;
    /// True if a thread loads and saves its grains one after the other, at the end of a call.
    static constexpr bool in_turn = Traits::uniform_constants && wanted == Wanted::Reduction;

    Block &block;
    Grains &grains;
    const SharedView<Config> &shared;
    CallState<Config> &call;
    const typename Config::Law::Constants &law;    ///< law of the call, or a copy in registers
    const PlanOf<Config> &plan;
    int num_extra;
    Held held;
    int num_grains = held.num_grains;
    bool tracks_energy =
        wanted != Wanted::Forces && Config::has_bookkeeping && call.tracks_energy();
    typename Config::Real overlap_limit = static_cast<typename Config::Real>(
        wanted == Wanted::Reduction ? call.batch.overlap_limit : 0.0);

    // ---- phases ---------------------------------------------------------------------------------

    /// Computes the forces of a step.
    RVE_INLINE void sum_forces()
    {
      const auto visit = [&](const auto item) RVE_INLINE_LAMBDA {
        grains.for_parts(item, [&](const auto i) RVE_INLINE_LAMBDA {
          auto sum = begin_sum<ConfigFor<std::decay_t<decltype(i)>>>(grains.largest_of(i));
          add_owned_pairs(i, sum);
          grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
        });
        // Extra pairs are computed with the grains, without a phase of their own.
        grains.for_each_grain(item, num_extra, [&](Item i) RVE_INLINE_LAMBDA {
          auto sum = begin_sum<Config>(grains.largest_of(i));
          block.share_out(i, num_grains, num_extra,
                          [&](int m) RVE_INLINE_LAMBDA { add_extra_pair(m, sum); });
          grains.keep_largest(i, sum.largest_force);
        });
      };
      constexpr Visit way = Traits::disks_in_registers ? Visit::Registers : Visit::Items;
      block.template for_items<way>(num_grains, visit);
    }

    /// Computes the forces of a step and the Love sums in call.totals.sum. One thread calls then()
    /// afterwards.
    template <class Then> RVE_INLINE void sum_love_terms(Then then)
    {
      block.template add_up_items<Config::components, typename Config::Sum>(
          num_grains,
          [&](const auto item, auto *term) RVE_INLINE_LAMBDA {
            if constexpr (kIsPack<std::decay_t<decltype(item)>>) {
              add_pack(item, term);
            } else {
              const auto sum = add_grain(item);
              for (int k = 0; k < Config::components; ++k) term[k] = sum.stress[k];
              grains.save_with_forces(item);
            }
          },
          call.totals.sum, then);
    }

    /// Computes the last forces of a call and call.totals. The grains must be loaded, except for
    /// their pairs. With uniform_constants this function loads and saves the grains itself.
    RVE_INLINE void reduce()
    {
      // If a thread takes its grains in turn, it has no registers for sums of 64 bits. The sums of
      // two grains fit into 32 bits if all forces are within their limit. Larger forces are
      // reported as an error.
      constexpr bool adds_up = in_turn && kRelaxedSpheres<Config::D>;
      auto of_thread = Vec<typename Config::Sum, Config::components>::zero();
      const auto visit = [&](const auto item, auto *term, float &largest) RVE_INLINE_LAMBDA {
        if constexpr (kIsPack<std::decay_t<decltype(item)>>) {
          add_pack(item, term);
          grains.for_each_grain(item, num_grains, [&](Item i) RVE_INLINE_LAMBDA {
            largest = larger(largest, soundness(grains.view(i), grains.largest_of(i)));
          });
        } else {
          const Item i = item;
          const auto sum = add_grain(i);
          for (int k = 0; k < Config::components; ++k)
            if constexpr (adds_up)
              of_thread[k] = wrapping_sum(of_thread[k], sum.stress[k]);
            else
              term[k] = sum.stress[k];
          term[Sums::contacts] = sum.contacts;
          term[Sums::over_limit] = sum.over_limit;
          if constexpr (in_turn) grains.save_itself(i);    // its forces are on chip
          const float mine = soundness(grains.view(i), sum.largest_force);
          largest = mine > largest ? mine : largest;
        }
      };
      constexpr Visit way = in_turn ? Visit::InTurn : Visit::Items;
      block.template reduce_items<Sums::count, typename Config::Sum, way>(
          num_grains, visit,
          [&](auto *term) RVE_INLINE_LAMBDA {
            if constexpr (adds_up)
              for (int k = 0; k < Config::components; ++k) term[k] = of_thread[k];
          },
          call.totals);
    }

    // ---- pairs of a grain -----------------------------------------------------------------------

    /// Computes the pairs that grain i, or a pack of grains, owns.
    template <class SomeItem, class Sum> RVE_INLINE void add_owned_pairs(const SomeItem i, Sum &sum)
    {
      const auto me = grains.view(i);
      if constexpr (loads_pairs && !loads_each_pair)
        for (int k = 0; k < Config::owned_pairs; ++k) grains.load_pair(shared, k, i);
      grains.for_slots(
          i, [&]() RVE_INLINE_LAMBDA { return constants_of_pair<ConfigFor<SomeItem>>(); },
          [&](int k) RVE_INLINE_LAMBDA {
            if constexpr (loads_each_pair && !kIsPack<SomeItem>) grains.load_pair(shared, k, i);
            return grains.view_partner(shared, k, i);
          },
          [&](const auto &constants, const auto &other)
              RVE_INLINE_LAMBDA { return pair_geometry(constants, me, other); },
          [&](int k, const auto &constants, const auto &other, const auto &contact)
              RVE_INLINE_LAMBDA {
                using Real = typename ConfigFor<SomeItem>::Real;
                add_pair<wanted>(call, tracks_energy, constants, me, other, contact,
                                 static_cast<Real>(overlap_limit), grains.history_of(k, i), sum,
                                 [&](const auto &force) RVE_INLINE_LAMBDA {
                                   grains.add_to_partner(block, shared, k, i, force);
                                 });
                // Registers do not suffice for all histories: each is saved while the next pair is
                // computed.
                if constexpr (in_turn) grains.save_pair(k, i);
              },
          [&](int k) RVE_INLINE_LAMBDA { return is_slot_taken(k, i); });
      round_torque(sum);
    }

    /// True if the pairs must be loaded before they are computed. Pairs of InMemory stay loaded
    /// from step to step.
    static constexpr bool loads_pairs = wanted == Wanted::Reduction ||
        (wanted == Wanted::LoveSums && !Config::in_memory);
    /// True if each pair is loaded when it is needed, since the sums of the stress leave few
    /// registers.
    static constexpr bool loads_each_pair =
        loads_pairs && !Traits::streams_history && !Config::in_memory;

    template <class Here> RVE_INLINE StepConstants<Here> constants_of_pair()
    {
      if constexpr (Traits::uniform_constants && wanted == Wanted::Forces) {
        return held.step;
      } else {
        if constexpr (Traits::rereads_constants) block.reread();
        return step_constants<Here>(law, plan);
      }
    }

    /// Returns whether slot k has a pair, or true if the test would cost more than it saves.
    template <class SomeItem> RVE_INLINE bool is_slot_taken(int k, const SomeItem i)
    {
      if constexpr (Config::D != 2 || wanted == Wanted::Reduction) {
        return true;
      } else if constexpr (wanted == Wanted::Forces || kIsPack<SomeItem>) {
        return grains.is_taken(k, i);
      } else {
        // With loads_each_pair, the pair of the slot has not been loaded yet.
        if (shared.partner[k * num_grains + i] != i) return true;
        // The history register of this slot is saved with the others. Its old value would count as
        // a spring that is released.
        if constexpr (Block::kInRegisters) grains.clear_history(k, i);
        return false;
      }
    }

    /// Computes extra pair m and adds it to the sum of a grain.
    RVE_INLINE void add_extra_pair(int m, GrainSum<Config> &sum)
    {
      const PairView<Config> &pairs = call.pairs;
      const int first = pairs.extra_first[m], second = pairs.extra_second[m];
      const auto one = view_grain(shared, first), other = view_grain(shared, second);
      const auto constants = step_constants<Config>(law, plan);
      sum.own = Vec<typename Config::Sum, Config::freedoms>::zero();
      sum.torque = Vec<typename Config::Real, Config::spins>::zero();
      add_pair<wanted>(
          call, tracks_energy, constants, one, other, pair_geometry(constants, one, other),
          overlap_limit, pairs.extra_history[m], sum,
          [&](const auto &force) RVE_INLINE_LAMBDA { add_force(block, shared, second, force); });
      round_torque(sum);
      add_force(block, shared, first, sum.own);
    }

    RVE_INLINE void add_extra_pairs(Item i, GrainSum<Config> &sum)
    {
      for (int m = i; m < num_extra; m += num_grains) add_extra_pair(m, sum);
    }

    // ---- a grain or a pack of grains, with all sums ---------------------------------------------

    /// Computes the owned pairs of grain i and its share of the extra pairs, and stores the forces.
    /// The dissipation is added to work.friction and work.viscous, whose index is the number of the
    /// grain in the RveState.
    RVE_INLINE auto add_grain(Item i)
    {
      if constexpr (in_turn) grains.load_itself(i);
      auto sum = begin_sum<Config>(grains.largest_of(i));
      add_owned_pairs(i, sum);
      if constexpr (Traits::uniform_constants || Config::in_memory)
        grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
      else
        grains.own.keep(i, sum.own);
      add_extra_pairs(i, sum);
      grains.keep_largest(i, sum.largest_force);
      round_love(sum);
      if constexpr (Config::has_bookkeeping)
        if (tracks_energy) {
          const int number = call.number_of(i);
          call.work.friction[number] += sum.dissipation.friction;
          call.work.viscous[number] += sum.dissipation.viscous;
        }
      return sum;
    }

    template <class SomePack> RVE_INLINE void add_pack(const SomePack item, std::int64_t *term)
    {
      grains.for_parts(item, [&](const auto i) RVE_INLINE_LAMBDA {
        auto sum = begin_sum<ConfigFor<std::decay_t<decltype(i)>>>(grains.largest_of(i));
        add_owned_pairs(i, sum);
        grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
        round_love(sum);
        add_terms_of_pack(sum, term);
      });
      grains.for_each_grain(item, num_extra, [&](Item i) RVE_INLINE_LAMBDA {
        auto sum = begin_sum<Config>(grains.largest_of(i));
        add_extra_pairs(i, sum);
        grains.keep_largest(i, sum.largest_force);
        round_love(sum);
        add_terms_of_pack(sum, term);
      });
    }

    /// Adds the sums of a pack, whose terms are integers of 64 bits.
    template <class Sum>
    static RVE_INLINE void add_terms_of_pack(const Sum &sum, std::int64_t *term)
    {
      for (int k = 0; k < Config::components; ++k)
        term[k] = wrapping_sum(term[k], total(sum.stress[k]));
      if constexpr (wanted == Wanted::Reduction) {
        term[Sums::contacts] += sum.contacts;
        term[Sums::over_limit] += sum.over_limit;
      }
    }
  };

  template <Wanted wanted, class Block, class Config, class Grains, class Held>
  RVE_INLINE ContactForces<wanted, Block, Config, Grains, Held>
  contact_forces(Block &block, Grains &grains, const SharedView<Config> &shared,
                 CallState<Config> &call, const typename Config::Law::Constants &law,
                 const PlanOf<Config> &plan, int num_extra, const Held &held)
  {
    return {block, grains, shared, call, law, plan, num_extra, held};
  }

}    // namespace RVE_ISA
}    // namespace rve
