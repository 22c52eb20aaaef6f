// The background grid: cells of equal edges over a box, with one layer of ghost nodes around it.
//
// A point inside the box reaches at most one cell width beyond it (half size of a GIMP domain <= half a cell), so
// one layer holds every node that it can touch.

#ifndef MPM_GRID_H
#define MPM_GRID_H

#include "rve/core/config.h"
#include "rve/core/error.h"
#include "rve/core/space.h"
#include "rve/core/tensor.h"
#include "rve/core/vec.h"

#include <cmath>
#include <cstddef>
#include <string>

namespace mpm {

template <int D> using Vec = rve::Vec<double, D>;
template <int D> using Tensor = rve::Tensor<double, D>;
using Vec2 = Vec<2>;

/// Of a node: its number along each axis.
template <int D> using Place = rve::Vec<int, D>;

/// Integers that are summed on a node: its mass and momentum, or a vector.
template <int D> constexpr int INERTIA_SUMS = 1 + rve::Space<D>::axes;
template <int D> constexpr int VECTOR_SUMS = rve::Space<D>::axes;

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

template <int D> class Grid {
 public:
  /// Box [lo, hi] [length] in cells of `cell_size` [length]; all extents must be whole numbers of cells
  /// (to 1e-6 cells), or rve::InputError.
  Grid(const Vec<D> &lo, const Vec<D> &hi, double cell_size) :
      lo_(lo), hi_(hi), cell_size_(cell_size)
  {
    using rve::number;
    rve::require(cell_size > 0.0,
                 "grid cell size must be positive, got " + number(cell_size) + " [length]");
    for (int a = 0; a < D; ++a) {
      const std::string axis(1, "xyz"[a]);
      rve::require(hi[a] > lo[a],
                   "grid extent in " + axis + " must be positive, got lo " + number(lo[a]) +
                       ", hi " + number(hi[a]) + " [length]");
      const double cells = (hi[a] - lo[a]) / cell_size;
      rve::require(cells < 1e6,
                   "grid must have fewer than 1000000 cells in " + axis + ", got " + number(cells));
      cells_[a] = static_cast<int>(std::lround(cells));
      rve::require(cells_[a] > 0 && std::abs(cells - cells_[a]) < 1e-6,
                   "grid extent in " + axis + " must be a whole number of cells, got " +
                       number(hi[a] - lo[a]) + " / " + number(cell_size) + " = " + number(cells));
    }
    double count = 1.0;
    for (int a = 0; a < D; ++a) count *= nodes(a);
    rve::require(count < 2e8, "grid must have fewer than 200000000 nodes, got " + number(count));
  }

  RVE_HD double cell_size() const { return cell_size_; }
  RVE_HD double lo(int axis) const { return lo_[axis]; }
  RVE_HD double hi(int axis) const { return hi_[axis]; }

  /// Number of cells along an axis; its nodes are -1 (ghost), 0 ... cells, cells + 1 (ghost).
  RVE_HD int cells(int axis) const { return cells_[axis]; }
  RVE_HD int nodes(int axis) const { return cells_[axis] + 3; }
  RVE_HD int node_count() const { return stride(D); }

  /// Storage index of a node, numbered from -1 to cells + 1 along each axis.
  RVE_HD int node(const Place<D> &place) const
  {
    int index = place[D - 1] + 1;
    for (int a = D - 2; a >= 0; --a) index = index * nodes(a) + (place[a] + 1);
    return index;
  }
  /// The place of a node with this storage index.
  RVE_HD Place<D> place(int node) const
  {
    Place<D> place;
    for (int a = 0; a < D - 1; ++a) {
      place[a] = node % nodes(a) - 1;
      node /= nodes(a);
    }
    place[D - 1] = node - 1;
    return place;
  }
  /// By how much the storage index grows from a node to the next one along an axis.
  RVE_HD int stride(int axis) const
  {
    int stride = 1;
    for (int a = 0; a < axis; ++a) stride *= nodes(a);
    return stride;
  }
  /// Nodes with the same place along the last axis follow each other in storage: a layer.
  int layers() const { return nodes(D - 1); }
  int layer_size() const { return stride(D - 1); }

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
};

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
  RVE_HD bool contains(const Grid<D> &grid, int node) const
  {
    const Place<D> place = grid.place(node);
    for (int a = 0; a < D; ++a)
      if (place[a] < first[a] || place[a] >= end[a]) return false;
    return true;
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

}    // namespace mpm

#endif
