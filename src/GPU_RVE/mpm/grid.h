// SPDX-License-Identifier: GPL-2.0-only
// The background grid: cells of equal edges over a box, with one layer of ghost nodes around it.
//
// A point inside the box reaches at most one cell width beyond it, since the half size of a GIMP
// domain is at most half a cell. One layer therefore has all ghost nodes that points can touch.
//
// A rank stores a box of nodes, its part of the grid. Storage indices of nodes refer to this part.
// Cells, coordinates and places (node numbers along each axis) refer to the whole grid.

#pragma once

#include "rve/core/config.h"
#include "rve/core/error.h"
#include "rve/core/space.h"
#include "rve/core/tensor.h"
#include "rve/core/vec.h"

#include <cmath>
#include <cstdint>

namespace mpm {

template <int D> using Vec = rve::Vec<double, D>;
template <int D> using Tensor = rve::Tensor<double, D>;
using Vec2 = Vec<2>;

/// Index of a node along each axis.
template <int D> using NodeIndex = rve::Vec<int, D>;

/// Sides of the grid and faces of the box of a point or body: low and high side of each axis.
enum class Face { XLo, XHi, YLo, YHi, ZLo, ZHi };

/// Number of faces of a box.
template <int D> constexpr int FACES = 2 * rve::Space<D>::axes;

RVE_HD inline int axis_of(Face face)
{
  return static_cast<int>(face) / 2;
}

/// Returns the direction of the outward normal along its axis: -1 or +1.
RVE_HD inline double outward(Face face)
{
  return static_cast<int>(face) % 2 == 0 ? -1.0 : 1.0;
}

template <int D> class Grid;

/// A block of nodes of a grid, from `first` to before `end` along each axis.
template <int D> struct NodeBox {
  NodeIndex<D> first = NodeIndex<D>::zero();
  NodeIndex<D> end = NodeIndex<D>::zero();

  bool is_empty() const
  {
    for (int a = 0; a < D; ++a)
      if (first[a] >= end[a]) return true;
    return false;
  }
  RVE_HD bool contains(const NodeIndex<D> &place) const
  {
    for (int a = 0; a < D; ++a)
      if (place[a] < first[a] || place[a] >= end[a]) return false;
    return true;
  }
  RVE_HD bool contains(const Grid<D> &grid, int node) const { return contains(grid.place(node)); }

  /// Number of nodes. The type is double, since boxes of large grids exceed the range of int.
  double count() const
  {
    double count = 1.0;
    for (int a = 0; a < D; ++a) count *= first[a] < end[a] ? end[a] - first[a] : 0;
    return count;
  }

  /// Calls visit(place) for all nodes; the place along the first axis varies fastest.
  template <class Visit> void for_each(const Visit &visit) const
  {
    if (is_empty()) return;
    NodeIndex<D> place = first;
    for (int a = 0; a < D;) {
      visit(place);
      for (a = 0; a < D && ++place[a] == end[a]; ++a) place[a] = first[a];
    }
  }
};

/// Returns the nodes in both boxes.
template <int D> NodeBox<D> common(const NodeBox<D> &one, const NodeBox<D> &other)
{
  NodeBox<D> box;
  for (int a = 0; a < D; ++a) {
    box.first[a] = one.first[a] > other.first[a] ? one.first[a] : other.first[a];
    box.end[a] = one.end[a] < other.end[a] ? one.end[a] : other.end[a];
  }
  return box;
}

template <int D> class Grid {
 public:
  /// Upper limit, exclusive, of the number of nodes that can be held.
  static constexpr double MOST_NODES = 2e8;

  /// Divides the box from lo to hi [length] into cells of `cell_size` [length]. The grid holds all
  /// nodes. If there are MOST_NODES or more, it holds none, and part() returns a grid that holds
  /// some of them. Throws rve::InputError unless all extents are whole numbers of cells within 1e-6
  /// cells.
  Grid(const Vec<D> &lo, const Vec<D> &hi, double cell_size) :
      lo_(lo), hi_(hi), cell_size_(cell_size)
  {
    using rve::require;
    require(cell_size > 0.0, "grid cell size must be positive, got ", cell_size, " [length]");
    for (int a = 0; a < D; ++a) {
      const char axis = "xyz"[a];
      require(hi[a] > lo[a], "grid extent in ", axis, " must be positive, got lo ", lo[a], ", hi ",
              hi[a], " [length]");
      const double cells = (hi[a] - lo[a]) / cell_size;
      require(cells < 1e6, "grid must have fewer than 1000000 cells in ", axis, ", got ", cells);
      cells_[a] = static_cast<int>(std::lround(cells));
      require(cells_[a] > 0 && std::abs(cells - cells_[a]) < 1e-6, "grid extent in ", axis,
              " must be a whole number of cells, got ", hi[a] - lo[a], " / ", cell_size, " = ",
              cells);
    }
    if (all().count() < MOST_NODES) *this = part(all());
  }

  /// Returns the box of all nodes of the grid including ghosts.
  NodeBox<D> all() const
  {
    NodeBox<D> box;
    for (int a = 0; a < D; ++a) {
      box.first[a] = -1;
      box.end[a] = cells_[a] + 2;
    }
    return box;
  }
  /// Returns the same grid with storage for a box of nodes. The box must be within all() and have
  /// fewer than MOST_NODES nodes.
  Grid part(const NodeBox<D> &box) const
  {
    Grid grid = *this;
    for (int a = 0; a < D; ++a) {
      grid.first_[a] = box.is_empty() ? 0 : box.first[a];
      grid.held_[a] = box.is_empty() ? 0 : box.end[a] - box.first[a];
    }
    return grid;
  }
  /// Returns the box of the nodes that are held.
  NodeBox<D> held() const
  {
    NodeBox<D> box;
    for (int a = 0; a < D; ++a) {
      box.first[a] = first(a);
      box.end[a] = last(a) + 1;
    }
    return box;
  }

  RVE_HD double cell_size() const { return cell_size_; }
  RVE_HD double lo(int axis) const { return lo_[axis]; }
  RVE_HD double hi(int axis) const { return hi_[axis]; }

  /// Number of cells along an axis. Its nodes are -1 (ghost), 0 ... cells, cells + 1 (ghost).
  RVE_HD int cells(int axis) const { return cells_[axis]; }

  /// Number of nodes that are held along an axis; first() and last() are the places of the
  /// outermost held nodes.
  RVE_HD int nodes(int axis) const { return held_[axis]; }
  RVE_HD int first(int axis) const { return first_[axis]; }
  RVE_HD int last(int axis) const { return first_[axis] + held_[axis] - 1; }
  RVE_HD int node_count() const { return stride(D); }

  /// Returns the storage index of the node at a place. The node must be held. Places are from -1 to
  /// cells + 1 along each axis.
  RVE_HD int node(const NodeIndex<D> &place) const
  {
    int index = place[D - 1] - first_[D - 1];
    for (int a = D - 2; a >= 0; --a) index = index * nodes(a) + (place[a] - first_[a]);
    return index;
  }
  /// Returns the place of the node with this storage index.
  RVE_HD NodeIndex<D> place(int node) const
  {
    NodeIndex<D> place;
    for (int a = 0; a < D - 1; ++a) {
      place[a] = node % nodes(a) + first_[a];
      node /= nodes(a);
    }
    place[D - 1] = node + first_[D - 1];
    return place;
  }
  /// Difference of the storage indices of successive nodes along an axis.
  RVE_HD int stride(int axis) const
  {
    int stride = 1;
    for (int a = 0; a < axis; ++a) stride *= nodes(a);
    return stride;
  }
  /// Number of lines of held nodes along an axis.
  RVE_HD int lines_along(int axis) const
  {
    int lines = 1;
    for (int a = 0; a < D; ++a)
      if (a != axis) lines *= nodes(a);
    return lines;
  }
  /// Number of layers. A layer has the nodes with the same place along the last axis, contiguous in
  /// storage.
  int layers() const { return nodes(D - 1); }
  int layer_size() const { return stride(D - 1); }

  /// Returns the index of a place among all() nodes, in the order of storage.
  std::int64_t id(const NodeIndex<D> &place) const
  {
    std::int64_t id = 0;
    for (int a = D - 1; a >= 0; --a) id = id * (cells_[a] + 3) + (place[a] + 1);
    return id;
  }
  NodeIndex<D> place_of_id(std::int64_t id) const
  {
    NodeIndex<D> place;
    for (int a = 0; a < D; ++a) {
      place[a] = static_cast<int>(id % (cells_[a] + 3)) - 1;
      id /= cells_[a] + 3;
    }
    return place;
  }

  /// Returns a coordinate [length] as a distance from the low side [cells].
  RVE_HD double scaled(double coordinate, int axis) const
  {
    return (coordinate - lo_[axis]) / cell_size_;
  }

  /// Returns the distance from the axis x = 0 [cells] of a scaled x coordinate, for axisymmetry.
  RVE_HD double radius(double xi) const { return xi + lo_[0] / cell_size_; }

  RVE_HD bool contains(const double *position) const
  {
    for (int a = 0; a < D; ++a)
      if (!(position[a] >= lo_[a] && position[a] <= hi_[a])) return false;
    return true;
  }

 private:
  Vec<D> lo_, hi_;
  double cell_size_;
  int cells_[D];
  int first_[D] = {}, held_[D] = {};
};

}    // namespace mpm
