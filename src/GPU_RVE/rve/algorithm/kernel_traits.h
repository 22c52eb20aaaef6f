// SPDX-License-Identifier: GPL-2.0-only
// Compile-time choices that fit a kernel to the registers of its threads, by block and kernel
// configuration. Except for kRelaxedSpheres they change only the speed. "Gain" is the increase of
// steps per second on an NVIDIA H200 with CUDA 13.0 (doc/src/dev_gpu_kernels.rst), unless a line
// names other quantities. Numbers of instructions are from NVRTC 13.0.

#pragma once

#include "rve/algorithm/kernel_config.h"
#include "rve/core/arithmetic.h"

namespace rve {
inline namespace RVE_ISA {

  /// True for spheres in relaxed arithmetic. The torques and the Love terms of a sphere's own pairs
  /// are then added in floating point, and each sum is rounded once. Local damping uses the sign
  /// bit of the velocity (BySign in physics/damping.h). This is the only choice here that changes
  /// bits of results: the sums depend on the order of pairs. Forces are always rounded pair by
  /// pair, so that the forces on both grains are opposite to the last bit.
  ///
  /// Gain: 2.5 % of calls of ten steps, together with reads and writes of whole histories
  /// (read_whole); not measured alone.
  template <int D> constexpr bool kRelaxedSpheres = kIsRelaxed &&D == 3;

  /// True if histories do not fit into registers: those of spheres in `double`.
  template <class Config>
  constexpr bool kHasLongHistory = Config::D == 3 && sizeof(typename Config::Real) == 8;

  template <class Block, class Config> struct KernelTraits {
    /// A thread has one disk, in registers. A thread without a disk steps a disk without contacts,
    /// so that no phase is in a branch: at the end of a branch both paths must have their values in
    /// the same registers. The first move is before the loop of steps. The pairs of a disk read the
    /// constants of a step once.
    ///
    /// Gain: 7 % fewer instructions of a step in `fast`, 4 % in `mixed`. Together with records of
    /// 24 bytes and the safe box: 10 to 15 % more steps per second in long calls.
    static constexpr bool disks_in_registers = Block::kInRegisters && Config::D == 2;

    /// A thread has one or two spheres. Its registers keep only the data that no other thread
    /// reads, with two partners per register. The other data of a sphere are in one record on chip,
    /// which its own thread reads as well. The forces of a sphere's own pairs are added, on chip,
    /// to the forces of pairs that other spheres own.
    ///
    /// Gain: not measured alone.
    static constexpr bool spheres_in_registers = Block::kInRegisters && Config::D == 3;

    /// Constants of a step are in uniform registers, once per warp (CudaHints::uniform()). Such
    /// kernels must be small. A call with details therefore uses another kernel (Residency in
    /// engine/cuda_kernels.h), and the end of a call processes the two spheres of a thread one
    /// after the other by the same code.
    ///
    /// Gain: 10 % in `fast`.
    static constexpr bool uniform_constants =
        spheres_in_registers && Block::kHasUniforms && !Config::steers;

    /// Spheres without uniform registers read the constants of a step again for each pair.
    ///
    /// Gain: 77 of 84 spilled numbers of a step if a thread has 64 registers; not timed alone.
    static constexpr bool rereads_constants =
        spheres_in_registers && sizeof(typename Config::Wide) == 4;

    /// Histories stay in memory. A thread reads the history of a pair while it computes the
    /// previous pair.
    ///
    /// Gain: 59 % (linear springs in `double`, with two spheres per thread instead of one).
    static constexpr bool streams_history = Block::kInRegisters && kHasLongHistory<Config>;

    /// A move returns a predicate that is true if its grain has left the list. It compares the
    /// position with a box, and computes the displacement only outside of the box.
    ///
    /// Gain: 21 of 49 spilled numbers of a step of spheres in `fast`; not timed alone.
    static constexpr bool checks_list_by_predicate = uniform_constants || disks_in_registers;
  };

}    // namespace RVE_ISA
}    // namespace rve
