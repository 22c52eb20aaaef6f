// SPDX-License-Identifier: GPL-2.0-only
// Velocity conditions on the sides of the grid, and the arrays of rigid bodies on it. Contact with
// bodies is in face_contact.h and rigid_contact.h.
//
// Every condition is imposed as an impulse on nodal momenta, twice in a balance: on the momenta with the forces, which gives the
// velocities of the grid, and on those that the points brought, from which their increments are counted. What is held then gives
// its points the change of its own velocity, and not the difference between theirs and its own. The wall or body feels the first
// impulse less the second one, of which points with increments alone (flip 1) keep everything and those with velocities of the
// grid (flip 0) nothing. Sides are imposed node by node, bodies column by column of nodes: neither looks at what the others change.

#pragma once

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

/// Whether contact of a body that can separate is found from the momenta, or taken from the last time it was found.
enum class Contact { Find, Keep };

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

}    // namespace face_pair

}    // namespace mpm
