// SPDX-License-Identifier: GPL-2.0-only
// Forces of all contacts of one RVE. Every pair is computed once, by its owner; each component of the force is
// rounded once to an integer and added with opposite signs to the two grains, so that the sum has no order and momentum is
// conserved to the last bit.

#pragma once

#include "rve/algorithm/call_state.h"
#include "rve/algorithm/passing_grains.h"
#include "rve/core/integer_sums.h"
#include "rve/core/pack_item.h"
#include "rve/core/status.h"
#include "rve/physics/contact_geometry.h"
#include "rve/physics/laws/law.h"
#include "rve/physics/stress.h"

#include <limits>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// What a step needs to know of its RVE that is the same for all grains, in internal units.
  template <class Scene> struct StepConstants {
    typename Scene::Law law;
    Tensor<typename Scene::Wide, Scene::D> to_length;
    Tensor<typename Scene::Real, Scene::D> gradient;
    typename Scene::Real dt;    ///< zero evaluates without advancing the history [time]
  };

  /// For packs of grains, too, from the constants of one.
  template <class Scene, class LawConstants, class Numbers>
  RVE_INLINE StepConstants<Scene> step_constants(const LawConstants &law,
                                                 const StepPlan<Numbers, Scene::D> &plan)
  {
    StepConstants<Scene> step;
    step.law.take(law);
    step.to_length = plan.to_length.template as<typename Scene::Wide>();
    step.gradient = plan.gradient.template as<typename Scene::Real>();
    step.dt = typename Scene::Real(law.dt);
    return step;
  }

  /// Where the two grains of a pair are to each other; they touch when the overlap is positive, and the law says whether they act on each
  /// other.
  template <class Scene>
  RVE_INLINE ContactGeometry<typename Scene::Real, Scene::D>
  pair_geometry(const StepConstants<Scene> &step, const ViewOf<Scene> &i, const ViewOf<Scene> &j)
  {
    const auto branch = step.to_length *
        fractional_difference<typename Scene::Numbers>(j.motion.position, i.motion.position);
    return contact_geometry<typename Scene::Real>(branch, i.radius + j.radius);
  }

  template <class Scene>
  RVE_INLINE auto pair_force(const StepConstants<Scene> &step,
                             const ContactGeometry<typename Scene::Real, Scene::D> &contact,
                             const ViewOf<Scene> &i, const ViewOf<Scene> &j,
                             typename Scene::History history)
  {
    using Real = typename Scene::Real;
    const GrainMotion<Real, Scene::D> motion_i{i.motion.velocity, i.spin,
                                               static_cast<Real>(i.radius)};
    const GrainMotion<Real, Scene::D> motion_j{j.motion.velocity, j.spin,
                                               static_cast<Real>(j.radius)};
    return evaluate(step.law, contact, motion_i, motion_j, step.gradient, history, step.dt);
  }

  constexpr float kInfinity = std::numeric_limits<float>::infinity();

  /// What a survey shall say of a grain: its largest force, if it is sound.
  template <class Numbers, int D>
  RVE_INLINE float soundness(const GrainView<Numbers, D> &grain,
                             typename Numbers::Real largest_force)
  {
    const float force = static_cast<float>(largest_force);
    return moves_soundly<D>(grain.motion.velocity, grain.spin) && force == force ? force
                                                                                 : kInfinity;
  }

  /// Whether torques on a grain from its own pairs, and their Love terms, are added up as they are, and rounded once. That hangs on the order
  /// of the pairs, and so does relaxed arithmetic of spheres anyway. Forces have to be rounded one by one: those on both grains are opposite to
  /// the last bit.
  template <int D> constexpr bool kRoundsOnce = kIsRelaxed &&D == 3;

  /// What gathers while a grain's pairs are computed.
  template <class Numbers, int D> struct GrainSum {
    Vec<typename Numbers::Sum, Space<D>::freedoms> own;    ///< force and torque on the owner
    /// kRoundsOnce: in place of that of `own`, until round_torque.
    Vec<typename Numbers::Real, Space<D>::spins> torque;
    typename Numbers::Real largest_force;    ///< that counts for the unit of forces
    Vec<typename Numbers::Sum, Space<D>::components> stress;    ///< Love terms, with the stress
    /// kRoundsOnce: in place of `stress`, until round_love.
    Vec<typename Numbers::Real, Space<D>::components> love;
    std::int32_t contacts, crushed;    ///< with the stress
    Dissipation heat;                  ///< with the stress, in programs that keep books
  };

  /// Nothing yet, after contact forces up to a largest one.
  template <class Scene>
  RVE_INLINE GrainSum<typename Scene::Numbers, Scene::D>
  begin_sum(typename Scene::Real largest_force)
  {
    using Sum = typename Scene::Sum;
    return {Vec<Sum, Scene::freedoms>::zero(),
            Vec<typename Scene::Real, Scene::spins>::zero(),
            largest_force,
            Vec<Sum, Scene::components>::zero(),
            Vec<typename Scene::Real, Scene::components>::zero(),
            0,
            0,
            {0.0, 0.0}};
  }

  /// Adds the Love terms of one contact, in the unit of forces: a branch is no longer than one internal length.
  template <class Numbers, int D>
  RVE_INLINE void add_love_term(const Truth<typename Numbers::Real> &acting,
                                const Vec<typename Numbers::Real, D> &force,
                                const Vec<typename Numbers::Real, D> &branch,
                                GrainSum<Numbers, D> &sum)
  {
    const auto stress = love_term(force, branch);
    for (int k = 0; k < Space<D>::components; ++k) {
      const auto mine = where(acting, stress.component[k]);
      if constexpr (kRoundsOnce<D>) {
        sum.love[k] = sum.love[k] + mine;
      } else {
        typename Numbers::Sum units;
        round_to(mine, units);
        sum.stress[k] = wrapping_sum(sum.stress[k], units);
      }
    }
  }

  /// What is wanted beside the forces.
  enum class Wanted {
    Nothing,
    LoveSums,    ///< in the steps of programs that keep books
    Survey       ///< of the last forces of a call: Love sums, contacts, soundness
  };

  template <class Numbers, int D> RVE_INLINE void round_torque(GrainSum<Numbers, D> &sum)
  {
    if constexpr (kRoundsOnce<D>)
      for (int k = 0; k < Space<D>::spins; ++k) round_to(sum.torque[k], sum.own[D + k]);
  }

  /// Love terms into integers.
  template <class Numbers, int D> RVE_INLINE void round_love(GrainSum<Numbers, D> &sum)
  {
    if constexpr (kRoundsOnce<D>)
      for (int k = 0; k < Space<D>::components; ++k) round_to(sum.love[k], sum.stress[k]);
  }

  /// Computes a pair, or a pack of pairs: advances its history, adds its force to `sum` of grain i, and hands what grain j gets to
  /// add_to_j(force and torque). keeps_ledger: what is lost is asked for, in programs with all books.
  template <Wanted wanted, class Scene, class Call, class History, class AddToOther>
  RVE_INLINE void add_pair(const Call &call, bool keeps_ledger, const StepConstants<Scene> &step,
                           const ViewOf<Scene> &grain_i, const ViewOf<Scene> &grain_j,
                           const ContactGeometry<typename Scene::Real, Scene::D> &contact,
                           typename Scene::Real overlap_limit, History &&history,
                           GrainSum<typename Scene::Numbers, Scene::D> &sum, AddToOther add_to_j)
  {
    using Real = typename Scene::Real;
    using Sum = typename Scene::Sum;
    constexpr bool with_stress = wanted != Wanted::Nothing;
    const auto remember = [&](const typename Scene::History &now) RVE_INLINE_LAMBDA {
      if constexpr (wanted == Wanted::Survey)
        history = now;
      else
        history = Scene::Law::between_looks(now);
    };
    const auto release = [&]() RVE_INLINE_LAMBDA {
      if constexpr (with_stress && Scene::books)
        if (keeps_ledger) sum.heat.friction += step.law.released(history);
      remember(typename Scene::History());
    };
    // in packs `where` does what the branch does for one pair; whole packs of spheres have nothing to do in their last slots
    if constexpr (std::is_same_v<Truth<Real>, bool> || Scene::D == 3) {
      if (!any(step.law.acts(contact))) {
        if constexpr (Scene::has_friction) release();
        return;
      }
    }
    const Truth<Real> acting = step.law.acts(contact);
    if constexpr (Scene::Law::has_reach) {
      static_assert(std::is_same_v<Truth<Real>, bool>, "packs of grains have no law with a reach");
      if (!(contact.overlap > Real(0))) release();
    }
    const auto force = pair_force(step, contact, grain_i, grain_j, history);
    if constexpr (Scene::has_friction) {
      Truth<typename Scene::Spring> keeps;
      convert_truth(acting, keeps);
      remember(where(keeps, force.history()));
    }
    sum.largest_force = larger(sum.largest_force, where(acting, fabs(force.normal_force)));
    if constexpr (Scene::books) {
      if (call.header.all_forces_count)
        sum.largest_force =
            select(acting, Scene::Law::largest(force, sum.largest_force), sum.largest_force);
    }
    constexpr int D = Scene::D;
    Vec<Sum, Scene::freedoms> on_j;
    Vec<Sum, Scene::spins> torque_i;
    for (int a = 0; a < D; ++a) round_to(where(acting, -force.force[a]), on_j[a]);
    for (int k = 0; k < Scene::spins; ++k) {
      on_j[D + k] = torque_i[k] = Sum(0);
      if constexpr (Scene::has_friction) {
        round_to(where(acting, spin_component(force.torque_j, k)), on_j[D + k]);
        const Real mine = where(acting, spin_component(force.torque_i, k));
        if constexpr (kRoundsOnce<D>)
          sum.torque[k] = sum.torque[k] + mine;
        else
          round_to(mine, torque_i[k]);
      }
    }
    for (int a = 0; a < D; ++a) sum.own[a] = wrapping_difference(sum.own[a], on_j[a]);
    if constexpr (!kRoundsOnce<D>)
      for (int k = 0; k < Scene::spins; ++k)
        sum.own[D + k] = wrapping_sum(sum.own[D + k], torque_i[k]);
    add_to_j(on_j);
    if constexpr (with_stress)
      add_love_term<typename Scene::Numbers, D>(acting, force.force, contact.branch, sum);
    if constexpr (wanted == Wanted::Survey) {
      const Real ri = static_cast<Real>(grain_i.radius), rj = static_cast<Real>(grain_j.radius);
      sum.contacts += count(acting);
      sum.crushed += count_without(acting, contact.overlap <= overlap_limit * smaller(ri, rj));
    }
    if constexpr (with_stress && Scene::books)
      if (keeps_ledger) step.law.dissipate(contact, force, step.dt, sum.heat);
  }

  struct Nothing {
    RVE_INLINE void operator()() const {}
  };

  /// What a step reads again and again, with kHoldsUniforms from registers of the warp. To be made before the grains move: whether the compiler
  /// leaves a number there hangs on how often it is read in how many instructions (CUDA 13.0), and seldom is better.
  template <class Scene> struct HeldConstants {
    StepConstants<Scene> step;
    std::int32_t num_grains;
  };
  /// Without: the pairs read the rest where it is.
  struct HeldCount {
    std::int32_t num_grains;
  };
  template <class Scene, class Block, class LawConstants>
  RVE_INLINE auto held_constants(Block &block, const LawConstants &law, const PlanOf<Scene> &plan,
                                 std::int32_t num_grains)
  {
    if constexpr (kHoldsUniforms<Block, Scene>)
      return block.uniform(HeldConstants<Scene>{step_constants<Scene>(law, plan), num_grains});
    else
      return HeldCount{num_grains};
  }

  /// All owned and extra pairs of the RVE. `law` and `num_extra` are those of the call, or copies in registers, and `held` is of held_constants, for
  /// forces alone. When more than forces is wanted, `grains` have loaded themselves but not their pairs, and call.survey is filled; with
  /// kHoldsUniforms they are loaded and saved here. With Love sums alone then() is called by one thread when they are there.
  template <Wanted wanted, class Block, class Scene, class Grains, class Held = Nothing,
            class Then = Nothing>
  RVE_INLINE void contact_forces(Block &block, Grains &grains, const SharedView<Scene> &shared,
                                 CallState<Scene> &call, const typename Scene::Law::Constants &law,
                                 int num_grains, const PlanOf<Scene> &plan, int num_extra,
                                 const Held &held = Held(), Then then = Then())
  {
    using Item = typename Block::Item;
    using Numbers = typename Scene::Numbers;
    const bool keeps_ledger = wanted != Wanted::Nothing && Scene::books && call.keeps_ledger();
    const auto overlap_limit = static_cast<typename Scene::Real>(
        wanted == Wanted::Survey ? call.batch.overlap_limit : 0.0);
    constexpr bool holds = kHoldsUniforms<Block, Scene>;
    // the pairs that grain i owns, or a pack of grains
    const auto add_owned = [&](const auto i, auto &sum) RVE_INLINE_LAMBDA {
      using Here = typename Grains::template SceneOf<std::decay_t<decltype(i)>>;
      const auto me = grains.view(i);
      // those of InMemory stay loaded from step to step
      constexpr bool loads_pairs = wanted == Wanted::Survey ||
          (wanted == Wanted::LoveSums && !Scene::in_memory);
      constexpr bool pass = kHistoryPasses<Block, Scene> || Scene::in_memory;
      if constexpr (loads_pairs && pass)
        for (int k = 0; k < Scene::owned_pairs; ++k) grains.load_pair(shared, k, i);
      grains.for_slots(
          i,
          [&]() RVE_INLINE_LAMBDA {
            if constexpr (holds && wanted == Wanted::Nothing) {
              block.assume(held.step.dt > 0);    // forces without a step are surveyed
              return held.step;
            } else {
              if constexpr (kRereads<Block, Scene>) block.reread();
              return step_constants<Here>(law, plan);
            }
          },
          [&](int k) RVE_INLINE_LAMBDA {
            // each when it is needed: the sums of the stress leave few registers
            if constexpr (loads_pairs && !pass && !IsPack<std::decay_t<decltype(i)>>::value)
              grains.load_pair(shared, k, i);
            return grains.view_partner(shared, k, i);
          },
          [&](const auto &step, const auto &other)
              RVE_INLINE_LAMBDA { return pair_geometry(step, me, other); },
          [&](int k, const auto &step, const auto &other, const auto &contact) RVE_INLINE_LAMBDA {
            add_pair<wanted>(call, keeps_ledger, step, me, other, contact,
                             static_cast<typename Here::Real>(overlap_limit),
                             grains.history_of(k, i), sum,
                             [&](const auto &force) RVE_INLINE_LAMBDA {
                               grains.add_to_partner(block, shared, k, i, force);
                             });
            // on its way while the next one is computed: there are no registers for all
            if constexpr (holds && wanted == Wanted::Survey) grains.save_pair(k, i);
          },
          // where pairs are loaded when they are needed, none is known yet
          [&](int k) RVE_INLINE_LAMBDA {
            if constexpr (Scene::D != 2 || wanted == Wanted::Survey)
              return true;
            else if constexpr (wanted == Wanted::Nothing ||
                               IsPack<std::decay_t<decltype(i)>>::value)
              return grains.is_taken(k, i);
            else if (shared.partner[k * num_grains + i] != i)
              return true;
            // saved with the others, what the register held before would count as a spring that is released: of an array it is nothing
            if constexpr (Block::kInRegisters) grains.forget_pair(k, i);
            return false;
          });
      round_torque(sum);
    };
    const auto add_extra = [&](int m, GrainSum<Numbers, Scene::D> &sum) RVE_INLINE_LAMBDA {
      const PairView<Scene> &pairs = call.pairs;
      const int first = pairs.extra_first[m], second = pairs.extra_second[m];
      const auto one = view_grain(shared, first), other = view_grain(shared, second);
      const auto step = step_constants<Scene>(law, plan);
      sum.own = Vec<typename Scene::Sum, Scene::freedoms>::zero();
      sum.torque = Vec<typename Scene::Real, Scene::spins>::zero();
      add_pair<wanted>(call, keeps_ledger, step, one, other, pair_geometry(step, one, other),
                       overlap_limit, pairs.extra_history[m], sum,
                       [&](const auto &force)
                           RVE_INLINE_LAMBDA { add_force(block, shared, second, force); });
      round_torque(sum);
      add_force(block, shared, first, sum.own);
    };

    // the pairs of a grain, and the extra ones that go with its number: what is lost is added up by the numbers of grains
    const auto add_all = [&](Item i) RVE_INLINE_LAMBDA {
      if constexpr (holds && wanted == Wanted::Survey) grains.load_itself(i);
      auto sum = begin_sum<Scene>(grains.largest_of(i));
      add_owned(i, sum);
      if constexpr (holds || Scene::in_memory)
        grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
      else
        grains.own.keep(i, sum.own);
      for (int m = i; m < num_extra; m += num_grains) add_extra(m, sum);
      grains.keep_largest(i, sum.largest_force);
      round_love(sum);
      if constexpr (Scene::books)
        if (keeps_ledger) {
          const int number = call.number_of(i);
          call.work.friction[number] += sum.heat.friction;
          call.work.viscous[number] += sum.heat.viscous;
        }
      return sum;
    };

    using Sums = StressSums<Scene::D>;
    // to the terms of a pack, integers of 64 bits
    const auto add_terms = [&](const auto &sum, auto *term) RVE_INLINE_LAMBDA {
      for (int k = 0; k < Scene::components; ++k)
        term[k] = wrapping_sum(term[k], total(sum.stress[k]));
      if constexpr (wanted == Wanted::Survey) {
        term[Sums::contacts] += sum.contacts;
        term[Sums::crushed] += sum.crushed;
      }
    };
    const auto add_pack = [&](const auto item, std::int64_t *term) RVE_INLINE_LAMBDA {
      grains.for_parts(item, [&](const auto i) RVE_INLINE_LAMBDA {
        using Here = typename Grains::template SceneOf<std::decay_t<decltype(i)>>;
        auto sum = begin_sum<Here>(grains.largest_of(i));
        add_owned(i, sum);
        grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
        round_love(sum);
        add_terms(sum, term);
      });
      grains.for_each_grain(item, num_extra, [&](Item i) RVE_INLINE_LAMBDA {
        auto sum = begin_sum<Scene>(grains.largest_of(i));
        for (int m = i; m < num_extra; m += num_grains) add_extra(m, sum);
        grains.keep_largest(i, sum.largest_force);
        round_love(sum);
        add_terms(sum, term);
      });
    };

    if constexpr (wanted == Wanted::LoveSums) {
      block.template add_up_items<Scene::components, typename Scene::Sum>(
          num_grains,
          [&](const auto item, auto *term) RVE_INLINE_LAMBDA {
            if constexpr (IsPack<std::decay_t<decltype(item)>>::value) {
              add_pack(item, term);
            } else {
              const auto sum = add_all(item);
              for (int k = 0; k < Scene::components; ++k) term[k] = sum.stress[k];
              grains.save_with_forces(item);
            }
          },
          call.survey.sum, then);
    } else if constexpr (wanted == Wanted::Survey) {
      // Where a thread takes its grains in turn, sums of 64 bits have no registers. Without forces beyond their limit, which are told of, those
      // of two grains have 32.
      constexpr bool adds_up = holds && kRoundsOnce<Scene::D>;
      auto of_thread = Vec<typename Scene::Sum, Scene::components>::zero();
      const auto survey = [&](const auto item, auto *term, float &largest) RVE_INLINE_LAMBDA {
        if constexpr (IsPack<std::decay_t<decltype(item)>>::value) {
          add_pack(item, term);
          grains.for_each_grain(item, num_grains, [&](Item i) RVE_INLINE_LAMBDA {
            largest = larger(largest, soundness(grains.view(i), grains.largest_of(i)));
          });
        } else {
          const Item i = item;
          const auto sum = add_all(i);
          for (int k = 0; k < Scene::components; ++k)
            if constexpr (adds_up)
              of_thread[k] = wrapping_sum(of_thread[k], sum.stress[k]);
            else
              term[k] = sum.stress[k];
          term[Sums::contacts] = sum.contacts;
          term[Sums::crushed] = sum.crushed;
          if constexpr (holds) grains.save_itself(i);    // its forces are on chip
          const float mine = soundness(grains.view(i), sum.largest_force);
          largest = mine > largest ? mine : largest;
        }
      };
      if constexpr (holds)
        block.template survey_items_in_turn<Sums::count, typename Scene::Sum>(
            num_grains, survey,
            [&](auto *term) RVE_INLINE_LAMBDA {
              if constexpr (adds_up)
                for (int k = 0; k < Scene::components; ++k) term[k] = of_thread[k];
            },
            call.survey);
      else
        block.template survey_items<Sums::count, typename Scene::Sum>(num_grains, survey,
                                                                      call.survey);
    } else {
      const auto step_item = [&](const auto item) RVE_INLINE_LAMBDA {
        grains.for_parts(item, [&](const auto i) RVE_INLINE_LAMBDA {
          using Here = typename Grains::template SceneOf<std::decay_t<decltype(i)>>;
          auto sum = begin_sum<Here>(grains.largest_of(i));
          add_owned(i, sum);
          grains.keep_forces(block, shared, i, sum.own, sum.largest_force);
        });
        // they ride along with the grains: no phase of their own
        grains.for_each_grain(item, num_extra, [&](Item i) RVE_INLINE_LAMBDA {
          auto sum = begin_sum<Scene>(grains.largest_of(i));
          block.share_out(i, num_grains, num_extra,
                          [&](int m) RVE_INLINE_LAMBDA { add_extra(m, sum); });
          grains.keep_largest(i, sum.largest_force);
        });
      };
      if constexpr (kFillsPlaces<Block, Scene>)
        block.for_places(num_grains, step_item);
      else
        block.for_items(num_grains, step_item);
    }
  }

}    // namespace RVE_ISA
}    // namespace rve
