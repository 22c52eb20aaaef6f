// SPDX-License-Identifier: GPL-2.0-only
// Leapfrog integration of peculiar velocity and fractional coordinate: c' = F_damped/m, s' = H^-1
// c. The mean velocity field does not occur in these equations: equations (19)-(23), (38) and (39)
// of the paper reduce to this form (doc/src/theory_rve.rst).

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

  /// Returns the longest stable step [time] for the largest eigenvalues w^2 of M^-1 K [1/time^2]
  /// and B of M^-1 C [1/time]. Local damping increases a force by a factor of at most 1 + alpha. A
  /// dashpot uses the velocity of half a step earlier.
  RVE_INLINE double leapfrog_bound(double frequency_squared, double dashpot_rate, double alpha)
  {
    const double gain = 1.0 + alpha;
    const double b = gain * dashpot_rate;
    return 4.0 / (b + std::sqrt(b * b + 4.0 * gain * frequency_squared));
  }

}    // namespace RVE_ISA
}    // namespace rve
