// What the CUDA engine and its kernels both know: launch records and sizes. NVRTC reads it, too, so it knows nothing of the host.

#ifndef RVE_ENGINE_CUDA_KERNELS_H
#define RVE_ENGINE_CUDA_KERNELS_H

#include "rve/algorithm/image.h"
#include "rve/engine/programs.h"

#include <cstddef>

namespace rve {

/// Where an RVE lives.
struct RveHandle {
  char *image;
  std::int32_t num_grains, extra_capacity;
};

/// What one call works on. Device pointers.
template <int D> struct LaunchRecord {
  const RveHandle *rves;                ///< (count)
  const DriveRecord<D> *drives;         ///< (count)
  const SteeringRecord<D> *steering;    ///< (count), or null
  const int *order;            ///< (count) positions in the call, longest first; null: as they come
  AnswerRecord<D> *answers;    ///< (count)
  DetailRecord<D> *details;    ///< (count), or null
  int count;
  int *queue;                   ///< next entry of `order` to take; preparing sets it to 0
  char *prepared;               ///< (count) PreparedCall with the plan of some steps
  std::size_t prepared_size;    ///< of one
  int steps_ahead;              ///< that are planned
  int prepared_together;        ///< calls that one block prepares
  char *memory;                 ///< a workspace per resident block
  std::size_t memory_stride;
  std::size_t chip_size;    ///< bytes on chip for RVEs of any number of grains
  std::size_t overflow;     ///< offset of what does not fit there, in the workspace
  int pair_capacity;
};

/// The kernel that prepares calls has at least so many threads for each: one for each piece of 16 bytes of a drive.
template <int D> constexpr int kThreadsPerCall = D == 2 ? 4 : 8;

/// Sizes that the host plans memory with.
struct KernelSizes {
  std::size_t shared, workspace, prepared;
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

/// Kernels of one program, functions of (LaunchRecord, BatchConstants).
struct ProgramKernels {
  const void *kernel[kNumResidencies];    ///< null where there is none: another residency serves
  /// Fills LaunchRecord::prepared, which is on chip meanwhile, and resets the queue. Null where another program's serves.
  const void *prepare;
};

}    // namespace rve

#endif
