// SPDX-License-Identifier: GPL-2.0-only
// The block program: advances one RVE by one call, on one CPU thread or one CUDA thread block.
//
//   grains, pairs and units as the call before left them                       call_begin.h
//   for each step:
//     H <- cell of the step on its path, or by the servo                       step_planning.h
//     c <- c + dt F/m with local damping, s <- s + dt H^-1 c                   kick of the step before, drift
//     if a grain has left the safety of the list, or the lattice leans:        list_renewal.h
//       reduce the lattice, build the list
//     F <- sums of the contact forces of all pairs                             contact_forces.h, physics/laws
//     if books are kept: Love sums, work, energy lost, rate of the servo
//   Love stress of the last forces; details if somebody looks                  homogenization.h
//   last kick, status, everything back to the image                            call_end.h
//
// The kick of a step stands at the beginning of the next one, which saves a barrier. The stress of a call belongs to its end
// configuration.

#pragma once

#include "rve/algorithm/call_begin.h"
#include "rve/algorithm/call_end.h"
#include "rve/algorithm/grain_motion.h"
#include "rve/algorithm/homogenization.h"
#include "rve/algorithm/stress_servo.h"
#include "rve/core/pack_item.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Work of Cundall's damping on one velocity component in one step [force length].
  RVE_INLINE double damping_loss(double mass, double before, double after, double increment)
  {
    return -mass * ((after - before) - increment) * 0.5 * (before + after);
  }

  /// StepGrains: how the steps take their grains, one by one or in packs as well. All else takes them one by one.
  template <class Block, class Scene, class StepGrains = GrainsOf<Block, Scene>> class RveProgram {
    using Item = typename Block::Item;
    using Real = typename Scene::Real;
    using Wide = typename Scene::Wide;

    using Begin = CallBegin<Block, Scene>;
    using Planning = StepPlanning<Block, Scene>;
    using Renewal = ListRenewal<Block, Scene>;
    using Stored = StoredGrains<Block, Scene>;
    using Progress = CallProgress<Scene>;
    using End = CallEnd<Block, Scene>;
    using Grains = GrainsOf<Block, Scene>;

   public:
    /// The call is prepared and has its views, of which `shared` is one.
    RVE_INLINE RveProgram(Block &block_in, CallState<Scene> &call_in,
                          const SharedView<Scene> &shared_in) :
        block(block_in),
        call(call_in), shared(shared_in), num_grains(call_in.num_grains)
    {
    }

    /// Runs the call. The image is written only when nothing fatal happened; `answer` always. `detail`: null, or room for the
    /// second look.
    RVE_INLINE void run(AnswerRecord<Scene::D> &answer, DetailRecord<Scene::D> *detail)
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
    RVE_INLINE bool has_servo() const { return Scene::steers && call.has_servo(); }
    RVE_INLINE bool has_ledger() const { return Scene::books && call.keeps_ledger(); }
    /// Whether Love sums of every step are wanted.
    RVE_INLINE bool has_books() const
    {
      return Scene::steers && call.drive.substeps > 0 && (has_servo() || has_ledger());
    }
    /// Without substeps the forces of the present configuration are asked for.
    RVE_INLINE bool evaluates() const { return call.drive.substeps == 0; }
    RVE_INLINE int last_step() const { return evaluates() ? 1 : call.drive.substeps; }

    // ---- the step ---------------------------------------------------------------------------------------------------------------

    /// All steps but the forces of the last one. `direct`: the grains are in the image only.
    RVE_INLINE void run_steps(bool direct)
    {
      if constexpr (Scene::steers)
        if (has_books()) {
          run_with_books();
          return;
        }
      if (evaluates()) {
        if (call.plan_last < 1) Planning::make_plan(block, call, 1);
        return;
      }
      const int last = last_step();
      bool moved = false;
      for (int k = 1;;) {
        if (k > call.plan_last) Planning::make_plan(block, call, k);
        k = run_planned(k, moved, direct);
        direct = false;
        // the grains of step k have moved; its forces are missing
        moved = true;
        if (needs_renewal) {
          Renewal::renew(block, call, k);
          if (call.fatal()) return;
        }
        if (k == last) return;
        if (!needs_renewal) Planning::make_plan(block, call, k);
      }
    }

    /// The steps from k on, as far as they are planned. If `moved`, the grains have made the move of the first one. Returns a step
    /// whose move was made, and whose forces are missing: the last one, the last that is planned, or one whose list does not
    /// serve any more (needs_renewal). Nothing is called from here: the registers belong to the grains.
    RVE_INLINE int run_planned(int k, bool moved, bool direct)
    {
      // read here, not kept from the beginning of the call: then it has a register
      const int n = *const_cast<const volatile std::int32_t *>(&call.num_grains);
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
      if constexpr (kFillsPlaces<Block, Scene>)
        block.for_empty_places(num_grains,
                               [&](Item i) RVE_INLINE_LAMBDA { grains.be_nobody(shared, i); });
      int t = k - first;
      if constexpr (kFillsPlaces<Block, Scene>) {
        t = step_in_places(grains, t, end, n, moved, k > 1);
      } else {
        for (bool kicks = k > 1;; kicks = true, ++t) {
          const PlanOf<Scene> &plan = call.plan[t];
          const auto held = held_constants<Scene>(block, call.law, plan, n);
          if (!moved) {
            if (move<false>(grains, plan, call.alpha, held.num_grains, kicks)) {
              t = ~t;    // a flag of its own would take a register through all steps
              break;
            }
          }
          if (t == end) break;
          moved = false;
          contact_forces<Wanted::Nothing>(block, grains, shared, call, call.law, held.num_grains,
                                          plan, call.num_extra, held);
        }
      }
      block.own_items(num_grains, [&](const auto i) RVE_INLINE_LAMBDA { grains.save(i); });
      needs_renewal = t < 0;
      return first + (needs_renewal ? ~t : t);
    }

    /// The steps of disks in registers: the forces of entry t of the plan, after its move if that is not made, up to the move of entry `end`.
    /// Returns the entry of the last move, or its complement if the list does not serve any more. The first move stands before the loop,
    /// which has no branch but around pairs that do not touch; what all steps read of the call is in registers.
    RVE_INLINE int step_in_places(StepGrains &grains, int t, int end, int n, bool moved, bool kicks)
    {
      const PlanOf<Scene> *plan = call.plan + t;
      const auto law = call.law;
      const Real alpha = call.alpha;
      const int num_extra = call.num_extra;
      if (!moved && move<true>(grains, *plan, alpha, n, kicks)) return ~t;
      for (int left = end - t; left > 0; --left) {
        contact_forces<Wanted::Nothing>(block, grains, shared, call, law, n, *plan, num_extra);
        ++plan;
        if (move<true>(grains, *plan, alpha, n, true)) return ~(end - left + 1);
      }
      return end;
    }

    /// From the image to where the steps want the grains, in internal units.
    RVE_INLINE void fetch(StepGrains &grains)
    {
      block.for_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA {
        const auto stored = Stored::read_grain(call.image, i, num_grains, true);
        grains.radius.keep(i, Stored::show_grain(call, shared, i, stored));
        grains.motion.keep(i, Stored::internal_motion(call, stored));
        grains.spin.keep(i, stored.spin);
        grains.largest_force.keep(i, Real(0));
        grains.partners.publish(i, stored.partner);
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          if constexpr (Scene::has_friction)
            grains.history[k].keep(
                i, Scene::Law::between_looks(Stored::internal_history(call, stored.history[k])));
          else    // they are zero, and stay there
            grains.history[k].publish(i, typename Scene::History());
        }
        set_response(shared, i, Stored::response_of(call, grains.radius[i], stored.list_position));
      });
      block.own_items(num_grains,
                      [&](Item i) RVE_INLINE_LAMBDA { grains.partners.look_at_all(shared, i); });
    }

    /// The forces of step k with all that the end of a call wants to know of them, left in call.survey.
    RVE_INLINE void surveyed_forces(Grains &grains, int k)
    {
      if constexpr (std::is_same_v<StepGrains, Grains>) {
        if constexpr (!kHoldsUniforms<Block, Scene>)
          block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA { grains.load_itself(i); });
        contact_forces<Wanted::Survey>(block, grains, shared, call, call.law, num_grains,
                                       call.planned(k), call.num_extra);
      } else {
        survey_in_packs(call.planned(k));
      }
    }

    /// Leaves all where single grains have it, in the same arrays. Not in the program itself, whose steps would be compiled to less.
    RVE_COLD void survey_in_packs(const PlanOf<Scene> &plan)
    {
      StepGrains packs(block, shared, call.work, num_grains);
      block.own_items(num_grains, [&](const auto i) RVE_INLINE_LAMBDA { packs.load(shared, i); });
      contact_forces<Wanted::Survey>(block, packs, shared, call, call.law, num_grains, plan,
                                     call.num_extra);
      block.own_items(num_grains, [&](const auto item) RVE_INLINE_LAMBDA {
        packs.for_each_grain(item, num_grains, [&](Item i) RVE_INLINE_LAMBDA {
          packs.leave_forces(i, IsPack<std::decay_t<decltype(item)>>::value);
        });
      });
    }

    RVE_INLINE void save(Grains &grains)
    {
      block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA {
        if constexpr (Scene::in_memory)
          grains.save(i);
        else
          grains.save_with_forces(i);
      });
    }

    // ---- with a servo or a ledger: Love sums of every step ----------------------------------------------------------------------

    /// All steps but the forces of the last one. The work of the first half of a step wants the stress before it: with a ledger a step 0
    /// has forces, and nothing else.
    RVE_APART void run_with_books()
    {
      const bool ledger = has_ledger(), servo = has_servo();
      const int last = last_step();
      block.begin_add_up();
      if (ledger) {
        begin_step_zero();
      } else {
        block.once([&] {
          grow_by_servo();
          call.list_inverse = inverse(call.list_cell);
        });
        begin_step(1, ledger, servo);
      }
      begin_stretch();
      for (int k = ledger ? 0 : 1;; ++k) {
        if (k > 0) {
          block.begin_add_up();
          StepGrains grains(block, shared, call.work, num_grains);
          block.own_items(num_grains,
                          [&](const auto i) RVE_INLINE_LAMBDA { grains.load_with_forces(i); });
          if (move<false>(grains, call.planned(k), call.alpha, num_grains, k > 1)) {
            end_stretch();
            Renewal::renew(block, call, k);
            if (call.fatal()) return;
            begin_stretch();
          }
          if (k == last) {
            end_stretch();
            return;
          }
        }
        // anew: what threads without a grain have shall not seem alive from step to step
        StepGrains grains(block, shared, call.work, num_grains);
        block.own_items(num_grains,
                        [&](const auto i) RVE_INLINE_LAMBDA { grains.load_with_forces(i); });
        contact_forces<Wanted::LoveSums>(block, grains, shared, call, call.law, num_grains,
                                         call.planned(k), call.num_extra, Nothing(), [&] {
                                           if (k > 0) keep_books(k, ledger, servo);
                                           if (servo) grow_by_servo();
                                         });
        if (k == 0) {
          end_step_zero();
          if constexpr (Scene::in_memory) begin_stretch();
        }
        begin_step(k + 1, ledger, servo);
      }
    }

    /// Of steps whose grains are loaded for each phase anew: what packs of grains need beside them, and pairs that pass by.
    RVE_INLINE void begin_stretch()
    {
      if constexpr (!std::is_same_v<StepGrains, Grains> || Scene::in_memory) {
        StepGrains grains(block, shared, call.work, num_grains);
        block.own_items(num_grains,
                        [&](const auto i) RVE_INLINE_LAMBDA { grains.load(shared, i); });
      }
    }
    /// The pairs back to where all others look for them.
    RVE_INLINE void end_stretch()
    {
      if constexpr (Scene::in_memory) {
        StepGrains grains(block, shared, call.work, num_grains);
        block.own_items(num_grains, [&](Item i) RVE_INLINE_LAMBDA { grains.save_pairs(i); });
      }
    }

    /// After the forces of step k. By one thread.
    RVE_INLINE void keep_books(int k, bool ledger, bool servo)
    {
      if (ledger) add_half_of_work(call.planned(k).gradient.template as<double>());
      if (servo) steer();
    }

    /// Velocity gradient of a planned step over the cell before the step, L (I - dt L)^-1. The plan
    /// has L, over the cell after the step; a servo in the plane has one for both [1/time].
    RVE_INLINE Tensor<double, Scene::D> gradient_before(const PlanOf<Scene> &plan) const
    {
      const auto after = plan.gradient.template as<double>();
      if (Scene::D == 2 && has_servo()) return after;
      return after *
          inverse(Tensor<double, Scene::D>::identity() - static_cast<double>(call.law.dt) * after);
    }

    /// Adds half of the work of the mean field in a step: that of the last forces, on branches that
    /// grow by `gradient`. Half of a step is done by the forces before it and half by those after
    /// it, each on its own branches; a rigid rotation then does no work. By one thread.
    RVE_INLINE void add_half_of_work(const Tensor<double, Scene::D> &gradient)
    {
      double power = 0.0;
      for (int c = 0; c < Scene::components; ++c)
        power += static_cast<double>(call.survey.sum[c]) * gradient.component[c];
      call.supplied +=
          0.5 * (call.units.force * call.units.length) * power * static_cast<double>(call.law.dt);
    }

    /// Plans step k, whose cell is known, and adds the first half of its work.
    RVE_INLINE void begin_step(int k, bool ledger, bool servo)
    {
      if (servo) {
        Planning::plan_servo_step(block, call, k, [&] {
          if (ledger) add_half_of_work(gradient_before(call.plan[0]));
        });
        return;
      }
      if (k > call.plan_last) Planning::make_plan(block, call, k);
      block.once([&] { add_half_of_work(gradient_before(call.planned(k))); });
    }

    /// Prepares forces of the configuration before the first step. They leave their Love sums in call.survey, and everything else shall be
    /// as it was.
    RVE_INLINE void begin_step_zero()
    {
      Stored::copy_history(block, call, call.pairs, call.work.fresh);
      block.once([&] {
        call.plan[0] = PlanOf<Scene>();
        call.plan[0].to_length =
            fraction_to_length<typename Scene::Numbers>(call.units.per_length * call.cell);
        call.plan_first = call.plan_last = 0;    // the steps are planned anew
        call.list_inverse = inverse(call.list_cell);
        call.law.dt = Real(0);
      });
    }

    RVE_INLINE void end_step_zero()
    {
      Stored::copy_history(block, call, call.work.fresh, call.pairs);
      block.for_each(num_grains, [&](Item i) {
        clear_sums<Block>(shared, i);
        shared.largest_force[i] = Real(0);
        call.work.damping[i] = call.work.friction[i] = call.work.viscous[i] = 0.0;
      });
      block.once([&] { call.law.dt = static_cast<Real>(call.drive.dt); });
    }

    /// By one thread.
    RVE_INLINE void grow_by_servo()
    {
      const Tensor<double, Scene::D> prescribed =
          load_tensor<Scene::D>(call.steering.velocity_gradient);
      if (call.steering.modes)
        call.servo_gradient = gradient_of_modes(*call.steering.modes, prescribed,
                                                [&](const SteeredMode<Scene::D> &mode) {
                                                  return amplitude_in(mode, call.servo_gradient);
                                                });
      else
        for (int c = 0; c < Scene::components; ++c)
          call.servo_gradient.component[c] = call.steering.controlled[c]
              ? call.servo_gradient.component[c]
              : prescribed.component[c];
      const Tensor<double, Scene::D> small = call.drive.dt * call.servo_gradient;
      // exp to third order
      const Tensor<double, Scene::D> growth =
          Tensor<double, Scene::D>::identity() + small + 0.5 * (small * small);
      call.cell = growth * call.cell;
      call.deformation = growth * call.deformation;
    }

    /// By one thread.
    RVE_INLINE void steer()
    {
      const SteeringRecord<Scene::D> &steering = call.steering;
      const auto stress = [&](int c) { return stress_component(call, call.end_per_volume, c); };
      if (steering.modes) {
        call.servo_gradient = gradient_of_modes(
            *steering.modes, load_tensor<Scene::D>(steering.velocity_gradient),
            [&](const SteeredMode<Scene::D> &mode) {
              double now = 0.0;
              for (int c = 0; c < Scene::components; ++c) now += mode.stress[c] * stress(c);
              return steer_rate(amplitude_in(mode, call.servo_gradient), now, mode.goal, mode.gain,
                                call.drive.dt, mode.max_rate);
            });
        return;
      }
      // without a branch: no component waits for another one
      Tensor<double, Scene::D> gradient = call.servo_gradient;
      for (int c = 0; c < Scene::components; ++c) {
        // both components of a shear
        const int row = c / Scene::D, column = c % Scene::D;
        const double now = row == column ? stress(c)
                                         : 0.5 * (stress(c) + stress(column * Scene::D + row));
        const double rate = gradient.component[c],
                     steered = steer_rate(rate, now, steering.stress_goal[c], steering.servo_gain,
                                          call.drive.dt, steering.servo_max_rate);
        gradient.component[c] = steering.controlled[c] ? steered : rate;
      }
      call.servo_gradient = gradient;
    }

    /// Kick of a grain, or of a pack of them, by the forces that the last phase left.
    template <class SomeGrains, class SomeItem, class Numbers, int D>
    RVE_INLINE void kick_item(SomeGrains &grains, SomeItem i,
                              const GrainResponse<Numbers, D> &response,
                              typename Numbers::Real alpha, GrainView<Numbers, D> &grain)
    {
      const GrainView<Numbers, D> before = grain;
      const auto force = grains.collect(block, shared, i);
      const auto increment = kick_grain<Scene::has_friction>(grain, force, response, alpha);
      grains.publish_spin(i, grain.spin);
      if constexpr (Scene::books) {
        if (call.batch.track_energy) note_damping(i, before, grain, increment);
      }
    }

    RVE_INLINE void note_damping(Item i, const ViewOf<Scene> &before, const ViewOf<Scene> &after,
                                 const Kick<typename Scene::Numbers, Scene::D> &increment)
    {
      const double length = call.units.length;
      const double r = static_cast<double>(before.radius) * length, mass = call.mass_of(r);
      const Vec<Real, Scene::D> &slow = before.motion.velocity, &fast = after.motion.velocity;
      double lost = damping_loss(mass, slow[0], fast[0], increment.velocity[0]);
      for (int a = 1; a < Scene::D; ++a)
        lost += damping_loss(mass, slow[a], fast[a], increment.velocity[a]);
      lost = length * length * lost;
      const double inertia = GrainShape<Scene::D>::inertia * mass * r * r;
      for (int k = 0; k < Scene::spins; ++k)
        lost += damping_loss(inertia, spin_component(before.spin, k), spin_component(after.spin, k),
                             spin_component(increment.spin, k));
      call.work.damping[call.number_of(i)] += lost;
    }

    /// Kick of the step before, then drift in the present cell. Returns whether a grain has left the safety of the list, or the step allows none
    /// to be in it. InPlaces: threads without a grain move nobody.
    template <bool InPlaces>
    RVE_INLINE bool move(StepGrains &grains, const PlanOf<Scene> &plan, Real alpha, int n,
                         bool kick_first)
    {
      const MoveConstants<typename Scene::Numbers, Scene::D> constants(plan, alpha);
      const auto move_item = [&](const auto i) RVE_INLINE_LAMBDA {
        using Here = typename StepGrains::template SceneOf<std::decay_t<decltype(i)>>;
        const MoveConstants<typename Here::Numbers, Here::D> step(constants, constants.alpha);
        auto grain = grains.view(i);
        const auto response = grains.response(shared, i);
        if (kick_first) kick_item(grains, i, response, step.alpha, grain);
        drift_grain(step, grain.motion);
        if constexpr (kFewRegisters<Block, Scene> || Scene::in_memory)
          grains.publish(shared, i, grain, response);
        else
          grains.publish_motion(i, grain.motion);
        if constexpr (kHoldsUniforms<Block, Scene> || (Block::kInRegisters && Scene::D == 2)) {
          // numbers, of which a GPU makes a predicate; of a truth in two branches it makes a number
          if (is_in_safe_box(step, grain.motion, response)) return 0;
          // what only few grains want is not kept for all of them
          block.reread();
          const MoveConstants<typename Scene::Numbers, Scene::D> exact(plan, Real(0));
          return squared_displacement(exact, grain.motion, response) > exact.allowed_squared ? 1
                                                                                             : 0;
        } else {
          return any(has_left_list(step, grain.motion, response));
        }
      };
      if constexpr (InPlaces)
        return block.any_place(n, move_item);
      else
        return block.any_item(n, move_item);
    }

    // ---- the end of a call ------------------------------------------------------------------------------------------------------

    /// The forces of the last step, and what follows from them.
    RVE_INLINE void finish(AnswerRecord<Scene::D> &answer, DetailRecord<Scene::D> *detail)
    {
      // an evaluation must not change the history: the Coulomb limit may be another one, with dashpots or after a change of friction
      if (evaluates()) Stored::copy_history(block, call, call.pairs, call.work.fresh);
      std::uint32_t word;
      const auto conclude = [&](int part) { End::conclude(call, word, part, answer); };
      {
        Grains grains(block, shared, num_grains);
        surveyed_forces(grains, last_step());
        word = End::judge(call);
        // by one way through the code, which shall be little: nobody looks at details here
        if constexpr (kHoldsUniforms<Block, Scene>) {
          if (evaluates() || (word & status::Fatal) || !End::is_sound(call))
            word = settle(block, call, word);
          if (word & status::Fatal)
            fail(word, answer);
          else
            store<false>(grains, End::kConclusions, conclude);
          return;
        }
        // the cell of a servo is known in the end only
        if (has_servo() && !(determinant(call.cell) > 0.0)) word |= status::NonFinite;
        // as nearly always: nothing else wants to see the grains
        if (Block::kInRegisters && !evaluates() && !has_books() && !detail &&
            !(word & status::Fatal) && End::is_sound(call)) {
          store<true>(grains, End::kConclusions, conclude);
          return;
        }
        save(grains);
        if (has_books()) block.once([&] { keep_books(last_step(), has_ledger(), has_servo()); });
      }
      if (evaluates()) Stored::copy_history(block, call, call.work.fresh, call.pairs);
      if (End::needs_look(call, word)) word = End::find_trouble(block, call, word);
      if (word & status::Fatal) {
        fail(word, answer);
        return;
      }
      if (detail) look_again(*detail);
      Grains grains(block, shared, num_grains);
      if (has_books()) {
        // the work of damping is complete with the last kick
        store<false>(grains, 0, conclude);
        EnergyLoss lost;
        if (has_ledger()) {
          const double energy = call.units.force * call.units.length;
          lost.damping = block.sum_array(num_grains, call.work.damping);
          lost.friction = energy * block.sum_array(num_grains, call.work.friction);
          lost.viscous = energy * block.sum_array(num_grains, call.work.viscous);
        }
        block.once([&] { Progress::note_progress(call, lost); });
        block.for_each(End::kConclusions, conclude);
      } else {
        store<false>(grains, End::kConclusions, conclude);
      }
      if (detail)
        copy_words(block, static_cast<const ImageProgress<Scene::D> &>(*call.image.header),
                   detail->progress);
    }

    /// What is left to do where forces were only asked for, or where something may be wrong: returns the status.
    static RVE_COLD std::uint32_t settle(Block block, CallState<Scene> &call, std::uint32_t word)
    {
      if (call.drive.substeps == 0) Stored::copy_history(block, call, call.work.fresh, call.pairs);
      return End::needs_look(call, word) ? End::find_trouble(block, call, word) : word;
    }

    RVE_INLINE void fail(std::uint32_t word, AnswerRecord<Scene::D> &answer)
    {
      block.once([&] { End::answer_failure(call, word, answer); });
    }

    /// Force and torque on grain i, which are left where the last kick asks for them.
    RVE_INLINE typename Grains::Sums collect_own(Item i)
    {
      if constexpr (Scene::in_memory) {
        const auto force = collect_force(block, shared, typename Grains::Sums(), i);
        add_force(block, shared, i, force);
        return force;
      } else {
        return shared.own[i] = collect_force(block, shared, shared.own[i], i);
      }
    }

    RVE_INLINE void look_again(DetailRecord<Scene::D> &detail)
    {
      double *force_size = call.work.scratch + 3 * num_grains;
      block.for_items(num_grains, [&](Item i) {
        const auto own = collect_own(i);
        double squared = static_cast<double>(own[0]) * static_cast<double>(own[0]);
        for (int a = 1; a < Scene::D; ++a)
          squared += static_cast<double>(own[a]) * static_cast<double>(own[a]);
        force_size[i] = std::sqrt(squared);
      });
      homogenize(block, call, last_step(), detail);
    }

    /// The last kick, then everything back to the image, and meanwhile parts(0) ... parts(num_parts - 1). Loaded: the grains
    /// are, with their last forces.
    template <bool Loaded, class Parts>
    RVE_INLINE void store(Grains &grains, int num_parts, const Parts &parts)
    {
      const ImageView<Scene> &image = call.image;
      const Real alpha = call.alpha;
      const Real to_user = static_cast<Real>(call.units.length);
      const double force_to_user = call.units.force, length_to_user = call.units.length;
      const auto history_to_user = [=](const typename Scene::History &history) {
        return Scene::Law::in_units(history, force_to_user, length_to_user);
      };
      const bool moved = !evaluates();
      const bool relisted = call.num_rebuilds > 0;
      const auto store_item = [&](Item i) RVE_INLINE_LAMBDA {
        if (!Loaded) {
          grains.load(shared, i);
          grains.load_forces(i);
        }
        ViewOf<Scene> grain = grains.view(i);
        if (moved) kick_item(grains, i, response_of(shared, i), alpha, grain);
        image.position[i] = grain.motion.position;
        image.velocity[i] = to_user * grain.motion.velocity;
        image.spin[i] = grain.spin;
        if (Scene::has_friction)
          for (int k = 0; k < Scene::owned_pairs; ++k)
            Block::write_whole(image.history[k * num_grains + i],
                               history_to_user(grains.remembered(k, i)));
        if (relisted) {
          image.list_position[i] = list_position_of(shared, i);
          image.number[i] = call.work.number[i];
          image.radius[i] = static_cast<typename Scene::Wide>(call.units.length) * grain.radius;
          for (int k = 0; k < Scene::owned_pairs; ++k)
            image.partner[k * num_grains + i] = grains.partner_in_slot(k, i);
        }
      };
      if constexpr (kHoldsUniforms<Block, Scene>)
        block.for_items_in_turn(num_grains, store_item, num_parts, parts);
      else
        block.for_items(num_grains, store_item, num_parts, parts);
      const int num_extra = call.num_extra;
      if (num_extra > 0)
        block.for_each(num_extra, [&](Item m) {
          image.extra_first[m] = call.pairs.extra_first[m];
          image.extra_second[m] = call.pairs.extra_second[m];
          image.extra_history[m] = history_to_user(call.pairs.extra_history[m]);
        });
    }

    Block &block;
    CallState<Scene> &call;
    const SharedView<Scene> &shared;
    const int num_grains;
    bool needs_renewal = false;
  };

}    // namespace RVE_ISA
}    // namespace rve
