// SPDX-License-Identifier: GPL-2.0-only
// Tangential contact laws.

#pragma once

#include "rve/core/vec.h"

namespace rve {
inline namespace RVE_ISA {

  /// Force of a spring with a limit after one step: along the contact of two disks a number, of two spheres a vector.
  template <class Real, class History, int D> struct LimitedForce {
    Spin<Real, D> force;        ///< on grain i [force]
    Spin<History, D> spring;    ///< part of it that the spring carries on to the next step [force]
    /// Spring force that the limit took away; zero when sticking [force].
    Spin<History, D> slipped;
    Truth<History> sliding;    ///< at the limit
  };

  /// Linear incremental spring with Coulomb limit. In two dimensions the history is a signed number, so load reversal unloads
  /// the spring; equation (14) as printed adds magnitudes along the present increment and cannot unload.
  /// Viscous: a dashpot beside the spring, under the same limit; compiled in only for scenes that have one.
  template <class Real, class History, bool Viscous> struct LinearTangential {
    History stiffness;    ///< k_t [force/length]
    Real friction;        ///< mu [-]
    Real viscosity;       ///< gamma_t [force time/length]

    /// `spring` is the history, `velocity` the tangential velocity of j relative to i at the contact [length/time].
    RVE_INLINE LimitedForce<Real, History, 2> advance(History spring, Real velocity,
                                                      Real normal_force, Real dt) const
    {
      const History elastic = fma(stiffness * History(dt), History(velocity), spring);
      History viscous = History(0), trial = elastic;
      if constexpr (Viscous) {
        viscous = History(viscosity) * History(velocity);
        // without viscosity not even a zero is added: it could change the sign of a zero
        if (viscosity != Real(0)) trial = elastic + viscous;
      }
      const History limit = History(friction * fabs(normal_force));
      const History magnitude = smaller(fabs(trial), limit);
      const History capped = within(limit, trial);
      LimitedForce<Real, History, 2> result;
      result.force = Real(capped);
      result.sliding = magnitude >= limit;
      // a sticking contact keeps its spring to the bit: evaluating it again must not change it
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
