// Velocity conditions on the grid: its four sides, and rigid bodies with a prescribed velocity.
//
// Every condition is imposed as an impulse on nodal momenta, and the impulse is what the wall or the body feels.

#ifndef MPM_BOUNDARY_H
#define MPM_BOUNDARY_H

#include "mpm/grid.h"
#include "mpm/shape_functions.h"

#include <array>
#include <vector>

namespace mpm {

/// Free: no condition. Roller: no velocity normal to the side. Fixed: no velocity. They hold on the side and beyond it.
enum class SideKind { Free, Roller, Fixed };

/// How a rigid body touches the material.
struct RigidBodyOptions {
  Face face = Face::YLo;    ///< the body's contact face; a footing presses with its lower one
  bool rough = true;    ///< both velocity components are prescribed there; else the normal one only
  bool separation = false;    ///< the face can push but not pull
};

/// A rigid body in this step: the rectangle around the boxes of its points, moving without rotation.
struct RigidBodyState {
  Vec2 lo, hi;      ///< [length]
  Vec2 velocity;    ///< [length/time]
};

class Boundary {
 public:
  Boundary(const Grid &grid, ShapeFunction shape, const std::array<SideKind, 4> &sides,
           const std::vector<RigidBodyOptions> &bodies);

  /// Whether contact of a body that can separate is found from the momenta, or taken from the last time it was found.
  enum class Contact { Find, Keep };

  /// Changes `momentum` [mass length/time] of the nodes so that it satisfies all conditions. `mass` [mass] per node; nodes
  /// without mass take no part. What a side holds is the side's alone: bodies leave it and do not feel it.
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
  /// Rows further inside the body move with it. On its two lateral faces material can slide and separate.
  /// Columns count as under the body if they are within its width, edges included: put the edges on columns.
  void impose(const std::vector<double> &mass, const std::vector<RigidBodyState> &bodies,
              Contact contact, std::vector<Vec2> &momentum);

  /// Impulse [mass length/time] that the material gave to a body or a side in the last call of impose().
  const Vec2 &body_impulse(int body) const { return body_impulse_[body]; }
  const Vec2 &side_impulse(Face side) const { return side_impulse_[static_cast<int>(side)]; }

  /// Whether the last call of impose() had a condition on this component of the node's velocity.
  bool constrains(int node, int axis) const
  {
    return on_side_[2 * node + axis] || on_body_[2 * node + axis];
  }

 private:
  void impose_body(int body, const std::vector<double> &mass, const RigidBodyState &state,
                   Contact contact, std::vector<Vec2> &momentum);
  void impose_sides(std::vector<Vec2> &momentum);

  struct SideNode {
    int node;
    Face side;
    bool fixed;
  };

  Grid grid_;
  ShapeFunction shape_;
  std::vector<RigidBodyOptions> options_;
  std::vector<SideNode> side_nodes_;
  std::vector<char> on_side_;                ///< per node and component
  std::vector<char> on_body_;                ///< per node and component
  std::vector<std::vector<char>> closed_;    ///< per body and column: the face is in contact
  std::vector<Vec2> body_impulse_;
  std::array<Vec2, 4> side_impulse_;
};

}    // namespace mpm

#endif
