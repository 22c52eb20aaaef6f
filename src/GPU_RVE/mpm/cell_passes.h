// SPDX-License-Identifier: GPL-2.0-only
// Passes for means over cells: the volumetric parts of strain and stress with mean dilation.
//
// Many points in a cell ask for more constraints of volume than its nodes have freedoms, and the
// material locks. With the mean of the cell it has one constraint (Hughes 1980, Int. J. Numer. Meth.
// Engng 15, 1413). The mean pressure in the forces belongs to it:
//   Σ_p V p tr(L)_mean = Σ_c V_c p_c tr(L)_c = Σ_p V p_mean tr(L),
// so that forces do the work of the stresses.

#pragma once

#include "mpm/box_parts.h"

namespace mpm {

/// visit(node, weight) for the cells that the box of a point covers, by the node below each, with the
/// part of the box that is in it. With linear shape functions all of a point is in one cell.
template <int D, class Visit>
RVE_HD void each_cell(const StepView<D> &step, int p, const Visit &visit)
{
  const PointBox<D> &box = step.box[p];
  const bool has_extent = step.shape != ShapeFunction::Linear;
  int first[D];
  int count[D];
  int total = 1;
  for (int a = 0; a < D; ++a) {
    const double half = has_extent ? box.half[a] : 0.0;
    const int last_cell = step.grid.cells(a) - (has_extent ? 0 : 1);
    int last = static_cast<int>(std::floor(box.place[a] + half));
    first[a] = static_cast<int>(std::floor(box.place[a] - half));
    if (last > last_cell) last = last_cell;
    if (first[a] > last) first[a] = last;
    count[a] = last - first[a] + 1;
    total *= count[a];
  }
  for (int k = 0; k < total; ++k) {
    Place<D> cell;
    double weight = 1.0;
    for (int a = 0, rest = k; a < D; ++a) {
      cell[a] = first[a] + rest % count[a];
      rest /= count[a];
      if (!has_extent) continue;
      const double low = box.place[a] - box.half[a], high = box.place[a] + box.half[a];
      const double from = low > cell[a] ? low : cell[a];
      const double to = high < cell[a] + 1.0 ? high : cell[a] + 1.0;
      weight *= to > from ? (to - from) / (high - low) : 0.0;
    }
    if (weight > 0.0) visit(step.grid.node(cell), weight);
  }
}

/// The mean of the cells of a point.
template <int D> RVE_HD double mean_of_cells(const StepView<D> &step, int p)
{
  double mean = 0.0;
  each_cell(step, p, [&](int node, double weight) { mean += weight * step.cell_mean[node]; });
  return mean;
}

/// Scales of the two sums of a cell: volume, and volume times pressure or dilation.
template <int D> struct CellScales {
  rve::FixedScale volume, product;

  RVE_HD void begin(const StepView<D> &step, bool is_dilation)
  {
    const double most = step.maximum[VolumeBound];
    volume = rve::FixedScale(most, step.point_total);
    product = rve::FixedScale(most * step.maximum[is_dilation ? DilationBound : PressureBound],
                              step.point_total);
  }
};

/// Volume of the points in each cell, and volume times their dilation or pressure.
template <int D> struct ScatterToCells : PointPass<D> {
  using Pass<D>::step;
  bool is_dilation;    ///< else the pressure
  CellScales<D> scale = {};

  static constexpr bool adds_to(SumKind kind) { return kind == VectorSums; }
  RVE_HD void begin() { scale.begin(step, is_dilation); }
  template <class Sums> RVE_HD void operator()(int p, const Sums &sums) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const double volume = step.points.volume[p];
    const double value = is_dilation ? trace(step.points.velocity_gradient[p])
                                     : trace(step.points.stress[p]) / D;
    each_cell(step, p, [&](int node, double weight) {
      const std::size_t k = width_of<D>(VectorSums) * static_cast<std::size_t>(node);
      add_to(sums[VectorSums], k, scale.volume.integer(weight * volume));
      add_to(sums[VectorSums], k + 1, scale.product.integer(weight * volume * value));
    });
  }
};

template <int D> struct MeanOfCell : NodePass<D> {
  using Pass<D>::step;
  bool is_dilation;
  CellScales<D> scale = {};

  RVE_HD void begin() { scale.begin(step, is_dilation); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const std::int64_t *of_cell = step.sums_at(VectorSums, n);
    const double volume = scale.volume.real(of_cell[0]);
    step.cell_mean[n] = volume > 0.0 ? scale.product.real(of_cell[1]) / volume : 0.0;
  }
};

/// L of a point before its dilation is replaced by that of its cells.
template <int D> struct GradientOfPoint : PointPass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const Tensor<D> gradient = gathered_gradient(step, p, step.velocity);
    step.points.velocity_gradient[p] = gradient;
    tally.raise(DilationBound, std::abs(trace(gradient)));
  }
};

}    // namespace mpm
