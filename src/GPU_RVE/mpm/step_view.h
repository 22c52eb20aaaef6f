// SPDX-License-Identifier: GPL-2.0-only
// What the passes of a time step work on: pointers into the memory of the host or of a device, and the tally that passes over
// points leave behind.

#pragma once

#include "mpm/boundary.h"
#include "mpm/grid_transfer.h"
#include "mpm/node_fields.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace mpm {

/// What is wrong with a point; `describe` has the words.
enum class ErrorCode {
  None,
  Position,
  Outside,
  Velocity,
  Stress,
  HalfSize,
  UnknownBody,
  UnknownModel,
  Mass,
  Volume,
  BodyForce,
  RigidTraction,
  Traction,
  Inverted
};

/// Largest values that are known after a pass. The first are those of deformable points or of nodes; then one per load, and
/// those of each body: its low sides with the sign changed, then its high ones. Zeros are positive.
enum Maximum {
  MassBound,
  MomentumBound,
  MomentumAgainBound,
  Unbalanced,
  /// Of the terms of contacts with bodies that can turn, over what their sums have room for.
  ContactBound,
  /// Half size of boxes that follow the deformation, after strains; of this rank [cells].
  BoxBound,
  DilationBound,    ///< |tr L| [1/time]
  VolumeBound,      ///< of a point [length³]
  PressureBound,    ///< |tr σ / D| [stress]
  ForceBound,       ///< those of loads follow
  NUM_MAXIMA
};

/// Of the first point with trouble: lower ones come first. 64 bits, so that threads of a device can take the least.
struct PointErrorKey {
  static constexpr std::uint64_t NO_ERROR = std::numeric_limits<std::uint64_t>::max();
  static RVE_HD std::uint64_t key(int point, ErrorCode code)
  {
    return static_cast<std::uint64_t>(point) << 8 | static_cast<std::uint64_t>(code);
  }
  static int point(std::uint64_t key) { return static_cast<int>(key >> 8); }
  static ErrorCode code(std::uint64_t key) { return static_cast<ErrorCode>(key & 255); }
};

/// One traction vector on one face of a point's box.
template <int D> struct PointLoad {
  int point;
  int load;    ///< index of its TractionLoad
  Face face;
  bool follows;
  Vec<D> traction;    ///< [stress]
};

/// Momenta that contacts change, and the impulses on divided nodes that are not added yet.
template <int D> struct ContactMomenta {
  Vec<D> *momentum, *gathered;
};

/// What the passes of a step see. A step has no arrays before a machine gives it some.
template <int D> struct StepView : NodeFields<D, Pointer> {
  StepView(const Grid<D> &grid_in, const SolverOptions<D> &options, bool shares_grid_in) :
      grid(grid_in), shape(options.shape), flip(options.flip), damping(options.damping),
      thickness(options.thickness), mean_dilation(options.mean_dilation),
      absorbs(options.absorbs()), num_bodies(static_cast<int>(options.rigid_bodies.size())),
      num_rigid(options.num_turning()), shares_grid(shares_grid_in)
  {
  }

  Grid<D> grid;    ///< the part that this rank holds
  ShapeFunction shape;
  double flip, damping, thickness;
  bool mean_dilation;    ///< then there are boxes of points and means of cells
  bool absorbs;          ///< some sides have dashpots
  double dt = 0.0;
  int num_bodies, num_models = 0, num_loads = 0;
  int num_rigid;    ///< of the bodies, those that can turn
  /// Bodies can hold the same nodes in this step, which are divided then. Without it they are
  /// imposed one by one, to the same bits.
  bool divides_nodes = false;
  RigidBodyStep<D> *rigid = nullptr;
  const Vec<D> *body_velocity = nullptr;    ///< per rigid body [length/time]
  /// In the step before; not a number: there was none.
  const Vec<D> *body_velocity_before = nullptr;
  std::int64_t point_total = 0;    ///< deformable points of all ranks
  bool shares_grid;                ///< with other ranks
  /// If it shares the grid: the nodes that this rank's points reach, where it knows everything.
  NodeBox<D> touched;
  const NodeBox<D> *lower_touched = nullptr;    ///< the same of each rank before this one
  int num_lower = 0;
  const double *maximum = nullptr;    ///< by Maximum, and on; of all ranks

  PointView<D> points;
  Support<D> *support = nullptr;          ///< per point
  PointBox<D> *box = nullptr;             ///< per point, if has_boxes()
  Tensor<D> *increment = nullptr;         ///< per point: ΔF
  const PointLoad<D> *loads = nullptr;    ///< of this rank
  int num_point_loads = 0;

  std::int64_t *sums[NUM_SUM_KINDS] = {};    ///< in all_sums, per node
  const std::uint8_t *sides = nullptr;       ///< per node: SideBits
  const AbsorbingNode<D> *absorbing = nullptr;
  int num_absorbing = 0;

  RVE_HD bool follows() const { return shape == ShapeFunction::Cpgimp; }
  RVE_HD bool has_boxes() const { return follows() || mean_dilation; }

  RVE_HD int load_maximum(int load) const { return NUM_MAXIMA + load; }
  RVE_HD int body_maximum(int body) const { return NUM_MAXIMA + num_loads + FACES<D> * body; }
  RVE_HD int num_maxima() const { return body_maximum(num_bodies); }

  /// For sums over all points with this bound.
  RVE_HD rve::FixedScale scale(Maximum bound) const { return {maximum[bound], point_total}; }
  /// Bound of all forces that a point can put on a node [force].
  RVE_HD double force_bound() const
  {
    double bound = maximum[ForceBound];
    // a point can get the mean pressure of its neighbours
    if (mean_dilation) bound += maximum[VolumeBound] * maximum[PressureBound] / grid.cell_size();
    for (int k = 0; k < num_loads; ++k) bound += maximum[load_maximum(k)];
    return bound;
  }
  RVE_HD rve::FixedScale force_scale() const { return {force_bound(), point_total}; }

  RVE_HD const std::int64_t *sums_at(SumKind kind, int n) const
  {
    return sums[kind] + width_of<D>(kind) * static_cast<std::size_t>(n);
  }
  /// Index of a node in a field with several rows of nodes, per body or axis.
  RVE_HD std::size_t in_row(int row, int n) const
  {
    return static_cast<std::size_t>(row) * grid.node_count() + n;
  }

  RVE_HD bool held_by_side(int n, int axis) const
  {
    return (sides[n] & (SideBits::across(axis) | SideBits::FIXED_ACROSS_ANY)) != 0;
  }
  /// Whether the last conditions that were imposed had one on this component of the velocity.
  RVE_HD bool constrains(int n, int axis) const
  {
    return held_by_side(n, axis) || (this->on_body[n] >> axis & 1) != 0;
  }
  /// Takes from the momentum [mass length/time] of a node what the sides hold.
  RVE_HD void impose_sides(int n, Vec<D> &momentum) const
  {
    for (int a = 0; sides[n] != 0 && a < D; ++a)
      if (held_by_side(n, a)) momentum[a] = 0.0;
  }
  /// The same for the two momenta of a balance, with and before the forces; the impulse is recorded.
  RVE_HD void balance_sides(int n, Vec<D> &with_forces, Vec<D> &before) const
  {
    const int kinds = sides[n];
    if (kinds == 0) return;
    for (int axis = 0; axis < D; ++axis) {
      if (!(kinds & SideBits::across(axis))) continue;
      const bool fixed = (kinds & SideBits::fixed_across(axis)) != 0;
      Vec<D> felt = Vec<D>::zero();
      for (int a = 0; a < D; ++a) {
        if (a != axis && !fixed) continue;
        felt[a] = with_forces[a] - flip * before[a];
        with_forces[a] = before[a] = 0.0;
      }
      this->side_impulse[in_row(axis, n)] = felt;
    }
  }

  RVE_HD bool has_several_bodies() const { return num_bodies > 1; }
  RVE_HD std::uint16_t &contacts_at(int body, int n) const
  {
    return this->contacts_of_body[in_row(body, n)];
  }
  RVE_HD int contacts(int body, int n, int axis) const
  {
    return contacts_at(body, n) >> 4 * axis & 15;
  }
  /// Marks the components of a node that the only contact of a body there holds.
  template <class Holds>
  RVE_HD void mark_contacts(int body, int n, int weight, const Holds &holds) const
  {
    int marks = 0, bits = 0;
    for (int a = 0; a < D; ++a) {
      if (!holds(a)) continue;
      marks |= weight << 4 * a;
      bits |= 1 << a;
    }
    contacts_at(body, n) = static_cast<std::uint16_t>(marks);
    this->on_body[n] = static_cast<std::uint8_t>(this->on_body[n] | bits);
  }
  RVE_HD void forget_contacts(int n) const
  {
    this->on_body[n] = 0;
    for (int b = 0; b < num_bodies; ++b) contacts_at(b, n) = 0;
  }
  RVE_HD bool is_shared(int n, int axis) const
  {
    return divides_nodes && (this->parts[n] >> 8 * axis & 255) != 0;
  }
  /// Weight of a contact that has the whole surroundings of a node: the sectors along its face.
  static constexpr int WHOLE_CONTACT = 1 << (D - 1);
  /// Mass of a node over the part that a contact with this weight acts on.
  RVE_HD double division(int n, int axis, int weight) const
  {
    return is_shared(n, axis) ? static_cast<double>(this->parts[n] >> 8 * axis & 255) / weight
                              : 1.0;
  }
  RVE_HD ContactMomenta<D> with_forces() const { return {this->momentum_end, this->gathered_end}; }
  RVE_HD ContactMomenta<D> before_forces() const { return {this->momentum, this->gathered}; }
  RVE_HD void add_impulse(const ContactMomenta<D> &momenta, int n, int axis, double impulse) const
  {
    (is_shared(n, axis) ? momenta.gathered : momenta.momentum)[n][axis] += impulse;
  }

  RVE_HD RigidBodyState<D> body(int b) const
  {
    const double *extent = maximum + body_maximum(b);
    RigidBodyState<D> state;
    for (int a = 0; a < D; ++a) {
      state.lo[a] = -extent[a];
      state.hi[a] = extent[D + a];
    }
    state.velocity = body_velocity[b];
    return state;
  }
};

/// Of passes, by which the first point with trouble is found.
constexpr int NUM_STAGES = 3;

/// What all passes have. A thread calls begin() on a copy of its own before its items.
template <int D> struct Pass {
  /// Trouble of a lower stage is reported first; points with trouble in stage 0 have no weights.
  static constexpr int STAGE = 1;
  static constexpr bool OVER_POINTS = false;
  StepView<D> step;
  RVE_HD void begin() {}
};

template <int D> struct PointPass : Pass<D> {
  static constexpr bool OVER_POINTS = true;
  int items() const { return this->step.points.count; }
};
template <int D> struct NodePass : Pass<D> {
  int items() const { return this->step.grid.node_count(); }
};
/// Item k is the k-th load of a point.
template <int D> struct LoadPass : Pass<D> {
  int items() const { return this->step.num_point_loads; }
};

}    // namespace mpm
