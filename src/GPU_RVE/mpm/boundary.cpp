#include "mpm/boundary.h"

#include <algorithm>

namespace mpm {

namespace {

  /// Coordinates agree within this many cells: far above round-off, far below anything that matters.
  constexpr double SAME_PLACE = 1e-6;

  /// Two nodes of one column of the grid on both sides of a body's face, with the share of the face's force that each takes.
  struct FacePair {
    int node[2];
    double share[2];
    bool used[2];    ///< takes a share at all

    /// Impulse on one component that gives the pair the velocity `target` at the face; false if there is nothing to push.
    bool impulse(const std::vector<double> &mass, const std::vector<Vec2> &momentum, int axis,
                 double target, double &result) const
    {
      double velocity = 0.0;
      double compliance = 0.0;
      for (int k = 0; k < 2; ++k) {
        if (!used[k]) continue;
        const double m = mass[node[k]];
        if (!(m > 0.0)) return false;
        velocity += share[k] * momentum[node[k]][axis] / m;
        compliance += share[k] * share[k] / m;
      }
      result = (target - velocity) / compliance;
      return true;
    }
  };

}    // namespace

Boundary::Boundary(const Grid &grid, ShapeFunction shape, const std::array<SideKind, 4> &sides,
                   const std::vector<RigidBodyOptions> &bodies) :
    grid_(grid),
    shape_(shape), options_(bodies), on_side_(2 * static_cast<std::size_t>(grid.node_count()), 0),
    on_body_(on_side_), closed_(bodies.size()), body_impulse_(bodies.size(), Vec2::zero())
{
  side_impulse_.fill(Vec2::zero());
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi}) {
    const SideKind kind = sides[static_cast<int>(side)];
    if (kind == SideKind::Free) continue;
    const int axis = axis_of(side);
    const int last = grid.cells(axis);
    for (int along = -1; along <= grid.cells(1 - axis) + 1; ++along)
      for (int across : {outward(side) < 0.0 ? -1 : last, outward(side) < 0.0 ? 0 : last + 1}) {
        const int node = axis == 0 ? grid.node(across, along) : grid.node(along, across);
        const bool fixed = kind == SideKind::Fixed;
        side_nodes_.push_back({node, side, fixed});
        on_side_[2 * node + axis] = 1;
        if (fixed) on_side_[2 * node + 1 - axis] = 1;
      }
  }
}

void Boundary::impose(const std::vector<double> &mass, const std::vector<RigidBodyState> &bodies,
                      Contact contact, std::vector<Vec2> &momentum)
{
  std::fill(on_body_.begin(), on_body_.end(), 0);
  for (std::size_t b = 0; b < bodies.size(); ++b)
    impose_body(static_cast<int>(b), mass, bodies[b], contact, momentum);
  impose_sides(momentum);
}

void Boundary::impose_sides(std::vector<Vec2> &momentum)
{
  side_impulse_.fill(Vec2::zero());
  for (const SideNode &entry : side_nodes_) {
    const int axis = axis_of(entry.side);
    Vec2 &felt = side_impulse_[static_cast<int>(entry.side)];
    Vec2 &p = momentum[entry.node];
    for (int a = 0; a < 2; ++a) {
      if (a != axis && !entry.fixed) continue;
      felt[a] += p[a];
      p[a] = 0.0;
    }
  }
}

void Boundary::impose_body(int body, const std::vector<double> &mass, const RigidBodyState &state,
                           Contact contact, std::vector<Vec2> &momentum)
{
  const RigidBodyOptions &options = options_[body];
  const int normal = axis_of(options.face);
  const int tangent = 1 - normal;
  const double outside = outward(options.face);
  const int inwards = outside < 0.0 ? 1 : -1;    // step of the row index into the body
  const Vec2 &velocity = state.velocity;
  Vec2 &felt = body_impulse_[body];
  felt = Vec2::zero();

  // rows on both sides of the face, and the last row inside the body
  const double face = grid_.scaled(outside < 0.0 ? state.lo[normal] : state.hi[normal], normal);
  const double back = grid_.scaled(outside < 0.0 ? state.hi[normal] : state.lo[normal], normal);
  if (!(std::abs(face) < 1e9 && std::abs(back) < 1e9)) return;    // nowhere near the grid
  const int inner = static_cast<int>(outside < 0.0 ? std::ceil(face) : std::floor(face));
  double outer_share = std::abs(inner - face);
  if (shape_ == ShapeFunction::Linear) outer_share = outer_share < 0.5 ? 0.0 : 1.0;
  const int last_row = grid_.cells(normal) + 1;

  // columns under the body
  const double left = grid_.scaled(state.lo[tangent], tangent);
  const double right = grid_.scaled(state.hi[tangent], tangent);
  const double last_column = grid_.cells(tangent) + 1;
  const int begin =
      static_cast<int>(std::ceil(std::clamp(left - SAME_PLACE, -1.0, last_column + 1)));
  const int end = static_cast<int>(std::floor(std::clamp(right + SAME_PLACE, -2.0, last_column)));

  const auto node_at = [&](int column, int row) {
    return normal == 1 ? grid_.node(column, row) : grid_.node(row, column);
  };
  const auto on_grid = [&](int row) {
    return row >= -1 && row <= last_row;
  };
  const auto held_by_side = [&](const FacePair &pair, int axis) {
    return (pair.used[0] && on_side_[2 * pair.node[0] + axis]) ||
        (pair.used[1] && on_side_[2 * pair.node[1] + axis]);
  };
  const auto prescribe = [&](int node, int axis) {
    if (on_side_[2 * node + axis]) return;
    const double change = mass[node] * velocity[axis] - momentum[node][axis];
    momentum[node][axis] += change;
    felt[axis] -= change;
    on_body_[2 * node + axis] = 1;
  };

  std::vector<char> &closed = closed_[body];
  closed.resize(static_cast<std::size_t>(grid_.cells(tangent)) + 3, 0);
  if (contact == Contact::Find) std::fill(closed.begin(), closed.end(), 0);

  for (int column = begin; column <= end; ++column) {
    FacePair pair;
    const int row[2] = {inner, inner - inwards};
    const double share[2] = {1.0 - outer_share, outer_share};
    bool reachable = true;
    for (int k = 0; k < 2; ++k) {
      pair.share[k] = share[k];
      pair.used[k] = share[k] > SAME_PLACE;
      if (pair.used[k] && !on_grid(row[k])) reachable = false;
      pair.node[k] = on_grid(row[k]) ? node_at(column, row[k]) : 0;
    }

    if (reachable) {
      double impulse;
      bool touches = pair.impulse(mass, momentum, normal, velocity[normal], impulse);
      if (contact == Contact::Keep)
        touches = touches && closed[column + 1];
      else if (options.separation)
        touches = touches && impulse * outside > 0.0;    // pushes the material away
      closed[column + 1] = touches;

      for (int a = 0; touches && a < 2; ++a) {
        if (a != normal && !options.rough) continue;
        if (held_by_side(pair, a)) continue;
        pair.impulse(mass, momentum, a, velocity[a], impulse);
        felt[a] -= impulse;
        for (int k = 0; k < 2; ++k) {
          if (!pair.used[k]) continue;
          momentum[pair.node[k]][a] += pair.share[k] * impulse;
          on_body_[2 * pair.node[k] + a] = 1;
        }
      }
    }

    // the inside of the body, and its lateral faces
    const double lateral = column < left + SAME_PLACE ? -1.0
        : column > right - SAME_PLACE                 ? 1.0
                                                      : 0.0;
    const int first_inside = std::clamp(pair.used[0] ? inner + inwards : inner, -1, last_row);
    for (int j = first_inside; on_grid(j); j += inwards) {
      if ((back - j) * inwards < -SAME_PLACE || (j - face) * inwards < -SAME_PLACE) break;
      const int node = node_at(column, j);
      if (!(mass[node] > 0.0)) continue;
      if (lateral == 0.0) {
        prescribe(node, 0);
        prescribe(node, 1);
      } else if ((momentum[node][tangent] / mass[node] - velocity[tangent]) * lateral < 0.0) {
        prescribe(node, tangent);
      }
    }
  }
}

}    // namespace mpm
