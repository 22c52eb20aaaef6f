// SPDX-License-Identifier: GPL-2.0-only
// Widths, strain and lattice reduction of the periodic cell.

#include "rve/physics/cell.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace rve;
using rve_test::Random;

namespace {

Tensor2 random_cell(Random &random, double shear)
{
  const double a = random.uniform(0.5, 2.0), b = random.uniform(0.5, 2.0),
               angle = random.uniform(0.0, 6.28);
  const Tensor2 leaning{{a, random.uniform(-shear, shear), 0.0, b}};
  const Tensor2 rotation{{std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)}};
  return rotation * leaning;
}

/// Returns min |G u| over sampled unit vectors u, an upper bound of the smallest singular value.
double smallest_stretch_by_trial(const Tensor2 &g, int directions)
{
  double smallest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < directions; ++k) {
    const double angle = 3.14159265358979323846 * k / directions;
    const auto image = g * Vec<double, 2>{{std::cos(angle), std::sin(angle)}};
    smallest = std::fmin(smallest, std::sqrt(dot(image, image)));
  }
  return smallest;
}

double largest_component(const Tensor2 &t)
{
  double largest = 0.0;
  for (double x : t.component) largest = std::fmax(largest, std::fabs(x));
  return largest;
}

}    // namespace

TEST(Cell, PerpendicularWidthIsTheDistanceOfTheFacesNotTheEdge)
{
  const Tensor2 cell{{4.0, 3.0, 0.0, 4.0}};    // edges (4, 0) and (3, 4)

  EXPECT_DOUBLE_EQ(perpendicular_width(cell, 0), 16.0 / 5.0);    // across the edge of length 5
  EXPECT_DOUBLE_EQ(perpendicular_width(cell, 1), 4.0);
  EXPECT_DOUBLE_EQ(smallest_width(cell), 16.0 / 5.0);
}

TEST(Cell, PerpendicularWidthIsTheSpacingOfTheImagesOfALine)
{
  Random random(1);
  for (int sample = 0; sample < 200; ++sample) {
    const Tensor2 cell = random_cell(random, 2.0);
    for (int axis = 0; axis < 2; ++axis) {
      const Vec<double, 2> step{{cell(0, axis), cell(1, axis)}},
          line{{cell(0, 1 - axis), cell(1, 1 - axis)}};
      // `across` is the component of the step perpendicular to the line.
      const double along = dot(step, line) / dot(line, line);
      const Vec<double, 2> across = step - along * line;

      EXPECT_NEAR(perpendicular_width(cell, axis), std::sqrt(dot(across, across)),
                  1e-14 * (1.0 + std::fabs(along)));
    }
  }
}

TEST(SmallestStretch, IsTheSmallestSingularValue)
{
  Random random(2);
  const int directions = 20000;
  for (int sample = 0; sample < 100; ++sample) {
    Tensor2 g;
    for (double &x : g.component) x = random.uniform(-1.5, 1.5);

    const double stretch = smallest_stretch(g), tried = smallest_stretch_by_trial(g, directions);

    // The minimum can lie between two sampled directions. Then |G u|^2 is smaller than at these
    // directions by at most (s_max da)^2, with the largest singular value s_max and the angle da
    // between the directions.
    const double step = 3.0 * 3.1416 / directions;
    EXPECT_LE(stretch, tried + 1e-14);
    EXPECT_GE(stretch * stretch, tried * tried - step * step);
  }
}

TEST(SmallestStretch, OfARotationIsOneAndOfAStretchTheSmallerOne)
{
  const double c = std::cos(0.3), s = std::sin(0.3);

  // The result contains the root of s1^2 + s2^2 - 2 det, with the singular values s1 and s2. For a
  // rotation this sum is zero, but its rounding error of 4e-16 has a root of 2e-8. The root is
  // subtracted, so that the result can only be too small, which is safe.
  EXPECT_NEAR(smallest_stretch(Tensor2{{c, -s, s, c}}), 1.0, 3e-8);
  EXPECT_NEAR(smallest_stretch(Tensor2{{1.3, 0.0, 0.0, 0.9}}), 0.9, 1e-15);
  EXPECT_NEAR(smallest_stretch(Tensor2{{c, -s, s, c}} * Tensor2{{1.3, 0.0, 0.0, 0.9}}), 0.9, 1e-15);
}

TEST(LatticeReduction, StopsAtAnUprightCell)
{
  EXPECT_EQ(lattice_step(Tensor2{{1.0, 0.59, 0.0, 1.0}}).axis, -1);
  EXPECT_EQ(lattice_step(Tensor2{{1.0, 0.61, 0.0, 1.0}}).axis, 1);
  EXPECT_EQ(lattice_step(Tensor2{{1.0, 0.61, 0.0, 1.0}}).multiple[0], 1);
  EXPECT_EQ(lattice_step(Tensor2{{1.0, -2.7, 0.0, 1.0}}).multiple[0], -3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(lattice_step(Tensor2{{nan, nan, nan, nan}}).axis, -1);
}

TEST(LatticeReduction, DoesNotFlipBackAndForth)
{
  // A cell is reduced just beyond the limit of reduction, 0.6. If it is sheared back below this
  // limit, the reduction must not be undone.
  Tensor2 cell{{1.0, 0.61, 0.0, 1.0}};
  cell = apply_lattice_step(cell, lattice_step(cell));

  EXPECT_NEAR(cell(0, 1), -0.39, 1e-15);
  EXPECT_EQ(lattice_step(cell).axis, -1);
  cell(0, 1) -= 0.02;
  EXPECT_EQ(lattice_step(cell).axis, -1);
}

TEST(LatticeReduction, ReducedCellIsAsWideAsItsShortEdgeAllows)
{
  Random random(3);
  for (int sample = 0; sample < 500; ++sample) {
    Tensor2 cell = random_cell(random, 50.0);
    int steps = 0;
    for (LatticeStep<2> step = lattice_step(cell); step.axis >= 0; step = lattice_step(cell)) {
      cell = apply_lattice_step(cell, step);
      ASSERT_LT(++steps, 20);
    }
    const double a = std::hypot(cell(0, 0), cell(1, 0)), b = std::hypot(cell(0, 1), cell(1, 1));

    EXPECT_GE(smallest_width(cell),
              0.8 * std::fmin(a, b) * (1.0 - 1e-14));    // sin of the angle >= sqrt(1 - 0.6^2)
  }
}

TEST(LatticeReduction, KeepsDeterminantAndCartesianPositionsModuloTheLattice)
{
  Random random(4);
  for (int sample = 0; sample < 500; ++sample) {
    const Tensor2 start = random_cell(random, 20.0);
    const Vec<std::uint64_t, 2> point{{random.bits(), random.bits()}};
    Tensor2 cell = start;
    Vec<std::uint64_t, 2> s = point;
    std::int64_t m[2][2] = {{1, 0}, {0, 1}};    // the reduced cell is start * m
    for (LatticeStep<2> step = lattice_step(cell); step.axis >= 0; step = lattice_step(cell)) {
      s = apply_lattice_step(s, step);
      cell = apply_lattice_step(cell, step);
      for (auto &row : m) row[step.axis] -= step.multiple[1 - step.axis] * row[1 - step.axis];
    }

    ASSERT_EQ(m[0][0] * m[1][1] - m[0][1] * m[1][0], 1);
    for (int a = 0; a < 2; ++a) {
      // M s' = s holds exactly in wrapping integers: s and s' are the same point except for whole
      // cell vectors.
      const std::uint64_t back =
          static_cast<std::uint64_t>(m[a][0]) * s[0] + static_cast<std::uint64_t>(m[a][1]) * s[1];
      ASSERT_EQ(back, point[a]);
      for (int b = 0; b < 2; ++b) {
        double column = 0.0;
        for (int k = 0; k < 2; ++k) column += start(a, k) * static_cast<double>(m[k][b]);
        ASSERT_NEAR(cell(a, b), column, 1e-14 * largest_component(start));
      }
    }
    ASSERT_NEAR(determinant(cell), determinant(start), 1e-14 * largest_component(start) * 4.0);
  }
}

TEST(LatticeReduction, ThirtyTwoBitFractionsAreTheLeadingHalves)
{
  const LatticeStep<2> step{1, {-3, 0}};
  const Vec<std::uint32_t, 2> s{{0xdeadbeefu, 0x12345678u}};

  const auto narrow = apply_lattice_step(s, step);
  const auto wide = apply_lattice_step(
      Vec<std::uint64_t, 2>{{std::uint64_t(s[0]) << 32, std::uint64_t(s[1]) << 32}}, step);

  for (int a = 0; a < 2; ++a) EXPECT_EQ(std::uint64_t(narrow[a]) << 32, wide[a]);
}
