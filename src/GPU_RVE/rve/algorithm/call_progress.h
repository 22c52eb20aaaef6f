// SPDX-License-Identifier: GPL-2.0-only
// Prepares the part of the stored state that a successful call changes, except the grains.

#pragma once

#include "rve/algorithm/call_state.h"

#include <cstring>

namespace rve {
inline namespace RVE_ISA {

  /// Copies word number `k` of a plain struct.
  template <class Word, class T> RVE_INLINE void copy_word(const T &from, T &to, int k)
  {
    static_assert(sizeof(T) % sizeof(Word) == 0, "a whole number of words");
    // NVRTC does not have std::memcpy.
    memcpy(reinterpret_cast<char *>(&to) + k * sizeof(Word),
           reinterpret_cast<const char *>(&from) + k * sizeof(Word), sizeof(Word));
  }

  /// Copies a plain struct word by word, with many threads.
  template <class Block, class T> RVE_INLINE void copy_words(Block &block, const T &from, T &to)
  {
    block.for_each(static_cast<int>(sizeof(T) / sizeof(std::int32_t)),
                   [&](typename Block::Item w) { copy_word<std::int32_t>(from, to, w); });
  }

  /// Returns component k of the Love stress from the sums of the last forces, in a cell of volume 1
  /// / per_volume [stress].
  template <class Config>
  RVE_INLINE double stress_component(const CallState<Config> &call, double per_volume, int k)
  {
    const double unit = call.units.force * call.units.length * per_volume;
    return static_cast<double>(call.totals.sum[k]) * unit;
  }

  /// Prepares the StateProgress that a successful call stores, as far as it is known in advance.
  template <class Config> struct CallProgress {

    /// Sets call.after, the StateProgress of a successful call. With a servo it has the changes up
    /// to the current cell. One thread calls this function.
    static RVE_INLINE void note_progress(PreparedCall<Config> &call, const EnergyLoss &lost)
    {
      const StateHeader<Config::D> &before = call.header;
      const DriveRecord<Config::D> &drive = call.drive;
      StateProgress<Config::D> &after = call.after;
      const bool on_path = drive.substeps > 0 && !call.has_servo();
      const Tensor<double, Config::D> cell = on_path ? call.path.end() : call.cell;
      store_tensor(cell, after.cell);
      store_tensor(on_path ? load_tensor<Config::D>(drive.deformation) * call.deformation
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

    /// Returns 1 / (det H times thickness) [1/length^3].
    static RVE_INLINE double per_volume(const PreparedCall<Config> &call, double volume)
    {
      return 1.0 / (volume * call.header.material.thickness);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
