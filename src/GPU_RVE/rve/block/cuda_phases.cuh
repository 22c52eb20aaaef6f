// SPDX-License-Identifier: GPL-2.0-only
// Phases of a CUDA thread block: assignment of items to threads, and barriers.

#pragma once

#include "rve/block/cuda_hints.cuh"
#include "rve/block/cuda_threads.cuh"
#include "rve/core/pack_item.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  template <int ItemsPerThread> class CudaPhases {
   public:
    using Item = std::conditional_t<ItemsPerThread == 2, ItemOfThread, int>;

    template <class F> RVE_DEVICE void for_each(int n, F f)
    {
      visit_all(n, f);
      __syncthreads();
    }

    template <class F, class Aside> RVE_DEVICE void for_each(int n, F f, Aside aside)
    {
      visit_all(n, f);
      do_aside(aside);
      __syncthreads();
    }

    template <Visit way = Visit::Items, class F> RVE_DEVICE void for_items(int n, F f)
    {
      visit_items<way>(n, f);
      __syncthreads();
    }

    /// The last thread calls g(0), the thread before it g(1), and so on, since the last threads
    /// most often have no item.
    template <Visit way = Visit::Items, class F, class G>
    RVE_DEVICE void for_items(int n, F f, int m, G g)
    {
      visit_items<way>(n, f);
      for (int k = blockDim.x - 1 - threadIdx.x; k < m; k += blockDim.x) g(k);
      __syncthreads();
    }

    template <class F> RVE_DEVICE void own_items(int n, F f) { visit_items<Visit::Items>(n, f); }

    template <class F> RVE_DEVICE void once(F f)
    {
      if (threadIdx.x == 0) f();
      __syncthreads();
    }

    template <class F> RVE_DEVICE bool any(int n, F f)
    {
      bool mine = false;
      visit_all(n, [&](Item i) { mine = f(i) | mine; });
      return __syncthreads_or(mine) != 0;
    }

    template <class F, class Aside> RVE_DEVICE bool any(int n, F f, Aside aside)
    {
      do_aside(aside);
      return any(n, f);
    }

    template <Visit way = Visit::Items, class F> RVE_DEVICE bool any_item(int n, F f)
    {
      // `mine` is an int if all threads call f, and a bool if f is called in a branch.
      std::conditional_t<way == Visit::Registers, int, bool> mine = 0;
      visit_items<way>(n, [&](Item i) RVE_INLINE_LAMBDA { mine = f(i) | mine; });
      return __syncthreads_or(mine) != 0;
    }

    template <class F> static RVE_DEVICE void for_empty_registers(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        const int i = threadIdx.x;
        if (i >= n) f(i);
      }
    }

    /// Distributes the numbers 0 ... count - 1 over n resident items and calls f(k) for each number
    /// k of item i. If a thread has two items, the first one has the share of both. Threads without
    /// an item have no share.
    template <class F> static RVE_DEVICE void share_out(Item i, int n, int count, F f)
    {
      if (slot_of(i) != 0) return;
      if (ItemsPerThread == 1 && i >= n) return;
      const int stride = ItemsPerThread == 2 ? min(n, static_cast<int>(blockDim.x)) : n;
      for (int k = i; k < count; k += stride) f(k);
    }

   protected:
    /// Calls f(item) for all items. If a thread has several items, the first item of each thread is
    /// assigned in ascending order of the threads, the second one in descending order, and so on.
    /// Spheres are numbered by their amount of work. The warp with the largest amount for its first
    /// items therefore has the smallest amount for its second items (gain: 16 to 20 % of the steps
    /// of spheres in `fast`, on an H100). An item is always assigned to the same thread, so that
    /// some phases need no barrier.
    template <class F> static RVE_DEVICE void visit_all(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        // A variable for the thread index would be kept in a register.
        for (int i = threadIdx.x; i < n; i += blockDim.x) f(i);
      } else {
        const int threads = blockDim.x, me = threadIdx.x;
        // A rolled loop keeps the kernel small: CudaHints::uniform().
        RVE_ROLLED
        for (int i = me, hop = 2 * (threads - me) - 1; i < n; i += hop, hop = 2 * threads - hop) {
          if constexpr (ItemsPerThread == 2)
            f(Item{i, 0});
          else
            f(i);
        }
      }
    }

    /// Calls f(item) for resident items. If they are in registers, a thread has at most
    /// ItemsPerThread of them. With two items per thread each call is in a branch, also for
    /// Visit::Registers.
    template <Visit way, class F> static RVE_DEVICE void visit_items(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        const int i = threadIdx.x;
        if (way == Visit::Registers || i < n) f(i);
      } else if constexpr (ItemsPerThread == 2 && way == Visit::InTurn) {
        const int first = threadIdx.x, second = 2 * blockDim.x - 1 - first;
        RVE_ROLLED
        for (int turn = 0; turn < 2; ++turn) {
          const int i = turn == 0 ? first : second;
          if (i < n) f(Item{i, 0});
        }
      } else if constexpr (ItemsPerThread == 2) {
        const int first = CudaHints::thread_again(), second = 2 * blockDim.x - 1 - first;
        if (first < n) f(Item{first, 0});
        if (second < n) f(Item{second, 1});
      } else {
        visit_all(n, f);
      }
    }

   private:
    /// Runs aside() in the last thread, which most often has no item.
    template <class Aside> static RVE_DEVICE void do_aside(Aside aside)
    {
      if (threadIdx.x == blockDim.x - 1) aside();
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
