// SPDX-License-Identifier: GPL-2.0-only
// What a function needs to run on both sides, and the namespace that keeps two builds of it apart.
//
// The host engine is compiled twice, for the baseline instruction set and for x86-64-v3, and chosen at run time. Everything
// that may be inlined into those two builds lives in the inline namespace RVE_ISA, so that the linker can never hand the
// code of one instruction set to the other. Plain data that crosses the border is declared outside of it.

#pragma once

#ifndef RVE_ISA
#define RVE_ISA portable
#endif

#if defined(__CUDACC__)
#define RVE_HD __host__ __device__
#else
#define RVE_HD
#endif

// ahead of a loop over what a thread has in registers, which have no addresses
#if defined(__CUDA_ARCH__)
#define RVE_UNROLL _Pragma("unroll")
#else
#define RVE_UNROLL
#endif

// RVE_COLD: code that runs rarely and must not take registers from the code that calls it
#if defined(__CUDACC__)
#define RVE_COLD __host__ __device__ __noinline__
#else
#define RVE_COLD __attribute__((noinline))
#endif

// RVE_APART: a function of its own for a CPU's compiler, which then gives it registers of its own (7 % of a step with a ledger); on a GPU a call
// would take the addresses of what is on the chip
#if defined(__CUDACC__)
#define RVE_APART __host__ __device__ __forceinline__
#else
#define RVE_APART __attribute__((noinline))
#endif

#if defined(__CUDACC__)
#define RVE_INLINE __host__ __device__ __forceinline__
#define RVE_INLINE_LAMBDA
#elif defined(RVE_SANITIZED)
// with the checks of the sanitizers in them, the programs are so large in one piece that their compilation takes eight times as long
#define RVE_INLINE inline
#define RVE_INLINE_LAMBDA
#else
#define RVE_INLINE inline __attribute__((always_inline))
// behind the parameters of a lambda that stands in an inner loop: a call per grain costs a tenth of its work
#define RVE_INLINE_LAMBDA __attribute__((always_inline))
#endif
