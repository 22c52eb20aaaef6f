// The block program as CUDA kernels; one translation unit per number format instantiates them.

#ifndef RVE_ENGINE_CUDA_KERNELS_CUH
#define RVE_ENGINE_CUDA_KERNELS_CUH

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_cuda.cuh"
#include "rve/engine/cuda_kernels.h"

namespace rve {

inline namespace RVE_ISA {

  template <class Format>
  RVE_DEVICE PreparedCall<Format> &prepared_call(const LaunchRecord &launch, int place)
  {
    return *reinterpret_cast<PreparedCall<Format> *>(
        launch.prepared + static_cast<std::size_t>(place) * launch.prepared_size);
  }

  /// What is copied at a time.
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

  /// Begins all calls, ahead of the blocks: what one thread does alone for its RVE, the others of a block would wait for. A
  /// block has `launch.prepared_together` calls, on chip.
  template <class Format>
  __global__ void prepare_calls(const __grid_constant__ LaunchRecord launch,
                                const __grid_constant__ BatchConstants batch)
  {
    extern __shared__ __align__(16) char on_chip[];
    using Rare = RareWork<BlockCuda<false>, Format>;
    const int steps = launch.steps_ahead, first = blockIdx.x * launch.prepared_together;
    const int count = min(launch.prepared_together, launch.count - first);
    const auto call_of = [&](int r) -> PreparedCall<Format> & {
      return *reinterpret_cast<PreparedCall<Format> *>(on_chip + r * launch.prepared_size);
    };
    const int me = threadIdx.x, threads = blockDim.x;
#if __CUDA_ARCH__ >= 900
    cudaTriggerProgrammaticLaunchCompletion();    // the next kernel waits where it needs what is prepared here
#endif
    if (me == 0 && first == 0) *launch.queue = 0;
    // the drives come over the bus: in rows, and asked for before anything else is waited for
    constexpr int of_drive = kPieces<DriveRecord>, of_header = kPieces<ImageHeader>,
                  of_steering = kPieces<SteeringRecord>, together = 4;
    const bool has_drive = me < count * of_drive;
    FourWords drive;
    if (has_drive) drive = piece_of(launch.drives[first + me / of_drive], me % of_drive);
    for (int begin = me; begin < count * of_header; begin += together * threads) {
      FourWords piece[together];
#pragma unroll
      for (int m = 0; m < together; ++m) {
        const int k = begin + m * threads;
        if (k < count * of_header)
          piece[m] = reinterpret_cast<const FourWords *>(
              launch.rves[first + k / of_header].image)[k % of_header];
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
    for (int r = me; r < count; r += threads)
      Rare::prepare(call_of(r), launch.rves[first + r].image, launch.pair_capacity);
    __syncthreads();
    for (int k = me; k < count * steps; k += threads)
      if (k % steps < call_of(k / steps).plan_last)
        Rare::plan_step(call_of(k / steps), k % steps, 1);
    __syncthreads();
    auto *to = reinterpret_cast<FourWords *>(
        launch.prepared + static_cast<std::size_t>(first) * launch.prepared_size);
    for (int w = me; w < static_cast<int>(count * launch.prepared_size / sizeof(FourWords));
         w += threads)
      to[w] = reinterpret_cast<const FourWords *>(on_chip)[w];
  }

  /// Into the cache, from where it is read a few microseconds later.
  RVE_DEVICE void prefetch(const char *memory, std::size_t size)
  {
#if __CUDA_ARCH__ >= 900
    asm volatile("cp.async.bulk.prefetch.L2.global [%0], %1;" ::"l"(memory),
                 "r"(static_cast<unsigned>(size / 16 * 16)));
#endif
  }

  /// The place in the call of an entry of the queue; -1: there is none any more.
  RVE_DEVICE int place_of(const LaunchRecord &launch, int entry)
  {
    if (entry >= launch.count) return -1;
    return launch.order ? launch.order[entry] : entry;
  }

  /// The RVE of an entry that some block will take soon, and its prepared call.
  template <class Format> RVE_DEVICE void prefetch_entry(const LaunchRecord &launch, int entry)
  {
    const int place = place_of(launch, entry);
    if (place < 0) return;
    const RveHandle rve = launch.rves[place];
    prefetch(rve.image, image_size<Format>(rve.num_grains, 0));
    prefetch(launch.prepared + static_cast<std::size_t>(place) * launch.prepared_size,
             launch.prepared_size);
  }

  /// Capacity: of a block with a thread per grain; 0: grains live in memory, any number of them.
  template <class Format, int Capacity, bool General>
  RVE_DEVICE void advance_rves(const LaunchRecord &launch, const BatchConstants &batch)
  {
    extern __shared__ __align__(16) char on_chip[];
    __shared__ CudaScratch scratch;
    __shared__ CallState<Format> call;
    __shared__ int entry, next_entry;    // of the queue
    __shared__ int place;                // of the entry, in the call
    __shared__ int grains_in_views;      // what the views of the block are made for
    using Block = BlockCuda<(Capacity > 0)>;
    using Rare = RareWork<Block, Format>;
    char *memory = launch.memory + blockIdx.x * launch.memory_stride;
    Block block(scratch);
#if __CUDA_ARCH__ >= 900
    cudaGridDependencySynchronize();    // until all calls are prepared
#endif
    block.once([&] {
      next_entry = atomicAdd(launch.queue, 1);
      grains_in_views = -1;
    });
    for (;;) {
      block.once([&] {
        entry = next_entry;
        place = place_of(launch, entry);
      });
      if (place < 0) return;
      const auto *from = reinterpret_cast<const FourWords *>(&prepared_call<Format>(launch, place));
      auto *to = reinterpret_cast<FourWords *>(static_cast<PreparedCall<Format> *>(&call));
      block.for_each(
          static_cast<int>(launch.prepared_size / sizeof(FourWords)),
          [&](int w) {
            to[w] = from[w];
          },
          [&] {
            next_entry = atomicAdd(launch.queue, 1);
            // when this RVE is done, those are next
            prefetch_entry<Format>(launch, entry + gridDim.x);
          });
      const int n = call.num_grains;
      const SharedView<Format> shared = Capacity > 0
          ? carve_shared<Format>(on_chip, Capacity, true)
          : carve_shared<Format>(on_chip, launch.chip_size, memory + launch.overflow, n);
      if (n != grains_in_views) {
        __syncthreads();
        block.once([&] {
          Rare::set_views(call, n, shared, memory, launch.pair_capacity);
          grains_in_views = n;
        });
      }
      RveProgram<Block, Format, General> program(block, call, Capacity > 0 ? shared : call.shared);
      program.run(launch.answers[place], launch.details ? launch.details + place : nullptr);
    }
  }

  /// RVEs that share a multiprocessor, by the registers that a format needs: more of them hide latencies, fewer spill less.
  /// Measured on an H200 with 400 disks.
  template <class Format>
  constexpr int kSharers = sizeof(typename Format::Wide) == 4
      ? 3
      : (sizeof(typename Format::Real) == 4 ? 2 : 1);
  /// Without histories `double` has registers for two as well: what they spill is not of the steps.
  template <class Format>
  constexpr int kSharers<Frictionless<Format>> = sizeof(typename Format::Wide) == 4 ? 3 : 2;

  template <class Format, bool General>
  __global__ void __launch_bounds__(kSmallBlock, kSharers<Format>)
      advance_many(const __grid_constant__ LaunchRecord launch,
                   const __grid_constant__ BatchConstants batch)
  {
    advance_rves<Format, kSmallBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kSmallBlock, 1)
      advance_few(const __grid_constant__ LaunchRecord launch,
                  const __grid_constant__ BatchConstants batch)
  {
    advance_rves<Format, kSmallBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kLargeBlock)
      advance_large(const __grid_constant__ LaunchRecord launch,
                    const __grid_constant__ BatchConstants batch)
  {
    advance_rves<Format, kLargeBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kLargeBlock)
      advance_in_memory(const __grid_constant__ LaunchRecord launch,
                        const __grid_constant__ BatchConstants batch)
  {
    advance_rves<Format, 0, General>(launch, batch);
  }

  template <class Format>
  KernelSizes kernel_sizes(int num_grains, bool in_registers, int pair_capacity, int steps_ahead)
  {
    KernelSizes sizes;
    sizes.shared = shared_size<Format>(num_grains, in_registers);
    sizes.workspace = workspace_size<Format>(num_grains, pair_capacity);
    sizes.prepared = (PreparedCall<Format>::size_with(steps_ahead) + 15) / 16 * 16;
    return sizes;
  }

  template <class Format> KernelFunction kernel_for_few()
  {
    if constexpr (kSharers < Format >> 1)
      return advance_few<Format, false>;
    else    // the same
      return advance_many<Format, false>;
  }

  /// Of a scene that does not need General. Its calls are prepared by the kernels that make_cuda_kernels() names.
  template <class Format> SceneKernels make_plain_kernels()
  {
    return {{advance_many<Format, false>, kernel_for_few<Format>(), advance_large<Format, false>,
             advance_in_memory<Format, false>},
            nullptr,
            nullptr};
  }

  /// Blocks for scenes that need General are not made small: fewer kernels to compile.
  template <class Format> SceneKernels make_general_kernels()
  {
    return {{nullptr, nullptr, advance_large<Format, true>, advance_in_memory<Format, true>},
            prepare_calls<Format>,
            kernel_sizes<Format>};
  }

  /// In the order of SceneKind.
  template <class Format>
  CudaKernels make_cuda_kernels(SceneKernels frictionless, const SceneKernels &rolling)
  {
    static_assert(sizeof(CallState<Format>) == sizeof(CallState<Frictionless<Format>>),
                  "calls are prepared alike");
    SceneKernels plain = make_plain_kernels<Format>();
    const SceneKernels general = make_general_kernels<Format>();
    for (SceneKernels *scene : {&plain, &frictionless}) {
      scene->prepare = general.prepare;
      scene->sizes = general.sizes;
    }
    return {{plain, general, frictionless, rolling}};
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
