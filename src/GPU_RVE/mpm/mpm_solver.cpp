#include "mpm/mpm_solver.h"

#include "rve/core/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace mpm {

using rve::number;
using rve::require;
using rve::Tensor2;

namespace {

  constexpr double SIZE_TOLERANCE = 1e-6;    // of a half size that should be at most h/2, relative

  int usable_threads(int requested)
  {
#ifdef _OPENMP
    return requested;
#else
    return std::min(requested, 1);
#endif
  }

  int this_thread()
  {
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
  }

  const SolverOptions &checked(const SolverOptions &options)
  {
    require(options.thickness > 0.0,
            "thickness must be positive, got " + number(options.thickness) + " [length]");
    require(options.flip >= 0.0 && options.flip <= 1.0,
            "flip fraction must be in [0, 1], got " + number(options.flip));
    require(options.damping >= 0.0 && options.damping < 1.0,
            "local damping must be in [0, 1), got " + number(options.damping));
    require(options.threads >= 1,
            "number of threads must be at least 1, got " + number(options.threads));
    return options;
  }

  bool finite(const Tensor2 &t)
  {
    return std::isfinite(t(0, 0)) && std::isfinite(t(0, 1)) && std::isfinite(t(1, 0)) &&
        std::isfinite(t(1, 1));
  }

  double largest(double a, double b)
  {
    return std::max(std::abs(a), std::abs(b));
  }

  /// Bound of the internal force components that a point can put on a node: |V σ·∇N| with |∂N| <= 1/h [force].
  double internal_force_bound(const Tensor2 &stress, double volume, double cell_size)
  {
    return volume / cell_size *
        std::max(std::abs(stress(0, 0)) + std::abs(stress(0, 1)),
                 std::abs(stress(1, 0)) + std::abs(stress(1, 1)));
  }

  void check_bound(double bound, std::int64_t terms, const std::string &what)
  {
    require(bound * static_cast<double>(terms) < 1e300,
            what + " of a point is too large for the sums on the grid, got " + number(bound));
  }

}    // namespace

MpmSolver::MpmSolver(const SolverOptions &options, Communication communication) :
    options_(checked(options)), communication_(std::move(communication)),
    grid_(options.lo, options.hi, options.cell_size),
    boundary_(grid_, options.shape, options.sides, options.rigid_bodies),
    body_velocity_(options.rigid_bodies.size(), Vec2::zero()), bodies_(options.rigid_bodies.size()),
    inertia_sums_(grid_.node_count(), usable_threads(options.threads)),
    vector_sums_(grid_.node_count(), usable_threads(options.threads)), mass_(grid_.node_count()),
    momentum_(mass_.size()), momentum_end_(mass_.size()), force_(mass_.size()),
    velocity_(mass_.size()), velocity_change_(mass_.size()),
    body_reaction_(options.rigid_bodies.size(), Vec2::zero())
{
  options_.threads = usable_threads(options.threads);
  side_reaction_.fill(Vec2::zero());
}

void MpmSolver::set_body_velocity(int body, const Vec2 &velocity)
{
  require(std::isfinite(velocity[0]) && std::isfinite(velocity[1]),
          "velocity of rigid body " + std::to_string(body) + " must be finite, got " +
              number(velocity[0]) + " " + number(velocity[1]) + " [length/time]");
  body_velocity_.at(body) = velocity;
}

void MpmSolver::step(const PointView &points, const std::vector<TractionLoad> &loads, double dt)
{
  prepare(points, loads, dt);
  gather_mass_and_momentum(points);
  if (options_.scheme == Scheme::Usavg) {
    momentum_end_ = momentum_;
    constrained_velocity(Boundary::Contact::Find);
    advance_stress(points, 0.5 * dt);
  }
  gather_forces(points, loads);
  advance_grid(dt);
  advance_points(points, dt);
  gather_momentum_again(points);
  constrained_velocity(Boundary::Contact::Keep);
  advance_stress(points, options_.scheme == Scheme::Usavg ? 0.5 * dt : dt);
  for (int p = 0; p < points.count; ++p) check_point(points, p);
}

void MpmSolver::evaluate(const PointView &points, const std::vector<TractionLoad> &loads, double dt)
{
  prepare(points, loads, dt);
  gather_mass_and_momentum(points);
  gather_forces(points, loads);
  advance_grid(dt);
}

void MpmSolver::fail(const PointView &points, int p, const std::string &what) const
{
  throw PointError(points.id[p],
                   "material point " + std::to_string(points.id[p]) + " at (" +
                       number(points.position[p][0]) + ", " + number(points.position[p][1]) + ") " +
                       what);
}

/// Refuses what would be undefined behaviour or nonsense further on.
void MpmSolver::check_point(const PointView &points, int p) const
{
  const double *x = points.position[p];
  const double *v = points.velocity[p];
  if (!(std::isfinite(x[0]) && std::isfinite(x[1])))
    fail(points, p, "has a position that is not finite");
  if (points.rigid_body[p] >= 0) return;

  if (!grid_.contains(x[0], x[1]))
    fail(points, p,
         "is outside of the grid, x from " + number(grid_.lo(0)) + " to " + number(grid_.hi(0)) +
             ", y from " + number(grid_.lo(1)) + " to " + number(grid_.hi(1)) + " [length]");
  if (!(std::isfinite(v[0]) && std::isfinite(v[1])))
    fail(points, p, "has a velocity that is not finite");
  if (!finite(points.stress[p])) fail(points, p, "has a stress that is not finite");
}

void MpmSolver::prepare(const PointView &points, const std::vector<TractionLoad> &loads, double dt)
{
  require(dt > 0.0 && std::isfinite(dt),
          "MPM time step must be positive, got " + number(dt) + " [time]");
  const double h = grid_.cell_size();
  const int bodies = static_cast<int>(bodies_.size());

  support_.resize(points.count);
  increment_.resize(points.count);
  point_total_ = 0;
  std::vector<double> extent(4 * bodies, -std::numeric_limits<double>::infinity());
  for (int p = 0; p < points.count; ++p) {
    check_point(points, p);
    const double *x = points.position[p];
    const Vec2 &half = points.half_size[p];
    if (!(half[0] > 0.0 && half[1] > 0.0 &&
          std::max(half[0], half[1]) <= 0.5 * h * (1.0 + SIZE_TOLERANCE)))
      fail(points, p,
           "must have half sizes in (0, " + number(0.5 * h) + "] (half a cell), got " +
               number(half[0]) + " " + number(half[1]) + " [length]");

    const int body = points.rigid_body[p];
    if (body >= bodies)
      fail(points, p,
           "belongs to rigid body " + std::to_string(body) + ", but there are only " +
               std::to_string(bodies));
    if (body >= 0) {
      for (int a = 0; a < 2; ++a) {
        extent[4 * body + a] = std::max(extent[4 * body + a], -(x[a] - half[a]));
        extent[4 * body + 2 + a] = std::max(extent[4 * body + 2 + a], x[a] + half[a]);
      }
      continue;
    }

    if (points.model[p] < 0 || points.model[p] >= static_cast<int>(models_.size()))
      fail(points, p,
           "has constitutive model " + std::to_string(points.model[p]) + ", but there are " +
               std::to_string(models_.size()));
    if (!(points.mass[p] > 0.0 && std::isfinite(points.mass[p])))
      fail(points, p, "must have a positive mass, got " + number(points.mass[p]) + " [mass]");
    if (!(points.volume[p] > 0.0 && std::isfinite(points.volume[p])))
      fail(points, p,
           "must have a positive volume, got " + number(points.volume[p]) + " [length^3]");
    if (!(std::isfinite(points.body_force[p][0]) && std::isfinite(points.body_force[p][1])))
      fail(points, p, "has a body force that is not finite");
    support_[p] = support_of(grid_, options_.shape, x, half);
    ++point_total_;
  }
  for (const TractionLoad &load : loads)
    for (const int p : load.point_index) {
      require(p >= 0 && p < points.count,
              "traction on point index " + std::to_string(p) + ", allowed are 0 to " +
                  std::to_string(points.count - 1));
      if (points.rigid_body[p] >= 0) fail(points, p, "is rigid and cannot carry a traction");
      if (!std::isfinite(load.traction[0] + load.traction[1]))
        fail(points, p, "has a traction that is not finite");
    }

  communication_.sum_over_ranks(&point_total_, 1);
  if (bodies > 0) communication_.max_over_ranks(extent.data(), extent.size());
  for (int b = 0; b < bodies; ++b) {
    require(std::isfinite(extent[4 * b]), "rigid body " + std::to_string(b) + " has no points");
    bodies_[b].velocity = body_velocity_[b];
    for (int a = 0; a < 2; ++a) {
      bodies_[b].lo[a] = -extent[4 * b + a];
      bodies_[b].hi[a] = extent[4 * b + 2 + a];
    }
  }
}

void MpmSolver::gather_mass_and_momentum(const PointView &points)
{
  double bound[2] = {0.0, 0.0};    // of a point's mass and momentum
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    const double m = points.mass[p];
    bound[0] = std::max(bound[0], m);
    bound[1] = std::max(bound[1], m * largest(points.velocity[p][0], points.velocity[p][1]));
  }
  communication_.max_over_ranks(bound, 2);
  check_bound(bound[0], point_total_, "mass");
  check_bound(bound[1], point_total_, "momentum");
  const FixedScale mass_scale(bound[0], point_total_);
  const FixedScale momentum_scale(bound[1], point_total_);

  inertia_sums_.clear();
#pragma omp parallel for num_threads(options_.threads)
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    const Support &support = support_[p];
    std::int64_t *sums = inertia_sums_.of_thread(this_thread());
    const double m = points.mass[p];
    scatter<3>(
        support, mass_scale, m,
        [&](int a, int b) {
          return m * support.value(a, b);
        },
        sums, 0);
    for (int c = 0; c < 2; ++c) {
      const double momentum = m * points.velocity[p][c];
      scatter<3>(
          support, momentum_scale, momentum,
          [&](int a, int b) {
            return momentum * support.value(a, b);
          },
          sums, 1 + c);
    }
  }
  std::vector<std::int64_t> &sums = inertia_sums_.merged();
  communication_.sum_over_ranks(sums.data(), sums.size());

  for (int n = 0; n < grid_.node_count(); ++n) {
    mass_[n] = mass_scale.real(inertia_sums_.at(n, 0));
    for (int c = 0; c < 2; ++c) momentum_[n][c] = momentum_scale.real(inertia_sums_.at(n, 1 + c));
  }
}

/// Length along the face, times thickness, on which the traction acts [length²].
double MpmSolver::load_extent(const PointView &points, const TractionLoad &load, int p) const
{
  const int tangent = 1 - axis_of(load.face);
  return 2.0 * points.half_size[p][tangent] *
      std::abs(points.deformation_gradient[p](tangent, tangent)) * options_.thickness;
}

/// f_I = - Σ V σ·∇N_I + Σ f N_I + traction (Sulsky, Chen & Schreyer 1994, Comput. Methods Appl. Mech. Eng. 118, 179).
void MpmSolver::gather_forces(const PointView &points, const std::vector<TractionLoad> &loads)
{
  const double h = grid_.cell_size();
  std::vector<double> bounds(1 + loads.size(), 0.0);    // of a point's forces, and of each load's
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    bounds[0] = std::max(bounds[0],
                         internal_force_bound(points.stress[p], points.volume[p], h) +
                             largest(points.body_force[p][0], points.body_force[p][1]));
  }
  for (std::size_t k = 0; k < loads.size(); ++k)
    for (const int p : loads[k].point_index)
      bounds[1 + k] = std::max(bounds[1 + k],
                               load_extent(points, loads[k], p) *
                                   largest(loads[k].traction[0], loads[k].traction[1]));
  communication_.max_over_ranks(bounds.data(), bounds.size());
  double bound = 0.0;
  for (const double b : bounds) bound += b;
  check_bound(bound, point_total_, "force");
  const FixedScale scale(bound, point_total_);

  vector_sums_.clear();
#pragma omp parallel for num_threads(options_.threads)
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    const Support &support = support_[p];
    std::int64_t *sums = vector_sums_.of_thread(this_thread());
    const Tensor2 stress_volume = (-points.volume[p]) * points.stress[p];
    for (int c = 0; c < 2; ++c) {
      // Σ∇N = 0: the shares of the internal force add up to nothing, to the last bit
      scatter<2>(
          support, scale, 0.0,
          [&](int a, int b) {
            const Vec2 gradient = support.gradient(a, b);
            return stress_volume(c, 0) * gradient[0] + stress_volume(c, 1) * gradient[1];
          },
          sums, c);
      const double body_force = points.body_force[p][c];
      if (body_force != 0.0)
        scatter<2>(
            support, scale, body_force,
            [&](int a, int b) {
              return body_force * support.value(a, b);
            },
            sums, c);
    }
  }
  for (const TractionLoad &load : loads) scatter_traction(points, load, scale);
  std::vector<std::int64_t> &sums = vector_sums_.merged();
  communication_.sum_over_ranks(sums.data(), sums.size());
  for (int n = 0; n < grid_.node_count(); ++n)
    for (int c = 0; c < 2; ++c) force_[n][c] = scale.real(vector_sums_.at(n, c));
}

/// Traction t on the face of a point's box: f_I = t A N_t,I(x_t) H_n,I(x_face), with N the shape function of the point along the
/// face, and H the hat function at the face itself across it.
///
/// Why: across the face the slope of the averaged shape function is the difference of the hat function over the box,
///   ∂S/∂y = [H(y + l) - H(y - l)] / 2l,
/// so a point with stress σ puts -V σ ∂S/∂y S_x = -A σ S_x [H(y + l) - H(y - l)] on a node (V = 2 l A). In a column of boxes
/// that touch each other the sum telescopes to -A σ S_x [H(top) - H(bottom)]: it is balanced to round-off by t = σ on
/// the top face if, and only if, t is spread with S_x along the face and with H at the place of the face. For linear functions
/// ∂N/∂y at the centre equals the same difference as long as the box lies within one cell.
void MpmSolver::scatter_traction(const PointView &points, const TractionLoad &load,
                                 const FixedScale &scale)
{
  const int normal = axis_of(load.face);
  for (const int p : load.point_index) {
    const double face =
        points.position[p][normal] + outward(load.face) * points.half_size[p][normal];
    const double xi = grid_.scaled(face, normal);

    // three rows that contain the face and lie within the ghost layer
    AxisWeights across = {
        std::clamp(static_cast<int>(std::floor(xi)), -1, grid_.cells(normal) - 1), {}, {}};
    for (int k = 0; k < 3; ++k)
      across.value[k] = std::max(0.0, 1.0 - std::abs(xi - (across.first + k)));
    Support support = support_[p];
    (normal == 0 ? support.x : support.y) = across;
    support.first_node = grid_.node(support.x.first, support.y.first);
    const double extent = load_extent(points, load, p);
    for (int c = 0; c < 2; ++c) {
      const double force = load.traction[c] * extent;
      scatter<2>(
          support, scale, force,
          [&](int a, int b) {
            return force * support.value(a, b);
          },
          vector_sums_.of_thread(0), c);
    }
  }
}

void MpmSolver::advance_grid(double dt)
{
  for (std::size_t n = 0; n < mass_.size(); ++n)
    momentum_end_[n] = mass_[n] > 0.0 ? momentum_[n] + dt * force_[n] : Vec2::zero();
  boundary_.impose(mass_, bodies_, Boundary::Contact::Find, momentum_end_);

  for (std::size_t b = 0; b < bodies_.size(); ++b)
    body_reaction_[b] = (1.0 / dt) * boundary_.body_impulse(static_cast<int>(b));
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi})
    side_reaction_[static_cast<int>(side)] = (1.0 / dt) * boundary_.side_impulse(side);
  max_unbalanced_force_ = 0.0;
  for (int n = 0; n < grid_.node_count(); ++n)
    for (int c = 0; c < 2; ++c)
      if (!boundary_.constrains(n, c))
        max_unbalanced_force_ = std::max(max_unbalanced_force_, std::abs(force_[n][c]));

  // Cundall's local damping, -α |f| sign(v), on the net force, reactions included: a node that is held feels none, and
  // reactions stay undamped. sign(0) = 0.
  if (options_.damping > 0.0) {
    for (std::size_t n = 0; n < mass_.size(); ++n)
      for (int c = 0; c < 2; ++c) {
        const double net = momentum_end_[n][c] - momentum_[n][c];
        const double direction = double(momentum_[n][c] > 0.0) - double(momentum_[n][c] < 0.0);
        momentum_end_[n][c] -= options_.damping * std::abs(net) * direction;
      }
    boundary_.impose(mass_, bodies_, Boundary::Contact::Keep, momentum_end_);
  }

  for (std::size_t n = 0; n < mass_.size(); ++n) {
    const bool has_mass = mass_[n] > 0.0;
    velocity_[n] = has_mass ? (1.0 / mass_[n]) * momentum_end_[n] : Vec2::zero();
    velocity_change_[n] = has_mass ? (1.0 / mass_[n]) * (momentum_end_[n] - momentum_[n])
                                   : Vec2::zero();
  }
}

void MpmSolver::advance_points(const PointView &points, double dt)
{
#pragma omp parallel for num_threads(options_.threads)
  for (int p = 0; p < points.count; ++p) {
    double *x = points.position[p];
    double *v = points.velocity[p];
    if (points.rigid_body[p] >= 0) {
      const Vec2 &prescribed = body_velocity_[points.rigid_body[p]];
      for (int c = 0; c < 2; ++c) {
        v[c] = prescribed[c];
        x[c] += dt * prescribed[c];
      }
      continue;
    }
    const Vec2 grid_velocity = interpolate(support_[p], velocity_);
    const Vec2 change = interpolate(support_[p], velocity_change_);
    const double flip = options_.flip;
    for (int c = 0; c < 2; ++c) {
      x[c] += dt * grid_velocity[c];
      v[c] = flip * (v[c] + change[c]) + (1.0 - flip) * grid_velocity[c];
    }
  }
}

void MpmSolver::gather_momentum_again(const PointView &points)
{
  double bound = 0.0;
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    if (!(std::isfinite(points.velocity[p][0]) && std::isfinite(points.velocity[p][1])))
      fail(points, p, "has a velocity that is not finite");
    bound = std::max(bound, points.mass[p] * largest(points.velocity[p][0], points.velocity[p][1]));
  }
  communication_.max_over_ranks(&bound, 1);
  check_bound(bound, point_total_, "momentum");
  const FixedScale scale(bound, point_total_);

  vector_sums_.clear();
#pragma omp parallel for num_threads(options_.threads)
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    const Support &support = support_[p];
    for (int c = 0; c < 2; ++c) {
      const double momentum = points.mass[p] * points.velocity[p][c];
      scatter<2>(
          support, scale, momentum,
          [&](int a, int b) {
            return momentum * support.value(a, b);
          },
          vector_sums_.of_thread(this_thread()), c);
    }
  }
  std::vector<std::int64_t> &sums = vector_sums_.merged();
  communication_.sum_over_ranks(sums.data(), sums.size());
  for (int n = 0; n < grid_.node_count(); ++n)
    for (int c = 0; c < 2; ++c) momentum_end_[n][c] = scale.real(vector_sums_.at(n, c));
}

void MpmSolver::constrained_velocity(Boundary::Contact contact)
{
  boundary_.impose(mass_, bodies_, contact, momentum_end_);
  for (std::size_t n = 0; n < mass_.size(); ++n)
    velocity_[n] = mass_[n] > 0.0 ? (1.0 / mass_[n]) * momentum_end_[n] : Vec2::zero();
}

void MpmSolver::advance_stress(const PointView &points, double dt)
{
  const Tensor2 identity = Tensor2::identity();
#pragma omp parallel for num_threads(options_.threads)
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) {
      points.velocity_gradient[p] = Tensor2::zero();
      continue;
    }
    points.velocity_gradient[p] = interpolate_gradient(support_[p], velocity_);
    increment_[p] = identity + dt * points.velocity_gradient[p];
    points.deformation_gradient[p] = increment_[p] * points.deformation_gradient[p];
    points.volume[p] = points.initial_volume[p] * determinant(points.deformation_gradient[p]);
  }
  for (int p = 0; p < points.count; ++p)
    if (points.rigid_body[p] < 0 &&
        !(determinant(increment_[p]) > 0.0 && points.volume[p] > 0.0 &&
          std::isfinite(points.volume[p])))
      fail(points, p,
           "is inverted, det(F) = " + number(determinant(points.deformation_gradient[p])) +
               "; the time step is too large or the material lost its stiffness");

  for (std::size_t model = 0; model < models_.size(); ++model) {
    point_list_.clear();
    for (int p = 0; p < points.count; ++p)
      if (points.rigid_body[p] < 0 && points.model[p] == static_cast<int>(model))
        point_list_.push_back(p);
    models_[model]->update(static_cast<int>(point_list_.size()), point_list_.data(),
                           increment_.data(), dt, points.stress, points.memory);
  }
}

double MpmSolver::cfl_number(const PointView &points, double dt) const
{
  double fastest = 0.0;
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    const double modulus = models_.at(points.model[p])->p_wave_modulus(p);
    const double *v = points.velocity[p];
    const double speed =
        std::sqrt(modulus * points.volume[p] / points.mass[p]) + std::hypot(v[0], v[1]);
    if (!std::isfinite(speed))
      fail(points, p, "has no wave speed, p-wave modulus " + number(modulus) + " [stress]");
    fastest = std::max(fastest, speed);
  }
  communication_.max_over_ranks(&fastest, 1);
  return dt * fastest / grid_.cell_size();
}

Totals MpmSolver::totals(const PointView &points) const
{
  constexpr int QUANTITIES = 4;    // mass, momentum, kinetic energy
  const auto value = [&](int p, int q) {
    const double *v = points.velocity[p];
    const double m = points.mass[p];
    return q == 0 ? m : q < 3 ? m * v[q - 1] : 0.5 * m * (v[0] * v[0] + v[1] * v[1]);
  };

  std::int64_t count = 0;
  double bound[QUANTITIES] = {};
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    check_point(points, p);
    ++count;
    for (int q = 0; q < QUANTITIES; ++q) bound[q] = std::max(bound[q], std::abs(value(p, q)));
  }
  communication_.sum_over_ranks(&count, 1);
  communication_.max_over_ranks(bound, QUANTITIES);

  std::int64_t sums[QUANTITIES] = {};
  FixedScale scale[QUANTITIES];
  for (int q = 0; q < QUANTITIES; ++q) {
    check_bound(bound[q], count, "mass, momentum or energy");
    scale[q] = FixedScale(bound[q], count);
  }
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
    for (int q = 0; q < QUANTITIES; ++q) sums[q] += scale[q].integer(value(p, q));
  }
  communication_.sum_over_ranks(sums, QUANTITIES);
  return {count,
          scale[0].real(sums[0]),
          {{scale[1].real(sums[1]), scale[2].real(sums[2])}},
          scale[3].real(sums[3])};
}

}    // namespace mpm
