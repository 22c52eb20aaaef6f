// SPDX-License-Identifier: GPL-2.0-only
// Algebra of vectors and tensors of a fixed dimension.

#include "rve/core/tensor.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using rve_test::Random;

namespace {

template <int D> Tensor<double, D> random_tensor(Random &random)
{
  Tensor<double, D> t;
  for (double &x : t.component) x = random.uniform(-1.0, 1.0);
  return t;
}

template <int D>
void expect_near(const Tensor<double, D> &x, const Tensor<double, D> &y, double error)
{
  for (int k = 0; k < D * D; ++k)
    EXPECT_NEAR(x.component[k], y.component[k], error) << "component " << k;
}

template <int D> void expect_same(const Tensor<double, D> &x, const Tensor<double, D> &y)
{
  expect_near(x, y, 0.0);
}

}    // namespace

TEST(Tensor, ColumnsOfTheProductWithUnitVectorsAreTheColumns)
{
  const Tensor2 t{{1.0, 2.0, 3.0, 4.0}};

  const auto x = t * Vec<double, 2>{{1.0, 0.0}};
  const auto y = t * Vec<double, 2>{{0.0, 1.0}};

  EXPECT_EQ(x[0], 1.0);
  EXPECT_EQ(x[1], 3.0);
  EXPECT_EQ(y[0], 2.0);
  EXPECT_EQ(y[1], 4.0);
}

TEST(Tensor, ProductOfKnownMatrices)
{
  const Tensor2 a{{1.0, 2.0, 3.0, 4.0}}, b{{5.0, 6.0, 7.0, 8.0}};

  expect_same(a * b, Tensor2{{19.0, 22.0, 43.0, 50.0}});
  expect_same(a + b, Tensor2{{6.0, 8.0, 10.0, 12.0}});
  expect_same(b - a, Tensor2{{4.0, 4.0, 4.0, 4.0}});
  expect_same(2.0 * a, Tensor2{{2.0, 4.0, 6.0, 8.0}});
  EXPECT_EQ(trace(a), 5.0);
  EXPECT_EQ(determinant(a), -2.0);
}

TEST(Tensor, IdentityAndTransposeInThreeDimensions)
{
  Random random(1);
  const auto a = random_tensor<3>(random), b = random_tensor<3>(random);

  expect_same(a * Tensor<double, 3>::identity(), a);
  expect_same(Tensor<double, 3>::identity() * a, a);
  expect_same(transpose(transpose(a)), a);
  // Both sides add the same products in the same order.
  expect_same(transpose(a * b), transpose(b) * transpose(a));
}

TEST(Tensor, InverseTimesTheTensorIsTheIdentity)
{
  Random random(2);
  for (int sample = 0; sample < 1000; ++sample) {
    const Tensor2 t = random_tensor<2>(random);
    const double det = determinant(t);
    if (std::fabs(det) < 0.05) continue;

    const Tensor2 unit = inverse(t) * t;

    expect_near(unit, Tensor2::identity(),
                4e-16 / std::fabs(det) * 8.0);    // a few roundings times the condition number
  }
}

TEST(Tensor, DeterminantOfAProductIsTheProductOfDeterminants)
{
  Random random(3);
  for (int sample = 0; sample < 1000; ++sample) {
    const Tensor2 a = random_tensor<2>(random), b = random_tensor<2>(random);

    EXPECT_NEAR(determinant(a * b), determinant(a) * determinant(b),
                4e-15);    // roundings of terms up to 4
  }
}

TEST(Tensor, DyadMapsAVectorToItsProjection)
{
  const Vec<double, 2> x{{2.0, 3.0}}, y{{5.0, 7.0}}, z{{1.0, -2.0}};

  const auto projected = dyad(x, y) * z;

  EXPECT_EQ(projected[0], 2.0 * dot(y, z));
  EXPECT_EQ(projected[1], 3.0 * dot(y, z));
}

TEST(Vec, CrossIsAntisymmetricAndPositiveCounterClockwise)
{
  const Vec<double, 2> x{{1.0, 0.0}}, y{{0.0, 1.0}}, z{{0.3, -0.7}};

  EXPECT_EQ(cross(x, y), 1.0);
  EXPECT_EQ(cross(y, z), -cross(z, y));
  EXPECT_NEAR(cross(z, z), 0.0, 0.5 * 2.3e-16 * 0.21);    // one of the two products is rounded
}

TEST(Tensor, IsFiniteIfAllComponentsAre)
{
  Random random(5);
  const auto sound = random_tensor<3>(random);
  EXPECT_TRUE(finite(sound));
  for (int k = 0; k < 9; ++k)
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
      auto t = sound;
      t.component[k] = bad;
      EXPECT_FALSE(finite(t)) << k;
    }
}

TEST(Vec, ProductsKeepTheirBitsWhenBothVectorsChangeSign)
{
  // The force of a contact must not depend on which of the two grains owns the pair.
  Random random(4);
  for (int sample = 0; sample < 1000; ++sample) {
    const Vec<double, 2> x{{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)}};
    const Vec<double, 2> y{{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)}};
    const Vec<double, 2> minus_x{{-x[0], -x[1]}}, minus_y{{-y[0], -y[1]}};

    ASSERT_EQ(cross(minus_x, minus_y), cross(x, y));
    ASSERT_EQ(cross(minus_x, y), -cross(x, y));
    ASSERT_EQ(dot(minus_x, minus_y), dot(x, y));
    ASSERT_EQ(dot(x, minus_y), -dot(x, y));
  }
}

TEST(Vec, ChangeOfFormatRoundsEachComponent)
{
  const Vec<double, 2> v{{1.0 / 3.0, -1e10 / 7.0}};

  const auto narrow = v.as<float>();

  EXPECT_EQ(narrow[0], 1.0f / 3.0f);
  EXPECT_EQ(narrow[1], static_cast<float>(-1e10 / 7.0));
}
