// SPDX-License-Identifier: GPL-2.0-only
// Packs of numbers that are computed with at once, in AVX2 registers. Every operation is the IEEE operation on each number, so
// that a formula gives the bits that it gives for one number. For translation units compiled for x86-64-v3.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/fixed_point.h"
#include "rve/core/integer_sums.h"
#include "rve/core/vec.h"

#include <cstdint>
#include <cstring>
#include <immintrin.h>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// What one register does, by the type of its numbers. A truth is a register whose lanes are all ones or all zeros.
  template <class T> struct Simd;

  template <> struct Simd<float> {
    using Register = __m256;
    static RVE_INLINE Register load(const float *p) { return _mm256_loadu_ps(p); }
    static RVE_INLINE void store(float *p, Register x) { _mm256_storeu_ps(p, x); }
    static RVE_INLINE Register all(float x) { return _mm256_set1_ps(x); }
    static RVE_INLINE Register add(Register x, Register y) { return _mm256_add_ps(x, y); }
    static RVE_INLINE Register subtract(Register x, Register y) { return _mm256_sub_ps(x, y); }
    static RVE_INLINE Register multiply(Register x, Register y) { return _mm256_mul_ps(x, y); }
    static RVE_INLINE Register divide(Register x, Register y) { return _mm256_div_ps(x, y); }
    static RVE_INLINE Register fused(Register x, Register y, Register z)
    {
      return _mm256_fmadd_ps(x, y, z);
    }
    static RVE_INLINE Register root(Register x) { return _mm256_sqrt_ps(x); }
    // x < y ? x : y and x > y ? x : y, also for NaN and zeros
    static RVE_INLINE Register smaller(Register x, Register y) { return _mm256_min_ps(x, y); }
    static RVE_INLINE Register larger(Register x, Register y) { return _mm256_max_ps(x, y); }
    static RVE_INLINE Register both(Register x, Register y) { return _mm256_and_ps(x, y); }
    static RVE_INLINE Register either(Register x, Register y) { return _mm256_or_ps(x, y); }
    static RVE_INLINE Register differ(Register x, Register y) { return _mm256_xor_ps(x, y); }
    static RVE_INLINE Register without(Register x, Register y) { return _mm256_andnot_ps(y, x); }
    template <int Predicate> static RVE_INLINE Register compare(Register x, Register y)
    {
      return _mm256_cmp_ps(x, y, Predicate);
    }
    static RVE_INLINE Register choose(Register truth, Register yes, Register no)
    {
      return _mm256_blendv_ps(no, yes, truth);
    }
    static RVE_INLINE int signs(Register x) { return _mm256_movemask_ps(x); }
  };

  template <> struct Simd<double> {
    using Register = __m256d;
    static RVE_INLINE Register load(const double *p) { return _mm256_loadu_pd(p); }
    static RVE_INLINE void store(double *p, Register x) { _mm256_storeu_pd(p, x); }
    static RVE_INLINE Register all(double x) { return _mm256_set1_pd(x); }
    static RVE_INLINE Register add(Register x, Register y) { return _mm256_add_pd(x, y); }
    static RVE_INLINE Register subtract(Register x, Register y) { return _mm256_sub_pd(x, y); }
    static RVE_INLINE Register multiply(Register x, Register y) { return _mm256_mul_pd(x, y); }
    static RVE_INLINE Register divide(Register x, Register y) { return _mm256_div_pd(x, y); }
    static RVE_INLINE Register fused(Register x, Register y, Register z)
    {
      return _mm256_fmadd_pd(x, y, z);
    }
    static RVE_INLINE Register root(Register x) { return _mm256_sqrt_pd(x); }
    static RVE_INLINE Register smaller(Register x, Register y) { return _mm256_min_pd(x, y); }
    static RVE_INLINE Register larger(Register x, Register y) { return _mm256_max_pd(x, y); }
    static RVE_INLINE Register both(Register x, Register y) { return _mm256_and_pd(x, y); }
    static RVE_INLINE Register either(Register x, Register y) { return _mm256_or_pd(x, y); }
    static RVE_INLINE Register differ(Register x, Register y) { return _mm256_xor_pd(x, y); }
    static RVE_INLINE Register without(Register x, Register y) { return _mm256_andnot_pd(y, x); }
    template <int Predicate> static RVE_INLINE Register compare(Register x, Register y)
    {
      return _mm256_cmp_pd(x, y, Predicate);
    }
    static RVE_INLINE Register choose(Register truth, Register yes, Register no)
    {
      return _mm256_blendv_pd(no, yes, truth);
    }
    static RVE_INLINE int signs(Register x) { return _mm256_movemask_pd(x); }
  };

  /// Integers wrap.
  template <class T> struct SimdInteger {
    using Register = __m256i;
    static RVE_INLINE Register load(const T *p)
    {
      return _mm256_loadu_si256(reinterpret_cast<const __m256i *>(p));
    }
    static RVE_INLINE void store(T *p, Register x)
    {
      _mm256_storeu_si256(reinterpret_cast<__m256i *>(p), x);
    }
    static RVE_INLINE Register all(T x)
    {
      if constexpr (sizeof(T) == 4)
        return _mm256_set1_epi32(static_cast<int>(x));
      else
        return _mm256_set1_epi64x(static_cast<long long>(x));
    }
    static RVE_INLINE Register add(Register x, Register y)
    {
      return sizeof(T) == 4 ? _mm256_add_epi32(x, y) : _mm256_add_epi64(x, y);
    }
    static RVE_INLINE Register subtract(Register x, Register y)
    {
      return sizeof(T) == 4 ? _mm256_sub_epi32(x, y) : _mm256_sub_epi64(x, y);
    }
  };

  template <> struct Simd<std::int32_t> : SimdInteger<std::int32_t> {
  };
  template <> struct Simd<std::uint32_t> : SimdInteger<std::uint32_t> {
  };
  template <> struct Simd<std::int64_t> : SimdInteger<std::int64_t> {
  };
  template <> struct Simd<std::uint64_t> : SimdInteger<std::uint64_t> {
  };

  /// N numbers in as many registers as they need.
  template <class T, int N> struct Pack {
    using Number = T;
    using Register = typename Simd<T>::Register;
    static constexpr int lanes = N;
    static constexpr int per_register = 32 / static_cast<int>(sizeof(T));
    static constexpr int num_registers = N / per_register;
    static_assert(N % per_register == 0, "whole registers");

    Register part[num_registers];

    Pack() = default;
    RVE_INLINE explicit Pack(T x)
    {
      for (int m = 0; m < num_registers; ++m) part[m] = Simd<T>::all(x);
    }
    /// As static_cast of each number.
    template <class U> RVE_INLINE explicit Pack(const Pack<U, N> &x) { convert(x, *this); }

    static RVE_INLINE Pack load(const T *p)
    {
      Pack x;
      for (int m = 0; m < num_registers; ++m) x.part[m] = Simd<T>::load(p + m * per_register);
      return x;
    }
    RVE_INLINE void store(T *p) const
    {
      for (int m = 0; m < num_registers; ++m) Simd<T>::store(p + m * per_register, part[m]);
    }
  };

  template <class T, int N> constexpr double kEpsilon<Pack<T, N>> = kEpsilon<T>;

  /// N truths, as wide as the numbers that were compared.
  template <class T, int N> struct PackTruth {
    Pack<T, N> lanes;
  };

  /// f of each register of the packs.
  template <class T, int N, class F, class... More>
  RVE_INLINE Pack<T, N> by_register(F f, const Pack<T, N> &x, const More &...more)
  {
    Pack<T, N> result;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      result.part[m] = f(x.part[m], more.part[m]...);
    return result;
  }

  template <class T, int N>
  RVE_INLINE Pack<T, N> operator+(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::add, x, y);
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> operator-(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::subtract, x, y);
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> operator*(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::multiply, x, y);
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> operator/(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return by_register(Simd<T>::divide, x, y);
  }
  template <class T, int N> RVE_INLINE Pack<T, N> operator-(const Pack<T, N> &x)
  {
    return by_register(Simd<T>::differ, x, Pack<T, N>(T(-0.0)));
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> fma(const Pack<T, N> &x, const Pack<T, N> &y, const Pack<T, N> &z)
  {
    return by_register(Simd<T>::fused, x, y, z);
  }
  template <class T, int N> RVE_INLINE Pack<T, N> fabs(const Pack<T, N> &x)
  {
    return by_register(Simd<T>::without, x, Pack<T, N>(T(-0.0)));
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> copysign(const Pack<T, N> &size, const Pack<T, N> &sign)
  {
    const Pack<T, N> sign_bit(T(-0.0));
    return by_register(Simd<T>::either, fabs(size), by_register(Simd<T>::both, sign, sign_bit));
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

  // comparisons as in C++: with a NaN only != is true
  template <class T, int N>
  RVE_INLINE PackTruth<T, N> operator<(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return {by_register(Simd<T>::template compare<_CMP_LT_OQ>, x, y)};
  }
  template <class T, int N>
  RVE_INLINE PackTruth<T, N> operator>(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return {by_register(Simd<T>::template compare<_CMP_GT_OQ>, x, y)};
  }
  template <class T, int N>
  RVE_INLINE PackTruth<T, N> operator>=(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return {by_register(Simd<T>::template compare<_CMP_GE_OQ>, x, y)};
  }
  template <class T, int N>
  RVE_INLINE PackTruth<T, N> operator<=(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return {by_register(Simd<T>::template compare<_CMP_LE_OQ>, x, y)};
  }
  template <class T, int N>
  RVE_INLINE PackTruth<T, N> operator!=(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return {by_register(Simd<T>::template compare<_CMP_NEQ_UQ>, x, y)};
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> select(const PackTruth<T, N> &condition, const Pack<T, N> &yes,
                               const Pack<T, N> &no)
  {
    return by_register(Simd<T>::choose, condition.lanes, yes, no);
  }
  /// x where the condition holds, zero elsewhere.
  template <class T, int N>
  RVE_INLINE Pack<T, N> where(const PackTruth<T, N> &condition, const Pack<T, N> &x)
  {
    return by_register(Simd<T>::both, condition.lanes, x);
  }
  /// A bit for each lane.
  template <class T, int N> RVE_INLINE int signs(const PackTruth<T, N> &condition)
  {
    int bits = 0;
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      bits |= Simd<T>::signs(condition.lanes.part[m]) << (m * Pack<T, N>::per_register);
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

  /// The sum of all lanes.
  template <class T, int N> RVE_INLINE std::int64_t total(const Pack<T, N> &x)
  {
    T lane[N];
    x.store(lane);
    std::int64_t sum = 0;
    for (int k = 0; k < N; ++k) sum = wrapping_sum(sum, static_cast<std::int64_t>(lane[k]));
    return sum;
  }

  /// Integers wrap.
  template <class T, int N>
  RVE_INLINE Pack<T, N> wrapping_sum(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return x + y;
  }
  template <class T, int N>
  RVE_INLINE Pack<T, N> wrapping_difference(const Pack<T, N> &x, const Pack<T, N> &y)
  {
    return x - y;
  }

  /// A number format for N grains at once.
  template <class Numbers, int N> struct PackNumbers {
    using Leading = PackNumbers<typename Numbers::Leading, N>;
    using Coordinate = Pack<typename Numbers::Coordinate, N>;
    using SignedCoordinate = Pack<typename Numbers::SignedCoordinate, N>;
    using Wide = Pack<typename Numbers::Wide, N>;
    using Spring = Pack<typename Numbers::Spring, N>;
    using Real = Pack<typename Numbers::Real, N>;
    using Sum = Pack<typename Numbers::Sum, N>;
  };

  // ---- three numbers behind one another per lane, and the lanes behind one another --------------------------------------------------

  template <int N> RVE_INLINE void load_triples(const float *from, Vec<Pack<float, N>, 3> &x)
  {
    for (int m = 0; m < N / 8; ++m, from += 24) {
      const auto two = [&](int k) {
        return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(from + k)),
                                    _mm_loadu_ps(from + k + 12), 1);
      };
      const __m256 front = two(0), middle = two(4), back = two(8);
      const __m256 xy = _mm256_shuffle_ps(middle, back, _MM_SHUFFLE(2, 1, 3, 2)),
                   yz = _mm256_shuffle_ps(front, middle, _MM_SHUFFLE(1, 0, 2, 1));
      x[0].part[m] = _mm256_shuffle_ps(front, xy, _MM_SHUFFLE(2, 0, 3, 0));
      x[1].part[m] = _mm256_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0));
      x[2].part[m] = _mm256_shuffle_ps(yz, back, _MM_SHUFFLE(3, 0, 3, 1));
    }
  }

  template <int N> RVE_INLINE void store_triples(const Vec<Pack<float, N>, 3> &x, float *to)
  {
    for (int m = 0; m < N / 8; ++m, to += 24) {
      const __m256 a = x[0].part[m], b = x[1].part[m], c = x[2].part[m];
      const __m256 ab = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0)),
                   bc = _mm256_shuffle_ps(b, c, _MM_SHUFFLE(3, 1, 3, 1)),
                   ca = _mm256_shuffle_ps(c, a, _MM_SHUFFLE(3, 1, 2, 0));
      const __m256 three[3] = {_mm256_shuffle_ps(ab, ca, _MM_SHUFFLE(2, 0, 2, 0)),
                               _mm256_shuffle_ps(bc, ab, _MM_SHUFFLE(3, 1, 2, 0)),
                               _mm256_shuffle_ps(ca, bc, _MM_SHUFFLE(3, 1, 3, 1))};
      for (int k = 0; k < 3; ++k) {
        _mm_storeu_ps(to + 4 * k, _mm256_castps256_ps128(three[k]));
        _mm_storeu_ps(to + 4 * k + 12, _mm256_extractf128_ps(three[k], 1));
      }
    }
  }

  template <int N> RVE_INLINE void load_triples(const double *from, Vec<Pack<double, N>, 3> &x)
  {
    for (int m = 0; m < N / 4; ++m, from += 12) {
      const __m256d a = _mm256_loadu_pd(from), b = _mm256_loadu_pd(from + 4),
                    c = _mm256_loadu_pd(from + 8);
      const __m256d xy = _mm256_permute2f128_pd(a, b, 0x30),    // x0 y0 x2 y2
          zx = _mm256_permute2f128_pd(a, c, 0x21),              // z0 x1 z2 x3
          yz = _mm256_permute2f128_pd(b, c, 0x30);              // y1 z1 y3 z3
      x[0].part[m] = _mm256_shuffle_pd(xy, zx, 0xa);
      x[1].part[m] = _mm256_shuffle_pd(xy, yz, 0x5);
      x[2].part[m] = _mm256_shuffle_pd(zx, yz, 0xa);
    }
  }

  template <int N> RVE_INLINE void store_triples(const Vec<Pack<double, N>, 3> &x, double *to)
  {
    for (int m = 0; m < N / 4; ++m, to += 12) {
      const __m256d xy = _mm256_unpacklo_pd(x[0].part[m], x[1].part[m]),
                    zx = _mm256_shuffle_pd(x[2].part[m], x[0].part[m], 0xa),
                    yz = _mm256_unpackhi_pd(x[1].part[m], x[2].part[m]);
      _mm256_storeu_pd(to, _mm256_permute2f128_pd(xy, zx, 0x20));
      _mm256_storeu_pd(to + 4, _mm256_permute2f128_pd(yz, xy, 0x30));
      _mm256_storeu_pd(to + 8, _mm256_permute2f128_pd(zx, yz, 0x31));
    }
  }

  // ---- two or four numbers behind one another per lane, and the lanes behind one another ---------------------------------------------

  template <int N> RVE_INLINE void load_numbers(const float *from, Pack<float, N> (&x)[2])
  {
    for (int m = 0; m < N / 8; ++m, from += 16) {
      const __m256 a = _mm256_loadu_ps(from), b = _mm256_loadu_ps(from + 8);
      const __m256 outer = _mm256_permute2f128_ps(a, b, 0x20),    // lanes 0, 1 and 4, 5
          inner = _mm256_permute2f128_ps(a, b, 0x31);
      x[0].part[m] = _mm256_shuffle_ps(outer, inner, _MM_SHUFFLE(2, 0, 2, 0));
      x[1].part[m] = _mm256_shuffle_ps(outer, inner, _MM_SHUFFLE(3, 1, 3, 1));
    }
  }

  template <int N> RVE_INLINE void store_numbers(const Pack<float, N> (&x)[2], float *to)
  {
    for (int m = 0; m < N / 8; ++m, to += 16) {
      const __m256 outer = _mm256_unpacklo_ps(x[0].part[m], x[1].part[m]),    // lanes 0, 1 and 4, 5
          inner = _mm256_unpackhi_ps(x[0].part[m], x[1].part[m]);
      _mm256_storeu_ps(to, _mm256_permute2f128_ps(outer, inner, 0x20));
      _mm256_storeu_ps(to + 8, _mm256_permute2f128_ps(outer, inner, 0x31));
    }
  }

  template <int N> RVE_INLINE void load_numbers(const double *from, Pack<double, N> (&x)[2])
  {
    for (int m = 0; m < N / 4; ++m, from += 8) {
      const __m256d a = _mm256_loadu_pd(from), b = _mm256_loadu_pd(from + 4);
      const __m256d even = _mm256_permute2f128_pd(a, b, 0x20),    // lanes 0 and 2
          odd = _mm256_permute2f128_pd(a, b, 0x31);
      x[0].part[m] = _mm256_unpacklo_pd(even, odd);
      x[1].part[m] = _mm256_unpackhi_pd(even, odd);
    }
  }

  template <int N> RVE_INLINE void store_numbers(const Pack<double, N> (&x)[2], double *to)
  {
    for (int m = 0; m < N / 4; ++m, to += 8) {
      const __m256d even = _mm256_unpacklo_pd(x[0].part[m], x[1].part[m]),    // lanes 0 and 2
          odd = _mm256_unpackhi_pd(x[0].part[m], x[1].part[m]);
      _mm256_storeu_pd(to, _mm256_permute2f128_pd(even, odd, 0x20));
      _mm256_storeu_pd(to + 4, _mm256_permute2f128_pd(even, odd, 0x31));
    }
  }

  /// Four rows and four columns of each half.
  RVE_INLINE void transpose(__m256 (&x)[4])
  {
    const __m256 a = _mm256_unpacklo_ps(x[0], x[1]), b = _mm256_unpacklo_ps(x[2], x[3]),
                 c = _mm256_unpackhi_ps(x[0], x[1]), d = _mm256_unpackhi_ps(x[2], x[3]);
    x[0] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 1, 0));
    x[1] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 2, 3, 2));
    x[2] = _mm256_shuffle_ps(c, d, _MM_SHUFFLE(1, 0, 1, 0));
    x[3] = _mm256_shuffle_ps(c, d, _MM_SHUFFLE(3, 2, 3, 2));
  }
  RVE_INLINE void transpose(__m256d (&x)[4])
  {
    const __m256d a = _mm256_unpacklo_pd(x[0], x[1]), b = _mm256_unpackhi_pd(x[0], x[1]),
                  c = _mm256_unpacklo_pd(x[2], x[3]), d = _mm256_unpackhi_pd(x[2], x[3]);
    x[0] = _mm256_permute2f128_pd(a, c, 0x20);
    x[1] = _mm256_permute2f128_pd(b, d, 0x20);
    x[2] = _mm256_permute2f128_pd(a, c, 0x31);
    x[3] = _mm256_permute2f128_pd(b, d, 0x31);
  }

  template <int N> RVE_INLINE void load_numbers(const float *from, Pack<float, N> (&x)[4])
  {
    for (int m = 0; m < N / 8; ++m, from += 32) {
      __m256 rows[4];    // lanes k and k + 4
      for (int k = 0; k < 4; ++k)
        rows[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(from + 4 * k)),
                                       _mm_loadu_ps(from + 4 * k + 16), 1);
      transpose(rows);
      for (int c = 0; c < 4; ++c) x[c].part[m] = rows[c];
    }
  }

  template <int N> RVE_INLINE void store_numbers(const Pack<float, N> (&x)[4], float *to)
  {
    for (int m = 0; m < N / 8; ++m, to += 32) {
      __m256 rows[4] = {x[0].part[m], x[1].part[m], x[2].part[m], x[3].part[m]};
      transpose(rows);
      for (int k = 0; k < 4; ++k) {
        _mm_storeu_ps(to + 4 * k, _mm256_castps256_ps128(rows[k]));
        _mm_storeu_ps(to + 4 * k + 16, _mm256_extractf128_ps(rows[k], 1));
      }
    }
  }

  template <int N> RVE_INLINE void load_numbers(const double *from, Pack<double, N> (&x)[4])
  {
    for (int m = 0; m < N / 4; ++m, from += 16) {
      __m256d rows[4];
      for (int k = 0; k < 4; ++k) rows[k] = _mm256_loadu_pd(from + 4 * k);
      transpose(rows);
      for (int c = 0; c < 4; ++c) x[c].part[m] = rows[c];
    }
  }

  template <int N> RVE_INLINE void store_numbers(const Pack<double, N> (&x)[4], double *to)
  {
    for (int m = 0; m < N / 4; ++m, to += 16) {
      __m256d rows[4] = {x[0].part[m], x[1].part[m], x[2].part[m], x[3].part[m]};
      transpose(rows);
      for (int k = 0; k < 4; ++k) _mm256_storeu_pd(to + 4 * k, rows[k]);
    }
  }

  /// Any other number of them.
  template <class T, int N, int K> RVE_INLINE void load_numbers(const T *from, Pack<T, N> (&x)[K])
  {
    T numbers[K][N];
    for (int lane = 0; lane < N; ++lane)
      for (int c = 0; c < K; ++c) numbers[c][lane] = from[lane * K + c];
    for (int c = 0; c < K; ++c) x[c] = Pack<T, N>::load(numbers[c]);
  }

  template <class T, int N, int K> RVE_INLINE void store_numbers(const Pack<T, N> (&x)[K], T *to)
  {
    T numbers[K][N];
    for (int c = 0; c < K; ++c) x[c].store(numbers[c]);
    for (int lane = 0; lane < N; ++lane)
      for (int c = 0; c < K; ++c) to[lane * K + c] = numbers[c][lane];
  }

  // ---- records of K numbers, as records of K packs ----------------------------------------------------------------------------------

  /// Record: a P, a pack, or a struct of them. `single` has the records of the lanes, each of numbers of one type.
  template <class Record, class P, class Single>
  RVE_INLINE Record load_records(const Single *single)
  {
    if constexpr (std::is_same_v<Record, P>) {
      return P::load(single);
    } else if constexpr (std::is_same_v<Record, Vec<P, 3>>) {
      Record record;
      load_triples(&(*single)[0], record);
      return record;
    } else {
      using T = typename P::Number;
      constexpr int K = sizeof(Single) / sizeof(T);
      static_assert(sizeof(Single) == K * sizeof(T) && sizeof(Record) == K * sizeof(P),
                    "the same numbers in both");
      P packs[K];
      load_numbers(reinterpret_cast<const T *>(single), packs);
      Record record;
      std::memcpy(&record, packs, sizeof(record));
      return record;
    }
  }

  template <class P, class Record, class Single>
  RVE_INLINE void store_records(const Record &record, Single *single)
  {
    if constexpr (std::is_same_v<Record, P>) {
      record.store(single);
    } else if constexpr (std::is_same_v<Record, Vec<P, 3>>) {
      store_triples(record, &(*single)[0]);
    } else {
      using T = typename P::Number;
      constexpr int K = sizeof(Single) / sizeof(T);
      static_assert(sizeof(Single) == K * sizeof(T) && sizeof(Record) == K * sizeof(P),
                    "the same numbers in both");
      P packs[K];
      std::memcpy(packs, &record, sizeof(record));
      store_numbers(packs, reinterpret_cast<T *>(single));
    }
  }

  template <class T, int N, int D>
  RVE_INLINE Vec<Pack<T, N>, D> where(const PackTruth<T, N> &condition, const Vec<Pack<T, N>, D> &x)
  {
    Vec<Pack<T, N>, D> result;
    for (int a = 0; a < D; ++a) result[a] = where(condition, x[a]);
    return result;
  }

  /// Each number of the record where the condition holds, zero elsewhere.
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

  // ---- from one type of numbers to another ----------------------------------------------------------------------------------------

  template <class T, int N> RVE_INLINE void convert(const Pack<T, N> &x, Pack<T, N> &y)
  {
    y = x;
  }

  template <int N>
  RVE_INLINE void convert(const Pack<std::uint32_t, N> &x, Pack<std::int32_t, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) y.part[m] = x.part[m];
  }
  template <int N>
  RVE_INLINE void convert(const Pack<std::int32_t, N> &x, Pack<std::uint32_t, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) y.part[m] = x.part[m];
  }
  template <int N>
  RVE_INLINE void convert(const Pack<std::uint64_t, N> &x, Pack<std::int64_t, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) y.part[m] = x.part[m];
  }
  template <int N>
  RVE_INLINE void convert(const Pack<std::int64_t, N> &x, Pack<std::uint64_t, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) y.part[m] = x.part[m];
  }

  template <int N> RVE_INLINE void convert(const Pack<std::int32_t, N> &x, Pack<float, N> &y)
  {
    for (int m = 0; m < x.num_registers; ++m) y.part[m] = _mm256_cvtepi32_ps(x.part[m]);
  }

  /// Without an instruction for it in AVX2: the leading 16 bits as a double, exact, plus the other 48 as another, one rounding.
  /// Each is made by its place in the mantissa of a large number: 3 2^67, whose last place is 2^16, and 2^52.
  template <int N> RVE_INLINE void convert(const Pack<std::int64_t, N> &x, Pack<double, N> &y)
  {
    const __m256d large = _mm256_set1_pd(442721857769029238784.0);    // 3 2^67
    const __m256d both = _mm256_set1_pd(442726361368656609280.0);     // 3 2^67 + 2^52
    const __m256d small = _mm256_set1_pd(4503599627370496.0);         // 2^52
    for (int m = 0; m < x.num_registers; ++m) {
      __m256i high = _mm256_srai_epi32(x.part[m], 16);
      high = _mm256_blend_epi16(high, _mm256_setzero_si256(), 0x33);
      high = _mm256_add_epi64(high, _mm256_castpd_si256(large));
      const __m256i low = _mm256_blend_epi16(x.part[m], _mm256_castpd_si256(small), 0x88);
      y.part[m] =
          _mm256_add_pd(_mm256_sub_pd(_mm256_castsi256_pd(high), both), _mm256_castsi256_pd(low));
    }
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

  /// The same truths for numbers of another width.
  template <class T, int N>
  RVE_INLINE void convert_truth(const PackTruth<T, N> &x, PackTruth<T, N> &y)
  {
    y = x;
  }
  template <int N>
  RVE_INLINE void convert_truth(const PackTruth<float, N> &x, PackTruth<double, N> &y)
  {
    for (int m = 0; m < x.lanes.num_registers; ++m) {
      const __m256i truth = _mm256_castps_si256(x.lanes.part[m]);
      y.lanes.part[2 * m] =
          _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_castsi256_si128(truth)));
      y.lanes.part[2 * m + 1] =
          _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_extracti128_si256(truth, 1)));
    }
  }

  // ---- rounding to integers, as round_to of each number ---------------------------------------------------------------------------

  template <int N> RVE_INLINE void round_to(const Pack<float, N> &x, Pack<std::int32_t, N> &q)
  {
    for (int m = 0; m < x.num_registers; ++m) q.part[m] = _mm256_cvtps_epi32(x.part[m]);
  }

  /// Numbers below 2^51 by their place in the mantissa of 3 2^51, larger ones and NaN one by one.
  template <int N> RVE_INLINE void round_to(const Pack<double, N> &x, Pack<std::int64_t, N> &q)
  {
    const __m256d magic = _mm256_set1_pd(6755399441055744.0);    // 3 2^51
    const Pack<double, N> limit(2251799813685248.0);             // 2^51
    if (__builtin_expect(signs(fabs(x) < limit) == (1 << N) - 1, true)) {
      for (int m = 0; m < x.num_registers; ++m)
        q.part[m] = _mm256_sub_epi64(_mm256_castpd_si256(_mm256_add_pd(x.part[m], magic)),
                                     _mm256_castpd_si256(magic));
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
