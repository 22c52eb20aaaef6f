// Number formats, and the two uses of integers in the engine: positions as unsigned fractions of the cell, whose overflow
// is the periodic wrap, and sums of forces, whose order then does not matter.

#ifndef RVE_CORE_FIXED_POINT_H
#define RVE_CORE_FIXED_POINT_H

#include "rve/core/config.h"
#include "rve/core/spring_forces.h"
#include "rve/core/tensor.h"

#include <cmath>
#include <cstdint>
#include <type_traits>

#if !defined(__CUDA_ARCH__) && defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace rve {
inline namespace RVE_ISA {

  /// Nearest integer, ties to even, on both sides the same. The argument must lie in the range of the integer.
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

  /// 32-bit fractions, fp32 everywhere.
  struct FastFormat {
    using Coordinate = std::uint32_t;
    using SignedCoordinate = std::int32_t;
    using Wide = float;          ///< branch vector and gap
    using Spring = float;        ///< force of a contact's spring
    using History = Spring;      ///< what a pair remembers: its tangential force
    using Real = float;          ///< the rest
    using Sum = std::int32_t;    ///< force on a grain
    static constexpr double fraction_unit = 1.0 / 4294967296.0;    // 2^-32
    static constexpr int sum_bits = 31;    ///< that a force on a grain may fill
    static constexpr bool has_friction = true;
    static constexpr bool has_rolling = false;
  };

  /// 64-bit fractions, branch, gap and tangential history in fp64, the rest in fp32.
  struct MixedFormat {
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using Spring = double;
    using History = Spring;
    using Real = float;
    using Sum = std::int32_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;    // 2^-64
    static constexpr int sum_bits = 31;    ///< of a force on a grain
    static constexpr bool has_friction = true;
    static constexpr bool has_rolling = false;
  };

  /// 64-bit fractions, fp64 everywhere, forces summed in 64 bits.
  struct DoubleFormat {
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using Spring = double;
    using History = Spring;
    using Real = double;
    using Sum = std::int64_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;
    /// The accumulators of a block are two limbs of 32 bits (block/block_cuda.cuh): 24 bits and the rest.
    static constexpr int sum_bits = 55;
    static constexpr bool has_friction = true;
    static constexpr bool has_rolling = false;
  };

  /// Fraction of the cell in fp32, in [0, 1).
  struct FloatFraction {
    float value;
  };

  /// As the paper: fp32 everywhere, positions too. Those of the paper are Cartesian; fractions have the same resolution, 2^-24 of the
  /// cell. For the study of what this loses, on a CPU.
  struct SingleFormat {
    using Coordinate = FloatFraction;
    using Wide = float;
    using Spring = float;
    using History = Spring;
    using Real = float;
    using Sum = std::int32_t;
    static constexpr double fraction_unit = 1.0;
    static constexpr int sum_bits = 31;    ///< of a force on a grain
    static constexpr bool has_friction = true;
    static constexpr bool has_rolling = false;
  };

  /// The same numbers for scenes without friction, where nothing acts along a contact: no tangential force, no torque, no history.
  template <class Format> struct Frictionless : Format {
    static constexpr bool has_friction = false;
  };

  /// The same numbers for scenes with rolling resistance, whose pairs remember a rolling force beside the tangential one.
  template <class Format> struct Rolling : Format {
    using History = SpringForces<typename Format::Spring>;
    static constexpr bool has_rolling = true;
  };

  /// Nearest-image difference of two fractions, in units of fraction_unit: the wrapped subtraction is the minimum image.
  template <class Format>
  RVE_INLINE typename Format::Wide nearest_image(typename Format::Coordinate to,
                                                 typename Format::Coordinate from)
  {
    if constexpr (std::is_same_v<typename Format::Coordinate, FloatFraction>) {
      const float difference = to.value - from.value;
      return difference - std::nearbyint(difference);
    } else {
      return static_cast<typename Format::Wide>(
          static_cast<typename Format::SignedCoordinate>(to - from));
    }
  }

  template <class Format, int D>
  RVE_INLINE Vec<typename Format::Wide, D>
  fractional_difference(const Vec<typename Format::Coordinate, D> &to,
                        const Vec<typename Format::Coordinate, D> &from)
  {
    Vec<typename Format::Wide, D> difference;
    for (int a = 0; a < D; ++a) difference[a] = nearest_image<Format>(to[a], from[a]);
    return difference;
  }

  RVE_INLINE FloatFraction wrapped(float x)
  {
    const float fraction = x - std::floor(x);
    return FloatFraction{fraction < 1.0f ? fraction : 0.0f};
  }

  /// Moves a fraction by a displacement in units of fraction_unit, by half a cell at most: even the wildest grain is seen to have moved.
  template <class Format>
  RVE_INLINE void drift(typename Format::Coordinate &s, typename Format::Wide displacement)
  {
    if constexpr (std::is_same_v<typename Format::Coordinate, FloatFraction>) {
      // a NaN goes half a cell too
      const float bounded = displacement > -0.5f ? (displacement < 0.5f ? displacement : 0.5f)
                                                 : (displacement <= -0.5f ? -0.5f : 0.5f);
      s = wrapped(s.value + bounded);
    } else {
      typename Format::SignedCoordinate units;
      round_to(displacement, units);    // saturates
      s += static_cast<typename Format::Coordinate>(units);
    }
  }

  /// Matrix that turns fractional differences into lengths, H * fraction_unit.
  template <class Format, int D>
  RVE_INLINE Tensor<typename Format::Wide, D> fraction_to_length(const Tensor<double, D> &cell)
  {
    return (Format::fraction_unit * cell).template as<typename Format::Wide>();
  }

  /// The leading 32 bits of a fraction: enough to see how far a grain has gone.
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

  /// Power of two 2^n, exact, without a transcendental function; n in [-1022, 1023].
  RVE_INLINE double power_of_two(int n)
  {
    union {
      std::uint64_t bits;
      double value;
    } u;
    u.bits = static_cast<std::uint64_t>(n + 1023) << 52;
    return u.value;
  }

  /// floor(log2(x)) of a positive normal number.
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

#endif
