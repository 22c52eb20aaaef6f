// SPDX-License-Identifier: GPL-2.0-only
// CUDA kernels. prepare_calls prepares the calls of RVEs. The kernels advance_... then advance the
// RVEs, each RVE with one thread block. There is a translation unit for each kernel variant and
// number format.

#pragma once

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_cuda.cuh"
#include "rve/engine/cuda_kernels.h"
#include "rve/engine/variant_configs.h"

namespace rve {

inline namespace RVE_ISA {

  template <class Config>
  RVE_DEVICE PreparedCall<Config> &prepared_call(const LaunchRecord<Config::D> &launch, int index)
  {
    return *reinterpret_cast<PreparedCall<Config> *>(
        launch.prepared + static_cast<std::size_t>(index) * launch.prepared_size);
  }

  /// Unit of copies between memory spaces: 16 bytes.
  struct alignas(16) FourWords {
    std::int32_t word[4];
  };

  template <class Record> RVE_DEVICE auto &piece_of(Record &record, int k)
  {
    static_assert(sizeof(Record) % sizeof(FourWords) == 0 && alignof(Record) == 16, "whole pieces");
    using Piece = std::conditional_t<std::is_const_v<Record>, const FourWords, FourWords>;
    return reinterpret_cast<Piece *>(&record)[k];
  }
  template <class Record> constexpr int kPieces = sizeof(Record) / sizeof(FourWords);

  /// Launch record of a kernel variant.
  template <KernelVariant variant, class Numbers>
  using LaunchOf = LaunchRecord<VariantConfig<variant, Numbers>::D>;

  /// Marks the calls that this block has prepared as ready. A block that waits for the mark sees
  /// all writes before it (release and acquire). One thread calls this function after a barrier.
  template <int D> RVE_DEVICE void tell_ready(const LaunchRecord<D> &launch)
  {
    asm volatile("st.release.gpu.global.u32 [%0], %1;" ::"l"(launch.ready + blockIdx.x),
                 "r"(launch.turn)
                 : "memory");
  }
  /// Waits until the call with this index is prepared. One thread calls this function before a
  /// barrier.
  template <int D> RVE_DEVICE void wait_until_ready(const LaunchRecord<D> &launch, int index)
  {
    const unsigned *const word = launch.ready + index / launch.prepared_together;
    unsigned turn;
    do {
      asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(turn) : "l"(word) : "memory");
    } while (turn != launch.turn);
  }

  /// Prepares the calls of all RVEs for the RVE kernel. One thread prepares the call of an RVE. If
  /// the RVE kernel did this, a whole block would wait for one thread. A block of this kernel
  /// prepares `launch.prepared_together` calls in shared memory.
  template <KernelVariant variant, class Numbers>
  __global__ void prepare_calls(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                                const __grid_constant__ BatchConstants batch)
  {
    extern __shared__ __align__(16) char on_chip[];
    using Config = VariantConfig<variant, Numbers>;
    using Begin = CallBegin<BlockCuda<0>, Config>;
    using Planning = StepPlanning<BlockCuda<0>, Config>;
    const int steps = launch.steps_ahead, first = blockIdx.x * launch.prepared_together;
    const int count = min(launch.prepared_together, launch.count - first);
    const auto call_of = [&](int r) -> PreparedCall<Config> & {
      return *reinterpret_cast<PreparedCall<Config> *>(on_chip + r * launch.prepared_size);
    };
    const int me = threadIdx.x, threads = blockDim.x;
#if __CUDA_ARCH__ >= 900
    // The device is allowed to place the blocks of the next kernel now. They wait for tell_ready()
    // before they read prepared calls.
    cudaTriggerProgrammaticLaunchCompletion();
#endif
    if (me == 0 && first == 0) *launch.queue = 0;
    // The DriveRecords are read from host memory over the bus, by coalesced loads that are issued
    // before all other loads.
    constexpr int of_drive = kPieces<DriveRecord<Config::D>>,
                  of_header = kPieces<StateHeader<Config::D>>,
                  of_steering = kPieces<SteeringRecord<Config::D>>, together = 4;
    const bool has_drive = me < count * of_drive;    // see kThreadsPerCall
    static_assert(of_drive <= kThreadsPerCall<Config::D>, "a thread for each piece of a drive");
    FourWords drive;
    if (has_drive) drive = piece_of(launch.drives[first + me / of_drive], me % of_drive);
    for (int begin = me; begin < count * of_header; begin += together * threads) {
      FourWords piece[together];
#pragma unroll
      for (int m = 0; m < together; ++m) {
        const int k = begin + m * threads;
        if (k < count * of_header)
          piece[m] = reinterpret_cast<const FourWords *>(
              launch.rves[first + k / of_header].device_state)[k % of_header];
      }
#pragma unroll
      for (int m = 0; m < together; ++m) {
        const int k = begin + m * threads;
        if (k < count * of_header)
          piece_of(call_of(k / of_header).header, k % of_header) = piece[m];
      }
    }
    for (int k = me; k < count * of_steering; k += threads)
      piece_of(call_of(k / of_steering).steering, k % of_steering) = launch.steering
          ? piece_of(launch.steering[first + k / of_steering], k % of_steering)
          : FourWords{{0, 0, 0, 0}};
    if (has_drive) piece_of(call_of(me / of_drive).drive, me % of_drive) = drive;
    for (int r = me; r < count; r += threads) call_of(r).batch = batch;
    __syncthreads();
    for (int r = me; r < count; r += threads) {
      Begin::prepare(call_of(r), launch.rves[first + r].device_state, launch.pair_capacity);
      if (launch.hold && *launch.hold > 0)
        call_of(r).status |= status::NonFinite;                   // the answer is discarded
      call_of(r).plan_last = min(call_of(r).plan_last, steps);    // the block plans the other steps
    }
    __syncthreads();
    for (int k = me; k < count * steps; k += threads)
      if (k % steps < call_of(k / steps).plan_last)
        Planning::plan_step(call_of(k / steps), k % steps, 1);
    __syncthreads();
    auto *to = reinterpret_cast<FourWords *>(
        launch.prepared + static_cast<std::size_t>(first) * launch.prepared_size);
    for (int w = me; w < static_cast<int>(count * launch.prepared_size / sizeof(FourWords));
         w += threads)
      to[w] = reinterpret_cast<const FourWords *>(on_chip)[w];
    __syncthreads();
    if (me == 0) tell_ready(launch);
  }

  /// Prefetches memory into the L2 cache. The memory is read a few microseconds later.
  RVE_DEVICE void prefetch(const char *memory, std::size_t size)
  {
#if __CUDA_ARCH__ >= 900
    asm volatile("cp.async.bulk.prefetch.L2.global [%0], %1;" ::"l"(memory),
                 "r"(static_cast<unsigned>(size / 16 * 16)));
#endif
  }

  /// Returns the index, in the call, of the RVE at an entry of the queue; -1 after the last entry.
  template <int D> RVE_DEVICE int index_of(const LaunchRecord<D> &launch, int entry)
  {
    if (entry >= launch.launched) return -1;
    return launch.order ? launch.order[entry] : entry;
  }

  /// Returns the address for the details of an RVE; null if its details are not requested.
  template <int D> RVE_DEVICE DetailRecord<D> *detail_at(const LaunchRecord<D> &launch, int index)
  {
    if (!launch.details || !launch.detail_of)
      return launch.details ? launch.details + index : nullptr;
    const int mine = launch.detail_of[index];
    return mine < 0 ? nullptr : launch.details + mine;
  }

  /// Prefetches the RVE at an entry of the queue that a block will take soon, and its prepared
  /// call.
  template <class Config>
  RVE_DEVICE void prefetch_entry(const LaunchRecord<Config::D> &launch, int entry)
  {
    const int index = index_of(launch, entry);
    if (index < 0) return;
    const RveHandle rve = launch.rves[index];
    prefetch(rve.device_state, device_state_size<Config>(rve.num_grains, 0));
    prefetch(launch.prepared + static_cast<std::size_t>(index) * launch.prepared_size,
             launch.prepared_size);
  }

  /// Returns views of the memory in which a block keeps the working data of its steps. `Capacity`
  /// is the largest number of grains in registers, or 0 for any number of grains in memory.
  template <class Config, int Capacity>
  RVE_DEVICE SharedView<Config> view_of_block(char *on_chip, std::size_t chip_size, char *memory,
                                              int num_grains)
  {
    if constexpr (Capacity == 0)
      return carve_shared<Config>(on_chip, chip_size, memory, num_grains);
    else if constexpr (Config::D == 2)
      return carve_shared<Config>(on_chip, Capacity, true);
    else
      return carve_shared_beside<Config>(on_chip, Capacity, memory, num_grains);
  }

  /// Returns the number of steps that a block plans at a time in the kernel of a residency; 0 for
  /// the default. The number depends on how much shared memory the grains of the RVEs on a
  /// multiprocessor leave free. Measured on an H200 in `fast`: two RVEs of 1000 spheres leave
  /// memory for 176 steps each, which is 1 % faster than 64 steps. A single RVE leaves memory for
  /// 256 steps, which is 1.5 % faster. Three RVEs of disks plan 64 steps each, 3 % faster than 32.
  /// A single RVE of disks plans 256 steps, 5 % faster. GPUs with less than 200 KB of shared memory
  /// use the default. A kernel with a servo plans one step at a time, and the memory is used for
  /// more RVEs.
  template <class Config, Residency residency> RVE_HD constexpr int plan_steps_beside()
  {
    // The shared memory of these kernels is full already.
    if (residency == Residency::Memory && Config::D == 3) return kStepsAhead;
    if (residency == Residency::Many && Config::D == 2 && Config::steers &&
        !Config::has_bookkeeping)
      return kStepsAhead;
#if __CUDA_ARCH__ == 900 || __CUDA_ARCH__ == 1000 || __CUDA_ARCH__ == 1030
    if (Config::D == 2 && sizeof(typename Config::Wide) == 4 &&
        (Config::has_bookkeeping || !Config::steers)) {
      if (residency == Residency::Many) return 64;
      if (residency == Residency::Few) return 256;
    }
    if (Config::D == 3 && sizeof(typename Config::Wide) == 4) {
      if (residency == Residency::Large) return 176;
      if (residency == Residency::Few || residency == Residency::Largest) return 256;
    }
#endif
    return 0;
  }

  template <class PlainConfig, Residency residency>
  RVE_DEVICE void advance_rves(const LaunchRecord<PlainConfig::D> &launch,
                               const BatchConstants &batch)
  {
    using Config =
        PlacedConfig<WithPlan<PlainConfig, plan_steps_beside<PlainConfig, residency>()>, residency>;
    constexpr BlockShape shape = block_shape<Config>(residency);
    constexpr int Capacity = shape.capacity();
    extern __shared__ __align__(16) char on_chip[];
    __shared__ CallState<Config> call;
    __shared__ int entry, next_entry;    // entries of the queue
    __shared__ int index;                // index of the entry in the call
    __shared__ int grains_in_views;      // number of grains for which the views were set
    using Block = BlockCuda<shape.items, shape.threads, Capacity>;
    static_assert(shape.lean == KernelTraits<Block, Config>::uniform_constants,
                  "without details, or with them");
    using Begin = CallBegin<Block, Config>;
    char *memory = launch.memory + blockIdx.x * launch.memory_stride;
    Block block;
    block.once([&] {
      wait_until_ready(launch, 0);    // first calls are prepared, queue is reset
      next_entry = atomicAdd(launch.queue, 1);
      grains_in_views = -1;
    });
    for (;;) {
      block.once([&] {
        entry = next_entry;
        index = index_of(launch, entry);
        if (index >= launch.prepared_together) wait_until_ready(launch, index);
      });
      if (index < 0) {
#if __CUDA_ARCH__ >= 900
        cudaGridDependencySynchronize();    // later kernels run after both kernels
#endif
        return;
      }
      const auto *from = reinterpret_cast<const FourWords *>(&prepared_call<Config>(launch, index));
      auto *to = reinterpret_cast<FourWords *>(static_cast<PreparedCall<Config> *>(&call));
      block.for_each(
          static_cast<int>(launch.prepared_size / sizeof(FourWords)),
          [&](int w) { to[w] = from[w]; },
          [&] {
            next_entry = atomicAdd(launch.queue, 1);
            // Blocks take these entries when they have finished their present RVEs.
            prefetch_entry<Config>(launch, entry + gridDim.x);
          });
      const int n = call.num_grains;
      const SharedView<Config> shared =
          view_of_block<Config, Capacity>(on_chip, launch.chip_size, memory + launch.overflow, n);
      if (n != grains_in_views) {
        __syncthreads();
        block.once([&] {
          Begin::set_views(call, n, shared, memory, launch.pair_capacity);
          grains_in_views = n;
        });
      }
      RveKernel<Block, Config> variant(block, call, Capacity > 0 ? shared : call.shared);
      variant.run(launch.answers[index], detail_at(launch, index));
    }
  }

  template <KernelVariant variant, class Numbers, Residency residency>
  constexpr BlockShape kShape = block_shape<VariantConfig<variant, Numbers>>(residency);

  template <KernelVariant variant, class Numbers>
  __global__ void __launch_bounds__((kShape<variant, Numbers, Residency::Many>.threads),
                                    (kShape<variant, Numbers, Residency::Many>.sharers))
      advance_many(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                   const __grid_constant__ BatchConstants batch)
  {
    advance_rves<VariantConfig<variant, Numbers>, Residency::Many>(launch, batch);
  }

  template <KernelVariant variant, class Numbers>
  __global__ void __launch_bounds__((kShape<variant, Numbers, Residency::Few>.threads),
                                    (kShape<variant, Numbers, Residency::Few>.sharers))
      advance_few(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                  const __grid_constant__ BatchConstants batch)
  {
    advance_rves<VariantConfig<variant, Numbers>, Residency::Few>(launch, batch);
  }

  template <KernelVariant variant, class Numbers>
  __global__ void __launch_bounds__((kShape<variant, Numbers, Residency::Large>.threads),
                                    (kShape<variant, Numbers, Residency::Large>.sharers))
      advance_large(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                    const __grid_constant__ BatchConstants batch)
  {
    advance_rves<VariantConfig<variant, Numbers>, Residency::Large>(launch, batch);
  }

  template <KernelVariant variant, class Numbers>
  __global__ void __launch_bounds__((kShape<variant, Numbers, Residency::Largest>.threads),
                                    (kShape<variant, Numbers, Residency::Largest>.sharers))
      advance_largest(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                      const __grid_constant__ BatchConstants batch)
  {
    advance_rves<VariantConfig<variant, Numbers>, Residency::Largest>(launch, batch);
  }

  template <KernelVariant variant, class Numbers>
  __global__ void __launch_bounds__((kShape<variant, Numbers, Residency::Memory>.threads),
                                    (kShape<variant, Numbers, Residency::Memory>.sharers))
      advance_in_memory(const __grid_constant__ LaunchOf<variant, Numbers> launch,
                        const __grid_constant__ BatchConstants batch)
  {
    advance_rves<VariantConfig<variant, Numbers>, Residency::Memory>(launch, batch);
  }

  template <int D> const void *address_of(void (*kernel)(LaunchRecord<D>, BatchConstants))
  {
    return reinterpret_cast<const void *>(kernel);
  }

  template <KernelVariant variant, class Numbers> VariantKernels make_variant_kernels()
  {
    using Traits = VariantTraits<variant>;
    using Config = VariantConfig<variant, Numbers>;
    static_assert(sizeof(PreparedCall<Config>) ==
                      sizeof(PreparedCall<VariantConfig<Traits::prepared_like, Numbers>>),
                  "calls are prepared alike");
    VariantKernels kernels = {};
    auto &kernel = kernels.kernel;
    const auto index = [&](Residency residency, const void *function) {
      kernel[static_cast<int>(residency)] = function;
    };
    if constexpr (block_shape<Config>(Residency::Many).items > 0) {
      index(Residency::Many, address_of(advance_many<variant, Numbers>));
      if constexpr (same_shape(block_shape<Config>(Residency::Few),
                               block_shape<Config>(Residency::Many)))
        index(Residency::Few, address_of(advance_many<variant, Numbers>));
      else
        index(Residency::Few, address_of(advance_few<variant, Numbers>));
    }
    if constexpr (block_shape<Config>(Residency::Large).items > 0)
      index(Residency::Large, address_of(advance_large<variant, Numbers>));
    if constexpr (block_shape<Config>(Residency::Largest).items > 0)
      index(Residency::Largest, address_of(advance_largest<variant, Numbers>));
    index(Residency::Memory, address_of(advance_in_memory<variant, Numbers>));
    if constexpr (Traits::prepared_like == variant)
      kernels.prepare = address_of(prepare_calls<variant, Numbers>);
    return kernels;
  }

}    // namespace RVE_ISA
}    // namespace rve
