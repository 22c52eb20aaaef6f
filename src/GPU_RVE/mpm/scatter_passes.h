// SPDX-License-Identifier: GPL-2.0-only
// Passes that add what points give to the integer sums on nodes.

#pragma once

#include "mpm/cell_passes.h"

namespace mpm {

/// Mass and momentum of a point.
template <int D> struct InertiaOfPoint {
  static constexpr SumKind KIND = InertiaSums;
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    mass_scale = step.mass_scale();
    momentum_scale = step.momentum_scale();
  }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double mass = step.points.mass[p];
    const Vec<D> velocity = first_of<D>(step.points.velocity[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      give<KIND>(support, part, mass_scale, mass, sums, 0);
      for (int c = 0; c < D; ++c)
        give<KIND>(support, part, momentum_scale, mass * velocity[c], sums, 1 + c);
    });
  }
};

/// f_I = - Σ V σ·∇N_I + Σ f N_I
/// (Sulsky, Chen & Schreyer 1994, Comput. Methods Appl. Mech. Eng. 118, 179).
template <int D> struct ForceOfPoint {
  static constexpr SumKind KIND = VectorSums;
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.force_scale(); }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    Tensor<D> stress = step.points.stress[p];
    if (step.mean_dilation) {
      const double change = mean_of_cells(step, p) - trace(stress) / D;
      for (int a = 0; a < D; ++a) stress(a, a) += change;
    }
    const double volume = step.points.volume[p];
    const Vec<D> body_force = first_of<D>(step.points.body_force[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      const Tensor<D> stress_volume = (-volume * part.share()) * stress;
      for (int c = 0; c < D; ++c) {
        // Σ∇N = 0: the shares of the internal force add up to nothing, to the last bit
        scatter_integer<width_of<D>(KIND)>(
            support, scale, 0,
            [&](const Place<D> &place) {
              const Vec<D> gradient = support.gradient(place);
              double force = stress_volume(c, 0) * gradient[0];
              for (int a = 1; a < D; ++a) force += stress_volume(c, a) * gradient[a];
              return force;
            },
            sums, c);
        if (body_force[c] != 0.0) give<KIND>(support, part, scale, body_force[c], sums, c);
      }
    });
  }
};

/// The momentum after the motion of the points.
template <int D> struct MomentumAgainOfPoint {
  static constexpr SumKind KIND = VectorSums;
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.momentum_again_scale(); }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double mass = step.points.mass[p];
    const Vec<D> velocity = first_of<D>(step.points.velocity[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      for (int c = 0; c < D; ++c) give<KIND>(support, part, scale, mass * velocity[c], sums, c);
    });
  }
};

/// All that the Parts say of a deformable point, added in one pass.
template <int D, class... Parts> struct Scatter : PointPass<D>, Parts... {
  using Pass<D>::step;
  Scatter(const PointPass<D> &pass) : PointPass<D>(pass) {}

  static constexpr bool adds_to(SumKind kind) { return ((Parts::KIND == kind) || ...); }
  RVE_HD void begin() { (Parts::begin(step), ...); }
  template <class Sums> RVE_HD void operator()(int p, const Sums &sums) const
  {
    if (step.points.rigid_body[p] < 0) (Parts::to_nodes(step, p, sums[Parts::KIND]), ...);
  }
};

template <int D> using ScatterInertia = Scatter<D, InertiaOfPoint<D>>;
template <int D> using ScatterForces = Scatter<D, ForceOfPoint<D>>;
/// Where stresses do not change between inertia and forces.
template <int D> using ScatterInertiaAndForces = Scatter<D, InertiaOfPoint<D>, ForceOfPoint<D>>;
template <int D> using ScatterMomentumAgain = Scatter<D, MomentumAgainOfPoint<D>>;

}    // namespace mpm
