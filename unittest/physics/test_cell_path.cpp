// SPDX-License-Identifier: GPL-2.0-only
// The path of the cell through one macro increment.

#include "rve/physics/cell_path.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;

namespace {

constexpr double PI = 3.14159265358979323846;
const Tensor2 CELL{{0.14, 0.02, -0.01, 0.15}};

Tensor2 rotation_by(double angle)
{
  return {{std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)}};
}

/// Returns the increment that the host prepares for the deformation gradient R(angle) U with the
/// stretch U. The path of the cell has `segments` straight segments.
CellIncrement<2> increment_of(double angle, const Tensor2 &stretch, int segments)
{
  return {rotation_by(angle) * stretch, rotation_by(angle / segments),
          stretch - Tensor2::identity(), segments};
}

double largest_difference(const Tensor2 &x, const Tensor2 &y)
{
  double largest = 0.0;
  for (int k = 0; k < 4; ++k)
    largest = std::fmax(largest, std::fabs(x.component[k] - y.component[k]));
  return largest;
}

}    // namespace

TEST(CellPath, EndPointIsExact)
{
  for (const int segments : {1, 7, 40})
    for (const int substeps : {1, 10, 33}) {
      const CellIncrement<2> increment =
          increment_of(0.3, Tensor2{{1.02, 0.01, 0.01, 0.97}}, segments);
      CellPath<2> path(CELL, increment, substeps, 1e-4);
      Tensor2 cell = CELL;
      for (int k = 1; k <= substeps; ++k) cell = path.cell(k);

      EXPECT_EQ(largest_difference(cell, increment.deformation * CELL), 0.0)
          << segments << " segments, " << substeps << " substeps";
    }
}

TEST(CellPath, ManySmallIncrementsDoNotDrift)
{
  // The cell rotates by 90 degrees in 100 calls of ten substeps. Explicit Euler steps of H would
  // increase the area in every substep.
  const CellIncrement<2> increment = increment_of(0.5 * PI / 100, Tensor2::identity(), 2);
  Tensor2 cell = CELL;
  for (int call = 0; call < 100; ++call) {
    CellPath<2> path(cell, increment, 10, 1e-4);
    for (int k = 1; k <= 10; ++k) cell = path.cell(k);
  }

  EXPECT_LT(largest_difference(cell, rotation_by(0.5 * PI) * CELL), 1e-14 * 0.15);
}

TEST(CellPath, IsAStraightLineTraversedAtConstantRate)
{
  const CellIncrement<2> increment{
      {{1.01, 0.02, 0.0, 0.99}}, Tensor2::identity(), {{0.01, 0.02, 0.0, -0.01}}, 1};
  const double dt = 1e-4;
  CellPath<2> path(CELL, increment, 8, dt);
  Tensor2 before = CELL;
  for (int k = 1; k <= 8; ++k) {
    const Tensor2 cell = path.cell(k);

    const Tensor2 expected = CELL + (k / 8.0) * (increment.deformation * CELL - CELL);
    EXPECT_LT(largest_difference(cell, expected), 1e-16);
    EXPECT_LT(largest_difference(path.cell_rate(), (1.0 / dt) * (cell - before)),
              1e-16 / dt);    // difference quotient
    before = cell;
  }
}

TEST(CellPath, ChordOfARotationIsShortByAnEighthOfTheSquaredAngleOfASegment)
{
  const double angle = 0.5 * PI;
  for (const int segments : {1, 10, 158}) {
    const CellIncrement<2> increment = increment_of(angle, Tensor2::identity(), segments);
    const int substeps = 40 * segments;
    CellPath<2> path(CELL, increment, substeps, 1e-5);
    const double theta = angle / segments;
    double smallest = 1.0, largest = 0.0;
    for (int k = 1; k <= substeps; ++k) {
      // `length` is the length of the rotated cell vectors divided by their exact length. Its
      // square is the ratio of the areas.
      const double length = std::sqrt(determinant(path.cell(k)) / determinant(CELL));
      smallest = std::fmin(smallest, length);
      largest = std::fmax(largest, length);
    }

    EXPECT_GE(smallest, 1.0 - theta * theta / 8.0 - 1e-14) << segments;
    EXPECT_LE(smallest, 1.0 - 0.9 * theta * theta / 8.0)
        << segments;    // the error is largest at the middle of a chord
    EXPECT_LE(largest, 1.0 + 1e-14);
  }
}

TEST(CellPath, RotationAndStretchAreCombinedAtTheKnots)
{
  const Tensor2 stretch{{1.05, 0.02, 0.02, 0.96}};
  const int segments = 20, substeps = 100;
  CellPath<2> path(CELL, increment_of(0.2, stretch, segments), substeps, 1e-4);

  for (int k = 1; k <= substeps; ++k) {
    const Tensor2 cell = path.cell(k);
    if (k % (substeps / segments) != 0) continue;
    const double along = static_cast<double>(k) / substeps;
    const Tensor2 knot = rotation_by(0.2 * along) *
        (Tensor2::identity() + along * (stretch - Tensor2::identity())) * CELL;
    EXPECT_LT(largest_difference(cell, knot), 1e-15) << "substep " << k;
  }
}

TEST(CellPath, StaysWithinAnEighthOfTheSquaredStrainOfTheExponential)
{
  // In simple shear exp(L t) = 1 + L t, so that the chord is exact. This test uses an extension,
  // whose chord lies above the exponential.
  for (const double strain : {0.02, 0.01}) {
    const Tensor2 deformation{{std::exp(strain), 0.0, 0.0, std::exp(-strain)}};
    CellPath<2> path(CELL, {deformation, Tensor2::identity(), deformation - Tensor2::identity(), 1},
                     50, 1e-4);
    double largest = 0.0;
    for (int k = 1; k <= 50; ++k) {
      const double t = strain * k / 50;
      const Tensor2 exponential{{std::exp(t), 0.0, 0.0, std::exp(-t)}};
      largest = std::fmax(largest, largest_difference(path.cell(k) * inverse(CELL), exponential));
    }

    EXPECT_LE(largest, strain * strain / 8.0 * std::exp(strain) + 1e-15);
    EXPECT_GE(largest, strain * strain / 8.0 * 0.9);
  }
}

TEST(CellPath, FollowsAChangeOfTheLattice)
{
  const CellIncrement<2> increment = increment_of(0.02, Tensor2{{1.01, 0.0, 0.0, 0.99}}, 2);
  const Tensor2 change{{1.0, -1.0, 0.0, 1.0}};
  CellPath<2> plain(CELL, increment, 10, 1e-4), mapped(CELL, increment, 10, 1e-4);
  for (int k = 1; k <= 10; ++k) {
    const Tensor2 expected = k <= 4 ? plain.cell(k) : plain.cell(k) * change;

    const Tensor2 cell = mapped.cell(k);

    EXPECT_LT(largest_difference(cell, expected), 1e-16) << "substep " << k;
    if (k == 4) mapped.map_start([&](const Tensor2 &start) { return start * change; });
  }
}
