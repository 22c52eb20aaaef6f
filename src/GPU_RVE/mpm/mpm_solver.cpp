// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/mpm_solver.h"

#include "cuda/cuda_required.h"
#include "mpm/host_machine.h"
#include "mpm/point_sums.h"
#include "mpm/step_sequence.h"
#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/core/threads.h"

#if defined(GPU_RVE_WITH_CUDA)
#include "mpm/cuda_machine.h"
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mpm {

using rve::concat;
using rve::require;

namespace {

  template <int D> std::string extents(const Grid<D> &grid)
  {
    std::string text;
    for (int a = 0; a < D; ++a)
      text += concat(a == 0 ? "" : ", ", "xyz"[a], " from ", grid.lo(a), " to ", grid.hi(a));
    return text;
  }

  /// Requires a grid and options that rings about the axis r = 0 allow.
  template <int D> void check_axisymmetric(const SolverOptions<D> &options)
  {
    require(D == 2, "axisymmetry needs two dimensions: x is the radius and y the axial coordinate");
    require(options.shape != ShapeFunction::Linear,
            "axisymmetry needs the shape functions gimp or cpgimp, which are averaged over rings");
    require(options.lo[0] >= 0.0,
            "the axis of an axisymmetric grid is x = 0, so its lower limit in "
            "x must be at least 0, got ",
            options.lo[0], " [length]");
    const int inner = static_cast<int>(Face::XLo);
    require(options.lo[0] > 0.0 ||
                (options.sides[inner] == SideKind::Roller && !options.dashpots[inner].exist()),
            "the side xlo of an axisymmetric grid from x = 0 is the axis, so it must be a roller");
  }

  /// Requires options that water that flows allows.
  template <int D> void check_flow(const SolverOptions<D> &options)
  {
    const PoreWater &water = options.water;
    require(water.mobility >= 0.0 && std::isfinite(water.mobility),
            "mobility of the pore water must be at least 0 and finite, got ", water.mobility,
            " [length^4/(force time)]");
    require(water.density >= 0.0 && std::isfinite(water.density),
            "density of the pore water must be at least 0 and finite, got ", water.density,
            " [mass/length^3]");
    if (!water.flows()) return;
    require(water.exists(), "water that flows needs a bulk modulus above 0");
    require(!options.axisymmetric, "water that flows does not support axisymmetry");
    require(options.scheme == Scheme::Musl, "water that flows needs the scheme musl");
    require(!options.mean_dilation,
            "water that flows does not support means of the dilation over cells");
    // with linear functions the flux of a node that a point just reaches is without bound
    require(options.shape != ShapeFunction::Linear,
            "water that flows needs the shape functions gimp or cpgimp");
  }

  template <int D> const SolverOptions<D> &checked(const SolverOptions<D> &options)
  {
    if (options.axisymmetric) check_axisymmetric(options);
    require(options.thickness > 0.0, "thickness must be positive, got ", options.thickness,
            " [length]");
    require(options.flip >= 0.0 && options.flip <= 1.0, "flip fraction must be in [0, 1], got ",
            options.flip);
    require(options.damping >= 0.0 && options.damping < 1.0,
            "local damping must be in [0, 1), got ", options.damping);
    for (int side = 0; side < FACES<D>; ++side) {
      const Dashpots &dashpots = options.dashpots[side];
      const SideKind kind = options.sides[side];
      for (const double speed : {dashpots.normal, dashpots.tangential})
        require(speed >= 0.0 && std::isfinite(speed),
                "wave speed of an absorbing side must be at least 0, got ", speed,
                " [length/time]");
      require(kind == SideKind::Free || dashpots.normal == 0.0,
              "a side that prescribes the normal velocity cannot absorb compression waves");
      require(kind != SideKind::Fixed || dashpots.tangential == 0.0,
              "a side that prescribes all velocities cannot absorb waves");
    }
    require(options.water.modulus >= 0.0 && std::isfinite(options.water.modulus),
            "bulk modulus of the pore water must be at least 0 and finite, got ",
            options.water.modulus, " [stress]");
    require(options.water.cavitation >= 0.0,
            "suction at which the pore water cavitates must be at least 0, got ",
            options.water.cavitation, " [stress]");
    check_flow(options);
    rve::require_threads(options.threads);
    return options;
  }

  template <int D>
  [[noreturn]] void fail(const PointView<D> &points, int p, const std::string &what)
  {
    throw PointError(points.id[p],
                     concat("material point ", points.id[p], " at (",
                            in_words<D>(points.position[p], ", "), ") ", what));
  }

  template <int D>
  std::unique_ptr<StepRunner<D>>
  make_rank_runner(const SolverOptions<D> &options, const Communication &communication,
                   const Grid<D> &grid, [[maybe_unused]] std::string *notice)
  {
    if (options.device != Device::Cpu) {
      const bool required = rve::cuda_required();
      std::string obstacle = "GPU_RVE was built without CUDA";
#if defined(GPU_RVE_WITH_CUDA)
      if (auto runner = make_cuda_machine(options, communication, grid, obstacle)) return runner;
      if (notice) *notice = obstacle + "; material points run on the CPU";
#endif
      require(options.device != Device::Cuda, "a CUDA device was requested, but ", obstacle);
      require(!required, rve::cuda_requirement, " forbids the CPU as a fallback: ", obstacle);
    }
    return std::make_unique<StepSequence<D, HostMachine>>(options, communication, grid);
  }

  /// Makes the runner of this rank. Collective; throws on all ranks if a rank has no runner.
  template <int D>
  std::unique_ptr<StepRunner<D>> make_runner(const SolverOptions<D> &options,
                                             const Communication &communication,
                                             const Grid<D> &grid, std::string *notice)
  {
    if (notice) notice->clear();
    std::unique_ptr<StepRunner<D>> runner;
    std::string problem;
    try {
      runner = make_rank_runner(options, communication, grid, notice);
    } catch (const std::exception &exception) {
      problem = exception.what();
    }
    communication.raise_on_all(problem);
    runner->join_ranks();
    return runner;
  }

}    // namespace

template <int D>
void throw_point_error(const Grid<D> &grid, const PointView<D> &points, int num_bodies,
                       int num_models, std::uint64_t key)
{
  const int p = PointErrorKey::point(key);
  const auto of_point = [&]() -> std::string {
    switch (PointErrorKey::code(key)) {
      case ErrorCode::Position:
        return "has a position that is not finite";
      case ErrorCode::Outside:
        return concat(
            "is outside of the grid, ", extents(grid),
            " [length]; use a larger domain, a boundary that retains it, or a shorter time step");
      case ErrorCode::Velocity:
        return "has a velocity that is not finite";
      case ErrorCode::Stress:
        return "has a stress that is not finite";
      case ErrorCode::HalfSize:
        if (!(points.initial_volume[p] > 0.0))
          return "has no volume: it was created after the setup of the run; create points before a "
                 "run, and do not skip the setup of that run (run ... pre no)";
        return concat("must have half sizes in (0, ", 0.5 * grid.cell_size(),
                      "] (half a cell), got ", in_words<D>(points.half_size[p].component, " "),
                      " [length]");
      case ErrorCode::UnknownBody:
        return concat("belongs to rigid body ", points.rigid_body[p],
                      ", but the number of rigid bodies is ", num_bodies);
      case ErrorCode::UnknownModel:
        return concat("has constitutive model ", points.model[p], ", but the number of models is ",
                      num_models);
      case ErrorCode::Mass:
        return concat("must have a positive mass, got ", points.mass[p], " [mass]");
      case ErrorCode::Volume:
        return concat("must have a positive volume, got ", points.volume[p], " [length^3]");
      case ErrorCode::BodyForce:
        return "has a body force that is not finite";
      case ErrorCode::RigidTraction:
        return "is rigid and cannot carry a traction; the group of the traction must have no "
               "points of a rigid body";
      case ErrorCode::Traction:
        return "has a traction that is not finite";
      case ErrorCode::Radius:
        return concat(
            "has the radius ", points.position[p][0],
            " [length]; it must be above 0, because an axisymmetric point is a ring about "
            "the axis x = 0");
      case ErrorCode::Porosity: {
        const PoreVolumes now = points.pore_volumes(p, points.volume[p]);
        return concat("has the porosity ", now.porosity(), ", below ", LEAST_POROSITY,
                      "; its volume is ", now.all / points.initial_volume[p],
                      " times the initial one: use a higher bulk modulus of the water, or a "
                      "shorter time step");
      }
      case ErrorCode::Dry:
        return "has lost all of its water; use a limit of cavitation above 0, or a group of the "
               "water without the points that run dry";
      default:
        return concat("is inverted, det(F) = ", determinant(points.deformation_gradient[p]),
                      "; the time step is too large or the material lost its stiffness");
    }
  };
  fail(points, p, of_point());
}

void check_bound(double bound, std::int64_t terms, const char *what)
{
  require(bound * static_cast<double>(terms) < 1e300, what,
          " of a point is too large for the sums on the grid, got ", bound);
}

template <int D>
MpmSolver<D>::MpmSolver(const SolverOptions<D> &options, Communication communication,
                        std::string *notice) :
    options_(checked(options)),
    communication_(std::move(communication)), grid_(options.lo, options.hi, options.cell_size),
    runner_(make_runner(options, communication_, grid_, notice)),
    body_velocity_(options.rigid_bodies.size(), Vec<D>::zero()),
    body_velocity_before_(options.rigid_bodies.size(),
                          std::numeric_limits<double>::quiet_NaN() * Vec<D>::zero()),
    rigid_(options_)
{
  options_.threads = rve::usable_threads(options.threads);
}

template <int D> void MpmSolver<D>::set_models(std::vector<Constitutive<D> *> models)
{
  for (std::size_t k = 0; options_.axisymmetric && k < models.size(); ++k)
    require(models[k]->takes_hoop(), "constitutive model ", k,
            " is for plane strain and has no hoop stress, which axisymmetry needs");
  stresses_.set_laws(std::move(models));
}

template <int D> void MpmSolver<D>::set_body_velocity(int body, const Vec<D> &velocity)
{
  require(!options_.axisymmetric || velocity[0] == 0.0, "velocity of ", options_.name_of_body(body),
          " along x must be 0, because an axisymmetric body is a ring or disk that moves along the "
          "axis only, got ",
          velocity[0], " [length/time]");
  require(are_finite<D>(velocity.component), [&] {
    return concat("velocity of ", options_.name_of_body(body), " must be finite, got ",
                  in_words<D>(velocity.component, " "), " [length/time]");
  });
  body_velocity_.at(body) = velocity;
}

template <int D> void MpmSolver<D>::set_body_friction(int body, double friction)
{
  require(friction > 0.0 && std::isfinite(friction), "friction of ", options_.name_of_body(body),
          " must be above 0 and finite, got ", friction);
  runner_->set_body_friction(body, friction);
}

template <int D> Vec<D> MpmSolver<D>::body_reaction(int body) const
{
  if (!rigid_.can_turn(body)) return runner_->body_reaction(body);
  Vec<D> force = Vec<D>::zero();
  for (int a = 0; last_dt_ > 0.0 && a < D; ++a) force[a] = rigid_.felt(body)[a] / last_dt_;
  return force;
}

template <int D> Vec<rve::Space<D>::spins> MpmSolver<D>::body_torque(int body) const
{
  auto torque = Vec<rve::Space<D>::spins>::zero();
  for (int k = 0; last_dt_ > 0.0 && k < rve::Space<D>::spins; ++k)
    torque[k] = rigid_.felt(body)[D + k] / last_dt_;
  return torque;
}

template <int D>
StepInput<D> MpmSolver<D>::input(const PointView<D> &points,
                                 const std::vector<TractionLoad<D>> &loads, double dt)
{
  require(dt > 0.0 && std::isfinite(dt), "MPM time step must be positive, got ", dt, " [time]");
  require(points.memory_width >= stresses_.memory_width(), "rows of the memory of points have ",
          points.memory_width, " numbers, but a law has ", stresses_.memory_width(),
          " state variables");
  require(!points.water.water_volume || options_.water.exists(),
          "points have pore water, but its bulk modulus is 0");
  loads_.clear();
  for (std::size_t k = 0; k < loads.size(); ++k)
    for (std::size_t n = 0; n < loads[k].point_index.size(); ++n) {
      const int p = loads[k].point_index[n];
      require(p >= 0 && p < points.count, "point index of a traction is ", p,
              "; it must be from 0 to ", points.count - 1);
      loads_.push_back({p, static_cast<int>(k), loads[k].face, loads[k].follows,
                        loads[k].of_point.empty() ? loads[k].traction : loads[k].of_point.at(n)});
    }
  last_dt_ = dt;
  return {points,
          loads_,
          static_cast<int>(loads.size()),
          stresses_.num_laws(),
          body_velocity_,
          body_velocity_before_,
          rigid_.steps(points, dt, communication_),
          dt};
}

template <int D>
void MpmSolver<D>::step(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads,
                        double dt)
{
  runner_->step(input(points, loads, dt), stresses_);
  body_velocity_before_ = body_velocity_;
  rigid_.advance(dt);
  check_points(points);
}

template <int D>
void MpmSolver<D>::evaluate(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads,
                            double dt)
{
  runner_->evaluate(input(points, loads, dt), stresses_);
}

/// Throws a PointError if the state of a point does not allow another step.
template <int D> void MpmSolver<D>::check_points(const PointView<D> &points) const
{
  std::uint64_t first = PointErrorKey::NO_ERROR;
  const rve::LightWork work(points.count, options_.threads);
#pragma omp parallel for num_threads(work.team) reduction(min : first)
  for (int p = 0; p < points.count; ++p) {
    const ErrorCode error =
        state_error(grid_, first_of<D>(points.position[p]), first_of<D>(points.velocity[p]),
                    points.stress[p], points.rigid_body[p] >= 0);
    if (error != ErrorCode::None) first = std::min(first, PointErrorKey::key(p, error));
  }
  if (first != PointErrorKey::NO_ERROR)
    throw_point_error(grid_, points, static_cast<int>(body_velocity_.size()), stresses_.num_laws(),
                      first);
}

template <int D> void MpmSolver<D>::synchronise() const
{
  if (stresses_.finish() == rve::StressesAre::OnHost) runner_->stresses_changed();
}

template <int D> double MpmSolver<D>::modulus_of_water(const PointView<D> &points, int p) const
{
  if (!points.water.water_volume) return 0.0;
  return pore_modulus(options_.water, points.pore_volumes(p, points.volume[p]));
}

template <int D> double MpmSolver<D>::flow_number(const PointView<D> &points, double dt) const
{
  if (!options_.water.flows()) return 0.0;
  fetch(points);
  double modulus = 0.0;
  for (int p = 0; p < points.count; ++p)
    if (points.rigid_body[p] < 0) modulus = std::max(modulus, modulus_of_water(points, p));
  communication_.max_over_ranks(&modulus, 1);
  const double diffusivity = options_.water.mobility * modulus;
  return 2.0 * D * dt * diffusivity / (options_.cell_size * options_.cell_size);
}

template <int D> double MpmSolver<D>::cfl_number(const PointView<D> &points, double dt) const
{
  fetch(points);
  stresses_.expect_questions();
  const auto speed_of = [&](int p) {
    const double modulus =
        stresses_.law(points.model[p]).p_wave_modulus(p) + modulus_of_water(points, p);
    const double *v = points.velocity[p];
    const double wave = std::sqrt(modulus * points.volume[p] / points.mass[p]);
    return wave + (D == 2 ? std::hypot(v[0], v[1]) : std::hypot(v[0], v[1], v[2]));
  };
  double fastest = 0.0;
  int first = points.count;
  {
    const rve::LightWork work(points.count, options_.threads);
    rve::FirstError failed;
#pragma omp parallel for num_threads(work.team) reduction(max : fastest) reduction(min : first)
    for (int p = 0; p < points.count; ++p) {
      if (points.rigid_body[p] >= 0) continue;
      double speed = 0.0;
      failed.guard(p, [&] { speed = speed_of(p); });
      if (std::isfinite(speed))
        fastest = std::max(fastest, speed);
      else
        first = std::min(first, p);
    }
    failed.rethrow();
  }
  if (first < points.count)
    fail(points, first,
         concat("has no wave speed, because its p-wave modulus is ",
                stresses_.law(points.model[first]).p_wave_modulus(first), " [stress]"));
  communication_.max_over_ranks(&fastest, 1);
  for (const Dashpots &dashpots : options_.dashpots)
    fastest = std::max({fastest, dashpots.normal, dashpots.tangential});
  return dt * fastest / grid_.cell_size();
}

template <int D> Totals<D> MpmSolver<D>::totals(const PointView<D> &points) const
{
  constexpr int ENERGY = 1 + D;    // after mass and momentum
  constexpr int QUANTITIES = ENERGY + 1;
  const auto value = [&](int p, int q) {
    const double *v = points.velocity[p];
    const double m = points.mass[p];
    if (q < ENERGY) return q == 0 ? m : m * v[q - 1];
    double square = v[0] * v[0];
    for (int a = 1; a < D; ++a) square += v[a] * v[a];
    return 0.5 * m * square;
  };

  check_points(points);
  const PointSums all = sum_over_points(
      points, communication_, QUANTITIES, [&](int p) { return points.rigid_body[p] < 0; }, value,
      [](double largest, std::int64_t terms) {
        check_bound(largest, terms, "mass, momentum or energy");
      });
  return {all.points, all.sums[0], first_of<D>(&all.sums[1]), all.sums[ENERGY]};
}

template class MpmSolver<2>;
template class MpmSolver<3>;
template void throw_point_error(const Grid<2> &, const PointView<2> &, int, int, std::uint64_t);
template void throw_point_error(const Grid<3> &, const PointView<3> &, int, int, std::uint64_t);

}    // namespace mpm
