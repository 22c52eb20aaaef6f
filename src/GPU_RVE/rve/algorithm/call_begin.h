// SPDX-License-Identifier: GPL-2.0-only
// Begin of a call: conversion of the stored state of an RVE to internal units.

#pragma once

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/force_units.h"
#include "rve/algorithm/list_renewal.h"
#include "rve/algorithm/stored_grain.h"

namespace rve {
inline namespace RVE_ISA {

  /// Prepares a call. If the last call has left no valid list, a list is built. If it has left no
  /// force scale, the force scale is estimated.
  template <class Block, class Config> struct CallBegin {
    using Item = typename Block::Item;
    using Real = typename Config::Real;

    using Stored = StoredGrains<Block, Config>;
    using Units = ForceUnits<Block, Config>;
    using Planning = StepPlanning<Block, Config>;
    using Progress = CallProgress<Config>;
    using Renewal = ListRenewal<Block, Config>;

    /// Sets the members of `call` except the entries of its plan. The members header, drive,
    /// steering and batch must be set before. One thread calls this function.
    static RVE_INLINE void prepare(PreparedCall<Config> &call, char *device_state,
                                   int pair_capacity)
    {
      const StateHeader<Config::D> &header = call.header;
      const DriveRecord<Config::D> &drive = call.drive;
      const BatchConstants &batch = call.batch;
      call.device_state =
          carve_device_state<Config>(device_state, header.num_grains, header.extra_capacity);
      call.num_grains = header.num_grains;
      call.status = status::Ok;
      call.num_extra = header.num_extra;
      call.needed_pairs = call.num_rebuilds = call.num_reductions = 0;
      call.cell = load_tensor<Config::D>(header.cell);
      call.list_cell = load_tensor<Config::D>(header.list_cell);
      call.deformation = load_tensor<Config::D>(header.deformation);
      call.servo_gradient = load_tensor<Config::D>(call.steering.modes && call.steering.modes->begin
                                                       ? call.steering.velocity_gradient
                                                       : header.servo_velocity_gradient);
      CellIncrement<Config::D> increment;
      increment.deformation = load_tensor<Config::D>(drive.deformation);
      increment.segments = drive.segments;
      if (drive.segments > 1) {
        increment.rotation = load_tensor<Config::D>(call.steering.rotation);
        increment.stretch = load_tensor<Config::D>(call.steering.stretch);
      }
      if (!call.has_servo())
        call.path = CellPath<Config::D>(call.cell, increment, drive.substeps, drive.dt);
      call.supplied = 0.0;
      const int length_bits = CallUnits::length_bits(contact_range<Config>(header));
      call.units.length = power_of_two(length_bits);
      call.units.per_length = power_of_two(-length_bits);
      call.mass_factor =
          header.material.density * GrainShape<Config::D>::volume * header.material.mass_depth;
      call.skin = batch.skin > 0.0 ? batch.skin : kDefaultSkinShare<Config::D> * header.mean_radius;
      call.expected_force = header.largest_contact_force;
      call.plan_first = 1;
      call.plan_last = 0;
      Progress::note_progress(call, {});
      if (call.num_extra > pair_capacity) {
        call.status = status::ListFull;
        call.needed_pairs = call.num_extra;
      } else if (call.is_continued()) {
        Units::choose_units(call);
        call.plan_last = Planning::steps_to_plan(call);
      }
    }

    /// Sets the views of the memory that the block uses. One thread calls it.
    static RVE_INLINE void set_views(CallState<Config> &call, int num_grains,
                                     const SharedView<Config> &shared, char *workspace,
                                     int pair_capacity)
    {
      call.shared = shared;
      if constexpr (KernelTraits<Block, Config>::spheres_in_registers)
        add_hidden_grain(shared, num_grains);
      call.work = carve_workspace<Config>(workspace, num_grains, pair_capacity);
      call.pairs = PairView<Config>{shared.partner, shared.history, call.work.extra_first,
                                    call.work.extra_second, call.work.extra_history};
    }

    /// Sets a hidden grain without contacts after the last grain; free slots refer to it.
    static RVE_INLINE void add_hidden_grain(const SharedView<Config> &shared, int num_grains)
    {
      shared.motion[num_grains] = MotionOf<Config>();
      shared.spin[num_grains] = Spin<Real, Config::D>();
      shared.radius[num_grains] = kRadiusWithoutContact<Config>;
    }

    /// Returns whether the first steps can read the grains directly from the stored state. This
    /// requires that no other code reads the grains before the steps.
    static RVE_INLINE bool is_direct(const CallState<Config> &call)
    {
      return Block::kInRegisters && !call.fatal() && call.plan_last > 0 &&
          call.drive.substeps > 0 && !call.batch.track_energy;
    }

    /// Converts the stored state to internal units, for a call for which is_direct() is false.
    /// prepare() and set_views() must have run; `shared` is one of the views.
    static RVE_INLINE void begin(Block &block, CallState<Config> &call,
                                 const SharedView<Config> &shared)
    {
      const int n = call.num_grains;
      const bool continued = call.is_continued();
      block.for_each(n, [&](Item i) {
        const typename Stored::StoredGrain stored =
            Stored::read_grain(call.device_state, i, n, continued);
        Stored::publish_grain(call, shared, i, stored);
        shared.motion[i] = Stored::internal_motion(call, stored);
        shared.largest_force[i] = Real(0);
        if (continued)
          Stored::take_pairs(call, shared, i, stored);
        else
          list_position_of(shared, i) = stored.list_position;
      });
      if (call.fatal()) return;
      if (!continued) {
        find_list_and_scale(block, call,
                            call.header.list_valid != 0 ? call.image_pairs() : call.pairs);
        if (call.fatal()) return;
      }
      Stored::fill_partner_radius(block, shared, n);
      take_extra_pairs(block, call);
    }

    /// Copies the extra pairs and converts their histories to internal units.
    static RVE_INLINE void take_extra_pairs(Block &block, CallState<Config> &call)
    {
      if (call.num_extra == 0) return;
      const PairView<Config> from = call.header.list_valid != 0 ? call.image_pairs() : call.pairs;
      const PairView<Config> to = call.pairs;
      block.for_each(call.num_extra, [&](Item m) {
        to.extra_first[m] = from.extra_first[m];
        to.extra_second[m] = from.extra_second[m];
        to.extra_history[m] = Stored::internal_history(call, from.extra_history[m]);
      });
    }

    /// Builds the list if there is no valid one, and estimates the force scale if the last call has
    /// left none. `from` has the stored pairs if the stored list is valid. Otherwise it is
    /// call.pairs, where the new list is built.
    static RVE_COLD void find_list_and_scale(Block block, CallState<Config> &call,
                                             PairView<Config> from)
    {
      if (!call.header.list_valid) {
        block.once([&] { Renewal::set_out(call, call.cell); });
        Renewal::rebuild(block, call, call.image_pairs());
      }
      if (call.fatal()) return;
      if (!(call.header.largest_contact_force > 0.0)) Units::estimate_force(block, call, from);
      block.once([&] { Units::choose_units(call); });
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        typename Stored::StoredGrain stored;
        Stored::read_pairs(from.partner, from.history, i, n, stored);
        stored.list_position = list_position_of(call.shared, i);
        Stored::take_pairs(call, call.shared, i, stored);
      });
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
