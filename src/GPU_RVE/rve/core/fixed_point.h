// SPDX-License-Identifier: GPL-2.0-only
// Fixed-point numbers of the engine. Positions are fractions of the cell, stored as unsigned
// integers; integer overflow is the periodic wrap. Forces are rounded to integers, so that their
// sums do not depend on the order of the terms.

#pragma once

#include "rve/core/numbers.h"
#include "rve/core/tensor.h"

#include <cmath>
#include <cstdint>
#include <type_traits>

#if !defined(__CUDA_ARCH__) && defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace rve {
inline namespace RVE_ISA {

  /// Rounds to the nearest integer, ties to even, in the same way on CPU and GPU. The argument must
  /// be in the range of the integer.
  RVE_INLINE void round_to(float x, std::int32_t &q)
  {
#if defined(__CUDA_ARCH__)
    q = __float2int_rn(x);
#elif defined(__SSE2__)
    q = _mm_cvtss_si32(_mm_set_ss(x));
#else
    q = static_cast<std::int32_t>(std::nearbyint(x));
#endif
  }

  RVE_INLINE void round_to(double x, std::int64_t &q)
  {
#if defined(__CUDA_ARCH__)
    q = __double2ll_rn(x);
#elif defined(__SSE2__)
    q = _mm_cvtsd_si64(_mm_set_sd(x));
#else
    q = static_cast<std::int64_t>(std::nearbyint(x));
#endif
  }

  RVE_INLINE void round_to(double x, std::int32_t &q)
  {
    std::int64_t wide;
    round_to(x, wide);
    q = static_cast<std::int32_t>(wide);
  }

  RVE_INLINE void round_to(float x, std::int64_t &q)
  {
    round_to(static_cast<double>(x), q);
  }

  /// Converts to the nearest real number, ties to even, in the same way on CPU and GPU.
  template <class Real, class Integer> RVE_INLINE Real to_real(const Integer &q)
  {
#if defined(__CUDA_ARCH__)
    if constexpr (std::is_same_v<Integer, std::int64_t>) {
      // The conversion instruction for 64 bits has a low throughput. Instead each half of q is
      // added to a power of two, by writing its 32 bits into the trailing mantissa bits of a
      // double. The subtraction of these powers is exact, so that only the sum of both halves is
      // rounded.
      constexpr int two_to_84 = 0x45300000, two_to_52 = 0x43300000;
      const int high = static_cast<int>(q >> 32), low = static_cast<int>(q);
      const double upper = __hiloint2double(two_to_84, high ^ static_cast<int>(0x80000000u)),
                   lower = __hiloint2double(two_to_52, low);
      return static_cast<Real>((upper - (0x1p84 + 0x1p63 + 0x1p52)) + lower);
    }
#endif
    return static_cast<Real>(q);
  }

  /// Returns `to` - `from` for the nearest periodic image of `to`, in units of fraction_unit. For
  /// integers, wrapping subtraction gives this difference.
  template <class Numbers>
  RVE_INLINE typename Numbers::Wide nearest_image(typename Numbers::Coordinate to,
                                                  typename Numbers::Coordinate from)
  {
    if constexpr (std::is_same_v<typename Numbers::Coordinate, FloatFraction>) {
      const float difference = to.value - from.value;
      return difference - std::nearbyint(difference);
    } else {
      return to_real<typename Numbers::Wide>(
          static_cast<typename Numbers::SignedCoordinate>(to - from));
    }
  }

  template <class Numbers, int D>
  RVE_INLINE Vec<typename Numbers::Wide, D>
  fractional_difference(const Vec<typename Numbers::Coordinate, D> &to,
                        const Vec<typename Numbers::Coordinate, D> &from)
  {
    Vec<typename Numbers::Wide, D> difference;
    for (int a = 0; a < D; ++a) difference[a] = nearest_image<Numbers>(to[a], from[a]);
    return difference;
  }

  RVE_INLINE FloatFraction wrapped(float x)
  {
    const float fraction = x - std::floor(x);
    return FloatFraction{fraction < 1.0f ? fraction : 0.0f};
  }

  /// Moves a fraction by a displacement in units of fraction_unit. Displacements saturate at half a
  /// cell, so that a larger displacement does not wrap to a small apparent motion.
  template <class Numbers>
  RVE_INLINE void drift(typename Numbers::Coordinate &s, typename Numbers::Wide displacement)
  {
    if constexpr (std::is_same_v<typename Numbers::Coordinate, FloatFraction>) {
      // A NaN counts as half a cell.
      const float bounded = displacement > -0.5f ? (displacement < 0.5f ? displacement : 0.5f)
                                                 : (displacement <= -0.5f ? -0.5f : 0.5f);
      s = wrapped(s.value + bounded);
    } else {
      typename Numbers::SignedCoordinate units;
      round_to(displacement, units);    // saturates
      s = s + static_cast<typename Numbers::Coordinate>(units);
    }
  }

  /// Returns the matrix H * fraction_unit, which maps fractional differences to lengths.
  template <class Numbers, int D>
  RVE_INLINE Tensor<typename Numbers::Wide, D> fraction_to_length(const Tensor<double, D> &cell)
  {
    return (Numbers::fraction_unit * cell).template as<typename Numbers::Wide>();
  }

  /// Returns the leading 32 bits of a fraction, which suffice to measure how far a grain has moved.
  RVE_INLINE std::uint32_t leading_bits(std::uint32_t s)
  {
    return s;
  }
  RVE_INLINE std::uint32_t leading_bits(std::uint64_t s)
  {
    return static_cast<std::uint32_t>(s >> 32);
  }
  RVE_INLINE std::uint32_t leading_bits(FloatFraction s)
  {
    return static_cast<std::uint32_t>(static_cast<double>(s.value) * 4294967296.0);
  }

  /// Returns 2^n, exact and without a transcendental function; n is in [-1022, 1023].
  RVE_INLINE double power_of_two(int n)
  {
    union {
      std::uint64_t bits;
      double value;
    } u;
    u.bits = static_cast<std::uint64_t>(n + 1023) << 52;
    return u.value;
  }

  /// Returns floor(log2(x)) of a positive normal number.
  RVE_INLINE int floor_log2(double x)
  {
    union {
      double value;
      std::uint64_t bits;
    } u;
    u.value = x;
    return static_cast<int>((u.bits >> 52) & 0x7ff) - 1023;
  }

}    // namespace RVE_ISA
}    // namespace rve
