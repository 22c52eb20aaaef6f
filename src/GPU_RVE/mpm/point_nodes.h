// SPDX-License-Identifier: GPL-2.0-only
// Functions of a point and its nodes: parts of a box that is larger than a cell, contributions to
// sums on nodes, interpolation of node fields, and the cells that the box covers.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// A part of the box of a point; all parts have equal sizes. In axisymmetry the box is a ring, and
/// parts with a larger radius have larger shares.
template <int D> struct BoxPart {
  int number = 0, count = 1;    ///< index of the part, and number of parts
  int place[D] = {};            ///< index of the part along each axis
  bool is_ring = false;
  // of a ring with several parts only
  int parts_along_r = 1;
  double low = 0.0, high = 0.0;    ///< radii of the edges of the whole box [cells]

  RVE_HD double share() const
  {
    if (!is_ring || count == 1) return 1.0 / count;
    return share_before(number + 1) - share_before(number);
  }
  /// Returns the integer share of this part in a total. The shares of all parts add up exactly to
  /// the rounded total.
  RVE_HD std::int64_t integer(const rve::FixedScale &scale, double total) const
  {
    if (count == 1) return scale.integer(total);
    if (is_ring)
      return scale.integer(total * share_before(number + 1)) -
          scale.integer(total * share_before(number));
    return scale.integer(total * ((number + 1.0) / count)) -
        scale.integer(total * (double(number) / count));
  }

  /// Makes the part one of a ring. `count` must be set.
  RVE_HD void set_ring(const Grid<D> &grid, const PointBox<D> &box)
  {
    is_ring = true;
    if (count == 1) return;
    parts_along_r = box.parts(0);
    low = grid.radius(box.place[0] - box.half[0]);
    high = grid.radius(box.place[0] + box.half[0]);
  }

 private:
  /// Share of the volume of the ring in the parts before part k.
  RVE_HD double share_before(int k) const
  {
    const int rows = k / parts_along_r, along_r = k % parts_along_r;
    const double edge = low + (high - low) * along_r / parts_along_r;
    const double of_row = (edge * edge - low * low) / (high * high - low * low);
    return (rows + of_row) * parts_along_r / count;
  }
};

/// Calls visit(support, part) for each part of the box of a point. A box that is not larger than a
/// cell has one part with the weights of the point.
template <int D, class Visit>
RVE_HD void each_part(const StepView<D> &step, int p, const Visit &visit)
{
  BoxPart<D> part;
  if (step.follows())
    for (int a = 0; a < D; ++a) part.count *= step.box[p].parts(a);
  if (part.count == 1) {
    if (step.is_axisymmetric()) part.set_ring(step.grid, step.box[p]);
    // without a copy, a GPU thread would read the weights again after each addition to memory
    const Support<D> support = step.support[p];
    visit(support, part);
    return;
  }
  const PointBox<D> box = step.box[p];
  for (; part.number < part.count; ++part.number) {
    for (int a = 0, rest = part.number; a < D; ++a) {
      part.place[a] = rest % box.parts(a);
      rest /= box.parts(a);
    }
    if (step.is_axisymmetric()) part.set_ring(step.grid, box);
    visit(support_of(step.grid, box, part.place, step.is_axisymmetric()), part);
  }
}

/// Adds a quantity `whole` of a point to component c of the sums of KIND on the nodes of the point.
/// A call adds the share of one part of the box. All parts together add exactly the rounded
/// quantity.
template <SumKind KIND, int D, class Sums>
RVE_HD void give(const Support<D> &support, const BoxPart<D> &part, const rve::FixedScale &scale,
                 double whole, Sums sums, int c)
{
  const double value = whole * part.share();
  scatter_integer<width_of<D>(KIND)>(
      support, scale, part.integer(scale, whole),
      [&](const NodeIndex<D> &place) { return value * support.value(place); }, sums, c);
}

/// Returns Σ_I N_I(x_p) field_I.
template <int D> RVE_HD Vec<D> gathered(const StepView<D> &step, int p, const Vec<D> *field)
{
  if (!step.follows()) return interpolate(step.support[p], field);
  Vec<D> sum = Vec<D>::zero();
  each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
    sum = sum + part.share() * interpolate(support, field);
  });
  return sum;
}

/// Returns Σ_I field_I ⊗ ∇N_I(x_p).
template <int D>
RVE_HD Tensor<D> gathered_gradient(const StepView<D> &step, int p, const Vec<D> *field)
{
  if (!step.follows()) return interpolate_gradient(step.support[p], field);
  Tensor<D> sum = Tensor<D>::zero();
  each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
    sum = sum + part.share() * interpolate_gradient(support, field);
  });
  return sum;
}

/// Returns the hoop weights of a part of the ring of an axisymmetric point.
template <int D>
RVE_HD HoopWeights hoop_weights_of(const StepView<D> &step, int p, const BoxPart<D> &part)
{
  return part.count == 1 ? step.hoop_weights[p]
                         : hoop_weights_of(step.grid, step.box[p], part.place[0]);
}

/// Returns the hoop strain rate Σ_I T_I v_r,I of an axisymmetric point, where T_I is the mean of
/// N_I/r over its ring [1/time]. The product with the radius of the point is the radial velocity of
/// the grid at the centre of its box.
template <int D> RVE_HD double gathered_hoop_rate(const StepView<D> &step, int p)
{
  double sum = 0.0;
  each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
    const HoopWeights hoop = hoop_weights_of(step, p, part);
    double of_part = 0.0;
    each_node<D>([&](const NodeIndex<D> &place) RVE_INLINE_LAMBDA {
      of_part += hoop.value(support, place) * step.velocity[support.node(place)][0];
    });
    sum += part.share() * of_part;
  });
  return sum;
}

/// Calls visit(node, weight) for the cells that the box of a point covers. `node` is the lowest
/// node of the cell, and `weight` the fraction of the volume of the box in the cell. With linear
/// shape functions a point is in one cell.
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
    NodeIndex<D> cell;
    double weight = 1.0;
    for (int a = 0, rest = k; a < D; ++a) {
      cell[a] = first[a] + rest % count[a];
      rest /= count[a];
      if (!has_extent) continue;
      const double low = box.place[a] - box.half[a], high = box.place[a] + box.half[a];
      const double from = low > cell[a] ? low : cell[a];
      const double to = high < cell[a] + 1.0 ? high : cell[a] + 1.0;
      weight *= to > from ? (to - from) / (high - low) : 0.0;
      if (step.is_axisymmetric() && a == 0)
        weight *= (step.grid.radius(from) + step.grid.radius(to)) /
            (step.grid.radius(low) + step.grid.radius(high));
    }
    if (weight > 0.0) visit(step.grid.node(cell), weight);
  }
}

/// Returns the weighted mean of the values of a point's cells.
template <int D> RVE_HD double mean_of_cells(const StepView<D> &step, int p)
{
  double mean = 0.0;
  each_cell(step, p, [&](int node, double weight) { mean += weight * step.cell_mean[node]; });
  return mean;
}

}    // namespace mpm
