// SPDX-License-Identifier: GPL-2.0-only
// Launch records and sizes that the CUDA engine and its kernels share. NVRTC compiles this header,
// so it includes no host headers.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/algorithm/kernel_config.h"
#include "rve/core/config.h"
#include "rve/engine/kernel_variants.h"

#include <cstddef>
#include <type_traits>

namespace rve {

/// Device state of an RVE: its address and sizes.
struct RveHandle {
  char *device_state;
  std::int32_t num_grains, extra_capacity;
};

/// Arguments of a launch. Pointers are device pointers.
template <int D> struct LaunchRecord {
  const RveHandle *rves;                ///< (count)
  const DriveRecord<D> *drives;         ///< (count)
  const SteeringRecord<D> *steering;    ///< (count), or null
  const int *order;    ///< (count) indices in the call, longest first; null: order of the call
  AnswerRecord<D> *answers;    ///< (count)
  DetailRecord<D> *details;    ///< (count), or as many as detail_of has, or null
  /// (count) index of the details of each RVE, -1: none; null: all have details
  const int *detail_of;
  int count, launched;          ///< the first `launched` entries of `order` are launched
  int *queue;                   ///< next entry of `order`; reset by the preparation
  const int *hold;              ///< *hold > 0: no RVE moves, and all calls fail; null: no effect
  char *prepared;               ///< (count) PreparedCall with the plan of some steps
  std::size_t prepared_size;    ///< bytes of one prepared call
  int steps_ahead;              ///< planned steps
  int prepared_together;        ///< calls that one block prepares
  /// (count / prepared_together, rounded up) mark of the calls that one block prepares; it equals
  /// `turn` when they are ready
  unsigned *ready;
  unsigned turn;    ///< number of this launch, which differs from all earlier ones
  char *memory;     ///< a workspace per resident block
  std::size_t memory_stride;
  std::size_t chip_size;    ///< shared memory for RVEs of any number of grains [bytes]
  std::size_t overflow;     ///< offset in the workspace of the part beyond shared memory
  int pair_capacity;
};

/// Smallest number of threads per call in the kernel that prepares calls: one for each 16 bytes of
/// a DriveRecord.
template <int D> constexpr int kThreadsPerCall = D == 2 ? 4 : 8;

/// Sizes from which the host allocates memory [bytes].
struct KernelSizes {
  std::size_t shared;    ///< shared memory of the steps
  std::size_t beside;    ///< global memory of the steps
  std::size_t workspace, prepared;
};

/// Storage of the working data of the grains: registers or memory. block_shape() has the block
/// sizes for each kind of storage.
enum class Residency {
  Many,       ///< small RVEs; a multiprocessor has registers for several of them
  Few,        ///< small RVEs that do not fill the device; registers for one
  Large,      ///< up to 1024 grains
  Largest,    ///< up to 2048 spheres in `fast`, one RVE on a multiprocessor
  Memory      ///< any number of grains
};
constexpr int kNumResidencies = 5;
constexpr int kSmallBlock = 416;
constexpr int kSteeredBlock = 224;    ///< kSmallBlock / 2, rounded up to whole warps
constexpr int kLargeBlock = 1024;

/// Block size of a kernel. `items` is the number of grains per thread in registers (0: any number
/// of grains, in memory), `threads` the largest number of threads of a block, `sharers` the number
/// of blocks for which a multiprocessor must have registers.
struct BlockShape {
  int items, threads, sharers;
  /// True if the kernel computes no details. It is then small, as CudaHints::uniform requires, and
  /// calls with details use another residency.
  bool lean = false;
  /// Number of grains for which shared memory suffices, if that is below the capacity of the
  /// threads; otherwise 0.
  int most_grains = 0;
  RVE_HD constexpr int capacity() const { return most_grains > 0 ? most_grains : items * threads; }
};
RVE_HD constexpr bool same_shape(const BlockShape &one, const BlockShape &other)
{
  return one.items == other.items && one.threads == other.threads && one.sharers == other.sharers;
}

/// Returns the block shape of a kernel configuration for a residency.
///
/// Disks: one grain per thread. More RVEs on a multiprocessor hide latencies better; fewer RVEs
/// have fewer register spills. `fast` has three RVEs per multiprocessor. `mixed` has two, and so
/// have variants with all bookkeeping, where two are faster than three. `double` has one, or two
/// without friction: without histories its spills are outside the steps. Measured on an H200 and an
/// H100 with 400 disks.
///
/// Disks with a servo and without bookkeeping: one thread of an RVE computes the servo and plans
/// steps while the others wait, and no grain stays in registers between steps. So a thread has two
/// grains, and a multiprocessor has as many RVEs as fit into its shared memory (228 KB). These RVEs
/// compute in turn. The result is 25 % more steps per second than with one grain per thread.
///
/// Spheres: two grains per thread. In `fast` two RVEs of a multiprocessor hide latencies of each
/// other. In `mixed`, and in variants with a servo or bookkeeping, a thread has twice the
/// registers, since spilling costs more than fewer resident threads. In `double` histories do not
/// fit even into these registers, so they are streamed from memory (streams_history). `double`
/// variants with a servo or bookkeeping stream all data of a grain (InMemory). Measured on an H200
/// with 1000 spheres.
template <class Config> RVE_HD constexpr BlockShape block_shape(Residency residency)
{
  const bool wide = sizeof(typename Config::Wide) > 4, all_wide = sizeof(typename Config::Real) > 4;
  if constexpr (Config::D == 2) {
    const int sharers =
        all_wide && Config::has_friction ? 1 : (wide || Config::has_bookkeeping ? 2 : 3);
    switch (residency) {
      case Residency::Many:
        if (Config::steers && !Config::has_bookkeeping)
          return {2, kSteeredBlock, all_wide ? 2 : (wide ? 4 : 5), false, kSmallBlock};
        return {1, kSmallBlock, sharers};
      case Residency::Few:    // one kernel less with all bookkeeping, since it compiles slowly
        return {1, kSmallBlock, Config::has_bookkeeping ? sharers : 1};
      case Residency::Large:
        return {1, kLargeBlock, 1};
      default:
        return {0, kLargeBlock, 1};
    }
  } else {
    const bool lean = !Config::steers;
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

/// Kernel configuration of a residency.
template <class Config, Residency residency>
using PlacedConfig =
    std::conditional_t<residency == Residency::Memory && Config::D == 3, InMemory<Config>, Config>;

/// Kernels of one variant, functions of (LaunchRecord, BatchConstants).
struct VariantKernels {
  /// Kernel of each residency; null where there is none and another residency is used.
  const void *kernel[kNumResidencies];
  /// Kernel that fills LaunchRecord::prepared through shared memory and resets the queue. It is
  /// null if the kernel of another variant prepares the calls.
  const void *prepare;
};

}    // namespace rve
