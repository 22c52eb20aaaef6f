// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/boundary.h"

#include <algorithm>
#include <map>
#include <utility>

namespace mpm {

template <int D>
Boundary<D>::Boundary(const Grid<D> &grid, const std::array<SideKind, FACES<D>> &sides,
                      const std::array<Dashpots, FACES<D>> &dashpots,
                      const std::vector<RigidBodyOptions> &bodies) :
    grid_(grid),
    sides_(sides), dashpots_(dashpots), options_(bodies)
{
}

template <int D> NodeBox<D> Boundary<D>::nodes_of(Face side) const
{
  NodeBox<D> box = grid_.all();
  const int axis = axis_of(side);
  if (outward(side) < 0.0)
    box.end[axis] = box.first[axis] + 2;
  else
    box.first[axis] = box.end[axis] - 2;
  return box;
}

template <int D> std::vector<std::uint8_t> Boundary<D>::sides(const Grid<D> &part) const
{
  std::vector<std::uint8_t> of_nodes(part.node_count(), 0);
  for (int side = 0; side < FACES<D>; ++side) {
    if (sides_[side] == SideKind::Free) continue;
    const Face face = static_cast<Face>(side);
    const int axis = axis_of(face);
    int bits = SideBits::across(axis);
    if (sides_[side] == SideKind::Fixed) bits |= SideBits::fixed_across(axis);
    common(part.held(), nodes_of(face)).for_each([&](const NodeIndex<D> &place) {
      std::uint8_t &of_node = of_nodes[part.node(place)];
      of_node = static_cast<std::uint8_t>(of_node | bits);
    });
  }
  return of_nodes;
}

template <int D> std::vector<AbsorbingNode<D>> Boundary<D>::absorbing(const Grid<D> &part) const
{
  std::map<int, AbsorbingNode<D>> found;
  for (int side = 0; side < FACES<D>; ++side) {
    const Dashpots &dashpots = dashpots_[side];
    if (!dashpots.exist()) continue;
    const Face face = static_cast<Face>(side);
    const int axis = axis_of(face);
    common(part.held(), nodes_of(face)).for_each([&](const NodeIndex<D> &place) {
      const int node = part.node(place);
      AbsorbingNode<D> &at = found.try_emplace(node).first->second;
      at.node = node;
      for (int c = 0; c < D; ++c)
        at.speed[axis][c] = c == axis ? dashpots.normal : dashpots.tangential;
    });
  }
  std::vector<AbsorbingNode<D>> nodes;
  for (const auto &[node, at] : found) nodes.push_back(at);
  return nodes;
}

/// Sums impulses in a fixed order: node by node along each line parallel to `axis`, and line after
/// line. Successive lines are neighbours along the first of the other axes.
template <int D>
Vec<D> Boundary<D>::sum_along(int axis, bool downwards, const Impulses &impulses) const
{
  std::vector<std::pair<std::int64_t, const Vec<D> *>> ordered;
  ordered.reserve(impulses.size());
  for (const NodeValue<D, Vec<D>> &at : impulses) {
    std::int64_t order = 0;
    for (int a = D - 1; a >= 0; --a)
      if (a != axis) order = order * (grid_.cells(a) + 3) + (at.place[a] + 1);
    const int row = downwards ? grid_.cells(axis) + 1 - at.place[axis] : at.place[axis] + 1;
    ordered.emplace_back(order * (grid_.cells(axis) + 3) + row, &at.value);
  }
  std::sort(ordered.begin(), ordered.end(),
            [](const auto &one, const auto &other) { return one.first < other.first; });
  Vec<D> sum = Vec<D>::zero();
  for (const auto &[order, value] : ordered) sum = sum + *value;
  return sum;
}

/// Returns minus the sum of the impulses of the body on nodes. Each line is summed from the face
/// into the body.
template <int D> Vec<D> Boundary<D>::body_impulse(int body, const Impulses &impulses) const
{
  const Face face = options_[body].face;
  return Vec<D>::zero() - sum_along(axis_of(face), outward(face) > 0.0, impulses);
}

template <int D> Vec<D> Boundary<D>::side_impulse(Face side, const Impulses &impulses) const
{
  return sum_along(axis_of(side), false, impulses);
}

template class Boundary<2>;
template class Boundary<3>;

}    // namespace mpm
