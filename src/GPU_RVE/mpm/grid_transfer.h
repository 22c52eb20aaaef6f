// From points to nodes and back: the weights of a point, its shares of the integer sums on the nodes, and the gather.

#ifndef MPM_GRID_TRANSFER_H
#define MPM_GRID_TRANSFER_H

#include "mpm/grid.h"
#include "mpm/shape_functions.h"
#include "rve/core/exact_sum.h"
#include "rve/core/tensor.h"

#include <cstddef>
#include <cstdint>

namespace mpm {

/// The nine nodes around a point: node(a, b) is column a and row b of its 3 x 3 block.
struct Support {
  int first_node;    ///< storage index of node(0, 0)
  int row_stride;
  AxisWeights x, y;
  double per_cell;    ///< 1 / cell size [1/length]

  RVE_HD int node(int a, int b) const { return first_node + b * row_stride + a; }
  RVE_HD double value(int a, int b) const { return x.value[a] * y.value[b]; }
  RVE_HD Vec2 gradient(int a, int b) const
  {
    return {{x.slope[a] * y.value[b] * per_cell, x.value[a] * y.slope[b] * per_cell}};
  }
};

/// Weights of a point inside the grid. half_size [length] matters for Gimp only.
RVE_HD inline Support support_of(const Grid &grid, ShapeFunction shape, const double *position,
                                 const Vec2 &half_size)
{
  Support support;
  AxisWeights *axis[2] = {&support.x, &support.y};
  for (int a = 0; a < 2; ++a) {
    const double xi = grid.scaled(position[a], a);
    const double half = half_size[a] / grid.cell_size();
    *axis[a] = shape == ShapeFunction::Linear ? linear_weights(xi, grid.cells(a))
                                              : gimp_weights(xi, half < 0.5 ? half : 0.5);
  }
  support.first_node = grid.node(support.x.first, support.y.first);
  support.row_stride = grid.row_stride();
  support.per_cell = 1.0 / grid.cell_size();
  return support;
}

/// Adds to the k-th of some sums on nodes. Where threads share the sums, their type brings an addition of its own.
RVE_HD inline void add_to(std::int64_t *sums, std::size_t k, std::int64_t part)
{
  sums[k] += part;
}

/// Adds share(a, b) of `total` to component c of every node of the support, each share rounded once. What rounding leaves of
/// the rounded total goes to the heaviest node: the nodes hold the total of the points to the last bit.
template <int C, class Share, class Sums>
RVE_HD void scatter(const Support &support, const rve::FixedScale &scale, double total,
                    const Share &share, Sums sums, int c)
{
  std::int64_t left = scale.integer(total);
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) {
      const std::int64_t part = scale.integer(share(a, b));
      add_to(sums, static_cast<std::size_t>(support.node(a, b)) * C + c, part);
      left -= part;
    }
  const int heaviest = support.node(support.x.heaviest(), support.y.heaviest());
  add_to(sums, static_cast<std::size_t>(heaviest) * C + c, left);
}

/// Σ_I N_I(x_p) field_I; `field` is an array over the nodes.
template <class Field> RVE_HD Vec2 interpolate(const Support &support, const Field &field)
{
  Vec2 sum = Vec2::zero();
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) sum = sum + support.value(a, b) * field[support.node(a, b)];
  return sum;
}

/// Σ_I field_I ⊗ ∇N_I(x_p)
template <class Field>
RVE_HD rve::Tensor2 interpolate_gradient(const Support &support, const Field &field)
{
  rve::Tensor2 sum = rve::Tensor2::zero();
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) sum = sum + dyad(field[support.node(a, b)], support.gradient(a, b));
  return sum;
}

}    // namespace mpm

#endif
