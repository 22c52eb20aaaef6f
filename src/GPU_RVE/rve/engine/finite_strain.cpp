// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/finite_strain.h"

#include <cmath>

namespace rve {

namespace {

  /// Returns the matrix [v] with [v] x = v cross x.
  Tensor3 cross_matrix(const Vec<double, 3> &v)
  {
    return Tensor3{{0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0}};
  }

  // Returns x y + z w with one rounding error each (Kahan), so no digits are lost if the products
  // cancel.
  double sum_of_products(double x, double y, double z, double w)
  {
    const double product = z * w;
    const double error = std::fma(z, w, -product);
    return std::fma(x, y, product) + error;
  }

  // Returns sinh(sqrt(d))/sqrt(d) for d > 0, sin(sqrt(-d))/sqrt(-d) for d < 0, and 1 for d = 0.
  double hyperbolic_sinc(double d)
  {
    // The error of four terms of the series is d^4/362880 < 3e-18.
    if (std::fabs(d) < 1e-3) return 1.0 + d / 6.0 * (1.0 + d / 20.0 * (1.0 + d / 42.0));
    const double root = std::sqrt(std::fabs(d));
    return d > 0.0 ? std::sinh(root) / root : std::sin(root) / root;
  }

}    // namespace

Tensor3 spatial_rotation(const Vec<double, 3> &turn)
{
  const double angle = std::sqrt(dot(turn, turn));
  // The forms sin(t)/t and (1 - cos(t))/t^2 = (sin(t/2)/(t/2))^2/2 lose no digits for small t.
  const double half = 0.5 * angle;
  const double sine = angle > 0.0 ? std::sin(angle) / angle : 1.0;
  const double half_sine = half > 0.0 ? std::sin(half) / half : 1.0;
  const Tensor3 k = cross_matrix(turn);
  return Tensor3::identity() + (sine * k + (0.5 * half_sine * half_sine) * (k * k));
}

Vec<double, 3> rotation_vector(const Tensor3 &rotation)
{
  // The largest component of the quaternion is computed first, and the others from it. So no root
  // loses digits.
  const Tensor3 &r = rotation;
  const double t = trace(r);
  double w;
  Vec<double, 3> v;
  int axis = r(0, 0) >= r(1, 1) ? 0 : 1;
  axis = r(axis, axis) >= r(2, 2) ? axis : 2;
  if (t >= r(axis, axis)) {
    w = 0.5 * std::sqrt(1.0 + t);
    v = (0.25 / w) * axial_vector(r);
  } else {
    const int next = (axis + 1) % 3, last = (axis + 2) % 3;
    v[axis] = 0.5 * std::sqrt(1.0 + r(axis, axis) - r(next, next) - r(last, last));
    const double factor = 0.25 / v[axis];
    v[next] = factor * (r(next, axis) + r(axis, next));
    v[last] = factor * (r(last, axis) + r(axis, last));
    w = factor * (r(last, next) - r(next, last));
  }
  if (w < 0.0) {    // both signs describe the same rotation
    w = -w;
    v = -1.0 * v;
  }
  const double sine = std::sqrt(dot(v, v));    // sine of half the angle
  return sine > 0.0 ? (2.0 * std::atan2(sine, w) / sine) * v : v;
}

// The exponential of a plane tensor has a closed form: A = m 1 + B with tr B = 0 has B B = d 1, so
// exp A = e^m (cosh(sqrt d) 1 + sinh(sqrt d)/sqrt d B). The result of a triangular tensor keeps the
// exact zero, and its diagonal elements are the exponentials of those of A. So a motion along one
// axis does not change the other axis.
Tensor2 exponential(const Tensor2 &a)
{
  const double mean = 0.5 * (a(0, 0) + a(1, 1));
  const double half_difference = 0.5 * (a(0, 0) - a(1, 1));
  const double d = sum_of_products(half_difference, half_difference, a(0, 1), a(1, 0));
  const double factor = std::exp(mean);
  const double s = hyperbolic_sinc(d);

  Tensor2 result;
  result(0, 1) = factor * s * a(0, 1);
  result(1, 0) = factor * s * a(1, 0);
  if (a(0, 1) == 0.0 || a(1, 0) == 0.0) {
    result(0, 0) = std::exp(a(0, 0));
    result(1, 1) = std::exp(a(1, 1));
  } else {
    const double c = d > 0.0 ? std::cosh(std::sqrt(d)) : std::cos(std::sqrt(-d));
    result(0, 0) = factor * (c + s * half_difference);
    result(1, 1) = factor * (c - s * half_difference);
  }
  return result;
}

// The exponential is the series of A/2^n, squared n times.
Tensor3 exponential(const Tensor3 &a)
{
  // If the norm of the argument is at most 1/2, the remainder of the series after 14 terms is below
  // 2^-14/14! of the sum. This is less than the rounding error.
  constexpr int TERMS = 14;
  int halvings = 0;
  Tensor3 part = a;
  while (largest_component(part) > 0.125 && halvings < 1100) {
    part = 0.5 * part;
    ++halvings;
  }
  // The loops compute exp(A) - 1, since the addition of the identity would cut off its last digits.
  Tensor3 less_one = Tensor3::zero();
  for (int k = TERMS; k >= 1; --k) less_one = (1.0 / k) * (part * (Tensor3::identity() + less_one));
  for (; halvings > 0; --halvings) less_one = 2.0 * less_one + less_one * less_one;
  return Tensor3::identity() + less_one;
}

}    // namespace rve
