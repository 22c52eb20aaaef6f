// SPDX-License-Identifier: GPL-2.0-only
// BlockCuda implements the functions of a block (block_serial.h) by one CUDA thread block. Only
// files in block/ and the CUDA engine use CUDA threads. A thread block has any size from 1 to 1024,
// which can differ between launches. CUB's block primitives are not used, since their size is a
// template parameter.
//
//   cuda_threads.cuh       warps and shared memory of the collectives
//   cuda_phases.cuh        assignment of items to threads; barriers
//   cuda_reductions.cuh    sums and maxima
//   cuda_scans.cuh         scans and orders, for lists
//   cuda_hints.cuh         hints to the compiler
//   this file              resident items and integer accumulation

#pragma once

#include "rve/block/cuda_hints.cuh"
#include "rve/block/cuda_phases.cuh"
#include "rve/block/cuda_reductions.cuh"
#include "rve/block/cuda_scans.cuh"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Block with at most MostThreads threads. With ItemsPerThread of 1 or 2 each thread has at most
  /// that many resident items and keeps them in registers. With 0 a thread has any number of
  /// resident items, in memory. Arrays on chip have space for `Capacity` items.
  template <int ItemsPerThread, int MostThreads = 1024, int Capacity = ItemsPerThread *MostThreads>
  class BlockCuda :
      public CudaReductions<ItemsPerThread, MostThreads>,
      public CudaScans<MostThreads>,
      public CudaHints {
   public:
    using typename CudaPhases<ItemsPerThread>::Item;
    static constexpr bool kInRegisters = ItemsPerThread > 0;
    static constexpr int kOnTheWay = 4;
    static constexpr int kCapacity = Capacity;
    /// True if uniform() keeps numbers in uniform registers. A thread with one item has enough
    /// ordinary registers, and the compiler would keep the numbers there.
    static constexpr bool kHasUniforms = ItemsPerThread == 2;

    static RVE_DEVICE char *chip()
    {
      extern __shared__ __align__(16) char on_chip[];
      return on_chip;
    }

    static RVE_DEVICE void begin_sum(std::int32_t *sums, int, int i) { sums[i] = 0; }
    RVE_DEVICE void accumulate(std::int32_t *sums, int, int i, std::int32_t v)
    {
      atomicAdd(sums + i, v);
    }
    RVE_DEVICE std::int32_t collect(std::int32_t *sums, int, int i) { return taken(sums + i); }

    /// 64-bit atomics on shared memory are compare-and-swap loops. Each sum is therefore stored in
    /// two numbers (limbs) of 32 bits: its low 24 bits, and its other bits. Limbs are added without
    /// carries, which is exact for up to 256 terms of magnitude below 2^55 / 256. Low and high
    /// limbs are in separate rows: if the two limbs of a sum were adjacent, an access to the low
    /// limbs of many sums would use only half of the banks.
    static RVE_DEVICE void begin_sum(std::int64_t *sums, int capacity, int i)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      limbs[i] = limbs[capacity + i] = 0;
    }
    RVE_DEVICE void accumulate(std::int64_t *sums, int capacity, int i, std::int64_t v)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      atomicAdd(limbs + i, static_cast<int>(v) & 0xffffff);
      atomicAdd(limbs + capacity + i, static_cast<int>(v >> 24));
    }
    RVE_DEVICE std::int64_t collect(std::int64_t *sums, int capacity, int i)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      const int low = taken(limbs + i), high = taken(limbs + capacity + i);
      return (static_cast<std::int64_t>(high) << 24) +
          static_cast<std::int64_t>(static_cast<unsigned>(low));
    }

    static RVE_DEVICE void add(std::int32_t *p, std::int32_t v) { atomicAdd(p, v); }
    static RVE_DEVICE int fetch_add(int *p, int v) { return atomicAdd(p, v); }
    static RVE_DEVICE void fetch_min(int *p, int v) { atomicMin(p, v); }

    template <class T, int Count> struct Copy {
      T value[Count];
      T *array;
      RVE_DEVICE T &operator[](Item item) { return value[slot_of(item)]; }
      RVE_DEVICE void load(Item item) { value[slot_of(item)] = array[item]; }
      RVE_DEVICE void save(Item item) { array[item] = value[slot_of(item)]; }
      RVE_DEVICE void load_whole(Item item)
      {
        value[slot_of(item)] = CudaHints::in_other_registers(CudaHints::read_whole(array[item]));
      }
      RVE_DEVICE void save_whole(Item item)
      {
        CudaHints::write_whole(array[item], CudaHints::in_other_registers(value[slot_of(item)]));
      }
      RVE_DEVICE void keep(Item item, const T &x) { value[slot_of(item)] = x; }
      RVE_DEVICE void publish(Item item, const T &x)
      {
        value[slot_of(item)] = x;
        array[item] = x;
      }
    };
    template <class T> struct Copy<T, 0> : ItemsInArray<T> {
    };
    template <class T> using Resident = Copy<T, ItemsPerThread>;

    template <class T> RVE_DEVICE Resident<T> resident(T *array)
    {
      // All threads set a value, also those without an item. Otherwise the value would be live in
      // the whole kernel.
      Resident<T> copy = Resident<T>();
      copy.array = array;
      return copy;
    }

   private:
    /// Returns a sum and sets it to zero. With items in registers the sums are on chip, where one
    /// atomic exchange replaces two accesses.
    static RVE_DEVICE int taken(int *sum)
    {
      if constexpr (kInRegisters) return atomicExch(sum, 0);
      const int total = *sum;
      *sum = 0;
      return total;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
