// SPDX-License-Identifier: GPL-2.0-only
// Shape of grains: disks in the plane, spheres in space.

#pragma once

#include "rve/core/config.h"
#include "rve/core/pi.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns x r^D, as for masses and volumes.
  template <int D> RVE_INLINE double times_power(double x, double radius)
  {
    for (int a = 0; a < D; ++a) x *= radius;
    return x;
  }

  /// Returns r^D.
  template <int D, class Number> RVE_INLINE Number power(Number radius)
  {
    Number x = radius;
    for (int a = 1; a < D; ++a) x = x * radius;
    return x;
  }

  /// A ball in D dimensions.
  template <int D> struct GrainShape;
  template <> struct GrainShape<2> {
    static constexpr double volume = kPi;    ///< of a grain of radius 1
    /// Moment of inertia divided by mass times squared radius [-].
    static constexpr double inertia = 0.5;
  };

  template <> struct GrainShape<3> {
    static constexpr double volume = 4.0 / 3.0 * kPi;
    static constexpr double inertia = 0.4;
  };

  /// Returns the area of a disk [length^2] or the volume of a sphere [length^3].
  template <int D> RVE_INLINE double grain_volume(double radius)
  {
    return times_power<D>(GrainShape<D>::volume, radius);
  }

}    // namespace RVE_ISA
}    // namespace rve
