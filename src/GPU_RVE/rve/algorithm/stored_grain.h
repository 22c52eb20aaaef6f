// SPDX-License-Identifier: GPL-2.0-only
// Conversion of a grain from the stored state of an RVE to the internal units of a call.

#pragma once

#include "rve/algorithm/call_state.h"

namespace rve {
inline namespace RVE_ISA {

  /// Reads stored grains and publishes them in the block.
  template <class Block, class Config> struct StoredGrains {
    using Item = typename Block::Item;
    using Real = typename Config::Real;
    using Wide = typename Config::Wide;
    using History = typename Config::History;
    /// A stored grain and its owned pairs.
    struct StoredGrain {
      Vec<typename Config::Coordinate, Config::D> position;
      Vec<Real, Config::D> velocity;
      Spin<Real, Config::D> spin;
      Vec<std::uint32_t, Config::D> list_position;
      Wide radius;
      std::int32_t partner[Config::owned_pairs];
      History history[Config::owned_pairs];
    };

    /// Reads a grain. All reads precede all writes, so that a thread waits for memory once.
    static RVE_INLINE StoredGrain read_grain(const DeviceStateView<Config> &device_state, int i,
                                             int num_grains, bool with_pairs)
    {
      StoredGrain stored;
      stored.position = device_state.position[i];
      stored.velocity = device_state.velocity[i];
      stored.spin = device_state.spin[i];
      stored.list_position = device_state.list_position[i];
      stored.radius = device_state.radius[i];
      if (with_pairs) read_pairs(device_state.partner, device_state.history, i, num_grains, stored);
      return stored;
    }

    static RVE_INLINE void read_pairs(const std::int32_t *partner, const History *history, int i,
                                      int num_grains, StoredGrain &stored)
    {
      for (int k = 0; k < Config::owned_pairs; ++k) {
        stored.partner[k] = partner[k * num_grains + i];
        stored.history[k] = Block::read_whole(history[k * num_grains + i]);
      }
    }

    static RVE_INLINE MotionOf<Config> internal_motion(const PreparedCall<Config> &call,
                                                       const StoredGrain &stored)
    {
      return MotionOf<Config>{stored.position,
                              static_cast<Real>(call.units.per_length) * stored.velocity};
    }

    /// Publishes the data of a grain except its motion, and clears the sums of its forces. Returns
    /// its internal radius.
    static RVE_INLINE Wide publish_grain(const PreparedCall<Config> &call,
                                         const SharedView<Config> &shared, int i,
                                         const StoredGrain &stored)
    {
      const Wide radius = static_cast<Wide>(call.units.per_length) * stored.radius;
      shared.spin[i] = stored.spin;
      shared.radius[i] = radius;
      clear_sums<Block>(shared, i);
      return radius;
    }

    /// Returns the response of a grain to forces.
    static RVE_INLINE GrainResponseOf<Config>
    response_of(const PreparedCall<Config> &call, Wide internal_radius,
                const Vec<std::uint32_t, Config::D> &list_position)
    {
      const Real r = static_cast<Real>(internal_radius), inverse = reciprocal(r * r);
      Real velocity_unit = static_cast<Real>(call.velocity_factor) * inverse;
      for (int a = 2; a < Config::D; ++a) velocity_unit = velocity_unit * reciprocal(r);
      constexpr double per_inertia = 1.0 / GrainShape<Config::D>::inertia;
      return GrainResponseOf<Config>{velocity_unit, Real(per_inertia) * velocity_unit * inverse,
                                     list_position};
    }

    static RVE_INLINE History internal_history(const PreparedCall<Config> &call, History stored)
    {
      return Config::Law::in_units(stored, call.units.per_force, call.units.per_length);
    }

    static RVE_INLINE void fill_partner_radius(Block &block, const SharedView<Config> &shared,
                                               int num_grains)
    {
      if constexpr (!Block::kInRegisters && !Config::in_memory)
        block.for_each(num_grains, [&](Item i) {
          for (int m = i; m < Config::owned_pairs * num_grains; m += num_grains)
            shared.partner_radius[m] = radius_of_partner(shared, i, shared.partner[m]);
        });
    }

    /// Publishes partners and histories of a grain, and its response to forces.
    static RVE_INLINE void take_pairs(const CallState<Config> &call,
                                      const SharedView<Config> &shared, int i,
                                      const StoredGrain &stored)
    {
      const int n = call.num_grains;
      for (int k = 0; k < Config::owned_pairs; ++k) {
        shared.partner[k * n + i] = stored.partner[k];
        shared.history[k * n + i] = internal_history(call, stored.history[k]);
      }
      set_response(shared, i, response_of(call, shared.radius[i], stored.list_position));
    }

    static RVE_COLD void copy_history(Block block, CallState<Config> &call, PairView<Config> from,
                                      PairView<Config> to)
    {
      // Each history is copied by the thread of its grain, which may have written it in the current
      // phase.
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        for (int m = i; m < Config::owned_pairs * n; m += n) to.history[m] = from.history[m];
      });
      block.for_each(call.num_extra, [&](Item m) { to.extra_history[m] = from.extra_history[m]; });
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
