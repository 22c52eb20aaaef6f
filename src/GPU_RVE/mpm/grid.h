// The background grid: square cells over a rectangle, with one layer of ghost nodes around it.
//
// A point inside the rectangle reaches at most one cell width beyond it (half size of a GIMP domain <= half a cell), so
// one layer holds every node that it can touch.

#ifndef MPM_GRID_H
#define MPM_GRID_H

#include "rve/core/config.h"
#include "rve/core/error.h"
#include "rve/core/vec.h"

#include <cmath>
#include <string>

namespace mpm {

using Vec2 = rve::Vec<double, 2>;

/// Sides of the grid and faces of a point's or body's box. Axis and outward sign follow from it.
enum class Face { XLo, XHi, YLo, YHi };

RVE_HD inline int axis_of(Face face)
{
  return face == Face::XLo || face == Face::XHi ? 0 : 1;
}

/// Outward normal along its axis: -1 or +1.
RVE_HD inline double outward(Face face)
{
  return face == Face::XLo || face == Face::YLo ? -1.0 : 1.0;
}

class Grid {
 public:
  /// Rectangle [lo, hi] [length] in cells of `cell_size` [length]; both extents must be whole numbers of cells
  /// (to 1e-6 cells), or rve::InputError.
  Grid(const Vec2 &lo, const Vec2 &hi, double cell_size) : lo_(lo), hi_(hi), cell_size_(cell_size)
  {
    using rve::number;
    rve::require(cell_size > 0.0,
                 "grid cell size must be positive, got " + number(cell_size) + " [length]");
    for (int a = 0; a < 2; ++a) {
      const std::string axis = a == 0 ? "x" : "y";
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
    rve::require(double(cells_[0] + 3) * double(cells_[1] + 3) < 2e8,
                 "grid must have fewer than 200000000 nodes, got " +
                     number(double(cells_[0] + 3) * double(cells_[1] + 3)));
  }

  RVE_HD double cell_size() const { return cell_size_; }
  RVE_HD double lo(int axis) const { return lo_[axis]; }
  RVE_HD double hi(int axis) const { return hi_[axis]; }

  /// Number of cells along an axis; its nodes are -1 (ghost), 0 ... cells, cells + 1 (ghost).
  RVE_HD int cells(int axis) const { return cells_[axis]; }
  RVE_HD int node_count() const { return (cells_[0] + 3) * (cells_[1] + 3); }
  RVE_HD int row_stride() const { return cells_[0] + 3; }

  /// Storage index of node (i, j), both from -1 to cells + 1.
  RVE_HD int node(int i, int j) const { return (j + 1) * row_stride() + (i + 1); }

  /// Coordinate in cell widths from the low side.
  RVE_HD double scaled(double coordinate, int axis) const
  {
    return (coordinate - lo_[axis]) / cell_size_;
  }

  RVE_HD bool contains(double x, double y) const
  {
    return x >= lo_[0] && x <= hi_[0] && y >= lo_[1] && y <= hi_[1];
  }

 private:
  Vec2 lo_, hi_;
  double cell_size_;
  int cells_[2];
};

/// A block of nodes of a grid: along both axes from `first` to before `end`, numbered as for Grid::node().
struct NodeBox {
  int first[2] = {0, 0};
  int end[2] = {0, 0};

  bool is_empty() const { return first[0] >= end[0] || first[1] >= end[1]; }
  RVE_HD bool contains(const Grid &grid, int node) const
  {
    const int place[2] = {node % grid.row_stride() - 1, node / grid.row_stride() - 1};
    for (int a = 0; a < 2; ++a)
      if (place[a] < first[a] || place[a] >= end[a]) return false;
    return true;
  }
};

}    // namespace mpm

#endif
