// The passes of a time step over points, nodes and columns of nodes: what one item does, from the same source for CPU threads and
// a device. Item i changes what belongs to item i; sums on nodes are integers, and what goes into a tally is a maximum: neither
// has an order. step_program.h has their sequence.
//
// A pass over points gets a tally: tally.raise(k, value) keeps the largest value, tally.trouble(p, what) the first point that
// cannot be treated.

#ifndef MPM_STEP_PASSES_H
#define MPM_STEP_PASSES_H

#include "mpm/step_view.h"

namespace mpm {

/// Not rve::larger, which wants numbers: a `b` that is not a number is passed over.
RVE_HD inline double larger(double a, double b)
{
  return a < b ? b : a;
}

/// The larger one of two magnitudes.
RVE_HD inline double largest(double a, double b)
{
  return larger(std::abs(a), std::abs(b));
}

/// What would be undefined behaviour or nonsense further on, before a step or after it.
RVE_HD inline Trouble state_trouble(const Grid &grid, const PointView &points, int p)
{
  const double *x = points.position[p];
  const double *v = points.velocity[p];
  if (!(std::isfinite(x[0]) && std::isfinite(x[1]))) return Trouble::Position;
  if (points.rigid_body[p] >= 0) return Trouble::None;
  if (!grid.contains(x[0], x[1])) return Trouble::Outside;
  if (!(std::isfinite(v[0]) && std::isfinite(v[1]))) return Trouble::Velocity;
  if (!finite(points.stress[p])) return Trouble::Stress;
  return Trouble::None;
}

constexpr double SIZE_TOLERANCE = 1e-6;    // of a half size that should be at most h/2, relative

/// What is wrong with a point that shall begin a step.
RVE_HD inline Trouble input_trouble(const Grid &grid, const PointView &points, int num_bodies,
                                    int num_models, int p)
{
  const Trouble trouble = state_trouble(grid, points, p);
  if (trouble != Trouble::None) return trouble;
  const Vec2 &half = points.half_size[p];
  if (!(half[0] > 0.0 && half[1] > 0.0 &&
        larger(half[0], half[1]) <= 0.5 * grid.cell_size() * (1.0 + SIZE_TOLERANCE)))
    return Trouble::HalfSize;
  if (points.rigid_body[p] >= num_bodies) return Trouble::UnknownBody;
  if (points.rigid_body[p] >= 0) return Trouble::None;
  if (points.model[p] < 0 || points.model[p] >= num_models) return Trouble::UnknownModel;
  if (!(points.mass[p] > 0.0 && std::isfinite(points.mass[p]))) return Trouble::Mass;
  if (!(points.volume[p] > 0.0 && std::isfinite(points.volume[p]))) return Trouble::Volume;
  if (!(std::isfinite(points.body_force[p][0]) && std::isfinite(points.body_force[p][1])))
    return Trouble::BodyForce;
  return Trouble::None;
}

/// Bound of the internal force components that a point can put on a node: |V σ·∇N| with |∂N| <= 1/h [force].
RVE_HD inline double internal_force_bound(const rve::Tensor2 &stress, double volume,
                                          double cell_size)
{
  return volume / cell_size *
      larger(std::abs(stress(0, 0)) + std::abs(stress(0, 1)),
             std::abs(stress(1, 0)) + std::abs(stress(1, 1)));
}

RVE_HD inline double force_bound_of(const StepView &step, int p)
{
  const PointView &points = step.points;
  return internal_force_bound(points.stress[p], points.volume[p], step.grid.cell_size()) +
      largest(points.body_force[p][0], points.body_force[p][1]);
}

/// Length along the face, times thickness, on which the traction acts [length²].
RVE_HD inline double load_extent(const StepView &step, const PointLoad &load)
{
  const int tangent = 1 - axis_of(load.face);
  const PointView &points = step.points;
  return 2.0 * points.half_size[load.point][tangent] *
      std::abs(points.deformation_gradient[load.point](tangent, tangent)) * step.thickness;
}

/// What all passes have. A thread calls begin() on a copy of its own before its items.
struct Pass {
  /// Trouble of a lower stage is told first; points that have trouble in stage 0 have no weights.
  static constexpr int STAGE = 1;
  StepView step;
  RVE_HD void begin() {}
};

constexpr int NUM_STAGES = 3;

// ---- passes over points --------------------------------------------------------------------------------------------------------

/// Checks, weights, bounds of what goes to the nodes, and the extents of rigid bodies.
struct PreparePoint : Pass {
  static constexpr int STAGE = 0;
  bool bounds_forces;    ///< stresses do not change before the forces are summed

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView &points = step.points;
    const Trouble trouble = input_trouble(step.grid, points, step.num_bodies, step.num_models, p);
    if (trouble != Trouble::None) {
      tally.trouble(p, trouble);
      return;
    }
    const double *x = points.position[p];
    const Vec2 &half = points.half_size[p];
    const int body = points.rigid_body[p];
    if (body >= 0) {
      for (int a = 0; a < 2; ++a) {
        tally.raise(step.body_maximum(body) + a, half[a] - x[a]);
        tally.raise(step.body_maximum(body) + 2 + a, x[a] + half[a]);
      }
      return;
    }
    step.support[p] = support_of(step.grid, step.shape, x, half);
    const double m = points.mass[p];
    tally.raise(MassBound, m);
    tally.raise(MomentumBound, m * largest(points.velocity[p][0], points.velocity[p][1]));
    if (bounds_forces) tally.raise(ForceBound, force_bound_of(step, p));
  }
};

/// The bound of forces after stresses have changed within a step.
struct BoundForces : Pass {
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    if (step.points.rigid_body[p] < 0) tally.raise(ForceBound, force_bound_of(step, p));
  }
};

/// Checks a load and bounds its force; item k is the k-th load of a point.
struct PrepareLoad : Pass {
  static constexpr int STAGE = 0;
  bool bounds_forces;

  template <class Tally> RVE_HD void operator()(int k, Tally &tally) const
  {
    const PointLoad &load = step.loads[k];
    if (step.points.rigid_body[load.point] >= 0) {
      tally.trouble(load.point, Trouble::RigidTraction);
    } else if (!std::isfinite(load.traction[0] + load.traction[1])) {
      tally.trouble(load.point, Trouble::Traction);
    } else if (bounds_forces) {
      tally.raise(step.load_maximum(load.load),
                  load_extent(step, load) * largest(load.traction[0], load.traction[1]));
    }
  }
};

/// Mass and momentum of a point to its nodes.
struct InertiaOfPoint {
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView &step)
  {
    mass_scale = step.mass_scale();
    momentum_scale = step.momentum_scale();
  }

  template <class Sums> RVE_HD void to_nodes(const StepView &step, int p, Sums sums) const
  {
    const Support &support = step.support[p];
    const double m = step.points.mass[p];
    scatter<3>(
        support, mass_scale, m,
        [&](int a, int b) {
          return m * support.value(a, b);
        },
        sums, 0);
    for (int c = 0; c < 2; ++c) {
      const double momentum = m * step.points.velocity[p][c];
      scatter<3>(
          support, momentum_scale, momentum,
          [&](int a, int b) {
            return momentum * support.value(a, b);
          },
          sums, 1 + c);
    }
  }
};

/// f_I = - Σ V σ·∇N_I + Σ f N_I (Sulsky, Chen & Schreyer 1994, Comput. Methods Appl. Mech. Eng. 118, 179).
struct ForceOfPoint {
  rve::FixedScale scale;

  RVE_HD void begin(const StepView &step) { scale = step.force_scale(); }

  template <class Sums> RVE_HD void to_nodes(const StepView &step, int p, Sums sums) const
  {
    const Support &support = step.support[p];
    const rve::Tensor2 stress_volume = (-step.points.volume[p]) * step.points.stress[p];
    for (int c = 0; c < 2; ++c) {
      // Σ∇N = 0: the shares of the internal force add up to nothing, to the last bit
      scatter<2>(
          support, scale, 0.0,
          [&](int a, int b) {
            const Vec2 gradient = support.gradient(a, b);
            return stress_volume(c, 0) * gradient[0] + stress_volume(c, 1) * gradient[1];
          },
          sums, c);
      const double body_force = step.points.body_force[p][c];
      if (body_force != 0.0)
        scatter<2>(
            support, scale, body_force,
            [&](int a, int b) {
              return body_force * support.value(a, b);
            },
            sums, c);
    }
  }
};

struct ScatterInertia : Pass {
  static constexpr bool INERTIA = true, VECTORS = false;
  InertiaOfPoint inertia = {};

  RVE_HD void begin() { inertia.begin(step); }
  template <class Sums> RVE_HD void operator()(int p, Sums inertia_sums, Sums) const
  {
    if (step.points.rigid_body[p] < 0) inertia.to_nodes(step, p, inertia_sums);
  }
};

struct ScatterForces : Pass {
  static constexpr bool INERTIA = false, VECTORS = true;
  ForceOfPoint force = {};

  RVE_HD void begin() { force.begin(step); }
  template <class Sums> RVE_HD void operator()(int p, Sums, Sums force_sums) const
  {
    if (step.points.rigid_body[p] < 0) force.to_nodes(step, p, force_sums);
  }
};

/// Both at once, where stresses do not change between them.
struct ScatterInertiaAndForces : Pass {
  static constexpr bool INERTIA = true, VECTORS = true;
  InertiaOfPoint inertia = {};
  ForceOfPoint force = {};

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

struct ScatterMomentumAgain : Pass {
  static constexpr bool INERTIA = false, VECTORS = true;
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.momentum_again_scale(); }

  template <class Sums> RVE_HD void operator()(int p, Sums, Sums sums) const
  {
    if (step.points.rigid_body[p] >= 0) return;
    const Support &support = step.support[p];
    for (int c = 0; c < 2; ++c) {
      const double momentum = step.points.mass[p] * step.points.velocity[p][c];
      scatter<2>(
          support, scale, momentum,
          [&](int a, int b) {
            return momentum * support.value(a, b);
          },
          sums, c);
    }
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
struct ScatterLoad : Pass {
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.force_scale(); }

  template <class Sums> RVE_HD void operator()(int k, Sums sums) const
  {
    const PointLoad &load = step.loads[k];
    const int p = load.point;
    const int normal = axis_of(load.face);
    const double face =
        step.points.position[p][normal] + outward(load.face) * step.points.half_size[p][normal];
    const double xi = step.grid.scaled(face, normal);

    // three rows that contain the face and lie within the ghost layer
    const int row = static_cast<int>(std::floor(xi));
    const int highest = step.grid.cells(normal) - 1;
    AxisWeights across = {row < -1 ? -1 : row > highest ? highest : row, {}, {}};
    for (int b = 0; b < 3; ++b)
      across.value[b] = larger(0.0, 1.0 - std::abs(xi - (across.first + b)));
    Support support = step.support[p];
    (normal == 0 ? support.x : support.y) = across;
    support.first_node = step.grid.node(support.x.first, support.y.first);
    const double extent = load_extent(step, load);
    for (int c = 0; c < 2; ++c) {
      const double force = load.traction[c] * extent;
      scatter<2>(
          support, scale, force,
          [&](int a, int b) {
            return force * support.value(a, b);
          },
          sums, c);
    }
  }
};

/// x += dt Σ N v,  v = flip (v + Σ N Δv) + (1 - flip) Σ N v; rigid points move with their body.
struct AdvancePoint : Pass {
  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView &points = step.points;
    double *x = points.position[p];
    double *v = points.velocity[p];
    if (points.rigid_body[p] >= 0) {
      const Vec2 &prescribed = step.body_velocity[points.rigid_body[p]];
      for (int c = 0; c < 2; ++c) {
        v[c] = prescribed[c];
        x[c] += step.dt * prescribed[c];
      }
      return;
    }
    const Vec2 grid_velocity = interpolate(step.support[p], step.velocity);
    const Vec2 change = interpolate(step.support[p], step.velocity_change);
    for (int c = 0; c < 2; ++c) {
      x[c] += step.dt * grid_velocity[c];
      v[c] = step.flip * (v[c] + change[c]) + (1.0 - step.flip) * grid_velocity[c];
    }
    if (!(std::isfinite(v[0]) && std::isfinite(v[1]))) tally.trouble(p, Trouble::Velocity);
    tally.raise(MomentumAgainBound, points.mass[p] * largest(v[0], v[1]));
  }
};

/// L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F.
struct StrainPoint : Pass {
  static constexpr int STAGE = 2;
  double dt;    ///< of the whole step or of a part

  template <class Tally> RVE_HD void operator()(int p, Tally &tally) const
  {
    const PointView &points = step.points;
    if (points.rigid_body[p] >= 0) {
      points.velocity_gradient[p] = rve::Tensor2::zero();
      return;
    }
    const rve::Tensor2 gradient = interpolate_gradient(step.support[p], step.velocity);
    const rve::Tensor2 increment = rve::Tensor2::identity() + dt * gradient;
    const rve::Tensor2 deformation = increment * points.deformation_gradient[p];
    const double volume = points.initial_volume[p] * determinant(deformation);
    points.velocity_gradient[p] = gradient;
    points.deformation_gradient[p] = deformation;
    points.volume[p] = volume;
    step.increment[p] = increment;
    if (!(determinant(increment) > 0.0 && volume > 0.0 && std::isfinite(volume)))
      tally.trouble(p, Trouble::Inverted);
  }
};

// ---- passes over nodes ---------------------------------------------------------------------------------------------------------

/// Mass and momentum of a node from their sums.
struct InertiaOfNode {
  rve::FixedScale mass_scale, momentum_scale;

  RVE_HD void begin(const StepView &step)
  {
    mass_scale = step.mass_scale();
    momentum_scale = step.momentum_scale();
  }

  RVE_HD void take(const StepView &step, int n) const
  {
    const std::int64_t *sums = step.inertia_sums + 3 * static_cast<std::size_t>(n);
    step.mass[n] = mass_scale.real(sums[0]);
    for (int c = 0; c < 2; ++c) step.momentum[n][c] = momentum_scale.real(sums[1 + c]);
  }
};

/// p += f dt; what bodies did in the step before is forgotten.
struct ForceOfNode {
  rve::FixedScale scale;

  RVE_HD void begin(const StepView &step) { scale = step.force_scale(); }

  RVE_HD void take(const StepView &step, int n) const
  {
    const std::int64_t *sums = step.vector_sums + 2 * static_cast<std::size_t>(n);
    for (int c = 0; c < 2; ++c) step.force[n][c] = scale.real(sums[c]);
    step.momentum_end[n] = step.mass[n] > 0.0 ? step.momentum[n] + step.dt * step.force[n]
                                              : Vec2::zero();
    step.boundary.on_body[n] = 0;
    for (int b = 0; b < step.num_bodies; ++b)
      step.boundary.body_impulse[static_cast<std::size_t>(b) * step.grid.node_count() + n] =
          Vec2::zero();
  }
};

/// The momentum at the start of the step is that for the first strains too.
struct NodeInertia : Pass {
  InertiaOfNode inertia = {};

  RVE_HD void begin() { inertia.begin(step); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    inertia.take(step, n);
    step.momentum_end[n] = step.momentum[n];
  }
};

struct NodeForce : Pass {
  ForceOfNode force = {};

  RVE_HD void begin() { force.begin(step); }
  template <class Tally> RVE_HD void operator()(int n, Tally &) const { force.take(step, n); }
};

struct NodeInertiaAndForce : Pass {
  InertiaOfNode inertia = {};
  ForceOfNode force = {};

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
struct NodeBalance : Pass {
  template <class Tally> RVE_HD void operator()(int n, Tally &tally) const
  {
    Vec2 &begin = step.momentum[n];
    Vec2 &end = step.momentum_end[n];
    step.boundary.balance_sides(n, step.flip, end, begin);
    // elsewhere a rank may have the force of a node, but not know that a body holds it
    if (!step.shares_grid || step.touched.contains(step.grid, n))
      for (int c = 0; c < 2; ++c)
        if (!step.boundary.constrains(n, c)) tally.raise(Unbalanced, std::abs(step.force[n][c]));
    if (!(step.damping > 0.0)) {
      set_velocities(step, n);
      return;
    }
    // -α |f| sign(v) on the net force, reactions included: a node that is held feels none, and reactions stay undamped. sign(0) = 0.
    step.damping_impulse[n] = (-1.0) * end;
    for (int c = 0; c < 2; ++c) {
      const double net = end[c] - begin[c];
      const double direction = double(begin[c] > 0.0) - double(begin[c] < 0.0);
      end[c] -= step.damping * std::abs(net) * direction;
    }
  }

  static RVE_HD void set_velocities(const StepView &step, int n)
  {
    const double mass = step.mass[n];
    const Vec2 &end = step.momentum_end[n];
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * end : Vec2::zero();
    step.velocity_change[n] = mass > 0.0 ? (1.0 / mass) * (end - step.momentum[n]) : Vec2::zero();
  }
};

/// Sides again and the velocities, after damping.
struct NodeDamped : Pass {
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    step.boundary.impose_sides(n, step.momentum_end[n]);
    step.damping_impulse[n] = step.damping_impulse[n] + step.momentum_end[n];
    NodeBalance::set_velocities(step, n);
  }
};

/// The momentum of the second extrapolation.
struct NodeMomentumAgain : Pass {
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.momentum_again_scale(); }

  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const std::int64_t *sums = step.vector_sums + 2 * static_cast<std::size_t>(n);
    for (int c = 0; c < 2; ++c) step.momentum_end[n][c] = scale.real(sums[c]);
  }
};

/// Velocities for strains, from momenta on which bodies have been imposed.
struct NodeVelocity : Pass {
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const double mass = step.mass[n];
    step.boundary.impose_sides(n, step.momentum_end[n]);
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * step.momentum_end[n] : Vec2::zero();
  }
};

// ---- pass over columns of nodes ------------------------------------------------------------------------------------------------

struct ImposeBody : Pass {
  int body;
  RigidBodyOptions options;
  Contact contact;
  bool balances;    ///< on the momenta before the forces too, and what the body feels is recorded

  int columns() const { return step.grid.cells(1 - axis_of(options.face)) + 3; }

  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    RigidBodyState state = step.body(body);
    step.boundary.impose_body(body, options, state, k - 1, contact, balances ? 1.0 : 0.0, step.mass,
                              step.momentum_end);
    state.velocity = step.body_velocity_before[body];
    // a body that has just come held nothing before: what its nodes bring is all theirs
    if (!balances || std::isnan(state.velocity[0])) return;
    step.boundary.impose_body(body, options, state, k - 1, Contact::Before, -step.flip, step.mass,
                              step.momentum);
  }
};

// ---- passes over the nodes that ranks share --------------------------------------------------------------------------------------

/// What nodes of a list have in their sums, to and from a buffer: component c of the k-th node is number c * count + k. The
/// ranks do this together, whatever one of them has found.
struct ListedSums : Pass {
  static constexpr int STAGE = 0;
  const int *nodes;
  int count;
  bool has_inertia, has_vectors;
  std::int64_t *buffer;

  int components() const { return (has_inertia ? 3 : 0) + (has_vectors ? 2 : 0); }

 protected:
  template <class Move> RVE_HD void each(int k, const Move &move) const
  {
    const auto n = static_cast<std::size_t>(nodes[k]);
    std::int64_t *place = buffer + k;
    for (int c = 0; has_inertia && c < 3; ++c, place += count)
      move(step.inertia_sums[3 * n + c], *place);
    for (int c = 0; has_vectors && c < 2; ++c, place += count)
      move(step.vector_sums[2 * n + c], *place);
  }
};

struct PackSums : ListedSums {
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    each(k, [](std::int64_t &sum, std::int64_t &place) {
      place = sum;
    });
  }
};

struct UnpackSums : ListedSums {
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    each(k, [](std::int64_t &sum, std::int64_t &place) {
      sum = place;
    });
  }
};

}    // namespace mpm

#endif
