// The execution vocabulary of block_serial.h on one CUDA thread block. The only place, beside the CUDA engine, that knows of
// threads. Works for any block size from 1 to 1024, which may change from launch to launch: that is why CUB's block
// primitives, whose size is a template parameter, are not used here.

#ifndef RVE_BLOCK_BLOCK_CUDA_CUH
#define RVE_BLOCK_BLOCK_CUDA_CUH

#include "rve/core/integer_sums.h"

#include <cstdint>

#define RVE_DEVICE __device__ __forceinline__

namespace rve {
inline namespace RVE_ISA {

  /// Shared memory of the collectives.
  struct CudaScratch {
    double chunk[256];
    unsigned long long sum[16];
    int scan[1024];
  };

  /// OneItemPerThread: no phase over grains has more items than the block has threads, so that what per_item declares is one
  /// object per thread and can live in registers. Otherwise it lives in `item_storage`.
  template <bool OneItemPerThread> class BlockCuda {
   public:
    using Item = int;

    __device__ BlockCuda(CudaScratch &scratch_in, void *item_storage) :
        scratch(scratch_in), storage(item_storage)
    {
    }

    template <class F> RVE_DEVICE void for_each(int n, F f)
    {
      for (int i = threadIdx.x; i < n; i += blockDim.x) f(i);
      __syncthreads();
    }

    template <class F> RVE_DEVICE void once(F f)
    {
      if (threadIdx.x == 0) f();
      __syncthreads();
    }

    template <class F> RVE_DEVICE bool any(int n, F f)
    {
      bool mine = false;
      for (int i = threadIdx.x; i < n; i += blockDim.x) mine = f(i) | mine;
      return __syncthreads_or(mine) != 0;
    }

    RVE_DEVICE double sum_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) {
        return x + y;
      });
    }

    RVE_DEVICE double max_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) {
        return y > x ? y : x;
      });
    }

    template <int M, class F> RVE_DEVICE IntegerSums<M> sum_integers(int n, F f)
    {
      static_assert(M <= 16, "CudaScratch::sum holds 16 numbers");
      std::int64_t term[M];
      for (int m = 0; m < M; ++m) term[m] = 0;
      for (int i = threadIdx.x; i < n; i += blockDim.x) f(i, term);
      for (int m = threadIdx.x; m < M; m += blockDim.x) scratch.sum[m] = 0;
      __syncthreads();
      const bool whole_warps = blockDim.x % 32 == 0;
      for (int m = 0; m < M; ++m) {
        auto x = static_cast<unsigned long long>(term[m]);
        if (whole_warps)
          for (int offset = 16; offset > 0; offset /= 2)
            x += __shfl_down_sync(0xffffffffu, x, offset);
        if (!whole_warps || threadIdx.x % 32 == 0) atomicAdd(&scratch.sum[m], x);
      }
      __syncthreads();
      IntegerSums<M> sums;
      for (int m = 0; m < M; ++m) sums.value[m] = static_cast<std::int64_t>(scratch.sum[m]);
      __syncthreads();
      return sums;
    }

    RVE_DEVICE int exclusive_scan(int *a, int n)
    {
      const int threads = blockDim.x, me = threadIdx.x;
      const int share = (n + threads - 1) / threads;
      const int first = min(me * share, n), last = min(first + share, n);
      int mine = 0;
      for (int i = first; i < last; ++i) mine += a[i];
      scratch.scan[me] = mine;
      __syncthreads();
      for (int offset = 1; offset < threads; offset *= 2) {
        const int left = me >= offset ? scratch.scan[me - offset] : 0;
        __syncthreads();
        scratch.scan[me] += left;
        __syncthreads();
      }
      const int total = scratch.scan[threads - 1];
      int before = scratch.scan[me] - mine;
      for (int i = first; i < last; ++i) {
        const int x = a[i];
        a[i] = before;
        before += x;
      }
      __syncthreads();
      return total;
    }

    RVE_DEVICE void add(std::int32_t *p, std::int32_t v) { atomicAdd(p, v); }

    /// 64-bit atomics on shared memory are compare-and-swap loops; two 32-bit ones with the carry give the same final sum.
    RVE_DEVICE void add(std::int64_t *p, std::int64_t v)
    {
      auto *half = reinterpret_cast<unsigned *>(p);
      const auto low = static_cast<unsigned>(v);
      const unsigned old = atomicAdd(half, low);
      const unsigned high =
          static_cast<unsigned>(static_cast<std::uint64_t>(v) >> 32) + (old + low < old ? 1u : 0u);
      if (high) atomicAdd(half + 1, high);
    }

    RVE_DEVICE int fetch_add(int *p, int v) { return atomicAdd(p, v); }
    RVE_DEVICE void fetch_min(int *p, int v) { atomicMin(p, v); }

    template <class State> struct InRegisters {
      State state;
      RVE_DEVICE State &operator[](int) { return state; }
    };
    template <class State> struct InMemory {
      State *state;
      RVE_DEVICE State &operator[](int item) { return state[item]; }
    };
    template <bool InRegister, class State> struct Choose {
      using Type = InRegisters<State>;
      static RVE_DEVICE Type make(void *) { return Type(); }
    };
    template <class State> struct Choose<false, State> {
      using Type = InMemory<State>;
      static RVE_DEVICE Type make(void *memory) { return Type{static_cast<State *>(memory)}; }
    };
    template <class State> using PerItem = typename Choose<OneItemPerThread, State>::Type;

    template <class State> RVE_DEVICE PerItem<State> per_item(int)
    {
      return Choose<OneItemPerThread, State>::make(storage);
    }

   private:
    /// Chunks of 32 items, each reduced in order, then the chunks in order, as BlockSerial does.
    template <class Operation> RVE_DEVICE double reduce(int n, const double *a, Operation operation)
    {
      double total = 0.0;
      const int num_chunks = (n + 31) / 32;
      for (int base = 0; base < num_chunks; base += 256) {
        const int count = min(256, num_chunks - base);
        for (int c = threadIdx.x; c < count; c += blockDim.x) {
          double x = 0.0;
          for (int i = (base + c) * 32; i < n && i < (base + c + 1) * 32; ++i)
            x = operation(x, a[i]);
          scratch.chunk[c] = x;
        }
        __syncthreads();
        for (int c = 0; c < count; ++c) total = operation(total, scratch.chunk[c]);
        __syncthreads();
      }
      return total;
    }

    CudaScratch &scratch;
    void *storage;
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
