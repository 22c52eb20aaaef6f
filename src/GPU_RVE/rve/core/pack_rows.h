// SPDX-License-Identifier: GPL-2.0-only
// Rows of memory to packs and back: a record of four numbers per grain, of which a pack wants the first ones of all its lanes, the second
// ones and so on. `row(lane)` is the address of a record; one of four words of 32 bits is aligned to 16 bytes. For translation units compiled
// for x86-64-v3.

#pragma once

#include "rve/core/pack.h"
#include "rve/core/vec.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Four registers of 8 rows of four words of 32 bits.
  struct FourColumns {
    __m256 column[4];

    template <class Row> RVE_INLINE void load(const Row &row)
    {
      for (int lane = 0; lane < 4; ++lane)
        column[lane] = _mm256_insertf128_ps(
            _mm256_castps128_ps256(_mm_loadu_ps(reinterpret_cast<const float *>(row(lane)))),
            _mm_loadu_ps(reinterpret_cast<const float *>(row(lane + 4))), 1);
      transpose(column);
    }

    template <class Row> RVE_INLINE void store(const Row &row) const
    {
      __m256 pair[4] = {column[0], column[1], column[2], column[3]};
      transpose(pair);
      for (int lane = 0; lane < 4; ++lane) {
        _mm_store_ps(reinterpret_cast<float *>(row(lane)), _mm256_castps256_ps128(pair[lane]));
        _mm_store_ps(reinterpret_cast<float *>(row(lane + 4)),
                     _mm256_extractf128_ps(pair[lane], 1));
      }
    }
  };

  /// Two registers of 4 rows with two words of 64 bits, after `offset` of them.
  struct TwoColumns {
    __m256d first, second;

    template <class Row> RVE_INLINE void load(const Row &row, int offset)
    {
      const auto words = [&](int lane) {
        return _mm_loadu_pd(reinterpret_cast<const double *>(row(lane)) + offset);
      };
      const __m256d even = _mm256_insertf128_pd(_mm256_castpd128_pd256(words(0)), words(2), 1);
      const __m256d odd = _mm256_insertf128_pd(_mm256_castpd128_pd256(words(1)), words(3), 1);
      first = _mm256_unpacklo_pd(even, odd);
      second = _mm256_unpackhi_pd(even, odd);
    }

    template <class Row> RVE_INLINE void store(const Row &row, int offset) const
    {
      const __m256d even = _mm256_unpacklo_pd(first, second);
      const __m256d odd = _mm256_unpackhi_pd(first, second);
      const auto put = [&](int lane, __m128d words) {
        _mm_storeu_pd(reinterpret_cast<double *>(row(lane)) + offset, words);
      };
      put(0, _mm256_castpd256_pd128(even));
      put(1, _mm256_castpd256_pd128(odd));
      put(2, _mm256_extractf128_pd(even, 1));
      put(3, _mm256_extractf128_pd(odd, 1));
    }
  };

  /// The addresses of four rows, from lane `first` on.
  template <class Row> RVE_INLINE auto rows_from(const Row &row, int first)
  {
    return [&row, first](int lane) { return row(first + lane); };
  }

  template <int N, class Row>
  RVE_INLINE void load_words(const Row &row, Vec<Pack<std::uint64_t, N>, 2> &words)
  {
    for (int m = 0; m < N / 4; ++m) {
      TwoColumns columns;
      columns.load(rows_from(row, 4 * m), 0);
      words[0].part[m] = _mm256_castpd_si256(columns.first);
      words[1].part[m] = _mm256_castpd_si256(columns.second);
    }
  }

  template <int N, class Row>
  RVE_INLINE void store_words(const Row &row, const Vec<Pack<std::uint64_t, N>, 2> &words)
  {
    for (int m = 0; m < N / 4; ++m)
      TwoColumns{_mm256_castsi256_pd(words[0].part[m]), _mm256_castsi256_pd(words[1].part[m])}
          .store(rows_from(row, 4 * m), 0);
  }

  // ---- load_row and store_row: two integers and two floating-point numbers, as the record has them ----------------------------------

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<std::uint32_t, 8>, 2> &first,
                           Vec<Pack<float, 8>, 2> &second)
  {
    FourColumns columns;
    columns.load(row);
    for (int a = 0; a < 2; ++a) {
      first[a].part[0] = _mm256_castps_si256(columns.column[a]);
      second[a].part[0] = columns.column[2 + a];
    }
  }

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<float, 8>, 2> &first,
                           Vec<Pack<std::uint32_t, 8>, 2> &second)
  {
    FourColumns columns;
    columns.load(row);
    for (int a = 0; a < 2; ++a) {
      first[a].part[0] = columns.column[a];
      second[a].part[0] = _mm256_castps_si256(columns.column[2 + a]);
    }
  }

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<std::uint64_t, 8>, 2> &first,
                           Vec<Pack<float, 8>, 2> &second)
  {
    load_words(row, first);
    const auto two_rows = [&](int lane) {
      const auto at = [&](int k) { return reinterpret_cast<const __m64 *>(row(k)) + 2; };
      return _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), at(lane)), at(lane + 1));
    };
    const auto four_rows = [&](int lane) {
      return _mm256_insertf128_ps(_mm256_castps128_ps256(two_rows(lane)), two_rows(lane + 4), 1);
    };
    const __m256 a = four_rows(0), b = four_rows(2);
    second[0].part[0] = _mm256_shuffle_ps(a, b, 0x88);
    second[1].part[0] = _mm256_shuffle_ps(a, b, 0xdd);
  }

  template <int N, class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<std::uint64_t, N>, 2> &first,
                           Vec<Pack<double, N>, 2> &second)
  {
    load_words(row, first);
    for (int m = 0; m < N / 4; ++m) {
      TwoColumns columns;
      columns.load(rows_from(row, 4 * m), 2);
      second[0].part[m] = columns.first;
      second[1].part[m] = columns.second;
    }
  }

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<double, 8>, 2> &first,
                           Vec<Pack<std::uint32_t, 8>, 2> &second)
  {
    for (int m = 0; m < 2; ++m) {
      TwoColumns columns;
      columns.load(rows_from(row, 4 * m), 0);
      first[0].part[m] = columns.first;
      first[1].part[m] = columns.second;
    }
    std::uint32_t words[2][8];
    for (int lane = 0; lane < 8; ++lane)
      for (int a = 0; a < 2; ++a)
        words[a][lane] = reinterpret_cast<const std::uint32_t *>(row(lane))[4 + a];
    for (int a = 0; a < 2; ++a) second[a] = Pack<std::uint32_t, 8>::load(words[a]);
  }

  template <class Row>
  RVE_INLINE void store_row(const Row &row, const Vec<Pack<std::uint32_t, 8>, 2> &first,
                            const Vec<Pack<float, 8>, 2> &second)
  {
    FourColumns{{_mm256_castsi256_ps(first[0].part[0]), _mm256_castsi256_ps(first[1].part[0]),
                 second[0].part[0], second[1].part[0]}}
        .store(row);
  }

  template <class Row>
  RVE_INLINE void store_row(const Row &row, const Vec<Pack<std::uint64_t, 8>, 2> &first,
                            const Vec<Pack<float, 8>, 2> &second)
  {
    store_words(row, first);
    const __m256 x = second[0].part[0], y = second[1].part[0];
    const auto put = [&](int lane, __m128 two) {
      const auto at = [&](int k) { return reinterpret_cast<__m64 *>(row(k)) + 2; };
      _mm_storel_pi(at(lane), two);
      _mm_storeh_pi(at(lane + 1), two);
    };
    const __m256 a = _mm256_unpacklo_ps(x, y), b = _mm256_unpackhi_ps(x, y);
    put(0, _mm256_castps256_ps128(a));
    put(2, _mm256_castps256_ps128(b));
    put(4, _mm256_extractf128_ps(a, 1));
    put(6, _mm256_extractf128_ps(b, 1));
  }

  template <int N, class Row>
  RVE_INLINE void store_row(const Row &row, const Vec<Pack<std::uint64_t, N>, 2> &first,
                            const Vec<Pack<double, N>, 2> &second)
  {
    store_words(row, first);
    for (int m = 0; m < N / 4; ++m)
      TwoColumns{second[0].part[m], second[1].part[m]}.store(rows_from(row, 4 * m), 2);
  }

  // ---- rows of four integers, of which three count -----------------------------------------------------------------------------------

  RVE_INLINE void add_words(std::int32_t *row, __m128i x)
  {
    auto *sum = reinterpret_cast<__m128i *>(row);
    _mm_store_si128(sum, _mm_add_epi32(_mm_load_si128(sum), x));
  }

  RVE_INLINE void add_words(std::int64_t *row, __m256i x)
  {
    auto *sum = reinterpret_cast<__m256i *>(row);
    _mm256_store_si256(sum, _mm256_add_epi64(_mm256_load_si256(sum), x));
  }

  /// Adds the three numbers of each lane to its row, one lane after the other: rows may be the same.
  template <class Row>
  RVE_INLINE void add_to_row(const Row &row, const Vec<Pack<std::int32_t, 8>, 3> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    const __m256i a = _mm256_unpacklo_epi32(x[0].part[0], x[1].part[0]);
    const __m256i b = _mm256_unpackhi_epi32(x[0].part[0], x[1].part[0]);
    const __m256i c = _mm256_unpacklo_epi32(x[2].part[0], zero);
    const __m256i d = _mm256_unpackhi_epi32(x[2].part[0], zero);
    const __m256i pair[4] = {_mm256_unpacklo_epi64(a, c), _mm256_unpackhi_epi64(a, c),
                             _mm256_unpacklo_epi64(b, d), _mm256_unpackhi_epi64(b, d)};
    for (int lane = 0; lane < 4; ++lane) {
      add_words(row(lane), _mm256_castsi256_si128(pair[lane]));
      add_words(row(lane + 4), _mm256_extracti128_si256(pair[lane], 1));
    }
  }

  template <int N, class Row>
  RVE_INLINE void add_to_row(const Row &row, const Vec<Pack<std::int64_t, N>, 3> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    for (int m = 0; m < N / 4; ++m) {
      const __m256i a = _mm256_unpacklo_epi64(x[0].part[m], x[1].part[m]);
      const __m256i b = _mm256_unpackhi_epi64(x[0].part[m], x[1].part[m]);
      const __m256i c = _mm256_unpacklo_epi64(x[2].part[m], zero);
      const __m256i d = _mm256_unpackhi_epi64(x[2].part[m], zero);
      add_words(row(4 * m), _mm256_permute2x128_si256(a, c, 0x20));
      add_words(row(4 * m + 1), _mm256_permute2x128_si256(b, d, 0x20));
      add_words(row(4 * m + 2), _mm256_permute2x128_si256(a, c, 0x31));
      add_words(row(4 * m + 3), _mm256_permute2x128_si256(b, d, 0x31));
    }
  }

  /// Takes 8 rows that lie behind one another, and leaves zeros.
  RVE_INLINE void take_rows(std::int32_t *rows, Vec<Pack<std::int32_t, 8>, 3> &sum)
  {
    FourColumns columns;
    columns.load([&](int lane) { return rows + 4 * lane; });
    for (int c = 0; c < 3; ++c) sum[c].part[0] = _mm256_castps_si256(columns.column[c]);
    for (int k = 0; k < 32; k += 8)
      _mm256_storeu_si256(reinterpret_cast<__m256i *>(rows + k), _mm256_setzero_si256());
  }

  RVE_INLINE void take_rows(std::int64_t *rows, Vec<Pack<std::int64_t, 8>, 3> &sum)
  {
    for (int m = 0; m < 2; ++m) {
      const auto row = [&](int lane) { return rows + 4 * (4 * m + lane); };
      TwoColumns xy, torque;
      xy.load(row, 0);
      torque.load(row, 2);
      sum[0].part[m] = _mm256_castpd_si256(xy.first);
      sum[1].part[m] = _mm256_castpd_si256(xy.second);
      sum[2].part[m] = _mm256_castpd_si256(torque.first);
    }
    for (int k = 0; k < 32; k += 4)
      _mm256_storeu_si256(reinterpret_cast<__m256i *>(rows + k), _mm256_setzero_si256());
  }

  /// Adds the integers of 8 grains to the sum and leaves zeros.
  template <class Integer> RVE_INLINE void take_numbers(Integer *array, Pack<Integer, 8> &sum)
  {
    sum = sum + Pack<Integer, 8>::load(array);
    Pack<Integer, 8>(Integer(0)).store(array);
  }

  // ---- vectors in space: three words of each lane, at any address -----------------------------------------------------------------------

  /// The addresses that lie `bytes` behind those of the lanes.
  template <class Row> RVE_INLINE auto behind(const Row &row, int bytes)
  {
    return [&row, bytes](int lane) { return reinterpret_cast<const char *>(row(lane)) + bytes; };
  }

  RVE_INLINE void take_column(__m256 column, __m256 &part)
  {
    part = column;
  }
  RVE_INLINE void take_column(__m256 column, __m256i &part)
  {
    part = _mm256_castps_si256(column);
  }
  RVE_INLINE void take_column(__m256d column, __m256d &part)
  {
    part = column;
  }
  RVE_INLINE void take_column(__m256d column, __m256i &part)
  {
    part = _mm256_castpd_si256(column);
  }

  /// The words x[Begin], x[Begin + 1], ... of four words of 32 bits per lane. All four are read.
  template <int Begin, class T, int K, class Row>
  RVE_INLINE void load_four(const Row &row, Vec<Pack<T, 8>, K> &x)
  {
    FourColumns columns;
    columns.load(row);
    for (int a = Begin; a < K; ++a) take_column(columns.column[a], x[a].part[0]);
  }

  template <class T, int N, class Row>
  RVE_INLINE void load_three(const Row &row, Vec<Pack<T, N>, 3> &x)
  {
    if constexpr (sizeof(T) == 4) {
      load_four<0>(row, x);
    } else {
      for (int m = 0; m < N / 4; ++m) {
        const auto four = rows_from(row, 4 * m);
        TwoColumns front, back;
        front.load(four, 0);
        back.load(four, 1);
        take_column(front.first, x[0].part[m]);
        take_column(front.second, x[1].part[m]);
        take_column(back.second, x[2].part[m]);
      }
    }
  }

  /// Records of two vectors, and of two numbers and a vector.
  template <class T, class U, int N, class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<T, N>, 3> &first, Vec<Pack<U, N>, 3> &second)
  {
    load_three(row, first);
    load_three(behind(row, 3 * sizeof(T)), second);
  }

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<float, 8>, 2> &first,
                           Vec<Pack<std::uint32_t, 8>, 3> &second)
  {
    load_four<0>(row, first);
    load_three(behind(row, 2 * sizeof(float)), second);
  }

  template <class Row>
  RVE_INLINE void load_row(const Row &row, Vec<Pack<double, 8>, 2> &first,
                           Vec<Pack<std::uint32_t, 8>, 3> &second)
  {
    for (int m = 0; m < 2; ++m) {
      TwoColumns columns;
      columns.load(rows_from(row, 4 * m), 0);
      first[0].part[m] = columns.first;
      first[1].part[m] = columns.second;
    }
    load_three(behind(row, 2 * sizeof(double)), second);
  }

  /// Columns of 8 rows of 8 words of 32 bits, or rows of columns.
  RVE_INLINE void transpose(__m256i (&x)[8])
  {
    __m256i pair[8], quad[8];
    for (int k = 0; k < 8; k += 2) {
      pair[k] = _mm256_unpacklo_epi32(x[k], x[k + 1]);
      pair[k + 1] = _mm256_unpackhi_epi32(x[k], x[k + 1]);
    }
    for (int k = 0; k < 8; k += 4)
      for (int m = 0; m < 2; ++m) {
        quad[k + 2 * m] = _mm256_unpacklo_epi64(pair[k + m], pair[k + 2 + m]);
        quad[k + 2 * m + 1] = _mm256_unpackhi_epi64(pair[k + m], pair[k + 2 + m]);
      }
    for (int k = 0; k < 4; ++k) {
      x[k] = _mm256_permute2x128_si256(quad[k], quad[k + 4], 0x20);
      x[k + 4] = _mm256_permute2x128_si256(quad[k], quad[k + 4], 0x31);
    }
  }

  /// Columns of 4 rows of 4 words of 64 bits.
  RVE_INLINE void transpose(__m256i (&x)[4])
  {
    const __m256i a = _mm256_unpacklo_epi64(x[0], x[1]), b = _mm256_unpackhi_epi64(x[0], x[1]),
                  c = _mm256_unpacklo_epi64(x[2], x[3]), d = _mm256_unpackhi_epi64(x[2], x[3]);
    x[0] = _mm256_permute2x128_si256(a, c, 0x20);
    x[1] = _mm256_permute2x128_si256(b, d, 0x20);
    x[2] = _mm256_permute2x128_si256(a, c, 0x31);
    x[3] = _mm256_permute2x128_si256(b, d, 0x31);
  }

  template <class T, int N, class Row>
  RVE_INLINE void store_three(const Row &row, const Vec<Pack<T, N>, 3> &x)
  {
    if constexpr (sizeof(T) == 4) {
      const auto bits = [&](int a) { return (__m256i) x[a].part[0]; };
      const __m256i zero = _mm256_setzero_si256();
      const __m256i xy[2] = {_mm256_unpacklo_epi32(bits(0), bits(1)),
                             _mm256_unpackhi_epi32(bits(0), bits(1))},
                    z[2] = {_mm256_unpacklo_epi32(bits(2), zero),
                            _mm256_unpackhi_epi32(bits(2), zero)};
      const auto put = [&](int lane, __m128i three) {
        auto *to = const_cast<char *>(reinterpret_cast<const char *>(row(lane)));
        _mm_storel_epi64(reinterpret_cast<__m128i *>(to), three);
        _mm_storeu_si32(to + 8, _mm_unpackhi_epi64(three, three));
      };
      for (int k = 0; k < 2; ++k) {
        const __m256i even = _mm256_unpacklo_epi64(xy[k], z[k]),
                      odd = _mm256_unpackhi_epi64(xy[k], z[k]);
        put(2 * k, _mm256_castsi256_si128(even));
        put(2 * k + 1, _mm256_castsi256_si128(odd));
        put(2 * k + 4, _mm256_extracti128_si256(even, 1));
        put(2 * k + 5, _mm256_extracti128_si256(odd, 1));
      }
    } else {
      for (int m = 0; m < N / 4; ++m) {
        __m256i rows[4] = {(__m256i) x[0].part[m], (__m256i) x[1].part[m], (__m256i) x[2].part[m],
                           _mm256_setzero_si256()};
        transpose(rows);
        for (int lane = 0; lane < 4; ++lane) {
          auto *to = const_cast<char *>(reinterpret_cast<const char *>(row(4 * m + lane)));
          _mm_storeu_si128(reinterpret_cast<__m128i *>(to), _mm256_castsi256_si128(rows[lane]));
          _mm_storel_epi64(reinterpret_cast<__m128i *>(to + 16),
                           _mm256_extracti128_si256(rows[lane], 1));
        }
      }
    }
  }

  template <class T, class U, int N, class Row>
  RVE_INLINE void store_row(const Row &row, const Vec<Pack<T, N>, 3> &first,
                            const Vec<Pack<U, N>, 3> &second)
  {
    store_three(row, first);
    store_three(behind(row, 3 * sizeof(T)), second);
  }

  // ---- rows of eight integers, of which six count: as those of four ------------------------------------------------------------------

  template <class Row>
  RVE_INLINE void add_to_row(const Row &row, const Vec<Pack<std::int32_t, 8>, 6> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    __m256i lanes[8] = {x[0].part[0], x[1].part[0], x[2].part[0], x[3].part[0],
                        x[4].part[0], x[5].part[0], zero,         zero};
    transpose(lanes);
    for (int lane = 0; lane < 8; ++lane) {
      auto *sum = reinterpret_cast<__m256i *>(row(lane));
      _mm256_storeu_si256(sum, _mm256_add_epi32(_mm256_loadu_si256(sum), lanes[lane]));
    }
  }

  template <int N, class Row>
  RVE_INLINE void add_to_row(const Row &row, const Vec<Pack<std::int64_t, N>, 6> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    for (int m = 0; m < N / 4; ++m) {
      __m256i front[4] = {x[0].part[m], x[1].part[m], x[2].part[m], x[3].part[m]},
              back[4] = {x[4].part[m], x[5].part[m], zero, zero};
      transpose(front);
      transpose(back);
      for (int lane = 0; lane < 4; ++lane) {
        std::int64_t *sum = row(4 * m + lane);
        add_words(sum, front[lane]);
        add_words(sum + 4, back[lane]);
      }
    }
  }

  RVE_INLINE void take_rows(std::int32_t *rows, Vec<Pack<std::int32_t, 8>, 6> &sum)
  {
    __m256i lanes[8];
    for (int lane = 0; lane < 8; ++lane) {
      auto *row = reinterpret_cast<__m256i *>(rows + 8 * lane);
      lanes[lane] = _mm256_loadu_si256(row);
      _mm256_storeu_si256(row, _mm256_setzero_si256());
    }
    transpose(lanes);
    for (int c = 0; c < 6; ++c) sum[c].part[0] = lanes[c];
  }

  RVE_INLINE void take_rows(std::int64_t *rows, Vec<Pack<std::int64_t, 8>, 6> &sum)
  {
    for (int m = 0; m < 2; ++m) {
      __m256i front[4], back[4];
      for (int lane = 0; lane < 4; ++lane) {
        auto *row = reinterpret_cast<__m256i *>(rows + 8 * (4 * m + lane));
        front[lane] = _mm256_load_si256(row);
        back[lane] = _mm256_load_si256(row + 1);
        _mm256_store_si256(row, _mm256_setzero_si256());
        _mm256_store_si256(row + 1, _mm256_setzero_si256());
      }
      transpose(front);
      transpose(back);
      for (int c = 0; c < 4; ++c) sum[c].part[m] = front[c];
      for (int c = 0; c < 2; ++c) sum[4 + c].part[m] = back[c];
    }
  }

  // ---- single numbers ---------------------------------------------------------------------------------------------------------------

  template <class T, int N> RVE_INLINE Pack<T, N> gather(const T *array, const std::int32_t *index)
  {
    T number[N];
    for (int lane = 0; lane < N; ++lane) number[lane] = array[index[lane]];
    return Pack<T, N>::load(number);
  }

  /// The leading 32 bits of fractions.
  RVE_INLINE Pack<std::uint32_t, 8> leading_bits(const Pack<std::uint32_t, 8> &s)
  {
    return s;
  }
  RVE_INLINE Pack<std::uint32_t, 8> leading_bits(const Pack<std::uint64_t, 8> &s)
  {
    const __m256 odd =
        _mm256_shuffle_ps(_mm256_castsi256_ps(s.part[0]), _mm256_castsi256_ps(s.part[1]), 0xdd);
    Pack<std::uint32_t, 8> leading;
    leading.part[0] = _mm256_permute4x64_epi64(_mm256_castps_si256(odd), 0xd8);
    return leading;
  }

}    // namespace RVE_ISA
}    // namespace rve
