#include "mpm/shared_nodes.h"

#include "mpm/grid_transfer.h"
#include "rve/core/threads.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mpm {

template <int D>
SharedNodes<D>::SharedNodes(const Grid<D> &grid, Communication communication,
                            const std::vector<RigidBodyOptions> &bodies, int threads) :
    grid_(grid),
    communication_(std::move(communication)), threads_(rve::usable_threads(threads)),
    touched_(communication_.ranks)
{
  for (const RigidBodyOptions &body : bodies) {
    if (body.form == BodyForm::Face)
      ++margin_[axis_of(body.face)];
    else
      for (int &margin : margin_) margin += 2;
  }
}

template <int D> void SharedNodes<D>::find(const PointView<D> &points, ShapeFunction shape)
{
  if (communication_.ranks == 1) {
    point_total_ = std::count_if(points.rigid_body, points.rigid_body + points.count, [](int body) {
      return body < 0;
    });
    return;
  }

  constexpr double INFINITE = std::numeric_limits<double>::infinity();
  double lo[D], hi[D];
  std::fill_n(lo, D, INFINITE);
  std::fill_n(hi, D, -INFINITE);
  std::int64_t count = 0;
  {
    const rve::LightWork work(points.count, threads_);
#pragma omp parallel for num_threads(work.team) reduction(+ : count) reduction(min : lo[:D]) reduction(max : hi[:D])
    for (int p = 0; p < points.count; ++p) {
      if (points.rigid_body[p] >= 0) continue;
      ++count;
      // a position that is not a number leaves them alone, in this order of arguments
      for (int a = 0; a < D; ++a) {
        lo[a] = std::min(lo[a], points.position[p][a]);
        hi[a] = std::max(hi[a], points.position[p][a]);
      }
      if (shape != ShapeFunction::Cpgimp || !grid_.contains(points.position[p])) continue;
      const PointBox<D> box = deformed_box(grid_, points.position[p], points.half_size[p],
                                           points.deformation_gradient[p]);
      for (int a = 0; a < D; ++a) {
        const double beyond = std::max(0.0, box.half[a] - 0.5) * grid_.cell_size();
        lo[a] = std::min(lo[a], points.position[p][a] - beyond);
        hi[a] = std::max(hi[a], points.position[p][a] + beyond);
      }
    }
  }
  // the count of all points, then the corners of the box of each rank
  const NodeBox<D> own = box_around(lo, hi);
  std::vector<std::int64_t> words(1 + 2 * D * static_cast<std::size_t>(communication_.ranks), 0);
  words[0] = count;
  for (int a = 0; a < D; ++a) {
    std::int64_t *corners = &words[1 + 2 * D * communication_.rank];
    corners[a] = own.first[a];
    corners[D + a] = own.end[a];
  }
  communication_.sum_over_ranks(words.data(), words.size());
  point_total_ = words[0];
  words[0] = 0;
  if (words == words_) return;
  words_ = std::move(words);
  for (int rank = 0; rank < communication_.ranks; ++rank)
    for (int a = 0; a < D; ++a) {
      const std::int64_t *corners = &words_[1 + 2 * D * rank];
      touched_[rank].first[a] = static_cast<int>(corners[a]);
      touched_[rank].end[a] = static_cast<int>(corners[D + a]);
    }
  list_nodes();
}

/// With xi the coordinate in cells, weights reach from node floor(xi) - 1 to floor(xi) + 2 (support_of). Loads are on faces at most
/// half a cell away and have three rows, from floor(xi) - 1 to floor(xi) + 3 (ScatterLoad). Points outside of the grid, or without
/// a place, end the step on their rank: any box will do for them.
template <int D> NodeBox<D> SharedNodes<D>::box_around(const double *lo, const double *hi) const
{
  for (int a = 0; a < D; ++a)
    if (!(lo[a] <= hi[a])) return {};
  NodeBox<D> box;
  for (int a = 0; a < D; ++a) {
    const auto cell_of = [&](double coordinate) {
      return static_cast<int>(
          std::floor(face_pair::clamped(grid_.scaled(coordinate, a), 0.0, grid_.cells(a))));
    };
    box.first[a] = cell_of(lo[a]) - 1;
    box.end[a] = std::min(cell_of(hi[a]) + 4, grid_.cells(a) + 2);
  }
  return box;
}

template <int D> void SharedNodes<D>::list_nodes()
{
  std::vector<char> is_shared(grid_.node_count(), 0);
  for (int a = 0; a < communication_.ranks; ++a)
    for (int b = 0; b < communication_.ranks; ++b) {
      if (a == b || touched_[a].is_empty()) continue;
      NodeBox<D> common;
      for (int axis = 0; axis < D; ++axis) {
        common.first[axis] =
            std::max(touched_[a].first[axis] - margin_[axis], touched_[b].first[axis]);
        common.end[axis] = std::min(touched_[a].end[axis] + margin_[axis], touched_[b].end[axis]);
      }
      common.for_each([&](const Place<D> &place) {
        is_shared[grid_.node(place)] = 1;
      });
    }
  std::vector<int> nodes;
  for (int node = 0; node < grid_.node_count(); ++node)
    if (is_shared[node]) nodes.push_back(node);
  if (nodes == nodes_) return;
  nodes_ = std::move(nodes);
  ++edition_;
}

template <int D> bool SharedNodes<D>::is_first_to_touch(int node) const
{
  return std::none_of(touched_.begin(), touched_.begin() + communication_.rank,
                      [&](const NodeBox<D> &lower) {
                        return lower.contains(grid_, node);
                      });
}

template class SharedNodes<2>;
template class SharedNodes<3>;

}    // namespace mpm
