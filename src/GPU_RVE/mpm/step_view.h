// SPDX-License-Identifier: GPL-2.0-only
// Data of the passes of a time step: pointers into the memory of the host or of a device, maxima,
// and error codes of points.

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

/// Error of a point; throw_point_error() has the messages.
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
  Inverted,
  Radius,
  Porosity,
  Dry
};

/// Indices of the maxima that passes find. Maxima over deformable points or nodes come first, then
/// one maximum per load, then 2 D maxima per body: its low coordinates with the opposite sign, and
/// its high coordinates. Zeros are positive.
enum Maximum {
  MassBound,
  MomentumBound,
  MomentumAgainBound,
  Unbalanced,
  /// Largest term of contacts with bodies that can turn, relative to the capacity of their sums.
  ContactBound,
  /// Half size of a box that follows the deformation, after the strains of the step [cells]. This
  /// maximum is over this rank only.
  BoxBound,
  DilationBound,    ///< |tr L| [1/time]
  VolumeBound,      ///< volume of a point, of a ring at r < h times h/r [length³]
  /// |tr σ / D|; with water that flows, |p| plus its weight over the height of a cell [stress].
  PressureBound,
  ForceBound,    ///< force of a point on a node [force]; last, since the bounds of loads follow
  NUM_MAXIMA
};

/// Key of a point with an error. Keys have the order of the points. They have 64 bits, so that
/// threads of a device can find the lowest key atomically.
struct PointErrorKey {
  static constexpr std::uint64_t NO_ERROR = std::numeric_limits<std::uint64_t>::max();
  static RVE_HD std::uint64_t key(int point, ErrorCode code)
  {
    return static_cast<std::uint64_t>(point) << 8 | static_cast<std::uint64_t>(code);
  }
  static int point(std::uint64_t key) { return static_cast<int>(key >> 8); }
  static ErrorCode code(std::uint64_t key) { return static_cast<ErrorCode>(key & 255); }
};

/// A traction vector on one face of a point's box.
template <int D> struct PointLoad {
  int point;
  int load;    ///< index of the TractionLoad
  Face face;
  bool follows;
  Vec<D> traction;    ///< [stress]
};

/// Momenta that contacts change, and impulses on divided nodes that have not been added to the
/// momenta yet.
template <int D> struct ContactMomenta {
  Vec<D> *momentum, *gathered;
};

/// Data of the passes of a step. A machine sets the pointers.
template <int D> struct StepView : NodeFields<D, Pointer> {
  StepView(const Grid<D> &grid_in, const SolverOptions<D> &options, bool shares_grid_in) :
      grid(grid_in), shape(options.shape), flip(options.flip), damping(options.damping),
      thickness(options.thickness), axisymmetric(options.axisymmetric),
      mean_dilation(options.mean_dilation), water(options.water), absorbs(options.absorbs()),
      num_bodies(static_cast<int>(options.rigid_bodies.size())), num_rigid(options.num_turning()),
      shares_grid(shares_grid_in)
  {
  }

  Grid<D> grid;    ///< the part that this rank holds
  ShapeFunction shape;
  double flip, damping, thickness;
  bool axisymmetric;     ///< see is_axisymmetric()
  bool mean_dilation;    ///< volumetric parts of strains and stresses are means over cells
  PoreWater water;
  bool absorbs;    ///< some sides have dashpots
  double dt = 0.0;
  int num_bodies, num_models = 0, num_loads = 0;
  int num_rigid;    ///< number of bodies that can turn
  /// True if nodes are divided among bodies, because several bodies can hold the same node in this
  /// step (shared_contacts.h). If no node has several bodies, imposing the bodies one by one
  /// without division gives the same bits.
  bool divides_nodes = false;
  RigidBodyStep<D> *rigid = nullptr;
  const Vec<D> *body_velocity = nullptr;    ///< per rigid body [length/time]
  /// Velocities in the previous step; NaN if there was none [length/time].
  const Vec<D> *body_velocity_before = nullptr;
  std::int64_t point_total = 0;    ///< deformable points of all ranks
  bool shares_grid;                ///< there are other ranks
  /// Nodes that points of this rank reach. If shares_grid, only data on these nodes are correct.
  NodeBox<D> touched;
  const NodeBox<D> *lower_touched = nullptr;    ///< touched boxes of the ranks before this one
  int num_lower = 0;
  const double *maximum = nullptr;    ///< maxima over all ranks, indexed by Maximum

  PointView<D> points;
  Support<D> *support = nullptr;     ///< per point
  PointBox<D> *box = nullptr;        ///< per point, if has_boxes()
  Tensor<D> *increment = nullptr;    ///< per point: ΔF
  /// Per point in axisymmetry: 1 + Δt v_r/r, the hoop component of ΔF. With mean dilation it holds
  /// the rate v_r/r [1/time] between GradientOfPoint and StrainPoint.
  double *hoop_increment = nullptr;
  HoopWeights *hoop_weights = nullptr;    ///< per point in axisymmetry, of a box with one part
  const PointLoad<D> *loads = nullptr;    ///< loads of this rank
  int num_point_loads = 0;

  std::int64_t *sums[NUM_SUM_KINDS] = {};    ///< per node, within all_sums
  const std::uint8_t *sides = nullptr;       ///< per node: SideBits
  const AbsorbingNode<D> *absorbing = nullptr;
  int num_absorbing = 0;

  RVE_HD bool follows() const { return shape == ShapeFunction::Cpgimp; }
  /// True if x is the radius and y the coordinate along the axis r = 0 (SolverOptions).
  RVE_HD bool is_axisymmetric() const { return D == 2 && axisymmetric; }
  RVE_HD bool has_boxes() const { return follows() || mean_dilation || is_axisymmetric(); }
  /// Returns the trace of a tensor with these components in the plane and this hoop component.
  RVE_HD double trace_with(const Tensor<D> &tensor, double hoop) const
  {
    return is_axisymmetric() ? trace(tensor) + hoop : trace(tensor);
  }
  /// Number of normal components of strains and stresses.
  RVE_HD int normal_components() const { return is_axisymmetric() ? 3 : D; }
  /// Hoop stress of a point; 0 without axisymmetry [stress].
  RVE_HD double hoop_stress(int p) const
  {
    if constexpr (D == 2)
      if (axisymmetric) return points.hoop_stress[p];
    return 0.0;
  }
  RVE_HD bool has_water() const { return points.water.water_volume != nullptr; }

  RVE_HD bool has_flow() const { return has_water() && water.flows(); }

  /// Total stress of a point with an effective stress [stress] and a volume [length³].
  RVE_HD Tensor<D> total_stress(int p, const Tensor<D> &effective, double volume) const
  {
    Tensor<D> total = effective;
    if (!has_water()) return total;
    const double pressure = pressure_of_water(p, volume);
    for (int a = 0; a < D; ++a) total(a, a) -= pressure;
    return total;
  }
  /// Pore pressure of a point with a volume [length³], if has_water() [stress].
  RVE_HD double pressure_of_water(int p, double volume) const
  {
    return pore_pressure(water, points.pore_volumes(p, volume));
  }

  RVE_HD int load_maximum(int load) const { return NUM_MAXIMA + load; }
  RVE_HD int body_maximum(int body) const { return NUM_MAXIMA + num_loads + FACES<D> * body; }
  RVE_HD int num_maxima() const { return body_maximum(num_bodies); }

  /// Scale of sums over all points with this bound.
  RVE_HD rve::FixedScale scale(Maximum bound) const { return {maximum[bound], point_total}; }
  /// Bound of all forces of a point on a node [force].
  RVE_HD double force_bound() const
  {
    double bound = maximum[ForceBound];
    // mean dilation can give a point the pressure of its neighbours, in axisymmetry also as hoop
    // stress
    if (mean_dilation)
      bound += (is_axisymmetric() ? 2.0 : 1.0) * maximum[VolumeBound] * maximum[PressureBound] /
          grid.cell_size();
    for (int k = 0; k < num_loads; ++k) bound += maximum[load_maximum(k)];
    return bound;
  }
  RVE_HD rve::FixedScale force_scale() const { return {force_bound(), point_total}; }

  RVE_HD const std::int64_t *sums_at(SumKind kind, int n) const
  {
    return sums[kind] + width_of<D>(kind) * static_cast<std::size_t>(n);
  }
  /// Index of a node in a field with a row of nodes per body or axis.
  RVE_HD std::size_t in_row(int row, int n) const
  {
    return static_cast<std::size_t>(row) * grid.node_count() + n;
  }

  RVE_HD bool held_by_side(int n, int axis) const
  {
    return (sides[n] & (SideBits::across(axis) | SideBits::FIXED_ACROSS_ANY)) != 0;
  }
  /// True if the conditions that were imposed last include this velocity component.
  RVE_HD bool constrains(int n, int axis) const
  {
    return held_by_side(n, axis) || (this->on_body[n] >> axis & 1) != 0;
  }
  /// Sets to zero the components of a node's momentum that sides hold.
  RVE_HD void impose_sides(int n, Vec<D> &momentum) const
  {
    for (int a = 0; sides[n] != 0 && a < D; ++a)
      if (held_by_side(n, a)) momentum[a] = 0.0;
  }
  /// Imposes the sides on the momenta of a balance, with and before the forces, and stores the
  /// impulse on the sides.
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
  /// Stores the only contact of a body at a node: the components a for which holds(a) is true, and
  /// the weight of the contact.
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
  /// Weight of a contact that covers all sectors around a node: the number of these sectors
  /// (shared_contacts.h).
  static constexpr int WHOLE_CONTACT = 1 << (D - 1);
  /// Ratio of the mass of a node to the part on which a contact with this weight acts.
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

/// Number of stages of passes; PointErrorKey keys of lower stages are reported first.
constexpr int NUM_STAGES = 3;

/// Base class of passes. Each thread calls begin() on its own copy before it processes items.
template <int D> struct Pass {
  /// Stage of the errors that the pass reports. Points with errors in stage 0 have no weights.
  static constexpr int STAGE = 1;
  static constexpr bool OVER_POINTS = false;
  static constexpr bool USES_WATER = false;    ///< the pass reads the pore water of points
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
/// Base class of passes over loads. Item k is the k-th load of a point.
template <int D> struct LoadPass : Pass<D> {
  int items() const { return this->step.num_point_loads; }
};

}    // namespace mpm
