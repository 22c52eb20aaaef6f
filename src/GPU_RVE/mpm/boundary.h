// SPDX-License-Identifier: GPL-2.0-only
// Velocity conditions on the sides of the grid, and the arrays of rigid bodies on it. Contact with
// bodies is in face_contact.h and rigid_contact.h.
//
// Every condition is imposed as an impulse on nodal momenta, twice in a balance: on the momenta with the
// forces, which gives the velocities of the grid, and on those that the points brought, from which
// their increments are counted. The wall or body feels the first impulse less flip times the second one
// (doc/src/theory_mpm.rst). Sides are imposed node by node, bodies column by column of nodes: neither
// looks at what the others change.

#pragma once

#include "mpm/grid.h"
#include "mpm/rigid_shape.h"
#include "mpm/shape_functions.h"

#include <array>
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

/// Bits of a node: a side holds it across an axis, and that side holds all components.
struct SideBits {
  static RVE_HD constexpr int across(int axis) { return 1 << 2 * axis; }
  static RVE_HD constexpr int fixed_across(int axis) { return 2 << 2 * axis; }
  static constexpr int FIXED_ACROSS_ANY = 0xaa;
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

  /// Per node that is held: SideBits.
  std::vector<std::uint8_t> sides(const Grid<D> &part) const;
  /// Those that are held; nodes ascending.
  std::vector<AbsorbingNode<D>> absorbing(const Grid<D> &part) const;

  /// The nodes of the whole grid on a side and beyond it.
  NodeBox<D> nodes_of(Face side) const;

  /// Impulse [mass length/time] of the material on a body, or on a side, from the impulses on nodes
  /// for that body, or for the axis of that side on nodes_of() it. Always summed in the same order;
  /// nodes without an impulse may be left out.
  Vec<D> body_impulse(int body, const Impulses &felt) const;
  Vec<D> side_impulse(Face side, const Impulses &felt) const;

 private:
  Vec<D> sum_along(int axis, bool downwards, const Impulses &felt) const;

  Grid<D> grid_;
  std::array<SideKind, FACES<D>> sides_;
  std::array<Dashpots, FACES<D>> dashpots_;
  std::vector<RigidBodyOptions> options_;
};

namespace face_pair {

  /// Coordinates agree within this many cells: far above round-off, far below anything that matters.
  constexpr double SAME_PLACE = 1e-6;

  RVE_HD inline double clamped(double value, double low, double high)
  {
    return value < low ? low : value > high ? high : value;
  }

}    // namespace face_pair

}    // namespace mpm
