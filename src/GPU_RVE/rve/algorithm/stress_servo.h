// SPDX-License-Identifier: GPL-2.0-only
// Stress servo: steers components of the velocity gradient until the stress reaches its goal.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/core/tensor.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  /// Returns the new value of a controlled component of L [1/time]: L + (1 - g s) gain dt (goal -
  /// stress), with g = 0.25 and s = sign(L (goal - stress)), limited to +-max_rate. The magnitude
  /// of the rate therefore grows more slowly than it falls. The periodic triaxial tests of SudoDEM
  /// and YADE have the same controller. Tensile stress is positive.
  RVE_INLINE double steer_rate(double rate, double stress, double goal, double gain, double dt,
                               double max_rate)
  {
    const double growth_damping = 0.25;
    const double error = goal - stress;
    const double direction = rate * error;
    const double sign = direction > 0.0 ? 1.0 : (direction < 0.0 ? -1.0 : 0.0);
    const double steered = rate + (1.0 - growth_damping * sign) * gain * dt * error;
    return steered > max_rate ? max_rate : (steered < -max_rate ? -max_rate : steered);
  }

  /// Returns the amplitude of a mode in L [1/time].
  template <int D>
  RVE_INLINE double amplitude_in(const SteeredMode<D> &mode, const Tensor<double, D> &gradient)
  {
    double sum = 0.0;
    for (int c = 0; c < Space<D>::components; ++c) sum += mode.dual[c] * gradient.component[c];
    return sum;
  }

  /// Returns the prescribed L plus the sum of amplitude(mode) * mode.rate over all modes.
  template <int D, class Amplitude>
  RVE_INLINE Tensor<double, D> gradient_of_modes(const SteeredModes<D> &modes,
                                                 const Tensor<double, D> &prescribed,
                                                 const Amplitude &amplitude)
  {
    Tensor<double, D> gradient = prescribed;
    for (int k = 0; k < modes.count; ++k) {
      const double a = amplitude(modes.mode[k]);
      for (int c = 0; c < Space<D>::components; ++c)
        gradient.component[c] += a * modes.mode[k].rate[c];
    }
    return gradient;
  }

}    // namespace RVE_ISA
}    // namespace rve
