// The phases of a step for packs of grains on a CPU with AVX2 (BlockSimd): the bits of the texts for one
// grain, whose formulas they share. For plain scenes.

#ifndef RVE_ALGORITHM_SIMD_PHASES_H
#define RVE_ALGORITHM_SIMD_PHASES_H

#include "rve/algorithm/contact_forces.h"
#include "rve/algorithm/pack_phases.h"
#include "rve/core/pack_rows.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

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

  /// GrainResponse of 8 grains.
  template <class Numbers> struct PackedResponse {
    Vec<Pack<typename Numbers::Real, 8>, 2> units;    ///< of velocity and of spin
    Vec<Pack<std::uint32_t, 8>, 2> list_position;
  };

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
    load_row(
        [&](int lane) {
          return shared.motion + first + lane;
        },
        grains.motion.position, grains.motion.velocity);
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
    load_row(
        [&](int lane) {
          return shared.motion + partner[lane];
        },
        grains.motion.position, grains.motion.velocity);
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
      add_to_row(
          [&](int lane) {
            return &rows[shared.partner[slot(k) + lane]].force_x;
          },
          on_j[k]);
    add_to_row(
        [&](int lane) {
          return &rows[first + lane].force_x;
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
                            const PackedResponse<typename Scene::Numbers> &response,
                            const Pack<typename Scene::Real, 8> &alpha,
                            Motion<PackNumbers<typename Scene::Numbers, 8>> &motion)
  {
    using Real = Pack<typename Scene::Real, 8>;
    Vec<Pack<typename Scene::Sum, 8>, 3> sum;
    take_rows(&force_rows(call)[first].force_x, sum);
    collect(shared.force_x + first, sum[0]);
    collect(shared.force_y + first, sum[1]);
    collect(shared.torque + first, sum[2]);
    for (int a = 0; a < 2; ++a)
      motion.velocity[a] =
          kick(motion.velocity[a], static_cast<Real>(sum[a]) * response.units[0], alpha);
    const Real spin = Real::load(shared.spin + first);
    kick(spin, static_cast<Real>(sum[2]) * response.units[1], alpha).store(shared.spin + first);
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
    load_row(
        [&](int lane) {
          return shared.motion + i.first + lane;
        },
        motion.position, motion.velocity);
    PackedResponse<typename Scene::Numbers> response;
    load_row(
        [&](int lane) {
          return shared.response + i.first + lane;
        },
        response.units, response.list_position);
    if (kick_first)
      kick_pack(i.first, call, shared, response, typename Packed::Real(alpha), motion);
    const Vec<Wide, 2> displacement = to_fraction * motion.velocity.template as<Wide>();
    for (int a = 0; a < 2; ++a) {
      typename Packed::SignedCoordinate units;
      round_to(displacement[a], units);
      motion.position[a] = motion.position[a] + static_cast<typename Packed::Coordinate>(units);
    }
    store_row(
        [&](int lane) {
          return shared.motion + i.first + lane;
        },
        motion.position, motion.velocity);
    const Vec<Pack<std::uint32_t, 8>, 2> now{
        {leading_bits(motion.position[0]), leading_bits(motion.position[1])}};
    const Vec<Float, 2> moved = plan.list_to_length.template as<Float>() *
        fractional_difference<PackNumbers<FastNumbers, 8>>(now, response.list_position);
    return signs(dot(moved, moved) > Float(plan.allowed_squared)) != 0;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
