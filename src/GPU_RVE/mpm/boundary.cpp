#include "mpm/boundary.h"

namespace mpm {

Boundary::Boundary(const Grid &grid, const std::array<SideKind, 4> &sides,
                   const std::vector<RigidBodyOptions> &bodies) :
    grid_(grid),
    options_(bodies), sides_(grid.node_count(), 0)
{
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi}) {
    const SideKind kind = sides[static_cast<int>(side)];
    if (kind == SideKind::Free) continue;
    const int axis = axis_of(side);
    int bits = axis == 0 ? BoundaryView::AcrossX : BoundaryView::AcrossY;
    if (kind == SideKind::Fixed)
      bits |= axis == 0 ? BoundaryView::FixedAcrossX : BoundaryView::FixedAcrossY;
    const int last = grid.cells(axis);
    for (int along = -1; along <= grid.cells(1 - axis) + 1; ++along)
      for (int across : {outward(side) < 0.0 ? -1 : last, outward(side) < 0.0 ? 0 : last + 1}) {
        const int node = axis == 0 ? grid.node(across, along) : grid.node(along, across);
        side_nodes_[static_cast<int>(side)].push_back(node);
        sides_[node] = static_cast<std::uint8_t>(sides_[node] | bits);
      }
  }
}

Vec2 Boundary::body_impulse(int body, const Vec2 *felt) const
{
  const Face face = options_[body].face;
  const int normal = axis_of(face);
  const int rows = grid_.cells(normal) + 3;
  Vec2 sum = Vec2::zero();
  for (int column = -1; column <= grid_.cells(1 - normal) + 1; ++column)
    for (int k = 0; k < rows; ++k) {
      const int row = outward(face) < 0.0 ? k - 1 : rows - 2 - k;    // into the body
      sum = sum - felt[normal == 1 ? grid_.node(column, row) : grid_.node(row, column)];
    }
  return sum;
}

Vec2 Boundary::side_impulse(Face side, const Vec2 *felt) const
{
  Vec2 sum = Vec2::zero();
  for (const int node : side_nodes_[static_cast<int>(side)]) sum = sum + felt[node];
  return sum;
}

}    // namespace mpm
