// SPDX-License-Identifier: GPL-2.0-only
// Error messages for wrong input contain the wrong value and the allowed range.

#include "field/marginal.h"
#include "scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

using field::Anisotropy;
using field::CirculantEmbedding;
using field::Covariance;
using field::Exponential;
using field::Gaussian;
using field::Grid;
using rve_test::expect_message;
using rve_test::grid_of;
using rve_test::input_error;

namespace {

std::string embedding_error(const Grid &grid, const Covariance &covariance,
                            std::int64_t limit = CirculantEmbedding::DEFAULT_LIMIT)
{
  return input_error([&] { CirculantEmbedding(grid, covariance, limit); });
}

}    // namespace

TEST(FieldErrors, CorrelationLengthsFitTheGrid)
{
  const Grid grid = grid_of(11, 6, 1.0, 0.5);    // 10 by 2.5
  const auto message = [&](double h, double v, double angle = 0.0) {
    return embedding_error(grid, {Exponential{}, Anisotropy({h, v}, angle)});
  };
  expect_message(message(0.9, 1.0),
                 "horizontal correlation length 0.9 is below the grid spacing, 1 ");
  expect_message(message(1.0, 0.4),
                 "vertical correlation length 0.4 is below the grid spacing, 0.5 ");
  expect_message(message(10.1, 1.0),
                 "horizontal correlation length 10.1 is above the extent of the domain, 10 ");
  expect_message(message(5.0, 2.6),
                 "vertical correlation length 2.6 is above the extent of the domain, 2.5 ");
  // The angle of 90 degrees turns the first correlation length to the vertical axis of the grid.
  expect_message(message(3.0, 1.0, 90.0),
                 "horizontal correlation length 3 is above the extent of the domain, 2.5 ");
  EXPECT_EQ(message(2.5, 10.0, 90.0), "");
  EXPECT_EQ(message(10.0, 2.5), "") << "the extent itself is allowed";
  EXPECT_EQ(message(1.0, 0.5), "") << "the spacing itself is allowed";
}

TEST(FieldErrors, LengthsAndAnglesAreNumbers)
{
  expect_message(input_error([] {
                   Anisotropy({0.0, 1.0});
                 }),
                 "horizontal correlation length must be positive, got 0");
  expect_message(input_error([] {
                   Anisotropy({1.0, NAN});
                 }),
                 "vertical correlation length must be positive, got nan");
  expect_message(input_error([] {
                   Anisotropy({1.0, 2.0}, INFINITY);
                 }),
                 "angle must be from -360 to 360 [degrees], got inf");
}

TEST(FieldErrors, SmoothnessIsInItsRange)
{
  for (const double nu : {0.0, -1.0, 25.1, double(NAN)})
    expect_message(input_error([&] { field::Matern{nu}; }),
                   "smoothness nu of the Matern covariance must be in (0, 25], got " +
                       rve::number(nu));
}

TEST(FieldErrors, GridIsPossible)
{
  const auto message = [](field::Vec lo, field::Vec hi, field::Vec spacing) {
    return input_error([&] { Grid::covering(lo, hi, spacing); });
  };
  expect_message(message({0, 0}, {1, 1}, {0.0, 1.0}), "grid spacing in x must be positive, got 0");
  expect_message(message({0, 0}, {1, 1}, {0.5, 1.5}),
                 "grid spacing in y must be at most the extent of the domain, 1, got 1.5");
  expect_message(message({0, 2}, {1, 1}, {0.5, 0.5}),
                 "domain must have a positive extent in y, got 2 to 1");
  expect_message(message({0, 0}, {1, 1}, {0.5, 1e-10}), "grid would have 1e+10 cells in y");
}

TEST(FieldErrors, TorusBeyondTheLimitNamesTheMissingMemory)
{
  const Covariance covariance{Gaussian{}, Anisotropy({6.0, 4.0})};
  expect_message(embedding_error(grid_of(7, 5), covariance, 95),
                 "the covariance needs a torus of 12 x 8 points, above the limit of 95");
  const std::string message = embedding_error(grid_of(7, 5), covariance, 96);
  expect_message(message, "the embedding on a torus of 12 x 8 points has ");
  expect_message(message, " negative eigenvalues, down to -");
  expect_message(message, "; the next torus has ");
  expect_message(message, " points, above the limit of 96");
  EXPECT_EQ(embedding_error(grid_of(7, 5), covariance), "");
}

TEST(FieldErrors, TorusBeyondTheRangeOfIntegersIsRefusedAtOnce)
{
  // The rotated ellipse is at least about 10^17 spacings wide, more than the limit of FFTW.
  for (const double spacing : {1e-11, 1e-15, 1e-300}) {
    const Grid grid = Grid::covering({0.0, 0.0}, {4.0 * spacing, 1e6}, {spacing, 1e5});
    expect_message(embedding_error(grid, {Gaussian{}, Anisotropy({5e5, 4e5}, 45.0)}),
                   "above the limit of 200000000");
  }
}

TEST(FieldErrors, LengthsWhoseSquaresOverflowAreCompared)
{
  for (const double unit : {1e-200, 1e200}) {
    const Grid grid = Grid::covering({0.0, 0.0}, {10.0 * unit, 10.0 * unit}, {unit, unit});
    EXPECT_EQ(embedding_error(grid, {Exponential{}, Anisotropy({2.0 * unit, 2.0 * unit})}), "");
    expect_message(embedding_error(grid, {Exponential{}, Anisotropy({0.5 * unit, 2.0 * unit})}),
                   "horizontal correlation length " + rve::number(0.5 * unit) +
                       " is below the grid spacing, " + rve::number(unit));
  }
}

TEST(FieldErrors, MarginalsArePossible)
{
  expect_message(input_error([] { field::Normal(NAN, 1.0); }), "mean must be finite, got nan");
  expect_message(input_error([] { field::Normal(1.0, 0.0); }),
                 "standard deviation must be positive, got 0");
  expect_message(input_error([] { field::Lognormal(0.0, 1.0); }),
                 "mean of a lognormal field must be positive, got 0");
  expect_message(input_error([] { field::Lognormal(1.0, -1.0); }),
                 "standard deviation must be positive, got -1");
  expect_message(input_error([] { field::Uniform(2.0, 2.0); }),
                 "lower bound must be below the upper one, got 2 and 2");
  expect_message(input_error([] { field::Bounded(0.0, 1.0, INFINITY, 1.0); }),
                 "location of a bounded field must be finite, got inf");
  expect_message(input_error([] { field::Bounded(0.0, 1.0, 0.0, 0.0); }),
                 "scale of a bounded field must be positive, got 0");
}

TEST(FieldErrors, MarginalsAreFiniteOrRefused)
{
  expect_message(input_error([] { field::Lognormal(1.0, 1e200); }),
                 "standard deviation of a lognormal field must be at most 1e15 times its mean, got "
                 "1e+200 for the mean 1");
  expect_message(
      input_error([] { field::Lognormal(1e300, 1e300); }),
      "values of a lognormal field with the mean 1e+300 and the standard deviation 1e+300 "
      "would leave the range of numbers");
  expect_message(input_error([] { field::Lognormal(1e-300, 1e-300); }),
                 "would leave the range of numbers, 2.3e-308 to 1.8e308: choose another unit");
  expect_message(
      input_error([] { field::Normal(0.0, 1e307); }),
      "mean and 40 standard deviations must add up to less than 1.8e308, got 0 and 1e+307");
  expect_message(input_error([] { field::Uniform(-1e308, 1e308); }),
                 "bounds of a field must be less than 1.8e308 apart, got [-1e+308, 1e+308]");
  expect_message(input_error([] { field::Bounded(-1e308, 1e308, 0.0, 1.0); }),
                 "bounds of a field must be less than 1.8e308 apart");
  // If the constructor accepts its parameters, all values of the field are finite.
  const double numbers[] = {1e-300, 1e-200, 1e-15, 1e-3, 1.0, 1e3, 1e15, 1e200, 1e300, 1.7e308};
  for (const double first : numbers)
    for (const double second : numbers) {
      const auto finite = [&](const auto &make) {
        std::optional<field::Marginal> marginal;
        if (!input_error([&] { marginal.emplace(make()); }).empty()) return;
        for (const double z : {-40.0, -8.6, -1.0, 0.0, 1.0, 8.6, 40.0})
          EXPECT_TRUE(std::isfinite(std::visit([z](const auto &f) { return f(z); }, *marginal)))
              << "kind " << marginal->index() << ", " << first << " " << second << " at " << z;
      };
      finite([&] { return field::Normal(first, second); });
      finite([&] { return field::Lognormal(first, second); });
      finite([&] { return field::Uniform(-first, second); });
      finite([&] { return field::Bounded(-1.0, 1.0, first, second); });
      finite([&] { return field::Bounded(-first, second, 0.0, 1.0); });
    }
}
