// SPDX-License-Identifier: GPL-2.0-only
// Tests fractional coordinates that are stored as wrapping integers, and rounding to integers.

#include "rve/core/fixed_point.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace rve;
using rve_test::Random;

namespace {

__extension__ typedef __int128 Integer128;

template <class Format> class FractionOfTheCell : public ::testing::Test {
};
using Formats = ::testing::Types<FastNumbers, MixedNumbers, DoubleNumbers>;
TYPED_TEST_SUITE(FractionOfTheCell, Formats);

/// Returns the number of units in the cell, 2^32 or 2^64.
template <class Format> Integer128 units_in_cell()
{
  return Integer128(1) << (8 * sizeof(typename Format::Coordinate));
}

/// Adds whole cells to `difference` until it is in [-1/2, 1/2) of a cell.
Integer128 nearest_image(Integer128 difference, Integer128 cell)
{
  while (difference >= cell / 2) difference -= cell;
  while (difference < -(cell / 2)) difference += cell;
  return difference;
}

template <class Coordinate> Coordinate random_coordinate(Random &random)
{
  return static_cast<Coordinate>(random.bits() >> (64 - 8 * sizeof(Coordinate)));
}

}    // namespace

TYPED_TEST(FractionOfTheCell, WrappedDifferenceIsTheNearestImage)
{
  using Coordinate = typename TypeParam::Coordinate;
  Random random(1);
  const Integer128 cell = units_in_cell<TypeParam>();

  for (int sample = 0; sample < 10000; ++sample) {
    const Vec<Coordinate, 2> from{
        {random_coordinate<Coordinate>(random), random_coordinate<Coordinate>(random)}};
    const Vec<Coordinate, 2> to{
        {random_coordinate<Coordinate>(random), random_coordinate<Coordinate>(random)}};

    const auto difference = fractional_difference<TypeParam>(to, from);

    for (int a = 0; a < 2; ++a) {
      const Integer128 expected = nearest_image(Integer128(to[a]) - Integer128(from[a]), cell);
      // The expected number is the exact integer, rounded once.
      const auto rounded =
          static_cast<typename TypeParam::Wide>(static_cast<std::int64_t>(expected));
      ASSERT_EQ(difference[a], rounded);
    }
  }
}

TYPED_TEST(FractionOfTheCell, NeighboursAcrossTheBoundaryAreCloseInUnits)
{
  using Coordinate = typename TypeParam::Coordinate;
  const Coordinate last = std::numeric_limits<Coordinate>::max();

  const auto forward = fractional_difference<TypeParam>(Vec<Coordinate, 2>{{2, last}},
                                                        Vec<Coordinate, 2>{{last, 2}});

  EXPECT_EQ(forward[0], 3.0);
  EXPECT_EQ(forward[1], -3.0);
}

TYPED_TEST(FractionOfTheCell, ExchangeOfThePointsChangesTheSignAndNothingElse)
{
  using Coordinate = typename TypeParam::Coordinate;
  Random random(2);

  for (int sample = 0; sample < 10000; ++sample) {
    const Vec<Coordinate, 2> x{{random_coordinate<Coordinate>(random), 1}};
    const Vec<Coordinate, 2> y{{random_coordinate<Coordinate>(random), 7}};

    const auto forth = fractional_difference<TypeParam>(x, y);
    const auto back = fractional_difference<TypeParam>(y, x);

    ASSERT_EQ(forth[0], -back[0]);
    ASSERT_EQ(forth[1], -back[1]);
  }
}

TYPED_TEST(FractionOfTheCell, UnitTimesCellGivesLength)
{
  const Tensor2 cell{{2.0, 0.5, 0.0, 3.0}};
  using Coordinate = typename TypeParam::Coordinate;
  const Coordinate quarter = Coordinate(1) << (8 * sizeof(Coordinate) - 2);

  const auto to_length = fraction_to_length<TypeParam>(cell);
  const auto branch = to_length *
      fractional_difference<TypeParam>(Vec<Coordinate, 2>{{quarter, quarter}},
                                       Vec<Coordinate, 2>{{0, 0}});

  EXPECT_EQ(branch[0], 0.625);    // exact, since nothing is rounded
  EXPECT_EQ(branch[1], 0.75);
}

template <class Float, class Integer> Integer rounded(Float x)
{
  Integer q;
  round_to(x, q);
  return q;
}

template <class Float, class Integer> void expect_ties_to_even()
{
  EXPECT_EQ((rounded<Float, Integer>(0.5)), 0);
  EXPECT_EQ((rounded<Float, Integer>(1.5)), 2);
  EXPECT_EQ((rounded<Float, Integer>(2.5)), 2);
  EXPECT_EQ((rounded<Float, Integer>(-0.5)), 0);
  EXPECT_EQ((rounded<Float, Integer>(-1.5)), -2);
  EXPECT_EQ((rounded<Float, Integer>(-2.5)), -2);
  EXPECT_EQ((rounded<Float, Integer>(Float(2.499))), 2);
  EXPECT_EQ((rounded<Float, Integer>(Float(-2.501))), -3);
  // the largest half-integer that fp32 holds
  EXPECT_EQ((rounded<Float, Integer>(4194304.5f)), 4194304);
  EXPECT_EQ((rounded<Float, Integer>(4194305.5f)), 4194306);
}

TEST(RoundTo, TiesGoToTheEvenNeighbour)
{
  expect_ties_to_even<float, std::int32_t>();
  expect_ties_to_even<float, std::int64_t>();
  expect_ties_to_even<double, std::int32_t>();
  expect_ties_to_even<double, std::int64_t>();
}

TEST(RoundTo, IsSymmetricAndNearest)
{
  Random random(3);
  for (int sample = 0; sample < 20000; ++sample) {
    const double x = std::ldexp(random.uniform(-1.0, 1.0), random.integer(-3, 62));
    const float y =
        static_cast<float>(std::ldexp(random.uniform(-1.0, 1.0), random.integer(-3, 30)));

    const auto wide = rounded<double, std::int64_t>(x);
    const auto narrow = rounded<float, std::int32_t>(y);

    ASSERT_EQ(wide, (-rounded<double, std::int64_t>(-x)));
    ASSERT_EQ(narrow, (-rounded<float, std::int32_t>(-y)));
    ASSERT_LE(std::fabs(static_cast<long double>(wide) - x), 0.5L);
    ASSERT_LE(std::fabs(static_cast<long double>(narrow) - y), 0.5L);
  }
}

TEST(PowerOfTwo, IsExactOverTheWholeRange)
{
  for (int n = -1022; n <= 1023; ++n) ASSERT_EQ(power_of_two(n), std::ldexp(1.0, n)) << n;
}

TEST(FloorLog2, IsTheExponentOnBothSidesOfEveryPower)
{
  for (int n = -1021; n <= 1023; ++n) {
    const double power = std::ldexp(1.0, n);
    ASSERT_EQ(floor_log2(power), n);
    ASSERT_EQ(floor_log2(std::nextafter(power, 0.0)), n - 1);
    ASSERT_EQ(floor_log2(std::nextafter(power, 2.0 * power)), n);
  }
}
