// SPDX-License-Identifier: GPL-2.0-only
// Marginal distributions against closed forms. Values of many independent fields are checked by the
// Kolmogorov-Smirnov test.

#include "field/interpolation.h"
#include "field/marginal.h"
#include "scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using field::Bounded;
using field::CirculantEmbedding;
using field::Lognormal;
using field::Normal;
using field::Uniform;

namespace {

double normal_distribution(double z)
{
  return 0.5 * std::erfc(-z / std::sqrt(2.0));
}

/// Returns the integral of f(z) exp(-z^2/2)/sqrt(2 pi) over all z. For this integrand, the error of
/// the trapezoidal rule is only a rounding error.
template <class Function> double expectation(const Function &f)
{
  const double step = 1.0 / 64.0;
  double sum = 0.0;
  for (int k = -12 * 64; k <= 12 * 64; ++k)
    sum += f(k * step) * std::exp(-0.5 * k * step * k * step);
  return sum * step / std::sqrt(2.0 * M_PI);
}

/// Returns the largest distance between the empirical distribution function of the numbers and
/// `distribution`.
template <class Distribution>
double kolmogorov_distance(std::vector<double> numbers, const Distribution &distribution)
{
  std::sort(numbers.begin(), numbers.end());
  const double count = static_cast<double>(numbers.size());
  double distance = 0.0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const double f = distribution(numbers[k]);
    distance = std::max({distance, std::fabs(f - static_cast<double>(k) / count),
                         std::fabs(f - static_cast<double>(k + 1) / count)});
  }
  return distance;
}

constexpr int FIELDS = 4000;

/// Returns four samples of Gaussian values, each with one value of every field: at a node with
/// linear and with nearest interpolation, then at a point between nodes with both interpolations.
std::vector<std::vector<double>> gaussian_values()
{
  const field::Grid grid = rve_test::grid_of(9, 7);
  const field::Covariance covariance = rve_test::all_covariances({3.0, 1.5}, 15.0)[0];
  CirculantEmbedding embedding(grid, covariance);
  const field::Vec node{grid.origin[0] + 4.0, grid.origin[1] + 3.0};
  const field::Vec between{grid.origin[0] + 3.5, grid.origin[1] + 2.45};
  std::vector<std::vector<double>> values(4);
  for (int k = 0; k < FIELDS; ++k) {
    const std::vector<double> nodes = embedding.sample(k);
    for (const int at : {0, 1})
      for (const int kind : {0, 1}) {
        const field::Interpolation interpolation(kind == 0 ? field::InterpolationKind::Linear
                                                           : field::InterpolationKind::Nearest,
                                                 grid, covariance);
        values[2 * at + kind].push_back(interpolation.value(nodes, at == 0 ? node : between));
      }
  }
  return values;
}

template <class Marginal, class Distribution>
void expect_distribution(const Marginal &marginal, const Distribution &distribution)
{
  for (std::vector<double> values : gaussian_values()) {
    for (double &z : values) z = marginal(z);
    // for large n, P(sqrt(n) D > t) = 2 exp(-2 t^2) (Kolmogorov), which is 1e-5 for t = 2.47
    EXPECT_LT(kolmogorov_distance(values, distribution), 2.47 / std::sqrt(FIELDS));
  }
}

}    // namespace

TEST(Marginal, NormalValuesAreNormallyDistributed)
{
  expect_distribution(Normal(0.4, 0.05),
                      [](double y) { return normal_distribution((y - 0.4) / 0.05); });
}

TEST(Marginal, LognormalValuesHaveTheRequestedMeanAndDeviation)
{
  const double mean = 20e3, deviation = 8e3;
  const Lognormal marginal(mean, deviation);

  const double m = expectation(marginal);
  const double s = std::sqrt(expectation([&](double z) { return std::pow(marginal(z) - m, 2); }));

  EXPECT_NEAR(m, mean, 1e-10 * mean);    // rounding of a sum of some 1000 terms
  EXPECT_NEAR(s, deviation, 1e-10 * mean);
  const double zeta = std::sqrt(std::log(1.16)), lambda = std::log(mean) - 0.5 * zeta * zeta;
  expect_distribution(marginal,
                      [&](double y) { return normal_distribution((std::log(y) - lambda) / zeta); });
}

TEST(Marginal, UniformValuesAreUniformlyDistributed)
{
  expect_distribution(Uniform(-1.0, 3.0), [](double y) { return (y + 1.0) / 4.0; });
}

TEST(Marginal, BoundedValuesHaveTheDistributionOfTheTransformedNormalNumber)
{
  // P(Y < y) = Phi((pi ln((y - lo)/(hi - y)) - location) / scale)
  const auto distribution = [](double y) {
    return normal_distribution((M_PI * std::log((y - 0.15) / (0.3 - y)) - 1.0) / 2.0);
  };
  expect_distribution(Bounded(0.15, 0.3, 1.0, 2.0), distribution);
  // If the location is 0, the distribution is symmetric about the middle of the interval.
  for (const double z : {0.1, 1.0, 4.0})
    EXPECT_NEAR(Bounded(2.0, 4.0, 0.0, 1.5)(z) - 3.0, 3.0 - Bounded(2.0, 4.0, 0.0, 1.5)(-z), 1e-15);
}

TEST(Marginal, ValuesNeverLeaveTheBounds)
{
  // In binary numbers 0.1 + (0.3 - 0.1) is greater than 0.3.
  for (const double z : {-40.0, -8.57, -1.0, 0.0, 1.0, 8.57, 40.0})
    for (const auto &interval : {std::pair<double, double>{0.1, 0.3}, {-1e300, -1e-300}}) {
      const double u = Uniform(interval.first, interval.second)(z);
      const double b = Bounded(interval.first, interval.second, 3.0, 5.0)(z);
      for (const double y : {u, b}) {
        EXPECT_GE(y, interval.first);
        EXPECT_LE(y, interval.second);
      }
    }
}

TEST(Marginal, CovarianceOfALognormalFieldIsTheClosedForm)
{
  // C_Y = mean^2 (exp(zeta^2 rho) - 1) with the correlation rho of the Gaussian field. Its
  // estimator is the mean of (X - mean)(Y - mean). The variance of the estimator follows from the
  // moments E[X^a Y^b] = exp(lambda (a+b) + zeta^2/2 (a^2 + b^2 + 2 a b rho)).
  const double mean = 2.0, deviation = 0.8;
  const Lognormal marginal(mean, deviation);
  const double zeta2 = std::log(1.16), lambda = std::log(mean) - 0.5 * zeta2;
  const field::Grid grid = rve_test::grid_of(6, 4);
  for (const field::Covariance &covariance : rve_test::all_covariances({3.0, 1.5})) {
    CirculantEmbedding embedding(grid, covariance);
    const double rho = covariance({2.0, 1.0});
    double sum = 0.0;
    for (int k = 0; k < FIELDS; ++k) {
      const std::vector<double> nodes = embedding.sample(k);
      sum += (marginal(nodes[0]) - mean) * (marginal(nodes[grid.index({2, 1})]) - mean);
    }

    const auto moment = [&](int a, int b) {
      return std::exp(lambda * (a + b) + 0.5 * zeta2 * (a * a + b * b + 2.0 * a * b * rho));
    };
    const double closed_form = mean * mean * std::expm1(zeta2 * rho);
    // E[(X-m)^2 (Y-m)^2], expanded
    const int binomial[3] = {1, -2, 1};
    double fourth = 0.0;
    for (int a = 0; a <= 2; ++a)
      for (int b = 0; b <= 2; ++b)
        fourth += binomial[a] * binomial[b] * std::pow(mean, 4 - a - b) * moment(a, b);
    const double error = std::sqrt((fourth - closed_form * closed_form) / FIELDS);
    EXPECT_NEAR(sum / FIELDS, closed_form, 4.5 * error) << covariance.name();
    EXPECT_LT(error, 0.1 * closed_form) << "so this means something";
  }
}
