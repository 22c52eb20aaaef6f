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
      const SeenMotions<Scene> motion = call.shared.motion;
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
      const double range = contact_range<Scene>(call.header),
                   reach = Scene::Law::reach(call.header.material);
      // the wrapped difference is the nearest image only within half of the smallest width; a NaN fails the comparison too
      const bool wide_enough = 0.5 * smallest_width(cell) > range + call.skin;
      ListSizes sizes{0, 0};
      const double per_length = call.units.per_length;
      if (wide_enough)
        sizes = build_list(block, call.shared.motion, call.shared.radius, call.work,
                           call.num_grains, per_length * cell, per_length * range,
                           per_length * reach, per_length * call.skin, old, call.num_extra);
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
        if constexpr (Scene::steers) call.list_inverse = inverse(cell);
        ++call.num_rebuilds;
        CallProgress<Scene>::note_progress(call, {});
      });
      if (call.fatal()) return;
      const int n = call.num_grains;
      if constexpr (Scene::D == 3) order_grains(block, call);
      const auto place = [&](int i) {
        return Scene::D == 3 ? call.work.proposal[i] : i;
      };
      block.for_each(n, [&](Item i) {
        const int here = place(i);
        for (int k = 0; k < Scene::owned_pairs; ++k) {
          call.pairs.partner[k * n + here] = place(call.work.fresh.partner[k * n + i]);
          call.pairs.history[k * n + here] = call.work.fresh.history[k * n + i];
        }
        for (int a = 0; a < Scene::D; ++a)
          list_position_of(call.shared, i)[a] = leading_bits(call.shared.motion[i].position[a]);
      });
      StoredGrains<Block, Scene>::fill_partner_radius(block, call.shared, n);
      if (call.num_extra > 0)
        block.for_each(call.num_extra, [&](Item m) {
          call.pairs.extra_first[m] = place(call.work.fresh.extra_first[m]);
          call.pairs.extra_second[m] = place(call.work.fresh.extra_second[m]);
          call.pairs.extra_history[m] = call.work.fresh.extra_history[m];
        });
    }

   private:
    /// Numbers the grains anew: those that own most pairs that touch first. The threads of a warp, or the lanes of a pack, then have
    /// nothing to do in the same slots, and skip them together: a quarter of all contacts. work.proposal has the new places; the pairs
    /// are still to be moved. The image keeps its order until the call ends soundly.
    static RVE_COLD void order_grains(Block block, CallState<Scene> &call)
    {
      const int n = call.num_grains;
      const WorkspaceView<Scene> &work = call.work;
      // flags by key and grain, whose sums are the places: room that the list does not need any more
      std::int32_t *flag = work.row_partner;
      constexpr int kKeys = Scene::owned_pairs + 1;
      static_assert(PairCounts<3>::listed_at_first >= kKeys, "room for the flags");
      const auto flag_of = [&](int i) {
        return (Scene::owned_pairs - work.load[i]) * n + i;
      };
      block.for_each(kKeys * n, [&](Item m) {
        flag[m] = 0;
      });
      block.for_each(n, [&](Item i) {
        flag[flag_of(i)] = 1;
      });
      block.exclusive_scan(flag, kKeys * n);
      block.for_each(n, [&](Item i) {
        work.proposal[i] = flag[flag_of(i)];
      });
      const bool is_first = call.num_rebuilds == 1;    // of this call
      const std::int32_t *number = is_first ? call.image.number : work.number;
      block.for_each(n, [&](Item i) {
        work.accepted[work.proposal[i]] = number[i];
      });
      block.for_each(n, [&](Item i) {
        work.number[i] = work.accepted[i];
      });
      const SharedView<Scene> &shared = call.shared;
      if constexpr (Scene::in_memory) {
        move_to_places(block, n, work, shared.motion.place);
        move_to_places(block, n, work, shared.motion.course);
      } else {
        move_to_places(block, n, work, shared.motion);
      }
      move_to_places(block, n, work, shared.list_position);
      move_to_places(block, n, work, shared.largest_force);
    }

    template <class T>
    static RVE_INLINE void move_to_places(Block &block, int n, const WorkspaceView<Scene> &work,
                                          T *array)
    {
      static_assert(sizeof(T) <= kScratch<Scene::D> * sizeof(double) && alignof(T) <= 16, "room");
      T *moved = reinterpret_cast<T *>(work.scratch);
      block.for_each(n, [&](Item i) {
        moved[work.proposal[i]] = array[i];
      });
      block.for_each(n, [&](Item i) {
        array[i] = moved[i];
      });
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
