// Velocity conditions on the grid: its sides, and rigid bodies with a prescribed velocity that press with one face. Bodies that can turn
// are in rigid_contact.h.
//
// Every condition is imposed as an impulse on nodal momenta, twice in a balance: on the momenta with the forces, which gives the
// velocities of the grid, and on those that the points brought, from which their increments are counted. What is held then gives
// its points the change of its own velocity, and not the difference between theirs and its own. The wall or body feels the first
// impulse less the second one, of which points with increments alone (flip 1) keep everything and those with velocities of the
// grid (flip 0) nothing. Sides are imposed node by node, bodies column by column of nodes: neither looks at what the others change.

#ifndef MPM_BOUNDARY_H
#define MPM_BOUNDARY_H

#include "mpm/grid.h"
#include "mpm/rigid_shape.h"
#include "mpm/shape_functions.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace mpm {

/// Free: no condition. Roller: no velocity normal to the side. Fixed: no velocity. They hold on the side and beyond it.
enum class SideKind { Free, Roller, Fixed };

/// Speeds of waves [length/time] that the dashpots of a side absorb, by their traction -ρ c v on its nodes; 0: no dashpot.
struct Dashpots {
  double normal = 0.0;        ///< compression waves; the side must be free
  double tangential = 0.0;    ///< shear waves; the side must be free or a roller

  bool exist() const { return normal != 0.0 || tangential != 0.0; }
};

/// A node with the dashpots of the sides that it belongs to.
template <int D> struct AbsorbingNode {
  int node;
  Vec<D> speed[D];    ///< across each axis, of each component of the velocity [length/time]
};

/// How a rigid body touches the material.
struct RigidBodyOptions {
  Face face = Face::YLo;    ///< the body's contact face; a footing presses with its lower one
  bool rough = true;    ///< both velocity components are prescribed there; else the normal one only
  bool separation = false;    ///< the face can push but not pull
  bool round = false;    ///< in space: a cylinder in the body's box, along the normal of its face
  BodyForm form = BodyForm::Face;    ///< the others have no face and are not `round`
  // of a form that can turn
  double friction = 0.0;     ///< coefficient, of a contact that is not rough: such a one separates
  int free = 0;              ///< bit k: freedom k obeys forces; the others are prescribed
  bool has_pivot = false;    ///< else it turns about its centre of mass
  double pivot[3] = {};      ///< at the beginning [length]
  double turned[3] = {};     ///< rotation vector at the beginning, in the plane the angle [radian]
};

/// A rigid body in this step: the box around the boxes of its points, moving without rotation.
template <int D> struct RigidBodyState {
  Vec<D> lo, hi;      ///< [length]
  Vec<D> velocity;    ///< [length/time]
};

/// Whether contact of a body that can separate is found from the momenta, or taken from the last time it was found. Before: of the
/// momenta before the forces: they get the conditions that those with the forces have just got.
enum class Contact { Find, Keep, Before };

/// The conditions as the passes over the nodes see them.
template <int D> struct BoundaryView {
  /// Bits of a node: whether it is held by a side across an axis, and whether that side holds all components.
  static RVE_HD constexpr int across(int axis) { return 1 << 2 * axis; }
  static RVE_HD constexpr int fixed_across(int axis) { return 2 << 2 * axis; }
  static constexpr int FIXED_ACROSS_ANY = 0xaa;

  Grid<D> grid;
  ShapeFunction shape;
  const std::uint8_t *sides = nullptr;    ///< per node, as above
  std::uint8_t *on_body = nullptr;    ///< per node: bit a if a body has a condition on component a
  std::uint8_t *closed = nullptr;     ///< per body and column: the face is in contact
  /// Per body that can turn and node: two bits a contact, as Touch says.
  std::uint16_t *contact_states = nullptr;

  // Impulses [mass length/time] that the material gave, for the reactions
  Vec<D> *side_impulse = nullptr;    ///< per axis and node: to the side across that axis
  Vec<D> *body_impulse = nullptr;    ///< per body and node

  RVE_HD bool held_by_side(int node, int axis) const
  {
    return (sides[node] & (across(axis) | FIXED_ACROSS_ANY)) != 0;
  }
  /// Whether the last conditions that were imposed had one on this component of the node's velocity.
  RVE_HD bool constrains(int node, int axis) const
  {
    return held_by_side(node, axis) || (on_body[node] >> axis & 1) != 0;
  }
  /// Columns of held nodes along an axis, one for each node across it; and along any axis, or more.
  RVE_HD int columns_across(int axis) const { return grid.lines_along(axis); }
  RVE_HD int columns() const
  {
    int most = 0;
    for (int a = 0; a < D; ++a) most = columns_across(a) > most ? columns_across(a) : most;
    return most;
  }

  /// Takes from the momentum [mass length/time] of a node what the sides hold.
  RVE_HD void impose_sides(int node, Vec<D> &momentum) const
  {
    for (int a = 0; sides[node] != 0 && a < D; ++a)
      if (held_by_side(node, a)) momentum[a] = 0.0;
  }
  /// The same for the two momenta of a balance, with and before the forces; the impulse is recorded.
  RVE_HD void balance_sides(int node, double flip, Vec<D> &with_forces, Vec<D> &before) const
  {
    const int kinds = sides[node];
    if (kinds == 0) return;
    for (int axis = 0; axis < D; ++axis) {
      if (!(kinds & across(axis))) continue;
      const bool fixed = (kinds & fixed_across(axis)) != 0;
      Vec<D> felt = Vec<D>::zero();
      for (int a = 0; a < D; ++a) {
        if (a != axis && !fixed) continue;
        felt[a] = with_forces[a] - flip * before[a];
        with_forces[a] = before[a] = 0.0;
      }
      side_impulse[axis * grid.node_count() + node] = felt;
    }
  }

  /// Changes the momenta [mass length/time] of the nodes in one column under a body, one of columns_across(), so that they
  /// satisfy its conditions. Columns that are not under the body are left alone. `mass` [mass] per node; nodes without mass take no part.
  /// What a side holds is the side's alone: bodies leave it and do not feel it.
  ///
  /// The face of a body lies between two rows of nodes, an inner and an outer one, as a rule on neither. In every column of
  /// nodes under the body, the velocity *interpolated at the face* is the body's: with w the distance of the face from the
  /// inner row in cells,
  ///   (1 - w) v_in + w v_out = v_body,     impulses (1 - w) J on the inner, w J on the outer node,
  ///   J = (v_body - (1 - w) v_in - w v_out) / ((1 - w)² / m_in + w² / m_out),
  /// the projection in the metric of the mass, which cannot add energy. The force acts on the nodes as a traction at
  /// the face would: uniform stress under the body stays in equilibrium wherever the face is, and nothing jumps when it
  /// passes a row. Prescribing whole rows instead leaves either a void or a rigid layer of up to a cell under the face.
  /// With linear shape functions, whose points have no extent, w is rounded to 0 or 1.
  ///
  /// Rows further inside the body move with it. On its lateral faces material can slide and separate; on an edge between two of them
  /// it is held where it moves into both, by that which has to change it less.
  /// Columns count as under the body if they are within its width, edges included: put the edges on columns. Those of a round body are
  /// within its radius; on its lateral face are nodes of the outermost cell, and what they must not do is move towards the axis.
  ///
  /// `felt_share` of the impulse is added to what the body felt in this step.
  RVE_HD void impose_body(int body, const RigidBodyOptions &options, const RigidBodyState<D> &state,
                          int column, Contact contact, double felt_share, const double *mass,
                          Vec<D> *momentum) const;
};

/// A node of the whole grid with a value.
template <int D, class T> struct NodeValue {
  Place<D> place;
  T value;
};

/// What the conditions say of the nodes of a part of the grid, and the impulses added up.
template <int D> class Boundary {
 public:
  using Impulses = std::vector<NodeValue<D, Vec<D>>>;    ///< of nodes in any order

  Boundary(const Grid<D> &grid, const std::array<SideKind, FACES<D>> &sides,
           const std::array<Dashpots, FACES<D>> &dashpots,
           const std::vector<RigidBodyOptions> &bodies);

  /// Per node that is held, for BoundaryView::sides.
  std::vector<std::uint8_t> sides(const Grid<D> &part) const;
  /// Those that are held; nodes ascending.
  std::vector<AbsorbingNode<D>> absorbing(const Grid<D> &part) const;
  bool absorbs() const;

  /// The nodes of the whole grid on a side and beyond it.
  NodeBox<D> nodes_of(Face side) const;

  /// Impulse [mass length/time] of the material on a body, or on a side, from what a BoundaryView recorded for that body, or for the
  /// axis of that side on nodes_of() it. Always summed in the same order; nodes without an impulse may be left out.
  Vec<D> body_impulse(int body, const Impulses &felt) const;
  Vec<D> side_impulse(Face side, const Impulses &felt) const;

 private:
  Vec<D> sum_along(int axis, bool downwards, const Impulses &felt) const;

  Grid<D> grid_;
  std::array<SideKind, FACES<D>> sides_;
  std::array<Dashpots, FACES<D>> dashpots_;
  std::vector<RigidBodyOptions> options_;
};

// ---- implementation -----------------------------------------------------------------------------------------------------------

namespace face_pair {

  /// Coordinates agree within this many cells: far above round-off, far below anything that matters.
  constexpr double SAME_PLACE = 1e-6;

  RVE_HD inline double clamped(double value, double low, double high)
  {
    return value < low ? low : value > high ? high : value;
  }

  /// Two nodes of one column of the grid on both sides of a body's face, with the share of the face's force that each takes.
  struct FacePair {
    int node[2];
    double share[2];
    bool used[2];    ///< takes a share at all

    /// Impulse on one component that gives the pair the velocity `target` at the face; false if there is nothing to push.
    template <int D>
    RVE_HD bool impulse(const double *mass, const Vec<D> *momentum, int axis, double target,
                        double &result) const
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

}    // namespace face_pair

template <int D>
RVE_HD void BoundaryView<D>::impose_body(int body, const RigidBodyOptions &options,
                                         const RigidBodyState<D> &state, int column,
                                         Contact contact, double felt_share, const double *mass,
                                         Vec<D> *momentum) const
{
  using namespace face_pair;
  const int normal = axis_of(options.face);
  const double outside = outward(options.face);
  const int inwards = outside < 0.0 ? 1 : -1;    // step of the row index into the body
  const Vec<D> &velocity = state.velocity;
  Vec<D> *felt = felt_share != 0.0
      ? body_impulse + static_cast<std::size_t>(body) * grid.node_count()
      : nullptr;

  // rows on both sides of the face, and the last row inside the body
  const double face = grid.scaled(outside < 0.0 ? state.lo[normal] : state.hi[normal], normal);
  const double back = grid.scaled(outside < 0.0 ? state.hi[normal] : state.lo[normal], normal);
  if (!(std::abs(face) < 1e9 && std::abs(back) < 1e9)) return;    // nowhere near the grid
  const int inner = static_cast<int>(outside < 0.0 ? std::ceil(face) : std::floor(face));
  double outer_share = std::abs(inner - face);
  if (shape == ShapeFunction::Linear) outer_share = outer_share < 0.5 ? 0.0 : 1.0;
  const int first_row = grid.first(normal), last_row = grid.last(normal);

  // columns under the body, and on which lateral faces of it they are
  Place<D> place = Place<D>::zero();
  int lateral[D] = {};    // -1 or 1, along the axes of the face
  bool is_lateral = false;
  const bool is_round = D == 3 && options.round;
  Vec<D> from_axis = Vec<D>::zero();    // of a round body, to the column
  double radius = 1e9;
  for (int a = 0, rest = column; a < D; ++a) {
    if (a == normal) continue;
    place[a] = rest % grid.nodes(a) + grid.first(a);
    rest /= grid.nodes(a);
    const double left = grid.scaled(state.lo[a], a);
    const double right = grid.scaled(state.hi[a], a);
    const double last_column = grid.cells(a) + 1;
    if (place[a] < std::ceil(clamped(left - SAME_PLACE, -1.0, last_column + 1)) ||
        place[a] > std::floor(clamped(right + SAME_PLACE, -2.0, last_column)))
      return;
    lateral[a] = place[a] < left + SAME_PLACE ? -1 : place[a] > right - SAME_PLACE ? 1 : 0;
    is_lateral = is_lateral || lateral[a] != 0;
    if (!is_round) continue;
    const double half = 0.5 * (right - left);
    from_axis[a] = place[a] - (left + half);
    radius = half < radius ? half : radius;
  }
  if (is_round) {
    const double distance = std::sqrt(dot(from_axis, from_axis));
    if (distance > radius + SAME_PLACE) return;
    is_lateral = distance > radius - 1.0 && distance > 0.0;
    if (is_lateral) from_axis = (1.0 / distance) * from_axis;
  }

  const auto node_at = [&](int row) {
    place[normal] = row;
    return grid.node(place);
  };
  const auto is_held = [&](int row) {    // there is no mass elsewhere
    return row >= first_row && row <= last_row;
  };
  const auto set_on_body = [&](int node, int axis) {
    on_body[node] = static_cast<std::uint8_t>(on_body[node] | 1 << axis);
  };
  const auto prescribe = [&](int node, int axis) {
    if (held_by_side(node, axis)) return;
    const double change = mass[node] * velocity[axis] - momentum[node][axis];
    momentum[node][axis] += change;
    if (felt) felt[node][axis] += felt_share * change;
    set_on_body(node, axis);
  };

  FacePair pair;
  const int row[2] = {inner, inner - inwards};
  const double share[2] = {1.0 - outer_share, outer_share};
  bool reachable = true;
  for (int k = 0; k < 2; ++k) {
    pair.share[k] = share[k];
    pair.used[k] = share[k] > SAME_PLACE;
    if (pair.used[k] && !is_held(row[k])) reachable = false;
    pair.node[k] = is_held(row[k]) ? node_at(row[k]) : 0;
  }

  if (reachable) {
    std::uint8_t &is_closed = closed[static_cast<std::size_t>(body) * columns() + column];
    double impulse;
    bool touches = pair.impulse(mass, momentum, normal, velocity[normal], impulse);
    if (contact != Contact::Find)
      touches = touches && is_closed;
    else if (options.separation)
      touches = touches && impulse * outside > 0.0;    // pushes the material away
    is_closed = touches;

    for (int a = 0; touches && a < D; ++a) {
      if (a != normal && !options.rough) continue;
      bool held = false;
      for (int k = 0; k < 2; ++k) held = held || (pair.used[k] && held_by_side(pair.node[k], a));
      if (held) continue;
      pair.impulse(mass, momentum, a, velocity[a], impulse);
      if (felt) felt[pair.used[1] ? pair.node[1] : pair.node[0]][a] += felt_share * impulse;
      for (int k = 0; k < 2; ++k) {
        if (!pair.used[k]) continue;
        momentum[pair.node[k]][a] += pair.share[k] * impulse;
        set_on_body(pair.node[k], a);
      }
    }
  }

  // the inside of the body, and its lateral faces
  int inside = pair.used[0] ? inner + inwards : inner;
  inside = inside < first_row ? first_row : inside > last_row ? last_row : inside;
  for (; is_held(inside); inside += inwards) {
    if ((back - inside) * inwards < -SAME_PLACE || (inside - face) * inwards < -SAME_PLACE) break;
    const int node = node_at(inside);
    if (!(mass[node] > 0.0)) continue;
    if (!is_lateral) {
      for (int a = 0; a < D; ++a) prescribe(node, a);
    } else if (is_round) {
      // towards the axis, in the directions that no side holds
      double entry = 0.0, free_part = 0.0;
      bool was_held = false;
      for (int a = 0; a < D; ++a) {
        if (from_axis[a] == 0.0 || held_by_side(node, a)) continue;
        entry -= (momentum[node][a] / mass[node] - velocity[a]) * from_axis[a];
        free_part += from_axis[a] * from_axis[a];
        was_held = was_held || (on_body[node] >> a & 1) != 0;
      }
      if (!(contact == Contact::Before ? was_held : entry > 0.0)) continue;
      for (int a = 0; a < D; ++a) {
        if (from_axis[a] == 0.0 || held_by_side(node, a)) continue;
        const double change = mass[node] * entry / free_part * from_axis[a];
        momentum[node][a] += change;
        if (felt) felt[node][a] += felt_share * change;
        set_on_body(node, a);
      }
    } else if (contact == Contact::Before) {
      for (int a = 0; a < D; ++a)
        if (lateral[a] != 0 && (on_body[node] >> a & 1) != 0) prescribe(node, a);
    } else {
      int holds = -1;    // the axis that material moves into the body along, slowest
      double slowest = 0.0;
      for (int a = 0; a < D; ++a) {
        if (lateral[a] == 0 || held_by_side(node, a)) continue;
        const double entry = (momentum[node][a] / mass[node] - velocity[a]) * -lateral[a];
        if (holds >= 0 && !(entry < slowest)) continue;
        holds = a;
        slowest = entry;
      }
      if (slowest > 0.0) prescribe(node, holds);
    }
  }
}

}    // namespace mpm

#endif
