// SPDX-License-Identifier: GPL-2.0-only
// What a program of the block is compiled for.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/core/fixed_point.h"
#include "rve/core/numbers.h"

namespace rve {
inline namespace RVE_ISA {

  /// What a program does beside steps along a path.
  enum class Books {
    None,
    Servo,
    All    ///< servo, energy ledger, a unit of forces that looks at all of them, and the bound of the time step
  };

  /// A contact law in a number format, and the books of the program. What a scene does not need takes no registers of its programs, and
  /// leaves their bits. Everything in algorithm/ takes such a Scene. Which ones there are: engine/programs.h.
  template <class ContactLaw, Books kept>
  struct SceneOf : ContactLaw::Numbers, Space<ContactLaw::D> {
    using Law = ContactLaw;
    using Numbers = typename Law::Numbers;
    using History = typename Law::History;    ///< what a pair remembers of its contact
    static constexpr int D = Law::D;          ///< of space
    static constexpr int owned_pairs = PairCounts<D>::owned;
    static constexpr bool has_friction = Law::has_friction;
    static constexpr bool has_rolling = Law::has_rolling;
    static constexpr bool steers = kept != Books::None;
    static constexpr bool books = kept == Books::All;
    static constexpr int plan_steps = 0;        ///< kPlanSteps, where it is another than usual
    static constexpr bool in_memory = false;    ///< InMemory

    /// The same scene in other numbers.
    template <class OtherNumbers> using In = SceneOf<typename Law::template In<OtherNumbers>, kept>;
  };

  /// The same scene where there is room for longer plans.
  template <class Scene, int steps> struct WithPlan : Scene {
    static constexpr int plan_steps = steps;
  };

  /// The same scene, of spheres, for blocks that have registers for none of them: what does not fit on chip passes by in each step
  /// (algorithm/passing_grains.h).
  template <class Scene> struct InMemory : Scene {
    static_assert(Scene::D == 3, "spheres");
    static constexpr bool in_memory = true;
  };

}    // namespace RVE_ISA
}    // namespace rve
