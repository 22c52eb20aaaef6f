// SPDX-License-Identifier: GPL-2.0-only
// Leapfrog in peculiar velocity and fractional coordinate: c' = F_damped/m, s' = H^-1 c. The mean field never enters
// (doc/theory: equations (19)-(23), (38), (39) of the paper reduce to this).

#pragma once

#include "rve/physics/damping.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  /// One velocity component after a step, equations (3a) and (4): `increment` is dt F/m, and damping looks at the velocity
  /// at the full step.
  template <bool BySign = false, class Real>
  RVE_INLINE Real kick(Real velocity, Real increment, Real alpha)
  {
    return velocity + locally_damped<BySign>(alpha, increment, velocity + Real(0.5) * increment);
  }

  /// The same of a vector, with damping that knows no axes.
  template <class Real, int D>
  RVE_INLINE Vec<Real, D> kick_objectively(const Vec<Real, D> &velocity,
                                           const Vec<Real, D> &increment, Real alpha)
  {
    return velocity + objectively_damped(alpha, increment, fma(Real(0.5), increment, velocity));
  }

  /// Longest stable step of that [time]: w^2 and B are the largest eigenvalues of M^-1 K [1/time^2] and of M^-1 C [1/time], and
  /// damping makes a force up to 1 + alpha times as large. A dashpot sees the velocity of half a step before.
  RVE_INLINE double leapfrog_bound(double frequency_squared, double dashpot_rate, double alpha)
  {
    const double gain = 1.0 + alpha;
    const double b = gain * dashpot_rate;
    return 4.0 / (b + std::sqrt(b * b + 4.0 * gain * frequency_squared));
  }

}    // namespace RVE_ISA
}    // namespace rve
