// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/shared_nodes.h"

#include "mpm/grid_transfer.h"
#include "rve/core/error.h"
#include "rve/core/threads.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace mpm {

template <int D>
SharedNodes<D>::SharedNodes(const Grid<D> &grid, Communication communication,
                            const std::vector<RigidBodyOptions> &bodies, int threads) :
    grid_(grid),
    communication_(std::move(communication)), threads_(rve::usable_threads(threads)),
    touched_(communication_.ranks), part_(grid.part({}))
{
  for (const RigidBodyOptions &body : bodies) {
    if (body.form == BodyForm::Face)
      ++reach_[axis_of(body.face)];
    else
      for (int &reach : reach_) reach += 2;
  }
}

template <int D>
void SharedNodes<D>::find(const PointView<D> &points, ShapeFunction shape, double half_boxes)
{
  constexpr double INFINITE = std::numeric_limits<double>::infinity();
  const auto beyond = [](double half) {
    return std::max(0.0, half - 0.5);    // reach beyond a box of one cell on each side [cells]
  };
  const bool asks_points = shape == ShapeFunction::Cpgimp && half_boxes == FROM_POINTS;
  const double beyond_all = shape == ShapeFunction::Cpgimp ? beyond(half_boxes) * grid_.cell_size()
                                                           : 0.0;
  double lo[D], hi[D];
  std::fill_n(lo, D, INFINITE);
  std::fill_n(hi, D, -INFINITE);
  std::int64_t count = 0;
  {
    const rve::LightWork work(points.count, threads_);
#pragma omp parallel for num_threads(work.team) reduction(+ : count) reduction(min : lo[:D]) \
    reduction(max : hi[:D])
    for (int p = 0; p < points.count; ++p) {
      if (points.rigid_body[p] >= 0) continue;
      ++count;
      // points outside the grid, or without a finite position, cause an error later in the step
      const double *x = points.position[p];
      if (!grid_.contains(x)) continue;
      double more[D];
      std::fill_n(more, D, beyond_all);
      if (asks_points) {
        const PointBox<D> box =
            deformed_box(grid_, x, points.half_size[p], points.deformation_gradient[p]);
        for (int a = 0; a < D; ++a) more[a] = beyond(box.half[a]) * grid_.cell_size();
      }
      for (int a = 0; a < D; ++a) {
        lo[a] = std::min(lo[a], x[a] - more[a]);
        hi[a] = std::max(hi[a], x[a] + more[a]);
      }
    }
  }
  // words: number of points of all ranks, then the corners of the box of each rank
  const NodeBox<D> own = box_around(lo, hi);
  std::vector<std::int64_t> words(1 + 2 * D * static_cast<std::size_t>(communication_.ranks), 0);
  words[0] = count;
  for (int a = 0; a < D; ++a) {
    std::int64_t *corners = &words[1 + 2 * D * communication_.rank];
    corners[a] = own.first[a];
    corners[D + a] = own.end[a];
  }
  if (communication_.ranks > 1) communication_.sum_over_ranks(words.data(), words.size());
  point_total_ = words[0];
  words[0] = 0;
  if (words == words_) return;
  for (int rank = 0; rank < communication_.ranks; ++rank)
    for (int a = 0; a < D; ++a) {
      const std::int64_t *corners = &words[1 + 2 * D * rank];
      touched_[rank].first[a] = static_cast<int>(corners[a]);
      touched_[rank].end[a] = static_cast<int>(corners[D + a]);
    }
  words_.clear();    // if require_capacity() throws, the next call must check again
  require_capacity();
  words_ = std::move(words);
  choose_part();
  list_nodes();
}

/// Returns the nodes that points between `lo` and `hi` [length] can touch. The weights of a point
/// with the coordinate xi [cells] reach from node floor(xi) - 1 to floor(xi) + 2 (support_of). A
/// load on a face of the point acts on three successive nodes along the normal (ScatterLoad). If
/// the face is at most half a cell away from xi, the first of the three nodes is between
/// floor(xi) - 1 and floor(xi) + 1, and the last is at most floor(xi) + 3. find() moves `lo` and
/// `hi` outwards for larger boxes of points.
template <int D> NodeBox<D> SharedNodes<D>::box_around(const double *lo, const double *hi) const
{
  for (int a = 0; a < D; ++a)
    if (!(lo[a] <= hi[a])) return {};
  NodeBox<D> box;
  for (int a = 0; a < D; ++a) {
    const auto cell_of = [&](double coordinate) {
      return static_cast<int>(
          std::floor(clamped(grid_.scaled(coordinate, a), 0.0, grid_.cells(a))));
    };
    box.first[a] = cell_of(lo[a]) - 1;
    box.end[a] = std::min(cell_of(hi[a]) + 4, grid_.cells(a) + 2);
  }
  return box;
}

template <int D> NodeBox<D> SharedNodes<D>::wider(const NodeBox<D> &box, const int *margin) const
{
  if (box.is_empty()) return {};
  NodeBox<D> result = box;
  for (int a = 0; a < D; ++a) {
    result.first[a] -= margin[a];
    result.end[a] += margin[a];
  }
  return common(result, grid_.all());
}

template <int D> NodeBox<D> SharedNodes<D>::to_hold(int rank) const
{
  int margin[D];
  std::fill_n(margin, D, MARGIN);
  return wider(needed(rank), margin);
}

/// Throws rve::InputError if a rank would hold too many nodes. Each rank checks the boxes of all
/// ranks, so that all ranks throw together.
template <int D> void SharedNodes<D>::require_capacity() const
{
  for (int rank = 0; rank < communication_.ranks; ++rank) {
    const NodeBox<D> box = to_hold(rank);
    rve::require(box.count() < Grid<D>::MOST_NODES, [&] {
      std::string extents, nodes;
      for (int a = 0; a < D; ++a) {
        const double cell = grid_.cell_size();
        extents +=
            rve::concat(a == 0 ? "" : ", ", "xyz"[a], " from ", grid_.lo(a) + box.first[a] * cell,
                        " to ", grid_.lo(a) + (box.end[a] - 1) * cell);
        nodes += rve::concat(a == 0 ? "" : " x ", box.end[a] - box.first[a]);
      }
      return rve::concat(
          "rank ", rank, " of ", communication_.ranks, " has points that need ", nodes,
          " nodes of the grid, ", extents, " [length]; a rank can hold fewer than ",
          Grid<D>::MOST_NODES,
          ": use more ranks, divide the domain among them so that each has points in a smaller "
          "box, or use larger cells");
    });
  }
}

/// Chooses another part of the grid if the present part lacks needed nodes, or if it has more than
/// twice as many nodes as to_hold() returns. Nodes beyond the needed box take time and memory.
template <int D> void SharedNodes<D>::choose_part()
{
  const NodeBox<D> box = needed(communication_.rank);
  const NodeBox<D> fresh = to_hold(communication_.rank), held = part_.held();
  const bool is_there = box.is_empty() || common(box, held).count() == box.count();
  if (is_there && !(held.count() > 2.0 * fresh.count())) return;
  part_ = grid_.part(fresh);
  ++part_edition_;
}

template <int D> void SharedNodes<D>::list_nodes()
{
  const int own = communication_.rank;
  std::vector<int> given, taken;
  neighbours_.clear();
  const auto add = [&](const NodeBox<D> &box, std::vector<int> &list) {
    const std::size_t before = list.size();
    box.for_each([&](const NodeIndex<D> &place) { list.push_back(part_.node(place)); });
    return list.size() - before;
  };
  for (int rank = 0; rank < communication_.ranks; ++rank) {
    if (rank == own || touched_[rank].is_empty() || touched().is_empty()) continue;
    const std::size_t to = add(common(touched(), needed(rank)), given);
    const std::size_t from = add(common(touched_[rank], needed(own)), taken);
    if (to + from > 0) neighbours_.push_back({rank, to, from});
  }
  if (given == given_ && taken == taken_) return;
  given_ = std::move(given);
  taken_ = std::move(taken);
  ++edition_;
}

template <int D> double SharedNodes<D>::most_given() const
{
  double most = 0.0;
  for (int from = 0; from < communication_.ranks; ++from)
    for (int to = 0; to < communication_.ranks; ++to)
      if (to != from) most = std::max(most, common(touched_[from], needed(to)).count());
  return most;
}

template <int D> bool SharedNodes<D>::is_first_to_touch(const NodeIndex<D> &place) const
{
  return std::none_of(touched_.begin(), touched_.begin() + communication_.rank,
                      [&](const NodeBox<D> &lower) { return lower.contains(place); });
}

template class SharedNodes<2>;
template class SharedNodes<3>;

}    // namespace mpm
