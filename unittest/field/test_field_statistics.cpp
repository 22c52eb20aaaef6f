// SPDX-License-Identifier: GPL-2.0-only
// Statistics over many fields. Every estimator is a mean of products of Gaussian numbers. Its
// variance has a closed form: E[abcd] = E[ab]E[cd] + E[ac]E[bd] + E[ad]E[bc] (Isserlis 1918). The
// bound of each check is 4.5 standard deviations. Correct code exceeds this bound in fewer than one
// of a hundred thousand checks. Since seeds are fixed, a check that has passed always passes.

#include "field/normal_numbers.h"
#include "oracle/fourier.h"
#include "scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using field::CirculantEmbedding;
using field::Covariance;
using field::Grid;
using rve_test::all_covariances;
using rve_test::grid_of;
using rve_test::sum_over_pairs;

namespace {

constexpr double BOUND = 4.5;    // standard deviations
constexpr int FIELDS = 2000;

/// A covariance and its fields with the seeds 1, 2, ...
struct Case {
  Covariance covariance;
  std::vector<std::vector<double>> fields{};
};

const Grid grid = grid_of(24, 16);

std::vector<std::vector<double>> fields_of(const Covariance &covariance, int count,
                                           std::uint64_t first_seed = 1)
{
  CirculantEmbedding embedding(grid, covariance);
  std::vector<std::vector<double>> fields;
  for (int k = 0; k < count; ++k) fields.push_back(embedding.sample(first_seed + k));
  return fields;
}

const std::vector<Case> &cases()
{
  static const std::vector<Case> all = [] {
    std::vector<Case> list;
    for (const Covariance &c : all_covariances({5.0, 2.5})) list.push_back({c});
    list.push_back({all_covariances({6.0, 1.5}, 30.0)[0]});
    list.push_back({all_covariances({6.0, 1.5}, 120.0)[2]});
    for (Case &one : list) one.fields = fields_of(one.covariance, FIELDS);
    return list;
  }();
  return all;
}

/// A lag in nodes.
struct Lag {
  int i, j;
};

/// Returns the mean of f(x) g(x + lag) over all x for which x and x + lag are nodes.
double mean_product(const std::vector<double> &f, const std::vector<double> &g, Lag lag)
{
  const int nx = static_cast<int>(grid.nodes[0]), ny = static_cast<int>(grid.nodes[1]);
  double sum = 0.0;
  int pairs = 0;
  for (int j = std::max(0, -lag.j); j < std::min(ny, ny - lag.j); ++j)
    for (int i = std::max(0, -lag.i); i < std::min(nx, nx - lag.i); ++i, ++pairs)
      sum += f[j * nx + i] * g[(j + lag.j) * nx + i + lag.i];
  return sum / pairs;
}

/// Returns the variance of mean_product(f, f, lag) of one field.
double variance_of_mean_product(const Covariance &covariance, Lag lag)
{
  const std::int64_t nx = grid.nodes[0] - std::abs(lag.i), ny = grid.nodes[1] - std::abs(lag.j);
  const double pairs = static_cast<double>(nx * ny);
  return sum_over_pairs(nx, ny,
                        [&](double i, double j) {
                          return std::pow(covariance({i, j}), 2) +
                              covariance({i + lag.i, j + lag.j}) *
                              covariance({i - lag.i, j - lag.j});
                        }) /
      (pairs * pairs);
}

/// Returns the variance of mean_product(f, g, lag) of two independent fields. The expectation of
/// f(x) g(y) is zero for all x and y.
double variance_of_cross_product(const Covariance &covariance, Lag lag)
{
  const std::int64_t nx = grid.nodes[0] - std::abs(lag.i), ny = grid.nodes[1] - std::abs(lag.j);
  const double pairs = static_cast<double>(nx * ny);
  return sum_over_pairs(nx, ny,
                        [&](double i, double j) {
                          return std::pow(covariance({i, j}), 2);
                        }) /
      (pairs * pairs);
}

struct Estimate {
  double value, deviation;
};

Estimate estimated_covariance(const Case &one, Lag lag)
{
  double sum = 0.0;
  for (const auto &f : one.fields) sum += mean_product(f, f, lag);
  const double count = static_cast<double>(one.fields.size());
  return {sum / count, std::sqrt(variance_of_mean_product(one.covariance, lag) / count)};
}

}    // namespace

TEST(FieldStatistics, MeanIsZero)
{
  for (const Case &one : cases()) {
    const double nodes = static_cast<double>(field::total(grid.nodes));
    double mean = 0.0;
    for (const auto &f : one.fields)
      for (const double z : f) mean += z / (nodes * FIELDS);

    const double variance = sum_over_pairs(grid.nodes[0], grid.nodes[1],
                                           [&](double i, double j) {
                                             return one.covariance({i, j});
                                           }) /
        (nodes * nodes * FIELDS);
    EXPECT_LT(std::fabs(mean), BOUND * std::sqrt(variance)) << one.covariance.name();
  }
}

TEST(FieldStatistics, VarianceAndCovarianceAreTheClosedForm)
{
  for (const Case &one : cases()) {
    for (const Lag lag : {Lag{0, 0}, Lag{1, 0}, Lag{0, 1}, Lag{3, 0}, Lag{0, 3}, Lag{2, 2},
                          Lag{-2, 2}, Lag{6, 1}, Lag{10, 6}, Lag{15, 0}, Lag{0, 12}}) {
      const Estimate estimate = estimated_covariance(one, lag);

      EXPECT_NEAR(estimate.value, one.covariance({double(lag.i), double(lag.j)}),
                  BOUND * estimate.deviation)
          << one.covariance.name() << ", lag " << lag.i << " " << lag.j;
      EXPECT_LT(estimate.deviation, 0.02) << "so this means something";
    }
  }
}

TEST(FieldStatistics, RatioOfTheCorrelationLengthsIsTheAnisotropy)
{
  // Along each axis of the ellipse, the exponential covariance C gives the correlation length as
  // -lag/ln C. An error dC of C is a relative error dC/(C |ln C|) of the length.
  for (const bool turned : {false, true}) {
    const double angle = turned ? std::atan2(3.0, 4.0) * 180.0 / M_PI : 0.0;
    Case one{{field::Exponential{}, field::Anisotropy({8.0, 2.0}, angle)}};
    one.fields = fields_of(one.covariance, FIELDS);
    const Lag along = turned ? Lag{8, 6} : Lag{8, 0}, across = turned ? Lag{-3, 4} : Lag{0, 2};
    double length[2], error[2];
    for (const int axis : {0, 1}) {
      const Lag lag = axis == 0 ? along : across;
      const Estimate c = estimated_covariance(one, lag);
      length[axis] = -std::hypot(lag.i, lag.j) / std::log(c.value);
      error[axis] = c.deviation / (c.value * std::fabs(std::log(c.value)));
    }

    // The standard deviation of the ratio is computed to first order in `error`. Terms of second
    // order are a few per cent of it, so the bound is 10 % larger.
    const double deviation = 4.0 * std::hypot(error[0], error[1]);
    EXPECT_NEAR(length[0] / length[1], 4.0, 1.1 * BOUND * deviation);
    EXPECT_LT(deviation, 0.2) << "so this means something";
  }
}

TEST(FieldStatistics, PowerAtEachWaveNumberIsTheEigenvalue)
{
  // Let X_k be the Fourier transform of the field at the wave number k, lambda_k the eigenvalue and
  // N the number of points. If k differs from -k, |X_k|^2/(N lambda_k) is exponentially distributed
  // (mean 1, variance 1). Otherwise it is chi-squared with one degree of freedom (mean 1, variance
  // 2). The test averages over rings of wave numbers and counts only one of k and -k.
  for (const Covariance &covariance : all_covariances({4.0, 2.0})) {
    const Grid grid = grid_of(17, 13);
    CirculantEmbedding embedding(grid, covariance);
    const field::Size torus = embedding.torus();
    const double points = static_cast<double>(field::total(torus));
    std::vector<double> c;
    for (std::int64_t j = 0; j < torus[1]; ++j)
      for (std::int64_t i = 0; i < torus[0]; ++i)
        c.push_back(covariance({static_cast<double>(std::min(i, torus[0] - i)),
                                static_cast<double>(std::min(j, torus[1] - j))}));
    const auto eigenvalues = rve_test::fourier_transform(torus, c);
    constexpr int RINGS = 8, SAMPLES = 60;
    double sum[RINGS] = {}, variance[RINGS] = {}, count[RINGS] = {};
    for (int sample = 0; sample < SAMPLES; ++sample) {
      field::NormalNumbers normal(sample);
      std::vector<double> noise(c.size());
      normal.fill(noise.data(), static_cast<std::int64_t>(noise.size()));
      const auto spectrum = rve_test::fourier_transform(torus, embedding.field_on_torus(noise));
      for (std::int64_t l = 0; l < torus[1]; ++l)
        for (std::int64_t k = 0; k < torus[0]; ++k) {
          const std::int64_t at = l * torus[0] + k;
          const std::int64_t negative =
              (torus[1] - l) % torus[1] * torus[0] + (torus[0] - k) % torus[0];
          const double eigenvalue = eigenvalues[at].real();
          // Most eigenvalues of the Gaussian covariance are zero within rounding errors.
          if (negative < at || eigenvalue < 1e-6) continue;
          const double radius = std::hypot(
              static_cast<double>(std::min(k, torus[0] - k)) / static_cast<double>(torus[0]),
              static_cast<double>(std::min(l, torus[1] - l)) / static_cast<double>(torus[1]));
          const int ring = std::min(static_cast<int>(radius / 0.5 * RINGS), RINGS - 1);
          sum[ring] += std::norm(spectrum[at]) / (points * eigenvalue);
          variance[ring] += negative == at ? 2.0 : 1.0;
          count[ring] += 1.0;
        }
    }
    for (int ring = 0; ring < RINGS; ++ring) {
      if (count[ring] == 0.0) continue;
      EXPECT_NEAR(sum[ring] / count[ring], 1.0, BOUND * std::sqrt(variance[ring]) / count[ring])
          << covariance.name() << ", ring " << ring;
    }
  }
}

TEST(FieldStatistics, FieldsOfTwoSeedsAreIndependent)
{
  for (const Case &one : cases()) {
    const auto distant = fields_of(one.covariance, FIELDS / 2, std::uint64_t(1) << 40);
    for (const Lag lag : {Lag{0, 0}, Lag{1, 0}, Lag{0, -1}, Lag{5, 3}}) {
      // `neighbors` is the mean over the pairs of seeds 1 and 2, 2 and 3, ... Although a field
      // occurs in two pairs, the products of different pairs are uncorrelated. `strangers` is the
      // mean over the pairs 1 and 2^40, 2 and 2^40 + 1, ...
      double neighbors = 0.0, strangers = 0.0;
      for (int k = 0; k < FIELDS / 2; ++k) {
        neighbors += mean_product(one.fields[k], one.fields[k + 1], lag) / (FIELDS / 2);
        strangers += mean_product(one.fields[k], distant[k], lag) / (FIELDS / 2);
      }

      const double bound =
          BOUND * std::sqrt(variance_of_cross_product(one.covariance, lag) / (FIELDS / 2));
      EXPECT_LT(std::fabs(neighbors), bound)
          << one.covariance.name() << ", lag " << lag.i << " " << lag.j;
      EXPECT_LT(std::fabs(strangers), bound)
          << one.covariance.name() << ", lag " << lag.i << " " << lag.j;
    }
  }
}

TEST(NormalNumbers, AreNormalAndUncorrelated)
{
  constexpr int COUNT = 1000000;
  std::vector<double> z(COUNT);
  field::NormalNumbers(3).fill(z.data(), COUNT);

  // The mean of z^k over n numbers has the variance (E[z^2k] - E[z^k]^2)/n, with E[z^2] = 1, E[z^4]
  // = 3, E[z^6] = 15 and E[z^8] = 105.
  double moment[5] = {}, correlation[3] = {};
  for (int i = 0; i < COUNT; ++i) {
    for (int k = 1; k <= 4; ++k) moment[k] += std::pow(z[i], k) / COUNT;
    for (int d = 1; d <= 2; ++d) correlation[d] += z[i] * z[(i + d) % COUNT] / COUNT;
  }
  const double root = std::sqrt(COUNT);
  EXPECT_NEAR(moment[1], 0.0, BOUND * 1.0 / root);
  EXPECT_NEAR(moment[2], 1.0, BOUND * std::sqrt(2.0) / root);
  EXPECT_NEAR(moment[3], 0.0, BOUND * std::sqrt(15.0) / root);
  EXPECT_NEAR(moment[4], 3.0, BOUND * std::sqrt(96.0) / root);
  for (int d = 1; d <= 2; ++d) EXPECT_NEAR(correlation[d], 0.0, BOUND / root);
}

TEST(NormalNumbers, AreTheDocumentedTransformOfTheStandardsGenerator)
{
  // By the C++ standard, the 10000th number of the default seed 5489 is 9981545732273789042.
  std::mt19937_64 reference;
  reference.discard(9999);
  ASSERT_EQ(reference(), 9981545732273789042u);
  std::mt19937_64 engine(7);
  const double u = (static_cast<double>(engine() >> 11) + 1.0) / 9007199254740992.0;
  const double v = static_cast<double>(engine() >> 11) / 9007199254740992.0;

  double z[2];
  field::NormalNumbers(7).fill(z, 2);

  // The compiler can evaluate the same formula differently here, so a few rounding errors remain.
  EXPECT_NEAR(z[0], std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * M_PI * v), 1e-14);
  EXPECT_NEAR(z[1], std::sqrt(-2.0 * std::log(u)) * std::sin(2.0 * M_PI * v), 1e-14);
}
