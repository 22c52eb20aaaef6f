// SPDX-License-Identifier: GPL-2.0-only
// Warps, shared memory and items of the threads of a CUDA thread block.

#pragma once

#include "rve/core/config.h"

#include <cstdint>

#define RVE_DEVICE __device__ __forceinline__
#define RVE_ROLLED _Pragma("unroll 1")

namespace rve {
inline namespace RVE_ISA {

  /// Item of a thread that has two items. `slot` is 0 for the first item and 1 for the second. If
  /// the item is in registers, `slot` is known at compile time, since registers cannot be indexed
  /// at run time.
  struct ItemOfThread {
    int index, slot;
    RVE_DEVICE operator int() const { return index; }
  };
  RVE_DEVICE int slot_of(int)
  {
    return 0;
  }
  RVE_DEVICE int slot_of(ItemOfThread item)
  {
    return item.slot;
  }

  namespace warps {

    /// Mask of all lanes of a warp. Lanes that the last warp lacks count as exited. With a mask
    /// that is unknown at compile time each exchange would need ten more instructions.
    constexpr unsigned kAllLanes = 0xffffffffu;

    RVE_DEVICE int lane()
    {
      return threadIdx.x % 32;
    }
    /// Index of this thread's warp.
    RVE_DEVICE int index()
    {
      return threadIdx.x / 32;
    }
    RVE_DEVICE int count()
    {
      return (blockDim.x + 31) / 32;
    }
    /// Number of lanes of this thread's warp. The last warp can have fewer than 32.
    RVE_DEVICE int lanes_here()
    {
      return min(32, static_cast<int>(blockDim.x) - 32 * index());
    }

    /// Returns the sum over the threads of a warp. Each term is split into parts (limbs) of 27, 27
    /// and 10 bits, whose sums fit into 32 bits.
    RVE_DEVICE long long sum(std::int64_t term)
    {
      const unsigned low = static_cast<unsigned>(term) & 0x7ffffffu,
                     middle = static_cast<unsigned>(term >> 27) & 0x7ffffffu;
      const int high = static_cast<int>(term >> 54);
      return static_cast<long long>(__reduce_add_sync(kAllLanes, low)) +
          (static_cast<long long>(__reduce_add_sync(kAllLanes, middle)) << 27) +
          static_cast<long long>(static_cast<unsigned long long>(__reduce_add_sync(kAllLanes, high))
                                 << 54);
    }

    /// Returns the sum over the threads of a warp. Each term is split into two limbs of 16 bits.
    RVE_DEVICE long long sum(std::int32_t term)
    {
      const unsigned low = static_cast<unsigned>(term) & 0xffffu;
      const int high = term >> 16;
      return static_cast<long long>(__reduce_add_sync(kAllLanes, low)) +
          65536ll * __reduce_add_sync(kAllLanes, high);
    }

  }    // namespace warps

  /// Shared memory of the collectives of a block with at most `Warps` warps.
  template <int Warps> struct CudaScratch {
    static constexpr int kChunks = 8 * Warps;
    union {
      double chunk[kChunks];
      long long sum[16][Warps];
      int scan[Warps], of_class[16][Warps];
    };
    int largest[Warps];
  };
  template <int Warps> RVE_DEVICE CudaScratch<Warps> &cuda_scratch()
  {
    __shared__ CudaScratch<Warps> memory;
    return memory;
  }

}    // namespace RVE_ISA
}    // namespace rve
