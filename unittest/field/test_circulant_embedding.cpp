// SPDX-License-Identifier: GPL-2.0-only
// Exactness of the circulant embedding. The second moments of its fields are computed without
// sampling and compared with the dense covariance matrix and its Cholesky factor.

#include "oracle/dense_matrix.h"
#include "oracle/fourier.h"
#include "scenes.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using field::CirculantEmbedding;
using field::Covariance;
using field::Grid;
using rve_test::all_covariances;
using rve_test::covariance_matrix;
using rve_test::fourier_transform;
using rve_test::grid_of;
using rve_test::largest_difference;
using rve_test::Matrix;
using rve_test::solve_lower;

namespace {

/// Returns the matrix of the linear map from the noise on the torus to the nodes. Column p is the
/// field of the unit vector p.
Matrix map_of(CirculantEmbedding &embedding, const Grid &grid)
{
  const std::size_t nodes = field::total(grid.nodes), points = field::total(embedding.torus());
  Matrix map(nodes, std::vector<double>(points));
  std::vector<double> noise(points, 0.0);
  for (std::size_t p = 0; p < points; ++p) {
    noise[p] = 1.0;
    const std::vector<double> torus = embedding.field_on_torus(noise);
    noise[p] = 0.0;
    for (std::int64_t j = 0; j < grid.nodes[1]; ++j)
      for (std::int64_t i = 0; i < grid.nodes[0]; ++i)
        map[j * grid.nodes[0] + i][p] = torus[j * embedding.torus()[0] + i];
  }
  return map;
}

/// Returns covariances at the shortest distance on a torus. If both directions around the torus are
/// equally long, the covariance is the mean of both.
std::vector<double> covariance_on(const field::Size &torus, const Grid &grid,
                                  const Covariance &covariance)
{
  const auto lags = [&](int axis, std::int64_t j) -> std::vector<double> {
    const double there = static_cast<double>(j) * grid.spacing[axis];
    const double back = static_cast<double>(j - torus[axis]) * grid.spacing[axis];
    if (2 * j == torus[axis]) return {there, back};
    return {2 * j < torus[axis] ? there : back};
  };
  std::vector<double> values;
  for (std::int64_t j = 0; j < torus[1]; ++j)
    for (std::int64_t i = 0; i < torus[0]; ++i) {
      double sum = 0.0;
      int count = 0;
      for (const double x : lags(0, i))
        for (const double y : lags(1, j)) {
          sum += covariance({x, y});
          ++count;
        }
      values.push_back(sum / count);
    }
  return values;
}

std::vector<double> noise_on(const field::Size &torus, std::uint64_t seed)
{
  rve_test::Random random(seed);
  std::vector<double> noise(field::total(torus));
  for (double &w : noise) w = random.uniform(-1.0, 1.0);
  return noise;
}

struct Case {
  Grid grid;
  Covariance covariance;
};

std::vector<Case> cases()
{
  std::vector<Case> all;
  for (const double angle : {0.0, 90.0, 25.0, -70.0})
    for (const Covariance &c : all_covariances({1.7, 0.9}, angle))
      all.push_back({grid_of(7, 5, 0.5, 0.6), c});
  for (const Covariance &c : all_covariances({0.9, 1.0}))
    all.push_back({grid_of(2, 9, 0.9, 0.3), c});
  return all;
}

}    // namespace

TEST(CirculantEmbedding, SecondMomentsAreTheCovarianceMatrix)
{
  for (const Case &one : cases()) {
    CirculantEmbedding embedding(one.grid, one.covariance);

    const Matrix moments = rve_test::times_own_transpose(map_of(embedding, one.grid));

    // The tolerance covers two errors. The rounding error of two transforms of at most about 1000
    // points is 2 log2(1000) epsilon = 4e-15. In addition, small eigenvalues are set to zero.
    EXPECT_LT(largest_difference(moments, covariance_matrix(one.grid, one.covariance)), 2e-14)
        << one.covariance.name() << " on " << field::to_string(one.grid.nodes) << ", torus "
        << field::to_string(embedding.torus());
  }
}

TEST(CirculantEmbedding, EqualsTheCholeskyFactorUpToARotation)
{
  for (const Case &one : cases()) {
    const Matrix factor = rve_test::cholesky_factor(covariance_matrix(one.grid, one.covariance));
    CirculantEmbedding embedding(one.grid, one.covariance);

    // Let A be the map and L the Cholesky factor. Since A A^T = L L^T, the rows of L^-1 A are
    // orthonormal. This test gives small and large eigenvalues of the covariance the same weight.
    const Matrix rotation = solve_lower(factor, map_of(embedding, one.grid));

    const Matrix inverse = solve_lower(factor, rve_test::identity(factor.size()));
    double norm_squared = 0.0;
    for (const auto &row : inverse)
      for (const double x : row) norm_squared += x * x;
    // A A^T has errors of 2e-14 (see the test above). L^-1 magnifies them by a factor of at most
    // n |L^-1|^2, with n nodes and the Frobenius norm.
    const double tolerance = 2e-14 * static_cast<double>(factor.size()) * norm_squared;
    if (one.covariance.name() == "exponential") {
      EXPECT_LT(tolerance, 1e-9);    // the test is sharp
    }
    EXPECT_LT(largest_difference(rve_test::times_own_transpose(rotation),
                                 rve_test::identity(factor.size())),
              tolerance)
        << one.covariance.name();
  }
}

TEST(CirculantEmbedding, NegativeEigenvaluesAreFoundAndPaddedAway)
{
  std::vector<Covariance> covariances = all_covariances({6.0, 4.0});
  for (const Covariance &turned : all_covariances({6.0, 2.0}, 20.0)) covariances.push_back(turned);
  for (const Covariance &covariance : covariances) {
    const Grid grid = grid_of(7, 5);
    CirculantEmbedding embedding(grid, covariance);

    const field::TorusReport &first = embedding.trials().front(), &last = embedding.trials().back();
    ASSERT_GT(embedding.trials().size(), 1u) << covariance.name();
    EXPECT_EQ(first.points,
              covariance.anisotropy.is_aligned() ? (field::Size{12, 8}) : (field::Size{14, 10}));
    for (const field::TorusReport *report : {&first, &last}) {
      std::vector<double> eigenvalues;
      double negative_sum = 0.0;
      for (const auto &lambda :
           fourier_transform(report->points, covariance_on(report->points, grid, covariance))) {
        eigenvalues.push_back(lambda.real());
        if (lambda.real() < -report->tolerance) negative_sum -= lambda.real();
      }
      const auto negative = std::count_if(eigenvalues.begin(), eigenvalues.end(),
                                          [&](double x) { return x < -report->tolerance; });
      EXPECT_EQ(report->num_negative, negative) << covariance.name();
      EXPECT_NEAR(report->smallest, *std::min_element(eigenvalues.begin(), eigenvalues.end()),
                  2.0 * report->tolerance);
      EXPECT_NEAR(report->largest, *std::max_element(eigenvalues.begin(), eigenvalues.end()),
                  2.0 * report->tolerance);
      EXPECT_NEAR(report->covariance_error,
                  negative_sum / static_cast<double>(field::total(report->points)),
                  report->tolerance);
    }
    EXPECT_GT(first.num_negative, 0) << covariance.name();
    EXPECT_GT(first.covariance_error, 1e-4) << "clipping would be a real error";
    EXPECT_EQ(last.num_negative, 0) << covariance.name();
    EXPECT_LT(last.covariance_error, 1e-13) << "what is set to zero is rounding";
    for (int a = 0; a < 2; ++a) EXPECT_EQ(embedding.padding()[a], last.points[a] - first.points[a]);
    // With the padding the field is exact.
    EXPECT_LT(largest_difference(rve_test::times_own_transpose(map_of(embedding, grid)),
                                 covariance_matrix(grid, covariance)),
              1e-13)
        << covariance.name();
  }
}

TEST(CirculantEmbedding, TorusOfTwiceTheGridSufficesForShortCorrelations)
{
  for (const Covariance &covariance : all_covariances({2.0, 2.0})) {
    CirculantEmbedding embedding(grid_of(65, 49), covariance);

    EXPECT_EQ(embedding.trials().size(), 1u) << covariance.name();
    EXPECT_EQ(embedding.torus(), (field::Size{128, 96})) << covariance.name();
    EXPECT_EQ(embedding.padding(), (field::Size{0, 0})) << covariance.name();
  }
}

TEST(CirculantEmbedding, FieldHasTheSpectrumOfParseval)
{
  for (const Covariance &covariance : all_covariances({3.0, 2.0})) {
    const Grid grid = grid_of(17, 13);
    CirculantEmbedding embedding(grid, covariance);
    const field::Size torus = embedding.torus();
    const std::vector<double> noise = noise_on(torus, 5);

    const std::vector<double> field = embedding.field_on_torus(noise);

    const auto eigenvalues = fourier_transform(torus, covariance_on(torus, grid, covariance));
    const auto amplitude = fourier_transform(torus, noise);
    const auto spectrum = fourier_transform(torus, field);
    const double points = static_cast<double>(field::total(torus));
    double energy = 0.0, spectral_energy = 0.0;
    for (std::size_t k = 0; k < field.size(); ++k) {
      energy += field[k] * field[k];
      spectral_energy += std::fmax(eigenvalues[k].real(), 0.0) * std::norm(amplitude[k]) / points;
      // The power at each wave number follows from the noise and the eigenvalue.
      EXPECT_NEAR(std::norm(spectrum[k]),
                  std::fmax(eigenvalues[k].real(), 0.0) * std::norm(amplitude[k]), 1e-9 * points)
          << covariance.name();
    }
    EXPECT_NEAR(energy, spectral_energy, 1e-11 * energy) << covariance.name();
  }
}

TEST(CirculantEmbedding, SameSeedGivesTheSameBits)
{
  const Grid grid = grid_of(40, 30);
  const Covariance covariance = all_covariances({5.0, 3.0}, 10.0)[0];
  CirculantEmbedding first(grid, covariance), second(grid, covariance);

  const std::vector<double> field = first.sample(11);

  EXPECT_EQ(field, second.sample(11));
  EXPECT_EQ(field, first.sample(11)) << "a sample leaves nothing behind";
  EXPECT_NE(field, first.sample(12));
}
