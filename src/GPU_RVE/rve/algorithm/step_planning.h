// SPDX-License-Identifier: GPL-2.0-only
// Plans the DEM steps of a call: computes the data of the cell for many steps at a time.

#pragma once

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/verlet_list.h"

namespace rve {
inline namespace RVE_ISA {

  /// Plans the steps of a call on the path of its cell.
  template <class Block, class Config> struct StepPlanning {
    using Item = typename Block::Item;
    using Real = typename Config::Real;
    using Wide = typename Config::Wide;

    /// Returns the number of steps to plan before the call begins. The number is zero with a servo,
    /// whose first cell is not known. The function requires a valid list.
    static RVE_INLINE int steps_to_plan(const PreparedCall<Config> &call)
    {
      return call.has_servo() ? 0 : steps_to_plan(call, 1);
    }

    /// Returns H after step k, which is planned or about to be planned.
    static RVE_INLINE Tensor<double, Config::D> cell_of_step(const PreparedCall<Config> &call,
                                                             int k)
    {
      if (call.has_servo()) return call.cell;
      CellPath<Config::D> path = call.path;
      return cell_on(path, k);
    }

    /// Returns how many steps from `first` on can be planned.
    static RVE_INLINE int steps_to_plan(const PreparedCall<Config> &call, int first)
    {
      const int left = call.drive.substeps - first + 1;
      if (call.has_servo() || left < 1) return 1;
      return left < kPlanSteps<Config> ? left : kPlanSteps<Config>;
    }

    /// Plans as many steps from `first` on as possible.
    static RVE_COLD void make_plan(Block block, CallState<Config> &call, int first)
    {
      const int count = steps_to_plan(call, first);
      block.for_each(count, [&](Item t) { plan_step(call, t, first); });
      block.once([&] {
        if (!call.has_servo() && call.drive.segments > 1) cell_on(call.path, first - 1);
        call.plan_first = first;
        call.plan_last = first + count - 1;
      });
    }

    /// Makes entry t of a plan that starts with step `first`.
    static RVE_INLINE void plan_step(PreparedCall<Config> &call, int t, int first)
    {
      if (call.has_servo()) {
        plan_servo_motion(call);
        plan_list(call, call.plan[0], call.cell, inverse(call.list_cell));
        return;
      }
      Tensor<double, Config::D> cell = call.cell, rate = Tensor<double, Config::D>::zero();
      if (call.drive.substeps > 0) {
        CellPath<Config::D> path = call.path;
        const bool has_corners = call.drive.segments > 1;
        const Tensor<double, Config::D> before = has_corners ? cell_on(path, first + t - 1) : cell;
        const int segment = path.present_segment();
        cell = cell_on(path, first + t);
        // A step around a corner of the path goes straight from the old cell to the new one, and
        // its rate is that of the straight line. With the rate of the next segment, a pair that
        // turns with the cell would slip, and a rotation would do work. The slip would always have
        // the same direction if the axis of rotation is inclined to the normal.
        rate = path.present_segment() == segment ? path.cell_rate()
                                                 : (1.0 / call.drive.dt) * (cell - before);
      }
      const Tensor<double, Config::D> inverse_cell = inverse(cell);
      plan_motion(call, call.plan[t], cell, inverse_cell, rate * inverse_cell);
      plan_list(call, call.plan[t], cell, inverse(call.list_cell));
    }

    /// Plans step k of a servo, whose cell and rate are known. The thread that plans the motion
    /// calls f() afterwards; another thread plans the list at the same time.
    template <class F>
    static RVE_INLINE void plan_servo_step(Block &block, CallState<Config> &call, int k, F f)
    {
      block.for_each(
          1,
          [&](Item) {
            plan_servo_motion(call);
            call.plan_first = call.plan_last = k;
            f();
          },
          [&] { plan_list(call, call.plan[0], call.cell, call.list_inverse); });
    }

   private:
    static RVE_INLINE Tensor<double, Config::D> cell_on(CellPath<Config::D> &path, int step)
    {
      // Inlined code would need more registers than any other part of the kernel.
      if constexpr (KernelTraits<Block, Config>::uniform_constants)
        return path.cell_apart(step);
      else
        return path.cell(step);
    }

    /// Plans the motion in the only planned step of a servo.
    static RVE_INLINE void plan_servo_motion(PreparedCall<Config> &call)
    {
      const Tensor<double, Config::D> cell = call.cell;
      Tensor<double, Config::D> gradient = call.servo_gradient;
      // The gradient of a plan times the branch at the end of the step is the change of the branch
      // in the step, divided by dt. As on a path, the gradient is (I - exp(-L dt))/dt.
      if constexpr (Config::D == 3)
        gradient = gradient - (0.5 * call.drive.dt) * (gradient * gradient);
      plan_motion(call, call.plan[0], cell, inverse(cell), gradient);
      call.end_per_volume = CallProgress<Config>::per_volume(call, call.plan[0].volume);
    }

    /// Plans the motion of grains and their contacts in a step.
    static RVE_INLINE void plan_motion(const PreparedCall<Config> &call, PlanOf<Config> &plan,
                                       const Tensor<double, Config::D> &cell,
                                       const Tensor<double, Config::D> &inverse_cell,
                                       const Tensor<double, Config::D> &gradient)
    {
      plan.to_length = fraction_to_length<typename Config::Numbers>(call.units.per_length * cell);
      plan.to_fraction =
          ((call.drive.dt * call.units.length / Config::fraction_unit) * inverse_cell)
              .template as<Wide>();
      plan.gradient = gradient.template as<Real>();
      plan.volume = determinant(cell);
    }

    /// Computes how far grains are allowed to move with the current list, and whether the cell
    /// allows the list at all.
    static RVE_INLINE void plan_list(const PreparedCall<Config> &call, PlanOf<Config> &plan,
                                     const Tensor<double, Config::D> &cell,
                                     const Tensor<double, Config::D> &list_inverse)
    {
      const double per_length = call.units.per_length;
      // The factor covers the rounding of displacements.
      const double allowed = (1.0 - 1e-5) * per_length *
          allowed_displacement(cell, list_inverse, contact_range<Config>(call.header), call.skin);
      const bool serves = allowed > 0.0 && !is_lattice_step_due(cell);
      const Tensor<float, Config::D> lengths = fraction_to_length<FastNumbers>(per_length * cell);
      plan.set_list_to_length(lengths);
      // The squared length of a displacement is always above -1, unless the cell is not finite;
      // such a call does not end successfully.
      plan.allowed_squared = serves ? static_cast<float>(allowed * allowed) : -1.0f;
      plan.safe_box = serves ? safe_box(lengths, allowed) : 0;
    }

    /// Returns the half width of a box whose corners are at most `allowed` from its centre. Along
    /// each Cartesian axis, the distance of a corner from the centre is at most the sum of the
    /// components of the half edges. The factor covers the rounding of the exact displacement,
    /// which is computed for grains outside of the box.
    static RVE_INLINE std::uint32_t safe_box(const Tensor<float, Config::D> &to_length,
                                             double allowed)
    {
      float corner = 0.0f;
      for (int a = 0; a < Config::D; ++a) {
        float along = 0.0f;
        for (int b = 0; b < Config::D; ++b) along += std::fabs(to_length(a, b));
        corner += along * along;
      }
      const float box = 0.999f * static_cast<float>(allowed) / std::sqrt(corner);
      return static_cast<std::uint32_t>(box < 0x1p30f ? box : 0x1p30f);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
