// The phases of a step for packs of grains on a CPU with AVX2 (BlockSimd): the bits of the texts for one
// grain, whose formulas they share. For plain scenes.

#ifndef RVE_ALGORITHM_PACKED_GRAINS_H
#define RVE_ALGORITHM_PACKED_GRAINS_H

#include "rve/algorithm/contact_forces.h"
#include "rve/core/pack.h"
#include "rve/core/pack_item.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

  /// Grains that BlockSimd hands out at a time.
  constexpr int kPackedGrains = 8;

  /// A number format for N grains at once.
  template <class Numbers, int N> struct PackNumbers {
    using Coordinate = Pack<typename Numbers::Coordinate, N>;
    using SignedCoordinate = Pack<typename Numbers::SignedCoordinate, N>;
    using Wide = Pack<typename Numbers::Wide, N>;
    using Spring = Pack<typename Numbers::Spring, N>;
    using Real = Pack<typename Numbers::Real, N>;
    using Sum = Pack<typename Numbers::Sum, N>;
  };
  template <class Scene, int N>
  using PackScene = typename Scene::template In<PackNumbers<typename Scene::Numbers, N>>;

  template <class Numbers, int N> struct Motion<PackNumbers<Numbers, N>> {
    Vec<Pack<typename Numbers::Coordinate, N>, 2> position;
    Vec<Pack<typename Numbers::Real, N>, 2> velocity;
  };

  /// Still of 8 grains.
  template <class Numbers> struct PackedStill {
    Pack<typename Numbers::Real, 8> velocity_unit, spin_unit;
    Vec<Pack<std::uint32_t, 8>, 2> list_position;
  };

  // ---- rows of memory to packs and back: row(lane) is an address ----------------------------------------------------------------

  /// 8 rows of 4 words of 32 bits as 4 packs.
  template <class Row> RVE_INLINE void load_rows(const Row &row, __m256 (&column)[4])
  {
    __m256 pair[4];
    for (int lane = 0; lane < 4; ++lane)
      pair[lane] = _mm256_insertf128_ps(
          _mm256_castps128_ps256(_mm_load_ps(reinterpret_cast<const float *>(row(lane)))),
          _mm_load_ps(reinterpret_cast<const float *>(row(lane + 4))), 1);
    const __m256 a = _mm256_unpacklo_ps(pair[0], pair[1]), b = _mm256_unpacklo_ps(pair[2], pair[3]);
    const __m256 c = _mm256_unpackhi_ps(pair[0], pair[1]), d = _mm256_unpackhi_ps(pair[2], pair[3]);
    column[0] = _mm256_shuffle_ps(a, b, 0x44);
    column[1] = _mm256_shuffle_ps(a, b, 0xee);
    column[2] = _mm256_shuffle_ps(c, d, 0x44);
    column[3] = _mm256_shuffle_ps(c, d, 0xee);
  }

  template <class Row> RVE_INLINE void store_rows(const Row &row, const __m256 (&column)[4])
  {
    const __m256 a = _mm256_unpacklo_ps(column[0], column[1]);
    const __m256 b = _mm256_unpackhi_ps(column[0], column[1]);
    const __m256 c = _mm256_unpacklo_ps(column[2], column[3]);
    const __m256 d = _mm256_unpackhi_ps(column[2], column[3]);
    const __m256 pair[4] = {_mm256_shuffle_ps(a, c, 0x44), _mm256_shuffle_ps(a, c, 0xee),
                            _mm256_shuffle_ps(b, d, 0x44), _mm256_shuffle_ps(b, d, 0xee)};
    for (int lane = 0; lane < 4; ++lane) {
      _mm_store_ps(reinterpret_cast<float *>(row(lane)), _mm256_castps256_ps128(pair[lane]));
      _mm_store_ps(reinterpret_cast<float *>(row(lane + 4)), _mm256_extractf128_ps(pair[lane], 1));
    }
  }

  /// 4 rows whose 2 words of 64 bits at `offset` become 2 registers.
  template <class Row>
  RVE_INLINE void load_pairs_of_words(const Row &row, int offset, __m256d &first, __m256d &second)
  {
    const auto words = [&](int lane) {
      return _mm_load_pd(reinterpret_cast<const double *>(row(lane)) + offset);
    };
    const __m256d even = _mm256_insertf128_pd(_mm256_castpd128_pd256(words(0)), words(2), 1);
    const __m256d odd = _mm256_insertf128_pd(_mm256_castpd128_pd256(words(1)), words(3), 1);
    first = _mm256_unpacklo_pd(even, odd);
    second = _mm256_unpackhi_pd(even, odd);
  }

  template <class Row>
  RVE_INLINE void store_pairs_of_words(const Row &row, int offset, __m256d first, __m256d second)
  {
    const __m256d even = _mm256_unpacklo_pd(first, second);
    const __m256d odd = _mm256_unpackhi_pd(first, second);
    const auto put = [&](int lane, __m128d words) {
      _mm_store_pd(reinterpret_cast<double *>(row(lane)) + offset, words);
    };
    put(0, _mm256_castpd256_pd128(even));
    put(1, _mm256_castpd256_pd128(odd));
    put(2, _mm256_extractf128_pd(even, 1));
    put(3, _mm256_extractf128_pd(odd, 1));
  }

  template <int N, class Row>
  RVE_INLINE void load_motion(const Row &row, Motion<PackNumbers<FastNumbers, N>> &motion)
  {
    static_assert(N == 8 && sizeof(Motion<FastNumbers>) == 16, "4 words a row");
    __m256 column[4];
    load_rows(row, column);
    for (int a = 0; a < 2; ++a) {
      motion.position[a].part[0] = _mm256_castps_si256(column[a]);
      motion.velocity[a].part[0] = column[2 + a];
    }
  }

  template <int N, class Row>
  RVE_INLINE void load_positions(const Row &row, Vec<Pack<std::uint64_t, N>, 2> &position)
  {
    for (int m = 0; m < N / 4; ++m) {
      __m256d x, y;
      load_pairs_of_words(
          [&](int lane) {
            return row(4 * m + lane);
          },
          0, x, y);
      position[0].part[m] = _mm256_castpd_si256(x);
      position[1].part[m] = _mm256_castpd_si256(y);
    }
  }

  template <int N, class Row>
  RVE_INLINE void load_motion(const Row &row, Motion<PackNumbers<MixedNumbers, N>> &motion)
  {
    static_assert(N == 8 && sizeof(Motion<MixedNumbers>) == 32,
                  "two floats after two words of 64 bits");
    load_positions(row, motion.position);
    const auto velocities = [&](int lane) {
      const auto at = [&](int k) {
        return reinterpret_cast<const __m64 *>(&row(k)->velocity);
      };
      return _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), at(lane)), at(lane + 1));
    };
    const auto halves = [&](int lane) {
      return _mm256_insertf128_ps(_mm256_castps128_ps256(velocities(lane)), velocities(lane + 4),
                                  1);
    };
    const __m256 a = halves(0), b = halves(2);
    motion.velocity[0].part[0] = _mm256_shuffle_ps(a, b, 0x88);
    motion.velocity[1].part[0] = _mm256_shuffle_ps(a, b, 0xdd);
  }

  template <int N, class Row>
  RVE_INLINE void load_motion(const Row &row, Motion<PackNumbers<DoubleNumbers, N>> &motion)
  {
    static_assert(sizeof(Motion<DoubleNumbers>) == 32, "4 words of 64 bits a row");
    load_positions(row, motion.position);
    for (int m = 0; m < N / 4; ++m)
      load_pairs_of_words(
          [&](int lane) {
            return row(4 * m + lane);
          },
          2, motion.velocity[0].part[m], motion.velocity[1].part[m]);
  }

  template <int N>
  RVE_INLINE void store_motion(Motion<FastNumbers> *row,
                               const Motion<PackNumbers<FastNumbers, N>> &motion)
  {
    const __m256 column[4] = {_mm256_castsi256_ps(motion.position[0].part[0]),
                              _mm256_castsi256_ps(motion.position[1].part[0]),
                              motion.velocity[0].part[0], motion.velocity[1].part[0]};
    store_rows(
        [&](int lane) {
          return row + lane;
        },
        column);
  }

  template <int N>
  RVE_INLINE void store_positions(char *row, int bytes,
                                  const Vec<Pack<std::uint64_t, N>, 2> &position)
  {
    for (int m = 0; m < N / 4; ++m)
      store_pairs_of_words(
          [&](int lane) {
            return row + (4 * m + lane) * bytes;
          },
          0, _mm256_castsi256_pd(position[0].part[m]), _mm256_castsi256_pd(position[1].part[m]));
  }

  template <int N>
  RVE_INLINE void store_motion(Motion<MixedNumbers> *row,
                               const Motion<PackNumbers<MixedNumbers, N>> &motion)
  {
    store_positions(reinterpret_cast<char *>(row), sizeof(*row), motion.position);
    const __m256 x = motion.velocity[0].part[0], y = motion.velocity[1].part[0];
    const auto put = [&](int lane, __m128 two) {
      _mm_storel_pi(reinterpret_cast<__m64 *>(&row[lane].velocity), two);
      _mm_storeh_pi(reinterpret_cast<__m64 *>(&row[lane + 1].velocity), two);
    };
    const __m256 a = _mm256_unpacklo_ps(x, y), b = _mm256_unpackhi_ps(x, y);
    put(0, _mm256_castps256_ps128(a));
    put(2, _mm256_castps256_ps128(b));
    put(4, _mm256_extractf128_ps(a, 1));
    put(6, _mm256_extractf128_ps(b, 1));
  }

  template <int N>
  RVE_INLINE void store_motion(Motion<DoubleNumbers> *row,
                               const Motion<PackNumbers<DoubleNumbers, N>> &motion)
  {
    store_positions(reinterpret_cast<char *>(row), sizeof(*row), motion.position);
    for (int m = 0; m < N / 4; ++m)
      store_pairs_of_words(
          [&](int lane) {
            return row + 4 * m + lane;
          },
          2, motion.velocity[0].part[m], motion.velocity[1].part[m]);
  }

  template <class Numbers>
  RVE_INLINE void load_still(const Still<Numbers> *row, PackedStill<Numbers> &still)
  {
    static_assert(sizeof(Still<Numbers>) == 16, "4 words a row");
    __m256 column[4];
    load_rows(
        [&](int lane) {
          return row + lane;
        },
        column);
    still.velocity_unit.part[0] = column[0];
    still.spin_unit.part[0] = column[1];
    for (int a = 0; a < 2; ++a) still.list_position[a].part[0] = _mm256_castps_si256(column[2 + a]);
  }

  RVE_INLINE void load_still(const Still<DoubleNumbers> *row, PackedStill<DoubleNumbers> &still)
  {
    static_assert(sizeof(Still<DoubleNumbers>) == 32, "two doubles before two words of 32 bits");
    for (int m = 0; m < 2; ++m)
      load_pairs_of_words(
          [&](int lane) {
            return row + 4 * m + lane;
          },
          0, still.velocity_unit.part[m], still.spin_unit.part[m]);
    std::uint32_t x[8], y[8];
    for (int lane = 0; lane < 8; ++lane) {
      x[lane] = row[lane].list_position[0];
      y[lane] = row[lane].list_position[1];
    }
    still.list_position[0] = Pack<std::uint32_t, 8>::load(x);
    still.list_position[1] = Pack<std::uint32_t, 8>::load(y);
  }

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

  // ---- sums of forces -----------------------------------------------------------------------------------------------------------

  /// Force and torque on a grain side by side, so that a pair adds to its partner with one addition.
  template <class Numbers> struct alignas(4 * sizeof(typename Numbers::Sum)) ForceRow {
    typename Numbers::Sum force_x, force_y, torque, unused;
  };

  /// Room for one row per grain, as long as packs advance: zero outside of the steps, where the arrays of SharedView have it all.
  template <class Scene>
  RVE_INLINE ForceRow<typename Scene::Numbers> *force_rows(const CallState<Scene> &call)
  {
    static_assert(sizeof(ForceRow<typename Scene::Numbers>) <= 4 * sizeof(double) && kScratch > 4,
                  "a row per grain, and one to align the first one");
    constexpr std::uintptr_t size = sizeof(ForceRow<typename Scene::Numbers>);
    const auto begin = reinterpret_cast<std::uintptr_t>(call.work.scratch);
    return reinterpret_cast<ForceRow<typename Scene::Numbers> *>((begin + size - 1) / size * size);
  }

  RVE_INLINE void add_to_row(std::int32_t *row, __m128i x)
  {
    auto *sum = reinterpret_cast<__m128i *>(row);
    _mm_store_si128(sum, _mm_add_epi32(_mm_load_si128(sum), x));
  }

  RVE_INLINE void add_to_row(std::int64_t *row, __m256i x)
  {
    auto *sum = reinterpret_cast<__m256i *>(row);
    _mm256_store_si256(sum, _mm256_add_epi64(_mm256_load_si256(sum), x));
  }

  /// Adds the three numbers of each lane to the row of 4 integers at row(lane).
  template <class Row>
  RVE_INLINE void add_to_rows(const Row &row, const Vec<Pack<std::int32_t, 8>, 3> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    const __m256i a = _mm256_unpacklo_epi32(x[0].part[0], x[1].part[0]);
    const __m256i b = _mm256_unpackhi_epi32(x[0].part[0], x[1].part[0]);
    const __m256i c = _mm256_unpacklo_epi32(x[2].part[0], zero);
    const __m256i d = _mm256_unpackhi_epi32(x[2].part[0], zero);
    const __m256i pair[4] = {_mm256_unpacklo_epi64(a, c), _mm256_unpackhi_epi64(a, c),
                             _mm256_unpacklo_epi64(b, d), _mm256_unpackhi_epi64(b, d)};
    for (int lane = 0; lane < 4; ++lane) {
      add_to_row(&row(lane)->force_x, _mm256_castsi256_si128(pair[lane]));
      add_to_row(&row(lane + 4)->force_x, _mm256_extracti128_si256(pair[lane], 1));
    }
  }

  template <int N, class Row>
  RVE_INLINE void add_to_rows(const Row &row, const Vec<Pack<std::int64_t, N>, 3> &x)
  {
    const __m256i zero = _mm256_setzero_si256();
    for (int m = 0; m < N / 4; ++m) {
      const __m256i a = _mm256_unpacklo_epi64(x[0].part[m], x[1].part[m]);
      const __m256i b = _mm256_unpackhi_epi64(x[0].part[m], x[1].part[m]);
      const __m256i c = _mm256_unpacklo_epi64(x[2].part[m], zero);
      const __m256i d = _mm256_unpackhi_epi64(x[2].part[m], zero);
      add_to_row(&row(4 * m)->force_x, _mm256_permute2x128_si256(a, c, 0x20));
      add_to_row(&row(4 * m + 1)->force_x, _mm256_permute2x128_si256(b, d, 0x20));
      add_to_row(&row(4 * m + 2)->force_x, _mm256_permute2x128_si256(a, c, 0x31));
      add_to_row(&row(4 * m + 3)->force_x, _mm256_permute2x128_si256(b, d, 0x31));
    }
  }

  /// Takes the rows of 8 grains and leaves zeros.
  template <class Numbers, class Sum>
  RVE_INLINE void take_rows(ForceRow<Numbers> *row, Vec<Pack<Sum, 8>, 3> &sum)
  {
    if constexpr (sizeof(Sum) == 4) {
      __m256 column[4];
      load_rows(
          [&](int lane) {
            return row + lane;
          },
          column);
      for (int c = 0; c < 3; ++c) sum[c].part[0] = _mm256_castps_si256(column[c]);
    } else {
      for (int m = 0; m < 2; ++m) {
        const auto of_part = [&](int lane) {
          return row + 4 * m + lane;
        };
        __m256d x, y, torque, unused;
        load_pairs_of_words(of_part, 0, x, y);
        load_pairs_of_words(of_part, 2, torque, unused);
        sum[0].part[m] = _mm256_castpd_si256(x);
        sum[1].part[m] = _mm256_castpd_si256(y);
        sum[2].part[m] = _mm256_castpd_si256(torque);
      }
    }
    auto *bytes = reinterpret_cast<char *>(row);
    for (std::size_t k = 0; k < 8 * sizeof(*row); k += 32)
      _mm256_storeu_si256(reinterpret_cast<__m256i *>(bytes + k), _mm256_setzero_si256());
  }

  /// The row of grain i to where everybody looks.
  template <class Scene>
  RVE_INLINE void give_row(ForceRow<typename Scene::Numbers> &row, const SharedView<Scene> &shared,
                           int i)
  {
    shared.force_x[i] = wrapping_sum(shared.force_x[i], row.force_x);
    shared.force_y[i] = wrapping_sum(shared.force_y[i], row.force_y);
    shared.torque[i] = wrapping_sum(shared.torque[i], row.torque);
    row = ForceRow<typename Scene::Numbers>{0, 0, 0, 0};
  }

  /// Before the steps, for 8 grains.
  template <class Scene>
  RVE_INLINE void load_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call)
  {
    const int last_pack = call.num_grains - kPackedGrains;
    const int end = i.first + kPackedGrains > last_pack ? call.num_grains : i.first + kPackedGrains;
    for (int k = i.first; k < end; ++k)
      force_rows(call)[k] = ForceRow<typename Scene::Numbers>{0, 0, 0, 0};
  }

  /// After the steps.
  template <class Scene>
  RVE_INLINE void save_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                            const SharedView<Scene> &shared)
  {
    for (int k = i.first; k < i.first + kPackedGrains; ++k)
      give_row(force_rows(call)[k], shared, k);
  }

  // ---- forces -----------------------------------------------------------------------------------------------------------------

  template <int N, class Scene>
  RVE_INLINE void load_grains(const SharedView<Scene> &shared, int first,
                              GrainView<PackNumbers<typename Scene::Numbers, N>> &grains)
  {
    using Packed = PackScene<Scene, N>;
    load_motion(
        [&](int lane) {
          return shared.motion + first + lane;
        },
        grains.motion);
    grains.spin = Packed::Real::load(shared.spin + first);
    grains.radius = Packed::Wide::load(shared.radius + first);
  }

  /// The partners of N grains in a slot.
  template <int N, class Scene>
  RVE_INLINE void load_partners(const SharedView<Scene> &shared, int slot,
                                GrainView<PackNumbers<typename Scene::Numbers, N>> &grains)
  {
    using Packed = PackScene<Scene, N>;
    const std::int32_t *partner = shared.partner + slot;
    load_motion(
        [&](int lane) {
          return shared.motion + partner[lane];
        },
        grains.motion);
    grains.spin = gather<typename Scene::Real, N>(shared.spin, partner);
    grains.radius = Packed::Wide::load(shared.partner_radius + slot);
  }

  /// add_pair for the owned pairs of N grains.
  template <int N, class Scene>
  RVE_INLINE void packed_forces(int first, const SharedView<Scene> &shared,
                                const StepConstants<PackScene<Scene, N>> &step,
                                ForceRow<typename Scene::Numbers> *rows, int num_grains)
  {
    using Packed = PackScene<Scene, N>;
    using Real = typename Packed::Real;
    using History = typename Packed::History;
    using Sum = typename Packed::Sum;
    GrainView<typename Packed::Numbers> me;
    load_grains<N>(shared, first, me);
    Real largest_force = Real::load(shared.largest_force + first);
    Vec<Sum, 3> own = Vec<Sum, 3>::zero();
    // one stage for all slots before the next: what one pair waits for, roots and quotients, passes while others are served
    const auto slot = [&](int k) {
      return k * num_grains + first;
    };
    GrainView<typename Packed::Numbers> other[kOwnedPairs];
    ContactGeometry<Real, 2> contact[kOwnedPairs];
#pragma GCC unroll 3
    for (int k = 0; k < kOwnedPairs; ++k) {
      load_partners<N>(shared, slot(k), other[k]);
      contact[k] = pair_geometry(step, me, other[k]);
    }
    Vec<Sum, 3> on_j[kOwnedPairs];
#pragma GCC unroll 3
    for (int k = 0; k < kOwnedPairs; ++k) {
      typename Scene::History *history = shared.history + slot(k);
      const Truth<Real> touching = contact[k].overlap > Real(0);
      const auto force = pair_force(step, contact[k], me, other[k], History::load(history));
      if constexpr (Scene::has_friction) {
        Truth<History> keeps;
        convert_truth(touching, keeps);
        where(keeps, force.spring).store(history);
      }
      largest_force = larger(largest_force, where(touching, fabs(force.normal_force)));
      round_to(where(touching, -force.force[0]), on_j[k][0]);
      round_to(where(touching, -force.force[1]), on_j[k][1]);
      own[0] = own[0] - on_j[k][0];
      own[1] = own[1] - on_j[k][1];
      on_j[k][2] = Sum(0);
      if constexpr (Scene::has_friction) {
        Sum torque_i;
        round_to(where(touching, force.torque_j), on_j[k][2]);
        round_to(where(touching, force.torque_i), torque_i);
        own[2] = own[2] + torque_i;
      }
    }
#pragma GCC unroll 3
    for (int k = 0; k < kOwnedPairs; ++k)
      add_to_rows(
          [&](int lane) {
            return rows + shared.partner[slot(k) + lane];
          },
          on_j[k]);
    add_to_rows(
        [&](int lane) {
          return rows + first + lane;
        },
        own);
    largest_force.store(shared.largest_force + first);
  }

  /// Registers hold 8 floats, or 4 doubles.
  template <class Scene> RVE_INLINE constexpr int force_lanes()
  {
    return sizeof(typename Scene::Real) == 4 ? 8 : 4;
  }

  template <class Scene>
  RVE_INLINE void packed_forces(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                                const SharedView<Scene> &shared,
                                const StepPlan<typename Scene::Numbers> &plan, int num_grains)
  {
    constexpr int lanes = force_lanes<Scene>();
    // the same in every lane
    const auto step = step_constants<PackScene<Scene, lanes>>(call.law, plan);
    for (int part = 0; part < kPackedGrains; part += lanes)
      packed_forces<lanes>(i.first + part, shared, step, force_rows(call), num_grains);
    // grains that no pack will collect
    if (i.first + 2 * kPackedGrains > num_grains)
      for (int k = i.first + kPackedGrains; k < num_grains; ++k)
        give_row(force_rows(call)[k], shared, k);
  }

  // ---- motion -----------------------------------------------------------------------------------------------------------------

  /// Adds the integers of 8 grains to the sum and leaves zeros.
  template <class Integer> RVE_INLINE void collect(Integer *array, Pack<Integer, 8> &sum)
  {
    sum = sum + Pack<Integer, 8>::load(array);
    Pack<Integer, 8>(Integer(0)).store(array);
  }

  template <class Scene>
  RVE_INLINE void kick_pack(int first, const CallState<Scene> &call,
                            const SharedView<Scene> &shared,
                            const PackedStill<typename Scene::Numbers> &still,
                            const Pack<typename Scene::Real, 8> &alpha,
                            Motion<PackNumbers<typename Scene::Numbers, 8>> &motion)
  {
    using Real = Pack<typename Scene::Real, 8>;
    Vec<Pack<typename Scene::Sum, 8>, 3> sum;
    take_rows(force_rows(call) + first, sum);
    collect(shared.force_x + first, sum[0]);
    collect(shared.force_y + first, sum[1]);
    collect(shared.torque + first, sum[2]);
    for (int a = 0; a < 2; ++a)
      motion.velocity[a] =
          kick(motion.velocity[a], static_cast<Real>(sum[a]) * still.velocity_unit, alpha);
    const Real spin = Real::load(shared.spin + first);
    kick(spin, static_cast<Real>(sum[2]) * still.spin_unit, alpha).store(shared.spin + first);
  }

  /// RveProgram::move for 8 grains: whether one of them has left the safety of the list.
  template <class Scene>
  RVE_INLINE bool move_pack(PackItem<kPackedGrains> i, const CallState<Scene> &call,
                            const SharedView<Scene> &shared,
                            const StepPlan<typename Scene::Numbers> &plan,
                            typename Scene::Real alpha, bool kick_first)
  {
    using Packed = PackScene<Scene, 8>;
    using Wide = typename Packed::Wide;
    using Float = Pack<float, 8>;
    const auto to_fraction = plan.to_fraction.template as<Wide>();
    Motion<typename Packed::Numbers> motion;
    load_motion(
        [&](int lane) {
          return shared.motion + i.first + lane;
        },
        motion);
    PackedStill<typename Scene::Numbers> still;
    load_still(shared.still + i.first, still);
    if (kick_first) kick_pack(i.first, call, shared, still, typename Packed::Real(alpha), motion);
    const Vec<Wide, 2> displacement = to_fraction * motion.velocity.template as<Wide>();
    for (int a = 0; a < 2; ++a) {
      typename Packed::SignedCoordinate units;
      round_to(displacement[a], units);
      motion.position[a] = motion.position[a] + static_cast<typename Packed::Coordinate>(units);
    }
    store_motion(shared.motion + i.first, motion);
    const Vec<Pack<std::uint32_t, 8>, 2> now{
        {leading_bits(motion.position[0]), leading_bits(motion.position[1])}};
    const Vec<Float, 2> moved = plan.list_to_length.template as<Float>() *
        fractional_difference<PackNumbers<FastNumbers, 8>>(now, still.list_position);
    return signs(dot(moved, moved) > Float(plan.allowed_squared)) != 0;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
