// SPDX-License-Identifier: GPL-2.0-only
// The kernel that turns RVEs rigidly, for any memory of an RVE.

#pragma once

#include "rve/algorithm/rigid_turn.h"
#include "rve/block/block_cuda.cuh"
#include "rve/engine/cuda_increments.cuh"
#include "rve/engine/options.h"
#include "rve/engine/program_scenes.h"

namespace rve {

template <int D> struct TurnList {
  const TurnRecord<D> *turns;
  int count;
  /// In the memory of the device, where the number is known there alone; and above zero if none shall be turned. Or null.
  const int *count_there, *hold;
};

/// Turns RVEs rigidly, one after the other in each block of any size. All of one lies in front of the histories: with rolling resistance, too.
template <class Scene> __global__ void turn_rves(const TurnList<Scene::D> list)
{
  using Block = BlockCuda<0>;
  Block block;
  if (list.hold && *list.hold > 0) return;
  const int count = list.count_there ? *list.count_there : list.count;
  for (int k = blockIdx.x; k < count; k += gridDim.x) {
    const TurnRecord<Scene::D> turn = list.turns[k];
    turn_rigidly(block,
                 carve_image<Scene>(turn.rve.image, turn.rve.num_grains, turn.rve.extra_capacity),
                 load_tensor<Scene::D>(turn.rotation));
  }
}

template <int D> using TurnFunction = void (*)(TurnList<D>);

/// None for RVEs of the other dimension.
template <int D, class Scene> TurnFunction<D> turn_scene()
{
  if constexpr (Scene::D == D)
    return turn_rves<Scene>;
  else
    return nullptr;
}

template <int D, class Numbers> TurnFunction<D> turn_function(Program memory)
{
  switch (memory) {
#define RVE_TURN(name, law, books, prepared) \
  case Program::name:                        \
    return turn_scene<D, ProgramScene<Program::prepared, Numbers>>();
    RVE_PROGRAMS(RVE_TURN)
#undef RVE_TURN
  }
  return nullptr;
}

template <int D> TurnFunction<D> turn_function(Format format, Program memory)
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
