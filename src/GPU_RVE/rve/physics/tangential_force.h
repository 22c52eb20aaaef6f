// SPDX-License-Identifier: GPL-2.0-only
// Tangential contact laws.

#pragma once

#include "rve/core/arithmetic.h"

namespace rve {
inline namespace RVE_ISA {

  /// Tangential force of a contact in the plane after one step.
  template <class Real, class History> struct TangentialForce {
    Real force;        ///< on grain i along t = (-n_y, n_x) [force]
    History spring;    ///< part of it that the spring carries on to the next step [force]
    /// Spring force that the Coulomb limit took away; zero when sticking [force].
    History slipped;
    Truth<History> sliding;    ///< at the Coulomb limit
  };

  /// Linear incremental spring with Coulomb limit. In two dimensions the history is a signed number, so load reversal unloads
  /// the spring; equation (14) as printed adds magnitudes along the present increment and cannot unload.
  /// Viscous: a dashpot beside the spring, under the same limit; compiled in only for scenes that have one.
  template <class Real, class History, bool Viscous> struct LinearTangential {
    History stiffness;    ///< k_t [force/length]
    Real friction;        ///< mu [-]
    Real viscosity;       ///< gamma_t [force time/length]

    /// `spring` is the history, `velocity` the tangential velocity of j relative to i at the contact [length/time].
    RVE_INLINE TangentialForce<Real, History> advance(History spring, Real velocity,
                                                      Real normal_force, Real dt) const
    {
      const History elastic =
          fma(stiffness * static_cast<History>(dt), static_cast<History>(velocity), spring);
      History viscous = History(0), trial = elastic;
      if constexpr (Viscous) {
        viscous = static_cast<History>(viscosity) * static_cast<History>(velocity);
        // without viscosity not even a zero is added: it could change the sign of a zero
        if (viscosity != Real(0)) trial = elastic + viscous;
      }
      const History limit = static_cast<History>(friction * fabs(normal_force));
      const History magnitude = smaller(fabs(trial), limit);
      const History capped = within(limit, trial);
      TangentialForce<Real, History> result;
      result.force = static_cast<Real>(capped);
      result.sliding = magnitude >= limit;
      // a sticking contact keeps its spring to the bit: evaluating it again must not change it
      result.spring = capped;
      if constexpr (Viscous) {
        if (viscosity != Real(0)) result.spring = result.sliding ? capped - viscous : elastic;
      }
      result.slipped = trial - capped;
      return result;
    }

    /// Energy stored in the spring [force length]; zero without stiffness.
    RVE_INLINE double elastic_energy(History spring) const
    {
      const double force = static_cast<double>(spring);
      return stiffness > History(0) ? 0.5 * force * force / static_cast<double>(stiffness) : 0.0;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
