// SPDX-License-Identifier: GPL-2.0-only
// Leapfrog integration of the velocity c of a grain relative to the mean field (peculiar velocity)
// and of its fractional coordinates s: c' = F_damped/m, s' = H^-1 c, with the cell matrix H. The
// mean velocity field does not occur in these equations: equations (19)-(23), (38) and (39) of
// Zhao, Zhao & Liang (2021) reduce to this form (doc/src/theory_rve.rst).

#pragma once

#include "rve/physics/damping.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  /// Returns one velocity component after a step, equations (3a) and (4). `increment` is dt F/m;
  /// damping uses the velocity at the full step.
  template <bool BySign = false, class Real>
  RVE_INLINE Real kick(Real velocity, Real increment, Real alpha)
  {
    return velocity + locally_damped<BySign>(alpha, increment, velocity + Real(0.5) * increment);
  }

  /// Returns the velocity after a step with objective damping.
  template <class Real, int D>
  RVE_INLINE Vec<Real, D> kick_objectively(const Vec<Real, D> &velocity,
                                           const Vec<Real, D> &increment, Real alpha)
  {
    return velocity + objectively_damped(alpha, increment, fma(Real(0.5), increment, velocity));
  }

  /// Returns the longest stable step [time], 4 / (b + sqrt(b^2 + 4 g w^2)) with g = 1 + alpha and b
  /// = g B. `frequency_squared` is w^2, the largest eigenvalue of M^-1 K [1/time^2], and
  /// `dashpot_rate` is B, the largest eigenvalue of M^-1 C [1/time], for masses M, stiffness K and
  /// dashpots C. Local damping increases a force by a factor of at most g. A dashpot uses the
  /// velocity of half a step earlier.
  RVE_INLINE double leapfrog_bound(double frequency_squared, double dashpot_rate, double alpha)
  {
    const double gain = 1.0 + alpha;
    const double b = gain * dashpot_rate;
    return 4.0 / (b + std::sqrt(b * b + 4.0 * gain * frequency_squared));
  }

}    // namespace RVE_ISA
}    // namespace rve
