// SPDX-License-Identifier: GPL-2.0-only
// Tests grading curves and distributions of grain sizes against closed forms.

#include "rve/core/error.h"
#include "rve/engine/grading.h"
#include "support/messages.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace rve;
using namespace rve_test;

namespace {

// A sand with C_u = 4 and a fine one with a tail [m]
const GradingCurve WIDE = {{0.302e-3, 0.0},  {0.428e-3, 13.7}, {0.593e-3, 27.0}, {0.784e-3, 44.1},
                           {1.028e-3, 61.9}, {1.385e-3, 79.3}, {1.972e-3, 100.0}};
const GradingCurve FINE = {{0.115e-3, 0.9},  {0.157e-3, 7.2},  {0.183e-3, 25.6}, {0.2e-3, 47.9},
                           {0.231e-3, 73.8}, {0.281e-3, 88.3}, {0.358e-3, 96.7}, {0.499e-3, 100.0}};
// No grains between 0.3 and 1 mm
const GradingCurve GAP = {{0.2e-3, 0.0}, {0.3e-3, 40.0}, {1e-3, 40.0}, {1.3e-3, 100.0}};
constexpr double SINGLE = 2e-7;    // rounding of a product of three radii in single precision

double power_sum(const std::vector<double> &radii, double power, double below = 1e300)
{
  double sum = 0.0;
  for (const double r : radii)
    if (2.0 * r <= below) sum += std::pow(2.0 * r, power);
  return sum;
}

double mean_power(const std::vector<double> &radii, double power)
{
  return power_sum(radii, power) / static_cast<double>(radii.size());
}

std::string message_of_sizes(const SizeChoice &choice)
{
  return rve_test::message_of([&] { SizeDistribution(choice, 3); });
}

PackingRecipe recipe_of(int num_grains)
{
  PackingRecipe recipe;
  recipe.material = paper_material();
  recipe.num_grains = num_grains;
  recipe.pressure = 20e3;
  return recipe;
}

}    // namespace

// The grains of whole strata have their exact mass. The point of a curve is inside of one stratum.
TEST(Grading, GrainsFollowTheCurveWithinTheMassOfOneGrain)
{
  for (const int dimension : {2, 3})
    for (const GradingCurve &curve : {WIDE, FINE, GAP})
      for (const int n : {5, 60, 400, 5000}) {
        const std::vector<double> radii = SizeDistribution(curve, dimension).radii(n);
        ASSERT_EQ(radii.size(), static_cast<std::size_t>(n));
        EXPECT_TRUE(std::is_sorted(radii.begin(), radii.end()));
        const double all = power_sum(radii, dimension), cut = curve.front().percent;
        for (const auto &[diameter, percent] : curve) {
          const double given = (percent - cut) / (100.0 - cut);
          const double made = power_sum(radii, dimension, diameter) / all;
          const auto above = std::upper_bound(radii.begin(), radii.end(), 0.5 * diameter);
          const double next = above == radii.end() ? 0.0 : std::pow(2.0 * *above, dimension) / all;
          const double last =
              above == radii.begin() ? 0.0 : std::pow(2.0 * *(above - 1), dimension) / all;
          EXPECT_LE(made, given + last + SINGLE) << diameter << " " << n;
          EXPECT_GE(made, given - next - SINGLE) << diameter << " " << n;
        }
      }
}

// n_i is proportional to m_i / d_i^3 for spheres, and to m_i / d_i^2 for disks.
TEST(Grading, NumbersOfGrainsFollowFromTheirMasses)
{
  const GradingCurve two = {{1.0, 0.0}, {1.0 + 1e-9, 50.0}, {2.0, 50.0}, {2.0 + 1e-9, 100.0}};

  EXPECT_NEAR(SizeDistribution(two, 2).number_below(1.5), 4.0 / 5.0, 1e-7);
  EXPECT_NEAR(SizeDistribution(two, 3).number_below(1.5), 8.0 / 9.0, 1e-7);
  const std::vector<double> spheres = SizeDistribution(two, 3).radii(90);
  EXPECT_EQ(std::count_if(spheres.begin(), spheres.end(), [](double r) { return r < 0.75; }), 80);
}

// A class between two points has the mean of d^D that follows from dP = s d(ln d).
TEST(Grading, MeanMassIsThatOfALogLinearClass)
{
  const GradingCurve one = {{1.0, 0.0}, {3.0, 100.0}};
  for (const int d : {2, 3}) {
    const SizeDistribution sizes(one, d);
    const double mean = std::log(3.0) * d / (1.0 - std::pow(3.0, -d));
    EXPECT_NEAR(sizes.mean_power(), mean, 1e-12 * mean);
    EXPECT_NEAR(mean_power(sizes.radii(100), d), mean, 4.0 * SINGLE * mean);
    EXPECT_NEAR(sizes.diameter_at_mass(0.6), std::pow(3.0, 0.6), 1e-12);
  }
}

TEST(Grading, FinesBelowTheFirstPointAreCutOff)
{
  const SizeDistribution sizes(GradingCurve{{1.0, 20.0}, {2.0, 60.0}, {4.0, 100.0}}, 3);

  EXPECT_EQ(sizes.cut_share(), 0.2);
  EXPECT_EQ(sizes.smallest(), 1.0);
  EXPECT_NEAR(sizes.mass_below(2.0), 0.5, 1e-14);
  EXPECT_GE(sizes.radii(1000).front(), 0.5);
}

TEST(Grading, AtMostOneGrainIsInAGap)
{
  for (const int n : {10, 77, 400}) {
    const std::vector<double> radii = SizeDistribution(GAP, 3).radii(n);
    const auto in_gap = [](double r) { return 2.0 * r > 0.3001e-3 && 2.0 * r < 0.9999e-3; };
    EXPECT_LE(std::count_if(radii.begin(), radii.end(), in_gap), 1);
  }
}

// <r^k> = exp(k mu + k^2 sigma^2 / 2). Limits at 7 standard deviations of the mass leave less than
// 1e-9. The moment of the mass is exact, and the others converge as the number of grains grows.
TEST(Grading, LognormalRadiiHaveTheMomentsOfTheirDistribution)
{
  const double median = 0.004, sigma = 0.2;
  const LognormalRadii radii{median, sigma, median * std::exp(-7.0 * sigma),
                             median * std::exp(8.0 * sigma)};
  const std::vector<double> grains = SizeDistribution(radii, 3).radii(4000);
  for (const int k : {1, 2, 3}) {
    const double moment = std::pow(2.0 * median, k) * std::exp(0.5 * k * k * sigma * sigma);
    EXPECT_NEAR(mean_power(grains, k), moment, (k == 3 ? 4.0 * SINGLE : 2e-4) * moment) << k;
  }
  EXPECT_NEAR(2.0 * grains[1999], 2.0 * median, 1e-3 * median);
}

// The number of grains below the radius lo ((1 - u) + u (hi/lo)^(1-a))^(1/(1-a)) is u n.
TEST(Grading, PowerLawRadiiHaveTheQuantilesOfTheirExponent)
{
  const double lo = 0.002, hi = 0.01;
  const int n = 200;
  for (const double a : {0.0, 1.0, 2.0, 3.5, 4.0}) {
    const std::vector<double> radii = SizeDistribution(PowerLawRadii{a, lo, hi}, 3).radii(n);
    for (const int k : {1, 20, 100, 150, 199}) {
      const double u = static_cast<double>(k) / n, q = 1.0 - a;
      const double radius = q == 0.0
          ? lo * std::pow(hi / lo, u)
          : std::pow((1.0 - u) * std::pow(lo, q) + u * std::pow(hi, q), 1.0 / q);
      EXPECT_EQ(std::lower_bound(radii.begin(), radii.end(), radius) - radii.begin(), k) << a;
    }
    // <r^3> = q/(q+3) (hi^(q+3) - lo^(q+3)) / (hi^q - lo^q)
    const double q = 1.0 - a + 1e-7;    // avoids the quotient 0/0
    const double mean = q / (q + 3.0) * (std::pow(hi, q + 3.0) - std::pow(lo, q + 3.0)) /
        (std::pow(hi, q) - std::pow(lo, q));
    EXPECT_NEAR(mean_power(radii, 3), 8.0 * mean, 2e-6 * mean * 8.0) << a;
  }
}

TEST(Grading, DiametersPassingAreThoseOfTheGrains)
{
  // masses of spheres: 1, 8, 27 and 64 of 100
  const std::vector<double> spheres = {1.5, 0.5, 2.0, 1.0};
  EXPECT_EQ(diameter_passing(spheres, 3, 0.5), 1.0);
  EXPECT_EQ(diameter_passing(spheres, 3, 9.0), 2.0);
  EXPECT_EQ(diameter_passing(spheres, 3, 9.1), 3.0);
  EXPECT_EQ(diameter_passing(spheres, 3, 36.0), 3.0);
  EXPECT_EQ(diameter_passing(spheres, 3, 100.0), 4.0);
  // areas of disks: 1, 4, 9 and 16 of 30
  EXPECT_EQ(diameter_passing(spheres, 2, 50.0), 4.0);
  EXPECT_EQ(diameter_passing(spheres, 2, 46.0), 3.0);
  EXPECT_EQ(grading_of(spheres, 3).uniformity(), 4.0 / 3.0);

  // one class: d_x = d_0 (d_100/d_0)^x, and C_u = (d_100/d_0)^0.5
  const std::vector<double> many =
      SizeDistribution(GradingCurve{{1.0, 0.0}, {4.0, 100.0}}, 3).radii(20000);
  const Grading grading = grading_of(many, 3);
  // a grain has at most 64 / (20000 <d^3>) = 7.5e-4 of the mass, and 1 % of the mass 1.4 % of d
  EXPECT_NEAR(grading.d10, std::pow(4.0, 0.1), 1.5e-3);
  EXPECT_NEAR(grading.d50, 2.0, 3e-3);
  EXPECT_NEAR(grading.d60, std::pow(4.0, 0.6), 3e-3);
  EXPECT_NEAR(grading.uniformity(), 2.0, 3e-3);
  EXPECT_EQ(rve_test::message_of([&] { diameter_passing(spheres, 3, 101.0); }),
            "percent passing is 101; it must be from 0 to 100");
  EXPECT_EQ(rve_test::message_of([] { diameter_passing({}, 3, 50.0); }),
            "there are no grains; a grading needs at least one");
}

// d_90 = d_0 x^0.9 with x = d_100/d_0. The number above it is (x^-0.9D - x^-D) / (1 - x^-D).
TEST(Grading, NeededGrainsFollowFromTheCoarsestTenthAndTheWidth)
{
  const GradingCurve wide = {{1.0, 0.0}, {5.0, 100.0}};
  const auto coarse = [](int d) {
    return (std::pow(5.0, -0.9 * d) - std::pow(5.0, -d)) / (1.0 - std::pow(5.0, -d));
  };
  EXPECT_EQ(SizeDistribution(wide, 2).grains_needed(), std::ceil(5.0 / coarse(2)));
  EXPECT_EQ(SizeDistribution(wide, 3).grains_needed(), std::ceil(5.0 / coarse(3)));

  // equal spheres: (2.5 d)^3 = N pi/6 d^3 1.5, and 5 of 50 spheres have a tenth of the mass
  const GradingCurve narrow = {{1.0, 0.0}, {1.0001, 100.0}};
  EXPECT_NEAR(SizeDistribution(narrow, 3).grains_needed(), 50, 1);
  // a tail of large grains of 0.1 % of the mass: the cell decides
  const GradingCurve tail = {{1.0, 0.0}, {1.0 + 1e-9, 99.9}, {4.0, 99.9}, {4.0 + 4e-9, 100.0}};
  EXPECT_NEAR(SizeDistribution(tail, 3).grains_needed(), 1000.0 / (0.5236 * 1.5), 4.0);
}

TEST(Grading, WrongSizesAreNamed)
{
  const auto curve = [](const GradingCurve &points) { return message_of_sizes(points); };
  EXPECT_EQ(curve({{1.0, 100.0}}),
            "grading has 1 points; it must have at least 2, each with a diameter and the percent "
            "passing");
  EXPECT_EQ(curve({{1.0, 0.0}, {1.0, 100.0}}),
            "diameter of grading point 2 is 1 [length]; it must be greater than that of the point "
            "before, 1");
  EXPECT_EQ(curve({{1.0, 0.0}, {2.0, 60.0}, {3.0, 50.0}, {4.0, 100.0}}),
            "percent passing of grading point 3 is 50; it must be at least that of the point "
            "before, 60");
  EXPECT_EQ(curve({{1.0, 0.0}, {2.0, 99.0}}),
            "percent passing of the last grading point is 99; it must be 100");
  EXPECT_EQ(curve({{1.0, 0.0}, {2.0, 1.0}}),
            "percent passing of the last grading point is 1; it must be 100 (percentages, not "
            "shares)");
  EXPECT_EQ(curve({{1.0, -1.0}, {2.0, 100.0}}),
            "percent passing of grading point 1 is -1; it must be from 0 to 100");
  EXPECT_EQ(curve({{0.0, 0.0}, {2.0, 100.0}}),
            "diameter of grading point 1 is 0 [length]; it must be from 1e-30 to 1e+30");
  EXPECT_EQ(curve({{1.0, 100.0}, {2.0, 100.0}}),
            "percent passing of the first grading point is 100; it must be less: no grains are "
            "above its diameter");
  EXPECT_EQ(message_of_sizes(LognormalRadii{1.0, 0.0, 0.5, 2.0}),
            "standard deviation of the logarithm of the radius is 0 [-]; it must be from 1e-6 to "
            "3");
  EXPECT_EQ(message_of_sizes(LognormalRadii{1.0, 0.1, 5.0, 6.0})
                .find("the radii from 5 to 6 [length] have a share of "),
            0u);
  EXPECT_EQ(message_of_sizes(LognormalRadii{-1.0, 0.1, 0.5, 2.0}),
            "median radius is -1 [length]; it must be from 1e-30 to 1e+30");
  EXPECT_EQ(message_of_sizes(PowerLawRadii{3.0, 2.0, 1.0}),
            "largest grain radius is 1 [length]; it must be greater than the smallest radius, 2");
  EXPECT_EQ(message_of_sizes(PowerLawRadii{3.0, 1.0, 2e6}),
            "largest grain radius is 2000000 [length]; it must be at most 1000000 times the "
            "smallest radius, 1");
  EXPECT_EQ(message_of_sizes(PowerLawRadii{30.0, 1.0, 2.0}),
            "exponent of the power law is 30 [-]; it must be from -20 to 20");
  EXPECT_EQ(rve_test::message_of([] {
              SizeDistribution(WIDE, 3).radii(0);
            }).find("number of grains is 0; it must lie between 1 and "),
            0u);
}

// A sphere of ratio 10 can touch more smallest spheres than the sums of the engine allow.
TEST(Grading, SpheresOfALargeRatioAreRefusedWithTheirNumberAndACut)
{
  PackingRecipe recipe = recipe_of(20000);
  recipe.material.thickness = 1.0;
  const GradingCurve curve = {{1e-3, 0.0}, {12e-3, 100.0}};
  const std::string message = rve_test::message_of([&] { set_sizes<3>(recipe, curve); });
  const SizeDistribution sizes(curve, 3);
  EXPECT_EQ(message.find("ratio of largest to smallest diameter is "), 0u) << message;
  EXPECT_NE(message.find("it must be at most 6.6, because 256 grains at most may touch one grain. "
                         "This distribution would need " +
                         std::to_string(sizes.grains_needed()) +
                         " grains; a part from a diameter "
                         "of 0.00181818182 [length] on, which cuts off 24.06 % of the mass, can be "
                         "made"),
            std::string::npos)
      << message;

  const GradingCurve rest = {{1.82e-3, 24.1}, {12e-3, 100.0}};
  const SizeReport report = set_sizes<3>(recipe, rest);
  EXPECT_EQ(recipe.radii.size(), 20000u);
  EXPECT_EQ(report.cut_percent, 24.1);
  EXPECT_EQ(report.cut_diameter, 1.82e-3);
  EXPECT_EQ(report.coarse,
            std::lround(20000.0 *
                        (1.0 -
                         SizeDistribution(rest, 3).number_below(
                             SizeDistribution(rest, 3).diameter_at_mass(0.9)))));
}

TEST(Grading, DisksOfRatioTenArePacked)
{
  Options options;
  options.device = Device::Cpu;
  options.threads = 1;
  PackingRecipe recipe = recipe_of(300);
  const GradingCurve curve = {{1e-3, 0.0}, {10e-3, 100.0}};
  const SizeReport report = set_sizes<2>(recipe, curve);
  const RveState state = generate_packing(recipe, *make_engine(options));

  EXPECT_EQ(state.radius, recipe.radii);
  EXPECT_GT(report.largest / report.smallest, 8.5);
  EXPECT_GT(state.void_ratio(), 0.05);
  EXPECT_LT(state.void_ratio(), 0.2) << "small grains fill the gaps between large ones";
}
