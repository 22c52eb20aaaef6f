// SPDX-License-Identifier: GPL-2.0-only
// Rotations, polar decomposition and exponential of increments in space.

#include "rve/core/pi.h"
#include "rve/engine/finite_strain.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using rve_test::Random;

namespace {

using Vector = Vec<double, 3>;

Vector random_vector(Random &random, double size)
{
  return {{random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)}};
}

Tensor3 random_tensor(Random &random, double size)
{
  Tensor3 t;
  for (double &x : t.component) x = random.uniform(-size, size);
  return t;
}

double distance(const Tensor3 &x, const Tensor3 &y)
{
  double largest = 0.0;
  for (int k = 0; k < 9; ++k)
    largest = std::fmax(largest, std::fabs(x.component[k] - y.component[k]));
  return largest;
}

double distance(const Vector &x, const Vector &y)
{
  const Vector apart = x - y;
  return std::sqrt(dot(apart, apart));
}

Vector of_length(const Vector &v, double length)
{
  return (length / std::sqrt(dot(v, v))) * v;
}

}    // namespace

TEST(SpatialRotation, RotatesAboutItsVectorByItsLength)
{
  const Tensor3 quarter = spatial_rotation({{0.0, 0.0, 0.5 * kPi}});

  EXPECT_LT(distance(quarter, Tensor3{{0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0}}), 1e-15);
  Random random(1);
  for (int sample = 0; sample < 100; ++sample) {
    const Vector turn = random_vector(random, 3.0);
    const Tensor3 r = spatial_rotation(turn);
    EXPECT_LT(distance(transpose(r) * r, Tensor3::identity()), 2e-15);
    EXPECT_NEAR(determinant(r), 1.0, 2e-15);
    EXPECT_LT(distance(r * turn, turn), 1e-14);    // the axis does not change
  }
}

TEST(SpatialRotation, RecoversItsVectorUpToHalfATurn)
{
  Random random(2);
  for (const double angle : {0.0, 1e-12, 1e-6, 0.01, 1.0, 3.0, kPi - 1e-3, kPi - 1e-7})
    for (int sample = 0; sample < 50; ++sample) {
      const Vector turn = of_length(random_vector(random, 1.0), angle);
      EXPECT_LT(distance(rotation_vector(spatial_rotation(turn)), turn), 1e-14 + 4e-16) << angle;
    }
  // A rotation by more than half a turn is equivalent to a smaller rotation in the opposite
  // direction.
  const Vector far{{0.0, 0.0, kPi + 0.5}};
  EXPECT_LT(distance(rotation_vector(spatial_rotation(far)), {{0.0, 0.0, 0.5 - kPi}}), 1e-14);
}

TEST(SpatialPolarDecomposition, SeparatesRotationAndStretch)
{
  Random random(3);
  for (int sample = 0; sample < 200; ++sample) {
    const double size = sample % 2 ? 0.4 : 1e-4;
    const Vector turn = of_length(random_vector(random, 1.0), random.uniform(0.0, 3.0));
    const Tensor3 any = random_tensor(random, size);
    const Tensor3 strain = 0.5 * (any + transpose(any));
    const Tensor3 stretch = Tensor3::identity() + strain;
    if (determinant(stretch) < 0.1) continue;

    const PolarDecomposition polar(spatial_rotation(turn) * stretch);

    EXPECT_LT(distance(polar.rotation, spatial_rotation(turn)), 2e-14);
    EXPECT_LT(distance(polar.turn, turn), 1e-13);
    EXPECT_LT(distance(polar.strain, strain), 2e-14);
  }
}

TEST(Exponential, OfASpinIsARotationAndOfAStretchItsExponentials)
{
  Random random(4);
  for (int sample = 0; sample < 100; ++sample) {
    const Vector w = random_vector(random, 3.0);
    const Tensor3 spin{{0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0}};

    EXPECT_LT(distance(exponential(spin), spatial_rotation(w)), 2e-14);
  }
  const Tensor3 stretched = exponential(Tensor3{{0.3, 0.0, 0.0, 0.0, -2.0, 0.0, 0.0, 0.0, 1e-9}});
  EXPECT_NEAR(stretched(0, 0), std::exp(0.3), 1e-15);
  EXPECT_NEAR(stretched(1, 1), std::exp(-2.0), 1e-15);
  EXPECT_EQ(stretched(2, 2), 1.0 + 1e-9);
}

TEST(Exponential, HasTheInverseOfTheOppositeAndTheVolumeOfTheTrace)
{
  Random random(5);
  for (int sample = 0; sample < 100; ++sample) {
    const Tensor3 a = random_tensor(random, 1.0);

    EXPECT_LT(distance(exponential(a) * exponential(-1.0 * a), Tensor3::identity()), 1e-13);
    EXPECT_NEAR(determinant(exponential(a)) / std::exp(trace(a)), 1.0, 1e-13);
  }
}

TEST(Exponential, LeavesTheOtherAxesAsTheyAreToTheBit)
{
  const Tensor3 along_z = exponential(Tensor3{{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.7}});
  const Tensor3 sheared = exponential(Tensor3{{0.0, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}});

  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double one = a == b ? 1.0 : 0.0;
      EXPECT_TRUE((a == 2 && b == 2) || along_z(a, b) == one);
      EXPECT_TRUE((a == 0 && b == 1) || sheared(a, b) == one);
    }
  EXPECT_DOUBLE_EQ(sheared(0, 1), 0.8);
}
