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
  const int *order;    ///< (count) indices in the call, longest RVE first; null: order of the call
  AnswerRecord<D> *answers;    ///< (count)
  DetailRecord<D> *details;    ///< (count) or fewer if detail_of is set; null: no details
  /// (count) index of the details of each RVE, -1: no details; null: all RVEs have details
  const int *detail_of;
  int count, launched;          ///< the first `launched` entries of `order` are launched
  int *queue;                   ///< next entry of `order` to run; prepare_calls resets it
  const int *hold;              ///< *hold > 0: all calls fail and no RVE moves; null: no effect
  char *prepared;               ///< (count) PreparedCall with the plan of some steps
  std::size_t prepared_size;    ///< bytes of one prepared call
  int steps_ahead;              ///< planned steps
  int prepared_together;        ///< calls that one block prepares
  /// (count / prepared_together, rounded up) one mark for the calls that one block prepares; it
  /// equals `turn` when these calls are ready
  unsigned *ready;
  unsigned turn;    ///< number of this launch; all launches have different numbers
  char *memory;     ///< one workspace per resident block
  std::size_t memory_stride;
  std::size_t chip_size;    ///< dynamic shared memory of a block [bytes]
  std::size_t overflow;     ///< offset in a workspace of data that do not fit in shared memory
  int pair_capacity;
};

/// Smallest number of threads per call in the kernel that prepares calls. Each of these threads
/// copies 16 bytes of a DriveRecord.
template <int D> constexpr int kThreadsPerCall = D == 2 ? 4 : 8;

/// Sizes from which the host allocates memory [bytes].
struct KernelSizes {
  std::size_t shared;    ///< shared memory of a block
  std::size_t beside;    ///< global memory of a block for what does not fit in shared memory
  std::size_t workspace, prepared;
};

/// Storage of the working data of the grains in a kernel: registers or memory. block_shape()
/// returns the block size for each kind of storage.
enum class Residency {
  Many,       ///< many small RVEs; several of them share the registers of a multiprocessor
  Few,        ///< few small RVEs; each has all registers of a multiprocessor
  Large,      ///< up to 1024 grains
  Largest,    ///< up to 2048 spheres in `fast`, one RVE on a multiprocessor
  Memory      ///< any number of grains
};
constexpr int kNumResidencies = 5;
constexpr int kSmallBlock = 416;
constexpr int kSteeredBlock = 224;    ///< kSmallBlock / 2, rounded up to whole warps
constexpr int kLargeBlock = 1024;

/// Block size of a kernel. `items` is the number of grains per thread in registers; 0 stands for
/// any number of grains in memory. `threads` is the largest number of threads of a block. `sharers`
/// is the number of blocks that must fit into the registers of a multiprocessor.
struct BlockShape {
  int items, threads, sharers;
  /// True if the kernel computes no details (DetailRecord). The kernel is then as small as
  /// CudaHints::uniform() requires. Calls with details use another residency.
  bool lean = false;
  /// Number of grains for which shared memory suffices, if this number is below items * threads;
  /// otherwise 0.
  int most_grains = 0;
  RVE_HD constexpr int capacity() const { return most_grains > 0 ? most_grains : items * threads; }
};
RVE_HD constexpr bool same_shape(const BlockShape &one, const BlockShape &other)
{
  return one.items == other.items && one.threads == other.threads && one.sharers == other.sharers;
}

/// Returns the block shape of a kernel configuration for a residency.
///
/// Disks: one grain per thread. With more RVEs on a multiprocessor latencies are hidden better;
/// with fewer RVEs there are fewer register spills. `fast` has three RVEs per multiprocessor, and
/// two in variants with all bookkeeping, where two are faster. `mixed` has two. `double` has one
/// with friction. Without friction it has two, since there are no histories and the remaining
/// spills are outside the steps. Measured on an H200 and an H100 with 400 disks.
///
/// Disks with a servo and without bookkeeping: one thread of an RVE computes the servo and plans
/// steps while the others wait, and no grain stays in registers between steps. So a thread has two
/// grains, and a multiprocessor has as many RVEs as fit into its shared memory (228 KB). While one
/// RVE waits, others compute. This gives 25 % more steps per second than one grain per thread.
///
/// Spheres: two grains per thread. In `fast` a multiprocessor has two or more RVEs, so that one
/// computes while another waits. In `mixed`, and in variants with a servo or bookkeeping, a thread
/// has twice as many registers as in `fast`, since spilling costs more than fewer resident threads.
/// In `double` the histories do not fit into these registers either and are streamed from memory
/// (streams_history). `double` variants with a servo or bookkeeping stream all data of a grain
/// (InMemory). Measured on an H200 with 1000 spheres.
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
      case Residency::Few:    // with all bookkeeping same as Many: one slow compilation less
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
  /// (Residency) Kernels. A kernel is null if the variant does not have it and uses another
  /// residency.
  const void *kernel[kNumResidencies];
  /// Kernel prepare_calls, which fills LaunchRecord::prepared and resets the queue. It is null if
  /// the kernel of another variant prepares the calls.
  const void *prepare;
};

}    // namespace rve
