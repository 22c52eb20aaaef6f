// SPDX-License-Identifier: GPL-2.0-only
// What the passes of a time step work on: pointers into the memory of the host or of a device, and the tally that passes over
// points leave behind.

#pragma once

#include "mpm/boundary.h"
#include "mpm/grid_transfer.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace mpm {

/// What is wrong with a point; `describe` has the words.
enum class Trouble {
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
struct FirstTrouble {
  static constexpr std::uint64_t NOWHERE = std::numeric_limits<std::uint64_t>::max();
  static RVE_HD std::uint64_t key(int point, Trouble trouble)
  {
    return static_cast<std::uint64_t>(point) << 8 | static_cast<std::uint64_t>(trouble);
  }
  static int point(std::uint64_t key) { return static_cast<int>(key >> 8); }
  static Trouble trouble(std::uint64_t key) { return static_cast<Trouble>(key & 255); }
};

/// One traction vector on one face of a point's box.
template <int D> struct PointLoad {
  int point;
  int load;    ///< index of its TractionLoad
  Face face;
  bool follows;
  Vec<D> traction;    ///< [stress]
};

/// The nodes with dashpots, and what they take. Beside the view, of which every pass has a copy: most scenes have none.
template <int D> struct Absorbers {
  const AbsorbingNode<D> *nodes = nullptr;
  int count = 0;
  /// Per axis and node: to the side across that axis [mass length/time].
  Vec<D> *impulse = nullptr;
};

/// Momenta that contacts change, and the impulses on divided nodes that are not added yet.
template <int D> struct ContactMomenta {
  Vec<D> *momentum, *gathered;
};

template <int D> struct StepView {
  /// Without any array.
  StepView(const Grid<D> &grid_in, const SolverOptions<D> &options, bool shares_grid_in) :
      grid(grid_in), shape(options.shape), flip(options.flip), damping(options.damping),
      thickness(options.thickness),
      mean_dilation(options.mean_dilation), boundary{grid_in, options.shape},
      num_bodies(static_cast<int>(options.rigid_bodies.size())), num_rigid(options.num_turning()),
      shares_grid(shares_grid_in)
  {
  }

  Grid<D> grid;    ///< the part that this rank holds
  ShapeFunction shape;
  double flip, damping, thickness;
  bool mean_dilation;    ///< then there are boxes of points and means of cells
  double dt = 0.0;
  BoundaryView<D> boundary;
  int num_bodies, num_models = 0, num_loads = 0;
  int num_rigid;    ///< of the bodies, those that can turn
  /// Bodies can hold the same nodes in this step, which are divided then. Without it they are imposed one by one, to the same bits.
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

  // per node
  std::int64_t *inertia_sums = nullptr;    ///< mass, momentum
  std::int64_t *vector_sums = nullptr;     ///< forces; momentum of the second extrapolation
  double *mass = nullptr;                  ///< [mass]
  Vec<D> *momentum = nullptr;              ///< at the start of the step [mass length/time]
  Vec<D> *momentum_end = nullptr;
  Vec<D> *damping_impulse = nullptr;    ///< what damping added to the momentum [mass length/time]
  Vec<D> *force = nullptr;              ///< [force]
  Vec<D> *velocity = nullptr;           ///< that the points see next [length/time]
  Vec<D> *velocity_change = nullptr;    ///< [length/time]
  double *cell_mean = nullptr;          ///< of the cell above the node, if mean_dilation
  /// Per body and node: weight of its contacts on each component, four bits a component.
  std::uint16_t *contacts_of_body = nullptr;
  // where there are several bodies
  /// Per node: sum of the weights of contacts that divide it (shared_contacts.h), eight bits a
  /// component; 0: it is not divided.
  std::uint32_t *parts = nullptr;
  Vec<D> *gathered_end = nullptr, *gathered = nullptr;    ///< for momentum_end and momentum

  RVE_HD bool follows() const { return shape == ShapeFunction::Cpgimp; }
  RVE_HD bool has_boxes() const { return follows() || mean_dilation; }

  RVE_HD int load_maximum(int load) const { return NUM_MAXIMA + load; }
  RVE_HD int body_maximum(int body) const { return NUM_MAXIMA + num_loads + FACES<D> * body; }
  RVE_HD int num_maxima() const { return body_maximum(num_bodies); }

  RVE_HD rve::FixedScale mass_scale() const { return {maximum[MassBound], point_total}; }
  RVE_HD rve::FixedScale momentum_scale() const { return {maximum[MomentumBound], point_total}; }
  RVE_HD rve::FixedScale momentum_again_scale() const
  {
    return {maximum[MomentumAgainBound], point_total};
  }
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

  RVE_HD bool has_several_bodies() const { return num_bodies > 1; }
  RVE_HD std::uint16_t &contacts_at(int body, int n) const
  {
    return contacts_of_body[static_cast<std::size_t>(body) * grid.node_count() + n];
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
    boundary.on_body[n] = static_cast<std::uint8_t>(boundary.on_body[n] | bits);
  }
  RVE_HD void forget_contacts(int n) const
  {
    boundary.on_body[n] = 0;
    for (int b = 0; b < num_bodies; ++b) contacts_at(b, n) = 0;
  }
  RVE_HD bool is_shared(int n, int axis) const
  {
    return divides_nodes && (parts[n] >> 8 * axis & 255) != 0;
  }
  /// Weight of a contact that has the whole surroundings of a node: the sectors along its face.
  static constexpr int WHOLE_CONTACT = 1 << (D - 1);
  /// Mass of a node over the part that a contact with this weight acts on.
  RVE_HD double division(int n, int axis, int weight) const
  {
    return is_shared(n, axis) ? static_cast<double>(parts[n] >> 8 * axis & 255) / weight : 1.0;
  }
  RVE_HD ContactMomenta<D> with_forces() const { return {momentum_end, gathered_end}; }
  RVE_HD ContactMomenta<D> before_forces() const { return {momentum, gathered}; }
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

/// What all passes have. A thread calls begin() on a copy of its own before its items.
template <int D> struct Pass {
  /// Trouble of a lower stage is told first; points that have trouble in stage 0 have no weights.
  static constexpr int STAGE = 1;
  StepView<D> step;
  RVE_HD void begin() {}
};

}    // namespace mpm
