// SPDX-License-Identifier: GPL-2.0-only
// Renewal of the Verlet list during a call, and reduction of the lattice.

#pragma once

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/force_units.h"
#include "rve/algorithm/reorder.h"
#include "rve/algorithm/step_planning.h"
#include "rve/algorithm/stored_grain.h"
#include "rve/algorithm/verlet_list.h"

namespace rve {
inline namespace RVE_ISA {

  /// Renews Verlet lists. The functions are not inlined into the steps, so that they take no
  /// registers from the steps.
  template <class Block, class Config> struct ListRenewal {
    using Item = typename Block::Item;
    using Wide = typename Config::Wide;
    using Planning = StepPlanning<Block, Config>;

    /// Reduces the lattice if a reduction is due, replaces call.pairs by the list of step k, and
    /// plans the steps from k on again.
    static RVE_COLD void renew(Block block, CallState<Config> &call, int k)
    {
      const SeenMotions<Config> motion = at_known_addresses<Block>(call.shared).motion;
      // A motion by more than a quarter of the cell in one step is unstable.
      const Wide quarter_cell = static_cast<Wide>(0.25 / Config::fraction_unit);
      const Tensor<Wide, Config::D> to_fraction = call.planned(k).to_fraction;
      const bool leans = call.planned(k).allowed_squared < 0.0f;
      const bool unstable = block.any(
          call.num_grains,
          [&](Item i) {
            const Vec<Wide, Config::D> move = to_fraction * motion[i].velocity.template as<Wide>();
            bool stable = true;
            for (int a = 0; a < Config::D; ++a)
              stable = stable && std::fabs(move[a]) <= quarter_cell;
            return !stable;
          },
          [&] { set_out(call, Planning::cell_of_step(call, k)); });
      if (unstable) {
        const bool saturated = ForceUnits<Block, Config>::is_saturated(block, call);
        block.once([&] { call.status |= saturated ? status::ForceSaturated : status::Unstable; });
        return;
      }
      if (leans) reduce_lattice(block, call, k);
      rebuild(block, call, call.pairs);
      if (!call.fatal()) Planning::make_plan(block, call, k);
    }

    /// Sets the cell of a list and its search grid. One thread calls it.
    static RVE_INLINE void set_out(CallState<Config> &call, const Tensor<double, Config::D> &cell)
    {
      const double range = contact_range<Config>(call.header);
      Vec<double, Config::D> width;
      for (int a = 0; a < Config::D; ++a) width[a] = perpendicular_width(cell, a);
      double smallest = width[0];
      for (int a = 1; a < Config::D; ++a) smallest = width[a] < smallest ? width[a] : smallest;
      call.list_cell = cell;
      // The wrapped difference of two positions gives the nearest image only up to a distance of
      // half the smallest width. A NaN also fails this test.
      call.list_fits = 0.5 * smallest > range + call.skin;
      if (call.list_fits)
        call.list_grid = SearchGrid<Config::D>(width, range + call.skin, call.work.cell_capacity);
    }

    /// Builds the list for the current positions and the cell that set_out() has set, and writes it
    /// to call.pairs. Contact histories are copied from the pairs `old`.
    static RVE_COLD void rebuild(Block block, CallState<Config> &call, PairView<Config> old)
    {
      const int n = call.num_grains;
      if (!call.list_fits) {
        block.once([&] {
          const double volume = determinant(call.list_cell);
          call.status |= volume == volume ? status::CellTooNarrow : status::NonFinite;
        });
        return;
      }
      const SharedView<Config> shared = at_known_addresses<Block>(call.shared);
      const WorkspaceView<Config> work = workspace_of(call, shared);
      const double reach = Config::Law::reach(call.header.material);
      const SearchGrid<Config::D> grid = call.list_grid;
      const double per_length = call.units.per_length;
      const ListSizes sizes =
          build_list(block, shared.motion, shared.radius, work, n, per_length * call.list_cell,
                     grid, per_length * reach, per_length * call.skin, old, call.num_extra,
                     [&](const ListSizes &known) {
                       call.needed_pairs = known.num_pairs;
                       call.num_extra = known.num_extra;
                       if constexpr (Config::steers) call.list_inverse = inverse(call.list_cell);
                       ++call.num_rebuilds;
                       CallProgress<Config>::note_progress(call, {});
                     });
      if (sizes.num_pairs > work.pair_capacity) {
        block.once([&] {
          call.status |= status::ListFull;
          call.needed_pairs = sizes.num_pairs;
        });
        return;
      }
      order_grains(block, call, shared, work);
      const auto place = [&](int i) { return work.proposal[i]; };
      block.for_each(n, [&](Item i) {
        work.number[i] = work.excess_start[i];
        if constexpr (Block::kCapacity > 0) clear_sums<Block>(shared, i);
        const int here = place(i);
        for (int k = 0; k < Config::owned_pairs; ++k) {
          call.pairs.partner[k * n + here] = place(work.fresh.partner[k * n + i]);
          call.pairs.history[k * n + here] = work.fresh.history[k * n + i];
        }
        for (int a = 0; a < Config::D; ++a)
          list_position_of(shared, i)[a] = leading_bits(shared.motion[i].position[a]);
      });
      StoredGrains<Block, Config>::fill_partner_radius(block, shared, n);
      if (sizes.num_extra > 0)
        block.for_each(sizes.num_extra, [&](Item m) {
          call.pairs.extra_first[m] = place(work.fresh.extra_first[m]);
          call.pairs.extra_second[m] = place(work.fresh.extra_second[m]);
          call.pairs.extra_history[m] = work.fresh.extra_history[m];
        });
    }

   private:
    /// Returns the workspace to build the list in, with arrays on chip where possible. These arrays
    /// overwrite the sums of forces, which must be cleared afterwards.
    static RVE_INLINE WorkspaceView<Config> workspace_of(CallState<Config> &call,
                                                         const SharedView<Config> &shared)
    {
      WorkspaceView<Config> work = call.work;
      if constexpr (Block::kCapacity > 0) build_on_chip(work, shared, call.plan, Block::kCapacity);
      return work;
    }

    /// Reduces the lattice and sets the cell of step k again. The caller requests a reduction only
    /// if the plan of step k has a negative allowed_squared.
    static RVE_COLD void reduce_lattice(Block block, CallState<Config> &call, int k)
    {
      const SeenMotions<Config> motion = at_known_addresses<Block>(call.shared).motion;
      for (int guard = 0; guard < 8; ++guard) {
        const auto change = lattice_step(call.list_cell);
        if (change.axis < 0) break;
        block.for_each(call.num_grains, [&](Item i) {
          motion[i].position = apply_lattice_step(motion[i].position, change);
        });
        block.once([&] {
          if (call.has_servo())
            call.cell = apply_lattice_step(call.cell, change);
          else
            call.path.map_start([&](const Tensor<double, Config::D> &start) {
              return apply_lattice_step(start, change);
            });
          ++call.num_reductions;
          set_out(call, Planning::cell_of_step(call, k));
        });
      }
    }

    /// Renumbers the grains. Disks that own the most pairs come first. Spheres with the most
    /// touching pairs come first. Each grain has Config::owned_pairs slots, and a slot stores one
    /// pair or is free. After the renumbering, the threads of a warp, or the lanes of a pack, skip
    /// the same slots together. For spheres a quarter of all evaluations of slots is saved, and for
    /// disks a sixth. Disks with the same number of pairs are numbered row by row of the search
    /// grid. Neighbouring threads therefore read neighbouring grains even after many rebuilds. The
    /// new numbers are in work.proposal; the pairs are not moved yet. The stored state keeps its
    /// order until the call ends successfully.
    static RVE_INLINE void order_grains(Block &block, CallState<Config> &call,
                                        const SharedView<Config> &shared,
                                        const WorkspaceView<Config> &work)
    {
      const int n = call.num_grains;
      const auto grain_at = [&](int m) { return Config::D == 2 ? work.cell_grain[m] : m; };
      const std::int32_t *number = call.num_rebuilds == 1 ? call.device_state.number : work.number;
      block.template order_by_class<Config::owned_pairs + 1>(
          n, [&](int m) { return Config::owned_pairs - work.load[m]; },
          [&](int m, int index) {
            const int i = grain_at(m);
            work.proposal[i] = index;
            work.excess_start[index] = number[i];    // the old content is not needed any more
          });
      const auto move = [&](auto *...array) {
        static_assert((sizeof(*array) + ...) <= kScratch<Config::D> * sizeof(double) &&
                          ((alignof(std::decay_t<decltype(*array)>) <= 16) && ...),
                      "capacity");
        reorder(
            block, n, [&](int i) { return work.proposal[i]; }, work.scratch, array...);
      };
      if constexpr (Config::D == 2) {
        move(shared.response, shared.motion);
        move(shared.radius, shared.spin, shared.largest_force);
      } else {
        if constexpr (Config::in_memory) {
          move(shared.motion.place);
          move(shared.motion.course);
        } else {
          move(shared.motion);
        }
        move(shared.list_position);
        move(shared.largest_force);
      }
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
