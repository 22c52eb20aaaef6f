// SPDX-License-Identifier: GPL-2.0-only
// Launch parameters of a call of RVEs: kernels, threads, blocks and shared memory.

#pragma once

#include "cuda/cuda_device.h"
#include "cuda/early_launch.cuh"
#include "rve/core/error.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/cuda_kernels.h"
#include "rve/engine/cuda_variants.h"
#include "rve/engine/options.h"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>

namespace rve {

/// Shared memory that CUDA reserves per block [bytes].
constexpr std::size_t kReservedOnChip = 1024;

inline int rounded_up(int number, int unit)
{
  return (number + unit - 1) / unit * unit;
}

/// Returns a size in device memory rounded up to a multiple of 256, the alignment of the next part
/// [bytes].
inline std::size_t aligned(std::size_t size)
{
  return (size + 255) / 256 * 256;
}

struct LaunchPlan {
  const void *kernel = nullptr, *prepare = nullptr;
  KernelSizes sizes;
  int steps_ahead = 0;
  int block = 0;                    ///< threads
  int blocks = 0;                   ///< resident blocks of the device
  bool waits = false;               ///< true if the kernel can be launched early
  std::size_t dynamic = 0;          ///< dynamic shared memory [bytes]
  std::size_t overflow_size = 0;    ///< workspace for what shared memory cannot hold [bytes]
  bool is_final = false;            ///< false if a faster kernel is being compiled
  int share_on_chip = 0;            ///< carveout of shared memory, for both kernels [percent]
};

/// Launch plans of an engine, one for each kind of call. A run alternates between a few kinds of
/// calls, such as evaluations of some RVEs and steps of all RVEs.
class LaunchPlans {
 public:
  LaunchPlans(const cudaDeviceProp &_device, const CudaVariants &_variants, int _block_size) :
      device(_device), variants(_variants), chosen_block_size(_block_size)
  {
  }

  /// Returns the plan of a call and sets the attributes of its kernels.
  const LaunchPlan &plan_for(const CallShape &call)
  {
    const int steps_ahead = steps_to_prepare(call);
    const CallKind kind{fills_device(call), call.with_details && has_lean_kernels(call.variant),
                        call.largest,       call.pair_capacity,
                        steps_ahead,        call.variant};
    LaunchPlan &plan = plans[kind];
    if (!plan.is_final) plan = plan_of(call, steps_ahead);
    if (&plan == plan_in_use) return plan;
    plan_in_use = nullptr;
    check_cuda(cudaFuncSetAttribute(plan.kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                    static_cast<int>(plan.dynamic)),
               "shared memory of the kernel");
    // A multiprocessor changes its carveout (the share of shared memory) only when no block runs on
    // it. So both kernels of a call have the same carveout.
    const void *const both[] = {plan.prepare, plan.kernel};
    for (const void *kernel : both)
      check_cuda(cudaFuncSetAttribute(kernel, cudaFuncAttributePreferredSharedMemoryCarveout,
                                      plan.share_on_chip),
                 "division of the on-chip memory");
    plan_in_use = &plan;
    return plan;
  }

  /// Returns the device memory of a call for workspaces and prepared calls, without its kernels
  /// [bytes]. The number of resident blocks is an upper bound.
  std::size_t bytes_of(const CallShape &call) const
  {
    const KernelVariant variant = variants.usable(call.variant);
    const Residency residency = residency_of(call, variant);
    const BlockShape shape = *variants.shape(variant, residency);
    const KernelSizes sizes = variants.sizes(variant, residency, call.largest, call.pair_capacity,
                                             steps_to_prepare(call));
    const std::size_t most = device.sharedMemPerBlockOptin - kReservedOnChip;
    const std::size_t overflow = sizes.shared > most ? sizes.shared : sizes.beside;
    const int by_threads = device.maxThreadsPerMultiProcessor / block_size(shape, call.largest),
              by_memory = static_cast<int>(device.sharedMemPerMultiprocessor /
                                           (std::min(sizes.shared, most) + kReservedOnChip)),
              blocks = std::max(1, std::min(by_threads, by_memory)) * device.multiProcessorCount;
    return call.num_rves * sizes.prepared +
        std::min(call.num_rves, blocks) * (aligned(sizes.workspace) + aligned(overflow));
  }

  /// Returns true if plan_for() neither compiles nor loads the RVE kernel of a call.
  bool has_kernel(const CallShape &call) const
  {
    const KernelVariant variant = variants.usable(call.variant);
    return variants.is_at_hand(variant, residency_of(call, variant));
  }

 private:
  /// Properties of a call that determine its launch plan, in this order: true if the call fills the
  /// device; true if it has details and some kernels of its variant compute none;
  /// CallShape::largest; CallShape::pair_capacity; the number of planned steps; the kernel variant.
  using CallKind = std::tuple<bool, bool, int, int, int, KernelVariant>;

  const cudaDeviceProp &device;
  const CudaVariants &variants;
  const int chosen_block_size;    ///< 0: automatic
  std::map<CallKind, LaunchPlan> plans;
  const LaunchPlan *plan_in_use = nullptr;    ///< plan whose attributes are set at present

  LaunchPlan plan_of(const CallShape &call, int steps_ahead)
  {
    LaunchPlan plan;
    plan.steps_ahead = steps_ahead;
    const KernelVariant variant = variants.usable(call.variant);
    plan.prepare = variants.prepare(variant);
    cudaFuncAttributes attributes;
    std::size_t most = 0;    // largest dynamic shared memory of a launch
    const auto plan_with = [&](Residency residency) {
      const RuntimeKernel kernel = variants.advance(variant, residency);
      plan.kernel = kernel.function;
      plan.is_final = kernel.is_final;
      plan.block = block_size(*variants.shape(variant, residency), call.largest);
      plan.sizes =
          variants.sizes(variant, residency, call.largest, call.pair_capacity, plan.steps_ahead);
      plan.dynamic = plan.sizes.shared;
      check_cuda(cudaFuncGetAttributes(&attributes, plan.kernel), "attributes of the kernel");
      most = device.sharedMemPerBlockOptin - attributes.sharedSizeBytes - kReservedOnChip;
      plan.overflow_size = aligned(plan.sizes.beside);
    };
    Residency residency = residency_of(call, variant);
    plan_with(residency);
    if (residency != Residency::Memory && plan.dynamic > most) {
      // An H200 has enough shared memory for the largest kernel of each format. A GeForce GPU has
      // less than half as much and can get here.
      residency = Residency::Memory;
      plan_with(residency);
    }
    if (residency == Residency::Memory && plan.dynamic > most) {
      plan.dynamic = most / 16 * 16;
      plan.overflow_size = aligned(plan.sizes.shared);
    }
    plan.waits = waits_itself(device.major, attributes);
    check_cuda(cudaFuncSetAttribute(plan.kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                    static_cast<int>(plan.dynamic)),
               "shared memory of the kernel");
    plan_in_use = nullptr;    // the plan in use can have the same kernel
    int blocks_per_sm = 0;
    check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks_per_sm, plan.kernel,
                                                             plan.block, plan.dynamic),
               "occupancy");
    require(blocks_per_sm > 0,
            "no thread block of " + std::to_string(plan.block) + " threads fits on this device");
    plan.blocks = blocks_per_sm * device.multiProcessorCount;
    const std::size_t on_chip =
        blocks_per_sm * (plan.dynamic + attributes.sharedSizeBytes + kReservedOnChip);
    plan.share_on_chip =
        std::min(100,
                 static_cast<int>((100 * on_chip + device.sharedMemPerMultiprocessor - 1) /
                                  device.sharedMemPerMultiprocessor));
    return plan;
  }

  /// Returns the number of DEM steps that are planned for each RVE before its block begins: up to
  /// twice the mean number of steps of the call, and at most kStepsAhead. In the RVE kernel one
  /// thread plans further steps while the rest of its block waits. More planned steps reduce these
  /// waits; fewer planned steps reduce the memory traffic. The number is a power of two or
  /// CallShape::longest, so that successive calls mostly have the same launch plan.
  static int steps_to_prepare(const CallShape &call)
  {
    int steps = 1;
    while (steps < kStepsAhead && steps < call.longest && steps < 2.0 * call.mean) steps *= 2;
    return std::max(1, std::min(steps, call.longest));
  }

  /// Returns true if some kernels of a variant compute no details.
  bool has_lean_kernels(KernelVariant variant) const
  {
    const auto shape = variants.shape(variants.usable(variant), Residency::Large);
    return !shape || shape->lean;
  }

  bool fills_device(const CallShape &call) const
  {
    return call.num_rves > device.multiProcessorCount;
  }

  bool serves(const CallShape &call, KernelVariant variant, Residency residency) const
  {
    const auto shape = variants.shape(variant, residency);
    if (!shape || shape->items == 0 || call.largest > shape->capacity()) return false;
    if (shape->lean && call.with_details) return false;
    // With two items per thread, a sum over a partial warp causes an illegal instruction (CUDA
    // 13.0).
    if (shape->items == 2 && chosen_block_size % 32 != 0) return false;
    return chosen_block_size == 0 ||
        (chosen_block_size <= shape->threads && call.largest <= shape->items * chosen_block_size);
  }

  Residency residency_of(const CallShape &call, KernelVariant variant) const
  {
    // A call of few RVEs uses the kernel for many RVEs if that kernel is loaded and the kernel for
    // few RVEs is not. Compiling a kernel takes from seconds to half a minute, and a few calls,
    // such as time-step checks, do not save as much.
    const bool takes_many = fills_device(call) ||
        (variants.is_at_hand(variant, Residency::Many) &&
         !variants.is_at_hand(variant, Residency::Few));
    const Residency small = takes_many ? Residency::Many : Residency::Few;
    for (const Residency residency : {small, Residency::Large, Residency::Largest})
      if (serves(call, variant, residency)) return residency;
    // The kernel for many RVEs can be one without details. The kernel for few RVEs then serves a
    // call with details.
    const auto usual = variants.shape(variant, small);
    return usual && usual->lean && serves(call, variant, Residency::Few) ? Residency::Few
                                                                         : Residency::Memory;
  }

  /// Returns the number of threads of a block, in whole warps unless the user has chosen it. With
  /// grains in registers it is the smallest number whose registers hold all grains. With grains in
  /// memory there is one thread per grain where possible; otherwise all threads have about the same
  /// number of grains.
  int block_size(const BlockShape &shape, int num_grains) const
  {
    if (chosen_block_size > 0) return std::min(chosen_block_size, shape.threads);
    if (shape.items > 0) return rounded_up((num_grains + shape.items - 1) / shape.items, 32);
    const int rounds = (num_grains + shape.threads - 1) / shape.threads;
    const int in_a_round = (num_grains + rounds - 1) / rounds;
    return rounded_up(in_a_round, 32);
  }
};

}    // namespace rve
