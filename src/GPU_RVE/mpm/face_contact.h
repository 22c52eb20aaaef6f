// SPDX-License-Identifier: GPL-2.0-only
// Contact between the material and rigid bodies of the form Face, which press with one face. The
// passes run over columns of nodes across this face.
//
// The face of a body generally lies between an inner and an outer row of nodes. In each column of
// nodes under the body, the contact sets the velocity interpolated at the face to the velocity of
// the body. The impulses on the inner and the outer node are (1 - w) J and w J with
//   J = (v_body - (1 - w) v_in - w v_out) / ((1 - w)² / m_in + w² / m_out).
// w is the distance of the face from the inner row [cells]. v_in, m_in and v_out, m_out are the
// velocity and mass of the inner and the outer node. With linear shape functions w is rounded to 0
// or 1. doc/src/theory_mpm.rst explains this contact, and doc/src/dev_rigid_contact.rst the sliding
// of material on lateral faces. A lateral face that a neighbouring body covers is ignored.
//
// A column is under a body if it is within the width of the body, edges included. A column on an
// edge forms the lateral face there; an edge between two columns has no lateral face. A column is
// under a round body if it is within its radius. Columns less than one cell inside of the edge of a
// round body form its lateral face. There the motion of the material towards the axis is stopped.
//
// Each contact is first found and then imposed. Finding a contact marks the velocity components
// that the contact holds at its nodes. Bodies do not act on components that a side of the grid
// holds. A node that several bodies hold is divided among these bodies (shared_contacts.h).

#pragma once

#include "mpm/shared_contacts.h"

namespace mpm {

/// A column of nodes under a body.
template <int D> struct FaceColumn {
  int body;
  int normal;                 ///< axis of the column
  int inwards;                ///< step of the row index into the body
  double face, back;          ///< row coordinates of the two ends of the body
  NodeIndex<D> place;         ///< place of the column; the component along `normal` is not used
  int first_row, last_row;    ///< outermost rows of nodes that this rank stores

  // [0]: inner node, [1]: outer node of the face, with their shares of the impulse
  int row[2], node[2];
  double share[2];
  bool used[2];     ///< the node takes a share
  bool has_pair;    ///< this rank stores all used nodes

  int lateral[D] = {};    ///< -1 or 1 if the column is on the low or high lateral face, else 0
  bool is_lateral = false;
  int weight = StepView<D>::WHOLE_CONTACT;    ///< sectors (OpenFaces) that the body covers
  bool is_round = false;
  Vec<D> from_axis = Vec<D>::zero();    ///< unit vector from the axis to a lateral column, if round

  /// Sets the members for a column. Returns false if the column is not under the body.
  RVE_HD bool find(const StepView<D> &step, int number, const RigidBodyOptions &options, int column)
  {
    const Grid<D> &grid = step.grid;
    const RigidBodyState<D> state = step.body(number);
    body = number;
    normal = axis_of(options.face);
    const double outside = outward(options.face);
    inwards = outside < 0.0 ? 1 : -1;
    face = grid.scaled(outside < 0.0 ? state.lo[normal] : state.hi[normal], normal);
    back = grid.scaled(outside < 0.0 ? state.hi[normal] : state.lo[normal], normal);
    if (!(std::abs(face) < 1e9 && std::abs(back) < 1e9)) return false;    // far from the grid
    first_row = grid.first(normal);
    last_row = grid.last(normal);
    if (!find_place(grid, state, options, column)) return false;
    const int inner = static_cast<int>(outside < 0.0 ? std::ceil(face) : std::floor(face));
    double outer_share = std::abs(inner - face);
    if (step.shape == ShapeFunction::Linear) outer_share = outer_share < 0.5 ? 0.0 : 1.0;
    row[0] = inner;
    row[1] = inner - inwards;
    share[0] = 1.0 - outer_share;
    share[1] = outer_share;
    has_pair = true;
    for (int k = 0; k < 2; ++k) {
      used[k] = share[k] > POSITION_TOLERANCE;
      has_pair = has_pair && (!used[k] || is_held(row[k]));
      node[k] = is_held(row[k]) ? node_at(grid, row[k]) : 0;
    }
    return true;
  }

  RVE_HD bool is_held(int r) const { return r >= first_row && r <= last_row; }
  RVE_HD int node_at(const Grid<D> &grid, int r) const
  {
    NodeIndex<D> at = place;
    at[normal] = r;
    return grid.node(at);
  }

  /// Calls visit(row, node) for the nodes with mass inside the body that are not used at its face.
  template <class Visit> RVE_HD void each_inside(const StepView<D> &step, const Visit &visit) const
  {
    int inside = used[0] ? row[0] + inwards : row[0];
    inside = inside < first_row ? first_row : inside > last_row ? last_row : inside;
    for (; is_held(inside); inside += inwards) {
      if ((back - inside) * inwards < -POSITION_TOLERANCE ||
          (inside - face) * inwards < -POSITION_TOLERANCE)
        break;
      const int n = node_at(step.grid, inside);
      if (step.mass[n] > 0.0) visit(inside, n);
    }
  }

 private:
  RVE_HD bool find_place(const Grid<D> &grid, const RigidBodyState<D> &state,
                         const RigidBodyOptions &options, int column)
  {
    place = NodeIndex<D>::zero();
    is_round = D == 3 && options.round;
    double radius = 1e9;
    for (int a = 0, rest = column; a < D; ++a) {
      if (a == normal) continue;
      place[a] = rest % grid.nodes(a) + grid.first(a);
      rest /= grid.nodes(a);
      const double left = grid.scaled(state.lo[a], a);
      const double right = grid.scaled(state.hi[a], a);
      const double last_column = grid.cells(a) + 1;
      if (place[a] < std::ceil(clamped(left - POSITION_TOLERANCE, -1.0, last_column + 1)) ||
          place[a] > std::floor(clamped(right + POSITION_TOLERANCE, -2.0, last_column)))
        return false;
      lateral[a] = place[a] < left + POSITION_TOLERANCE ? -1
          : place[a] > right - POSITION_TOLERANCE       ? 1
                                                        : 0;
      is_lateral = is_lateral || lateral[a] != 0;
      if (lateral[a] != 0 && !is_round) weight /= 2;
      if (!is_round) continue;
      const double half = 0.5 * (right - left);
      from_axis[a] = place[a] - (left + half);
      radius = half < radius ? half : radius;
    }
    if (!is_round) return true;
    const double distance = std::sqrt(dot(from_axis, from_axis));
    if (distance > radius + POSITION_TOLERANCE) return false;
    is_lateral = distance > radius - 1.0 && distance > 0.0;
    if (is_lateral) from_axis = (1.0 / distance) * from_axis;
    return true;
  }
};

/// Lateral faces of a body at a node inside it, except the faces that another body covers. Two
/// plates that touch each other therefore act as one plate.
///
/// The axes along the face divide the surroundings of the node into sectors. A set of sectors is a
/// bit mask with bit s for sector s. Bit a of the number s is 0 on the low side of the node along
/// axis a, and 1 on the high side.
template <int D> struct OpenFaces {
  int lateral[D] = {};
  bool any = false;

  RVE_HD OpenFaces(const StepView<D> &step, const FaceColumn<D> &column, int row,
                   std::uint64_t plates)
  {
    NodeIndex<D> place = column.place;
    place[column.normal] = row;
    int own = sectors(column, column.lateral), all = own;
    for (int b = 0; b < step.num_bodies; ++b)
      if (b != column.body && b < 64 && (plates >> b & 1))
        all |= covered(step.grid, step.body(b), column, place);
    for (int a = 0; a < D; ++a) {
      if (column.lateral[a] == 0) continue;
      const int beyond = column.lateral[a] < 0 ? own >> (1 << a) : own << (1 << a);
      if ((all & beyond) == beyond) continue;
      lateral[a] = column.lateral[a];
      any = true;
    }
  }

 private:
  static constexpr int SECTORS = 1 << D;

  /// Returns the set of sectors on the inner sides of the lateral faces. The set has only the
  /// sectors on the low side along the column; they represent both sides.
  static RVE_HD int sectors(const FaceColumn<D> &column, const int *on_face)
  {
    int set = 0;
    for (int s = 0; s < SECTORS; ++s) {
      bool is_inside = (s >> column.normal & 1) == 0;
      for (int a = 0; a < D; ++a)
        is_inside = is_inside && (a == column.normal || on_face[a] != ((s >> a & 1) ? 1 : -1));
      if (is_inside) set |= 1 << s;
    }
    return set;
  }
  static RVE_HD int covered(const Grid<D> &grid, const RigidBodyState<D> &other,
                            const FaceColumn<D> &column, const NodeIndex<D> &place)
  {
    int on_face[D] = {};
    for (int a = 0; a < D; ++a) {
      const double from_low = place[a] - grid.scaled(other.lo[a], a);
      const double from_high = grid.scaled(other.hi[a], a) - place[a];
      if (!(from_low >= -POSITION_TOLERANCE && from_high >= -POSITION_TOLERANCE)) return 0;
      on_face[a] = from_low < POSITION_TOLERANCE ? -1 : from_high < POSITION_TOLERANCE ? 1 : 0;
    }
    return sectors(column, on_face);
  }
};

/// Finds the contacts of one body, imposes them, or both. Item k is a column across the face.
template <int D> struct ImposeBody : Pass<D> {
  using Pass<D>::step;
  int body;
  RigidBodyOptions options;
  std::uint64_t plates;    ///< bit b: body b presses with one face and is not round
  ContactWork work;

  int items() const { return step.grid.lines_along(axis_of(options.face)); }

  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    FaceColumn<D> column;
    if (!column.find(step, body, options, k)) return;
    if (work.finds) find(column, k);
    if (!work.imposes) return;
    impose(column, step.body_velocity[body], work.balances ? 1.0 : 0.0, step.with_forces());
    // a new body held no nodes in the previous step, so the momenta before the forces do not change
    const Vec<D> &before = step.body_velocity_before[body];
    if (work.balances && !std::isnan(before[0]))
      impose(column, before, -step.flip, step.before_forces());
  }

 private:
  RVE_HD void find(const FaceColumn<D> &column, int k) const
  {
    if (column.has_pair) find_pair(column, k);
    column.each_inside(step, [&](int row, int n) {
      const auto free_of_sides = [&](int a) { return !step.held_by_side(n, a); };
      if (!column.is_lateral)
        step.mark_contacts(body, n, column.weight, free_of_sides);
      else if (column.is_round)
        find_on_round(column, n);
      else
        find_on_lateral(OpenFaces<D>(step, column, row, plates), n, column.weight);
    });
  }

  /// Finds whether the face touches the material in this column, and marks the velocity components
  /// that the contact holds.
  RVE_HD void find_pair(const FaceColumn<D> &column, int k) const
  {
    double velocity = 0.0;
    bool touches = true;
    for (int i = 0; i < 2; ++i) {
      if (!column.used[i]) continue;
      const int n = column.node[i];
      const double m = step.mass[n];
      touches = touches && m > 0.0;
      velocity += column.share[i] * step.momentum_end[n][column.normal] / m;
    }
    std::uint8_t &is_closed = step.closed[step.in_row(body, k)];
    const double entry =
        (step.body_velocity[body][column.normal] - velocity) * outward(options.face);
    if (work.how == Contact::Keep)
      touches = touches && is_closed;
    else if (options.separation)
      touches = touches && entry > 0.0;    // the face pushes the material
    is_closed = touches;
    const auto holds = [&](int a) {
      if (!touches || !(a == column.normal || options.rough)) return false;
      for (int i = 0; i < 2; ++i)
        if (column.used[i] && step.held_by_side(column.node[i], a)) return false;
      return true;
    };
    for (int i = 0; i < 2; ++i)
      if (column.used[i]) step.mark_contacts(body, column.node[i], column.weight, holds);
  }

  /// Speed at which a node moves into the body along an axis, from the side `lateral`
  /// [length/time].
  RVE_HD double entry(int n, int a, int lateral) const
  {
    return (step.momentum_end[n][a] / step.mass[n] - step.body_velocity[body][a]) * -lateral;
  }

  RVE_HD void find_on_lateral(const OpenFaces<D> &open, int n, int weight) const
  {
    int only = -1;    // axis along which the material moves into the body slowest
    double slowest = 0.0;
    for (int a = 0; a < D; ++a) {
      if (open.lateral[a] == 0 || step.held_by_side(n, a)) continue;
      const double speed = entry(n, a, open.lateral[a]);
      if (only >= 0 && !(speed < slowest)) continue;
      only = a;
      slowest = speed;
    }
    step.mark_contacts(body, n, weight, [&](int a) {
      if (!open.any) return !step.held_by_side(n, a);
      return a == only && slowest > 0.0;
    });
  }

  RVE_HD bool is_radial(const FaceColumn<D> &column, int n, int a) const
  {
    return column.from_axis[a] != 0.0 && !step.held_by_side(n, a);
  }
  RVE_HD void find_on_round(const FaceColumn<D> &column, int n) const
  {
    double inwards = 0.0;
    for (int a = 0; a < D; ++a)
      if (is_radial(column, n, a)) inwards += entry(n, a, 1) * column.from_axis[a];
    step.mark_contacts(body, n, column.weight,
                       [&](int a) { return inwards > 0.0 && is_radial(column, n, a); });
  }

  /// Sets the marked components to the velocity of the body. In a balance, `felt_share` times each
  /// impulse is added to StepView::body_impulse, the impulse of the body on nodes in this step.
  RVE_HD void impose(const FaceColumn<D> &column, const Vec<D> &velocity, double felt_share,
                     const ContactMomenta<D> &momenta) const
  {
    if (column.has_pair) impose_pair(column, velocity, felt_share, momenta);
    column.each_inside(step, [&](int, int n) {
      if (column.is_lateral && column.is_round) {
        impose_on_round(column, n, velocity, felt_share, momenta);
        return;
      }
      for (int a = 0; a < D; ++a) {
        if (step.contacts(body, n, a) == 0 || work.skips(step.is_shared(n, a))) continue;
        const double change = step.mass[n] * velocity[a] - momenta.momentum[n][a];
        give(momenta, n, a, change / step.division(n, a, column.weight), felt_share);
      }
    });
  }

  RVE_HD void impose_pair(const FaceColumn<D> &column, const Vec<D> &velocity, double felt_share,
                          const ContactMomenta<D> &momenta) const
  {
    const int outermost = column.used[1] ? column.node[1] : column.node[0];
    for (int a = 0; a < D; ++a) {
      if (step.contacts(body, outermost, a) == 0) continue;
      double at_face = 0.0, compliance = 0.0;
      bool is_shared = false;
      for (int i = 0; i < 2; ++i) {
        if (!column.used[i]) continue;
        const int n = column.node[i];
        const double m = step.mass[n], share = column.share[i];
        at_face += share * momenta.momentum[n][a] / m;
        compliance += share * share / m * step.division(n, a, column.weight);
        is_shared = is_shared || step.is_shared(n, a);
      }
      if (work.skips(is_shared)) continue;
      const double impulse = (velocity[a] - at_face) / compliance;
      if (work.balances) felt_at(outermost)[a] += felt_share * impulse;
      for (int i = 0; i < 2; ++i)
        if (column.used[i]) give(momenta, column.node[i], a, column.share[i] * impulse, 0.0);
    }
  }

  /// Stops the motion towards the axis in the directions that no side holds.
  RVE_HD void impose_on_round(const FaceColumn<D> &column, int n, const Vec<D> &velocity,
                              double felt_share, const ContactMomenta<D> &momenta) const
  {
    double entry = 0.0, free_part = 0.0;
    double division = 1.0;
    bool is_shared = false;
    for (int a = 0; a < D; ++a) {
      if (step.contacts(body, n, a) == 0) continue;
      entry -= (momenta.momentum[n][a] / step.mass[n] - velocity[a]) * column.from_axis[a];
      free_part += column.from_axis[a] * column.from_axis[a];
      is_shared = is_shared || step.is_shared(n, a);
      const double of_axis = step.division(n, a, column.weight);
      division = of_axis > division ? of_axis : division;
    }
    if (!(free_part > 0.0) || work.skips(is_shared)) return;
    for (int a = 0; a < D; ++a) {
      if (step.contacts(body, n, a) == 0) continue;
      const double change = step.mass[n] * entry / free_part * column.from_axis[a];
      give(momenta, n, a, change / division, felt_share);
    }
  }

  RVE_HD Vec<D> &felt_at(int n) const { return step.body_impulse[step.in_row(body, n)]; }
  RVE_HD void give(const ContactMomenta<D> &momenta, int n, int a, double impulse,
                   double felt_share) const
  {
    step.add_impulse(momenta, n, a, impulse);
    if (work.balances) felt_at(n)[a] += felt_share * impulse;
  }
};

}    // namespace mpm
