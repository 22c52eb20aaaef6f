// SPDX-License-Identifier: GPL-2.0-only What a kernel does to suit the registers of its threads:
// all compile-time choices of the block program, by block and kernel configuration. They change the
// speed only. Gains are those of steps per second on an NVIDIA H200 with CUDA 13.0
// (doc/src/performance.rst), and those of instructions are of NVRTC 13.0.

#pragma once

#include "rve/algorithm/scene.h"
#include "rve/core/arithmetic.h"

namespace rve {
inline namespace RVE_ISA {

  /// Relaxed arithmetic of spheres adds up torques and Love terms of a sphere's own pairs in
  /// floating point and rounds each sum once, and damping decides by sign bits. This is the only
  /// choice here that changes bits: the sums depend on the order of pairs. Forces are rounded pair
  /// by pair in any case, since those on both grains are opposite to the last bit.
  ///
  /// Gain: with histories moved whole 2.5 % of calls of ten steps; not measured alone.
  template <int D> constexpr bool kRelaxedSpheres = kIsRelaxed &&D == 3;

  /// Histories of spheres in `double` do not fit into registers.
  template <class Scene>
  constexpr bool kHasLongHistory = Scene::D == 3 && sizeof(typename Scene::Real) == 8;

  template <class Block, class Scene> struct KernelTraits {
    /// A thread has one disk. Threads without one make the steps of a disk that touches none, so
    /// that no phase is in a branch, at whose end the registers of both ways would have to be made
    /// the same. The first move is before the loop of steps, and the pairs of a disk read the
    /// constants of a step once. Gain: 7 % fewer instructions of a step in `fast`, 4 % in `mixed`;
    /// with disks of 24 bytes and the safe box of their moves 10 to 15 % more long steps per
    /// second.
    static constexpr bool disks_in_registers = Block::kInRegisters && Scene::D == 2;

    /// A thread has one sphere or two, and keeps of each only what no other thread reads, with two
    /// partners to a register. What others read is in one record on chip, which the sphere itself
    /// reads as well, and a sphere adds the forces of its own pairs to those of others on chip.
    /// Gain: not measured alone.
    static constexpr bool spheres_in_registers = Block::kInRegisters && Scene::D == 3;

    /// Constants of a step are in uniform registers, once per warp (CudaHints::uniform()). Such
    /// kernels must be small: a call with details takes another residency, and the end of a call
    /// takes the two spheres of a thread one after the other by the same code. Gain: 10 % in
    /// `fast`.
    static constexpr bool uniform_constants =
        spheres_in_registers && Block::kHasUniforms && !Scene::steers;

    /// Spheres without uniform registers read the constants of a step again for each pair.
    /// Gain: 77 of 84 spilled numbers of a step where a thread has 64 registers; not timed alone.
    static constexpr bool rereads_constants =
        spheres_in_registers && sizeof(typename Scene::Wide) == 4;

    /// What a pair remembers stays in memory; a thread reads it while it computes the pair before.
    /// Gain: 59 % (linear springs in `double`, with two spheres of a thread where there was one).
    static constexpr bool streams_history = Block::kInRegisters && kHasLongHistory<Scene>;

    /// A move returns as a predicate whether its grain has left the list: a comparison with a box,
    /// and the displacement itself only outside of it. Gain: 21 of 49 spilled numbers of a step of
    /// spheres in `fast`; not timed alone.
    static constexpr bool checks_list_by_predicate = uniform_constants || disks_in_registers;
  };

}    // namespace RVE_ISA
}    // namespace rve
