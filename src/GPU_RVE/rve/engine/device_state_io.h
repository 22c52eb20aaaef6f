// SPDX-License-Identifier: GPL-2.0-only
// Conversion of the state of an RVE to its device state (algorithm/device_state.h) and back.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/engine/kernel_variants.h"
#include "rve/engine/options.h"
#include "rve/engine/state.h"

#include <cstddef>
#include <vector>

namespace rve {

/// Device state (algorithm/device_state.h) in the number format of the engine.
struct DeviceState {
  int num_grains = 0;
  int extra_capacity = 0;
  std::vector<char> bytes;
};

// In these functions `memory` is the kernel variant that defines the memory layout
// (engine/variant_choice.h). All RVEs of an engine have the same layout.

/// Returns the device state of an RVE. A grain has a fixed number of pairs in arrays; further pairs
/// are in a list of extra pairs. The list has capacity for at least `extra_capacity` pairs and for
/// all extra pairs of the state. Rolling forces are included if the variant has rolling resistance.
template <int D>
DeviceState build_device_state(Format format, const RveStateOf<D> &state, int extra_capacity,
                               KernelVariant memory);
/// Returns the RVE state in a device state, without rounding.
template <int D = 2>
RveStateOf<D> read_device_state(Format format, const DeviceState &device_state,
                                KernelVariant memory);
/// Turns an RVE rigidly.
template <int D>
void turn_device_state(Format format, DeviceState &device_state, const Tensor<double, D> &rotation,
                       KernelVariant memory);
template <int D>
std::size_t device_state_bytes(Format format, int num_grains, int extra_capacity,
                               KernelVariant memory);
/// Returns the initial capacity of the list of extra pairs. The engine enlarges the list on demand.
template <int D> int initial_extra_capacity(int num_grains);

/// Sets the material in a header, and the members of the header that follow from the material.
template <int D> void set_material_in(StateHeader<D> &header, const Material &material);

}    // namespace rve
