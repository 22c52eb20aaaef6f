// SPDX-License-Identifier: GPL-2.0-only
// Transposition of rows of memory to packs and back. A row has the numbers of one lane. The first
// pack has the first numbers of all rows, the second pack the second numbers, and so on.
// `row(lane)` returns the address of a row. Only translation units compiled for x86-64-v3 include
// this file.

#pragma once

#include "rve/core/pack.h"
#include "rve/core/vec.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rve {
inline namespace RVE_ISA {

  /// Returns a function like `row` that returns addresses `bytes` bytes higher.
  template <class Row> RVE_INLINE auto behind(const Row &row, std::size_t bytes)
  {
    return [&row, bytes](int lane) { return (char *) row(lane) + bytes; };
  }

  /// Transposes a 4 x 4 matrix; registers of floats hold two such matrices, one in each half.
  RVE_INLINE void transpose(RegisterOf<float> (&x)[4])
  {
    const __m256 a = _mm256_unpacklo_ps(x[0], x[1]), b = _mm256_unpacklo_ps(x[2], x[3]),
                 c = _mm256_unpackhi_ps(x[0], x[1]), d = _mm256_unpackhi_ps(x[2], x[3]);
    x[0] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 1, 0));
    x[1] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 2, 3, 2));
    x[2] = _mm256_shuffle_ps(c, d, _MM_SHUFFLE(1, 0, 1, 0));
    x[3] = _mm256_shuffle_ps(c, d, _MM_SHUFFLE(3, 2, 3, 2));
  }
  RVE_INLINE void transpose(RegisterOf<double> (&x)[4])
  {
    const __m256d a = _mm256_unpacklo_pd(x[0], x[1]), b = _mm256_unpackhi_pd(x[0], x[1]),
                  c = _mm256_unpacklo_pd(x[2], x[3]), d = _mm256_unpackhi_pd(x[2], x[3]);
    x[0] = _mm256_permute2f128_pd(a, c, 0x20);
    x[1] = _mm256_permute2f128_pd(b, d, 0x20);
    x[2] = _mm256_permute2f128_pd(a, c, 0x31);
    x[3] = _mm256_permute2f128_pd(b, d, 0x31);
  }

  /// Transposes register m of the packs x[0], ..., x[3] to rows of four numbers, one row for each
  /// lane of the register. If x has fewer than four packs (`count`), the last numbers of the rows
  /// are zero. rows[k] contains the row of lane k. For 32-bit numbers the upper half of rows[k]
  /// contains the row of lane k + 4.
  template <class T, int N>
  RVE_INLINE void to_rows(const Pack<T, N> *x, int count, int m, RegisterOf<Floating<T>> (&rows)[4])
  {
    using Register = RegisterOf<Floating<T>>;
    for (int c = 0; c < 4; ++c) rows[c] = c < count ? (Register) x[c].part[m] : Register{};
    transpose(rows);
  }

  // ---- two or four numbers of each row ----------------------------------------------------------

  template <class T, int N, class Row> RVE_INLINE void load_pairs(const Row &row, Pack<T, N> *x)
  {
    using Register = RegisterOf<T>;
    if constexpr (sizeof(T) == 8) {
      for (int m = 0; m < N / 4; ++m) {
        const auto two = [&](int lane) { return _mm_loadu_pd((const double *) row(4 * m + lane)); };
        const __m256d even = _mm256_set_m128d(two(2), two(0)),
                      odd = _mm256_set_m128d(two(3), two(1));
        x[0].part[m] = (Register) _mm256_unpacklo_pd(even, odd);
        x[1].part[m] = (Register) _mm256_unpackhi_pd(even, odd);
      }
    } else {
      const auto two_rows = [&](int lane) {
        const __m128 one = _mm_loadl_pi(_mm_setzero_ps(), (const __m64 *) row(lane));
        return _mm_loadh_pi(one, (const __m64 *) row(lane + 1));
      };
      const __m256 a = _mm256_set_m128(two_rows(4), two_rows(0)),
                   b = _mm256_set_m128(two_rows(6), two_rows(2));
      x[0].part[0] = (Register) _mm256_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0));
      x[1].part[0] = (Register) _mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1));
    }
  }

  template <class T, int N, class Row>
  RVE_INLINE void store_pairs(const Row &row, const Pack<T, N> *x)
  {
    if constexpr (sizeof(T) == 8) {
      for (int m = 0; m < N / 4; ++m) {
        const __m256d a = (__m256d) x[0].part[m], b = (__m256d) x[1].part[m];
        const __m256d even = _mm256_unpacklo_pd(a, b), odd = _mm256_unpackhi_pd(a, b);
        const auto put = [&](int lane, __m128d two) {
          _mm_storeu_pd((double *) row(4 * m + lane), two);
        };
        put(0, _mm256_castpd256_pd128(even));
        put(1, _mm256_castpd256_pd128(odd));
        put(2, _mm256_extractf128_pd(even, 1));
        put(3, _mm256_extractf128_pd(odd, 1));
      }
    } else {
      const __m256 x0 = (__m256) x[0].part[0], x1 = (__m256) x[1].part[0];
      const __m256 a = _mm256_unpacklo_ps(x0, x1), b = _mm256_unpackhi_ps(x0, x1);
      const auto put = [&](int lane, __m128 two) {
        _mm_storel_pi((__m64 *) row(lane), two);
        _mm_storeh_pi((__m64 *) row(lane + 1), two);
      };
      put(0, _mm256_castps256_ps128(a));
      put(2, _mm256_castps256_ps128(b));
      put(4, _mm256_extractf128_ps(a, 1));
      put(6, _mm256_extractf128_ps(b, 1));
    }
  }

  /// Loads the first K of four 32-bit numbers per row. The function reads all four.
  template <int K, class T, class Row> RVE_INLINE void load_fours(const Row &row, Pack<T, 8> *x)
  {
    const auto four = [&](int lane) { return _mm_loadu_ps((const float *) row(lane)); };
    RegisterOf<float> columns[4];
    for (int k = 0; k < 4; ++k) columns[k] = _mm256_set_m128(four(k + 4), four(k));
    transpose(columns);
    for (int c = 0; c < K; ++c) x[c].part[0] = (RegisterOf<T>) columns[c];
  }

  /// Stores the first K (3 or 4) of four 32-bit numbers per row.
  template <int K, class T, class Row>
  RVE_INLINE void store_fours(const Row &row, const Pack<T, 8> *x)
  {
    RegisterOf<float> rows[4];
    to_rows(x, K, 0, rows);
    const auto put = [&](int lane, __m128 four) {
      auto *to = (float *) row(lane);
      if constexpr (K == 4) {
        _mm_storeu_ps(to, four);
      } else {
        _mm_storel_pi((__m64 *) to, four);
        _mm_store_ss(to + 2, _mm_movehl_ps(four, four));
      }
    };
    for (int lane = 0; lane < 4; ++lane) {
      put(lane, _mm256_castps256_ps128(rows[lane]));
      put(lane + 4, _mm256_extractf128_ps(rows[lane], 1));
    }
  }

  // ---- rows of K numbers ------------------------------------------------------------------------

  /// Loads K numbers per row, in groups of two or four. An incomplete last group is moved back so
  /// that it overlaps the group before it. Three 32-bit numbers are read as a group of four, so
  /// that the word after each row is read, too.
  template <class T, int N, int K, class Row>
  RVE_INLINE void load_numbers(const Row &row, Vec<Pack<T, N>, K> &x)
  {
    constexpr int count = sizeof(T) == 8 || K == 2 ? 2 : 4;
    for (int k = 0; k < K; k += count) {
      const int first = k + count > K && K > count ? K - count : k;
      if constexpr (count == 2)
        load_pairs(behind(row, first * sizeof(T)), &x[first]);
      else
        load_fours<(K < 4 ? K : 4)>(behind(row, first * sizeof(T)), &x[first]);
    }
  }

  template <class T, int N, int K, class Row>
  RVE_INLINE void store_numbers(const Row &row, const Vec<Pack<T, N>, K> &x)
  {
    constexpr int count = sizeof(T) == 8 || K == 2 ? 2 : 4;
    for (int k = 0; k < K; k += count) {
      const int first = k + count > K && K > count ? K - count : k;
      if constexpr (count == 2)
        store_pairs(behind(row, first * sizeof(T)), &x[first]);
      else
        store_fours<(K < 4 ? K : 4)>(behind(row, first * sizeof(T)), &x[first]);
    }
  }

  /// Loads rows with two numbers of type T followed by two numbers of type U.
  template <class T, class U, int N, class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<T, N>, 2> &first, Vec<Pack<U, N>, 2> &second)
  {
    if constexpr (sizeof(T) == 4 && sizeof(U) == 4) {
      Vec<Pack<T, N>, 4> all;
      load_numbers(row, all);
      for (int a = 0; a < 2; ++a) {
        first[a] = all[a];
        second[a].part[0] = (RegisterOf<U>) all[2 + a].part[0];
      }
    } else {
      load_numbers(row, first);
      load_numbers(behind(row, 2 * sizeof(T)), second);
    }
  }

  template <class T, class U, int N, class Row>
  RVE_INLINE void store_row(const Row &row, const Vec<Pack<T, N>, 2> &first,
                            const Vec<Pack<U, N>, 2> &second)
  {
    if constexpr (sizeof(T) == 4 && sizeof(U) == 4) {
      Vec<Pack<T, N>, 4> all{{first[0], first[1]}};
      for (int a = 0; a < 2; ++a) all[2 + a].part[0] = (RegisterOf<T>) second[a].part[0];
      store_numbers(row, all);
    } else {
      store_numbers(row, first);
      store_numbers(behind(row, 2 * sizeof(T)), second);
    }
  }

  // ---- sums: rows of 4 integers (3 used) or of 8 (6 used) ---------------------------------------

  RVE_INLINE void add_four(std::int32_t *sum, __m128i x)
  {
    auto *four = (__m128i *) sum;
    _mm_store_si128(four, _mm_add_epi32(_mm_load_si128(four), x));
  }
  RVE_INLINE void add_four(std::int64_t *sum, __m256i x)
  {
    auto *four = (__m256i *) sum;
    _mm256_store_si256(four, _mm256_add_epi64(_mm256_load_si256(four), x));
  }

  /// Adds the numbers of each lane to its row. The lanes are processed one after the other, since
  /// several lanes can have the same row.
  template <class T, int N, int K, class Row>
  RVE_INLINE void add_to_row(const Row &row, const Vec<Pack<T, N>, K> &x)
  {
    for (int m = 0; m < Pack<T, N>::num_registers; ++m)
      for (int first = 0; first < K; first += 4) {
        RegisterOf<Floating<T>> rows[4];
        to_rows(&x[first], K - first, m, rows);
        for (int lane = 0; lane < 4; ++lane) {
          const auto numbers = (__m256i) rows[lane];
          if constexpr (sizeof(T) == 4) {
            add_four(row(lane) + first, _mm256_castsi256_si128(numbers));
            add_four(row(lane + 4) + first, _mm256_extracti128_si256(numbers, 1));
          } else {
            add_four(row(4 * m + lane) + first, numbers);
          }
        }
      }
  }

  /// Loads the consecutive rows of N lanes, and sets the rows in memory to zero.
  template <class T, int N, int K> RVE_INLINE void take_rows(T *rows, Vec<Pack<T, N>, K> &sum)
  {
    constexpr int length = K <= 4 ? 4 : 8;
    load_numbers([&](int lane) { return rows + length * lane; }, sum);
    for (int k = 0; k < length; ++k) Pack<T, N>(T(0)).store(rows + N * k);
  }

  /// Adds the integers of N grains in `array` to `sum`, and sets them in `array` to zero.
  template <class T, int N> RVE_INLINE void take_numbers(T *array, Pack<T, N> &sum)
  {
    sum = wrapping_sum(sum, Pack<T, N>::load(array));
    Pack<T, N>(T(0)).store(array);
  }

  // ---- consecutive structs ----------------------------------------------------------------------

  /// Loads three floats per lane, from consecutive structs of three floats.
  RVE_INLINE void load_triples(const float *from, Vec<Pack<float, 8>, 3> &x)
  {
    const auto two = [&](int k) {
      return _mm256_set_m128(_mm_loadu_ps(from + k + 12), _mm_loadu_ps(from + k));
    };
    const __m256 front = two(0), middle = two(4), back = two(8);
    const __m256 xy = _mm256_shuffle_ps(middle, back, _MM_SHUFFLE(2, 1, 3, 2)),
                 yz = _mm256_shuffle_ps(front, middle, _MM_SHUFFLE(1, 0, 2, 1));
    x[0].part[0] = _mm256_shuffle_ps(front, xy, _MM_SHUFFLE(2, 0, 3, 0));
    x[1].part[0] = _mm256_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0));
    x[2].part[0] = _mm256_shuffle_ps(yz, back, _MM_SHUFFLE(3, 0, 3, 1));
  }

  RVE_INLINE void store_triples(const Vec<Pack<float, 8>, 3> &x, float *to)
  {
    const __m256 a = x[0].part[0], b = x[1].part[0], c = x[2].part[0];
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

  /// Loads a struct of packs from `single`, an array with one struct of numbers for each lane.
  /// Record has K packs of type P, and Single has K numbers, all of the same type. If K is 1,
  /// Record can be a pack and Single a number.
  template <class Record, class P, class Single>
  RVE_INLINE Record load_records(const Single *single)
  {
    using T = typename P::Number;
    constexpr int K = sizeof(Single) / sizeof(T);
    static_assert(sizeof(Single) == K * sizeof(T) && sizeof(Record) == K * sizeof(P),
                  "the same numbers in both");
    const auto *numbers = reinterpret_cast<const T *>(single);
    Vec<P, K> packs;
    if constexpr (K == 1)
      packs[0] = P::load(numbers);
    else if constexpr (K == 3 && sizeof(T) == 4)
      load_triples(numbers, packs);
    else
      load_numbers([&](int lane) { return numbers + K * lane; }, packs);
    Record record;
    std::memcpy(&record, &packs, sizeof(record));
    return record;
  }

  template <class P, class Record, class Single>
  RVE_INLINE void store_records(const Record &record, Single *single)
  {
    using T = typename P::Number;
    constexpr int K = sizeof(Single) / sizeof(T);
    static_assert(sizeof(Single) == K * sizeof(T) && sizeof(Record) == K * sizeof(P),
                  "the same numbers in both");
    auto *numbers = reinterpret_cast<T *>(single);
    Vec<P, K> packs;
    std::memcpy(&packs, &record, sizeof(record));
    if constexpr (K == 1)
      packs[0].store(numbers);
    else if constexpr (K == 3 && sizeof(T) == 4)
      store_triples(packs, numbers);
    else
      store_numbers([&](int lane) { return numbers + K * lane; }, packs);
  }

  // ---- single numbers ---------------------------------------------------------------------------

  template <class T, int N> RVE_INLINE Pack<T, N> gather(const T *array, const std::int32_t *index)
  {
    T number[N];
    for (int lane = 0; lane < N; ++lane) number[lane] = array[index[lane]];
    return Pack<T, N>::load(number);
  }

  /// Returns the leading 32 bits of fractions.
  RVE_INLINE Pack<std::uint32_t, 8> leading_bits(const Pack<std::uint32_t, 8> &s)
  {
    return s;
  }
  RVE_INLINE Pack<std::uint32_t, 8> leading_bits(const Pack<std::uint64_t, 8> &s)
  {
    const __m256i odd = (__m256i) _mm256_shuffle_ps((__m256) s.part[0], (__m256) s.part[1],
                                                    _MM_SHUFFLE(3, 1, 3, 1));
    Pack<std::uint32_t, 8> leading;
    leading.part[0] = (RegisterOf<std::uint32_t>) _mm256_permute4x64_epi64(odd, 0xd8);
    return leading;
  }

}    // namespace RVE_ISA
}    // namespace rve
