// SPDX-License-Identifier: GPL-2.0-only
#include "macro/in_situ.h"

#include "rve/core/eigenvalues.h"
#include "rve/core/error.h"
#include "rve/core/exact_sum.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/packing.h"

#include <algorithm>
#include <cmath>

namespace macro {

namespace {

  using rve::number;
  using rve::require;

  // DEM steps of a call of the engine, as in the preparation of packings.
  constexpr int STEPS_PER_CALL = 250;

  // Largest number of DEM steps. A tenfold change of stress takes some ten thousand.
  constexpr std::int64_t MOST_STEPS = 1000000;

  // Number of DEM steps without progress after which an RVE stalls. STALLED_FAR applies if the
  // grains are at rest and the error exceeds FAR times the tolerance, because such an error does
  // not decrease any more. STALLED applies otherwise, for two reasons. Smaller errors vary by
  // rounding and can still fall below the tolerance. Grains in motion rearrange slowly under small
  // stresses.
  constexpr std::int64_t STALLED_FAR = 25000, STALLED = 200000;
  constexpr double FAR = 100.0;
  // Progress is a decrease of left() below this share of its least value so far [-].
  constexpr double PROGRESS = 0.9;

  // Limit of the logarithm of the largest stretch of the cell [-]. If the grains are not at rest at
  // this stretch, they flow in the critical state.
  constexpr double LARGEST_EXTENSION = 1.0;

  // Least ratio of the tolerance to the largest component of the goal [-]. Rounding errors of the
  // stress exceed a smaller tolerance.
  constexpr double LEAST_TOLERANCE = 1e-13;

  // Largest unbalanced force ratio of grains at rest: the ratio of the mean force on a grain to the
  // mean contact force [-]. The preparation of packings ends at the same ratio.
  constexpr double UNBALANCED_AT_REST = 1e-3;

  // Largest number of rounds of GroundAtRest, and largest relative change of the density of a level
  // in the last round.
  constexpr int MOST_ROUNDS = 10;
  constexpr double DENSITY_CHANGE = 1e-4;

  // Ratio of the DEM time step to the stability bound [-]. The bound does not include contacts that
  // form within a call.
  constexpr double SHARE_OF_BOUND = 0.8;
  // Lower limit of bound_ratio() [-].
  constexpr double LEAST_BOUND_RATIO = 0.3;

  template <int D> struct Way : WayToStress<D> {
    bool was_at_rest = false;    ///< the RVE had its stress and was at rest before the last call
    bool is_held = false;        ///< the last call was without the servo
    /// Deformation at the start.
    rve::Tensor<double, D> begin = rve::Tensor<double, D>::identity();
    double least_left = HUGE_VAL;          ///< least left() so far
    std::int64_t steps_at_progress = 0;    ///< steps at the last progress

    /// Distance from the end of the way [-]. It is the product of two ratios: of the stress error
    /// to its tolerance, and of the unbalanced force ratio to its limit. A ratio below 1 counts as
    /// 1, so the distance is 1 at the end.
    double left(const rve::ResultOf<D> &now) const
    {
      return std::fmax(this->error(now) / this->tolerance, 1.0) *
          std::fmax(now.unbalanced_ratio / this->unbalanced_ratio, 1.0);
    }
    /// Returns true if left() has made no progress for STALLED or STALLED_FAR steps. A cell without
    /// contacts is not stalled: it approaches its first contacts.
    bool stalls(const rve::ResultOf<D> &now)
    {
      const double still_left = left(now);
      if (still_left < PROGRESS * least_left || now.coordination_number == 0.0) {
        least_left = std::fmin(least_left, still_left);
        steps_at_progress = this->steps;
      }
      const bool is_far = now.unbalanced_ratio <= this->unbalanced_ratio && least_left > FAR;
      return this->steps - steps_at_progress >= (is_far ? STALLED_FAR : STALLED);
    }
    /// Logarithm of the largest stretch since the start [-]; not positive in pure compression.
    double extension(const rve::ResultOf<D> &now) const
    {
      const rve::Tensor<double, D> f = now.deformation * rve::inverse(begin);
      return 0.5 * std::log(rve::largest_eigenvalue(rve::transpose(f) * f));
    }
  };

  /// Returns the mean of the steered normal pressures at the goal, or the present pressure if no
  /// normal stress is steered [stress].
  template <int D> double pressure_of(const StressGoal &goal, const rve::ResultOf<D> &now)
  {
    double sum = 0.0;
    int count = 0;
    for (int a = 0; a < D; ++a) {
      if (!goal.steered[a][a]) continue;
      sum -= goal.stress(a, a);
      ++count;
    }
    return count > 0 ? sum / count : now.mean_stress();
  }

  /// Estimates the ratio of the stability bound at the goal to the present bound [-], because
  /// contacts can stiffen within one call. The modulus of a Hertz contact grows with the cube root
  /// of its force, and the bound falls with the square root of the modulus.
  template <int D>
  double bound_ratio(const rve::Material &material, const rve::ResultOf<D> &now,
                     const StressGoal &goal)
  {
    if (rve::has_constant_moduli<D>(material)) return 1.0;
    const double pressure = now.mean_stress();
    if (!(pressure > 0.0)) return LEAST_BOUND_RATIO;
    const double growth = pressure_of(goal, now) / pressure;
    if (!(growth > 1.0)) return 1.0;
    return std::max(1.0 / std::sqrt(std::cbrt(growth)), LEAST_BOUND_RATIO);
  }

  /// Text of a symmetric tensor: component(a, b) for each component, in the order of names().
  template <int D, class Component> std::string components(const Component &component)
  {
    std::string text = component(0, 0);
    for (int a = 1; a < D; ++a) text += " " + component(a, a);
    for (int a = 0; a < D; ++a)
      for (int b = a + 1; b < D; ++b) text += " " + component(a, b);
    return text;
  }

  template <int D> constexpr const char *names()
  {
    return D == 2 ? "(sxx syy sxy)" : "(sxx syy szz sxy sxz syz)";
  }

  template <int D> std::string goal_in_words(const StressGoal &goal)
  {
    return components<D>([&](int a, int b) {
      return goal.steered[a][b] ? number(goal.stress(a, b)) : std::string("held");
    });
  }

  /// Throws InSituError if the goal has a tension, because grains without cohesion do not carry
  /// tension. If all normal stresses are steered, the largest principal stress must be below 0.
  /// Otherwise each steered normal stress must be below 0. Grains with cohesion are not checked.
  template <int D>
  void check_compression(const StressGoal &goal, const rve::Material &material, std::size_t index)
  {
    if (material.law == rve::ContactLaw::Dmt && material.surface_energy > 0.0) return;
    bool all_steered = true;
    double largest = -HUGE_VAL;    // largest steered normal stress
    for (int a = 0; a < D; ++a) {
      all_steered = all_steered && goal.steered[a][a];
      if (goal.steered[a][a]) largest = std::fmax(largest, goal.stress(a, a));
    }
    if (all_steered) largest = rve::largest_eigenvalue(rve::leading_components<D>(goal.stress));
    if (largest < 0.0) return;
    throw InSituError(index,
                      "the stress in situ is " + goal_in_words<D>(goal) + " [stress] " +
                          names<D>() + ", and its largest principal stress is " + number(largest) +
                          "; it must be below 0, because grains without cohesion carry "
                          "compression only");
  }

  void check_tolerance(const StressGoal &goal, double tolerance, std::size_t index)
  {
    double largest = 0.0;
    for (const double x : goal.stress.component) largest = std::fmax(largest, std::fabs(x));
    if (tolerance >= LEAST_TOLERANCE * largest) return;
    throw InSituError(index,
                      "the tolerance of the stress in situ is " + number(tolerance) +
                          " [stress]; it must be at least " + number(LEAST_TOLERANCE * largest) +
                          ", which is " + number(LEAST_TOLERANCE) +
                          " of the largest component, because of rounding errors");
  }

  /// Raises the local damping of grains to the damping of the preparation of packings. restore()
  /// undoes this.
  template <int D> class Damping {
   public:
    Damping(RvePointsOf<D> &_points, const std::vector<int> &all) : points(_points)
    {
      const double enough = rve::PackingRecipe().preparation_damping;
      std::vector<rve::Material> damped;
      for (const int slot : all) {
        const rve::Material &material = points.material(slot);
        if (material.local_damping >= enough) continue;
        slots.push_back(slot);
        own.push_back(material);
        damped.push_back(material);
        damped.back().local_damping = enough;
      }
      if (!slots.empty()) points.set_materials(slots, damped);
    }
    void restore()
    {
      if (!slots.empty()) points.set_materials(slots, own);
    }

   private:
    RvePointsOf<D> &points;
    std::vector<int> slots;
    std::vector<rve::Material> own;
  };

}    // namespace

// ---- level ground ----

HeightProfile::HeightProfile(double lowest, double thickness, std::vector<double> values) :
    lowest_(lowest), thickness_(thickness), values_(std::move(values))
{
  require(!values_.empty() && values_[0] > 0.0,
          "a profile over height needs a value of its lowest level");
  require(thickness > 0.0, [&] {
    return "thickness of the levels of the ground is " + number(thickness) +
        " [length]; it must be greater than 0";
  });
  below_.push_back(0.0);
  for (std::size_t k = 0; k < values_.size(); ++k) {
    if (values_[k] == 0.0) values_[k] = values_[k - 1];
    below_.push_back(below_.back() + values_[k] * thickness_);
  }
}

std::size_t HeightProfile::level_of(double height) const
{
  const double last = static_cast<double>(values_.size() - 1);
  const double level = std::floor((height - lowest_) / thickness_);
  return static_cast<std::size_t>(std::fmin(std::fmax(level, 0.0), last));
}

double HeightProfile::integral_below(double height) const
{
  const std::size_t k = level_of(height);
  return below_[k] + (height - lowest_ - static_cast<double>(k) * thickness_) * values_[k];
}

double HeightProfile::between(double height, double upper) const
{
  return integral_below(upper) - integral_below(height);
}

double HeightProfile::change_to(const HeightProfile &other) const
{
  double largest = 0.0;
  for (std::size_t k = 0; k < values_.size(); ++k)
    largest = std::fmax(largest, std::fabs(other.values_[k] / values_[k] - 1.0));
  return largest;
}

double HeightProfile::least() const
{
  return *std::min_element(values_.begin(), values_.end());
}

double HeightProfile::most() const
{
  return *std::max_element(values_.begin(), values_.end());
}

HeightProfile level_means(const std::vector<double> &height, const std::vector<double> &value,
                          double thickness, const mpm::Communication &ranks)
{
  double extremes[3] = {-HUGE_VAL, -HUGE_VAL, 0.0};    // largest -height, height and value
  for (std::size_t k = 0; k < height.size(); ++k) {
    extremes[0] = std::fmax(extremes[0], -height[k]);
    extremes[1] = std::fmax(extremes[1], height[k]);
    extremes[2] = std::fmax(extremes[2], value[k]);
  }
  ranks.max_over_ranks(extremes, 3);
  const double lowest = -extremes[0];
  const double levels = std::round((extremes[1] - lowest) / thickness) + 1.0;
  require(levels <= MOST_LEVELS, [&] {
    return "heights of points are from " + number(lowest) + " to " + number(extremes[1]) +
        " [length]; they must span at most " + number(MOST_LEVELS) + " levels of " +
        number(thickness) + " [length], the width of a point";
  });
  const auto count = static_cast<std::size_t>(levels);
  auto points = static_cast<std::int64_t>(height.size());
  ranks.sum_over_ranks(&points, 1);
  const rve::FixedScale scale(extremes[2], points);
  std::vector<std::int64_t> sums(2 * count, 0);    // sums of values, then numbers of points
  for (std::size_t k = 0; k < height.size(); ++k) {
    const auto level = static_cast<std::size_t>(std::round((height[k] - lowest) / thickness));
    sums[level] += scale.integer(value[k]);
    ++sums[count + level];
  }
  ranks.sum_over_ranks(sums.data(), sums.size());
  std::vector<double> means(count, 0.0);
  for (std::size_t k = 0; k < count; ++k)
    if (sums[count + k] > 0) means[k] = scale.real(sums[k]) / static_cast<double>(sums[count + k]);
  return {lowest - 0.5 * thickness, thickness, means};
}

// ---- ground at rest ----

GroundAtRest::GroundAtRest(double gravity, double thickness, int vertical, Points points,
                           const std::vector<double> &density, mpm::Communication ranks) :
    gravity_(gravity),
    thickness_(thickness), vertical_(vertical), points_(std::move(points)),
    ranks_(std::move(ranks)), density_(level_means(points_.height, density, thickness_, ranks_))
{
}

double GroundAtRest::vertical_pressure(std::size_t point) const
{
  const double total = points_.surcharge[point] +
      gravity_ * density_.between(points_.height[point], points_.surface[point]);
  return points_.pore_pressure.empty() ? total : total - points_.pore_pressure[point];
}

StressGoal GroundAtRest::goal(std::size_t point) const
{
  const double stress = -vertical_pressure(point);
  if (!points_.finds_k0) return StressGoal::at_rest(vertical_, stress, points_.k0[point], true);
  if (!k0_) return StressGoal::at_rest(vertical_, stress, 1.0, false);
  return StressGoal::at_rest(vertical_, stress, k0_->at(points_.height[point]), true);
}

std::vector<StressGoal> GroundAtRest::goals() const
{
  std::vector<StressGoal> all;
  for (std::size_t point = 0; point < points_.height.size(); ++point) all.push_back(goal(point));
  return all;
}

bool GroundAtRest::settles(const std::vector<double> &density, const std::vector<double> &ratio)
{
  const HeightProfile now = level_means(points_.height, density, thickness_, ranks_);
  const double change = density_.change_to(now);
  // k0 is the mean ratio of the packings in a level, and most packings have another ratio; at least
  // one more round is therefore needed after k0 is found
  const bool has_k0 = !points_.finds_k0 || k0_;
  if (!has_k0) k0_ = level_means(points_.height, ratio, thickness_, ranks_);
  if (has_k0 && change <= DENSITY_CHANGE) return true;
  require(rounds_ < MOST_ROUNDS, [&] {
    return "density and stress of the RVEs do not converge: in iteration " +
        std::to_string(rounds_) + " the relative change of the density of a level is still " +
        number(change);
  });
  density_ = now;
  ++rounds_;
  return false;
}

// ---- RVEs ----

template <int D>
InSituReport bring_to_stress(RvePointsOf<D> &points, const std::vector<int> &slots,
                             const std::vector<StressGoal> &goals, double tolerance, double dt)
{
  for (std::size_t k = 0; k < slots.size(); ++k)
    check_compression<D>(goals[k], points.material(slots[k]), k);
  require(tolerance > 0.0, [&] {
    return "tolerance of the stress in situ is " + number(tolerance) +
        " [stress]; it must be greater than 0";
  });
  InSituReport report;
  if (slots.empty()) return report;
  for (std::size_t k = 0; k < slots.size(); ++k) check_tolerance(goals[k], tolerance, k);

  const MacroStepOptions options = points.macro_step();
  // with the default options no RVE is skipped, and the stress is taken after the last DEM step
  points.set_options(MacroStepOptions());
  Damping<D> damping(points, slots);

  std::vector<Way<D>> ways;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Way<D> way{{k, slots[k], WayToStress<D>::servo(goals[k], STEPS_PER_CALL), tolerance,
                UNBALANCED_AT_REST}};
    way.begin = points.point(slots[k]).result.deformation;
    way.drive.servo_gain = points.servo_gain(slots[k]);
    const double pressure =
        std::fmax(pressure_of(goals[k], points.point(slots[k]).result), tolerance);
    way.drive.servo_max_rate = rve::default_compression_rate(points.state(slots[k]), pressure);
    ways.push_back(way);
  }
  const auto drives = [&](const std::vector<Way<D>> &some, const std::vector<int> &of_slots) {
    const std::vector<double> bounds =
        points.bound_time_steps(of_slots, dt / (SHARE_OF_BOUND * LEAST_BOUND_RATIO));
    std::vector<rve::DriveOf<D>> calls;
    for (std::size_t k = 0; k < some.size(); ++k) {
      const double share = SHARE_OF_BOUND *
          bound_ratio(points.material(some[k].slot), points.point(some[k].slot).result,
                      goals[some[k].index]);
      calls.push_back(some[k].is_held ? rve::DriveOf<D>() : some[k].drive);
      calls.back().substeps = STEPS_PER_CALL;
      calls.back().dt = bounds[k] > 0.0 ? std::min(dt, share * bounds[k]) : dt;
    }
    return calls;
  };
  const auto has_ended = [&](Way<D> &way, std::size_t) {
    const rve::ResultOf<D> &result = points.point(way.slot).result;
    const auto fail = [&](const std::string &what) {
      points.set_options(options);
      const auto component = [&](int a, int b) {
        return number(0.5 * (result.stress(a, b) + result.stress(b, a)));
      };
      throw InSituError(way.index,
                        "cannot be brought to the stress " + goal_in_words<D>(goals[way.index]) +
                            " [stress] " + names<D>() + ": " + what + "; its stress is " +
                            components<D>(component) + " after " + std::to_string(way.steps) +
                            " DEM steps, and its unbalanced force ratio is " +
                            number(result.unbalanced_ratio));
    };
    if (points.frozen(way.slot)) fail(rve::describe_status(result.status));
    if (way.is_held && way.has_stress(result)) {
      report.largest_error = std::fmax(report.largest_error, way.error(result));
      report.most_steps = std::max(report.most_steps, way.steps);
      return true;
    }
    const std::string ratio =
        "use a ratio of lateral to vertical stress between the active and the passive limit";
    if (way.extension(result) >= LARGEST_EXTENSION)
      fail("its cell has been stretched by a factor of " +
           rve::rounded(std::exp(LARGEST_EXTENSION)) + ", and the grains still flow; " + ratio);
    const bool stalls = way.stalls(result);
    if (stalls && way.unbalanced_ratio >= result.unbalanced_ratio)
      fail("the grains are at rest, but the stress differs from its goal by " +
           rve::rounded(way.error(result)) + " [stress], more than the tolerance, " +
           number(tolerance) + " [stress]; use a larger tolerance");
    if (way.steps >= MOST_STEPS || stalls)
      fail("it did not come to rest within " + number(tolerance) + " [stress] of this stress; " +
           ratio + ", or a larger tolerance");
    // the RVE must be at rest after two calls in a row, because an oscillating servo passes through
    // its goal
    const bool is_at_rest = way.is_at_rest(result);
    way.is_held = is_at_rest && way.was_at_rest && !way.is_held;
    way.was_at_rest = is_at_rest;
    return false;
  };
  lead(
      ways, drives,
      [&](const std::vector<int> &of_slots, const std::vector<rve::DriveOf<D>> &calls) {
        points.advance(of_slots, calls);
      },
      has_ended);
  damping.restore();
  points.reset(slots);
  points.set_options(options);
  return report;
}

template InSituReport bring_to_stress<2>(RvePointsOf<2> &, const std::vector<int> &,
                                         const std::vector<StressGoal> &, double, double);
template InSituReport bring_to_stress<3>(RvePointsOf<3> &, const std::vector<int> &,
                                         const std::vector<StressGoal> &, double, double);

}    // namespace macro
