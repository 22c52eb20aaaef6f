// SPDX-License-Identifier: GPL-2.0-only
// Passes over points: checks, weights and bounds at the start of a step, motion and strains at the
// end.

#pragma once

#include "mpm/point_nodes.h"

namespace mpm {

/// Data of a point at the start of a step. If a GPU thread reads all of them at once, it waits for
/// memory only once.
template <int D> struct PointAtStart {
  Vec<D> position, velocity, half_size, body_force;
  Tensor<D> stress;
  double mass, volume;
  int rigid_body, model;

  RVE_HD PointAtStart(const PointView<D> &points, int p) :
      position(first_of<D>(points.position[p])), velocity(first_of<D>(points.velocity[p])),
      half_size(points.half_size[p]), body_force(first_of<D>(points.body_force[p])),
      stress(points.stress[p]), mass(points.mass[p]), volume(points.volume[p]),
      rigid_body(points.rigid_body[p]), model(points.model[p])
  {
  }
};

/// Returns the error of the state of a point, before or after a step, that would cause undefined
/// behaviour or wrong results. If a point has several errors, the last assignment wins. The
/// function has no branches, since a GPU thread does not read the next numbers before it has
/// decided a branch.
template <int D>
RVE_HD ErrorCode state_error(const Grid<D> &grid, const Vec<D> &position, const Vec<D> &velocity,
                             const Tensor<D> &stress, bool is_rigid)
{
  ErrorCode error = finite(stress) ? ErrorCode::None : ErrorCode::Stress;
  error = are_finite<D>(velocity.component) ? error : ErrorCode::Velocity;
  error = grid.contains(position.component) ? error : ErrorCode::Outside;
  error = is_rigid ? ErrorCode::None : error;
  return are_finite<D>(position.component) ? error : ErrorCode::Position;
}

constexpr double SIZE_TOLERANCE = 1e-6;    // relative tolerance of the largest half size, h/2

/// Returns the error of a point at the start of a step. The last assignment wins, as in
/// state_error().
template <int D>
RVE_HD ErrorCode input_error(const Grid<D> &grid, const PointAtStart<D> &point, int num_bodies,
                             int num_models)
{
  const bool is_rigid = point.rigid_body >= 0;
  const auto is_positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  ErrorCode error = are_finite<D>(point.body_force.component) ? ErrorCode::None
                                                              : ErrorCode::BodyForce;
  error = is_positive(point.volume) ? error : ErrorCode::Volume;
  error = is_positive(point.mass) ? error : ErrorCode::Mass;
  error = point.model >= 0 && point.model < num_models ? error : ErrorCode::UnknownModel;
  error = is_rigid ? ErrorCode::None : error;
  error = point.rigid_body < num_bodies ? error : ErrorCode::UnknownBody;
  bool has_size = true;
  for (int a = 0; a < D; ++a)
    has_size = has_size && point.half_size[a] > 0.0 &&
        point.half_size[a] <= 0.5 * grid.cell_size() * (1.0 + SIZE_TOLERANCE);
  error = has_size ? error : ErrorCode::HalfSize;
  const ErrorCode of_state =
      state_error(grid, point.position, point.velocity, point.stress, is_rigid);
  return of_state == ErrorCode::None ? error : of_state;
}

/// Bound of the components of the internal force of a point on a node, |V σ·∇N| with |∂N| <= 1/h.
/// It excludes the hoop stress [force].
template <int D>
RVE_HD double internal_force_bound(const Tensor<D> &stress, double volume, double cell_size)
{
  double largest_row = 0.0;
  for (int a = 0; a < D; ++a) {
    double row = std::abs(stress(a, 0));
    for (int b = 1; b < D; ++b) row += std::abs(stress(a, b));
    largest_row = a == 0 ? row : larger(largest_row, row);
  }
  return volume / cell_size * largest_row;
}

/// Bound of the volume of a point for VolumeBound [length³].
template <int D> RVE_HD double volume_bound(const StepView<D> &step, int p, double volume)
{
  if (!step.is_axisymmetric()) return volume;
  return volume * larger(1.0, step.grid.cell_size() / step.points.position[p][0]);
}

/// Raises the bounds of the forces of a point on a node and, with mean dilation, of volume and
/// pressure. `stress` is the total stress.
template <int D, class Tally>
RVE_HD void raise_force_bounds(const StepView<D> &step, int p, const Tensor<D> &stress,
                               double volume, const double *body_force, Tally &tally)
{
  // mean dilation replaces the point's own pressure by a mean; removing the own pressure at most
  // doubles the bound, and force_bound() adds the mean
  const double factor = step.mean_dilation ? 2.0 : 1.0;
  double bound = internal_force_bound(stress, volume, step.grid.cell_size());
  if (step.is_axisymmetric())    // the hoop weights are at most 1/r
    bound += volume / step.points.position[p][0] * std::abs(step.hoop_stress(p));
  tally.raise(ForceBound, factor * (bound + largest<D>(body_force)));
  if (!step.mean_dilation) return;
  tally.raise(VolumeBound, volume_bound(step, p, volume));
  tally.raise(PressureBound,
              std::abs(step.trace_with(stress, step.hoop_stress(p))) / step.normal_components());
}

/// Raises the bounds of the forces on the water of a point (WaterFlow).
template <int D, class Tally>
RVE_HD void raise_flow_bounds(const StepView<D> &step, int p, const PointAtStart<D> &point,
                              Tally &tally)
{
  const double weight = step.water.density * largest<D>(point.body_force.component) / point.mass;
  tally.raise(VolumeBound, point.volume);
  tally.raise(PressureBound,
              std::abs(step.pressure_of_water(p, point.volume)) + step.grid.cell_size() * weight);
}

/// Finds errors and weights of points, bounds of their contributions to nodes, and extents of rigid
/// bodies.
template <int D> struct PreparePoint : PointPass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  static constexpr bool USES_WATER = true;
  bool bounds_forces;    ///< set if stresses do not change before the forces are summed

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointAtStart<D> point(step.points, p);
    ErrorCode error = input_error(step.grid, point, step.num_bodies, step.num_models);
    if (step.is_axisymmetric() && error == ErrorCode::None) error = ring_error(p, point);
    if (error != ErrorCode::None) {
      tally.error(p, error);
      return;
    }
    const double *x = point.position.component;
    const Vec<D> &half = point.half_size;
    const int body = point.rigid_body;
    if (body >= 0) {
      for (int a = 0; a < D; ++a) {
        tally.raise(step.body_maximum(body) + a, half[a] - x[a]);
        tally.raise(step.body_maximum(body) + D + a, x[a] + half[a]);
      }
      return;
    }
    if (step.has_boxes()) {
      const Tensor<D> &F = step.points.deformation_gradient[p];
      step.box[p] = deformed_box(step.grid, x, half, step.follows() ? F : Tensor<D>::identity(),
                                 step.is_axisymmetric());
    }
    if (step.follows() || step.is_axisymmetric()) {
      const int whole[D] = {};
      step.support[p] = support_of(step.grid, step.box[p], whole, step.is_axisymmetric());
      if (step.is_axisymmetric()) step.hoop_weights[p] = hoop_weights_of(step.grid, step.box[p], 0);
    } else {
      step.support[p] = support_of(step.grid, step.shape, x, half);
    }
    tally.raise(MassBound, point.mass);
    tally.raise(MomentumBound, point.mass * largest<D>(point.velocity.component));
    if (bounds_forces)
      raise_force_bounds(step, p, step.total_stress(p, point.stress, point.volume), point.volume,
                         point.body_force.component, tally);
    if (step.mean_dilation) tally.raise(VolumeBound, volume_bound(step, p, point.volume));
    if (step.has_flow()) raise_flow_bounds(step, p, point, tally);
  }

 private:
  /// Returns the error that a point of a plane model would not have.
  RVE_HD ErrorCode ring_error(int p, const PointAtStart<D> &point) const
  {
    if (!(point.position[0] > 0.0)) return ErrorCode::Radius;
    const bool has_stress = point.rigid_body >= 0 || std::isfinite(step.hoop_stress(p));
    return has_stress ? ErrorCode::None : ErrorCode::Stress;
  }
};

/// Raises the bounds of forces after stresses have changed within a step.
template <int D> struct BoundForces : PointPass<D> {
  using Pass<D>::step;
  static constexpr bool USES_WATER = true;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView<D> &points = step.points;
    if (points.rigid_body[p] < 0)
      raise_force_bounds(step, p, step.total_stress(p, points.stress[p], points.volume[p]),
                         points.volume[p], points.body_force[p], tally);
  }
};

/// Moves points: x += dt Σ N v, v = flip (v + Σ N Δv) + (1 - flip) Σ N v. The sums are over nodes
/// with the shape function N, velocity v and velocity change Δv. Rigid points move with their body.
/// The velocity of a ring is the mean over its volume. Its box moves with the axial component, so
/// that the centre of mass moves with the momentum. Along the radius it moves with the velocity at
/// its middle, so that its radius grows with its hoop strain.
template <int D> struct AdvancePoint : PointPass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView<D> &points = step.points;
    double *x = points.position[p];
    double *v = points.velocity[p];
    if (points.rigid_body[p] >= 0) {
      for (int k = 0; k < step.num_rigid; ++k)
        if (step.rigid[k].body == points.rigid_body[p]) {
          turn_with(step.rigid[k], x, v);
          return;
        }
      const Vec<D> &prescribed = step.body_velocity[points.rigid_body[p]];
      for (int c = 0; c < D; ++c) {
        v[c] = prescribed[c];
        x[c] += step.dt * prescribed[c];
      }
      return;
    }
    const Vec<D> grid_velocity = gathered(step, p, step.velocity);
    const Vec<D> change = gathered(step, p, step.velocity_change);
    Vec<D> of_box = grid_velocity;
    if (step.is_axisymmetric()) of_box[0] = x[0] * gathered_hoop_rate(step, p);
    for (int c = 0; c < D; ++c) {
      x[c] += step.dt * of_box[c];
      v[c] = step.flip * (v[c] + change[c]) + (1.0 - step.flip) * grid_velocity[c];
    }
    if (!are_finite<D>(v)) tally.error(p, ErrorCode::Velocity);
    tally.raise(MomentumAgainBound, points.mass[p] * largest<D>(v));
  }

 private:
  /// Moves a point with a body that turns, accurate to round-off. The velocity is that at the new
  /// position.
  RVE_HD void turn_with(const RigidBodyStep<D> &body, double *x, double *v) const
  {
    Vec<D> arm, linear;
    for (int c = 0; c < D; ++c) {
      arm[c] = x[c] - body.origin[c];
      linear[c] = body.now[c];
    }
    arm = turn_of<D>(body.now, step.dt) * arm;
    const Vec<D> velocity = velocity_at(body.now, arm);
    for (int c = 0; c < D; ++c) {
      x[c] = body.origin[c] + step.dt * linear[c] + arm[c];
      v[c] = velocity[c];
    }
  }
};

/// Finds the velocity gradient L of points. StrainPoint later replaces the dilation in L by the
/// mean over cells.
template <int D> struct GradientOfPoint : PointPass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const Tensor<D> gradient = gathered_gradient(step, p, step.velocity);
    step.points.velocity_gradient[p] = gradient;
    double hoop_rate = 0.0;
    if (step.is_axisymmetric()) step.hoop_increment[p] = hoop_rate = gathered_hoop_rate(step, p);
    tally.raise(DilationBound, std::abs(step.trace_with(gradient, hoop_rate)));
  }
};

/// Finds strains: L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F. In axisymmetry the volume also
/// grows with the hoop strain.
template <int D> struct StrainPoint : PointPass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 2;
  static constexpr bool USES_WATER = true;
  double dt;    ///< whole time step or a part of it [time]

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView<D> &points = step.points;
    if (points.rigid_body[p] >= 0) {
      points.velocity_gradient[p] = Tensor<D>::zero();
      return;
    }
    Tensor<D> gradient;
    double hoop_rate = 0.0;
    if (step.mean_dilation) {
      gradient = points.velocity_gradient[p];
      if (step.is_axisymmetric()) hoop_rate = step.hoop_increment[p];
      const double change = (mean_of_cells(step, p) - step.trace_with(gradient, hoop_rate)) /
          step.normal_components();
      for (int a = 0; a < D; ++a) gradient(a, a) += change;
      hoop_rate += change;
    } else {
      gradient = gathered_gradient(step, p, step.velocity);
      if (step.is_axisymmetric()) hoop_rate = gathered_hoop_rate(step, p);
    }
    const Tensor<D> increment = Tensor<D>::identity() + dt * gradient;
    const Tensor<D> deformation = increment * points.deformation_gradient[p];
    double volume = points.initial_volume[p] * determinant(deformation);
    if (step.is_axisymmetric()) {
      const double hoop = step.hoop_increment[p] = 1.0 + dt * hoop_rate;
      // V/(V₀ det F) is the hoop component of F
      volume = points.volume[p] * determinant(increment) * hoop;
      if (!(hoop > 0.0)) tally.error(p, ErrorCode::Inverted);
    }
    if (step.has_flow()) flow(p, tally);
    points.velocity_gradient[p] = gradient;
    points.deformation_gradient[p] = deformation;
    points.volume[p] = volume;
    step.increment[p] = increment;
    if (!(determinant(increment) > 0.0 && volume > 0.0 && std::isfinite(volume)))
      tally.error(p, ErrorCode::Inverted);
    if (step.has_water() && !(volume - points.water.grain_volume[p] >= LEAST_POROSITY * volume))
      tally.error(p, ErrorCode::Porosity);
    if (step.follows())
      for (int a = 0; a < D; ++a)
        tally.raise(BoxBound, deformed_half(step.grid, points.half_size[p], deformation, a));
  }

 private:
  /// Changes the water of a point, dV_w = -dt V div q, with its volume at the start of the step.
  template <class Tally> RVE_HD void flow(int p, Tally &tally) const
  {
    double &water = step.points.water.water_volume[p];
    if (!(water > 0.0)) return;
    water -= dt * step.points.volume[p] * trace(gathered_gradient(step, p, step.water_flux));
    if (!(water > 0.0)) tally.error(p, ErrorCode::Dry);
  }
};

}    // namespace mpm
