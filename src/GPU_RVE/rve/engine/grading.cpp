// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/grading.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/force_bounds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace rve {

namespace {

  /// Sizes of a script, as the checks of grains allow them.
  constexpr double LEAST_SIZE = 1e-30, LARGEST_SIZE = 1e30;
  /// Largest ratio of the limits of a distribution, for which its powers stay finite.
  constexpr double LARGEST_RATIO = 1e6;

  /// Returns the integral of x^(q - 1) between two positive numbers.
  double power_integral(double from, double to, double q)
  {
    const double log_ratio = std::log(to / from);
    return q == 0.0 ? log_ratio : std::pow(from, q) * std::expm1(q * log_ratio) / q;
  }

  /// Returns the share of a normal distribution between two numbers of standard deviations.
  double normal_share(double from, double to)
  {
    // The tail that both numbers are in has the digits of a small share.
    const double sign = from > 0.0 ? -1.0 : 1.0;
    const auto below = [](double z) { return 0.5 * std::erfc(-z * std::sqrt(0.5)); };
    return sign * (below(sign * to) - below(sign * from));
  }

  void require_size(double value, const std::string &what)
  {
    require(value >= LEAST_SIZE && value <= LARGEST_SIZE, what, " is ", value,
            " [length]; it must be from ", LEAST_SIZE, " to ", LARGEST_SIZE);
  }

  void require_limits(double smallest, double largest)
  {
    require_size(smallest, "smallest grain radius");
    require_size(largest, "largest grain radius");
    require(largest > smallest, "largest grain radius is ", largest,
            " [length]; it must be greater than the smallest radius, ", smallest);
    require(largest <= LARGEST_RATIO * smallest, "largest grain radius is ", largest,
            " [length]; it must be at most ", LARGEST_RATIO, " times the smallest radius, ",
            smallest);
  }

  void check_curve(const GradingCurve &curve)
  {
    require(curve.size() >= 2, "grading has ", curve.size(),
            " points; it must have at least 2, each with a diameter and the percent passing");
    for (std::size_t k = 0; k < curve.size(); ++k) {
      const std::string point = concat("grading point ", k + 1);
      const auto [diameter, percent] = curve[k];
      require_size(diameter, concat("diameter of ", point));
      require(percent >= 0.0 && percent <= 100.0, "percent passing of ", point, " is ", percent,
              "; it must be from 0 to 100");
      if (k == 0) continue;
      require(diameter > curve[k - 1].diameter, "diameter of ", point, " is ", diameter,
              " [length]; it must be greater than that of the point before, ",
              curve[k - 1].diameter);
      require(percent >= curve[k - 1].percent, "percent passing of ", point, " is ", percent,
              "; it must be at least that of the point before, ", curve[k - 1].percent);
    }
    require(curve.back().percent == 100.0, "percent passing of the last grading point is ",
            curve.back().percent, "; it must be 100",
            curve.back().percent == 1.0 ? " (percentages, not shares)" : "");
    require(curve.front().percent < 100.0,
            "percent passing of the first grading point is 100; it must be less: no grains are "
            "above its diameter");
  }

}    // namespace

SizeDistribution::SizeDistribution(const SizeChoice &choice, int _dimension) : dimension(_dimension)
{
  std::visit([this](const auto &chosen) { set(chosen); }, choice);
}

// Sizes are relative to the largest one, so that powers stay in the range of numbers.
void SizeDistribution::set(const GradingCurve &curve)
{
  check_curve(curve);
  least = curve.front().diameter;
  most = curve.back().diameter;
  cut = curve.front().percent / 100.0;
  // A class is the part between two points. `slope` is its mass over the logarithm of the ratio of
  // its diameters. `mass_before` and `number_before` are those of the classes before it.
  struct Class {
    double begin, end, slope, mass_before, number_before;
  };
  std::vector<Class> classes;
  double mass_sum = 0.0, number_sum = 0.0;
  const double q = -dimension;
  for (std::size_t k = 1; k < curve.size(); ++k) {
    const double begin = curve[k - 1].diameter / most, end = curve[k].diameter / most;
    const double share = (curve[k].percent - curve[k - 1].percent) / (100.0 * (1.0 - cut));
    const double slope = share / std::log(end / begin);
    classes.push_back({begin, end, slope, mass_sum, number_sum});
    mass_sum += share;
    number_sum += slope * power_integral(begin, end, q);
  }
  const auto class_of = [classes](double x) {
    std::size_t k = 0;
    while (k + 1 < classes.size() && x > classes[k].end) ++k;
    return classes[k];
  };
  const double scale = most;
  mass = [=](double diameter) {
    const Class of = class_of(diameter / scale);
    return (of.mass_before + of.slope * std::log(diameter / scale / of.begin)) / mass_sum;
  };
  number = [=](double diameter) {
    const Class of = class_of(diameter / scale);
    return (of.number_before + of.slope * power_integral(of.begin, diameter / scale, q)) /
        number_sum;
  };
  mean = std::pow(most, dimension) * mass_sum / number_sum;
}

void SizeDistribution::set(const LognormalRadii &radii)
{
  require_size(radii.median, "median radius");
  require(radii.sigma >= 1e-6 && radii.sigma <= 3.0,
          "standard deviation of the logarithm of the "
          "radius is ",
          radii.sigma, " [-]; it must be from 1e-6 to 3");
  require_limits(radii.smallest, radii.largest);
  least = 2.0 * radii.smallest;
  most = 2.0 * radii.largest;
  const double sigma = radii.sigma, median = 2.0 * radii.median;
  const auto deviations = [=](double diameter) { return std::log(diameter / median) / sigma; };
  // The mass has the same distribution with the median shifted (Hatch and Choate 1929).
  const double begin = deviations(least), end = deviations(most), shift = dimension * sigma;
  const double all = normal_share(begin, end), all_mass = normal_share(begin - shift, end - shift);
  require(all >= 1e-6 && all_mass >= 1e-6, "the radii from ", radii.smallest, " to ", radii.largest,
          " [length] have a share of ", std::min(all, all_mass),
          " of the lognormal distribution; it must be at least 1e-6");
  number = [=](double diameter) { return normal_share(begin, deviations(diameter)) / all; };
  mass = [=](double diameter) {
    return normal_share(begin - shift, deviations(diameter) - shift) / all_mass;
  };
  mean = std::pow(median, dimension) * std::exp(0.5 * shift * shift) * all_mass / all;
}

void SizeDistribution::set(const PowerLawRadii &radii)
{
  require(std::fabs(radii.exponent) <= 20.0, "exponent of the power law is ", radii.exponent,
          " [-]; it must be from -20 to 20");
  require_limits(radii.smallest, radii.largest);
  least = 2.0 * radii.smallest;
  most = 2.0 * radii.largest;
  const double scale = most, begin = least / most, q = 1.0 - radii.exponent;
  const auto integral = [=](double diameter, double power) {
    return power_integral(begin, diameter / scale, q + power);
  };
  const double d = dimension, all = integral(most, 0.0), all_mass = integral(most, d);
  number = [=](double diameter) { return integral(diameter, 0.0) / all; };
  mass = [=](double diameter) { return integral(diameter, d) / all_mass; };
  mean = std::pow(most, dimension) * all_mass / all;
}

double SizeDistribution::inside(double diameter) const
{
  return std::clamp(diameter, least, most);
}

/// Returns the diameter at which a share is reached, by bisection of the logarithm.
double SizeDistribution::quantile(const std::function<double(double)> &share_below,
                                  double share) const
{
  double low = 0.0, high = std::log(most / least);
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (share_below(inside(least * std::exp(middle))) < share ? low : high) = middle;
  }
  return inside(least * std::exp(0.5 * (low + high)));
}

double SizeDistribution::diameter_at_mass(double share) const
{
  return quantile(mass, share);
}

std::vector<double> SizeDistribution::radii(int n) const
{
  require(n >= 1 && n <= INT32_MAX / 4, "number of grains is ", n, "; it must lie between 1 and ",
          INT32_MAX / 4);
  std::vector<double> radii;
  double below = least, mass_at_below = 0.0;
  for (int k = 1; k <= n; ++k) {
    const double above = k == n ? most : quantile(number, static_cast<double>(k) / n);
    const double mass_at_above = k == n ? 1.0 : mass(above);
    const double power = n * mean * (mass_at_above - mass_at_below);
    const double diameter = dimension == 2 ? std::sqrt(power) : std::cbrt(power);
    radii.push_back(static_cast<float>(0.5 * std::clamp(diameter, below, above)));
    below = above;
    mass_at_below = mass_at_above;
  }
  return radii;
}

int SizeDistribution::grains_needed() const
{
  const double coarse = 1.0 - number_below(diameter_at_mass(0.9));
  // void ratios of dense packings without friction
  const double void_ratio = dimension == 2 ? 0.15 : 0.5;
  const double solid = mean * (dimension == 2 ? kPi / 4.0 : kPi / 6.0);
  const double of_width = std::pow(WIDTH_OF_CELL * most, dimension) / (solid * (1.0 + void_ratio));
  // The factor keeps the rounding of the shares from adding a grain.
  const double needed = std::ceil((1.0 - 1e-9) * std::max(FEWEST_COARSE / coarse, of_width));
  return static_cast<int>(std::min(needed, static_cast<double>(INT32_MAX)));
}

double diameter_passing(std::vector<double> radii, int dimension, double percent)
{
  require(percent >= 0.0 && percent <= 100.0, "percent passing is ", percent,
          "; it must be from 0 to 100");
  require(!radii.empty(), "there are no grains; a grading needs at least one");
  std::sort(radii.begin(), radii.end());
  const double largest = radii.back();
  std::vector<double> sums;
  double sum = 0.0;
  for (const double radius : radii) {
    sum += std::pow(radius / largest, dimension);
    sums.push_back(sum);
  }
  // A share that the rounding of the sums puts just below a percentage counts as reaching it.
  const double goal = (1.0 - 1e-12) * percent / 100.0 * sum;
  const auto at = std::lower_bound(sums.begin(), sums.end(), goal) - sums.begin();
  return 2.0 * radii[at];
}

Grading grading_of(const std::vector<double> &radii, int dimension)
{
  const auto at = [&](double percent) { return diameter_passing(radii, dimension, percent); };
  return {at(10.0), at(50.0), at(60.0)};
}

template <int D> SizeReport set_sizes(PackingRecipe &recipe, const SizeChoice &choice)
{
  const SizeDistribution sizes(choice, D);
  recipe.radii = sizes.radii(recipe.num_grains);
  const double smallest = 2.0 * recipe.radii.front(), largest = 2.0 * recipe.radii.back();
  SizeReport report{recipe.num_grains, sizes.grains_needed(),    0, smallest, largest,
                    sizes.smallest(),  100.0 * sizes.cut_share()};
  report.coarse = static_cast<int>(
      std::lround(recipe.num_grains * (1.0 - sizes.number_below(sizes.diameter_at_mass(0.9)))));
  if (neighbor_bits<D>(smallest, largest, recipe.material) <= LARGEST_NEIGHBOR_BITS) return report;
  const double limit = largest_size_ratio<D>(reach_of(recipe.material) > 0.0);
  const double begin = sizes.largest() / limit;
  throw InputError(concat("ratio of largest to smallest diameter is ", rounded(largest / smallest),
                          " (", largest, " and ", smallest, " [length]); it must be at most ",
                          limit, ", because ", 1 << LARGEST_NEIGHBOR_BITS,
                          " grains at most may touch one grain. This distribution would "
                          "need ",
                          report.needed, " grains; a part from a diameter of ", begin,
                          " [length] on, which cuts off ", rounded(100.0 * sizes.mass_below(begin)),
                          " % of the mass, can be made"));
}

template SizeReport set_sizes<2>(PackingRecipe &, const SizeChoice &);
template SizeReport set_sizes<3>(PackingRecipe &, const SizeChoice &);

}    // namespace rve
