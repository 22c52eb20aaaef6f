// SPDX-License-Identifier: GPL-2.0-only
// Consistency of shape functions along one axis at every position, including cell edges and nodes.

#include "mpm/shape_functions.h"

#include <gtest/gtest.h>
#include <vector>

using mpm::AxisWeights;

namespace {

constexpr int CELLS = 7;
constexpr double ROUND_OFF = 1e-14;    // a few operations on numbers of order 10

/// Returns positions in cells: multiples of 1/40, which include nodes, cell centres and positions
/// half a GIMP box away from them, and the floating-point neighbours of nodes.
std::vector<double> places()
{
  std::vector<double> result;
  for (int k = 0; k <= 40 * CELLS; ++k) result.push_back(k / 40.0);
  for (int k = 0; k <= CELLS; ++k) {
    if (k > 0) result.push_back(std::nextafter(k, 0.0));
    if (k < CELLS) result.push_back(std::nextafter(k, 100.0));
  }
  return result;
}

void expect_consistent(const AxisWeights &weights, double xi, double place_tolerance)
{
  double value = 0.0, slope = 0.0, place = 0.0, gradient = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double node = weights.first + k;
    EXPECT_GE(weights.value[k], 0.0) << "at " << xi;
    EXPECT_LE(std::abs(weights.slope[k]), 1.0 + ROUND_OFF) << "at " << xi;
    value += weights.value[k];
    slope += weights.slope[k];
    place += weights.value[k] * node;
    gradient += weights.slope[k] * node;
  }
  EXPECT_NEAR(value, 1.0, ROUND_OFF) << "partition of unity at " << xi;
  EXPECT_NEAR(slope, 0.0, ROUND_OFF) << "gradient sum at " << xi;
  EXPECT_NEAR(place, xi, place_tolerance) << "linear function at " << xi;
  EXPECT_NEAR(gradient, 1.0, ROUND_OFF) << "slope of a linear function at " << xi;
}

}    // namespace

TEST(LinearShape, ReproducesLinearFunctionsEverywhere)
{
  for (const double xi : places()) {
    const bool near_node =
        std::abs(xi - std::round(xi)) < 1e-6;    // the margin of linear_weights() is 6e-8
    expect_consistent(mpm::linear_weights(xi, CELLS), xi, near_node ? 0x1p-24 : ROUND_OFF);
  }
}

TEST(GimpShape, ReproducesLinearFunctionsEverywhereForAnyBox)
{
  for (const double half : {0.5, 0.25, 0.3, 0.05})
    for (const double xi : places()) expect_consistent(mpm::gimp_weights(xi, half), xi, ROUND_OFF);
}

TEST(GimpShape, IsTheHatFunctionAveragedOverTheBox)
{
  const double half = 0.3;
  const int samples = 20000;
  for (const double xi : {2.0, 2.1, 2.3, 2.5, 2.65, 2.7, 2.9}) {
    const AxisWeights weights = mpm::gimp_weights(xi, half);
    for (int k = 0; k < 3; ++k) {
      double average = 0.0;
      for (int s = 0; s < samples; ++s) {
        const double place = xi + half * (2.0 * (s + 0.5) / samples - 1.0);
        average += std::max(0.0, 1.0 - std::abs(place - (weights.first + k))) / samples;
      }
      EXPECT_NEAR(weights.value[k], average, 1e-7) << "midpoint rule, kinks between samples";
    }
  }
}

TEST(LinearShape, EveryNodeWithASlopeHasAWeight)
{
  for (const double xi : places()) {
    const AxisWeights weights = mpm::linear_weights(xi, CELLS);
    for (int k = 0; k < 2; ++k) EXPECT_GE(weights.value[k], 0x1p-25) << "at " << xi;
  }
}

TEST(LinearShape, PointOnTheHighSideBelongsToTheLastCell)
{
  const AxisWeights weights = mpm::linear_weights(CELLS, CELLS);

  EXPECT_EQ(weights.first, CELLS - 1);
  EXPECT_NEAR(weights.value[1], 1.0, 0x1p-23);
  EXPECT_EQ(weights.slope[2], 0.0) << "the ghost node feels nothing";
}
