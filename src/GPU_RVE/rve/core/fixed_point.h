// Number formats, and the two uses of integers in the engine: positions as unsigned fractions of the cell, whose overflow
// is the periodic wrap, and sums of forces, whose order then does not matter.

#ifndef RVE_CORE_FIXED_POINT_H
#define RVE_CORE_FIXED_POINT_H

#include "rve/core/config.h"
#include "rve/core/tensor.h"

#include <cmath>
#include <cstdint>

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
    using Wide = float;                                            ///< branch vector and gap
    using History = float;                                         ///< tangential force
    using Real = float;                                            ///< the rest
    using Sum = std::int32_t;                                      ///< force on a grain
    static constexpr double fraction_unit = 1.0 / 4294967296.0;    // 2^-32
    static constexpr int sum_bits = 31;    ///< that a force on a grain may fill
  };

  /// 64-bit fractions, branch, gap and tangential history in fp64, the rest in fp32.
  struct MixedFormat {
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using History = double;
    using Real = float;
    using Sum = std::int32_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;    // 2^-64
    static constexpr int sum_bits = 31;    ///< of a force on a grain
  };

  /// 64-bit fractions, fp64 everywhere, forces summed in 64 bits.
  struct DoubleFormat {
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using History = double;
    using Real = double;
    using Sum = std::int64_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;
    /// The accumulators of a block are two limbs of 32 bits (block/block_cuda.cuh): 24 bits and the rest.
    static constexpr int sum_bits = 55;
  };

  /// Nearest-image difference of two fractions, in units of fraction_unit: the wrapped subtraction is the minimum image.
  template <class Format, int D>
  RVE_INLINE Vec<typename Format::Wide, D>
  fractional_difference(const Vec<typename Format::Coordinate, D> &to,
                        const Vec<typename Format::Coordinate, D> &from)
  {
    Vec<typename Format::Wide, D> difference;
    for (int a = 0; a < D; ++a)
      difference[a] = static_cast<typename Format::Wide>(
          static_cast<typename Format::SignedCoordinate>(to[a] - from[a]));
    return difference;
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
