#include "mpm/shared_nodes.h"

#include "rve/core/threads.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mpm {

SharedNodes::SharedNodes(const Grid &grid, Communication communication,
                         const std::vector<RigidBodyOptions> &bodies, int threads) :
    grid_(grid),
    communication_(std::move(communication)), threads_(rve::usable_threads(threads)),
    touched_(communication_.ranks)
{
  for (const RigidBodyOptions &body : bodies) ++margin_[axis_of(body.face)];
}

void SharedNodes::find(const PointView &points)
{
  if (communication_.ranks == 1) {
    point_total_ = std::count_if(points.rigid_body, points.rigid_body + points.count, [](int body) {
      return body < 0;
    });
    return;
  }

  constexpr double INFINITE = std::numeric_limits<double>::infinity();
  double lo_x = INFINITE, lo_y = INFINITE, hi_x = -INFINITE, hi_y = -INFINITE;
  std::int64_t count = 0;
  {
    const rve::LightWork work(points.count, threads_);
#pragma omp parallel for num_threads(work.team) reduction(+ : count) reduction(min : lo_x, lo_y) reduction(max : hi_x, hi_y)
    for (int p = 0; p < points.count; ++p) {
      if (points.rigid_body[p] >= 0) continue;
      ++count;
      // a position that is not a number leaves them alone, in this order of arguments
      lo_x = std::min(lo_x, points.position[p][0]);
      lo_y = std::min(lo_y, points.position[p][1]);
      hi_x = std::max(hi_x, points.position[p][0]);
      hi_y = std::max(hi_y, points.position[p][1]);
    }
  }
  const NodeBox own = box_around({{lo_x, lo_y}}, {{hi_x, hi_y}});
  std::vector<std::int64_t> words(1 + 4 * static_cast<std::size_t>(communication_.ranks), 0);
  words[0] = count;
  for (int a = 0; a < 2; ++a) {
    words[1 + 4 * communication_.rank + a] = own.first[a];
    words[3 + 4 * communication_.rank + a] = own.end[a];
  }
  communication_.sum_over_ranks(words.data(), words.size());
  point_total_ = words[0];
  words[0] = 0;
  if (words == words_) return;
  words_ = std::move(words);
  for (int rank = 0; rank < communication_.ranks; ++rank)
    for (int a = 0; a < 2; ++a) {
      touched_[rank].first[a] = static_cast<int>(words_[1 + 4 * rank + a]);
      touched_[rank].end[a] = static_cast<int>(words_[3 + 4 * rank + a]);
    }
  list_nodes();
}

/// With xi the coordinate in cells, weights reach from node floor(xi) - 1 to floor(xi) + 2 (support_of). Loads are on faces at most
/// half a cell away and have three rows, from floor(xi) - 1 to floor(xi) + 3 (ScatterLoad). Points outside of the grid, or without
/// a place, end the step on their rank: any box will do for them.
NodeBox SharedNodes::box_around(const Vec2 &lo, const Vec2 &hi) const
{
  if (!(lo[0] <= hi[0] && lo[1] <= hi[1])) return {};
  NodeBox box;
  for (int a = 0; a < 2; ++a) {
    const auto cell_of = [&](double coordinate) {
      return static_cast<int>(
          std::floor(face_pair::clamped(grid_.scaled(coordinate, a), 0.0, grid_.cells(a))));
    };
    box.first[a] = cell_of(lo[a]) - 1;
    box.end[a] = std::min(cell_of(hi[a]) + 4, grid_.cells(a) + 2);
  }
  return box;
}

void SharedNodes::list_nodes()
{
  std::vector<char> is_shared(grid_.node_count(), 0);
  for (int a = 0; a < communication_.ranks; ++a)
    for (int b = 0; b < communication_.ranks; ++b) {
      if (a == b || touched_[a].is_empty()) continue;
      NodeBox common;
      for (int axis = 0; axis < 2; ++axis) {
        common.first[axis] =
            std::max(touched_[a].first[axis] - margin_[axis], touched_[b].first[axis]);
        common.end[axis] = std::min(touched_[a].end[axis] + margin_[axis], touched_[b].end[axis]);
      }
      if (common.is_empty()) continue;
      for (int j = common.first[1]; j < common.end[1]; ++j)
        std::fill(is_shared.begin() + grid_.node(common.first[0], j),
                  is_shared.begin() + grid_.node(common.end[0] - 1, j) + 1, 1);
    }
  std::vector<int> nodes;
  for (int node = 0; node < grid_.node_count(); ++node)
    if (is_shared[node]) nodes.push_back(node);
  if (nodes == nodes_) return;
  nodes_ = std::move(nodes);
  ++edition_;
}

bool SharedNodes::is_first_to_touch(int node) const
{
  return std::none_of(touched_.begin(), touched_.begin() + communication_.rank,
                      [&](const NodeBox &lower) {
                        return lower.contains(grid_, node);
                      });
}

}    // namespace mpm
