// SPDX-License-Identifier: GPL-2.0-only
// Which nodes of the grid a rank holds, which of them concern others too, and what the ranks know of each other.
//
// Two boxes of nodes belong to a rank: the touched one, outside of which its points add nothing to any sum, and the needed one around
// it, which holds all that has influence on a touched node. The rank holds the needed box and a margin, in which its points may move
// before it must hold another one. Nodes that nobody has touched have no mass and change nothing: so what is held beyond the touched
// box has no influence on any bit.
//
// Sums over all ranks are formed in the needed box of each rank: every rank gives what it has in its touched box and in the needed box
// of another one to that one, and takes what others have touched in its own needed box. Elsewhere it has zeros, but never a part of a
// sum. So momenta, conditions and impulses are right on the nodes that it touches, which are all that its points see; what it finds on
// others must not be used.
//
// Nodes have influence on each other through rigid bodies only, which tie the two nodes of a column on both sides of a face
// together (ImposeBody in face_contact.h), one body at one place across its face. All that n bodies with faces across an axis can
// tie together lies within n + 1 successive nodes along that axis, whatever their order and however often they are imposed: the
// needed box is wider by n on both sides. A body that can turn ties together the two nodes of a line on both sides of its surface, along
// one axis after the other, and twice if local damping has disturbed that (ImposeContacts): each makes the needed box wider by two
// along each axis. What a body feels is counted by the first rank that touches the node of the contact.

#pragma once

#include "mpm/boundary.h"
#include "mpm/grid.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace mpm {

/// Another rank, and how many nodes have sums that go to it and come from it.
struct Neighbour {
  int rank;
  std::size_t given, taken;
};

template <int D> class SharedNodes {
 public:
  /// Boxes of points reach as far as their deformation gradients say.
  static constexpr double FROM_POINTS = -1.0;

  SharedNodes(const Grid<D> &grid, Communication communication,
              const std::vector<RigidBodyOptions> &bodies, int threads);

  /// Finds them for the positions at the start of a step. All ranks call it together; rve::InputError on all of them if one would hold
  /// too many nodes. `half_boxes`: half size of the largest box that follows the deformation, in cells, where the gradients are elsewhere.
  void find(const PointView<D> &points, ShapeFunction shape, double half_boxes = FROM_POINTS);

  // as found
  /// Deformable points of all ranks.
  std::int64_t point_total() const { return point_total_; }
  /// The nodes that may get anything from the points of this rank and the loads on them.
  const NodeBox<D> &touched() const { return touched_[communication_.rank]; }
  /// Touched boxes of the ranks before this one, num_lower() of them.
  const NodeBox<D> *lower_touched() const { return touched_.data(); }
  int num_lower() const { return communication_.rank; }
  /// The grid with storage for what this rank holds.
  const Grid<D> &part() const { return part_; }
  /// Number of the part: another one for another part.
  int part_edition() const { return part_edition_; }

  /// Those that have nodes in common with this rank, ascending. None for one rank.
  const std::vector<Neighbour> &neighbours() const { return neighbours_; }
  /// Nodes of the part whose sums go to the neighbours, one neighbour after the other, and nodes for which sums come from them.
  const std::vector<int> &given() const { return given_; }
  const std::vector<int> &taken() const { return taken_; }
  /// Number of these lists: another one for other lists.
  int edition() const { return edition_; }
  /// The most nodes whose sums go from one rank to another one, of all ranks: a number that all of them know.
  /// For few ranks: it looks at all pairs of them.
  double most_given() const;

  /// The values of all nodes in a box that are not zero bits, by the order of Grid::id(), from those of each rank in the nodes that it
  /// has touched. All ranks call it together, with the same box. `own` is per node of the part.
  template <class T>
  std::vector<NodeValue<D, T>> everywhere(const T *own, const NodeBox<D> &where) const;
  /// Of one node; zero bits if no rank has touched it.
  template <class T> T at(const T *own, const Place<D> &place) const
  {
    NodeBox<D> box = {place, place};
    for (int a = 0; a < D; ++a) ++box.end[a];
    const std::vector<NodeValue<D, T>> found = everywhere(own, box);
    return found.empty() ? T{} : found.front().value;
  }

  /// visit(box) for boxes one after the other, in the order of Grid::id(), which hold all that any rank has touched and are small enough
  /// to ask for all their values at once.
  template <class Visit> void each_layer(const Visit &visit) const;

 private:
  /// Cells that points may move, at least, until another part is held.
  static constexpr int MARGIN = 1;
  static constexpr double MOST_AT_ONCE = 1 << 20;    ///< nodes

  NodeBox<D> box_around(const double *lo, const double *hi) const;
  NodeBox<D> wider(const NodeBox<D> &box, const int *margin) const;
  NodeBox<D> needed(int rank) const { return wider(touched_[rank], reach_); }
  NodeBox<D> to_hold(int rank) const;
  void require_capacity() const;
  void choose_part();
  void list_nodes();
  bool is_first_to_touch(const Place<D> &place) const;

  Grid<D> grid_;    ///< the whole, of which nothing is stored
  Communication communication_;
  int threads_;
  int reach_[D] = {};    ///< by which needed boxes are wider
  std::int64_t point_total_ = 0;
  std::vector<std::int64_t> words_;    ///< what touched_ has been made from
  std::vector<NodeBox<D>> touched_;    ///< per rank
  Grid<D> part_;
  int part_edition_ = 1;
  std::vector<Neighbour> neighbours_;
  std::vector<int> given_, taken_;
  int edition_ = 0;
};

template <int D>
template <class T>
std::vector<NodeValue<D, T>> SharedNodes<D>::everywhere(const T *own, const NodeBox<D> &where) const
{
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::int64_t) == 0);
  // a node is told by the first rank that has touched it, unless its value is zero bits
  const T zero{};
  std::vector<NodeValue<D, T>> told;
  common(touched(), where).for_each([&](const Place<D> &place) {
    const T &value = own[part_.node(place)];
    if (std::memcmp(&value, &zero, sizeof(T)) != 0 && is_first_to_touch(place))
      told.push_back({place, value});
  });
  if (communication_.ranks == 1) return told;

  // every rank fills a part of one list that is zero elsewhere: node, value, node, value ...
  std::vector<std::int64_t> counts(communication_.ranks, 0);
  counts[communication_.rank] = static_cast<std::int64_t>(told.size());
  communication_.sum_over_ranks(counts.data(), counts.size());
  std::int64_t before = 0, total = 0;
  for (int rank = 0; rank < communication_.ranks; ++rank) {
    if (rank < communication_.rank) before += counts[rank];
    total += counts[rank];
  }
  constexpr std::size_t ROW = 1 + sizeof(T) / sizeof(std::int64_t);
  std::vector<std::int64_t> rows(ROW * total, 0);
  for (std::size_t k = 0; k < told.size(); ++k) {
    std::int64_t *row = &rows[ROW * (before + k)];
    row[0] = grid_.id(told[k].place);
    std::memcpy(row + 1, &told[k].value, sizeof(T));
  }
  if (total > 0) communication_.sum_over_ranks(rows.data(), rows.size());

  std::vector<const std::int64_t *> order;
  order.reserve(total);
  for (std::int64_t k = 0; k < total; ++k) order.push_back(&rows[ROW * k]);
  std::sort(order.begin(), order.end(),
            [](const std::int64_t *one, const std::int64_t *other) { return *one < *other; });
  std::vector<NodeValue<D, T>> all(total);
  for (std::int64_t k = 0; k < total; ++k) {
    all[k].place = grid_.place_of_id(*order[k]);
    std::memcpy(&all[k].value, order[k] + 1, sizeof(T));
  }
  return all;
}

template <int D> template <class Visit> void SharedNodes<D>::each_layer(const Visit &visit) const
{
  NodeBox<D> all;
  for (const NodeBox<D> &box : touched_) {
    if (box.is_empty()) continue;
    const bool is_first = all.is_empty();
    for (int a = 0; a < D; ++a) {
      all.first[a] = is_first ? box.first[a] : std::min(all.first[a], box.first[a]);
      all.end[a] = is_first ? box.end[a] : std::max(all.end[a], box.end[a]);
    }
  }
  if (all.is_empty()) return;
  const int layers = all.end[D - 1] - all.first[D - 1];
  const double of_layer = all.count() / layers;
  const int at_once =
      static_cast<int>(std::min(1.0 * layers, std::max(1.0, MOST_AT_ONCE / of_layer)));
  NodeBox<D> piece = all;
  for (; piece.first[D - 1] < all.end[D - 1]; piece.first[D - 1] = piece.end[D - 1]) {
    piece.end[D - 1] = std::min(piece.first[D - 1] + at_once, all.end[D - 1]);
    visit(piece);
  }
}

}    // namespace mpm
