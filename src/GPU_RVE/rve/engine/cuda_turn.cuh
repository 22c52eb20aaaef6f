// SPDX-License-Identifier: GPL-2.0-only
// Rigid rotation of RVEs on a CUDA device.

#pragma once

#include "rve/algorithm/rigid_turn.h"
#include "rve/block/block_cuda.cuh"
#include "rve/engine/variant_configs.h"

namespace rve {

template <int D> struct TurnList {
  const TurnRecord<D> *turns;
  int count;
  const int *count_there;    ///< count in device memory, used instead of `count`; or null
  const int *hold;           ///< device memory, positive if no RVE may be turned; or null
};

/// Turns RVEs rigidly. A block, of any size, turns one RVE after the other. `Config` has the memory
/// layout of the RVEs.
template <class Config> __global__ void turn_rves(const TurnList<Config::D> list)
{
  using Block = BlockCuda<0>;
  Block block;
  if (list.hold && *list.hold > 0) return;
  const int count = list.count_there ? *list.count_there : list.count;
  for (int k = blockIdx.x; k < count; k += gridDim.x) {
    const TurnRecord<Config::D> turn = list.turns[k];
    turn_rigidly(block,
                 carve_device_state<Config>(turn.rve.device_state, turn.rve.num_grains,
                                            turn.rve.extra_capacity),
                 load_tensor<Config::D>(turn.rotation));
  }
}

template <int D> using TurnFunction = void (*)(TurnList<D>);

template <int D, class Numbers> TurnFunction<D> turn_function(KernelVariant memory)
{
  return with_variant<D>(memory, [](auto variant) -> TurnFunction<D> {
    return turn_rves<VariantConfig<decltype(variant)::prepared_like, Numbers>>;
  });
}

template <int D> TurnFunction<D> turn_function(Format format, KernelVariant memory)
{
  switch (format) {
    case Format::Fast:
      return turn_function<D, FastNumbers>(memory);
    case Format::Mixed:
      return turn_function<D, MixedNumbers>(memory);
    default:
      return turn_function<D, DoubleNumbers>(memory);
  }
}

}    // namespace rve
