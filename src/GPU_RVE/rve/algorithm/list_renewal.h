// A new Verlet list during a call, and the reduction of the lattice.

#ifndef RVE_ALGORITHM_LIST_RENEWAL_H
#define RVE_ALGORITHM_LIST_RENEWAL_H

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/step_planning.h"
#include "rve/algorithm/stored_grain.h"
#include "rve/algorithm/verlet_list.h"

namespace rve {
inline namespace RVE_ISA {

  /// On arrays, apart from the steps: it takes no registers from them.
  template <class Block, class Scene> struct ListRenewal {
    using Item = typename Block::Item;
    using Wide = typename Scene::Wide;
    using Planning = StepPlanning<Block, Scene>;

    /// Reduces the lattice if it is due, builds the list of step k from call.pairs into call.pairs, and plans anew.
    static RVE_COLD void renew(Block block, CallState<Scene> &call, int k)
    {
      MotionOf<Scene> *motion = call.shared.motion;
      // a quarter of the cell in one step is no motion of a grain any more
      const Wide quarter_cell = static_cast<Wide>(0.25 / Scene::fraction_unit);
      const Tensor<Wide, Scene::D> to_fraction = call.planned(k).to_fraction;
      const bool unstable = block.any(call.num_grains, [&](Item i) {
        const Vec<Wide, Scene::D> move = to_fraction * motion[i].velocity.template as<Wide>();
        bool stable = true;
        for (int a = 0; a < Scene::D; ++a) stable = stable && std::fabs(move[a]) <= quarter_cell;
        return !stable;
      });
      if (unstable) {
        block.once([&] {
          call.status |= status::Unstable;
        });
        return;
      }
      for (int guard = 0; guard < 8; ++guard) {
        const auto change = lattice_step(Planning::cell_of_step(call, k));
        if (change.axis < 0) break;
        block.for_each(call.num_grains, [&](Item i) {
          motion[i].position = apply_lattice_step(motion[i].position, change);
        });
        block.once([&] {
          if (call.has_servo())
            call.cell = apply_lattice_step(call.cell, change);
          else
            call.path.map_start([&](const Tensor<double, Scene::D> &start) {
              return apply_lattice_step(start, change);
            });
          ++call.num_reductions;
        });
      }
      rebuild(block, call, call.pairs, Planning::cell_of_step(call, k));
      if (!call.fatal()) Planning::make_plan(block, call, k);
    }

    /// Builds the list of the present positions; call.pairs has it afterwards. Contact history comes from the `old` pairs.
    static RVE_COLD void rebuild(Block block, CallState<Scene> &call, PairView<Scene> old,
                                 Tensor<double, Scene::D> cell)
    {
      const double largest_radius = call.header.largest_radius;
      // the wrapped difference is the nearest image only within half of the smallest width; a NaN fails the comparison too
      const bool wide_enough = 0.5 * smallest_width(cell) > 2.0 * largest_radius + call.skin;
      ListSizes sizes{0, 0};
      const double per_length = call.units.per_length;
      if (wide_enough)
        sizes = build_list(block, call.shared.motion, call.shared.radius, call.work,
                           call.num_grains, per_length * cell, per_length * largest_radius,
                           per_length * call.skin, old, call.num_extra);
      block.once([&] {
        if (!wide_enough) {
          call.status |= determinant(cell) == determinant(cell) ? status::CellTooNarrow
                                                                : status::NonFinite;
          return;
        }
        if (sizes.num_pairs > call.work.pair_capacity) call.status |= status::ListFull;
        call.needed_pairs = sizes.num_pairs;
        call.num_extra = sizes.num_extra;
        call.list_cell = cell;
        ++call.num_rebuilds;
        CallProgress<Scene>::note_progress(call, 0.0);
      });
      if (call.fatal()) return;
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          call.pairs.partner[k * n + i] = call.work.fresh.partner[k * n + i];
          call.pairs.history[k * n + i] = call.work.fresh.history[k * n + i];
        }
        for (int a = 0; a < Scene::D; ++a)
          call.shared.response[i].list_position[a] =
              leading_bits(call.shared.motion[i].position[a]);
      });
      StoredGrains<Block, Scene>::fill_partner_radius(block, call.shared, n);
      if (call.num_extra > 0)
        block.for_each(call.num_extra, [&](Item m) {
          call.pairs.extra_first[m] = call.work.fresh.extra_first[m];
          call.pairs.extra_second[m] = call.work.fresh.extra_second[m];
          call.pairs.extra_history[m] = call.work.fresh.extra_history[m];
        });
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
