// SPDX-License-Identifier: GPL-2.0-only
// The background grid: cells of equal edges over a box, with one layer of ghost nodes around it.
//
// A point inside the box reaches at most one cell width beyond it (half size of a GIMP domain <= half a cell), so
// one layer holds every node that it can touch.
//
// Storage is for a box of nodes, the part of the grid that a rank holds: node numbers count in it. Cells, coordinates and places are those
// of the whole grid.

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

/// Of a node: its number along each axis.
template <int D> using Place = rve::Vec<int, D>;

/// Sides of the grid and faces of a point's or body's box: low and high of each axis in turn.
enum class Face { XLo, XHi, YLo, YHi, ZLo, ZHi };

/// Faces of a box.
template <int D> constexpr int FACES = 2 * rve::Space<D>::axes;

RVE_HD inline int axis_of(Face face)
{
  return static_cast<int>(face) / 2;
}

/// Outward normal along its axis: -1 or +1.
RVE_HD inline double outward(Face face)
{
  return static_cast<int>(face) % 2 == 0 ? -1.0 : 1.0;
}

template <int D> class Grid;

/// A block of nodes of a grid: along each axis from `first` to before `end`, numbered as for Grid::node().
template <int D> struct NodeBox {
  Place<D> first = Place<D>::zero();
  Place<D> end = Place<D>::zero();

  bool is_empty() const
  {
    for (int a = 0; a < D; ++a)
      if (first[a] >= end[a]) return true;
    return false;
  }
  RVE_HD bool contains(const Place<D> &place) const
  {
    for (int a = 0; a < D; ++a)
      if (place[a] < first[a] || place[a] >= end[a]) return false;
    return true;
  }
  RVE_HD bool contains(const Grid<D> &grid, int node) const { return contains(grid.place(node)); }

  /// How many; as a real number, since boxes of large grids have more nodes than an integer counts.
  double count() const
  {
    double count = 1.0;
    for (int a = 0; a < D; ++a) count *= first[a] < end[a] ? end[a] - first[a] : 0;
    return count;
  }

  /// visit(place) for all nodes, those along the first axis one after the other.
  template <class Visit> void for_each(const Visit &visit) const
  {
    if (is_empty()) return;
    Place<D> place = first;
    for (int a = 0; a < D;) {
      visit(place);
      for (a = 0; a < D && ++place[a] == end[a]; ++a) place[a] = first[a];
    }
  }
};

/// The nodes in both boxes.
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
  /// Nodes that can be held, fewer than this.
  static constexpr double MOST_NODES = 2e8;

  /// Box [lo, hi] [length] in cells of `cell_size` [length]; all extents must be whole numbers of cells
  /// (to 1e-6 cells), or rve::InputError. Holds all nodes, or none if they are too many: then ask for a part().
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

  /// All nodes of the grid, ghosts included.
  NodeBox<D> all() const
  {
    NodeBox<D> box;
    for (int a = 0; a < D; ++a) {
      box.first[a] = -1;
      box.end[a] = cells_[a] + 2;
    }
    return box;
  }
  /// The same grid, holding the nodes of a box: of all() and fewer than MOST_NODES.
  Grid part(const NodeBox<D> &box) const
  {
    Grid grid = *this;
    for (int a = 0; a < D; ++a) {
      grid.first_[a] = box.is_empty() ? 0 : box.first[a];
      grid.held_[a] = box.is_empty() ? 0 : box.end[a] - box.first[a];
    }
    return grid;
  }
  /// The nodes that are held.
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

  /// Number of cells along an axis; its nodes are -1 (ghost), 0 ... cells, cells + 1 (ghost).
  RVE_HD int cells(int axis) const { return cells_[axis]; }

  /// Of the nodes that are held along an axis: how many, and the places of the first and the last one.
  RVE_HD int nodes(int axis) const { return held_[axis]; }
  RVE_HD int first(int axis) const { return first_[axis]; }
  RVE_HD int last(int axis) const { return first_[axis] + held_[axis] - 1; }
  RVE_HD int node_count() const { return stride(D); }

  /// Storage index of a node that is held, by its place: from -1 to cells + 1 along each axis.
  RVE_HD int node(const Place<D> &place) const
  {
    int index = place[D - 1] - first_[D - 1];
    for (int a = D - 2; a >= 0; --a) index = index * nodes(a) + (place[a] - first_[a]);
    return index;
  }
  /// The place of a node with this storage index.
  RVE_HD Place<D> place(int node) const
  {
    Place<D> place;
    for (int a = 0; a < D - 1; ++a) {
      place[a] = node % nodes(a) + first_[a];
      node /= nodes(a);
    }
    place[D - 1] = node + first_[D - 1];
    return place;
  }
  /// By how much the storage index grows from a node to the next one along an axis.
  RVE_HD int stride(int axis) const
  {
    int stride = 1;
    for (int a = 0; a < axis; ++a) stride *= nodes(a);
    return stride;
  }
  /// Lines of held nodes along an axis.
  RVE_HD int lines_along(int axis) const
  {
    int lines = 1;
    for (int a = 0; a < D; ++a)
      if (a != axis) lines *= nodes(a);
    return lines;
  }
  /// Nodes with the same place along the last axis follow each other in storage: a layer.
  int layers() const { return nodes(D - 1); }
  int layer_size() const { return stride(D - 1); }

  /// The number of a place among all() nodes, in the order of storage.
  std::int64_t id(const Place<D> &place) const
  {
    std::int64_t id = 0;
    for (int a = D - 1; a >= 0; --a) id = id * (cells_[a] + 3) + (place[a] + 1);
    return id;
  }
  Place<D> place_of_id(std::int64_t id) const
  {
    Place<D> place;
    for (int a = 0; a < D; ++a) {
      place[a] = static_cast<int>(id % (cells_[a] + 3)) - 1;
      id /= cells_[a] + 3;
    }
    return place;
  }

  /// Coordinate in cell widths from the low side.
  RVE_HD double scaled(double coordinate, int axis) const
  {
    return (coordinate - lo_[axis]) / cell_size_;
  }

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
