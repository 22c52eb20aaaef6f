// SPDX-License-Identifier: GPL-2.0-only
// Packs of numbers in AVX2 registers; one instruction computes all numbers of a register. Every
// operation is the IEEE operation on each number, so that a formula gives the same bits for a pack
// as for single numbers. Only translation units compiled for x86-64-v3 include this file.
//
// std::experimental::simd is not used for two reasons. Its masks of more than one register are bit
// sets, which AVX2 must convert to registers for every selection. It converts 64-bit integers one
// by one.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/fixed_point.h"
#include "rve/core/integer_sums.h"

#include <cstdint>
#include <cstring>
#include <immintrin.h>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Vector type of GCC and clang, which has the arithmetic operators of numbers.
  template <class T> struct RegisterType {
    typedef T type __attribute__((vector_size(32)));
  };
  template <class T> using RegisterOf = typename RegisterType<T>::type;

  /// Operations that the register types have no operator for.
  template <class T> struct Simd;

  template <> struct Simd<float> {
    static RVE_INLINE __m256 fused(__m256 x, __m256 y, __m256 z)
    {
      return _mm256_fmadd_ps(x, y, z);
    }
    static RVE_INLINE __m256 root(__m256 x) { return _mm256_sqrt_ps(x); }
    // The instructions return x < y ? x : y and x > y ? x : y, also for NaN and zeros.
    static RVE_INLINE __m256 smaller(__m256 x, __m256 y) { return _mm256_min_ps(x, y); }
    static RVE_INLINE __m256 larger(__m256 x, __m256 y) { return _mm256_max_ps(x, y); }
    static RVE_INLINE __m256 choose(__m256 truth, __m256 yes, __m256 no)
    {
      return _mm256_blendv_ps(no, yes, truth);
    }
    static RVE_INLINE int signs(__m256 x) { return _mm256_movemask_ps(x); }
  };

  template <> struct Simd<double> {
    static RVE_INLINE __m256d fused(__m256d x, __m256d y, __m256d z)
    {
      return _mm256_fmadd_pd(x, y, z);
    }
    static RVE_INLINE __m256d root(__m256d x) { return _mm256_sqrt_pd(x); }
    static RVE_INLINE __m256d smaller(__m256d x, __m256d y) { return _mm256_min_pd(x, y); }
    static RVE_INLINE __m256d larger(__m256d x, __m256d y) { return _mm256_max_pd(x, y); }
    static RVE_INLINE __m256d choose(__m256d truth, __m256d yes, __m256d no)
    {
      return _mm256_blendv_pd(no, yes, truth);
    }
    static RVE_INLINE int signs(__m256d x) { return _mm256_movemask_pd(x); }
  };

  /// N numbers in as many registers as they need.
  template <class T, int N> struct Pack {
    using Number = T;
    using Register = RegisterOf<T>;
    typedef T InMemory __attribute__((vector_size(32), aligned(alignof(T)), may_alias));
    static constexpr int lanes = N;
    static constexpr int per_register = 32 / static_cast<int>(sizeof(T));
    static constexpr int num_registers = N / per_register;
    static_assert(N % per_register == 0, "whole registers");

    Register part[num_registers];

    Pack() = default;
    /// Sets all lanes to x. The form x - 0 keeps all bits of x, even if x is -0.
    RVE_INLINE explicit Pack(T x)
    {
      for (Register &numbers : part) numbers = x - Register{};
    }
    /// Converts each number as static_cast does.
    template <class U> RVE_INLINE explicit Pack(const Pack<U, N> &x) { convert(x, *this); }

    static RVE_INLINE Pack load(const T *p)
    {
      Pack x;
      for (int m = 0; m < num_registers; ++m)
        x.part[m] = *reinterpret_cast<const InMemory *>(p + m * per_register);
      return x;
    }
    RVE_INLINE void store(T *p) const
    {
      for (int m = 0; m < num_registers; ++m)
        *reinterpret_cast<InMemory *>(p + m * per_register) = part[m];
    }
  };

  template <class T, int N> constexpr double kEpsilon<Pack<T, N>> = kEpsilon<T>;

  /// Floating-point type of the same width as T.
  template <class T> using Floating = std::conditional_t<sizeof(T) == 4, float, double>;

  /// N truth values as wide as the compared numbers: each lane is all ones or all zeros.
  template <class T, int N> struct PackTruth {
    using Register = decltype(RegisterOf<T>() < RegisterOf<T>());

    Register part[Pack<T, N>::num_registers];
  };

  /// Applies f to each register of the packs.
  template <class T, int N, class F, class... More>
  RVE_INLINE Pack<T, N> by_register(F f, const Pack<T, N> &x, const More &...more)
  {
    Pack<T, N> result;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      result.part[m] = f(x.part[m], more.part[m]...);
    return result;
  }

#define RVE_PACK_OPERATOR(Result, op)                                                            \
  template <class T, int N>                                                                      \
  RVE_INLINE Result<T, N> operator op(const Pack<T, N> &x, const Pack<T, N> &y)                  \
  {                                                                                              \
    Result<T, N> result;                                                                         \
    for (int m = 0; m < Pack<T, N>::num_registers; ++m) result.part[m] = x.part[m] op y.part[m]; \
    return result;                                                                               \
  }
  RVE_PACK_OPERATOR(Pack, +)
  RVE_PACK_OPERATOR(Pack, -)
  RVE_PACK_OPERATOR(Pack, *)
  RVE_PACK_OPERATOR(Pack, /)
  // As for single numbers, a comparison with NaN is false, except != .
  RVE_PACK_OPERATOR(PackTruth, <)
  RVE_PACK_OPERATOR(PackTruth, >)
  RVE_PACK_OPERATOR(PackTruth, <=)
  RVE_PACK_OPERATOR(PackTruth, >=)
  RVE_PACK_OPERATOR(PackTruth, !=)
#undef RVE_PACK_OPERATOR

  template <class T, int N> RVE_INLINE Pack<T, N> operator-(const Pack<T, N> &x)
  {
    return by_register([](const auto &numbers) RVE_INLINE_LAMBDA { return -numbers; }, x);
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> fma(const Pack<T, N> &x, const Pack<T, N> &y, const Pack<T, N> &z)
  {
    return by_register(Simd<T>::fused, x, y, z);
  }
  /// Combines the sign bits of `sign` with the other bits of `size`.
  template <class T, int N>
  RVE_INLINE Pack<T, N> copysign(const Pack<T, N> &size, const Pack<T, N> &sign)
  {
    using Register = RegisterOf<T>;
    using Bits = typename PackTruth<T, N>::Register;
    const Bits sign_bit = (Bits) Pack<T, N>(T(-0.0)).part[0];
    return by_register(
        [&](const Register &x, const Register &y) RVE_INLINE_LAMBDA {
          return (Register) (((Bits) x & ~sign_bit) | ((Bits) y & sign_bit));
        },
        size, sign);
  }
  template <class T, int N> RVE_INLINE Pack<T, N> fabs(const Pack<T, N> &x)
  {
    return copysign(x, Pack<T, N>(T(0)));
  }
  template <class T, int N> RVE_INLINE Pack<T, N> smaller(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::smaller, x, y);
  }
  template <class T, int N> RVE_INLINE Pack<T, N> larger(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::larger, x, y);
  }
  template <class T, int N> RVE_INLINE Pack<T, N> sqrt(const Pack<T, N> &x)
  {
    return by_register(Simd<T>::root, x);
  }
  template <class T, int N>
  RVE_INLINE RootAndInverse<Pack<T, N>> root_and_inverse(const Pack<T, N> &x)
  {
    const Pack<T, N> root = sqrt(x);
    return {root, Pack<T, N>(T(1)) / root};
  }
  template <class T, int N> RVE_INLINE Pack<T, N> reciprocal(const Pack<T, N> &x)
  {
    return Pack<T, N>(T(1)) / x;
  }
  template <class T, int N> RVE_INLINE Pack<T, N> quotient(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return x / y;
  }
  template <class T, int N> RVE_INLINE Pack<T, N> root(const Pack<T, N> &x)
  {
    return sqrt(x);
  }

  template <class T, int N>
  RVE_INLINE Pack<T, N> select(const PackTruth<T, N> &condition, const Pack<T, N> &yes,
                               const Pack<T, N> &no)
  {
    using Register = RegisterOf<T>;
    Pack<T, N> result;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      result.part[m] = Simd<T>::choose((Register) condition.part[m], yes.part[m], no.part[m]);
    return result;
  }
  /// Returns x in the lanes where the condition holds, and zero in the others.
  template <class T, int N>
  RVE_INLINE Pack<T, N> where(const PackTruth<T, N> &condition, const Pack<T, N> &x)
  {
    using Register = RegisterOf<T>;
    using Bits = typename PackTruth<T, N>::Register;
    Pack<T, N> result;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      result.part[m] = (Register) (condition.part[m] & (Bits) x.part[m]);
    return result;
  }
  /// Applies where() to each pack of a struct of packs.
  template <class T, int N, class Record>
  RVE_INLINE Record where(const PackTruth<T, N> &condition, const Record &record)
  {
    constexpr int K = sizeof(Record) / sizeof(Pack<T, N>);
    static_assert(sizeof(Record) == K * sizeof(Pack<T, N>), "a record of such packs");
    Pack<T, N> packs[K];
    std::memcpy(packs, &record, sizeof(record));
    for (int c = 0; c < K; ++c) packs[c] = where(condition, packs[c]);
    Record result;
    std::memcpy(&result, packs, sizeof(result));
    return result;
  }

  /// Returns an integer with one bit per lane, which is set where the condition holds.
  template <class T, int N> RVE_INLINE int signs(const PackTruth<T, N> &condition)
  {
    int bits = 0;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      bits |= Simd<T>::signs((RegisterOf<T>) condition.part[m]) << (m * Pack<T, N>::per_register);
    return bits;
  }
  template <class T, int N> RVE_INLINE bool any(const PackTruth<T, N> &condition)
  {
    return signs(condition) != 0;
  }
  template <class T, int N> RVE_INLINE int count(const PackTruth<T, N> &condition)
  {
    return __builtin_popcount(signs(condition));
  }
  template <class T, int N>
  RVE_INLINE int count_without(const PackTruth<T, N> &condition, const PackTruth<T, N> &other)
  {
    return __builtin_popcount(signs(condition) & ~signs(other));
  }

  /// Returns the sum of all lanes.
  template <class T, int N> RVE_INLINE std::int64_t total(const Pack<T, N> &x)
  {
    T lane[N];
    x.store(lane);
    std::int64_t sum = 0;
    for (int k = 0; k < N; ++k) sum = wrapping_sum(sum, static_cast<std::int64_t>(lane[k]));
    return sum;
  }

  template <class T, int N>
  RVE_INLINE Pack<T, N> wrapping_sum(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    using Wrapping = Pack<std::make_unsigned_t<T>, N>;
    return Pack<T, N>(Wrapping(x) + Wrapping(y));
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> wrapping_difference(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    using Wrapping = Pack<std::make_unsigned_t<T>, N>;
    return Pack<T, N>(Wrapping(x) - Wrapping(y));
  }

  /// Number format for N grains at once.
  template <class Numbers, int N> struct PackNumbers {
    using Scalar = Numbers;
    using Leading = PackNumbers<typename Numbers::Leading, N>;
    using Coordinate = Pack<typename Numbers::Coordinate, N>;
    using SignedCoordinate = Pack<typename Numbers::SignedCoordinate, N>;
    using Wide = Pack<typename Numbers::Wide, N>;
    using Spring = Pack<typename Numbers::Spring, N>;
    using Real = Pack<typename Numbers::Real, N>;
    using Sum = Pack<typename Numbers::Sum, N>;
  };

  // ---- conversions ------------------------------------------------------------------------------

  /// Converts 64-bit integers to doubles; AVX2 has no instruction for this. The leading 16 bits
  /// become one double, the other 48 bits another. Both are exact, and only their sum is rounded.
  /// The bits of each part are placed in the mantissa of a large number, which is then subtracted.
  /// For the leading bits this number is 3 2^67; its last mantissa bit has the value 2^16. For the
  /// other bits it is 2^52; its last mantissa bit has the value 1.
  RVE_INLINE __m256d to_double(__m256i x)
  {
    const __m256d large = _mm256_set1_pd(442721857769029238784.0);    // 3 2^67
    const __m256d both = _mm256_set1_pd(442726361368656609280.0);     // 3 2^67 + 2^52
    const __m256d small = _mm256_set1_pd(4503599627370496.0);         // 2^52
    __m256i high = _mm256_srai_epi32(x, 16);
    high = _mm256_blend_epi16(high, _mm256_setzero_si256(), 0x33);
    high = _mm256_add_epi64(high, _mm256_castpd_si256(large));
    const __m256i low = _mm256_blend_epi16(x, _mm256_castpd_si256(small), 0x88);
    return _mm256_add_pd(_mm256_sub_pd(_mm256_castsi256_pd(high), both), _mm256_castsi256_pd(low));
  }

  /// Converts signed integers to unsigned ones and back, or signed integers to floating-point
  /// numbers of the same size.
  template <class T, class U, int N> RVE_INLINE void convert(const Pack<T, N> &x, Pack<U, N> &y)
  {
    static_assert(sizeof(T) == sizeof(U) && std::is_integral_v<T>, "no other conversion is needed");
    for (int m = 0; m < x.num_registers; ++m)
      if constexpr (std::is_same_v<U, float>)
        y.part[m] = _mm256_cvtepi32_ps((__m256i) x.part[m]);
      else if constexpr (std::is_same_v<U, double>)
        y.part[m] = to_double((__m256i) x.part[m]);
      else
        y.part[m] = (RegisterOf<U>) x.part[m];
  }

  template <int N> RVE_INLINE void convert(const Pack<float, N> &x, Pack<double, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) {
      y.part[2 * m] = _mm256_cvtps_pd(_mm256_castps256_ps128(x.part[m]));
      y.part[2 * m + 1] = _mm256_cvtps_pd(_mm256_extractf128_ps(x.part[m], 1));
    }
  }
  template <int N> RVE_INLINE void convert(const Pack<double, N> &x, Pack<float, N> &y)
  {
    for (int m = 0; m < y.num_registers; ++m)
      y.part[m] =
          _mm256_set_m128(_mm256_cvtpd_ps(x.part[2 * m + 1]), _mm256_cvtpd_ps(x.part[2 * m]));
  }

  /// Converts truth values to the truth type of numbers of another width.
  template <class T, int N>
  RVE_INLINE void convert_truth(const PackTruth<T, N> &x, PackTruth<T, N> &y)
  {
    y = x;
  }
  template <int N>
  RVE_INLINE void convert_truth(const PackTruth<float, N> &x, PackTruth<double, N> &y)
  {
    using Wide = typename PackTruth<double, N>::Register;
    for (int m = 0; m < Pack<float, N>::num_registers; ++m) {
      const __m256i truth = (__m256i) x.part[m];
      y.part[2 * m] = (Wide) _mm256_cvtepi32_epi64(_mm256_castsi256_si128(truth));
      y.part[2 * m + 1] = (Wide) _mm256_cvtepi32_epi64(_mm256_extracti128_si256(truth, 1));
    }
  }

  // ---- rounding to integers, as round_to() of each number ---------------------------------------

  template <int N> RVE_INLINE void round_to(const Pack<float, N> &x, Pack<std::int32_t, N> &q)
  {
    using Integers = RegisterOf<std::int32_t>;
    for (int m = 0; m < x.num_registers; ++m) q.part[m] = (Integers) _mm256_cvtps_epi32(x.part[m]);
  }

  /// Rounds numbers of magnitude below 2^51 by adding 3 2^51, whose last mantissa bit has the value
  /// 1. If a pack contains a larger number or NaN, its numbers are rounded one by one.
  template <int N> RVE_INLINE void round_to(const Pack<double, N> &x, Pack<std::int64_t, N> &q)
  {
    using Integers = RegisterOf<std::int64_t>;
    const Pack<double, N> magic(6755399441055744.0);    // 3 2^51
    const Pack<double, N> limit(2251799813685248.0);    // 2^51
    if (__builtin_expect(signs(fabs(x) < limit) == (1 << N) - 1, true)) {
      for (int m = 0; m < x.num_registers; ++m)
        q.part[m] = (Integers) (x.part[m] + magic.part[m]) - (Integers) magic.part[m];
    } else {
      double number[N];
      std::int64_t rounded[N];
      x.store(number);
      for (int lane = 0; lane < N; ++lane) round_to(number[lane], rounded[lane]);
      q = Pack<std::int64_t, N>::load(rounded);
    }
  }

}    // namespace RVE_ISA
}    // namespace rve
