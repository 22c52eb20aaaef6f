// SPDX-License-Identifier: GPL-2.0-only
// What a sound call will have changed of an RVE beside its grains.

#pragma once

#include "rve/algorithm/call_state.h"

#include <cstring>

namespace rve {
inline namespace RVE_ISA {

  /// Copies word number `k` of a plain struct.
  template <class Word, class T> RVE_INLINE void copy_word(const T &from, T &to, int k)
  {
    static_assert(sizeof(T) % sizeof(Word) == 0, "a whole number of words");
    // not std::memcpy, which NVRTC does not have
    memcpy(reinterpret_cast<char *>(&to) + k * sizeof(Word),
           reinterpret_cast<const char *>(&from) + k * sizeof(Word), sizeof(Word));
  }

  /// Copies a plain struct by many threads, word by word.
  template <class Block, class T> RVE_INLINE void copy_words(Block &block, const T &from, T &to)
  {
    block.for_each(static_cast<int>(sizeof(T) / sizeof(std::int32_t)),
                   [&](typename Block::Item w) { copy_word<std::int32_t>(from, to, w); });
  }

  /// Component of the Love stress from the sums of a force phase, in a cell of volume 1 / per_volume [stress].
  template <class Scene>
  RVE_INLINE double stress_component(const CallState<Scene> &call, double per_volume, int k)
  {
    const double unit = call.units.force * call.units.length * per_volume;
    return static_cast<double>(call.totals.sum[k]) * unit;
  }

  /// Prepared ahead, as far as it is known.
  template <class Scene> struct CallProgress {

    /// What a sound call will have changed, as far as that is known: with a servo the present cell. By one thread.
    static RVE_INLINE void note_progress(PreparedCall<Scene> &call, const EnergyLoss &lost)
    {
      const ImageHeader<Scene::D> &before = call.header;
      const DriveRecord<Scene::D> &drive = call.drive;
      ImageProgress<Scene::D> &after = call.after;
      const bool on_path = drive.substeps > 0 && !call.has_servo();
      const Tensor<double, Scene::D> cell = on_path ? call.path.end() : call.cell;
      store_tensor(cell, after.cell);
      store_tensor(on_path ? load_tensor<Scene::D>(drive.deformation) * call.deformation
                           : call.deformation,
                   after.deformation);
      store_tensor(call.list_cell, after.list_cell);
      store_tensor(call.servo_gradient, after.servo_velocity_gradient);
      after.num_extra = call.num_extra;
      after.list_valid = 1;
      after.steps = before.steps + drive.substeps;
      after.rebuilds = before.rebuilds + call.num_rebuilds;
      after.lattice_reductions = before.lattice_reductions + call.num_reductions;
      after.repeats = before.repeats;
      after.work = before.work + call.supplied;
      after.friction_loss = before.friction_loss + lost.friction;
      after.damping_loss = before.damping_loss + lost.damping;
      after.viscous_loss = before.viscous_loss + lost.viscous;
      call.end_per_volume = per_volume(call, determinant(cell));
    }

    /// 1 / (det H times thickness) [1/length^3]
    static RVE_INLINE double per_volume(const PreparedCall<Scene> &call, double volume)
    {
      return 1.0 / (volume * call.header.material.thickness);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
