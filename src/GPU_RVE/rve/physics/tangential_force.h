// SPDX-License-Identifier: GPL-2.0-only
// Tangential spring with Coulomb limit. LinearTangential is the spring of disks; the spring of
// spheres is in vector_spring.h. Both return a LimitedForce.

#pragma once

#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Result of one step of a spring whose force is limited. A force is a number along the tangent
  /// for two disks, and a vector for two spheres.
  template <class Real, class History, int D> struct LimitedForce {
    Spin<Real, D> force;    ///< on grain i [force]
    /// Part of the force that the spring keeps for the next step [force]
    Spin<History, D> spring;
    /// Part of the spring force above the limit; zero if sticking [force].
    Spin<History, D> slipped;
    Truth<History> sliding;    ///< true if the force is at the limit
  };

  /// Linear incremental spring with Coulomb limit. Its force, the history, is a signed number, so
  /// that a reversed load unloads the spring. Equation (14) of Zhao, Zhao & Liang (2021) adds
  /// magnitudes along the current increment and cannot unload the spring. With Viscous the spring
  /// has a parallel dashpot under the same limit; only kernels with dashpots are compiled with
  /// Viscous.
  template <class Real, class History, bool Viscous> struct LinearTangential {
    History stiffness;    ///< k_t [force/length]
    Real friction;        ///< mu [-]
    Real viscosity;       ///< gamma_t [force time/length]

    /// Advances the history `spring` by one step; `velocity` is the tangential velocity of j
    /// relative to i at the contact [length/time].
    RVE_INLINE LimitedForce<Real, History, 2> advance(History spring, Real velocity,
                                                      Real normal_force, Real dt) const
    {
      const History elastic = fma(stiffness * History(dt), History(velocity), spring);
      History viscous = History(0), trial = elastic;
      if constexpr (Viscous) {
        viscous = History(viscosity) * History(velocity);
        // Without viscosity the sum is not formed: adding zero could change the sign of a zero.
        if (viscosity != Real(0)) trial = elastic + viscous;
      }
      const History limit = History(friction * fabs(normal_force));
      const History magnitude = smaller(fabs(trial), limit);
      const History capped = within(limit, trial);
      LimitedForce<Real, History, 2> result;
      result.force = Real(capped);
      result.sliding = magnitude >= limit;
      // If the contact sticks, the stored spring is exactly `elastic`. A second evaluation with dt
      // = 0 then returns the same force, bit for bit.
      result.spring = capped;
      if constexpr (Viscous) {
        if (viscosity != Real(0)) result.spring = result.sliding ? capped - viscous : elastic;
      }
      result.slipped = trial - capped;
      return result;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
