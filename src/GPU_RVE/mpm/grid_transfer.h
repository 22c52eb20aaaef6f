// SPDX-License-Identifier: GPL-2.0-only
// Transfers between points and nodes: weights of a point, contributions of a point to integer sums
// on nodes, and interpolation from nodes.

#pragma once

#include "mpm/grid.h"
#include "mpm/shape_functions.h"
#include "rve/core/exact_sum.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace mpm {

/// The nodes around a point, three along each axis. Places in the support count from 0 to 2.
template <int D> struct Support {
  int first_node;       ///< storage index of the node at place 0
  int stride[D - 1];    ///< strides of the storage index along all axes but the first
  AxisWeights axis[D];
  double per_cell;    ///< 1 / cell size [1/length]

  RVE_INLINE int node(const NodeIndex<D> &place) const
  {
    return node(place, std::make_index_sequence<D - 1>());
  }
  RVE_INLINE double value(const NodeIndex<D> &place) const
  {
    return value(place, std::make_index_sequence<D>());
  }
  RVE_INLINE Vec<D> gradient(const NodeIndex<D> &place) const
  {
    Vec<D> gradient;
    for (int c = 0; c < D; ++c) {
      double product = c == 0 ? axis[0].slope[place[0]] : axis[0].value[place[0]];
      for (int a = 1; a < D; ++a)
        product *= a == c ? axis[a].slope[place[a]] : axis[a].value[place[a]];
      gradient[c] = product * per_cell;
    }
    return gradient;
  }
  RVE_HD NodeIndex<D> heaviest() const
  {
    NodeIndex<D> place;
    for (int a = 0; a < D; ++a) place[a] = axis[a].heaviest();
    return place;
  }

  /// Sets all other members from the grid and the weights of the axes.
  RVE_HD void locate(const Grid<D> &grid)
  {
    NodeIndex<D> first;
    for (int a = 0; a < D; ++a) first[a] = axis[a].first;
    first_node = grid.node(first);
    for (int a = 1; a < D; ++a) stride[a - 1] = grid.stride(a);
    per_cell = 1.0 / grid.cell_size();
  }

 private:
  // index sequences replace loops over axes, which device compilers would not unroll inside the
  // loops over nodes
  template <std::size_t... A>
  RVE_INLINE int node(const NodeIndex<D> &place, std::index_sequence<A...>) const
  {
    return (first_node + ... + (place[A + 1] * stride[A])) + place[0];
  }
  template <std::size_t... A>
  RVE_INLINE double value(const NodeIndex<D> &place, std::index_sequence<A...>) const
  {
    return (... * axis[A].value[place[A]]);
  }
};

/// Calls visit(place) for the nodes of a support; the place along the first axis varies fastest.
/// The fixed order preserves the bits of floating point sums.
template <int D, class Visit> RVE_INLINE void each_node(const Visit &visit)
{
  static_assert(D == 2 || D == 3, "each dimension needs its own loops");
  if constexpr (D == 2) {
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a) visit(NodeIndex<D>{{a, b}});
  } else {
    for (int c = 0; c < 3; ++c)
      for (int b = 0; b < 3; ++b)
        for (int a = 0; a < 3; ++a) visit(NodeIndex<D>{{a, b, c}});
  }
}

/// The box of a point at the start of a step [cells].
template <int D> struct PointBox {
  Vec<D> place;    ///< centre from the low sides of the grid [cells]
  Vec<D> half;     ///< half sizes, above 0.5 only if the box follows the deformation [cells]

  /// Number of equal parts along an axis, each of which is at most one cell long.
  RVE_HD int parts(int axis) const
  {
    const double cells = 2.0 * half[axis] * (1.0 - 1e-9);
    return cells > 1.0 ? static_cast<int>(std::ceil(cells)) : 1;
  }
};

/// Half size along an axis [cells] of the axis-aligned box that replaces the deformed box of a
/// point: l_a² = Σ_b (F_ab l_b)², with the deformation gradient F and the initial half sizes l_b.
/// Both boxes have the same second moments along the axes. A rotation does not change the half
/// sizes of a square or cube. If a stretched box rotates, its stretch rotates with it.
template <int D>
RVE_HD double deformed_half(const Grid<D> &grid, const Vec<D> &half_size,
                            const Tensor<D> &deformation, int axis)
{
  double square = 0.0;
  for (int b = 0; b < D; ++b) {
    const double edge = deformation(axis, b) * half_size[b];
    square += edge * edge;
  }
  return std::sqrt(square) / grid.cell_size();
}

/// The box with the half sizes deformed_half(), limited to half a cell beyond the sides of the
/// grid.
template <int D>
RVE_HD PointBox<D> deformed_box(const Grid<D> &grid, const double *position,
                                const Vec<D> &half_size, const Tensor<D> &deformation,
                                bool axisymmetric = false)
{
  PointBox<D> box;
  for (int a = 0; a < D; ++a) {
    box.place[a] = grid.scaled(position[a], a);
    box.half[a] = deformed_half(grid, half_size, deformation, a);
    const double above = grid.cells(a) - box.place[a];
    const double room = 0.5 + (above < box.place[a] ? above : box.place[a]);
    if (box.half[a] > room) box.half[a] = room;
    const double radius = grid.radius(box.place[0]);
    if (axisymmetric && a == 0 && box.half[a] > radius) box.half[a] = radius;
  }
  return box;
}

/// Centre and half size of a part of a box along an axis [cells].
struct PartOfAxis {
  double xi, half;
  template <int D>
  RVE_HD PartOfAxis(const PointBox<D> &box, int axis, int part) :
      half(box.half[axis] / box.parts(axis))
  {
    xi = box.place[axis] - box.half[axis] + (2 * part + 1) * half;
    if (!(half < 0.5)) half = 0.5;
  }
};

/// Weights of a part of a box; `part` has its index along each axis. In axisymmetry they are those
/// of a ring.
template <int D>
RVE_HD Support<D> support_of(const Grid<D> &grid, const PointBox<D> &box, const int *part,
                             bool axisymmetric = false)
{
  Support<D> support;
  for (int a = 0; a < D; ++a) {
    const PartOfAxis at(box, a, part[a]);
    support.axis[a] = axisymmetric && a == 0 ? ring_weights(at.xi, at.half, grid.radius(at.xi))
                                             : gimp_weights(at.xi, at.half);
  }
  support.locate(grid);
  return support;
}

/// Weights of the hoop strain and the hoop force of a part of a ring: means of N/r over the part
/// with the weight r, where N is the shape function of a node.
struct HoopWeights {
  double radius = 1.0;    ///< of the middle of the part [length]
  /// Hat functions along r, averaged and divided by the radius [1/length].
  double along_r[3] = {};

  /// Weight of a node [1/length].
  template <int D>
  RVE_INLINE double value(const Support<D> &support, const NodeIndex<D> &node) const
  {
    double product = along_r[node[0]];
    for (int a = 1; a < D; ++a) product *= support.axis[a].value[node[a]];
    return product;
  }
};

/// Hoop weights of a part of a ring with the index `part` along r.
template <int D>
RVE_HD HoopWeights hoop_weights_of(const Grid<D> &grid, const PointBox<D> &box, int part)
{
  const PartOfAxis at(box, 0, part);
  const AxisWeights plane = gimp_weights(at.xi, at.half);
  HoopWeights hoop;
  hoop.radius = grid.cell_size() * grid.radius(at.xi);
  const double per_radius = 1.0 / hoop.radius;
  for (int k = 0; k < 3; ++k) hoop.along_r[k] = plane.value[k] * per_radius;
  return hoop;
}

/// Weights of a point inside the grid with a box of fixed size. Linear ignores half_size [length].
template <int D>
RVE_HD Support<D> support_of(const Grid<D> &grid, ShapeFunction shape, const double *position,
                             const Vec<D> &half_size)
{
  Support<D> support;
  for (int a = 0; a < D; ++a) {
    const double xi = grid.scaled(position[a], a);
    const double half = half_size[a] / grid.cell_size();
    support.axis[a] = shape == ShapeFunction::Linear ? linear_weights(xi, grid.cells(a))
                                                     : gimp_weights(xi, half < 0.5 ? half : 0.5);
  }
  support.locate(grid);
  return support;
}

/// Adds to the k-th of the sums on nodes. Other types of sums overload this function.
RVE_HD inline void add_to(std::int64_t *sums, std::size_t k, std::int64_t part)
{
  sums[k] += part;
}

/// Adds share(place) to component c of `C` sums per node for all nodes of the support. `left` is
/// the rounded total. Each share is rounded once, except for the heaviest node, which gets the rest
/// of the total. The sum over the nodes is therefore exactly the total.
template <int C, int D, class Share, class Sums>
RVE_HD void scatter_integer(const Support<D> &support, const rve::FixedScale &scale,
                            std::int64_t left, const Share &share, Sums sums, int c)
{
  const int heaviest = support.node(support.heaviest());
  each_node<D>([&](const NodeIndex<D> &place) RVE_INLINE_LAMBDA {
    const int node = support.node(place);
    if (node == heaviest) return;
    const std::int64_t part = scale.integer(share(place));
    add_to(sums, static_cast<std::size_t>(node) * C + c, part);
    left -= part;
  });
  add_to(sums, static_cast<std::size_t>(heaviest) * C + c, left);
}

/// Rounds `total` and adds its shares to nodes as scatter_integer() does.
template <int C, int D, class Share, class Sums>
RVE_HD void scatter(const Support<D> &support, const rve::FixedScale &scale, double total,
                    const Share &share, Sums sums, int c)
{
  scatter_integer<C>(support, scale, scale.integer(total), share, sums, c);
}

/// Returns Σ_I N_I(x_p) field_I; `field` is an array over the nodes.
template <int D, class Field>
RVE_HD Vec<D> interpolate(const Support<D> &support, const Field &field)
{
  Vec<D> sum = Vec<D>::zero();
  each_node<D>([&](const NodeIndex<D> &place) RVE_INLINE_LAMBDA {
    sum = sum + support.value(place) * field[support.node(place)];
  });
  return sum;
}

/// Returns Σ_I field_I ⊗ ∇N_I(x_p).
template <int D, class Field>
RVE_HD Tensor<D> interpolate_gradient(const Support<D> &support, const Field &field)
{
  Tensor<D> sum = Tensor<D>::zero();
  each_node<D>([&](const NodeIndex<D> &place) RVE_INLINE_LAMBDA {
    sum = sum + dyad(field[support.node(place)], support.gradient(place));
  });
  return sum;
}

}    // namespace mpm
