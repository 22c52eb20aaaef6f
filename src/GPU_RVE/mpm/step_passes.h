// SPDX-License-Identifier: GPL-2.0-only
// The passes of a time step over points, nodes and columns of nodes: what one item does, from the same source for CPU threads and
// a device. Item i changes what belongs to item i; sums on nodes are integers, and what goes into a tally is a maximum: neither
// has an order. step_program.h has their sequence.
//
// A pass gets a tally: tally.raise(k, value) keeps the largest value, tally.trouble(p, what) the first point that
// cannot be treated, and tally.add(sum, part) adds to an integer that other items add to.

#pragma once

#include "mpm/face_contact.h"
#include "mpm/rigid_contact.h"

namespace mpm {

/// Not rve::larger, which wants numbers: a `b` that is not a number is passed over.
RVE_HD inline double larger(double a, double b)
{
  return a < b ? b : a;
}

/// The largest magnitude of D components.
template <int D> RVE_HD double largest(const double *component)
{
  double result = std::abs(component[0]);
  for (int a = 1; a < D; ++a) result = larger(result, std::abs(component[a]));
  return result;
}

/// A vector of its D components.
template <int D> RVE_HD Vec<D> first_of(const double *component)
{
  Vec<D> vector;
  for (int a = 0; a < D; ++a) vector[a] = component[a];
  return vector;
}

/// Whether D components are finite numbers.
template <int D> RVE_HD bool are_finite(const double *component)
{
  for (int a = 0; a < D; ++a)
    if (!std::isfinite(component[a])) return false;
  return true;
}

/// What a step begins with at a point, read at once: a thread of a GPU waits for memory once.
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

/// What would be undefined behaviour or nonsense further on, before a step or after it. The last assignment wins, and there is no branch:
/// behind one, a GPU would begin to read what it asks for.
template <int D>
RVE_HD Trouble state_trouble(const Grid<D> &grid, const Vec<D> &position, const Vec<D> &velocity,
                             const Tensor<D> &stress, bool is_rigid)
{
  Trouble trouble = finite(stress) ? Trouble::None : Trouble::Stress;
  trouble = are_finite<D>(velocity.component) ? trouble : Trouble::Velocity;
  trouble = grid.contains(position.component) ? trouble : Trouble::Outside;
  trouble = is_rigid ? Trouble::None : trouble;
  return are_finite<D>(position.component) ? trouble : Trouble::Position;
}

constexpr double SIZE_TOLERANCE = 1e-6;    // of a half size that should be at most h/2, relative

/// What is wrong with a point that shall begin a step. As in state_trouble, the last assignment wins.
template <int D>
RVE_HD Trouble input_trouble(const Grid<D> &grid, const PointAtStart<D> &point, int num_bodies,
                             int num_models)
{
  const bool is_rigid = point.rigid_body >= 0;
  const auto is_positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  Trouble trouble = are_finite<D>(point.body_force.component) ? Trouble::None : Trouble::BodyForce;
  trouble = is_positive(point.volume) ? trouble : Trouble::Volume;
  trouble = is_positive(point.mass) ? trouble : Trouble::Mass;
  trouble = point.model >= 0 && point.model < num_models ? trouble : Trouble::UnknownModel;
  trouble = is_rigid ? Trouble::None : trouble;
  trouble = point.rigid_body < num_bodies ? trouble : Trouble::UnknownBody;
  bool has_size = true;
  for (int a = 0; a < D; ++a)
    has_size = has_size && point.half_size[a] > 0.0 &&
        point.half_size[a] <= 0.5 * grid.cell_size() * (1.0 + SIZE_TOLERANCE);
  trouble = has_size ? trouble : Trouble::HalfSize;
  const Trouble of_state =
      state_trouble(grid, point.position, point.velocity, point.stress, is_rigid);
  return of_state == Trouble::None ? trouble : of_state;
}

/// Bound of the internal force components that a point can put on a node: |V σ·∇N| with |∂N| <= 1/h [force].
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

/// What a point can put on a node, and what its pressure can put on those of others.
template <int D, class Tally>
RVE_HD void raise_force_bounds(const StepView<D> &step, const Tensor<D> &stress, double volume,
                               const double *body_force, Tally &tally)
{
  // without its mean the stress is no larger than twice as much
  const double factor = step.mean_dilation ? 2.0 : 1.0;
  tally.raise(
      ForceBound,
      factor *
          (internal_force_bound(stress, volume, step.grid.cell_size()) + largest<D>(body_force)));
  if (!step.mean_dilation) return;
  tally.raise(VolumeBound, volume);
  tally.raise(PressureBound, std::abs(trace(stress)) / D);
}

/// Area on which the traction acts [length²]: that of the face as it is seen along its own direction before the deformation. In the
/// plane a face has a length |F_tt| times the initial one, and a thickness; in space the area is that of the parallelogram of its two
/// edges.
template <int D> RVE_HD double load_extent(const StepView<D> &step, const PointLoad<D> &load)
{
  static_assert(D == 2 || D == 3, "a face has one axis or two axes along it");
  const int normal = axis_of(load.face);
  const Vec<D> &half = step.points.half_size[load.point];
  const Tensor<D> &F = step.points.deformation_gradient[load.point];
  if constexpr (D == 2) {
    const int tangent = 1 - normal;
    return 2.0 * half[tangent] * std::abs(F(tangent, tangent)) * step.thickness;
  } else {
    const int s = (normal + 1) % 3, t = (normal + 2) % 3;
    return 4.0 * half[s] * half[t] * std::abs(F(s, s) * F(t, t) - F(s, t) * F(t, s));
  }
}

/// Force of a load [force]. One that follows acts on the present area vector of the face, A det(F) F^-T N of the initial one A N (Nanson):
/// the column of cofactors of F that belongs to the normal.
template <int D> RVE_HD Vec<D> load_force(const StepView<D> &step, const PointLoad<D> &load)
{
  Vec<D> force;
  if (!load.follows) {
    const double extent = load_extent(step, load);
    for (int c = 0; c < D; ++c) force[c] = load.traction[c] * extent;
    return force;
  }
  const int normal = axis_of(load.face);
  const Vec<D> &half = step.points.half_size[load.point];
  const Tensor<D> &F = step.points.deformation_gradient[load.point];
  if constexpr (D == 2) {
    const int tangent = 1 - normal;
    const double length = 2.0 * half[tangent] * step.thickness;
    force[normal] = load.traction[normal] * length * F(tangent, tangent);
    force[tangent] = -(load.traction[normal] * length * F(normal, tangent));
  } else {
    const int s = (normal + 1) % 3, t = (normal + 2) % 3;
    const double area = 4.0 * half[s] * half[t];
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      force[c] = load.traction[normal] * area * (F(a, s) * F(b, t) - F(b, s) * F(a, t));
    }
  }
  return force;
}

constexpr int NUM_STAGES = 3;

// ---- passes over points --------------------------------------------------------------------------------------------------------

/// Checks, weights, bounds of what goes to the nodes, and the extents of rigid bodies.
template <int D> struct PreparePoint : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  bool bounds_forces;    ///< stresses do not change before the forces are summed

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointAtStart<D> point(step.points, p);
    const Trouble trouble = input_trouble(step.grid, point, step.num_bodies, step.num_models);
    if (trouble != Trouble::None) {
      tally.trouble(p, trouble);
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
      step.box[p] = deformed_box(step.grid, x, half, step.follows() ? F : Tensor<D>::identity());
    }
    if (step.follows()) {
      const int whole[D] = {};
      step.support[p] = support_of(step.grid, step.box[p], whole);
    } else {
      step.support[p] = support_of(step.grid, step.shape, x, half);
    }
    tally.raise(MassBound, point.mass);
    tally.raise(MomentumBound, point.mass * largest<D>(point.velocity.component));
    if (bounds_forces)
      raise_force_bounds(step, point.stress, point.volume, point.body_force.component, tally);
    if (step.mean_dilation) tally.raise(VolumeBound, point.volume);
  }
};

/// The bound of forces after stresses have changed within a step.
template <int D> struct BoundForces : Pass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView<D> &points = step.points;
    if (points.rigid_body[p] < 0)
      raise_force_bounds(step, points.stress[p], points.volume[p], points.body_force[p], tally);
  }
};

/// Checks a load and bounds its force; item k is the k-th load of a point.
template <int D> struct PrepareLoad : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  bool bounds_forces;

  template <class Tally> RVE_HD void operator()(int k, Tally &tally) const
  {
    const PointLoad<D> &load = step.loads[k];
    if (step.points.rigid_body[load.point] >= 0) {
      tally.trouble(load.point, Trouble::RigidTraction);
    } else if (!are_finite<D>(load.traction.component)) {
      tally.trouble(load.point, Trouble::Traction);
    } else if (bounds_forces) {
      tally.raise(step.load_maximum(load.load), largest<D>(load_force(step, load).component));
    }
  }
};

/// One of the boxes that the box of a point consists of.
template <int D> struct BoxPart {
  int number = 0, count = 1;
  int place[D] = {};    ///< along the axes

  RVE_HD double share() const { return 1.0 / count; }
  /// Of a total that all parts together have to the last bit.
  RVE_HD std::int64_t integer(const rve::FixedScale &scale, double total) const
  {
    if (count == 1) return scale.integer(total);
    return scale.integer(total * ((number + 1.0) / count)) -
        scale.integer(total * (double(number) / count));
  }
};

/// visit(support, part): once with the weights of the point, unless its box is larger than a cell.
template <int D, class Visit>
RVE_HD void each_part(const StepView<D> &step, int p, const Visit &visit)
{
  BoxPart<D> part;
  if (step.follows())
    for (int a = 0; a < D; ++a) part.count *= step.box[p].parts(a);
  if (part.count == 1) {
    // a copy, here and where points give to nodes: a thread of a GPU reads what lies in memory anew behind each addition to it
    const Support<D> support = step.support[p];
    visit(support, part);
    return;
  }
  const PointBox<D> box = step.box[p];
  for (; part.number < part.count; ++part.number) {
    for (int a = 0, rest = part.number; a < D; ++a) {
      part.place[a] = rest % box.parts(a);
      rest /= box.parts(a);
    }
    visit(support_of(step.grid, box, part.place), part);
  }
}

/// Σ_I N_I(x_p) field_I
template <int D> RVE_HD Vec<D> gathered(const StepView<D> &step, int p, const Vec<D> *field)
{
  if (!step.follows()) return interpolate(step.support[p], field);
  Vec<D> sum = Vec<D>::zero();
  each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
    sum = sum + part.share() * interpolate(support, field);
  });
  return sum;
}

/// Σ_I field_I ⊗ ∇N_I(x_p)
template <int D>
RVE_HD Tensor<D> gathered_gradient(const StepView<D> &step, int p, const Vec<D> *field)
{
  if (!step.follows()) return interpolate_gradient(step.support[p], field);
  Tensor<D> sum = Tensor<D>::zero();
  each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
    sum = sum + part.share() * interpolate_gradient(support, field);
  });
  return sum;
}

/// visit(node, weight) for the cells that the box of a point covers, by the node below each, with the part of the box that is in it.
/// With linear shape functions points have no extent: all is in one cell.
template <int D, class Visit>
RVE_HD void each_cell(const StepView<D> &step, int p, const Visit &visit)
{
  const PointBox<D> &box = step.box[p];
  const bool has_extent = step.shape != ShapeFunction::Linear;
  int first[D];
  int count[D];
  int total = 1;
  for (int a = 0; a < D; ++a) {
    const double half = has_extent ? box.half[a] : 0.0;
    const int last_cell = step.grid.cells(a) - (has_extent ? 0 : 1);
    int last = static_cast<int>(std::floor(box.place[a] + half));
    first[a] = static_cast<int>(std::floor(box.place[a] - half));
    if (last > last_cell) last = last_cell;
    if (first[a] > last) first[a] = last;
    count[a] = last - first[a] + 1;
    total *= count[a];
  }
  for (int k = 0; k < total; ++k) {
    Place<D> cell;
    double weight = 1.0;
    for (int a = 0, rest = k; a < D; ++a) {
      cell[a] = first[a] + rest % count[a];
      rest /= count[a];
      if (!has_extent) continue;
      const double low = box.place[a] - box.half[a], high = box.place[a] + box.half[a];
      const double from = low > cell[a] ? low : cell[a];
      const double to = high < cell[a] + 1.0 ? high : cell[a] + 1.0;
      weight *= to > from ? (to - from) / (high - low) : 0.0;
    }
    if (weight > 0.0) visit(step.grid.node(cell), weight);
  }
}

/// The mean of the cells of a point.
template <int D> RVE_HD double mean_of_cells(const StepView<D> &step, int p)
{
  double mean = 0.0;
  each_cell(step, p, [&](int node, double weight) { mean += weight * step.cell_mean[node]; });
  return mean;
}

/// Volume of the points in each cell, and volume times their pressure or their dilation.
///
/// Why: many points in a cell ask for more constraints of volume than its nodes have freedoms, and the material locks. With the mean of
/// the cell it has one (Hughes 1980, Int. J. Numer. Meth. Engng 15, 1413). The mean pressure in the forces is what belongs to it:
/// Σ_p V p tr(L)_mean = Σ_c V_c p_c tr(L)_c = Σ_p V p_mean tr(L), so that forces do the work of the stresses.
template <int D> struct ScatterToCells : Pass<D> {
  using Pass<D>::step;
  static constexpr bool INERTIA = false, VECTORS = true;
  bool is_dilation;    ///< else the pressure
  rve::FixedScale volume_scale = {}, product_scale = {};

  RVE_HD void begin()
  {
    const double volume = step.maximum[VolumeBound];
    volume_scale = rve::FixedScale(volume, step.point_total);
    product_scale = rve::FixedScale(
        volume * step.maximum[is_dilation ? DilationBound : PressureBound], step.point_total);
  }
  template <class Sums> RVE_HD void operator()(int p, Sums, Sums sums) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const double volume = step.points.volume[p];
    const double value = is_dilation ? trace(step.points.velocity_gradient[p])
                                     : trace(step.points.stress[p]) / D;
    each_cell(step, p, [&](int node, double weight) {
      const std::size_t k = VECTOR_SUMS<D> * static_cast<std::size_t>(node);
      add_to(sums, k, volume_scale.integer(weight * volume));
      add_to(sums, k + 1, product_scale.integer(weight * volume * value));
    });
  }
};

template <int D> struct MeanOfCell : Pass<D> {
  using Pass<D>::step;
  ScatterToCells<D> sums;

  RVE_HD void begin() { sums.begin(); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const std::int64_t *of_cell = step.vector_sums + VECTOR_SUMS<D> * static_cast<std::size_t>(n);
    const double volume = sums.volume_scale.real(of_cell[0]);
    step.cell_mean[n] = volume > 0.0 ? sums.product_scale.real(of_cell[1]) / volume : 0.0;
  }
};

/// L of a point before its dilation is replaced by that of its cells.
template <int D> struct GradientOfPoint : Pass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const Tensor<D> gradient = gathered_gradient(step, p, step.velocity);
    step.points.velocity_gradient[p] = gradient;
    tally.raise(DilationBound, std::abs(trace(gradient)));
  }
};

/// Mass and momentum of a point to its nodes.
template <int D> struct InertiaOfPoint {
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    mass_scale = step.mass_scale();
    momentum_scale = step.momentum_scale();
  }

  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    const double m = step.points.mass[p];
    const Vec<D> velocity = first_of<D>(step.points.velocity[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      const double mass = m * part.share();
      scatter_integer<INERTIA_SUMS<D>>(
          support, mass_scale, part.integer(mass_scale, m),
          [&](const Place<D> &place) { return mass * support.value(place); }, sums, 0);
      for (int c = 0; c < D; ++c) {
        const double whole = m * velocity[c];
        const double momentum = whole * part.share();
        scatter_integer<INERTIA_SUMS<D>>(
            support, momentum_scale, part.integer(momentum_scale, whole),
            [&](const Place<D> &place) { return momentum * support.value(place); }, sums, 1 + c);
      }
    });
  }
};

/// f_I = - Σ V σ·∇N_I + Σ f N_I (Sulsky, Chen & Schreyer 1994, Comput. Methods Appl. Mech. Eng. 118, 179).
template <int D> struct ForceOfPoint {
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.force_scale(); }

  template <class Sums> RVE_HD void to_nodes(const StepView<D> &step, int p, Sums sums) const
  {
    Tensor<D> stress = step.points.stress[p];
    if (step.mean_dilation) {
      const double change = mean_of_cells(step, p) - trace(stress) / D;
      for (int a = 0; a < D; ++a) stress(a, a) += change;
    }
    const double volume = step.points.volume[p];
    const Vec<D> force_of_body = first_of<D>(step.points.body_force[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      const Tensor<D> stress_volume = (-volume * part.share()) * stress;
      for (int c = 0; c < D; ++c) {
        // Σ∇N = 0: the shares of the internal force add up to nothing, to the last bit
        scatter_integer<VECTOR_SUMS<D>>(
            support, scale, 0,
            [&](const Place<D> &place) {
              const Vec<D> gradient = support.gradient(place);
              double force = stress_volume(c, 0) * gradient[0];
              for (int a = 1; a < D; ++a) force += stress_volume(c, a) * gradient[a];
              return force;
            },
            sums, c);
        const double whole = force_of_body[c];
        const double body_force = whole * part.share();
        if (whole != 0.0)
          scatter_integer<VECTOR_SUMS<D>>(
              support, scale, part.integer(scale, whole),
              [&](const Place<D> &place) { return body_force * support.value(place); }, sums, c);
      }
    });
  }
};

template <int D> struct ScatterInertia : Pass<D> {
  using Pass<D>::step;
  static constexpr bool INERTIA = true, VECTORS = false;
  InertiaOfPoint<D> inertia = {};

  RVE_HD void begin() { inertia.begin(step); }
  template <class Sums> RVE_HD void operator()(int p, Sums inertia_sums, Sums) const
  {
    if (step.points.rigid_body[p] < 0) inertia.to_nodes(step, p, inertia_sums);
  }
};

template <int D> struct ScatterForces : Pass<D> {
  using Pass<D>::step;
  static constexpr bool INERTIA = false, VECTORS = true;
  ForceOfPoint<D> force = {};

  RVE_HD void begin() { force.begin(step); }
  template <class Sums> RVE_HD void operator()(int p, Sums, Sums force_sums) const
  {
    if (step.points.rigid_body[p] < 0) force.to_nodes(step, p, force_sums);
  }
};

/// Both at once, where stresses do not change between them.
template <int D> struct ScatterInertiaAndForces : Pass<D> {
  using Pass<D>::step;
  static constexpr bool INERTIA = true, VECTORS = true;
  InertiaOfPoint<D> inertia = {};
  ForceOfPoint<D> force = {};

  RVE_HD void begin()
  {
    inertia.begin(step);
    force.begin(step);
  }
  template <class Sums> RVE_HD void operator()(int p, Sums inertia_sums, Sums force_sums) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    inertia.to_nodes(step, p, inertia_sums);
    force.to_nodes(step, p, force_sums);
  }
};

template <int D> struct ScatterMomentumAgain : Pass<D> {
  using Pass<D>::step;
  static constexpr bool INERTIA = false, VECTORS = true;
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.momentum_again_scale(); }

  template <class Sums> RVE_HD void operator()(int p, Sums, Sums sums) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const double m = step.points.mass[p];
    const Vec<D> velocity = first_of<D>(step.points.velocity[p]);
    each_part(step, p, [&](const Support<D> &support, const BoxPart<D> &part) {
      for (int c = 0; c < D; ++c) {
        const double whole = m * velocity[c];
        const double momentum = whole * part.share();
        scatter_integer<VECTOR_SUMS<D>>(
            support, scale, part.integer(scale, whole),
            [&](const Place<D> &place) { return momentum * support.value(place); }, sums, c);
      }
    });
  }
};

/// Traction t on the face of a point's box: f_I = t A N_t,I(x_t) H_n,I(x_face), with N the shape function of the point along the
/// face, and H the hat function at the face itself across it.
///
/// Why: across the face the slope of the averaged shape function is the difference of the hat function over the box,
///   ∂S/∂y = [H(y + l) - H(y - l)] / 2l,
/// so a point with stress σ puts -V σ ∂S/∂y S_x = -A σ S_x [H(y + l) - H(y - l)] on a node (V = 2 l A). In a column of boxes
/// that touch each other the sum telescopes to -A σ S_x [H(top) - H(bottom)]: it is balanced to round-off by t = σ on
/// the top face if, and only if, t is spread with S_x along the face and with H at the place of the face. For linear functions
/// ∂N/∂y at the centre equals the same difference as long as the box lies within one cell.
template <int D> struct ScatterLoad : Pass<D> {
  using Pass<D>::step;
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.force_scale(); }

  template <class Sums> RVE_HD void operator()(int k, Sums sums) const
  {
    const PointLoad<D> &load = step.loads[k];
    const int p = load.point;
    const int normal = axis_of(load.face);
    const double face =
        step.points.position[p][normal] + outward(load.face) * step.points.half_size[p][normal];
    const double xi = step.follows()
        ? step.box[p].place[normal] + outward(load.face) * step.box[p].half[normal]
        : step.grid.scaled(face, normal);

    // three rows that contain the face and lie within the ghost layer
    const int row = static_cast<int>(std::floor(xi));
    const int highest = step.grid.cells(normal) - 1;
    AxisWeights across = {row < -1 ? -1 : row > highest ? highest : row, {}, {}};
    for (int b = 0; b < 3; ++b)
      across.value[b] = larger(0.0, 1.0 - std::abs(xi - (across.first + b)));
    const Vec<D> whole = load_force(step, load);
    each_part(step, p, [&](const Support<D> &of_part, const BoxPart<D> &part) {
      if (part.place[normal] != 0) return;    // one of those behind each other has the face
      Support<D> support = of_part;
      for (int a = 0; a < D; ++a)
        if (a == normal) support.axis[a] = across;
      support.locate(step.grid);
      const double share = part.count == 1 ? 1.0 : part.share() * step.box[p].parts(normal);
      for (int c = 0; c < D; ++c) {
        const double force = whole[c] * share;
        scatter<VECTOR_SUMS<D>>(
            support, scale, force,
            [&](const Place<D> &place) { return force * support.value(place); }, sums, c);
      }
    });
  }
};

/// x += dt Σ N v,  v = flip (v + Σ N Δv) + (1 - flip) Σ N v; rigid points move with their body.
template <int D> struct AdvancePoint : Pass<D> {
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
    for (int c = 0; c < D; ++c) {
      x[c] += step.dt * grid_velocity[c];
      v[c] = step.flip * (v[c] + change[c]) + (1.0 - step.flip) * grid_velocity[c];
    }
    if (!are_finite<D>(v)) tally.trouble(p, Trouble::Velocity);
    tally.raise(MomentumAgainBound, points.mass[p] * largest<D>(v));
  }

 private:
  /// Positions stay on the body to round-off; velocities are those at the end.
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

/// L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F.
template <int D> struct StrainPoint : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 2;
  double dt;    ///< of the whole step or of a part

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView<D> &points = step.points;
    if (points.rigid_body[p] >= 0) {
      points.velocity_gradient[p] = Tensor<D>::zero();
      return;
    }
    Tensor<D> gradient;
    if (step.mean_dilation) {
      gradient = points.velocity_gradient[p];
      const double change = (mean_of_cells(step, p) - trace(gradient)) / D;
      for (int a = 0; a < D; ++a) gradient(a, a) += change;
    } else {
      gradient = gathered_gradient(step, p, step.velocity);
    }
    const Tensor<D> increment = Tensor<D>::identity() + dt * gradient;
    const Tensor<D> deformation = increment * points.deformation_gradient[p];
    const double volume = points.initial_volume[p] * determinant(deformation);
    points.velocity_gradient[p] = gradient;
    points.deformation_gradient[p] = deformation;
    points.volume[p] = volume;
    step.increment[p] = increment;
    if (!(determinant(increment) > 0.0 && volume > 0.0 && std::isfinite(volume)))
      tally.trouble(p, Trouble::Inverted);
    if (step.follows())
      for (int a = 0; a < D; ++a)
        tally.raise(BoxBound, deformed_half(step.grid, points.half_size[p], deformation, a));
  }
};

// ---- passes over nodes ---------------------------------------------------------------------------------------------------------

/// Mass and momentum of a node from their sums.
template <int D> struct InertiaOfNode {
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView<D> &step)
  {
    mass_scale = step.mass_scale();
    momentum_scale = step.momentum_scale();
  }

  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.inertia_sums + INERTIA_SUMS<D> * static_cast<std::size_t>(n);
    step.mass[n] = mass_scale.real(sums[0]);
    for (int c = 0; c < D; ++c) step.momentum[n][c] = momentum_scale.real(sums[1 + c]);
  }
};

/// p += f dt; what bodies did in the step before is forgotten.
template <int D> struct ForceOfNode {
  rve::FixedScale scale;

  RVE_HD void begin(const StepView<D> &step) { scale = step.force_scale(); }

  RVE_HD void take(const StepView<D> &step, int n) const
  {
    const std::int64_t *sums = step.vector_sums + VECTOR_SUMS<D> * static_cast<std::size_t>(n);
    for (int c = 0; c < D; ++c) step.force[n][c] = scale.real(sums[c]);
    step.momentum_end[n] = step.mass[n] > 0.0 ? step.momentum[n] + step.dt * step.force[n]
                                              : Vec<D>::zero();
    step.forget_contacts(n);
    for (int b = 0; b < step.num_bodies; ++b)
      step.boundary.body_impulse[static_cast<std::size_t>(b) * step.grid.node_count() + n] =
          Vec<D>::zero();
  }
};

/// The momentum at the start of the step is that for the first strains too.
template <int D> struct NodeInertia : Pass<D> {
  using Pass<D>::step;
  InertiaOfNode<D> inertia = {};

  RVE_HD void begin() { inertia.begin(step); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    inertia.take(step, n);
    step.forget_contacts(n);
    step.momentum_end[n] = step.momentum[n];
  }
};

template <int D> struct NodeForce : Pass<D> {
  using Pass<D>::step;
  ForceOfNode<D> force = {};

  RVE_HD void begin() { force.begin(step); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const { force.take(step, n); }
};

template <int D> struct NodeInertiaAndForce : Pass<D> {
  using Pass<D>::step;
  InertiaOfNode<D> inertia = {};
  ForceOfNode<D> force = {};

  RVE_HD void begin()
  {
    inertia.begin(step);
    force.begin(step);
  }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    inertia.take(step, n);
    force.take(step, n);
  }
};

/// Sides, Cundall's local damping, and, unless damping disturbed the conditions, the velocities.
template <int D> struct NodeBalance : Pass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &tally) const
  {
    Vec<D> &begin = step.momentum[n];
    Vec<D> &end = step.momentum_end[n];
    step.boundary.balance_sides(n, step.flip, end, begin);
    // elsewhere a rank may have the force of a node, but not know that a body holds it
    if (!step.shares_grid || step.touched.contains(step.grid, n))
      for (int c = 0; c < D; ++c)
        if (!step.boundary.constrains(n, c)) tally.raise(Unbalanced, std::abs(step.force[n][c]));
    if (!(step.damping > 0.0)) {
      set_velocities(step, n);
      return;
    }
    // -α |f| sign(v) on the net force, reactions included: a node that is held feels none, and reactions stay undamped. sign(0) = 0.
    step.damping_impulse[n] = (-1.0) * end;
    for (int c = 0; c < D; ++c) {
      const double net = end[c] - begin[c];
      const double direction = double(begin[c] > 0.0) - double(begin[c] < 0.0);
      end[c] -= step.damping * std::abs(net) * direction;
    }
  }

  static RVE_HD void set_velocities(const StepView<D> &step, int n)
  {
    const double mass = step.mass[n];
    const Vec<D> &end = step.momentum_end[n];
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * end : Vec<D>::zero();
    step.velocity_change[n] = mass > 0.0 ? (1.0 / mass) * (end - step.momentum[n]) : Vec<D>::zero();
  }
};

/// Sides again and the velocities, after damping.
template <int D> struct NodeDamped : Pass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    step.boundary.impose_sides(n, step.momentum_end[n]);
    step.damping_impulse[n] = step.damping_impulse[n] + step.momentum_end[n];
    NodeBalance<D>::set_velocities(step, n);
  }
};

/// Dashpots of the sides: a traction -ρ c v on each component of the velocity, across and along the side (Lysmer & Kuhlemeyer 1969,
/// J. Eng. Mech. Div. ASCE 95, 859). They act on the momenta with the forces, before bodies and sides; what a side holds has none.
///
/// The share of a node in the area follows from its mass: material whose face is on the side has m = ρ A ∫ (1 - x/h) dx = ρ A h/2 there, for
/// any points per cell, and half of it where the face ends or another side begins. So ρ A c v = (2 c/h) m v, without an area or a density.
/// The velocity is that in the middle of the step, v = (p + p_end)/2m: p_end = p + f dt - β (p + p_end) with β = c dt/h takes the
/// energy ρ c A v² dt of the node and never gives any. Beyond β = 1 it turns a node's velocity over, of which points see a part only: then
/// they gain energy, and cfl_number() counts these speeds too.
template <int D> struct AbsorbAtNode : Pass<D> {
  using Pass<D>::step;
  Absorbers<D> absorbers;

  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    const AbsorbingNode<D> &at = absorbers.nodes[k];
    const double per_speed = step.dt / step.grid.cell_size();
    const Vec<D> &begin = step.momentum[at.node];
    Vec<D> &end = step.momentum_end[at.node];
    Vec<D> felt[D] = {};
    for (int c = 0; c < D; ++c) {
      if (step.boundary.held_by_side(at.node, c)) continue;
      double beta = 0.0;
      for (int a = 0; a < D; ++a) beta += per_speed * at.speed[a][c];
      end[c] = (end[c] - beta * begin[c]) / (1.0 + beta);
      for (int a = 0; a < D; ++a) felt[a][c] = per_speed * at.speed[a][c] * (begin[c] + end[c]);
    }
    for (int a = 0; a < D; ++a) absorbers.impulse[a * step.grid.node_count() + at.node] = felt[a];
  }
};

/// The momentum of the second extrapolation.
template <int D> struct NodeMomentumAgain : Pass<D> {
  using Pass<D>::step;
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.momentum_again_scale(); }

  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const std::int64_t *sums = step.vector_sums + VECTOR_SUMS<D> * static_cast<std::size_t>(n);
    for (int c = 0; c < D; ++c) step.momentum_end[n][c] = scale.real(sums[c]);
  }
};

/// Velocities for strains, from momenta on which bodies have been imposed.
template <int D> struct NodeVelocity : Pass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const double mass = step.mass[n];
    step.boundary.impose_sides(n, step.momentum_end[n]);
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * step.momentum_end[n] : Vec<D>::zero();
  }
};

// ---- passes over the nodes that ranks share --------------------------------------------------------------------------------------

/// What nodes of a list have in their sums, to and from a buffer, one node after the other. The ranks do this together, whatever one of
/// them has found.
template <int D> struct ListedSums : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  const int *nodes;
  int count;
  bool has_inertia, has_vectors;
  std::int64_t *buffer;

  RVE_HD int components() const
  {
    return (has_inertia ? INERTIA_SUMS<D> : 0) + (has_vectors ? VECTOR_SUMS<D> : 0);
  }

 protected:
  template <class Move> RVE_HD void each(int k, const Move &move) const
  {
    const auto n = static_cast<std::size_t>(nodes[k]);
    std::int64_t *place = buffer + static_cast<std::size_t>(k) * components();
    for (int c = 0; has_inertia && c < INERTIA_SUMS<D>; ++c, ++place)
      move(step.inertia_sums[INERTIA_SUMS<D> * n + c], *place);
    for (int c = 0; has_vectors && c < VECTOR_SUMS<D>; ++c, ++place)
      move(step.vector_sums[VECTOR_SUMS<D> * n + c], *place);
  }
};

template <int D> struct PackSums : ListedSums<D> {
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    this->each(k, [](std::int64_t &sum, std::int64_t &place) { place = sum; });
  }
};

/// Adds, since a node may be in the list for several ranks.
template <int D> struct UnpackSums : ListedSums<D> {
  template <class Tally> RVE_HD void operator()(int k, Tally &tally) const
  {
    this->each(k, [&](std::int64_t &sum, std::int64_t &place) { tally.add(&sum, place); });
  }
};

}    // namespace mpm
