// The block program as CUDA kernels; one translation unit per number format instantiates them.

#ifndef RVE_ENGINE_CUDA_KERNELS_CUH
#define RVE_ENGINE_CUDA_KERNELS_CUH

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_cuda.cuh"
#include "rve/engine/cuda_kernels.h"

namespace rve {

inline namespace RVE_ISA {

  /// Capacity: of a block with a thread per grain; 0: grains live in memory, any number of them.
  template <class Format, int Capacity, bool General>
  RVE_DEVICE void advance_rves(const LaunchRecord &launch, const BatchConstants &batch)
  {
    extern __shared__ __align__(16) char on_chip[];
    __shared__ CudaScratch scratch;
    __shared__ CallState<Format> call;
    __shared__ int next;
    using Block = BlockCuda<(Capacity > 0)>;
    char *memory = launch.memory + blockIdx.x * launch.memory_stride;
    const bool fetches = threadIdx.x == blockDim.x - 1;
    if (fetches) next = atomicAdd(launch.queue, 1);
    for (;;) {
      __syncthreads();
      const int taken = next;
      if (taken >= launch.count) return;
      __syncthreads();
      // the answer is needed only when this RVE is done
      if (fetches) next = atomicAdd(launch.queue, 1);
      const int k = launch.order[taken];
      char *image = launch.images[taken];
      const int n = reinterpret_cast<const ImageHeader *>(image)->num_grains;
      const SharedView<Format> shared = Capacity > 0
          ? carve_shared<Format>(on_chip, Capacity)
          : carve_shared<Format>(launch.shared_on_chip ? on_chip : memory + launch.shared_offset,
                                 n);
      Block block(scratch);
      RareWork<Block, Format>::begin(block, call, image, shared, memory, launch.pair_capacity,
                                     launch.drives[k],
                                     launch.steering ? launch.steering + k : nullptr, batch);
      RveProgram<Block, Format, General> program(block, call, shared);
      program.run(launch.answers[k], launch.details ? launch.details + k : nullptr);
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
      advance_many(const LaunchRecord launch, const BatchConstants batch)
  {
    advance_rves<Format, kSmallBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kSmallBlock, 1)
      advance_few(const LaunchRecord launch, const BatchConstants batch)
  {
    advance_rves<Format, kSmallBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kLargeBlock)
      advance_large(const LaunchRecord launch, const BatchConstants batch)
  {
    advance_rves<Format, kLargeBlock, General>(launch, batch);
  }

  template <class Format, bool General>
  __global__ void __launch_bounds__(kLargeBlock)
      advance_in_memory(const LaunchRecord launch, const BatchConstants batch)
  {
    advance_rves<Format, 0, General>(launch, batch);
  }

  template <class Format> KernelSizes kernel_sizes(int num_grains, int pair_capacity)
  {
    KernelSizes sizes;
    sizes.shared = shared_size<Format>(num_grains);
    sizes.workspace = workspace_size<Format>(num_grains, pair_capacity);
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
        kernel_sizes<Format>};
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
