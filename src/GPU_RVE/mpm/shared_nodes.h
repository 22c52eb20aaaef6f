// SPDX-License-Identifier: GPL-2.0-only
// Nodes of the grid that a rank holds, and nodes that it shares with other ranks.
//
// A rank has two boxes of nodes. The touched box contains all nodes to whose sums the points of the
// rank contribute. The needed box contains the touched box and all nodes that influence a touched
// node. The rank holds (stores) the needed box and a margin. Its points can move within this margin
// before the rank must hold another box. Nodes that no rank touches have no mass and change
// nothing. Nodes beyond the needed box therefore do not influence the bits of results.
//
// Each rank forms the sums over all ranks in its needed box. It gives its own sums to another rank
// where its touched box overlaps the needed box of that rank. It takes the sums of other ranks in
// its own needed box. A sum that a rank holds is thus zero or complete, but never a part of a sum.
// Momenta, conditions and impulses are therefore correct on the nodes that the rank touches. Its
// points use no other nodes. Results on other nodes must not be used.
//
// Nodes influence each other through rigid bodies only:
//   - A body with a face couples the two nodes of a column on both sides of its face (ImposeBody in
//     face_contact.h). If n bodies have faces across an axis, all nodes that they can couple lie
//     within n + 1 successive nodes along this axis, in any order of imposing. They make the needed
//     box wider by n on both sides.
//   - A body that can turn couples the two nodes of a line on both sides of its surface, along one
//     axis after the other (ImposeContacts). With local damping the contacts are imposed twice.
//     Each such body makes the needed box wider by two on both sides along each axis.
// The first rank that touches the node of a contact counts the impulse of the contact on the body.

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

/// Another rank, and the numbers of nodes whose sums are given to it and taken from it.
struct Neighbour {
  int rank;
  std::size_t given, taken;
};

/// Nodes that ranks hold and share in a step.
template <int D> class SharedNodes {
 public:
  /// Value of `half_boxes`: the deformation gradients of the points give the sizes of their boxes.
  static constexpr double FROM_POINTS = -1.0;

  SharedNodes(const Grid<D> &grid, Communication communication,
              const std::vector<RigidBodyOptions> &bodies, int threads);

  /// Finds the nodes for the positions at the start of a step. Collective. Throws rve::InputError
  /// on all ranks if one would hold too many nodes. `half_boxes`: half size of the largest box that
  /// follows the deformation [cells], if the deformation gradients in `points` are out of date.
  void find(const PointView<D> &points, ShapeFunction shape, double half_boxes = FROM_POINTS);

  // results of find()
  /// Number of deformable points of all ranks.
  std::int64_t point_total() const { return point_total_; }
  /// Box of the nodes to which points of this rank and loads on them can contribute.
  const NodeBox<D> &touched() const { return touched_[communication_.rank]; }
  /// Touched boxes of the ranks before this one, num_lower() of them.
  const NodeBox<D> *lower_touched() const { return touched_.data(); }
  int num_lower() const { return communication_.rank; }
  /// The grid with storage for the nodes that this rank holds.
  const Grid<D> &part() const { return part_; }
  /// Number that changes whenever the part changes.
  int part_edition() const { return part_edition_; }

  /// Ranks that share nodes with this rank, in ascending order.
  const std::vector<Neighbour> &neighbours() const { return neighbours_; }
  /// Indices in the part of the nodes whose sums this rank gives to its neighbours, one neighbour
  /// after the other. taken() has the nodes whose sums it takes from them.
  const std::vector<int> &given() const { return given_; }
  const std::vector<int> &taken() const { return taken_; }
  /// Number that changes whenever given() or taken() changes.
  int edition() const { return edition_; }
  /// Largest number of nodes whose sums one rank gives to another, over all pairs of ranks. All
  /// ranks get the same number. The run time of the function is quadratic in the number of ranks.
  double most_given() const;

  /// Returns the nodes in a box with their values, in the order of Grid::id(), without values whose
  /// bits are all zero. The first rank that touches a node gives its value. Collective, with the
  /// same box on all ranks. `own` has a value per node of the part.
  template <class T>
  std::vector<NodeValue<D, T>> everywhere(const T *own, const NodeBox<D> &where) const;
  /// Returns the value of one node, or zero bits if no rank touches it. Collective.
  template <class T> T at(const T *own, const NodeIndex<D> &place) const
  {
    NodeBox<D> box = {place, place};
    for (int a = 0; a < D; ++a) ++box.end[a];
    const std::vector<NodeValue<D, T>> found = everywhere(own, box);
    return found.empty() ? T{} : found.front().value;
  }

  /// Calls visit(box) for successive boxes in the order of Grid::id(). Together these boxes contain
  /// all touched boxes. Each is small enough for one call of everywhere().
  template <class Visit> void each_layer(const Visit &visit) const;

 private:
  /// Smallest distance [cells] that points can move before another part must be held.
  static constexpr int MARGIN = 1;
  static constexpr double MOST_AT_ONCE = 1 << 20;    ///< nodes of a box in each_layer()

  NodeBox<D> box_around(const double *lo, const double *hi) const;
  NodeBox<D> wider(const NodeBox<D> &box, const int *margin) const;
  NodeBox<D> needed(int rank) const { return wider(touched_[rank], reach_); }
  NodeBox<D> to_hold(int rank) const;
  void require_capacity() const;
  void choose_part();
  void list_nodes();
  bool is_first_to_touch(const NodeIndex<D> &place) const;

  Grid<D> grid_;    ///< the whole grid
  Communication communication_;
  int threads_;
  int reach_[D] = {};    ///< number of nodes by which needed boxes are wider on each side
  std::int64_t point_total_ = 0;
  std::vector<std::int64_t> words_;    ///< exchanged numbers from which touched_ was made
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
  // the first rank that touches a node gives its value, unless all bits are zero
  const T zero{};
  std::vector<NodeValue<D, T>> given;
  common(touched(), where).for_each([&](const NodeIndex<D> &place) {
    const T &value = own[part_.node(place)];
    if (std::memcmp(&value, &zero, sizeof(T)) != 0 && is_first_to_touch(place))
      given.push_back({place, value});
  });
  if (communication_.ranks == 1) return given;

  // each rank fills its part of one list, which is zero elsewhere: node, value, node, value ...
  std::vector<std::int64_t> counts(communication_.ranks, 0);
  counts[communication_.rank] = static_cast<std::int64_t>(given.size());
  communication_.sum_over_ranks(counts.data(), counts.size());
  std::int64_t before = 0, total = 0;
  for (int rank = 0; rank < communication_.ranks; ++rank) {
    if (rank < communication_.rank) before += counts[rank];
    total += counts[rank];
  }
  constexpr std::size_t ROW = 1 + sizeof(T) / sizeof(std::int64_t);
  std::vector<std::int64_t> rows(ROW * total, 0);
  for (std::size_t k = 0; k < given.size(); ++k) {
    std::int64_t *row = &rows[ROW * (before + k)];
    row[0] = grid_.id(given[k].place);
    std::memcpy(row + 1, &given[k].value, sizeof(T));
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
