// SPDX-License-Identifier: GPL-2.0-only
// The kernel: advances one RVE by one call, on one CPU thread or one CUDA thread block.
//
//   grains, pairs and units from the stored state                          call_begin.h
//   for each step:                                                         make_steps
//     H <- cell of the step on its path, or by the servo                   step_planning.h
//     c <- c + dt F/m with local damping, s <- s + dt H^-1 c               move: last kick, drift
//     if a grain has moved farther than the list allows, or the
//     lattice must be reduced: reduce the lattice, build the list          list_renewal.h
//     F <- sums of the contact forces of all pairs                         contact_forces.h
//     with bookkeeping: Love sums, work, energy lost, rate of the servo    step_bookkeeping.h
//   Love stress of the last forces; details on demand                      homogenization.h
//   last kick, status, everything back to the stored state                 call_end.h
//
// The kick of a step is made at the beginning of the next step, which saves a barrier. The stress
// of a call belongs to its end configuration.

#pragma once

#include "rve/algorithm/call_begin.h"
#include "rve/algorithm/call_end.h"
#include "rve/algorithm/contact_forces.h"
#include "rve/algorithm/grain_motion.h"
#include "rve/algorithm/homogenization.h"
#include "rve/algorithm/step_bookkeeping.h"
#include "rve/core/pack_item.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Kernel of one call. In the steps, StepGrains accesses the grains one at a time, or in packs
  /// where possible. All other phases use single grains.
  template <class Block, class Config, class StepGrains = GrainsOf<Block, Config>> class RveKernel {
    using Item = typename Block::Item;
    using Real = typename Config::Real;
    using Wide = typename Config::Wide;

    using Traits = KernelTraits<Block, Config>;
    using Begin = CallBegin<Block, Config>;
    using Bookkeeping = StepBookkeeping<Block, Config>;
    using Planning = StepPlanning<Block, Config>;
    using Renewal = ListRenewal<Block, Config>;
    using Stored = StoredGrains<Block, Config>;
    using Progress = CallProgress<Config>;
    using End = CallEnd<Block, Config>;
    using Grains = GrainsOf<Block, Config>;

   public:
    /// Takes a call for which CallBegin::prepare() and set_views() have run; `shared_in` is one of
    /// the views.
    RVE_INLINE RveKernel(Block &block_in, CallState<Config> &call_in,
                         const SharedView<Config> &shared_in) :
        block(block_in),
        call(call_in), shared(shared_in), num_grains(call_in.num_grains)
    {
    }

    /// Runs the call. It always writes `answer`. It writes the stored state only if no fatal error
    /// occurred, and details only if `detail` is not null.
    RVE_INLINE void run(AnswerRecord<Config::D> &answer, DetailRecord<Config::D> *detail)
    {
      const bool direct = Begin::is_direct(call);
      if (direct)
        Begin::take_extra_pairs(block, call);
      else
        Begin::begin(block, call, shared);
      if (!call.fatal()) run_steps(direct);
      if (call.fatal())
        fail(call.status, answer);
      else
        finish(answer, detail);
    }

   private:
    /// Returns whether the call has no substeps and only evaluates forces.
    RVE_INLINE bool evaluates() const { return call.drive.substeps == 0; }
    RVE_INLINE int last_step() const { return evaluates() ? 1 : call.drive.substeps; }

    RVE_INLINE Bookkeeping bookkeeping() const { return Bookkeeping(block, call); }
    /// Returns whether the Love sums of every step are needed.
    RVE_INLINE bool keeps_bookkeeping() const
    {
      return Config::steers && !evaluates() && bookkeeping().is_wanted();
    }

    // ---- the order of steps ---------------------------------------------------------------------

    /// Makes all steps except the forces of the last one. With `direct` the steps must read the
    /// grains from the stored state.
    RVE_INLINE void run_steps(bool direct)
    {
      if constexpr (Config::steers)
        if (keeps_bookkeeping()) {
          run_with_bookkeeping();
          return;
        }
      if (evaluates()) {
        if (call.plan_last < 1) Planning::make_plan(block, call, 1);
        return;
      }
      make_steps<false>(direct);
    }
    RVE_APART void run_with_bookkeeping() { make_steps<true>(false); }

    /// Makes the steps in segments. A segment ends with a step whose grains have moved and whose
    /// forces are missing. With energy bookkeeping there is a step 0, which has forces only.
    template <bool with_bookkeeping> RVE_INLINE void make_steps(bool direct)
    {
      const int last = last_step();
      const Bookkeeping has_bookkeeping = bookkeeping();
      bool moved = with_bookkeeping && has_bookkeeping.tracks_energy;
      int k = moved ? 0 : 1;
      if constexpr (with_bookkeeping) begin_bookkeeping(has_bookkeeping);
      for (;; moved = true) {
        if constexpr (with_bookkeeping)
          k = make_step(has_bookkeeping, k, moved);
        else
          k = make_segment(k, moved, direct && !moved);
        if (needs_renewal) {
          if constexpr (with_bookkeeping) save_pairs();
          Renewal::renew(block, call, k);
          if (call.fatal()) return;
          if constexpr (with_bookkeeping) load_pairs();
        }
        if (k == last) break;
      }
      if constexpr (with_bookkeeping) save_pairs();
    }

    // ---- steps with bookkeeping: grains are loaded for each phase -------------------------------

    RVE_INLINE void begin_bookkeeping(const Bookkeeping &has_bookkeeping)
    {
      block.begin_add_up();
      if (has_bookkeeping.tracks_energy) {
        has_bookkeeping.begin_step_zero();
      } else {
        block.once([&] {
          has_bookkeeping.grow_cell();
          call.list_inverse = inverse(call.list_cell);
        });
        has_bookkeeping.begin_step(1);
      }
      load_pairs();
    }

    /// If `moved` is true, the grains have made the move of step k; the function computes the
    /// forces of step k and makes the move of step k + 1. Otherwise it makes the move of step k.
    /// Returns the step of the move.
    RVE_INLINE int make_step(const Bookkeeping &has_bookkeeping, int k, bool moved)
    {
      if (moved) {
        sum_forces_and_stress(has_bookkeeping, k);
        has_bookkeeping.begin_step(++k);
      }
      block.begin_add_up();
      StepGrains grains(block, shared, call.work, num_grains);
      load_with_forces(grains);
      needs_renewal = move<Visit::Items>(grains, call.planned(k), call.alpha, num_grains, k > 1);
      return k;
    }

    RVE_INLINE void sum_forces_and_stress(const Bookkeeping &has_bookkeeping, int k)
    {
      // `grains` is local to this phase: if phases shared it, the values of threads without a grain
      // would be live from step to step.
      StepGrains grains(block, shared, call.work, num_grains);
      load_with_forces(grains);
      forces<Wanted::LoveSums>(grains, call.planned(k)).sum_love_terms([&] {
        if (k > 0) has_bookkeeping.end_step(k);
        if (has_bookkeeping.has_servo) has_bookkeeping.grow_cell();
      });
      if (k > 0) return;
      has_bookkeeping.end_step_zero(shared);
      if constexpr (Config::in_memory) load_pairs();
    }

    RVE_INLINE void load_with_forces(StepGrains &grains)
    {
      block.own_items(num_grains,
                      [&](const auto i) RVE_INLINE_LAMBDA { grains.load_with_forces(i); });
    }

    /// Loads pairs that stay in memory, and clears the rows of packs of grains.
    RVE_INLINE void load_pairs()
    {
      if constexpr (!std::is_same_v<StepGrains, Grains> || Config::in_memory) {
        StepGrains grains(block, shared, call.work, num_grains);
        block.own_items(num_grains,
                        [&](const auto i) RVE_INLINE_LAMBDA { grains.load(shared, i); });
      }
    }
    /// Saves pairs for the building of lists and the end of the call.
    RVE_INLINE void save_pairs()
    {
      if constexpr (Config::in_memory) {
        StepGrains grains(block, shared, call.work, num_grains);
        block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA { grains.save_pairs(i); });
      }
    }

    // ---- steps without bookkeeping: grains stay loaded from step to step ------------------------

    /// Makes the planned steps from k on. With `moved` the grains have already made the move of the
    /// first step. Returns a step whose move was made and whose forces are missing: the last step,
    /// the last planned step, or a step that needs a new list (needs_renewal). The steps call no
    /// function, since the grains occupy the registers.
    RVE_INLINE int make_segment(int k, bool moved, bool direct)
    {
      // After a renewal step k is already planned.
      if (k > call.plan_last || (moved && !needs_renewal)) Planning::make_plan(block, call, k);
      // No register is left to keep this value from the beginning of the call.
      const int n = block.read_again(call.num_grains);
      const int first = call.plan_first, last = last_step();
      const int end = (last < call.plan_last ? last : call.plan_last) - first;
      StepGrains grains(block, shared, call.work, num_grains);
      const auto load = [&](const auto i) RVE_INLINE_LAMBDA {
        if constexpr (Block::kInRegisters)
          grains.load_for_steps(shared, i);
        else
          grains.load(shared, i);
      };
      if constexpr (Block::kInRegisters) {
        if (direct)
          fetch(grains);
        else
          block.own_items(num_grains, load);
      } else {
        block.own_items(num_grains, load);
      }
      int t = k - first;
      if constexpr (Traits::disks_in_registers) {
        block.for_empty_registers(
            num_grains, [&](Item i) RVE_INLINE_LAMBDA { grains.set_resting_grain(shared, i); });
        t = step_in_registers(grains, t, end, n, moved, k > 1);
      } else {
        for (bool kicks = k > 1;; kicks = true, ++t) {
          const PlanOf<Config> &plan = call.plan[t];
          const auto held = hold_constants<Config>(block, call.law, plan, n);
          if (!moved) {
            if (move<Visit::Items>(grains, plan, call.alpha, held.num_grains, kicks)) {
              t = ~t;    // a separate flag would take a register through all steps
              break;
            }
          }
          if (t == end) break;
          moved = false;
          contact_forces<Wanted::Forces>(block, grains, shared, call, call.law, plan,
                                         call.num_extra, held)
              .sum_forces();
        }
      }
      block.own_items(num_grains, [&](const auto i) RVE_INLINE_LAMBDA { grains.save(i); });
      needs_renewal = t < 0;
      return first + (needs_renewal ? ~t : t);
    }

    /// Steps disks in registers: makes the move of entry t of the plan unless `moved` is true,
    /// computes the forces of this entry, and continues up to the move of entry `end`. Returns the
    /// entry of the last move, or its complement if a new list is needed. The first move is before
    /// the loop, so that the only branch of the loop is around pairs that do not touch. All steps
    /// read the data of the call from registers. This saves 3 % of the instructions. Spheres have
    /// no such loop: their kernels would be too large for uniform registers.
    RVE_INLINE int step_in_registers(StepGrains &grains, int t, int end, int n, bool moved,
                                     bool kicks)
    {
      const PlanOf<Config> *plan = call.plan + t;
      const auto law = call.law;
      const Real alpha = call.alpha;
      const int num_extra = call.num_extra;
      const PlainConstants held{n};
      if (!moved && move<Visit::Registers>(grains, *plan, alpha, n, kicks)) return ~t;
      for (int left = end - t; left > 0; --left) {
        contact_forces<Wanted::Forces>(block, grains, shared, call, law, *plan, num_extra, held)
            .sum_forces();
        ++plan;
        if (move<Visit::Registers>(grains, *plan, alpha, n, true)) return ~(end - left + 1);
      }
      return end;
    }

    /// Returns the ContactForces of a plan, for phases that need more than forces.
    template <Wanted wanted, class SomeGrains>
    RVE_INLINE auto forces(SomeGrains &grains, const PlanOf<Config> &plan)
    {
      return contact_forces<wanted>(block, grains, shared, call, call.law, plan, call.num_extra,
                                    PlainConstants{num_grains});
    }

    // ---- move -----------------------------------------------------------------------------------

    /// Kicks a grain, or a pack of grains, by the forces of the previous phase.
    template <class SomeGrains, class SomeItem, class Numbers, int D>
    RVE_INLINE void kick_item(SomeGrains &grains, SomeItem i,
                              const GrainResponse<Numbers, D> &response,
                              typename Numbers::Real alpha, GrainView<Numbers, D> &grain)
    {
      const GrainView<Numbers, D> before = grain;
      const auto force = grains.collect(block, shared, i);
      const auto increment = kick_grain<Config::has_friction>(grain, force, response, alpha);
      grains.publish_spin(i, grain.spin);
      if constexpr (Config::has_bookkeeping) {
        if (call.batch.track_energy)
          Bookkeeping::add_damping_loss(call, i, before, grain, increment);
      }
    }

    /// Makes the kick of the previous step and the drift in the current cell. Returns whether a
    /// grain has moved farther than the list allows, or the plan requires a new list.
    template <Visit way>
    RVE_INLINE bool move(StepGrains &grains, const PlanOf<Config> &plan, Real alpha, int n,
                         bool kick_first)
    {
      const MoveConstants<typename Config::Numbers, Config::D> constants(plan, alpha);
      const auto move_item = [&](const auto i) RVE_INLINE_LAMBDA {
        using Here = typename StepGrains::template ConfigOf<std::decay_t<decltype(i)>>;
        const MoveConstants<typename Here::Numbers, Here::D> step(constants, constants.alpha);
        auto grain = grains.view(i);
        const auto response = grains.response(shared, i);
        if (kick_first) kick_item(grains, i, response, step.alpha, grain);
        drift_grain(step, grain.motion);
        if constexpr (Traits::spheres_in_registers || Config::in_memory)
          grains.publish(shared, i, grain, response);
        else
          grains.publish_motion(i, grain.motion);
        if constexpr (Traits::checks_list_by_predicate) {
          if (is_in_safe_box(step, grain.motion, response)) return Block::predicate(false);
          // Few grains need the following data, which are therefore read again instead of kept in
          // registers.
          block.reread();
          const MoveConstants<typename Config::Numbers, Config::D> exact(plan, Real(0));
          return Block::predicate(squared_displacement(exact, grain.motion, response) >
                                  exact.allowed_squared);
        } else {
          return any(has_left_list(step, grain.motion, response));
        }
      };
      return block.template any_item<way>(n, move_item);
    }

    // ---- the end of a call ----------------------------------------------------------------------

    /// Computes the last forces and all results.
    RVE_INLINE void finish(AnswerRecord<Config::D> &answer, DetailRecord<Config::D> *detail)
    {
      // An evaluation must not change the history, which is therefore copied here and restored
      // later. The forces would change it if the Coulomb limit is not that of the last step: with
      // dashpots, or after a change of friction.
      if (evaluates()) Stored::copy_history(block, call, call.pairs, call.work.fresh);
      if constexpr (Traits::uniform_constants)
        finish_without_details(answer);
      else
        finish_with_details(answer, detail);
    }

    /// Finishes a call without details. All calls share one path of code, since the kernel must be
    /// small.
    RVE_INLINE void finish_without_details(AnswerRecord<Config::D> &answer)
    {
      Grains grains(block, shared, call.work, num_grains);
      reduce_last_forces(grains);
      std::uint32_t word = End::check(call);
      if (evaluates() || (word & status::Fatal) || !End::is_sound(call))
        word = check_grains(block, call, word);
      if (word & status::Fatal)
        fail(word, answer);
      else
        store<false>(grains, End::kResults,
                     [&](int part) { End::write_result(call, word, part, answer); });
    }

    static RVE_COLD std::uint32_t check_grains(Block block, CallState<Config> &call,
                                               std::uint32_t word)
    {
      if (call.drive.substeps == 0) Stored::copy_history(block, call, call.work.fresh, call.pairs);
      return End::with_errors_of_grains(block, call, word);
    }

    RVE_INLINE void finish_with_details(AnswerRecord<Config::D> &answer,
                                        DetailRecord<Config::D> *detail)
    {
      std::uint32_t word;
      const auto write = [&](int part) { End::write_result(call, word, part, answer); };
      {
        Grains grains(block, shared, call.work, num_grains);
        reduce_last_forces(grains);
        word = End::check(call);
        // The cell of a servo is known only at the end.
        if (bookkeeping().has_servo && !(determinant(call.cell) > 0.0)) word |= status::NonFinite;
        // In nearly all calls no other code reads the grains, so that they are stored directly from
        // registers.
        if (Block::kInRegisters && !evaluates() && !keeps_bookkeeping() && !detail &&
            !(word & status::Fatal) && End::is_sound(call)) {
          store<true>(grains, End::kResults, write);
          return;
        }
        save(grains);
        if (keeps_bookkeeping()) block.once([&] { bookkeeping().end_step(last_step()); });
      }
      if (evaluates()) Stored::copy_history(block, call, call.work.fresh, call.pairs);
      word = End::with_errors_of_grains(block, call, word);
      if (word & status::Fatal) {
        fail(word, answer);
        return;
      }
      if (detail) homogenize_last_forces(*detail);
      Grains grains(block, shared, call.work, num_grains);
      if (keeps_bookkeeping()) {
        // The work of damping is complete after the last kick.
        store<false>(grains, 0, write);
        const EnergyLoss lost = bookkeeping().losses();
        block.once([&] { Progress::note_progress(call, lost); });
        block.for_each(End::kResults, write);
      } else {
        store<false>(grains, End::kResults, write);
      }
      if (detail)
        copy_words(block, static_cast<const StateProgress<Config::D> &>(*call.device_state.header),
                   detail->progress);
    }

    /// Computes the forces of the last step and call.totals.
    RVE_INLINE void reduce_last_forces(Grains &grains)
    {
      if constexpr (std::is_same_v<StepGrains, Grains>) {
        if constexpr (!Traits::uniform_constants)
          block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA { grains.load_itself(i); });
        forces<Wanted::Reduction>(grains, call.planned(last_step())).reduce();
      } else {
        reduce_in_packs(call.planned(last_step()));
      }
    }

    /// Computes the last forces in packs and stores them in the arrays of single grains. It is a
    /// separate function so that it takes no registers from the steps.
    RVE_COLD void reduce_in_packs(const PlanOf<Config> &plan)
    {
      StepGrains packs(block, shared, call.work, num_grains);
      block.own_items(num_grains, [&](const auto i) RVE_INLINE_LAMBDA { packs.load(shared, i); });
      forces<Wanted::Reduction>(packs, plan).reduce();
      block.own_items(num_grains, [&](const auto item) RVE_INLINE_LAMBDA {
        packs.for_each_grain(item, num_grains, [&](Item i) RVE_INLINE_LAMBDA {
          packs.store_forces(i, kIsPack<std::decay_t<decltype(item)>>);
        });
      });
    }

    RVE_INLINE void save(Grains &grains)
    {
      block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA {
        if constexpr (Config::in_memory)
          grains.save(i);
        else
          grains.save_with_forces(i);
      });
    }

    RVE_INLINE void fail(std::uint32_t word, AnswerRecord<Config::D> &answer)
    {
      block.once([&] { End::write_failure(call, word, answer); });
    }

    /// Returns force and torque on grain i, and stores them for the last kick.
    RVE_INLINE typename Grains::Sums collect_own(Item i)
    {
      if constexpr (Config::in_memory) {
        const auto force = collect_force(block, shared, typename Grains::Sums(), i);
        add_force(block, shared, i, force);
        return force;
      } else {
        return shared.own[i] = collect_force(block, shared, shared.own[i], i);
      }
    }

    RVE_INLINE void homogenize_last_forces(DetailRecord<Config::D> &detail)
    {
      double *force_size = call.work.scratch + 3 * num_grains;
      block.for_items(num_grains, [&](Item i) {
        const auto own = collect_own(i);
        double squared = static_cast<double>(own[0]) * static_cast<double>(own[0]);
        for (int a = 1; a < Config::D; ++a)
          squared += static_cast<double>(own[a]) * static_cast<double>(own[a]);
        force_size[i] = std::sqrt(squared);
      });
      homogenize(block, call, last_step(), detail);
    }

    /// Loads the grains from the stored state, in internal units.
    RVE_INLINE void fetch(StepGrains &grains)
    {
      block.for_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA {
        const auto stored = Stored::read_grain(call.device_state, i, num_grains, true);
        grains.radius.keep(i, Stored::publish_grain(call, shared, i, stored));
        grains.motion.keep(i, Stored::internal_motion(call, stored));
        grains.spin.keep(i, stored.spin);
        grains.largest_force.keep(i, Real(0));
        grains.partners.publish(i, stored.partner);
        for (int k = 0; k < Config::owned_pairs; ++k) {
          if constexpr (Config::has_friction)
            grains.history[k].keep(
                i,
                Config::Law::history_for_steps(Stored::internal_history(call, stored.history[k])));
          else    // histories are zero and stay zero
            grains.history[k].publish(i, typename Config::History());
        }
        set_response(shared, i, Stored::response_of(call, grains.radius[i], stored.list_position));
      });
      block.own_items(num_grains,
                      [&](Item i) RVE_INLINE_LAMBDA { grains.partners.load_radii(shared, i); });
    }

    /// Makes the last kick, writes the stored state, and calls parts(0) ... parts(num_parts - 1) at
    /// the same time. Loaded is true if the grains are loaded already, with their last forces.
    template <bool Loaded, class Parts>
    RVE_INLINE void store(Grains &grains, int num_parts, const Parts &parts)
    {
      const DeviceStateView<Config> &device_state = call.device_state;
      const Real alpha = call.alpha;
      const Real to_user = static_cast<Real>(call.units.length);
      const double force_to_user = call.units.force, length_to_user = call.units.length;
      const auto history_to_user = [=](const typename Config::History &history) {
        return Config::Law::in_units(history, force_to_user, length_to_user);
      };
      const bool moved = !evaluates();
      const bool relisted = call.num_rebuilds > 0;
      const auto store_item = [&](Item i) RVE_INLINE_LAMBDA {
        if (!Loaded) {
          grains.load(shared, i);
          grains.load_forces(i);
        }
        ViewOf<Config> grain = grains.view(i);
        if (moved) kick_item(grains, i, response_of(shared, i), alpha, grain);
        device_state.position[i] = grain.motion.position;
        device_state.velocity[i] = to_user * grain.motion.velocity;
        device_state.spin[i] = grain.spin;
        if (Config::has_friction)
          for (int k = 0; k < Config::owned_pairs; ++k)
            Block::write_whole(device_state.history[k * num_grains + i],
                               history_to_user(grains.saved_history(k, i)));
        if (relisted) {
          device_state.list_position[i] = list_position_of(shared, i);
          device_state.number[i] = call.work.number[i];
          device_state.radius[i] =
              static_cast<typename Config::Wide>(call.units.length) * grain.radius;
          for (int k = 0; k < Config::owned_pairs; ++k)
            device_state.partner[k * num_grains + i] = grains.partner_in_slot(k, i);
        }
      };
      constexpr Visit way = Traits::uniform_constants ? Visit::InTurn : Visit::Items;
      block.template for_items<way>(num_grains, store_item, num_parts, parts);
      const int num_extra = call.num_extra;
      if (num_extra > 0)
        block.for_each(num_extra, [&](Item m) {
          device_state.extra_first[m] = call.pairs.extra_first[m];
          device_state.extra_second[m] = call.pairs.extra_second[m];
          device_state.extra_history[m] = history_to_user(call.pairs.extra_history[m]);
        });
    }

    Block &block;
    CallState<Config> &call;
    const SharedView<Config> &shared;
    const int num_grains;
    bool needs_renewal = false;
  };

}    // namespace RVE_ISA
}    // namespace rve
