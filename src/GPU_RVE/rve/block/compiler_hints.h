// SPDX-License-Identifier: GPL-2.0-only
// Hints to the compiler of a GPU. They change registers and instructions, never results.
// NoCompilerHints is for CPUs, where hints do nothing. CudaHints (cuda_hints.cuh) implements the
// hints for nvcc and NVRTC.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  struct NoCompilerHints {
    /// Makes the compiler read values from memory again instead of keeping them in registers.
    static RVE_INLINE void reread() {}
    /// Returns a number in memory; the compiler does not reuse an earlier read.
    template <class T> static RVE_INLINE T read_again(const T &x) { return x; }
    /// Returns x; the compiler computes values derived from x again instead of keeping them in
    /// registers.
    static RVE_INLINE int opaque(int x) { return x; }
    /// Returns x, which is the same for all threads. A block with kHasUniforms keeps x in uniform
    /// registers, which all threads of a warp share.
    template <class T> static RVE_INLINE T uniform(const T &x) { return x; }
    /// Returns a truth value, computed in several branches of a function, in a form that the
    /// compiler keeps in a predicate register.
    static RVE_INLINE bool predicate(bool x) { return x; }
    /// Reads or writes an element of an array in the memory of an RVE; a GPU moves 16 bytes at a
    /// time if the size of an element is a multiple of 16 bytes.
    template <class T> static RVE_INLINE T read_whole(const T &element) { return element; }
    template <class T> static RVE_INLINE void write_whole(T &element, const T &x) { element = x; }
  };

}    // namespace RVE_ISA
}    // namespace rve
