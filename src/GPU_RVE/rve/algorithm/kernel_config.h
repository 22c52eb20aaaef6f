// SPDX-License-Identifier: GPL-2.0-only
// Kernel configurations.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/core/fixed_point.h"
#include "rve/core/numbers.h"

namespace rve {
inline namespace RVE_ISA {

  /// Functions of a kernel in addition to DEM steps along a path of the cell.
  enum class Bookkept {
    None,
    Servo,
    All    ///< servo, energy bookkeeping, force unit from all forces, bound of the time step
  };

  /// Kernel configuration: a contact law in a number format, and the functions of the kernel.
  /// Functions that a kernel does not have take no registers, and their absence does not change the
  /// bits of results. All code in algorithm/ has the configuration as the template parameter
  /// Config. engine/kernel_variants.h lists the configurations.
  template <class ContactLaw, Bookkept kept>
  struct ConfigOf : ContactLaw::Numbers, Space<ContactLaw::D> {
    using Law = ContactLaw;
    using Numbers = typename Law::Numbers;
    using History = typename Law::History;    ///< history of a pair
    static constexpr int D = Law::D;          ///< dimension of space
    static constexpr int owned_pairs = PairCounts<D>::owned;
    static constexpr bool has_friction = Law::has_friction;
    static constexpr bool has_rolling = Law::has_rolling;
    static constexpr bool steers = kept != Bookkept::None;
    static constexpr bool has_bookkeeping = kept == Bookkept::All;
    /// Number of plan entries instead of kPlanSteps, if not 0
    static constexpr int plan_steps = 0;
    static constexpr bool in_memory = false;    ///< true for InMemory

    /// The same configuration in another number format.
    template <class OtherNumbers>
    using In = ConfigOf<typename Law::template In<OtherNumbers>, kept>;
  };

  /// The same configuration with space for longer plans.
  template <class Config, int steps> struct WithPlan : Config {
    static constexpr int plan_steps = steps;
  };

  /// The same configuration for spheres that do not fit into the registers of a block. Data that do
  /// not fit on chip are read from memory in each step (algorithm/passing_grains.h).
  template <class Config> struct InMemory : Config {
    static_assert(Config::D == 3, "spheres");
    static constexpr bool in_memory = true;
  };

}    // namespace RVE_ISA
}    // namespace rve
