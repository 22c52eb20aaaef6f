// Which nodes of the grid concern more than one rank, and what the ranks know of the others.
//
// Every rank has the whole grid, but its points touch a part of it only. Two boxes of nodes belong to a rank: the touched one,
// outside of which it adds nothing to any sum, and the needed one around it, which holds all that has influence on a touched node.
// Sums over all ranks are formed on the shared nodes, those in the needed box of one rank and the touched box of another. Then in
// its needed box a rank has the sums of all ranks: it lacked what others had touched there. Elsewhere it has them or zeros, but never
// a part of them. So momenta, conditions and impulses are right on the nodes that it touches, which are all that its points see; what
// it finds on others must not be used.
//
// Nodes have influence on each other through rigid bodies only, which tie the two nodes of a column on both sides of a face
// together (BoundaryView::impose_body), one body at one place across its face. All that n bodies with faces across an axis can
// tie together lies within n + 1 successive nodes along that axis, whatever their order and however often they are imposed: the
// needed box is wider by n on both sides. A body that can turn ties together the two nodes of a line on both sides of its surface, along
// one axis after the other, and twice if local damping has disturbed that (ImposeContacts): each makes the needed box wider by two
// along each axis. What a body feels is counted by the first rank that touches the node of the contact.

#ifndef MPM_SHARED_NODES_H
#define MPM_SHARED_NODES_H

#include "mpm/boundary.h"
#include "mpm/grid.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace mpm {

template <int D> class SharedNodes {
 public:
  SharedNodes(const Grid<D> &grid, Communication communication,
              const std::vector<RigidBodyOptions> &bodies, int threads);

  /// Finds them for the positions at the start of a step. All ranks call it together.
  void find(const PointView<D> &points, ShapeFunction shape);

  // as found
  /// Deformable points of all ranks.
  std::int64_t point_total() const { return point_total_; }
  /// The nodes that may get anything from the points of this rank and the loads on them.
  const NodeBox<D> &touched() const { return touched_[communication_.rank]; }
  /// The same of each rank before this one.
  std::vector<NodeBox<D>> lower_touched() const
  {
    return {touched_.begin(), touched_.begin() + communication_.rank};
  }
  /// Ascending; the same on all ranks. None for one rank.
  const std::vector<int> &nodes() const { return nodes_; }
  /// Number of the list: another one for other nodes.
  int edition() const { return edition_; }

  /// Values of all nodes to the bit, from those of each rank in the nodes that it has touched, and zero elsewhere. All ranks call
  /// it together. The result is `own` for one rank, else kept in `all`.
  template <class T> const T *everywhere(const T *own, std::vector<T> &all) const;

 private:
  NodeBox<D> box_around(const double *lo, const double *hi) const;
  void list_nodes();
  bool is_first_to_touch(int node) const;

  Grid<D> grid_;
  Communication communication_;
  int threads_;
  int margin_[D] = {};    ///< by which needed boxes are wider
  std::int64_t point_total_ = 0;
  std::vector<std::int64_t> words_;    ///< what touched_ has been made from
  std::vector<NodeBox<D>> touched_;    ///< per rank
  std::vector<int> nodes_;
  int edition_ = 0;
};

template <int D>
template <class T>
const T *SharedNodes<D>::everywhere(const T *own, std::vector<T> &all) const
{
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::int64_t) == 0);
  if (communication_.ranks == 1) return own;

  // a node is told by the first rank that has touched it, unless its value is zero bits
  const T zero{};
  std::vector<int> told;
  touched().for_each([&](const Place<D> &place) {
    const int node = grid_.node(place);
    if (std::memcmp(&own[node], &zero, sizeof(T)) != 0 && is_first_to_touch(node))
      told.push_back(node);
  });

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
    row[0] = told[k];
    std::memcpy(row + 1, &own[told[k]], sizeof(T));
  }
  if (total > 0) communication_.sum_over_ranks(rows.data(), rows.size());

  all.assign(grid_.node_count(), zero);
  for (std::int64_t k = 0; k < total; ++k)
    std::memcpy(&all[rows[ROW * k]], &rows[ROW * k + 1], sizeof(T));
  return all.data();
}

}    // namespace mpm

#endif
