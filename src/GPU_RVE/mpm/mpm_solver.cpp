#include "mpm/mpm_solver.h"

#include "cuda/cuda_required.h"
#include "mpm/host_machine.h"
#include "mpm/step_program.h"
#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/core/wall_time.h"

#if defined(GPU_RVE_WITH_CUDA)
#include "mpm/cuda_machine.h"
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mpm {

using rve::FixedScale;
using rve::number;
using rve::require;
using rve::Tensor2;

namespace {

  const SolverOptions &checked(const SolverOptions &options)
  {
    require(options.thickness > 0.0,
            "thickness must be positive, got " + number(options.thickness) + " [length]");
    require(options.flip >= 0.0 && options.flip <= 1.0,
            "flip fraction must be in [0, 1], got " + number(options.flip));
    require(options.damping >= 0.0 && options.damping < 1.0,
            "local damping must be in [0, 1), got " + number(options.damping));
    rve::require_threads(options.threads);
    return options;
  }

  [[noreturn]] void fail(const PointView &points, int p, const std::string &what)
  {
    throw PointError(points.id[p],
                     "material point " + std::to_string(points.id[p]) + " at (" +
                         number(points.position[p][0]) + ", " + number(points.position[p][1]) +
                         ") " + what);
  }

  std::unique_ptr<StepRunner> make_runner(const SolverOptions &options,
                                          const Communication &communication, const Grid &grid,
                                          std::string *notice)
  {
    if (notice) notice->clear();
    if (options.device != Device::Cpu) {
      const bool required = rve::cuda_required();
      std::string obstacle = "GPU_RVE was built without CUDA";
#if defined(GPU_RVE_WITH_CUDA)
      if (auto runner = make_cuda_machine(options, communication, grid, obstacle)) return runner;
#endif
      require(options.device != Device::Cuda, "a CUDA device was asked for, but " + obstacle);
      require(!required, rve::cuda_requirement() + " forbids falling back to the CPU: " + obstacle);
      if (notice) *notice = obstacle + "; CPU threads serve";
    }
    return std::make_unique<StepProgram<HostMachine>>(options, communication, grid);
  }

}    // namespace

void throw_point_error(const Grid &grid, const PointView &points, int num_bodies, int num_models,
                       std::uint64_t key)
{
  const int p = FirstTrouble::point(key);
  switch (FirstTrouble::trouble(key)) {
    case Trouble::Position:
      fail(points, p, "has a position that is not finite");
    case Trouble::Outside:
      fail(points, p,
           "is outside of the grid, x from " + number(grid.lo(0)) + " to " + number(grid.hi(0)) +
               ", y from " + number(grid.lo(1)) + " to " + number(grid.hi(1)) +
               " [length]; use a larger domain, a boundary that holds it, or a shorter time step");
    case Trouble::Velocity:
      fail(points, p, "has a velocity that is not finite");
    case Trouble::Stress:
      fail(points, p, "has a stress that is not finite");
    case Trouble::HalfSize:
      fail(points, p,
           "must have half sizes in (0, " + number(0.5 * grid.cell_size()) +
               "] (half a cell), got " + number(points.half_size[p][0]) + " " +
               number(points.half_size[p][1]) + " [length]");
    case Trouble::UnknownBody:
      fail(points, p,
           "belongs to rigid body " + std::to_string(points.rigid_body[p]) +
               ", but there are only " + std::to_string(num_bodies));
    case Trouble::UnknownModel:
      fail(points, p,
           "has constitutive model " + std::to_string(points.model[p]) + ", but there are " +
               std::to_string(num_models));
    case Trouble::Mass:
      fail(points, p, "must have a positive mass, got " + number(points.mass[p]) + " [mass]");
    case Trouble::Volume:
      fail(points, p,
           "must have a positive volume, got " + number(points.volume[p]) + " [length^3]");
    case Trouble::BodyForce:
      fail(points, p, "has a body force that is not finite");
    case Trouble::RigidTraction:
      fail(points, p,
           "is rigid and cannot carry a traction; the group of the traction must have no points of "
           "a "
           "rigid body");
    case Trouble::Traction:
      fail(points, p, "has a traction that is not finite");
    default:
      fail(points, p,
           "is inverted, det(F) = " + number(determinant(points.deformation_gradient[p])) +
               "; the time step is too large or the material lost its stiffness");
  }
}

void check_bound(double bound, std::int64_t terms, const char *what)
{
  require(bound * static_cast<double>(terms) < 1e300, [&] {
    return std::string(what) + " of a point is too large for the sums on the grid, got " +
        number(bound);
  });
}

MpmSolver::MpmSolver(const SolverOptions &options, Communication communication,
                     std::string *notice) :
    options_(checked(options)),
    communication_(std::move(communication)), grid_(options.lo, options.hi, options.cell_size),
    runner_(make_runner(options, communication_, grid_, notice)),
    body_velocity_(options.rigid_bodies.size(), Vec2::zero()),
    body_velocity_before_(
        options.rigid_bodies.size(),
        {{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()}})
{
  options_.threads = rve::usable_threads(options.threads);
}

void MpmSolver::set_models(std::vector<Constitutive *> models)
{
  models_ = std::move(models);
  model_seconds_.assign(models_.size(), 0.0);
  memory_width_ = 0;
  for (const Constitutive *model : models_)
    memory_width_ = std::max(memory_width_, static_cast<int>(model->state_variables().size()));
}

void MpmSolver::set_body_velocity(int body, const Vec2 &velocity)
{
  require(std::isfinite(velocity[0]) && std::isfinite(velocity[1]), [&] {
    return "velocity of " + options_.name_of_body(body) + " must be finite, got " +
        number(velocity[0]) + " " + number(velocity[1]) + " [length/time]";
  });
  body_velocity_.at(body) = velocity;
}

Vec2 MpmSolver::body_reaction(int body) const
{
  body_velocity_.at(body);    // throws where there is no such body
  return runner_->body_reaction(body);
}

StepInput MpmSolver::input(const PointView &points, const std::vector<TractionLoad> &loads,
                           double dt)
{
  require(dt > 0.0 && std::isfinite(dt), [&] {
    return "MPM time step must be positive, got " + number(dt) + " [time]";
  });
  require(points.memory_width >= memory_width_, [&] {
    return "rows of the memory of points have " + std::to_string(points.memory_width) +
        " numbers, but a law has " + std::to_string(memory_width_) + " state variables";
  });
  loads_.clear();
  for (std::size_t k = 0; k < loads.size(); ++k)
    for (const int p : loads[k].point_index) {
      require(p >= 0 && p < points.count, [&] {
        return "traction on point index " + std::to_string(p) + ", allowed are 0 to " +
            std::to_string(points.count - 1);
      });
      loads_.push_back({p, static_cast<int>(k), loads[k].face, loads[k].traction});
    }
  return {points,
          loads_,
          static_cast<int>(loads.size()),
          static_cast<int>(models_.size()),
          body_velocity_,
          body_velocity_before_,
          dt};
}

void MpmSolver::step(const PointView &points, const std::vector<TractionLoad> &loads, double dt)
{
  runner_->step(input(points, loads, dt), [&](const Tensor2 *increment, double part) {
    advance_stress(points, increment, part);
  });
  body_velocity_before_ = body_velocity_;
  check_points(points);
}

void MpmSolver::evaluate(const PointView &points, const std::vector<TractionLoad> &loads, double dt)
{
  runner_->evaluate(input(points, loads, dt));
}

/// Refuses what a step left behind and the next one could not begin with.
void MpmSolver::check_points(const PointView &points) const
{
  std::uint64_t first = FirstTrouble::NOWHERE;
  const rve::LightWork work(points.count, options_.threads);
#pragma omp parallel for num_threads(work.team) reduction(min : first)
  for (int p = 0; p < points.count; ++p) {
    const Trouble trouble = state_trouble(grid_, points, p);
    if (trouble != Trouble::None) first = std::min(first, FirstTrouble::key(p, trouble));
  }
  if (first != FirstTrouble::NOWHERE)
    throw_point_error(grid_, points, static_cast<int>(body_velocity_.size()),
                      static_cast<int>(models_.size()), first);
}

/// Which points a model has changes seldom: the lists are made anew when it does.
void MpmSolver::list_points(const PointView &points)
{
  const auto is_same = [&](const std::vector<int> &then, const int *now) {
    return static_cast<int>(then.size()) == points.count &&
        std::equal(then.begin(), then.end(), now);
  };
  if (points_of_model_.size() == models_.size() && is_same(listed_model_, points.model) &&
      is_same(listed_body_, points.rigid_body))
    return;
  listed_model_.assign(points.model, points.model + points.count);
  listed_body_.assign(points.rigid_body, points.rigid_body + points.count);
  points_of_model_.assign(models_.size(), {});
  for (int p = 0; p < points.count; ++p)
    if (points.rigid_body[p] < 0) points_of_model_[points.model[p]].push_back(p);
}

void MpmSolver::advance_stress(const PointView &points, const Tensor2 *increment, double dt)
{
  list_points(points);
  const MemoryRows memory{points.memory, points.memory_width};
  for (std::size_t k = 0; k < models_.size(); ++k) {
    Constitutive &model = *models_[k];
    const std::vector<int> &list = points_of_model_[k];
    const auto start = rve::WallClock::now();
    if (!model.takes_parts()) {
      model.update(static_cast<int>(list.size()), list.data(), increment, dt, points.stress,
                   memory);
      model_seconds_[k] += rve::seconds_since(start);
      continue;
    }
    const int count = static_cast<int>(list.size());
    const rve::LightWork work(count, options_.threads);
#pragma omp parallel num_threads(work.team)
    {
      const rve::ThreadShare mine(count);
      model.update(mine.end - mine.begin, list.data() + mine.begin, increment, dt, points.stress,
                   memory);
    }
    model_seconds_[k] += rve::seconds_since(start);
  }
}

double MpmSolver::cfl_number(const PointView &points, double dt) const
{
  fetch(points);
  for (Constitutive *model : models_) model->expect_questions();
  const auto speed_of = [&](int p) {
    const double modulus = models_.at(points.model[p])->p_wave_modulus(p);
    const double *v = points.velocity[p];
    return std::sqrt(modulus * points.volume[p] / points.mass[p]) + std::hypot(v[0], v[1]);
  };
  double fastest = 0.0;
  int first = points.count;
  {
    const rve::LightWork work(points.count, options_.threads);
#pragma omp parallel for num_threads(work.team) reduction(max : fastest) reduction(min : first)
    for (int p = 0; p < points.count; ++p) {
      if (points.rigid_body[p] >= 0) continue;
      const double speed = speed_of(p);
      if (std::isfinite(speed))
        fastest = std::max(fastest, speed);
      else
        first = std::min(first, p);
    }
  }
  if (first < points.count)
    fail(points, first,
         "has no wave speed, p-wave modulus " +
             number(models_.at(points.model[first])->p_wave_modulus(first)) + " [stress]");
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

  check_points(points);
  std::int64_t count = 0;
  double bound[QUANTITIES] = {};
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] >= 0) continue;
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
