// SPDX-License-Identifier: GPL-2.0-only
// Prefix sums (scans) and ordering of items by class in a CUDA thread block, to build lists.

#pragma once

#include "rve/block/cuda_threads.cuh"

namespace rve {
inline namespace RVE_ISA {

  template <int MostThreads> class CudaScans {
   public:
    RVE_DEVICE int exclusive_scan(int *a, int n)
    {
      const int total = scan(a, n);
      __syncthreads();
      return total;
    }
    RVE_DEVICE int scan_to_starts(int *a, int n)
    {
      const int total = scan(a, n);
      if (threadIdx.x == 0) a[n] = total;
      __syncthreads();
      return total;
    }

    template <int Classes, class ClassOf, class Take>
    RVE_DEVICE void order_by_class(int n, ClassOf class_of, Take take)
    {
      static_assert(Classes <= 16, "CudaScratch::of_class has space for 16 classes");
      // All lanes set the numbers, so that no __syncwarp() is needed. A __syncwarp() here would
      // prevent uniform registers (CudaHints::uniform()) in kernels of spheres.
      int next[Classes];
      RVE_UNROLL
      for (int k = 0; k < Classes; ++k) { next[k] = 0; }
      // The class is evaluated once if a thread has one item.
      int first_class = -1;
      class_by_class(
          n,
          [&](int i) {
            first_class = class_of(i);
            return first_class;
          },
          next, [](int, int) {});
      if (warps::lane() == 0) {
        RVE_UNROLL
        for (int k = 0; k < Classes; ++k) { scratch().of_class[k][warps::index()] = next[k]; }
      }
      __syncthreads();
      // For the items of this warp, the first index of a class is the number of items in earlier
      // classes, plus the number of items of the same class in earlier warps.
      int first = 0;
      RVE_UNROLL
      for (int k = 0; k < Classes; ++k) {
        const WarpCounts counts = sums_before_warp(scratch().of_class[k]);
        next[k] = first + counts.before;
        first += counts.all;
      }
      class_by_class(
          n, [&](int i) { return n <= static_cast<int>(blockDim.x) ? first_class : class_of(i); },
          next, take);
      __syncthreads();
    }

   private:
    static RVE_DEVICE CudaScratch<MostThreads / 32> &scratch()
    {
      return cuda_scratch<MostThreads / 32>();
    }

    template <class F> static RVE_DEVICE void one_by_one(int first, int last, F f)
    {
      // A rolled loop keeps the kernel small: CudaHints::uniform().
      RVE_ROLLED
      for (int i = first; i < last; ++i) { f(i); }
    }

    /// Calls visit(item, number[its class]) and then raises that number by one for the next item of
    /// the class. Each warp has consecutive items and its own numbers, which are the same in all
    /// lanes.
    template <int Classes, class ClassOf, class Visit>
    static RVE_DEVICE void class_by_class(int n, ClassOf class_of, int (&number)[Classes],
                                          Visit visit)
    {
      const int threads = blockDim.x, lanes = warps::lanes_here(), in_turn = 32 * warps::count();
      // A division is rarely needed.
      const int turns = n <= threads ? 1 : (n + in_turn - 1) / in_turn;
      const int begin = 32 * turns * warps::index(), end = min(begin + 32 * turns, n);
      const unsigned before = (1u << warps::lane()) - 1u;
      RVE_ROLLED
      for (int first = begin; first < end; first += lanes) {
        const int i = first + warps::lane();
        const int here = i < end ? class_of(i) : -1;
        int mine = 0;
        RVE_UNROLL
        for (int k = 0; k < Classes; ++k) {
          const unsigned same = __ballot_sync(warps::kAllLanes, here == k);
          mine = here == k ? number[k] + __popc(same & before) : mine;
          number[k] += __popc(same);
        }
        if (here >= 0) visit(i, mine);
      }
    }

    /// Consecutive items of a thread.
    struct Share {
      int first, last;
    };
    static RVE_DEVICE Share share_of(int n)
    {
      const int threads = blockDim.x, me = threadIdx.x;
      // A division is rarely needed.
      const int share = n <= threads ? 1 : (n + threads - 1) / threads;
      const int first = min(me * share, n);
      return {first, min(first + share, n)};
    }

    /// Returns the sum of x over the lanes of this warp up to and including this lane.
    static RVE_DEVICE int sum_of_lanes_up_to(int x)
    {
      // Rolled loops keep the kernel small: CudaHints::uniform().
      RVE_ROLLED
      for (int offset = 1; offset < 32; offset *= 2) {
        const int left = __shfl_up_sync(warps::kAllLanes, x, offset);
        if (warps::lane() >= offset) x += left;
      }
      return x;
    }

    /// Sums of one number per warp: over the warps before this one, and over all warps. Each warp
    /// computes them, which is faster than another barrier.
    struct WarpCounts {
      int before, all;
    };
    static RVE_DEVICE WarpCounts sums_before_warp(const int *of_warps)
    {
      const int count = warps::count(), mine = warps::index(), lanes = warps::lanes_here();
      WarpCounts counts = {0, 0};
      RVE_ROLLED
      for (int w = warps::lane(); w < count; w += lanes) {
        const int of_warp = of_warps[w];
        counts.before += w < mine ? of_warp : 0;
        counts.all += of_warp;
      }
      return {__reduce_add_sync(warps::kAllLanes, counts.before),
              __reduce_add_sync(warps::kAllLanes, counts.all)};
    }

    /// Replaces a[i] by the sum of the numbers before it. The function has no barrier at its end.
    RVE_DEVICE int scan(int *a, int n)
    {
      const Share share = share_of(n);
      int mine = 0;
      one_by_one(share.first, share.last, [&](int i) { mine += a[i]; });
      const int up_to = sum_of_lanes_up_to(mine);
      if (warps::lane() == warps::lanes_here() - 1) scratch().scan[warps::index()] = up_to;
      __syncthreads();
      const WarpCounts counts = sums_before_warp(scratch().scan);
      int before = counts.before + up_to - mine;
      one_by_one(share.first, share.last, [&](int i) {
        const int x = a[i];
        a[i] = before;
        before += x;
      });
      return counts.all;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
