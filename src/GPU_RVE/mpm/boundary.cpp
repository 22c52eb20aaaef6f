#include "mpm/boundary.h"

#include <map>

namespace mpm {

template <int D>
Boundary<D>::Boundary(const Grid<D> &grid, const std::array<SideKind, FACES<D>> &sides,
                      const std::array<Dashpots, FACES<D>> &dashpots,
                      const std::vector<RigidBodyOptions> &bodies) :
    grid_(grid),
    options_(bodies), sides_(grid.node_count(), 0)
{
  std::map<int, AbsorbingNode<D>> absorbing;
  for (int side = 0; side < FACES<D>; ++side) {
    const SideKind kind = sides[side];
    if (kind == SideKind::Free && !dashpots[side].exist()) continue;
    const Face face = static_cast<Face>(side);
    const int axis = axis_of(face);
    int bits = kind == SideKind::Free ? 0 : BoundaryView<D>::across(axis);
    if (kind == SideKind::Fixed) bits |= BoundaryView<D>::fixed_across(axis);
    const int last = grid.cells(axis);
    const bool is_low = outward(face) < 0.0;
    nodes_across(axis).for_each([&](Place<D> place) {
      for (const int across : {is_low ? -1 : last, is_low ? 0 : last + 1}) {
        place[axis] = across;
        const int node = grid.node(place);
        side_nodes_[side].push_back(node);
        sides_[node] = static_cast<std::uint8_t>(sides_[node] | bits);
        if (!dashpots[side].exist()) continue;
        AbsorbingNode<D> &at = absorbing.try_emplace(node).first->second;
        at.node = node;
        for (int c = 0; c < D; ++c)
          at.speed[axis][c] = c == axis ? dashpots[side].normal : dashpots[side].tangential;
      }
    });
  }
  for (const auto &[node, at] : absorbing) absorbing_.push_back(at);
}

template <int D> NodeBox<D> Boundary<D>::nodes_across(int axis) const
{
  NodeBox<D> box;
  for (int a = 0; a < D; ++a) {
    box.first[a] = a == axis ? 0 : -1;
    box.end[a] = a == axis ? 1 : grid_.cells(a) + 2;
  }
  return box;
}

template <int D> Vec<D> Boundary<D>::body_impulse(int body, const Vec<D> *felt) const
{
  const Face face = options_[body].face;
  const int normal = axis_of(face);
  const int rows = grid_.nodes(normal);
  Vec<D> sum = Vec<D>::zero();
  nodes_across(normal).for_each([&](Place<D> place) {
    for (int k = 0; k < rows; ++k) {
      place[normal] = outward(face) < 0.0 ? k - 1 : rows - 2 - k;    // into the body
      sum = sum - felt[grid_.node(place)];
    }
  });
  return sum;
}

template <int D> Vec<D> Boundary<D>::side_impulse(Face side, const Vec<D> *felt) const
{
  Vec<D> sum = Vec<D>::zero();
  for (const int node : side_nodes_[static_cast<int>(side)]) sum = sum + felt[node];
  return sum;
}

template class Boundary<2>;
template class Boundary<3>;

}    // namespace mpm
