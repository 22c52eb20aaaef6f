// SPDX-License-Identifier: GPL-2.0-only
// Covariance functions against closed forms and against an integral for the Bessel function.

#include "scenes.h"

#include <gtest/gtest.h>

#include <cmath>

using field::Anisotropy;
using field::Covariance;
using field::Exponential;
using field::Gaussian;
using field::Matern;

namespace {

/// Returns K_nu(s), the integral of exp(-s cosh t) cosh(nu t) over t from 0 to infinity. For this
/// integrand, the trapezoidal rule converges exponentially.
double bessel_k(double nu, double s)
{
  const double step = 1.0 / 64.0;
  double sum = 0.5 * std::exp(-s);
  for (int k = 1; k < 64 * 20; ++k)
    sum += std::exp(-s * std::cosh(k * step)) * std::cosh(nu * k * step);
  return sum * step;
}

}    // namespace

TEST(Covariance, IsOneAtLagZeroAndDecays)
{
  for (const Covariance &covariance : rve_test::all_covariances({2.0, 0.7}, 20.0)) {
    EXPECT_EQ(covariance({0.0, 0.0}), 1.0) << covariance.name();
    double last = 1.0;
    for (int k = 1; k < 100; ++k) {
      const double value = covariance({0.1 * k, -0.03 * k});
      EXPECT_LT(value, last) << covariance.name();
      EXPECT_GE(value, 0.0) << covariance.name();
      last = value;
    }
  }
}

TEST(Covariance, MaternIsTheBesselFunctionOfItsDefinition)
{
  for (const double nu : {0.1, 0.3, 0.8, 1.0, 2.7, 10.0, 25.0})
    for (const double r : {0.01, 0.1, 0.5, 1.0, 2.0, 4.0}) {
      const double s = std::sqrt(2.0 * nu) * r;
      const double expected =
          std::pow(2.0, 1.0 - nu) / std::tgamma(nu) * std::pow(s, nu) * bessel_k(nu, s);
      // Both values are accurate to about 14 digits. A power of up to 25 multiplies the rounding
      // error of s by its exponent.
      EXPECT_NEAR(Matern(nu)(r), expected, 1e-12) << "nu " << nu << ", r " << r;
    }
}

TEST(Covariance, ClosedFormsOfHalfIntegerSmoothnessAreLimitsOfTheBesselFunction)
{
  for (const double nu : {0.5, 1.5, 2.5})
    for (const double r : {0.05, 0.3, 1.0, 3.0, 10.0})
      // For nu + 1e-9 the code evaluates the Bessel function instead of the closed form. The value
      // itself changes by less than 1e-8.
      EXPECT_NEAR(Matern(nu)(r), Matern(nu + 1e-9)(r), 1e-8) << "nu " << nu << ", r " << r;
}

TEST(Covariance, MaternGoesFromExponentialToGaussian)
{
  for (const double r : {0.1, 1.0, 2.0}) {
    EXPECT_DOUBLE_EQ(Matern(0.5)(r), Exponential{}(r));
    // The difference decreases as 1/nu. For nu = 25 it is at most 0.01.
    EXPECT_NEAR(Matern(25.0)(r), Gaussian{}(r), 0.01);
    EXPECT_LT(std::fabs(Matern(25.0)(r) - Gaussian{}(r)),
              0.6 * std::fabs(Matern(12.0)(r) - Gaussian{}(r)));
  }
}

TEST(Covariance, MaternHasItsLimitsAtTinyAndHugeDistances)
{
  for (const double nu : {0.05, 0.8, 25.0}) {
    EXPECT_EQ(Matern(nu)(0.0), 1.0);
    EXPECT_EQ(Matern(nu)(1e6), 0.0);
    // for nu = 0.05 the value 1 - O(r^(2 nu)) is still far from 1
    EXPECT_NEAR(Matern(nu)(1e-30), 1.0, nu < 0.1 ? 0.01 : 1e-12);
  }
}

TEST(Anisotropy, CorrelationLengthsHoldAlongTheRotatedAxes)
{
  for (const double angle : {0.0, 30.0, 90.0, -45.0, 200.0}) {
    const Anisotropy ellipse({5.0, 0.5}, angle);
    const double c = std::cos(angle * M_PI / 180.0), s = std::sin(angle * M_PI / 180.0);

    EXPECT_NEAR(ellipse.distance({5.0 * c, 5.0 * s}), 1.0, 1e-14) << angle;
    EXPECT_NEAR(ellipse.distance({-0.5 * s, 0.5 * c}), 1.0, 1e-14) << angle;
    EXPECT_NEAR(ellipse.distance({5.0 * c - 0.5 * s, 5.0 * s + 0.5 * c}), std::sqrt(2.0), 1e-14)
        << angle;
  }
}

TEST(Anisotropy, HalfWidthIsTheFarthestPointOfTheEllipse)
{
  const Anisotropy ellipse({5.0, 0.5}, 30.0);
  double farthest[2] = {0.0, 0.0};
  for (int k = 0; k < 3600; ++k) {
    const double t = 2.0 * M_PI * k / 3600.0;
    for (int a = 0; a < 2; ++a)
      farthest[a] = std::fmax(farthest[a],
                              5.0 * std::cos(t) * ellipse.direction(0)[a] +
                                  0.5 * std::sin(t) * ellipse.direction(1)[a]);
  }
  // Samples are 0.1 degrees apart. The farthest sample is therefore nearer than the farthest point
  // by a relative difference of at most (0.1 degrees)^2/8 = 4e-7.
  for (int a = 0; a < 2; ++a) EXPECT_NEAR(ellipse.half_width(a), farthest[a], 5.0 * 4e-7);
}

TEST(Anisotropy, QuarterTurnsAndCirclesKeepTheirReflectionsExactly)
{
  EXPECT_TRUE(Anisotropy({5.0, 0.5}, 0.0).is_aligned());
  EXPECT_TRUE(Anisotropy({5.0, 0.5}, 90.0).is_aligned());
  EXPECT_TRUE(Anisotropy({5.0, 0.5}, -270.0).is_aligned());
  EXPECT_TRUE(Anisotropy({0.5, 0.5}, 33.0).is_aligned());
  EXPECT_FALSE(Anisotropy({5.0, 0.5}, 33.0).is_aligned());
}
