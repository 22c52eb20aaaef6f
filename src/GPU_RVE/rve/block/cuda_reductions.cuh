// SPDX-License-Identifier: GPL-2.0-only
// Sums and maxima over the items of a CUDA thread block.

#pragma once

#include "rve/block/cuda_phases.cuh"
#include "rve/core/integer_sums.h"

#include <cstdint>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  template <int ItemsPerThread, int MostThreads>
  class CudaReductions : public CudaPhases<ItemsPerThread> {
    using Phases = CudaPhases<ItemsPerThread>;
    using Scratch = CudaScratch<MostThreads / 32>;

   public:
    using typename Phases::Item;

    RVE_DEVICE double sum_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) { return x + y; });
    }

    RVE_DEVICE double max_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) { return y > x ? y : x; });
    }

    template <int M, class F> RVE_DEVICE IntegerSums<M> sum_integers(int n, F f)
    {
      std::int64_t term[M];
      for (int m = 0; m < M; ++m) term[m] = 0;
      Phases::visit_all(n, [&](Item i) { f(i, term); });
      sum_in_warps<M>(term);
      IntegerSums<M> sums;
#pragma unroll
      for (int m = 0; m < M; ++m) sums.value[m] = sum_over_warps(m);
      __syncthreads();
      return sums;
    }

    template <int M, class Term, Visit way = Visit::Items, class F, class Rest>
    RVE_DEVICE void reduce_items(int n, F f, Rest rest, Reduction<M> &reduction)
    {
      constexpr bool one_item = ItemsPerThread == 1;
      using Sum = std::conditional_t<one_item, Term, std::int64_t>;
      Sum sum[M];
      float largest = 0.0f;
      for (int m = 0; m < M; ++m) sum[m] = 0;
      // A Term can have 32 bits. The sum of the terms of several items can have more.
      const auto add = [&](auto g) RVE_INLINE_LAMBDA {
        if constexpr (one_item) {
          g(sum);
        } else {
          Term term[M];
          for (int m = 0; m < M; ++m) term[m] = 0;
          g(term);
          for (int m = 0; m < M; ++m) sum[m] += term[m];
        }
      };
      Phases::template visit_items<way>(n, [&](Item i) RVE_INLINE_LAMBDA {
        add([&](Term *term) RVE_INLINE_LAMBDA { f(i, term, largest); });
      });
      add(rest);
      // Floats that are not negative have the same order as their bits read as integers.
      const int of_warp = __reduce_max_sync(warps::kAllLanes, __float_as_int(largest));
      if (warps::lane() == 0) scratch().largest[warps::index()] = of_warp;
      sum_in_warps<M>(sum);
      for (int m = warps::index(); m <= M; m += warps::count()) {
        if (m == M) {
          int most = 0;
          for (int w = warps::lane(); w < warps::count(); w += warps::lanes_here())
            most = max(most, scratch().largest[w]);
          most = __reduce_max_sync(warps::kAllLanes, most);
          if (warps::lane() == 0) reduction.largest = __int_as_float(most);
        } else {
          const long long total = sum_over_warps(m);
          if (warps::lane() == 0) reduction.sum[m] = total;
        }
      }
      __syncthreads();
    }

    static RVE_DEVICE void begin_add_up()
    {
      for (int k = threadIdx.x; k < kTotals; k += blockDim.x) totals()[k] = 0;
    }

    /// Each thread splits its sums into parts of 16 or 22 bits (limbs). Each warp sums its limbs
    /// and adds them, without carries, to the totals on chip. After a single barrier one thread
    /// computes the sums from the totals.
    template <int M, class Term, class F, class Then>
    RVE_DEVICE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      using Own = std::conditional_t<ItemsPerThread == 1, Term, std::int64_t>;
      Own own[M];
      for (int m = 0; m < M; ++m) own[m] = 0;
      Phases::template visit_items<Visit::Items>(n, [&](Item i) RVE_INLINE_LAMBDA {
        Term term[M];
        for (int m = 0; m < M; ++m) term[m] = 0;
        f(i, term);
        for (int m = 0; m < M; ++m) own[m] += term[m];
      });
      // The sum of two terms of 32 bits has up to 33 bits: 16 in the first limb, 17 in the second
      // one.
      using Limbed = std::conditional_t<(ItemsPerThread > 0), Term, std::int64_t>;
      constexpr int limbs = kLimbs<Limbed>;
      static_assert(M * limbs <= kTotals, "a total for each limb");
      int of_warp[M * limbs];
      RVE_UNROLL
      for (int m = 0; m < M; ++m) { add_limbs_of_warp<Limbed>(own[m], of_warp + m * limbs); }
      if (warps::lane() == 0) {
        RVE_UNROLL
        for (int m = 0; m < M * limbs; ++m) { atomicAdd(totals() + m, of_warp[m]); }
      }
      __syncthreads();
      if (threadIdx.x == 0) {
        sum_of_totals<M, Limbed>(sum);
        CudaHints::reread();    // sums kept in registers would be spilled
        then();
      }
      __syncthreads();
    }

   private:
    static RVE_DEVICE Scratch &scratch()
    {
      return cuda_scratch<MostThreads / 32>();
    }

    /// Sums over the threads of each warp and writes the sums to scratch().sum.
    template <int M, class Term> RVE_DEVICE void sum_in_warps(const Term *term)
    {
      static_assert(M <= 16, "CudaScratch::sum holds 16 numbers");
#pragma unroll
      for (int m = 0; m < M; ++m) {
        const long long sum = warps::sum(term[m]);
        if (warps::lane() == 0) scratch().sum[m][warps::index()] = sum;
      }
      __syncthreads();
    }

    /// Returns the sum over all warps of result m of sum_in_warps(). All threads of a warp must
    /// call it.
    RVE_DEVICE long long sum_over_warps(int m)
    {
      std::int64_t mine = 0;
      for (int w = warps::lane(); w < warps::count(); w += warps::lanes_here())
        mine += scratch().sum[m][w];
      return warps::sum(mine);
    }

    /// Number of limbs of a term of add_up_items(). All limbs but the last have so few bits that
    /// their sum over 1024 threads fits into 32 bits.
    template <class Limbed> static constexpr int kLimbs = sizeof(Limbed) > 4 ? 3 : 2;
    template <class Limbed> static constexpr int kLimbBits = sizeof(Limbed) > 4 ? 22 : 16;
    static constexpr int kTotals = 32;
    static RVE_DEVICE int *totals()
    {
      __shared__ int memory[kTotals];
      return memory;
    }

    template <class Limbed, class Own>
    static RVE_DEVICE void add_limbs_of_warp(Own term, int *of_warp)
    {
      constexpr int last = kLimbs<Limbed> - 1, bits = kLimbBits<Limbed>;
      RVE_UNROLL
      for (int k = 0; k < last; ++k) {
        const unsigned limb = static_cast<unsigned>(term >> (k * bits)) & ((1u << bits) - 1u);
        of_warp[k] = static_cast<int>(__reduce_add_sync(warps::kAllLanes, limb));
      }
      of_warp[last] = __reduce_add_sync(warps::kAllLanes, static_cast<int>(term >> (last * bits)));
    }

    template <int M, class Limbed> static RVE_DEVICE void sum_of_totals(std::int64_t *sum)
    {
      constexpr int last = kLimbs<Limbed> - 1, bits = kLimbBits<Limbed>;
      RVE_UNROLL
      for (int m = 0; m < M; ++m) {
        const int *const limb = totals() + m * kLimbs<Limbed>;
        std::uint64_t total = static_cast<std::uint64_t>(static_cast<std::int64_t>(limb[last]))
            << (last * bits);
        for (int k = 0; k < last; ++k)
          total += static_cast<std::uint64_t>(static_cast<unsigned>(limb[k])) << (k * bits);
        sum[m] = static_cast<std::int64_t>(total);
      }
    }

    /// Reduces chunks of 32 items in order, then the chunks in order, as BlockSerial does.
    template <class Operation> RVE_DEVICE double reduce(int n, const double *a, Operation operation)
    {
      double total = 0.0;
      const int num_chunks = (n + 31) / 32;
      for (int base = 0; base < num_chunks; base += Scratch::kChunks) {
        const int count = min(Scratch::kChunks, num_chunks - base);
        for (int c = threadIdx.x; c < count; c += blockDim.x) {
          double x = 0.0;
          for (int i = (base + c) * 32; i < n && i < (base + c + 1) * 32; ++i)
            x = operation(x, a[i]);
          scratch().chunk[c] = x;
        }
        __syncthreads();
        for (int c = 0; c < count; ++c) total = operation(total, scratch().chunk[c]);
        __syncthreads();
      }
      return total;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
