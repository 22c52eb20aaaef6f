// Grains as the phases of a step take them: one by one. What a phase asks of them is written here, and for packs of grains in
// algorithm/packed_grains.h: how they are loaded, stored and summed up. What is computed with them is not: that is written once.

#ifndef RVE_ALGORITHM_GRAIN_ITEMS_H
#define RVE_ALGORITHM_GRAIN_ITEMS_H

#include "rve/algorithm/system_view.h"
#include "rve/core/integer_sums.h"

namespace rve {
inline namespace RVE_ISA {

  /// A grain as its contacts see it, in internal units.
  template <class Numbers, int D> struct GrainView {
    Motion<Numbers, D> motion;
    Spin<typename Numbers::Real, D> spin;
    typename Numbers::Wide radius;
  };
  template <class Scene> using ViewOf = GrainView<typename Scene::Numbers, Scene::D>;

  /// Grain i, from where every grain can be seen.
  template <class Scene> RVE_INLINE ViewOf<Scene> view_grain(const SharedView<Scene> &shared, int i)
  {
    return {shared.motion[i], shared.spin[i], shared.radius[i]};
  }

  /// Adds force and torque to what grain i gets from pairs of others.
  template <class Block, class Scene>
  RVE_INLINE void add_force(Block &block, const SharedView<Scene> &shared, int i,
                            const Vec<typename Scene::Sum, Scene::freedoms> &force)
  {
    constexpr int count = Scene::has_friction ? Scene::freedoms : Scene::D;
    for (int k = 0; k < count; ++k) block.accumulate(&shared.force[k][i], force[k]);
  }

  /// Force and torque on grain i: from the pairs that it owns, and those of others, of which zero is left.
  template <class Block, class Scene>
  RVE_INLINE Vec<typename Scene::Sum, Scene::freedoms>
  collect_force(Block &block, const SharedView<Scene> &shared,
                const Vec<typename Scene::Sum, Scene::freedoms> &own, int i)
  {
    using Sum = typename Scene::Sum;
    Vec<Sum, Scene::freedoms> sum;
    for (int k = 0; k < Scene::freedoms; ++k)
      sum[k] = k < Scene::D || Scene::has_friction
          ? wrapping_sum(own[k], block.collect(&shared.force[k][i]))
          : Sum(0);
    return sum;
  }

  /// The grains of a block, of which a thread of a GPU keeps its own in registers from step to step.
  template <class Block, class Scene> struct GrainItems {
    template <class T> using Resident = typename Block::template Resident<T>;
    using Numbers = typename Scene::Numbers;
    using Sums = Vec<typename Scene::Sum, Scene::freedoms>;
    /// The scene in the numbers of an item of a phase: here an item is one grain.
    template <class Item> using SceneOf = Scene;

    Resident<MotionOf<Scene>> motion;                       ///< published
    Resident<Spin<typename Scene::Real, Scene::D>> spin;    ///< published
    Resident<typename Scene::Wide> radius;
    Resident<Sums> own;
    Resident<typename Scene::Real> largest_force;
    Resident<std::int32_t> partner[Scene::owned_pairs];
    Resident<typename Scene::Wide> partner_radius[Scene::owned_pairs];
    Resident<typename Scene::History> history[Scene::owned_pairs];

    RVE_INLINE GrainItems(Block &block, const SharedView<Scene> &shared, int n) :
        motion(block.resident(shared.motion)), spin(block.resident(shared.spin)),
        radius(block.resident(shared.radius)), own(block.resident(shared.own)),
        largest_force(block.resident(shared.largest_force))
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        partner[k] = block.resident(shared.partner + k * n);
        partner_radius[k] = block.resident(shared.partner_radius + k * n);
        history[k] = block.resident(shared.history + k * n);
      }
    }

    /// With room that only packs of grains need.
    RVE_INLINE GrainItems(Block &block, const SharedView<Scene> &shared,
                          const WorkspaceView<Scene> &, int n) :
        GrainItems(block, shared, n)
    {
    }

    // ---- to registers and back --------------------------------------------------------------------------------------------------

    /// All but `own`, which does not last from one stretch of steps to the next.
    RVE_INLINE void load(const SharedView<Scene> &shared, int i)
    {
      load_itself(i);
      for (int k = 0; k < Scene::owned_pairs; ++k) load_pair(shared, k, i);
    }

    RVE_INLINE void load_itself(int i)
    {
      motion.load(i);
      spin.load(i);
      radius.load(i);
      largest_force.load(i);
    }

    RVE_INLINE void load_pair(const SharedView<Scene> &shared, int k, int i)
    {
      partner[k].load(i);
      if (Scene::has_friction) history[k].load(i);
      if (Block::kInRegisters) look_at_partner(shared, k, i);
    }

    /// The radius of a partner that is known.
    RVE_INLINE void look_at_partner(const SharedView<Scene> &shared, int k, int i)
    {
      partner_radius[k].keep(i, radius_of_partner(shared, i, partner[k][i]));
    }

    /// All but `own`; what is published is there already.
    RVE_INLINE void save(int i)
    {
      largest_force.save(i);
      if (Scene::has_friction)
        for (int k = 0; k < Scene::owned_pairs; ++k) history[k].save(i);
    }

    // ---- what the phases of a step ask for --------------------------------------------------------------------------------------

    RVE_INLINE ViewOf<Scene> view(int i) { return {motion[i], spin[i], radius[i]}; }

    /// The partner in slot k.
    RVE_INLINE ViewOf<Scene> view_partner(const SharedView<Scene> &shared, int k, int i)
    {
      const int j = partner[k][i];
      return {shared.motion[j], shared.spin[j], partner_radius[k][i]};
    }

    RVE_INLINE GrainResponseOf<Scene> response(const SharedView<Scene> &shared, int i)
    {
      return shared.response[i];
    }

    /// What the pair in slot k remembers: can be read and written.
    RVE_INLINE typename Scene::History &history_of(int k, int i) { return history[k][i]; }

    RVE_INLINE typename Scene::Real largest_of(int i) { return largest_force[i]; }

    /// act(k, step, other, look(step, other)) for the slots of grain i and the partners view(k) in them; step() reads what is the same for
    /// all pairs. Once for each pair: read for all, it would occupy registers; read after the branch of pairs that touch, it would be
    /// waited for.
    template <class Step, class View, class Look, class Act>
    RVE_INLINE void for_slots(int, Step step, View view, Look look, Act act)
    {
      for (int k = 0; k < Scene::owned_pairs; ++k) {
        const auto other = view(k);
        const auto here = step();
        act(k, here, other, look(here, other));
      }
    }

    /// f(part) for the parts of an item that are computed with at once.
    template <class F> RVE_INLINE void for_parts(int i, F f) { f(i); }

    /// f(i) for each grain of an item with a number below `end`.
    template <class F> RVE_INLINE void for_each_grain(int i, int end, F f)
    {
      if (i < end) f(i);
    }

    RVE_INLINE void add_to_partner(Block &block, const SharedView<Scene> &shared, int k, int i,
                                   const Sums &force)
    {
      add_force(block, shared, partner[k][i], force);
    }

    /// What the pairs that grain i owns have given.
    RVE_INLINE void keep_forces(int i, const Sums &force, typename Scene::Real largest)
    {
      own.keep(i, force);
      largest_force.keep(i, largest);
    }

    /// Force and torque from all pairs.
    RVE_INLINE Sums collect(Block &block, const SharedView<Scene> &shared, int i)
    {
      return collect_force(block, shared, own[i], i);
    }

    RVE_INLINE void publish_motion(int i, const MotionOf<Scene> &x) { motion.publish(i, x); }

    /// Without friction no other grain asks for it.
    RVE_INLINE void publish_spin(int i, const Spin<typename Scene::Real, Scene::D> &x)
    {
      if constexpr (Scene::has_friction)
        spin.publish(i, x);
      else
        spin.keep(i, x);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
