// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/cuda_launch.cuh"

#include "cuda/device_buffer.cuh"
#include "cuda/early_launch.cuh"
#include "rve/core/error.h"
#include "rve/engine/program_scenes.h"

#include <algorithm>
#include <string>

namespace rve {

namespace {

  constexpr int LARGEST_BLOCK = 1024;
  /// Bytes of a block on chip that CUDA keeps for itself.
  constexpr std::size_t kReserved = 1024;

  /// Steps that are planned for each RVE before the blocks begin: those of an RVE of mean length, and as many more, since a block that has
  /// to plan waits for one thread. The memory of all these plans is written and read for every RVE. A power of two: calls that follow each
  /// other are alike.
  int steps_to_prepare(const CallShape &call)
  {
    int steps = 1;
    while (steps < kStepsAhead && steps < call.longest && steps < 2.0 * call.mean) steps *= 2;
    return std::max(1, std::min(steps, call.longest));
  }

  cudaDeviceProp properties_of(const Options &options)
  {
    cudaDeviceProp properties;
    check_cuda(cudaGetDeviceProperties(&properties, options.device_number), "device properties");
    return properties;
  }

}    // namespace

LaunchPlans::LaunchPlans(const Options &options) :
    block_size_(options.block_size), device_(properties_of(options)),
    programs_(options, 10 * device_.major + device_.minor)
{
  require(block_size_ >= 0 && block_size_ <= LARGEST_BLOCK,
          "block size must be 0 (automatic) or in [1, 1024] threads, got ", block_size_);
}

const LaunchPlan &LaunchPlans::plan_for(const CallShape &call)
{
  const Kind kind{fills_device(call),     call.with_details && has_lean_kernels(call.program),
                  call.largest,           call.pair_capacity,
                  steps_to_prepare(call), call.program};
  const auto [at, is_new] = plans_.try_emplace(kind);
  if (is_new) {
    try {
      at->second = plan_of(call, kind);
    } catch (...) {
      plans_.erase(at);
      throw;
    }
  }
  const LaunchPlan &plan = at->second;
  if (&plan == plan_in_use_) return plan;
  plan_in_use_ = nullptr;
  check_cuda(cudaFuncSetAttribute(plan.kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                  static_cast<int>(plan.dynamic)),
             "shared memory of the kernel");
  // multiprocessors divide their memory anew only when they are empty: the same for both kernels of a call
  const void *const both[] = {plan.prepare, plan.kernel};
  for (const void *kernel : both)
    check_cuda(cudaFuncSetAttribute(kernel, cudaFuncAttributePreferredSharedMemoryCarveout,
                                    plan.share_on_chip),
               "division of the memory on chip");
  plan_in_use_ = &plan;
  return plan;
}

LaunchPlan LaunchPlans::plan_of(const CallShape &call, const Kind &kind)
{
  LaunchPlan plan;
  plan.steps_ahead = kind.steps_ahead;
  const Program program = programs_.usable(call.program);
  plan.prepare = programs_.prepare(program);
  cudaFuncAttributes attributes;
  std::size_t most = 0;    // bytes on chip that a launch may ask for
  const auto plan_with = [&](Residency residency) {
    plan.kernel = programs_.advance(program, residency);
    plan.block = block_size(*programs_.shape(program, residency), call.largest);
    plan.sizes =
        programs_.sizes(program, residency, call.largest, call.pair_capacity, plan.steps_ahead);
    plan.dynamic = plan.sizes.shared;
    check_cuda(cudaFuncGetAttributes(&attributes, plan.kernel), "attributes of the kernel");
    most = device_.sharedMemPerBlockOptin - attributes.sharedSizeBytes - kReserved;
    plan.overflow_size = aligned(plan.sizes.beside);
  };
  Residency residency = residency_of(call, program);
  plan_with(residency);
  if (residency != Residency::Memory && plan.dynamic > most) {
    // an H200 has room for the largest kernel of each format, a GeForce card has less than half of it
    residency = Residency::Memory;
    plan_with(residency);
  }
  if (residency == Residency::Memory && plan.dynamic > most) {
    plan.dynamic = most / 16 * 16;
    plan.overflow_size = aligned(plan.sizes.shared);
  }
  plan.waits = waits_itself(device_.major, attributes);
  check_cuda(cudaFuncSetAttribute(plan.kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                  static_cast<int>(plan.dynamic)),
             "shared memory of the kernel");
  plan_in_use_ = nullptr;    // the kernel may be its
  int blocks_per_sm = 0;
  check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks_per_sm, plan.kernel, plan.block,
                                                           plan.dynamic),
             "occupancy");
  require(blocks_per_sm > 0, "no thread block of ", plan.block, " threads fits on this device");
  plan.blocks = blocks_per_sm * device_.multiProcessorCount;
  const std::size_t on_chip =
      blocks_per_sm * (plan.dynamic + attributes.sharedSizeBytes + kReserved);
  plan.share_on_chip =
      std::min(100,
               static_cast<int>((100 * on_chip + device_.sharedMemPerMultiprocessor - 1) /
                                device_.sharedMemPerMultiprocessor));
  return plan;
}

/// Whether some of its kernels know no details.
bool LaunchPlans::has_lean_kernels(Program program) const
{
  const auto shape = programs_.shape(programs_.usable(program), Residency::Large);
  return !shape || shape->lean;
}

Residency LaunchPlans::residency_of(const CallShape &call, Program program) const
{
  const auto serves = [&](Residency residency) {
    const auto shape = programs_.shape(program, residency);
    if (!shape || shape->items == 0 || call.largest > shape->capacity()) return false;
    if (shape->lean && call.with_details) return false;
    // of a warp that is not whole, with two items of a thread, sums end in an illegal instruction (CUDA 13.0)
    if (shape->items == 2 && block_size_ % 32 != 0) return false;
    // with threads of the user's choice
    return block_size_ == 0 ||
        (block_size_ <= shape->threads && call.largest <= shape->items * block_size_);
  };
  // A few RVEs take the kernel for many if it is loaded and theirs is not: compiling it takes
  // seconds to half a minute, which a few calls, such as time-step checks, do not gain back.
  const bool takes_many = fills_device(call) ||
      (programs_.is_at_hand(program, Residency::Many) &&
       !programs_.is_at_hand(program, Residency::Few));
  const Residency small = takes_many ? Residency::Many : Residency::Few;
  for (const Residency residency : {small, Residency::Large, Residency::Largest})
    if (serves(residency)) return residency;
  // where the kernels for many RVEs know no details
  const auto usual = programs_.shape(program, small);
  return usual && usual->lean && serves(Residency::Few) ? Residency::Few : Residency::Memory;
}

/// As few threads as can have all grains. Where they are in memory, a thread per grain while that is possible; beyond that all threads
/// have the same number of grains, nearly.
int LaunchPlans::block_size(const BlockShape &shape, int num_grains) const
{
  if (block_size_ > 0) return std::min(block_size_, shape.threads);
  if (shape.items > 0) return rounded_up((num_grains + shape.items - 1) / shape.items, 32);
  const int rounds = (num_grains + shape.threads - 1) / shape.threads;
  const int in_a_round = (num_grains + rounds - 1) / rounds;
  return rounded_up(in_a_round, 32);
}

}    // namespace rve
