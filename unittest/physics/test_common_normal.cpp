// SPDX-License-Identifier: GPL-2.0-only
// Tests the contact geometry of ellipses and ellipsoids with pairs that are made backwards, from
// the normal and the overlap to the branch; with the potential of Perram and Wertheim; with finite
// differences; and by exchange of the grains.

#include "rve/physics/common_normal.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace rve;
using rve_test::Random;

namespace {

constexpr double PI = 3.14159265358979323846;

template <int D> using Vector = Vec<double, D>;
template <int D> using Shape = Tensor<double, D>;

template <int D> Vector<D> random_direction(Random &random)
{
  for (;;) {
    Vector<D> v;
    for (int a = 0; a < D; ++a) v[a] = random.uniform(-1.0, 1.0);
    const double squared = dot(v, v);
    if (squared > 0.01 && squared < 1.0) return unit_vector(v);
  }
}

Tensor<double, 2> random_rotation(Random &random, Vec<double, 2>)
{
  const double angle = random.uniform(0.0, 2.0 * PI);
  return {{std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)}};
}

Tensor<double, 3> random_rotation(Random &random, Vec<double, 3>)
{
  const Vec<double, 3> x = random_direction<3>(random);
  const Vec<double, 3> y = unit_vector(cross(x, random_direction<3>(random)));
  const Vec<double, 3> z = cross(x, y);
  Tensor<double, 3> t;
  for (int a = 0; a < 3; ++a) t(a, 0) = x[a], t(a, 1) = y[a], t(a, 2) = z[a];
  return t;
}

template <int D> Shape<D> shape_of(const Vector<D> &semi_axes, const Tensor<double, D> &turn)
{
  Shape<D> squares = Shape<D>::zero();
  for (int a = 0; a < D; ++a) squares(a, a) = semi_axes[a] * semi_axes[a];
  Shape<D> shape = turn * squares * transpose(turn);
  for (int a = 0; a < D; ++a)    // symmetric to the bit
    for (int b = 0; b < a; ++b) shape(a, b) = shape(b, a);
  return shape;
}

/// Returns a grain of the given ratio of largest to smallest semi-axis. The smallest is 1 to 4.
template <int D> Shape<D> random_shape(Random &random, double aspect_ratio)
{
  Vector<D> semi_axes;
  const double size = std::exp(random.uniform(0.0, std::log(4.0)));
  semi_axes[0] = aspect_ratio * size;
  semi_axes[D - 1] = size;
  if (D == 3) semi_axes[1] = random.uniform(size, aspect_ratio * size);
  return shape_of<D>(semi_axes, random_rotation(random, Vector<D>()));
}

/// Pair of grains with a known normal and overlap.
template <int D> struct Pair {
  Shape<D> i, j;
  Vector<D> normal, branch;
  double overlap, radius;    ///< radius: the smaller of the smallest semi-axes

  Pair(Random &random, double aspect_ratio, double relative_overlap)
  {
    i = random_shape<D>(random, aspect_ratio);
    j = random_shape<D>(random, aspect_ratio);
    radius = std::min(std::pow(determinant(i), 0.5 / D), std::pow(determinant(j), 0.5 / D));
    normal = random_direction<D>(random);
    overlap = relative_overlap * radius;
    const SupportPoint<double, D> at_i(i, normal), at_j(j, normal);
    branch = at_i.point + at_j.point - overlap * normal;
  }
};

template <class Real, int D> double angle_between(const Vec<Real, D> &x, const Vector<D> &y)
{
  const Vector<D> difference = x.template as<double>() - y;
  return std::sqrt(dot(difference, difference));
}

template <class T> class CommonNormal : public testing::Test {
};
template <int N> struct Dimension {
  static constexpr int value = N;
};
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(CommonNormal, Dimensions);

TYPED_TEST(CommonNormal, IsThatOfPairsThatWereMadeBackwards)
{
  constexpr int D = TypeParam::value;
  Random random(1);
  // The error of the overlap is half the square of the angle times the sum of two radii of
  // curvature, here at most 4 * 3^2 each. Branches have lengths up to 24.
  const double curvature = 36.0, rounding = 24.0 * 4e-16;
  for (const double aspect_ratio : {1.0, 1.2, 1.5, 2.0, 3.0})
    for (const double overlap : {1e-3, 0.05}) {
      const double error = overlap == 1e-3 ? 2e-8 : 1e-5;
      const int iterations = common_normal_iterations(aspect_ratio);
      for (int k = 0; k < 20000; ++k) {
        const Pair<D> pair(random, aspect_ratio, overlap);
        const Vector<D> normal = common_normal(pair.i, pair.j, pair.branch, iterations);
        ASSERT_LT(angle_between(normal, pair.normal), error) << "aspect ratio " << aspect_ratio;
        const EllipsoidContact<double, D> contact(pair.i, pair.j, pair.branch, normal);
        ASSERT_NEAR(contact.overlap, pair.overlap, curvature * error * error + rounding);
      }
    }
}

TYPED_TEST(CommonNormal, HasInSinglePrecisionTheErrorsOfItsRounding)
{
  constexpr int D = TypeParam::value;
  Random random(2);
  for (const double aspect_ratio : {1.5, 2.0, 3.0})
    for (int k = 0; k < 20000; ++k) {
      const Pair<D> pair(random, aspect_ratio, 1e-3);
      const Vec<float, D> normal =
          common_normal(pair.i.template as<float>(), pair.j.template as<float>(),
                        pair.branch.template as<float>(), common_normal_iterations(aspect_ratio));
      // 8 units of the last place, 1.2e-7: points on slender grains move faster than the normal
      ASSERT_LT(angle_between(normal, pair.normal), 1e-6);
      // the format mixed: a normal in single precision, the overlap in double precision
      const EllipsoidContact<double, D> contact(pair.i, pair.j, pair.branch,
                                                unit_vector(normal.template as<double>()));
      ASSERT_NEAR(contact.overlap, pair.overlap, 36e-12);
    }
}

TYPED_TEST(CommonNormal, NeedsAtMostTheStatedIterations)
{
  // One iteration less is too few: the numbers of iterations are not larger than they must be.
  constexpr int D = TypeParam::value;
  Random random(3);
  for (const double aspect_ratio : {2.0, 3.0}) {
    double worst = 0.0;
    for (int k = 0; k < 20000; ++k) {
      const Pair<D> pair(random, aspect_ratio, 1e-3);
      const int fewer = common_normal_iterations(aspect_ratio) - 1;
      worst = std::max(
          worst, angle_between(common_normal(pair.i, pair.j, pair.branch, fewer), pair.normal));
    }
    EXPECT_GT(worst, 2e-7) << "aspect ratio " << aspect_ratio;
  }
}

TYPED_TEST(CommonNormal, SeparatesGrainsWithAGap)
{
  constexpr int D = TypeParam::value;
  Random random(4);
  for (const double aspect_ratio : {1.5, 3.0})
    for (int k = 0; k < 20000; ++k) {
      const Pair<D> pair(random, aspect_ratio, -random.uniform(1e-9, 1.0));
      const Vector<D> normal =
          common_normal(pair.i, pair.j, pair.branch, common_normal_iterations(aspect_ratio));
      ASSERT_LT((EllipsoidContact<double, D>(pair.i, pair.j, pair.branch, normal).overlap), 0.0);
    }
}

/// Largest value of lambda (1 - lambda) r.[(1 - lambda) A_i + lambda A_j]^-1 r over 0 < lambda < 1.
/// It is 1 if and only if the grains touch (Perram & Wertheim 1985, J. Comput. Phys. 58, 409). The
/// function is concave, so a golden section finds the maximum.
template <int D> double contact_function(const Pair<D> &pair)
{
  const auto value = [&](double lambda) {
    const Shape<D> mean = (1.0 - lambda) * pair.i + lambda * pair.j;
    return lambda * (1.0 - lambda) * dot(pair.branch, inverse(mean) * pair.branch);
  };
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double left = high - golden * (high - low), right = low + golden * (high - low);
    (value(left) < value(right) ? low : high) = value(left) < value(right) ? left : right;
  }
  return value(0.5 * (low + high));
}

TYPED_TEST(CommonNormal, TouchesWherePerramAndWertheimsFunctionIsOne)
{
  constexpr int D = TypeParam::value;
  Random random(5);
  for (int k = 0; k < 1000; ++k) {
    const Pair<D> pair(random, 2.0, 0.0);
    const Vector<D> normal = common_normal(pair.i, pair.j, pair.branch, 6);
    EXPECT_NEAR((EllipsoidContact<double, D>(pair.i, pair.j, pair.branch, normal).overlap), 0.0,
                1e-13);
    EXPECT_NEAR(contact_function(pair), 1.0, 1e-12);
  }
}

TYPED_TEST(CommonNormal, HasClosedFormsAlongTheAxes)
{
  // tip on tip, side on side, and tip on side
  constexpr int D = TypeParam::value;
  Vector<D> semi_axes, turned;
  for (int a = 0; a < D; ++a) semi_axes[a] = turned[a] = 1.0 + 0.5 * a;
  std::reverse(turned.component, turned.component + D);
  const Shape<D> straight = shape_of<D>(semi_axes, Shape<D>::identity());
  const Shape<D> across = shape_of<D>(turned, Shape<D>::identity());
  for (int a = 0; a < D; ++a)
    for (const Shape<D> &other : {straight, across}) {
      Vector<D> branch = Vector<D>::zero();
      const double touching = semi_axes[a] + std::sqrt(other(a, a));
      branch[a] = 0.99 * touching;
      const Vector<D> normal = common_normal(straight, other, branch, 3);
      const EllipsoidContact<double, D> contact(straight, other, branch, normal);
      for (int b = 0; b < D; ++b) EXPECT_EQ(normal[b], a == b ? 1.0 : 0.0);
      EXPECT_NEAR(contact.overlap, 0.01 * touching, 1e-15 * touching);
      EXPECT_NEAR(contact.point_i[a], semi_axes[a] - 0.5 * contact.overlap, 1e-15 * touching);
    }
}

TYPED_TEST(CommonNormal, IsThatOfBallsForEqualSemiAxes)
{
  constexpr int D = TypeParam::value;
  Random random(6);
  for (int k = 0; k < 1000; ++k) {
    const double radius = random.uniform(1.0, 2.0), other = random.uniform(1.0, 2.0);
    Vector<D> radii, radii_of_other;
    for (int a = 0; a < D; ++a) radii[a] = radius, radii_of_other[a] = other;
    const Shape<D> i = shape_of<D>(radii, Shape<D>::identity());
    const Shape<D> j = shape_of<D>(radii_of_other, Shape<D>::identity());
    const Vector<D> direction = random_direction<D>(random);
    const Vector<D> branch = (0.999 * (radius + other)) * direction;
    const Vector<D> normal = common_normal(i, j, branch, 3);
    EXPECT_LT(angle_between(normal, direction), 1e-15);
    EXPECT_NEAR((EllipsoidContact<double, D>(i, j, branch, normal).overlap),
                0.001 * (radius + other), 4e-15);
  }
}

TYPED_TEST(CommonNormal, ChangesSignExactlyIfTheGrainsAreExchanged)
{
  constexpr int D = TypeParam::value;
  Random random(7);
  for (int k = 0; k < 2000; ++k) {
    const Pair<D> pair(random, 3.0, 0.01);
    const Tensor<float, D> i = pair.i.template as<float>(), j = pair.j.template as<float>();
    const Vec<float, D> branch = pair.branch.template as<float>();
    const Vec<float, D> normal = common_normal(i, j, branch, 5);
    const Vec<float, D> exchanged = common_normal(j, i, -1.0f * branch, 5);
    const EllipsoidContact<float, D> one(i, j, branch, normal),
        other(j, i, -1.0f * branch, exchanged);
    EXPECT_EQ(one.overlap, other.overlap);
    for (int a = 0; a < D; ++a) {
      EXPECT_EQ(exchanged[a], -normal[a]);
      EXPECT_EQ(other.point_i[a], one.point_j[a]);
      EXPECT_EQ(other.point_j[a], one.point_i[a]);
    }
  }
}

/// Converged overlap of a pair; the iterations are those of large overlaps.
template <int D> double overlap_of(const Shape<D> &i, const Shape<D> &j, const Vector<D> &branch)
{
  const Vector<D> normal = common_normal(i, j, branch, 30);
  return EllipsoidContact<double, D>(i, j, branch, normal).overlap;
}

TYPED_TEST(CommonNormal, MakesForcesAndTorquesTheGradientOfAPotential)
{
  // U = k delta^2/2 gives the force -k delta n on grain i and the torque point_i x force. For a
  // turn by the small angle e of the plane (a, b) this means d(delta)/de = point_i x n.
  constexpr int D = TypeParam::value;
  Random random(8);
  const double step = 1e-4;    // truncation and rounding are both about 1e-8
  for (int k = 0; k < 200; ++k) {
    const Pair<D> pair(random, 2.0, 0.01);
    const Vector<D> normal = common_normal(pair.i, pair.j, pair.branch, 30);
    const EllipsoidContact<double, D> contact(pair.i, pair.j, pair.branch, normal);
    for (int a = 0; a < D; ++a) {
      Vector<D> shift = Vector<D>::zero();
      shift[a] = step;
      const double slope = (overlap_of<D>(pair.i, pair.j, pair.branch + shift) -
                            overlap_of<D>(pair.i, pair.j, pair.branch - shift)) /
          (2.0 * step);
      EXPECT_NEAR(slope, -normal[a], 1e-6);
    }
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < a; ++b) {
        const auto turned = [&](double angle) {
          Tensor<double, D> turn = Tensor<double, D>::identity();
          turn(a, a) = turn(b, b) = std::cos(angle);
          turn(b, a) = std::sin(angle), turn(a, b) = -turn(b, a);
          return overlap_of<D>(turn * pair.i * transpose(turn), pair.j, pair.branch);
        };
        const double lever = contact.point_i[a] * normal[b] - contact.point_i[b] * normal[a];
        EXPECT_NEAR((turned(step) - turned(-step)) / (2.0 * step), lever, 1e-5);
      }
  }
}

}    // namespace
