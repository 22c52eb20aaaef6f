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

  /// Copies `size` bytes, or zeros from nowhere, by `count` threads of which this is number `me`. Whole pieces of T, aligned.
  template <class T>
  RVE_DEVICE void copy_by(int me, int count, const void *from, void *to, std::size_t size)
  {
    for (int w = me; w < static_cast<int>(size / sizeof(T)); w += count)
      static_cast<T *>(to)[w] = from ? static_cast<const T *>(from)[w] : T();
  }

  struct alignas(16) FourWords {
    std::int32_t word[4];
  };

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
    const int me = threadIdx.x, threads = blockDim.x, lane = me % 32;
    for (int r = me / 32; r < count; r += threads / 32) {
      PreparedCall<Format> &call = call_of(r);
      const int place = first + r;
      copy_by<std::int32_t>(lane, 32, &launch.drives[place], &call.drive, sizeof(DriveRecord));
      copy_by<FourWords>(lane, 32, launch.rves[place].image, &call.header, sizeof(ImageHeader));
      copy_by<std::int32_t>(lane, 32, launch.steering ? launch.steering + place : nullptr,
                            &call.steering, sizeof(SteeringRecord));
      if (lane == 0) call.batch = batch;
    }
    __syncthreads();
    for (int r = me; r < count; r += threads)
      Rare::prepare(call_of(r), launch.rves[first + r].image, launch.pair_capacity);
    __syncthreads();
    for (int k = me; k < count * steps; k += threads)
      if (k % steps < call_of(k / steps).plan_last)
        Rare::plan_step(call_of(k / steps), k % steps, 1);
    __syncthreads();
    copy_by<FourWords>(me, threads, on_chip,
                       launch.prepared + static_cast<std::size_t>(first) * launch.prepared_size,
                       count * launch.prepared_size);
  }

  /// An RVE that a block has taken from the queue.
  struct Taken {
    RveHandle rve;
    int place;    ///< in the call; -1: there is none left
  };

  /// Into the cache, from where it is read a few microseconds later.
  RVE_DEVICE void prefetch(const char *memory, std::size_t size)
  {
    asm volatile("cp.async.bulk.prefetch.L2.global [%0], %1;" ::"l"(memory),
                 "r"(static_cast<unsigned>(size / 16 * 16)));
  }

  /// The RVE of an entry of the queue. By one thread.
  template <class Format> RVE_DEVICE Taken take_rve(const LaunchRecord &launch, int entry)
  {
    if (entry >= launch.count) return Taken{{nullptr, 0, 0}, -1};
    const int place = launch.order ? launch.order[entry] : entry;
    const RveHandle rve = launch.rves[place];
    prefetch(rve.image, image_size<Format>(rve.num_grains, 0));
    prefetch(launch.prepared + static_cast<std::size_t>(place) * launch.prepared_size,
             launch.prepared_size);
    return Taken{rve, place};
  }

  /// Capacity: of a block with a thread per grain; 0: grains live in memory, any number of them.
  template <class Format, int Capacity, bool General>
  RVE_DEVICE void advance_rves(const LaunchRecord &launch, const BatchConstants &batch)
  {
    extern __shared__ __align__(16) char on_chip[];
    __shared__ CudaScratch scratch;
    __shared__ CallState<Format> call;
    // the next RVE is fetched while this one is loaded, one wait for memory in a phase
    __shared__ int next_entry;
    __shared__ Taken next;
    using Block = BlockCuda<(Capacity > 0)>;
    using Rare = RareWork<Block, Format>;
    char *memory = launch.memory + blockIdx.x * launch.memory_stride;
    Block block(scratch);
    int grains_in_views = -1;    // what the views of the block are made for
    block.once([&] {
      next = take_rve<Format>(launch, atomicAdd(launch.queue, 1));
    });
    for (;;) {
      const Taken taken = next;
      if (taken.place < 0) return;
      const int n = taken.rve.num_grains;
      const SharedView<Format> shared = Capacity > 0
          ? carve_shared<Format>(on_chip, Capacity)
          : carve_shared<Format>(on_chip, launch.chip_size, memory + launch.overflow, n);
      const auto *from =
          reinterpret_cast<const FourWords *>(&prepared_call<Format>(launch, taken.place));
      auto *to = reinterpret_cast<FourWords *>(static_cast<PreparedCall<Format> *>(&call));
      block.for_each(
          static_cast<int>(launch.prepared_size / sizeof(FourWords)),
          [&](int w) {
            to[w] = from[w];
          },
          [&] {
            next_entry = atomicAdd(launch.queue, 1);
            if (n == grains_in_views) return;
            Rare::set_views(call, n, shared, memory, launch.pair_capacity);
            grains_in_views = n;
          });
      Rare::begin(block, call, shared, [&] {
        next = take_rve<Format>(launch, next_entry);
      });
      RveProgram<Block, Format, General> program(block, call, Capacity > 0 ? shared : call.shared);
      program.run(launch.answers[taken.place],
                  launch.details ? launch.details + taken.place : nullptr);
    }
  }

  /// RVEs that share a multiprocessor, by the registers that a format needs: more of them hide latencies, fewer spill less.
  /// Measured on an H200 with 400 disks.
  template <class Format>
  constexpr int kSharers = sizeof(typename Format::Wide) == 4
      ? 3
      : (sizeof(typename Format::Real) == 4 ? 2 : 1);

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
  KernelSizes kernel_sizes(int num_grains, int pair_capacity, int steps_ahead)
  {
    KernelSizes sizes;
    sizes.shared = shared_size<Format>(num_grains);
    sizes.workspace = workspace_size<Format>(num_grains, pair_capacity);
    sizes.prepared = (PreparedCall<Format>::size_with(steps_ahead) + 15) / 16 * 16;
    return sizes;
  }

  /// Blocks for scenes that need General are not made small: fewer kernels to compile.
  template <class Format> CudaKernels make_cuda_kernels()
  {
    return {
        {{advance_many<Format, false>, nullptr},
         {kSharers<Format> > 1 ? advance_few<Format, false> : advance_many<Format, false>, nullptr},
         {advance_large<Format, false>, advance_large<Format, true>},
         {advance_in_memory<Format, false>, advance_in_memory<Format, true>}},
        prepare_calls<Format>,
        kernel_sizes<Format>};
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
