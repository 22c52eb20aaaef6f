// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/finite_strain.h"

#include <cmath>

namespace rve {

namespace {

  /// [v] x = v cross x
  Tensor3 cross_matrix(const Vec<double, 3> &v)
  {
    return Tensor3{{0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0}};
  }

  // x y + z w with one rounding error each (Kahan): no digits are lost where the products cancel.
  double sum_of_products(double x, double y, double z, double w)
  {
    const double product = z * w;
    const double error = std::fma(z, w, -product);
    return std::fma(x, y, product) + error;
  }

  // sinh(sqrt(d))/sqrt(d), continued to d <= 0 as sin(sqrt(-d))/sqrt(-d).
  double hyperbolic_sinc(double d)
  {
    // four terms of the series leave d^4/362880 < 3e-18
    if (std::fabs(d) < 1e-3) return 1.0 + d / 6.0 * (1.0 + d / 20.0 * (1.0 + d / 42.0));
    const double root = std::sqrt(std::fabs(d));
    return d > 0.0 ? std::sinh(root) / root : std::sin(root) / root;
  }

}    // namespace

Tensor3 spatial_rotation(const Vec<double, 3> &turn)
{
  const double angle = std::sqrt(dot(turn, turn));
  // sin(t)/t and (1 - cos(t))/t^2 = (sin(t/2)/(t/2))^2/2, without the loss of digits where t is small
  const double half = 0.5 * angle;
  const double sine = angle > 0.0 ? std::sin(angle) / angle : 1.0;
  const double half_sine = half > 0.0 ? std::sin(half) / half : 1.0;
  const Tensor3 k = cross_matrix(turn);
  return Tensor3::identity() + (sine * k + (0.5 * half_sine * half_sine) * (k * k));
}

Vec<double, 3> rotation_vector(const Tensor3 &rotation)
{
  // the quaternion, from that of its components which is largest: none of the roots then loses digits
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
  if (w < 0.0) {    // the other way round
    w = -w;
    v = -1.0 * v;
  }
  const double sine = std::sqrt(dot(v, v));    // of half the angle
  return sine > 0.0 ? (2.0 * std::atan2(sine, w) / sine) * v : v;
}

// Exponential of a plane tensor, in closed form: A = m 1 + B with tr B = 0 has B B = d 1, so
// exp A = e^m (cosh(sqrt d) 1 + sinh(sqrt d)/sqrt d B). Triangular tensors keep their exact zeros and
// the exponentials of their diagonals: a drive along one axis must leave the other as it is.
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

// By the series of A/2^n, squared n times.
Tensor3 exponential(const Tensor3 &a)
{
  // the rest of the series after 14 terms of an argument of at most 1/2 is below 2^-14/14! of it, less than its rounding
  constexpr int TERMS = 14;
  int halvings = 0;
  Tensor3 part = a;
  while (largest_component(part) > 0.125 && halvings < 1100) {
    part = 0.5 * part;
    ++halvings;
  }
  // exp - 1, whose digits an identity beside it would cut off
  Tensor3 less_one = Tensor3::zero();
  for (int k = TERMS; k >= 1; --k) less_one = (1.0 / k) * (part * (Tensor3::identity() + less_one));
  for (; halvings > 0; --halvings) less_one = 2.0 * less_one + less_one * less_one;
  return Tensor3::identity() + less_one;
}

}    // namespace rve
