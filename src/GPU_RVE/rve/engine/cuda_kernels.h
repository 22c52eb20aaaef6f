// SPDX-License-Identifier: GPL-2.0-only
// What the CUDA engine and its kernels both know: launch records and sizes. NVRTC reads it, too, so it knows nothing of the host.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/algorithm/scene.h"
#include "rve/core/config.h"
#include "rve/engine/programs.h"

#include <cstddef>
#include <type_traits>

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
  DetailRecord<D> *details;    ///< (count), or as many as detail_of says, or null
  const int *detail_of;        ///< (count) which of them is whose, -1: none; null: each has its own
  int count, launched;         ///< those launched are the first ones of `order`
  int *queue;                  ///< next entry of `order` to take; preparing sets it to 0
  const int *hold;             ///< if above zero no RVE moves, all fail; null: they go
  char *prepared;              ///< (count) PreparedCall with the plan of some steps
  std::size_t prepared_size;    ///< of one
  int steps_ahead;              ///< that are planned
  int prepared_together;        ///< calls that one block prepares
  unsigned *ready;    ///< (count / prepared_together) `turn` when the calls of a block are prepared
  unsigned turn;      ///< of this launch: another one than that of all before
  char *memory;       ///< a workspace per resident block
  std::size_t memory_stride;
  std::size_t chip_size;    ///< bytes on chip for RVEs of any number of grains
  std::size_t overflow;     ///< offset of what does not fit there, in the workspace
  int pair_capacity;
};

/// The kernel that prepares calls has at least so many threads for each: one for each piece of 16 bytes of a drive.
template <int D> constexpr int kThreadsPerCall = D == 2 ? 4 : 8;

/// Sizes that the host plans memory with [bytes].
struct KernelSizes {
  std::size_t shared;    ///< of what the steps work on: on chip
  std::size_t beside;    ///< of what of it is in memory
  std::size_t workspace, prepared;
};

/// How a kernel keeps what the grains' threads work with, and for which blocks it is made (block_shape).
enum class Residency {
  Many,       ///< small RVEs, registers for several of them on a multiprocessor
  Few,        ///< registers for one: the RVEs do not fill the device anyway
  Large,      ///< up to 1024 grains
  Largest,    ///< up to 2048 spheres in `fast`, one RVE on a multiprocessor
  Memory      ///< any number of grains
};
constexpr int kNumResidencies = 5;
constexpr int kSmallBlock = 416;
constexpr int kSteeredBlock = 224;    ///< whole warps for half as many grains
constexpr int kLargeBlock = 1024;

/// Grains of a thread, in its registers (0: any number, in memory), the most threads of a block, and the blocks that a multiprocessor shall
/// have registers for.
struct BlockShape {
  int items, threads, sharers;
  /// Without what looks at details: the kernel is small, which CudaHints::uniform wants. A call with details takes another residency.
  bool lean = false;
  /// That have room on chip, where they are fewer than those of all threads.
  int most_grains = 0;
  RVE_HD constexpr int capacity() const { return most_grains > 0 ? most_grains : items * threads; }
};
RVE_HD constexpr bool same_shape(const BlockShape &one, const BlockShape &other)
{
  return one.items == other.items && one.threads == other.threads && one.sharers == other.sharers;
}

/// Disks: a thread per grain. More RVEs on a multiprocessor hide latencies, fewer spill less: with all books two are faster than three. Without
/// histories `double` has registers for two as well: what they spill is not of the steps. Measured on an H200 and an H100 with 400 disks.
/// With a servo one thread of an RVE steers and plans while the others wait, and no grain stays in registers from step to step: two grains of a
/// thread, and as many RVEs as have room on chip (228 KB), so that others work meanwhile. 25 % more steps per second than with a thread per grain.
///
/// Spheres: two grains of a thread. In `fast` two RVEs of a multiprocessor hide what one waits for. In `mixed` and in programs with books a thread
/// has twice the registers: what would be spilled costs more than that fewer threads wait for each other. In `double` histories would not fit
/// even there: they pass by (streams_history), and all of a grain does in programs with books (InMemory). Measured on an H200 with 1000 spheres.
template <class Scene> RVE_HD constexpr BlockShape block_shape(Residency residency)
{
  const bool wide = sizeof(typename Scene::Wide) > 4, all_wide = sizeof(typename Scene::Real) > 4;
  if constexpr (Scene::D == 2) {
    const int sharers = all_wide && Scene::has_friction ? 1 : (wide || Scene::books ? 2 : 3);
    switch (residency) {
      case Residency::Many:
        if (Scene::steers && !Scene::books)
          return {2, kSteeredBlock, all_wide ? 2 : (wide ? 4 : 5), false, kSmallBlock};
        return {1, kSmallBlock, sharers};
      case Residency::Few:    // with all books a kernel less, which takes long to compile
        return {1, kSmallBlock, Scene::books ? sharers : 1};
      case Residency::Large:
        return {1, kLargeBlock, 1};
      default:
        return {0, kLargeBlock, 1};
    }
  } else {
    const bool lean = !Scene::steers;
    if (all_wide && !lean) return {0, 512, 1};
    switch (residency) {
      case Residency::Many:
        return {2, 256, wide || !lean ? 2 : 4, lean};
      case Residency::Few:
        return {wide ? 2 : 1, wide ? 512 : 1024, 1, wide && lean};
      case Residency::Large:
        return {2, 512, wide || !lean ? 1 : 2, lean};
      case Residency::Largest:
        if (wide) return {0, 512, 1};
        return {2, kLargeBlock, 1, lean};
      default:
        return {0, 512, 1};
    }
  }
}

/// A scene as a residency has it.
template <class Scene, Residency residency>
using PlacedScene =
    std::conditional_t<residency == Residency::Memory && Scene::D == 3, InMemory<Scene>, Scene>;

/// Kernels of one program, functions of (LaunchRecord, BatchConstants).
struct ProgramKernels {
  const void *kernel[kNumResidencies];    ///< null where there is none: another residency serves
  /// Fills LaunchRecord::prepared, which is on chip meanwhile, and resets the queue. Null where another program's serves.
  const void *prepare;
};

}    // namespace rve
