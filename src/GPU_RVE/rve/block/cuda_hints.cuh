// SPDX-License-Identifier: GPL-2.0-only
// Hints to nvcc and NVRTC. NoCompilerHints (compiler_hints.h) describes them; the reasons given
// here hold for CUDA 13.0.

#pragma once

#include "rve/block/cuda_threads.cuh"

namespace rve {
inline namespace RVE_ISA {

  struct CudaHints {
    static RVE_DEVICE void reread() { asm volatile("" ::: "memory"); }

    template <class T> static RVE_DEVICE T read_again(const T &x)
    {
      return *const_cast<const volatile T *>(&x);
    }

    static RVE_DEVICE int opaque(int x)
    {
      asm("" : "+r"(x));
      return x;
    }

    /// The compiler keeps x in uniform registers, which multiplications accept as an operand, under
    /// three conditions. The threads of the warp must be converged; __syncwarp() tells the compiler
    /// that they are. The kernel and all functions that it calls must be small: together up to
    /// about 15,000 instructions. No called function may need more than about 160 registers.
    /// Otherwise x occupies ordinary registers and causes spills; bench/uniform_registers.sh checks
    /// this.
    template <class T> static RVE_DEVICE T uniform(const T &x)
    {
      constexpr int words = sizeof(T) / sizeof(unsigned);
      static_assert(words * sizeof(unsigned) == sizeof(T), "whole words");
      unsigned word[words];
      memcpy(word, &x, sizeof(T));
      __syncwarp();
      RVE_UNROLL
      for (int m = 0; m < words; ++m) { word[m] = __reduce_or_sync(warps::kAllLanes, word[m]); }
      T same;
      memcpy(&same, word, sizeof(T));
      return same;
    }

    /// The result is an int, which the compiler keeps in a predicate register. If a bool is
    /// computed in two branches, the compiler keeps it in an ordinary register.
    static RVE_DEVICE int predicate(bool x) { return x ? 1 : 0; }

    template <class T> static RVE_DEVICE T read_whole(const T &element)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        return element;
      } else {
        T x;
        const auto &pieces = reinterpret_cast<const PiecesOf<T> &>(element);
        const PiecesOf<T> copy = pieces;
        memcpy(&x, &copy, sizeof(T));
        return x;
      }
    }
    template <class T> static RVE_DEVICE void write_whole(T &element, const T &x)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        element = x;
      } else {
        PiecesOf<T> copy;
        memcpy(&copy, &x, sizeof(T));
        reinterpret_cast<PiecesOf<T> &>(element) = copy;
      }
    }

    /// Returns a copy of x in other registers. An access to 16 bytes needs four consecutive
    /// registers. Numbers that are kept through all steps should not be bound to such registers
    /// (gain: 6 % with two histories of Hertz' law). The compiler does not know that `zero` is
    /// zero, and therefore keeps the copy.
    template <class T> static RVE_DEVICE T in_other_registers(const T &x)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        return x;
      } else {
        PiecesOf<T> copy;
        memcpy(&copy, &x, sizeof(T));
        const unsigned zero = blockDim.y - 1;
        for (Piece &piece : copy.piece)
          for (unsigned &word : piece.word) word ^= zero;
        T y;
        memcpy(&y, &copy, sizeof(T));
        return y;
      }
    }

    /// Reads threadIdx.x again and returns it. If a thread used its first value of threadIdx.x, it
    /// would keep and spill the addresses of its second item from step to step. This would cost 1
    /// to 3 % of the time of a step of spheres.
    static RVE_DEVICE int thread_again()
    {
      int thread;
      asm volatile("mov.u32 %0, %%tid.x;" : "=r"(thread));
      return thread;
    }

   private:
    /// Unit of a read or write. The arrays of an RVE begin at multiples of 16 bytes.
    struct alignas(16) Piece {
      unsigned word[4];
    };
    template <class T> struct PiecesOf {
      Piece piece[sizeof(T) / sizeof(Piece)];
    };
  };

}    // namespace RVE_ISA
}    // namespace rve
