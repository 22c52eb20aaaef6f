// What the CUDA engine knows of its kernels: launch records, sizes, and a table for each number format.

#ifndef RVE_ENGINE_CUDA_KERNELS_H
#define RVE_ENGINE_CUDA_KERNELS_H

#include "rve/algorithm/image.h"

#include <cstddef>

namespace rve {

/// What one launch works on. Device pointers.
struct LaunchRecord {
  char *const *images;               ///< (count) longest first
  const DriveRecord *drives;         ///< (count)
  const SteeringRecord *steering;    ///< (count), or null
  const int *order;                  ///< (count) positions in the call, longest first
  AnswerRecord *answers;             ///< (count)
  DetailRecord *details;             ///< (count), or null
  int count;
  int *queue;      ///< next entry of `order` to take
  char *memory;    ///< a workspace per resident block
  std::size_t memory_stride;
  std::size_t
      shared_offset;    ///< of the shared view within the workspace, when it does not fit on chip
  int pair_capacity;
  bool shared_on_chip;
};

using KernelFunction = void (*)(LaunchRecord, BatchConstants);

/// Sizes that the host plans memory with.
struct KernelSizes {
  std::size_t shared, workspace;
};

/// How a kernel keeps what the grains' threads work with, and for which blocks it is made.
enum class Residency {
  Many,    ///< a thread per grain, up to 416; registers for two or three RVEs on a multiprocessor
  Few,    ///< a thread per grain, up to 416; registers for one: the RVEs do not fill the device anyway
  Large,    ///< a thread per grain, up to 1024
  Memory    ///< any number of grains per thread
};
constexpr int kNumResidencies = 4;
constexpr int kSmallBlock = 416;
constexpr int kLargeBlock = 1024;

/// One number format's kernels. Null where there is none: another residency serves.
struct CudaKernels {
  KernelFunction kernel[kNumResidencies][kNumScenes];
  KernelSizes (*sizes)(int num_grains, int pair_capacity);
};

CudaKernels cuda_kernels_fast();
CudaKernels cuda_kernels_fast_relaxed();
CudaKernels cuda_kernels_mixed();
CudaKernels cuda_kernels_double();

}    // namespace rve

#endif
