// SPDX-License-Identifier: GPL-2.0-only
// Contact between the material and convex rigid bodies that can turn: passes over columns of nodes
// and over bodies.
//
// The surface of a body lies between nodes. A line of nodes along an axis has a contact where it
// meets the surface, if the surface normal there is nearer to this axis than to the other axes. The
// contact acts along the true normal on the velocity interpolated at the surface, as under the face
// of a body that does not turn (face_contact.h). Edges and corners need no special treatment, since
// each line meets one face. A line has a contact only if it meets the surface at least a quarter of
// a cell inside of the other faces. Without this rule, a block that has sunk into the ground a
// little would plough the ground. Each node deeper inside the body has a contact with the nearest
// surface. The nodes of a contact take shares of its impulse, and the centre of these shares is the
// position of the contact. Body and material therefore exchange momentum and angular momentum
// without error, except for round-off.
//
// If forces drive a body, its contacts use its velocity at the end of the step:
//   1. each contact adds its effective mass to the inertia of the body (GatherContacts)
//   2. the equations of motion are solved (SolveContacts)
//   3. the contacts are imposed with the resulting velocity (ImposeContacts)
//   4. the final motion follows from the other forces and from the reaction (FinishBodies)
// The reaction is the integer sum of the impulses of the contacts.

#pragma once

#include "mpm/shared_contacts.h"

namespace mpm {

/// A contact between a body and the grid: on the surface between two nodes of a line, or at a node
/// inside the body.
template <int D> struct RigidContact {
  int count;    ///< number of nodes that take a share
  int node[2];
  double share[2];
  int slot;         ///< index of the contact's state in contact_states of the first node
  Vec<D> normal;    ///< outward normal of the body
  Vec<D> arm;       ///< position from the origin of the body [length]

  /// True if the contact can hold this component.
  RVE_HD bool acts_on(const RigidBodyOptions &options, int axis) const
  {
    return options.rough || options.friction > 0.0 || normal[axis] != 0.0;
  }
  /// Largest StepView::division() of a node over the components on which the contact acts
  /// (shared_contacts.h).
  RVE_HD double division(const StepView<D> &step, const RigidBodyOptions &options, int n) const
  {
    double most = 1.0;
    for (int a = 0; a < D; ++a) {
      const double of_axis = step.division(n, a, StepView<D>::WHOLE_CONTACT);
      if (acts_on(options, a) && of_axis > most) most = of_axis;
    }
    return most;
  }
};

/// Smallest depth inside of the other faces at which a line has a contact [cells].
constexpr double LEAST_DEPTH = 0.25;

/// Two faces enclose a tip only if the sum of their unit normals is longer than this. The normals
/// of opposite faces cancel.
constexpr double TIP = 1e-3;

/// State of a tip between two faces. Near a tip both faces would use the same nodes, so one contact
/// at the tip replaces the contacts of both faces.
enum class Tip { None, Reachable, OutOfReach };

/// Finds a tip, its normal, and its position `row` on the line [cells].
template <int axis, int D>
RVE_HD Tip find_tip(const Grid<D> &grid, const typename RigidShape<D>::Crossing &crossing,
                    Vec<D> &normal, double &row)
{
  const double cell = grid.cell_size();
  const Vec<D> both = crossing.normal[0] + crossing.normal[1];
  const double length = std::sqrt(dot(both, both));
  const bool shares_nodes =
      std::ceil(crossing.place[0] / cell) >= std::floor(crossing.place[1] / cell);
  if (!shares_nodes || !(length > TIP)) return Tip::None;
  normal = (1.0 / length) * both;
  row = 0.5 * (crossing.place[0] + crossing.place[1]) / cell;
  const double least = (LEAST_DEPTH - POSITION_TOLERANCE) * cell;
  const bool is_reachable = row > grid.first(axis) && row < grid.last(axis) &&
      !(crossing.depth[0] < least) && !(crossing.depth[1] < least);
  return is_reachable ? Tip::Reachable : Tip::OutOfReach;
}

/// Calls visit(contact) for the contacts of a body on one line of nodes along an axis, in order.
template <int axis, int D, class Visit>
RVE_HD void each_contact_along(const StepView<D> &step, const RigidBodyStep<D> &body, int column,
                               const Visit &visit)
{
  const Grid<D> &grid = step.grid;
  const double cell = grid.cell_size();
  NodeIndex<D> place;
  place[axis] = 0;
  Vec<D> point;
  point[axis] = grid.lo(axis);
  const double radius = body.shape.radius() + POSITION_TOLERANCE * cell;
  for (int a = 0, rest = column; a < D; ++a) {
    if (a == axis) continue;
    place[a] = rest % grid.nodes(a) + grid.first(a);
    rest /= grid.nodes(a);
    point[a] = grid.lo(a) + place[a] * cell;
    if (!(std::abs(point[a] - body.shape.centre[a]) <= radius)) return;
  }
  typename RigidShape<D>::Crossing crossing;
  if (!body.shape.cross(point, axis, POSITION_TOLERANCE * cell, crossing)) return;

  // nodes outside of these rows are not stored and do not influence the points of this rank
  const int first_row = grid.first(axis), last_row = grid.last(axis);
  const auto is_steepest = [&](const Vec<D> &normal) {
    for (int a = 0; a < D; ++a)
      if (a < axis ? std::abs(normal[a]) >= std::abs(normal[axis])
                   : std::abs(normal[a]) > std::abs(normal[axis]))
        return false;
    return true;
  };
  const auto node_at = [&](int row) {
    place[axis] = row;
    return grid.node(place);
  };
  const auto add_node = [&](RigidContact<D> &contact, int row, double share) {
    contact.node[contact.count] = node_at(row);
    contact.share[contact.count] = share;
    ++contact.count;
    Vec<D> arm = point - body.origin;
    arm[axis] += row * cell;
    contact.arm = contact.arm + share * arm;
  };

  if (body.shape.form == BodyForm::Convex && is_steepest(crossing.normal[0]) &&
      is_steepest(crossing.normal[1])) {
    Vec<D> normal;
    double row;
    const Tip tip = find_tip<axis>(step.grid, crossing, normal, row);
    if (tip == Tip::Reachable) {
      RigidContact<D> contact = {0, {}, {}, 2 * axis, normal, Vec<D>::zero()};
      const int first = static_cast<int>(std::floor(row));
      double share = row - first;
      if (step.shape == ShapeFunction::Linear) share = share < 0.5 ? 0.0 : 1.0;
      if (1.0 - share > POSITION_TOLERANCE) add_node(contact, first, 1.0 - share);
      if (share > POSITION_TOLERANCE) add_node(contact, first + 1, share);
      visit(contact);
    }
    if (tip != Tip::None) return;
  }

  int inside[2];    // first and last row of the inner nodes that are in no contact on the surface
  for (int end = 0; end < 2; ++end) {
    const double face = clamped(crossing.place[end] / cell, first_row - 2.0, last_row + 2.0);
    const int inwards = end == 0 ? 1 : -1;
    const int inner = static_cast<int>(end == 0 ? std::ceil(face) : std::floor(face));
    inside[end] = inner;
    if (!is_steepest(crossing.normal[end])) continue;
    if (crossing.depth[end] < (LEAST_DEPTH - POSITION_TOLERANCE) * cell) {
      inside[end] = inner + inwards;
      continue;
    }
    double outer_share = std::abs(inner - face);
    if (step.shape == ShapeFunction::Linear) outer_share = outer_share < 0.5 ? 0.0 : 1.0;
    const double share[2] = {1.0 - outer_share, outer_share};
    RigidContact<D> contact = {0, {}, {}, 2 * axis + end, crossing.normal[end], Vec<D>::zero()};
    bool reachable = true;
    for (int k = 0; k < 2; ++k) {
      if (!(share[k] > POSITION_TOLERANCE)) continue;
      const int row = inner - k * inwards;
      if (row < first_row || row > last_row) {
        reachable = false;
        break;
      }
      add_node(contact, row, share[k]);
      if (k == 0) inside[end] = inner + inwards;
    }
    if (reachable) visit(contact);
  }
  const int first = inside[0] < first_row ? first_row : inside[0];
  const int last = inside[1] > last_row ? last_row : inside[1];
  for (int row = first; row <= last; ++row) {
    Vec<D> here = point;
    here[axis] += row * cell;
    const Vec<D> normal = body.shape.normal_at(here);
    if (!is_steepest(normal)) continue;
    RigidContact<D> contact = {0, {}, {}, 2 * D, normal, Vec<D>::zero()};
    add_node(contact, row, 1.0);
    visit(contact);
  }
}

/// Calls visit(contact) for the contacts of a body on one line of nodes along an axis. The axis is
/// a template argument, since nvcc 13.0 generates wrong device code for a variable axis.
template <int D, class Visit>
RVE_HD void each_contact(const StepView<D> &step, const RigidBodyStep<D> &body, int axis,
                         int column, const Visit &visit)
{
  if (axis == 0)
    each_contact_along<0>(step, body, column, visit);
  else if (D == 2 || axis == 1)
    each_contact_along<1>(step, body, column, visit);
  else
    each_contact_along<D - 1>(step, body, column, visit);
}

/// State of a contact. Slides: only friction changes the velocity of the material along the
/// surface.
enum class Touch { Open, Slides, Sticks };

/// Relative motion of body and material at a contact.
template <int D> struct RigidContactMotion {
  /// Effective mass: impulse per change of the velocity of the material at the contact [mass].
  double mass = 0.0;
  Vec<D> normal;    ///< unit vector; components that sides of the grid hold are zero
  /// Velocity of the body relative to the material, now and before the forces [length/time].
  Vec<D> approach, approach_before;
  bool is_held[D] = {};    ///< components that a side of the grid holds

  /// Returns false if a node has no mass or the sides of the grid hold the normal direction.
  RVE_HD bool find(const StepView<D> &step, const RigidBodyStep<D> &body,
                   const RigidContact<D> &contact, const RigidBodyOptions &options,
                   const Vec<D> *now, const Vec<D> *before)
  {
    double compliance = 0.0;
    Vec<D> velocity = Vec<D>::zero(), velocity_before = Vec<D>::zero();
    for (int k = 0; k < contact.count; ++k) {
      const int n = contact.node[k];
      const double m = step.mass[n];
      if (!(m > 0.0)) return false;
      compliance += contact.share[k] * contact.share[k] / m * contact.division(step, options, n);
      velocity = velocity + (contact.share[k] / m) * now[n];
      if (before) velocity_before = velocity_before + (contact.share[k] / m) * before[n];
      for (int a = 0; a < D; ++a) is_held[a] = is_held[a] || step.held_by_side(n, a);
    }
    mass = 1.0 / compliance;
    approach = freed(velocity_at(body.now, contact.arm) - velocity);
    approach_before = before && !body.is_new
        ? freed(velocity_at(body.before, contact.arm) - velocity_before)
        : Vec<D>::zero();
    normal = freed(contact.normal);
    const double length = std::sqrt(dot(normal, normal));
    if (!(length > POSITION_TOLERANCE)) return false;    // the body is cut by a symmetry plane
    normal = (1.0 / length) * normal;
    return true;
  }

  /// Returns a vector without the components that sides hold.
  RVE_HD Vec<D> freed(Vec<D> vector) const
  {
    for (int a = 0; a < D; ++a)
      if (is_held[a]) vector[a] = 0.0;
    return vector;
  }

  /// Normal impulse on the body, at least 0 [mass length/time].
  RVE_HD double normal_felt(double flip) const
  {
    const double felt = mass * (dot(approach, normal) - flip * dot(approach_before, normal));
    return felt > 0.0 ? felt : 0.0;
  }
  /// Unit vector of the velocity of the body relative to the material along the surface, or zero.
  RVE_HD Vec<D> slip() const
  {
    const Vec<D> along = approach - dot(approach, normal) * normal;
    const double speed = std::sqrt(dot(along, along));
    return speed > 0.0 ? (1.0 / speed) * along : Vec<D>::zero();
  }
  RVE_HD Touch touch(const RigidBodyOptions &options, double flip) const
  {
    const double closing = dot(approach, normal);
    const bool separates = options.separation || options.friction > 0.0;
    if (separates && !(closing > 0.0)) return Touch::Open;
    if (options.rough) return Touch::Sticks;
    if (!(options.friction > 0.0)) return Touch::Slides;
    const Vec<D> along = approach - closing * normal;
    return mass * std::sqrt(dot(along, along)) <= options.friction * normal_felt(flip)
        ? Touch::Sticks
        : Touch::Slides;
  }
};

/// Scales of the sums over contacts of one body. No bound of the terms is known in advance, since
/// nodes with little mass move fast. The sums therefore have capacity for terms that are a million
/// times larger than those of points. A second, fine sum of impulses keeps the digits that the
/// first sum rounds off.
template <int D> struct ContactScales {
  static constexpr double ROOM = 0x1p20;
  rve::FixedScale mass, coarse, fine;
  double mass_limit = 0.0, momentum_limit = 0.0;

  RVE_HD ContactScales(const StepView<D> &step, const RigidBodyStep<D> &body)
  {
    double speed = 0.0;
    for (int k = 0; k < FREEDOMS<D>; ++k) {
      const double arm = k < D ? 1.0 : body.reach;
      const double now = arm * std::abs(body.now[k]), before = arm * std::abs(body.before[k]);
      speed = now > speed ? now : speed;
      speed = before > speed ? before : speed;
    }
    const double point_mass = step.maximum[MassBound];
    mass_limit = ROOM * point_mass;
    momentum_limit =
        ROOM * (step.maximum[MomentumBound] + step.dt * step.force_bound() + point_mass * speed);
    mass = rve::FixedScale(mass_limit, body.terms);
    coarse = rve::FixedScale(momentum_limit, body.terms);
    fine = rve::FixedScale(coarse.unit(), body.terms);
  }
};

/// Base class of passes over contacts. Item k is a line of nodes along `axis`.
template <int D> struct ContactPass : Pass<D> {
  using Pass<D>::step;
  int index;    ///< index of the body in step.rigid
  int axis;
  RigidBodyOptions options;

  int items() const { return step.grid.lines_along(axis); }

 protected:
  /// True if this rank counts a contact in sums over ranks. Only the first rank that touches the
  /// first node of the contact counts it.
  RVE_HD bool counts(const RigidContact<D> &contact) const
  {
    if (!step.shares_grid) return true;
    const int node = contact.node[0];
    if (!step.touched.contains(step.grid, node)) return false;
    for (int k = 0; k < step.num_lower; ++k)
      if (step.lower_touched[k].contains(step.grid, node)) return false;
    return true;
  }
  /// Returns unit_motion() with the lever arm of rotations in units of `reach`.
  static RVE_HD Vec<D> scaled_motion(const RigidBodyStep<D> &body, int freedom, const Vec<D> &arm)
  {
    return unit_motion(freedom, freedom < D ? arm : (1.0 / body.reach) * arm);
  }
};

/// Sums the contributions of contacts to the inertia and momentum of a body that forces drive.
template <int D> struct GatherContacts : ContactPass<D> {
  using Pass<D>::step;

  template <class Tally> RVE_HD void operator()(int column, Tally &tally) const
  {
    constexpr int S = FREEDOMS<D>;
    RigidBodyStep<D> &body = step.rigid[this->index];
    const ContactScales<D> scales(step, body);
    each_contact(step, body, this->axis, column, [&](const RigidContact<D> &contact) {
      if (!this->counts(contact)) return;
      RigidContactMotion<D> motion;
      if (!motion.find(step, body, contact, this->options, step.momentum_end, step.momentum))
        return;
      const Touch touch = motion.touch(this->options, step.flip);
      if (touch == Touch::Open) return;
      // answer(v) is the impulse on the material if the body has the velocity v relative to it;
      // `rest` is this relative velocity without the contribution of body.now
      const Vec<D> rest = motion.approach - step.flip * motion.approach_before -
          motion.freed(velocity_at(body.now, contact.arm));
      const Vec<D> pushed =
          motion.normal + (touch == Touch::Slides ? this->options.friction : 0.0) * motion.slip();
      const auto answer = [&](const Vec<D> &velocity) {
        return touch == Touch::Sticks ? motion.mass * motion.freed(velocity)
                                      : (motion.mass * dot(velocity, motion.normal)) * pushed;
      };
      for (int i = 0; i < S; ++i) {
        const Vec<D> own = this->scaled_motion(body, i, contact.arm);
        const double part = -dot(own, answer(rest));
        tally.raise(ContactBound, std::abs(part) / scales.momentum_limit);
        tally.add(body.target + i, scales.coarse.integer(part));
        for (int j = 0; j < S; ++j) {
          const double more = dot(own, answer(this->scaled_motion(body, j, contact.arm)));
          tally.raise(ContactBound, std::abs(more) / scales.mass_limit);
          tally.add(body.stiffness + S * i + j, scales.mass.integer(more));
        }
      }
    });
  }
};

/// Finds the rates that satisfy the contacts of one body. The pass has one item.
template <int D> struct SolveContacts : Pass<D> {
  using Pass<D>::step;
  int index;

  int items() const { return 1; }
  template <class Tally> RVE_HD void operator()(int, Tally &) const
  {
    constexpr int S = FREEDOMS<D>;
    RigidBodyStep<D> &body = step.rigid[index];
    const ContactScales<D> scales(step, body);
    double matrix[S * S], right[S];
    const auto arm = [&](int k) { return k < D ? 1.0 : body.reach; };
    for (int i = 0; i < S; ++i) {
      right[i] = body.impulse[i] + arm(i) * scales.coarse.real(body.target[i]);
      for (int j = 0; j < S; ++j)
        matrix[S * i + j] =
            body.inertia[S * i + j] + arm(i) * arm(j) * scales.mass.real(body.stiffness[S * i + j]);
    }
    solve_free<D>(matrix, right, body.free, body.now);
  }
};

/// Marks the nodes on which contacts can act, before nodes are divided among bodies.
template <int D> struct FindContacts : ContactPass<D> {
  using Pass<D>::step;

  template <class Tally> RVE_HD void operator()(int column, Tally &) const
  {
    const RigidBodyStep<D> &body = step.rigid[this->index];
    each_contact(step, body, this->axis, column, [&](const RigidContact<D> &contact) {
      for (int k = 0; k < contact.count; ++k)
        if (!(step.mass[contact.node[k]] > 0.0)) return;
      for (int k = 0; k < contact.count; ++k) {
        std::uint16_t &marks = step.contacts_at(body.body, contact.node[k]);
        for (int a = 0; a < D; ++a)
          if (contact.acts_on(this->options, a) &&
              (marks >> 4 * a & 15) + StepView<D>::WHOLE_CONTACT < 16)
            marks = static_cast<std::uint16_t>(marks + (StepView<D>::WHOLE_CONTACT << 4 * a));
      }
    });
  }
};

/// Imposes the contacts. In a balance it changes both the momenta with the forces and the momenta
/// before the forces, and sums the impulse on the body.
template <int D> struct ImposeContacts : ContactPass<D> {
  using Pass<D>::step;
  ContactWork work;

  template <class Tally> RVE_HD void operator()(int column, Tally &tally) const
  {
    RigidBodyStep<D> &body = step.rigid[this->index];
    const ContactScales<D> scales(step, body);
    std::uint16_t *states = step.contact_states + step.in_row(this->index, 0);
    each_contact(step, body, this->axis, column, [&](const RigidContact<D> &contact) {
      bool is_shared = false;
      for (int k = 0; k < contact.count; ++k)
        is_shared = is_shared || contact.division(step, this->options, contact.node[k]) > 1.0;
      if (work.skips(is_shared)) return;
      std::uint16_t &state = states[contact.node[0]];
      const int bit = 2 * contact.slot;
      RigidContactMotion<D> motion;
      Touch touch = Touch::Open;
      if (motion.find(step, body, contact, this->options, step.momentum_end,
                      work.balances ? step.momentum : nullptr))
        touch = work.how == Contact::Find ? motion.touch(this->options, step.flip)
                                          : static_cast<Touch>(state >> bit & 3);
      state = static_cast<std::uint16_t>((state & ~(3 << bit)) | static_cast<int>(touch) << bit);
      if (touch == Touch::Open) return;

      const auto held_part = [&](const Vec<D> &velocity) {
        return motion.mass *
            (touch == Touch::Sticks ? velocity : dot(velocity, motion.normal) * motion.normal);
      };
      Vec<D> impulse = held_part(motion.approach);
      // friction acts as a force in the balance only; momenta for strains already contain it
      if (work.balances && touch == Touch::Slides && this->options.friction > 0.0)
        impulse =
            impulse + (this->options.friction * motion.normal_felt(step.flip)) * motion.slip();
      const Vec<D> impulse_before = held_part(motion.approach_before);
      for (int k = 0; k < contact.count; ++k) {
        const int n = contact.node[k];
        for (int a = 0; a < D; ++a) {
          step.add_impulse(step.with_forces(), n, a, contact.share[k] * impulse[a]);
          if (work.balances)
            step.add_impulse(step.before_forces(), n, a, contact.share[k] * impulse_before[a]);
        }
        for (int a = 0; a < D; ++a)
          if (!motion.is_held[a] && (touch == Touch::Sticks || motion.normal[a] != 0.0))
            step.on_body[n] = static_cast<std::uint8_t>(step.on_body[n] | 1 << a);
      }
      if (!work.balances || !this->counts(contact)) return;
      const Vec<D> felt = step.flip * impulse_before - impulse;
      for (int i = 0; i < FREEDOMS<D>; ++i) {
        const double part = dot(felt, this->scaled_motion(body, i, contact.arm));
        tally.raise(ContactBound, std::abs(part) / scales.momentum_limit);
        const std::int64_t coarse = scales.coarse.integer(part);
        tally.add(body.felt_coarse + i, coarse);
        tally.add(body.felt_fine + i, scales.fine.integer(part - scales.coarse.real(coarse)));
      }
    });
  }
};

/// Finds the motion of bodies from the impulses on them. Item k is the k-th body that can turn.
template <int D> struct FinishBodies : Pass<D> {
  using Pass<D>::step;

  int items() const { return step.num_rigid; }
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    constexpr int S = FREEDOMS<D>;
    RigidBodyStep<D> &body = step.rigid[k];
    const ContactScales<D> scales(step, body);
    double right[S];
    for (int i = 0; i < S; ++i) {
      body.felt[i] = (i < D ? 1.0 : body.reach) *
          (scales.coarse.real(body.felt_coarse[i]) + scales.fine.real(body.felt_fine[i]));
      right[i] = body.impulse[i] + body.felt[i];
    }
    solve_free<D>(body.inertia, right, body.free, body.now);
    // local damping acts as on nodes (NodeBalance)
    for (int i = 0; i < S; ++i) {
      if (!(body.free >> i & 1)) continue;
      const double direction = double(body.before[i] > 0.0) - double(body.before[i] < 0.0);
      body.now[i] -= step.damping * std::abs(body.now[i] - body.before[i]) * direction;
    }
  }
};

/// Copies the contact sums of one body, or the impulses on all bodies, to or from a buffer that
/// ranks exchange. Item k is a sum.
template <int D> struct MoveContactSums : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  int index;    ///< body whose contact sums are copied; -1: the impulses on all bodies
  bool packs;
  std::int64_t *buffer;
  int count;

  static constexpr int OF_ONE = FREEDOMS<D> * (FREEDOMS<D> + 1);
  static constexpr int FELT = 2 * FREEDOMS<D>;

  int items() const { return count; }
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    constexpr int S = FREEDOMS<D>;
    std::int64_t *sum;
    if (index >= 0) {
      RigidBodyStep<D> &body = step.rigid[index];
      sum = k < S * S ? body.stiffness + k : body.target + (k - S * S);
    } else {
      RigidBodyStep<D> &body = step.rigid[k / FELT];
      const int i = k % FELT;
      sum = i < S ? body.felt_coarse + i : body.felt_fine + (i - S);
    }
    if (packs)
      buffer[k] = *sum;
    else
      *sum = buffer[k];
  }
};

}    // namespace mpm
