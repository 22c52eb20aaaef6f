// The block program as a CUDA kernel, and the table of its instantiations: one translation unit per number format.

#ifndef RVE_ENGINE_CUDA_KERNELS_CUH
#define RVE_ENGINE_CUDA_KERNELS_CUH

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_cuda.cuh"

namespace rve {

/// What one launch works on. Device pointers.
struct LaunchRecord {
  char *const *images;          ///< (count) by position in the call
  const DriveRecord *drives;    ///< (count)
  const int *order;             ///< (count) longest first
  ResultRecord *results;        ///< (count)
  int count;
  int *queue;      ///< next entry of `order` to take
  char *memory;    ///< a workspace per resident block
  std::size_t memory_stride;
  std::size_t
      shared_offset;    ///< of the shared view within the workspace, when it does not fit on chip
  std::size_t items_offset;    ///< of per-item storage within the workspace
  int pair_capacity;
  bool shared_on_chip;
};

using KernelFunction = void (*)(LaunchRecord, BatchConstants);

/// Sizes that the host plans memory with.
struct KernelSizes {
  std::size_t shared, workspace, items;
};

/// One number format's kernels.
struct CudaKernels {
  KernelFunction kernel[2][kNumScenes];    ///< [one item per thread][SceneKind]
  KernelSizes (*sizes)(int num_grains, int pair_capacity);
};

CudaKernels cuda_kernels_fast();
CudaKernels cuda_kernels_mixed();
CudaKernels cuda_kernels_double();

template <class Format, bool OneItemPerThread, class Features>
__global__ void __launch_bounds__(1024) advance_kernel(LaunchRecord launch, BatchConstants batch)
{
  extern __shared__ __align__(16) char on_chip[];
  __shared__ CudaScratch scratch;
  __shared__ int taken;
  char *memory = launch.memory + blockIdx.x * launch.memory_stride;
  for (;;) {
    __syncthreads();
    if (threadIdx.x == 0) taken = atomicAdd(launch.queue, 1);
    __syncthreads();
    if (taken >= launch.count) return;
    const int k = launch.order[taken];
    char *image = launch.images[k];
    const auto &header = *reinterpret_cast<const ImageHeader *>(image);
    BlockCuda<OneItemPerThread> block(scratch, memory + launch.items_offset);
    RveProgram<BlockCuda<OneItemPerThread>, Format, Features> program(
        block, carve_image<Format>(image, header.num_grains, header.extra_capacity),
        carve_shared<Format>(launch.shared_on_chip ? on_chip : memory + launch.shared_offset,
                             header.num_grains),
        carve_workspace<Format>(memory, header.num_grains, launch.pair_capacity), launch.drives[k],
        batch);
    program.run(launch.results[k]);
  }
}

template <class Format> KernelSizes kernel_sizes(int num_grains, int pair_capacity)
{
  KernelSizes sizes;
  carve_shared<Format>(nullptr, num_grains, &sizes.shared);
  carve_workspace<Format>(nullptr, num_grains, pair_capacity, &sizes.workspace);
  sizes.items = sizeof(GrainState<Format>) * static_cast<std::size_t>(num_grains);
  return sizes;
}

template <class Format> CudaKernels make_cuda_kernels()
{
  using Plain = SceneFeatures<false, false>;
  using Viscous = SceneFeatures<true, false>;
  using Energy = SceneFeatures<true, true>;
  return {{{advance_kernel<Format, false, Plain>, advance_kernel<Format, false, Viscous>,
            advance_kernel<Format, false, Energy>},
           {advance_kernel<Format, true, Plain>, advance_kernel<Format, true, Viscous>,
            advance_kernel<Format, true, Energy>}},
          kernel_sizes<Format>};
}

}    // namespace rve

#endif
