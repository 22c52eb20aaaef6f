// SPDX-License-Identifier: GPL-2.0-only
// Velocity conditions on the sides of the grid, options of rigid bodies, and sums of reactions.
// Contact with bodies is in face_contact.h and rigid_contact.h.
//
// Each condition is an impulse on nodal momenta. A balance of momentum imposes it twice. The first
// impulse acts on the momenta after the forces have been added; these momenta give the velocities
// of the grid. The second impulse acts on the momenta before the forces. The difference of both
// momenta gives the velocity increments of the points. The impulse of the wall or body on the
// material is the first impulse minus flip times the second impulse (doc/src/theory_mpm.rst).
// Conditions of sides are imposed node by node, and conditions of bodies column by column of nodes.
// The work for a node or column does not read data that other nodes or columns change.

#pragma once

#include "mpm/grid.h"
#include "mpm/rigid_shape.h"
#include "mpm/shape_functions.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mpm {

/// Velocity condition on a side of the grid and on the nodes beyond it. Free: no condition. Roller:
/// no velocity normal to the side. Fixed: no velocity.
enum class SideKind { Free, Roller, Fixed };

/// Wave speeds c [length/time] of the dashpots of a side. The dashpots put a traction -ρ c v on the
/// nodes of the side, with the density ρ and the nodal velocity v. Zero means that there is no
/// dashpot.
struct Dashpots {
  double normal = 0.0;        ///< compression waves; the side must be free
  double tangential = 0.0;    ///< shear waves; the side must be free or a roller

  bool exist() const { return normal != 0.0 || tangential != 0.0; }
};

/// A node with the dashpots of the sides that it belongs to.
template <int D> struct AbsorbingNode {
  int node;
  Vec<D> speed[D];    ///< [axis across the side][velocity component], [length/time]
};

/// Form, contact and freedoms of a rigid body.
struct RigidBodyOptions {
  Face face = Face::YLo;    ///< the body's contact face; a footing presses with its lower one
  bool rough = true;    ///< all velocity components are prescribed; otherwise the normal one only
  bool separation = false;    ///< the face can push but not pull
  bool round = false;         ///< 3D: a cylinder in the body's box, along the normal of its face
  BodyForm form = BodyForm::Face;    ///< `face` and `round` matter for Face only
  // members for forms that can turn
  double friction = 0.0;     ///< coefficient; above 0: contacts can open, and `rough` must be false
  int free = 0;              ///< bit k: freedom k obeys forces; other freedoms are prescribed
  bool has_pivot = false;    ///< the body turns about `pivot`; otherwise about its centre of mass
  double pivot[3] = {};      ///< initial position of the pivot [length]
  double turned[3] = {};     ///< initial rotation vector; the angle in 2D [radian]
};

/// State of a rigid body of the form Face in a step. The body is the bounding box of the boxes of
/// its points and moves without rotation.
template <int D> struct RigidBodyState {
  Vec<D> lo, hi;      ///< [length]
  Vec<D> velocity;    ///< [length/time]
};

/// Source of the state of contacts. Find: the state follows from the momenta. Keep: the state that
/// was found last is used.
enum class Contact { Find, Keep };

/// Bits of a node: across(axis) if it is on a roller or fixed side across that axis,
/// fixed_across(axis) if that side is fixed.
struct SideBits {
  static RVE_HD constexpr int across(int axis) { return 1 << 2 * axis; }
  static RVE_HD constexpr int fixed_across(int axis) { return 2 << 2 * axis; }
  static constexpr int FIXED_ACROSS_ANY = 0xaa;
};

/// A node of the whole grid with a value.
template <int D, class T> struct NodeValue {
  NodeIndex<D> place;
  T value;
};

/// Conditions on the nodes of a part of the grid, and sums of impulses over the whole grid.
template <int D> class Boundary {
 public:
  using Impulses = std::vector<NodeValue<D, Vec<D>>>;    ///< nodes in any order

  Boundary(const Grid<D> &grid, const std::array<SideKind, FACES<D>> &sides,
           const std::array<Dashpots, FACES<D>> &dashpots,
           const std::vector<RigidBodyOptions> &bodies);

  /// Returns the SideBits of each node of the part.
  std::vector<std::uint8_t> sides(const Grid<D> &part) const;
  /// Returns the nodes of the part with dashpots, in ascending order.
  std::vector<AbsorbingNode<D>> absorbing(const Grid<D> &part) const;

  /// Returns the nodes of the whole grid on a side and beyond it.
  NodeBox<D> nodes_of(Face side) const;

  /// Impulse of the material on a body [mass length/time]. `impulses` are the impulses of this body
  /// on nodes; nodes without an impulse may be left out. The order of the sum is fixed.
  Vec<D> body_impulse(int body, const Impulses &impulses) const;
  /// Impulse of the material on a side [mass length/time]. `impulses` are the impulses of the nodes
  /// in nodes_of(side) on this side. The order of the sum is fixed, as in body_impulse().
  Vec<D> side_impulse(Face side, const Impulses &impulses) const;

 private:
  Vec<D> sum_along(int axis, bool downwards, const Impulses &impulses) const;

  Grid<D> grid_;
  std::array<SideKind, FACES<D>> sides_;
  std::array<Dashpots, FACES<D>> dashpots_;
  std::vector<RigidBodyOptions> options_;
};

/// Coordinates that differ by less than this count as equal [cells]. The value is far above
/// round-off.
constexpr double POSITION_TOLERANCE = 1e-6;

RVE_HD inline double clamped(double value, double low, double high)
{
  return value < low ? low : value > high ? high : value;
}

}    // namespace mpm
