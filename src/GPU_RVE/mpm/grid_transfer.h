// From points to nodes and back: the weights of a point, the integer sums on the nodes, and the gather.

#ifndef MPM_GRID_TRANSFER_H
#define MPM_GRID_TRANSFER_H

#include "mpm/exact_sum.h"
#include "mpm/grid.h"
#include "mpm/shape_functions.h"
#include "rve/core/tensor.h"

#include <cstdint>
#include <vector>

namespace mpm {

/// The nine nodes around a point: node(a, b) is column a and row b of its 3 x 3 block.
struct Support {
  int first_node;    ///< storage index of node(0, 0)
  int row_stride;
  AxisWeights x, y;
  double per_cell;    ///< 1 / cell size [1/length]

  int node(int a, int b) const { return first_node + b * row_stride + a; }
  double value(int a, int b) const { return x.value[a] * y.value[b]; }
  Vec2 gradient(int a, int b) const
  {
    return {{x.slope[a] * y.value[b] * per_cell, x.value[a] * y.slope[b] * per_cell}};
  }
};

/// Weights of a point inside the grid. half_size [length] matters for Gimp only.
inline Support support_of(const Grid &grid, ShapeFunction shape, const double *position,
                          const Vec2 &half_size)
{
  Support support;
  AxisWeights *axis[2] = {&support.x, &support.y};
  for (int a = 0; a < 2; ++a) {
    const double xi = grid.scaled(position[a], a);
    *axis[a] = shape == ShapeFunction::Linear
        ? linear_weights(xi, grid.cells(a))
        : gimp_weights(xi, std::min(half_size[a] / grid.cell_size(), 0.5));
  }
  support.first_node = grid.node(support.x.first, support.y.first);
  support.row_stride = grid.row_stride();
  support.per_cell = 1.0 / grid.cell_size();
  return support;
}

/// Integer sums of C quantities per node, one copy per thread so that no addition needs a lock.
template <int C> class NodeSums {
 public:
  NodeSums(int node_count, int threads) :
      parts_(threads, std::vector<std::int64_t>(static_cast<std::size_t>(node_count) * C))
  {
  }

  void clear()
  {
    for (auto &part : parts_) std::fill(part.begin(), part.end(), 0);
  }

  std::int64_t *of_thread(int thread) { return parts_[thread].data(); }

  /// Adds the copies up; the result is the copy of thread 0.
  std::vector<std::int64_t> &merged()
  {
    for (std::size_t t = 1; t < parts_.size(); ++t)
      for (std::size_t k = 0; k < parts_[0].size(); ++k) parts_[0][k] += parts_[t][k];
    return parts_[0];
  }

  std::int64_t at(int node, int c) const
  {
    return parts_[0][static_cast<std::size_t>(node) * C + c];
  }

 private:
  std::vector<std::vector<std::int64_t>> parts_;
};

/// Adds share(a, b) of `total` to component c of every node of the support, each share rounded once. What rounding leaves of
/// the rounded total goes to the heaviest node: the nodes hold the total of the points to the last bit.
template <int C, class Share>
void scatter(const Support &support, const FixedScale &scale, double total, const Share &share,
             std::int64_t *sums, int c)
{
  std::int64_t left = scale.integer(total);
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) {
      const std::int64_t part = scale.integer(share(a, b));
      sums[static_cast<std::size_t>(support.node(a, b)) * C + c] += part;
      left -= part;
    }
  sums[static_cast<std::size_t>(support.node(support.x.heaviest(), support.y.heaviest())) * C +
       c] += left;
}

/// Σ_I N_I(x_p) field_I
inline Vec2 interpolate(const Support &support, const std::vector<Vec2> &field)
{
  Vec2 sum = Vec2::zero();
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) sum = sum + support.value(a, b) * field[support.node(a, b)];
  return sum;
}

/// Σ_I field_I ⊗ ∇N_I(x_p)
inline rve::Tensor2 interpolate_gradient(const Support &support, const std::vector<Vec2> &field)
{
  rve::Tensor2 sum = rve::Tensor2::zero();
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) sum = sum + dyad(field[support.node(a, b)], support.gradient(a, b));
  return sum;
}

}    // namespace mpm

#endif
