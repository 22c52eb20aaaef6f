// SPDX-License-Identifier: GPL-2.0-only
// Rigid rotation of a stored RVE.

#pragma once

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// Rotates the stored state of an RVE: cell, deformation, velocities and the velocity gradient of
  /// a servo, in space also spins and contact histories. A rotation does not change the fractional
  /// coordinates and the list. In the plane it does not change spins and contact histories either.
  template <class Block, class Config>
  RVE_INLINE void turn_rigidly(Block &block, const DeviceStateView<Config> &device_state,
                               const Tensor<double, Config::D> &rotation)
  {
    const int n = device_state.header->num_grains, num_extra = device_state.header->num_extra;
    block.for_each(n, [&](typename Block::Item i) {
      const auto turned = rotation * device_state.velocity[i].template as<double>();
      device_state.velocity[i] = turned.template as<typename Config::Real>();
      if constexpr (Config::D == 3) {
        using Law = typename Config::Law;
        const auto spin = rotation * device_state.spin[i].template as<double>();
        device_state.spin[i] = spin.template as<typename Config::Real>();
        for (int k = 0; k < Config::owned_pairs; ++k)
          device_state.history[k * n + i] = Law::turned(device_state.history[k * n + i], rotation);
        for (int m = i; m < num_extra; m += n)
          device_state.extra_history[m] = Law::turned(device_state.extra_history[m], rotation);
      }
    });
    block.once([&] {
      StateHeader<Config::D> &header = *device_state.header;
      double *const of_columns[] = {header.cell, header.deformation, header.list_cell};
      for (double *tensor : of_columns)
        store_tensor(rotation * load_tensor<Config::D>(tensor), tensor);
      double *const gradient = header.servo_velocity_gradient;
      store_tensor(rotation * load_tensor<Config::D>(gradient) * transpose(rotation), gradient);
    });
  }

}    // namespace RVE_ISA
}    // namespace rve
