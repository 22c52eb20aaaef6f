// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/spatial_strain.h"

#include <cmath>

namespace rve {

namespace {

  /// [v] x = v cross x
  Tensor3 cross_matrix(const Vec<double, 3> &v)
  {
    return Tensor3{{0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0}};
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
    const double factor = 0.25 / w;
    v = {
        {factor * (r(2, 1) - r(1, 2)), factor * (r(0, 2) - r(2, 0)), factor * (r(1, 0) - r(0, 1))}};
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

SpatialPolarDecomposition::SpatialPolarDecomposition(const Tensor3 &f) :
    rotation(rotation_of(f)), turn(rotation_vector(rotation)), strain(biot_strain(f, rotation))
{
}

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
