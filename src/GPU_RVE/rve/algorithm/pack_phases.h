// The phases of a step for packs of grains, which blocks that hand out packs need (BlockSimd). simd_phases.h has them; a block that hands
// out single grains calls none of them.

#ifndef RVE_ALGORITHM_PACK_PHASES_H
#define RVE_ALGORITHM_PACK_PHASES_H

#include "rve/algorithm/call_state.h"
#include "rve/core/pack_item.h"

namespace rve {
inline namespace RVE_ISA {

  /// Grains that BlockSimd hands out at a time.
  constexpr int kPackedGrains = 8;

  /// Before a stretch of steps.
  template <class Scene> void load_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call);

  /// After it.
  template <class Scene>
  void save_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                 const SharedView<Scene> &shared);

  /// add_pair for all pairs that the grains own.
  template <class Scene>
  void packed_forces(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                     const SharedView<Scene> &shared, const StepPlan<typename Scene::Numbers> &plan,
                     int num_grains);

  /// RveProgram::move for the grains: whether one of them has left the safety of the list.
  template <class Scene>
  bool move_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                 const SharedView<Scene> &shared, const StepPlan<typename Scene::Numbers> &plan,
                 typename Scene::Real alpha, bool kick_first);

}    // namespace RVE_ISA
}    // namespace rve

#endif
