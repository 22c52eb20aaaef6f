// SPDX-License-Identifier: GPL-2.0-only
// Sums on the nodes of the grid: each node adds up contributions of the points near it, as
// integers. Each sum is a struct with these members:
//   KIND          kind of its integers (SumKind)
//   USES_WATER    true if to_nodes() reads the pore water of points
//   begin()       sets the scale of the integers
//   to_nodes()    adds the contributions of a point to its nodes
//   take()        computes fields of a node from the sum
// Scatter and TakeSums run several sums in one pass.

#pragma once

#include "mpm/point_nodes.h"

namespace mpm {

/// Sums of mass and momentum.
template <int D> struct Inertia {
  static constexpr SumKind KIND = InertiaSums;
  static constexpr bool USES_WATER = false;
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    mass_scale = step.scale(MassBound);
    momentum_scale = step.scale(MomentumBound);
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
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.sums_at(KIND, n);
    step.mass[n] = mass_scale.real(sums[0]);
    for (int c = 0; c < D; ++c) step.momentum[n][c] = momentum_scale.real(sums[1 + c]);
  }
};

/// Sums of mass and momentum for strains at the start of the step.
template <int D> struct InertiaForStrains : Inertia<D> {
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    Inertia<D>::take(step, n);
    step.forget_contacts(n);
    step.momentum_end[n] = step.momentum[n];
  }
};

/// Sums of the forces on nodes, f_I = - Σ V σ·∇N_I + Σ f N_I, with the volume V, total stress σ,
/// body force f and shape functions N_I of points (Sulsky, Chen & Schreyer 1994, Comput. Methods
/// Appl. Mech. Eng. 118, 179). In axisymmetry the radial component has the hoop stress as well,
/// - Σ V σ_θθ T_I with the hoop weights T_I of the ring. take() adds f_I dt to the momentum of the
/// node.
template <int D> struct Force {
  static constexpr SumKind KIND = VectorSums;
  static constexpr bool USES_WATER = true;
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.force_scale(); }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double volume = step.points.volume[p];
    Tensor<D> stress = step.total_stress(p, step.points.stress[p], volume);
    double hoop_stress = step.hoop_stress(p);    // there is no water in axisymmetry
    if (step.mean_dilation) {
      const double change =
          mean_of_cells(step, p) - step.trace_with(stress, hoop_stress) / step.normal_components();
      for (int a = 0; a < D; ++a) stress(a, a) += change;
      hoop_stress += change;
    }
    const Vec<D> body_force = first_of<D>(step.points.body_force[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      const double part_volume = -volume * part.share();
      const Tensor<D> stress_volume = part_volume * stress;
      HoopWeights hoop;
      if (step.is_axisymmetric()) hoop = hoop_weights_of(step, p, part);
      for (int c = 0; c < D; ++c) {
        // Σ∇N = 0 and ΣT = 1/r, so the shares of the internal force add up to exactly 0 or, along
        // the radius, to the hoop force
        const bool has_hoop = step.is_axisymmetric() && c == 0;
        const double hoop_volume = has_hoop ? part_volume * hoop_stress : 0.0;
        scatter_integer<width_of<D>(KIND)>(
            support, scale, has_hoop ? scale.integer(hoop_volume / hoop.radius) : 0,
            [&](const NodeIndex<D> &place) {
              const Vec<D> gradient = support.gradient(place);
              double force = stress_volume(c, 0) * gradient[0];
              for (int a = 1; a < D; ++a) force += stress_volume(c, a) * gradient[a];
              if (has_hoop) force += hoop_volume * hoop.value(support, place);
              return force;
            },
            sums, c);
        if (body_force[c] != 0.0) give<KIND>(support, part, scale, body_force[c], sums, c);
      }
    });
  }
  /// Sets force and momentum, and clears contacts and impulses of bodies from the step before.
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.sums_at(KIND, n);
    for (int c = 0; c < D; ++c) step.force[n][c] = scale.real(sums[c]);
    step.momentum_end[n] = step.mass[n] > 0.0 ? step.momentum[n] + step.dt * step.force[n]
                                              : Vec<D>::zero();
    step.forget_contacts(n);
    for (int b = 0; b < step.num_bodies; ++b) step.body_impulse[step.in_row(b, n)] = Vec<D>::zero();
  }
};

/// Sums of the volume of ground with water, and of the forces on its water per volume of pores,
/// Σ V p ∇N_I + Σ ρ_w V b N_I, with the pore pressure p and the acceleration b of the body force.
/// take() finds the flux of Darcy's law at the node, q_I = (k/ρ_w g) (forces)/(volume). The flux is
/// 0 in still water, also where the porosity changes. A face without a condition has p = 0.
template <int D> struct WaterFlow {
  static constexpr SumKind KIND = InertiaSums;
  static constexpr bool USES_WATER = true;
  rve::FixedScale volume_scale, scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    volume_scale = step.scale(VolumeBound);
    scale = rve::FixedScale(step.maximum[VolumeBound] * step.maximum[PressureBound] /
                                step.grid.cell_size(),
                            step.point_total);
  }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const PointView<D> &points = step.points;
    if (!(points.water.water_volume[p] > 0.0)) return;
    const double volume = points.volume[p];
    const double pressure = step.pressure_of_water(p, volume);
    const double weight = step.water.density * volume / points.mass[p];
    const Vec<D> body_force = first_of<D>(points.body_force[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      give<KIND>(support, part, volume_scale, volume, sums, 0);
      const double pressure_volume = pressure * volume * part.share();
      for (int c = 0; c < D; ++c) {
        scatter_integer<width_of<D>(KIND)>(
            support, scale, 0,
            [&](const NodeIndex<D> &place) { return pressure_volume * support.gradient(place)[c]; },
            sums, 1 + c);
        give<KIND>(support, part, scale, weight * body_force[c], sums, 1 + c);
      }
    });
  }
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.sums_at(KIND, n);
    const double volume = volume_scale.real(sums[0]);
    const NodeIndex<D> place = step.grid.place(n);
    for (int c = 0; c < D; ++c) {
      const bool is_closed = (place[c] <= 0 && step.water.is_impervious(c, false)) ||
          (place[c] >= step.grid.cells(c) && step.water.is_impervious(c, true));
      step.water_flux[n][c] =
          volume > 0.0 && !is_closed ? step.water.mobility * scale.real(sums[1 + c]) / volume : 0.0;
    }
  }
};

/// Sums of momentum after the motion of the points.
template <int D> struct MomentumAgain {
  static constexpr SumKind KIND = VectorSums;
  static constexpr bool USES_WATER = false;
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.scale(MomentumAgainBound); }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double mass = step.points.mass[p];
    const Vec<D> velocity = first_of<D>(step.points.velocity[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      for (int c = 0; c < D; ++c) give<KIND>(support, part, scale, mass * velocity[c], sums, c);
    });
  }
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.sums_at(KIND, n);
    for (int c = 0; c < D; ++c) step.momentum_end[n][c] = scale.real(sums[c]);
  }
};

/// Sums for means over cells: volume, and volume times dilation (or pressure), of the points in
/// each cell. With these means a cell with many points has one volume constraint instead of one per
/// point (Hughes 1980, Int. J. Numer. Meth. Engng 15, 1413). Nodal forces use the mean pressure, so
/// that the work of the forces is the work of the stresses.
template <int D, bool IS_DILATION> struct CellMean {
  static constexpr SumKind KIND = VectorSums;
  static constexpr bool USES_WATER = !IS_DILATION;
  rve::FixedScale volume_scale, product_scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    const double volume = step.maximum[VolumeBound];
    volume_scale = rve::FixedScale(volume, step.point_total);
    product_scale = rve::FixedScale(
        volume * step.maximum[IS_DILATION ? DilationBound : PressureBound], step.point_total);
  }
  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double volume = step.points.volume[p];
    double value;
    if constexpr (IS_DILATION)
      value = step.trace_with(step.points.velocity_gradient[p],
                              step.is_axisymmetric() ? step.hoop_increment[p] : 0.0);
    else
      value = step.trace_with(step.total_stress(p, step.points.stress[p], volume),
                              step.hoop_stress(p)) /
          step.normal_components();
    each_cell(step, p, [&](int node, double weight) {
      const std::size_t k = width_of<D>(KIND) * static_cast<std::size_t>(node);
      add_to(sums, k, volume_scale.integer(weight * volume));
      add_to(sums, k + 1, product_scale.integer(weight * volume * value));
    });
  }
  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *of_cell = step.sums_at(KIND, n);
    const double volume = volume_scale.real(of_cell[0]);
    step.cell_mean[n] = volume > 0.0 ? product_scale.real(of_cell[1]) / volume : 0.0;
  }
};
template <int D> using MeanDilation = CellMean<D, true>;
template <int D> using MeanPressure = CellMean<D, false>;

/// Pass that adds the contributions of deformable points to sums.
template <int D, template <int> class... Sum> struct Scatter : PointPass<D>, Sum<D>... {
  using Pass<D>::step;
  Scatter(const PointPass<D> &pass) : PointPass<D>(pass) {}

  static constexpr bool USES_WATER = (Sum<D>::USES_WATER || ...);
  static constexpr bool adds_to(SumKind kind) { return ((Sum<D>::KIND == kind) || ...); }
  RVE_HD void begin() { (Sum<D>::begin(step), ...); }
  template <class Sums> RVE_HD void operator()(int p, const Sums &sums) const
  {
    if (step.points.rigid_body[p] < 0) (Sum<D>::to_nodes(step, p, sums[Sum<D>::KIND]), ...);
  }
};

/// Pass that computes fields of nodes from sums, in the order of the sums.
template <int D, template <int> class... Sum> struct TakeSums : NodePass<D>, Sum<D>... {
  using Pass<D>::step;
  TakeSums(const NodePass<D> &pass) : NodePass<D>(pass) {}

  static constexpr bool USES_WATER = false;    // the sums have the pressure of the water already
  RVE_HD void begin() { (Sum<D>::begin(step), ...); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    (Sum<D>::take(step, n), ...);
  }
};

}    // namespace mpm
