// SPDX-License-Identifier: GPL-2.0-only
// Rotation and stretch of a deformation increment. The functions with RVE_HD also run on a device.

#pragma once

#include "rve/core/pi.h"
#include "rve/core/tensor.h"

#include <cmath>
#include <limits>

namespace rve {

/// Returns the axial vector of F - F^T. For a rotation its length is twice the sine of the angle.
RVE_HD inline Vec<double, 3> axial_vector(const Tensor3 &f)
{
  return {{f(2, 1) - f(1, 2), f(0, 2) - f(2, 0), f(1, 0) - f(0, 1)}};
}

inline Tensor2 plane_rotation(double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  return Tensor2{{c, -s, s, c}};
}

/// Returns the right-handed rotation about the direction of `turn` by its length [rad] (Rodrigues).
Tensor3 spatial_rotation(const Vec<double, 3> &turn);

/// Returns a rotation as a vector along its axis. The length of the vector is the angle, in [0, pi]
/// [rad]. At the angle pi the sign of the vector is arbitrary.
Vec<double, 3> rotation_vector(const Tensor3 &rotation);

RVE_HD inline double largest_component(const Tensor3 &t)
{
  double largest = 0.0;
  for (const double x : t.component) largest = std::fmax(largest, std::fabs(x));
  return largest;
}

/// Returns the rotation R of F = R U, det F > 0. Newton's iteration R <- (R + R^-T)/2 converges
/// quadratically (Higham 1986, "Computing the polar decomposition, with applications", SIAM J. Sci.
/// Stat. Comput. 7). Host and device give the same bits.
RVE_HD inline Tensor3 rotation_of(const Tensor3 &f)
{
  constexpr int MOST = 100;    // sufficient for a stretch of 2^100; increments need a handful
  Tensor3 rotation = f;
  for (int k = 0; k < MOST; ++k) {
    const Tensor3 next = 0.5 * (rotation + transpose(inverse(rotation)));
    const double change = largest_component(next - rotation);
    rotation = next;
    if (!(change > 1e-15)) break;    // also ends the loop for a NaN
  }
  return rotation;
}

/// Returns the angle in [0, pi] from its sine and cosine [rad]. The sum of their squares must be
/// one. The function halves the angle until the series of the arcsine is exact to the last digit.
/// Host and device give the same bits.
RVE_HD inline double angle_of(double sine, double cosine)
{
  constexpr double SMALL = 0.1;
  const bool is_obtuse = cosine < 0.0;
  if (is_obtuse) cosine = -cosine;
  double doublings = 1.0;
  while (sine > SMALL) {
    cosine = std::sqrt(0.5 * (1.0 + cosine));
    sine = 0.5 * sine / cosine;
    doublings *= 2.0;
  }
  // The coefficients of the series are 1, 1/6, 3/40, 15/336, ... Each is (2n - 1)^2/(2n (2n + 1))
  // times the previous one.
  const double square = sine * sine;
  double term = sine, sum = sine;
  for (int n = 1; n <= 8; ++n) {
    term = term * square * ((2.0 * n - 1.0) * (2.0 * n - 1.0) / (2.0 * n * (2.0 * n + 1.0)));
    sum += term;
  }
  return is_obtuse ? kPi - doublings * sum : doublings * sum;
}

/// Returns Biot's strain U - 1 of F = R U, symmetric to the last bit [-].
template <int D>
RVE_HD Tensor<double, D> biot_strain(const Tensor<double, D> &f, const Tensor<double, D> &rotation)
{
  const Tensor<double, D> stretch = transpose(rotation) * f;
  return 0.5 * (stretch + transpose(stretch)) - Tensor<double, D>::identity();
}

/// Polar decomposition F = R U, det F > 0.
template <int D> struct PolarDecomposition;

template <> struct PolarDecomposition<2> {
  double angle;        ///< angle of R, counter-clockwise, in (-pi, pi] [rad]
  Tensor2 rotation;    ///< R
  Tensor2 strain;      ///< Biot's U - 1, symmetric [-]

  explicit PolarDecomposition(const Tensor2 &f) :
      angle(std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1))), rotation(plane_rotation(angle)),
      strain(transpose(rotation) * f - Tensor2::identity())
  {
    // The strain becomes symmetric to the last bit.
    strain(0, 1) = strain(1, 0) = 0.5 * (strain(0, 1) + strain(1, 0));
  }

  /// Returns R^share.
  Tensor2 part_of_rotation(double share) const { return plane_rotation(share * angle); }
};

template <> struct PolarDecomposition<3> {
  Tensor3 rotation;       ///< R
  Vec<double, 3> turn;    ///< rotation_vector() of R [rad]
  double angle;           ///< angle of R, in [0, pi] [rad]
  Tensor3 strain;         ///< Biot's U - 1, symmetric [-]

  explicit PolarDecomposition(const Tensor3 &f) :
      rotation(rotation_of(f)), turn(rotation_vector(rotation)), angle(std::sqrt(dot(turn, turn))),
      strain(biot_strain(f, rotation))
  {
  }

  Tensor3 part_of_rotation(double share) const { return spatial_rotation(share * turn); }
};
template <int D> PolarDecomposition(const Tensor<double, D> &) -> PolarDecomposition<D>;

/// Returns the rotation R of F = R U in the plane, det F > 0, without trigonometric functions. Host
/// and device give the same bits.
RVE_HD inline Tensor2 rotation_of(const Tensor2 &f)
{
  const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
  const double length = std::sqrt(twice_cosine * twice_cosine + twice_sine * twice_sine);
  const double c = twice_cosine / length, s = twice_sine / length;
  return Tensor2{{c, -s, s, c}};
}

/// Returns the angle of a rotation, in [0, pi] [rad]. Host and device give the same bits.
RVE_HD inline double angle_of_rotation(const Tensor2 &r)
{
  return angle_of(std::fabs(r(1, 0)), r(0, 0));
}
/// Returns the angle of a rotation in space, in [0, pi] [rad]. The length of the axial vector is
/// twice the sine of the angle.
RVE_HD inline double angle_of_rotation(const Tensor3 &r)
{
  const Vec<double, 3> axis = axial_vector(r);
  return angle_of(0.5 * std::sqrt(dot(axis, axis)), 0.5 * (trace(r) - 1.0));
}

/// Rotation and Biot strain of an increment. Unlike PolarDecomposition it does not compute the
/// angle.
template <int D> struct RotationAndStrain {
  Tensor<double, D> rotation, strain;

  RVE_HD explicit RotationAndStrain(const Tensor<double, D> &f) :
      rotation(rotation_of(f)), strain(biot_strain(f, rotation))
  {
  }
};

/// Returns sqrt(a_ij a_ij).
template <int D> RVE_HD double norm(const Tensor<double, D> &a)
{
  double sum = 0.0;
  for (const double x : a.component) sum += x * x;
  return std::sqrt(sum);
}

/// Replaces an increment F = V R by its left stretch V, and returns its rotation R.
template <int D> RVE_HD Tensor<double, D> take_rotation(Tensor<double, D> &increment)
{
  const Tensor<double, D> rotation = rotation_of(increment);
  increment = increment * transpose(rotation);
  return rotation;
}

/// Returns the size of the strain in a deformation increment, |U - 1| [-]; zero for a rotation. In
/// the plane it follows from the sum and the difference of the principal stretches.
RVE_HD inline double strain_size(const Tensor2 &f)
{
  const double sum = std::sqrt((f(0, 0) + f(1, 1)) * (f(0, 0) + f(1, 1)) +
                               (f(1, 0) - f(0, 1)) * (f(1, 0) - f(0, 1)));
  const double square_of_difference =
      (f(0, 0) - f(1, 1)) * (f(0, 0) - f(1, 1)) + (f(0, 1) + f(1, 0)) * (f(0, 1) + f(1, 0));
  return std::sqrt(0.5 * ((sum - 2.0) * (sum - 2.0) + square_of_difference));
}

/// Finds strain_size() of a small increment in space, such as the increment of a macro step, to
/// twelve digits. It uses the series of U = sqrt(1 + 2E), E = (F^T F - 1)/2 [-]. Returns false if
/// the strain is not small.
RVE_HD inline bool find_strain_size(const Tensor3 &f, double &size)
{
  constexpr double SMALL = 1e-3;
  const Tensor3 green = 0.5 * (transpose(f) * f - Tensor3::identity());
  if (!(norm(green) < SMALL)) return false;
  const Tensor3 square = green * green;
  size = norm(green - 0.5 * square + 0.5 * (square * green) - 0.625 * (square * square));
  return true;
}
RVE_HD inline bool find_strain_size(const Tensor2 &f, double &size)
{
  size = strain_size(f);
  return true;
}

inline double strain_size(const Tensor3 &f)
{
  double size;
  return find_strain_size(f, size) ? size : norm(PolarDecomposition(f).strain);
}

constexpr double NO_BOUND = std::numeric_limits<double>::infinity();

/// Returns an upper bound of the angle of the rotation in a deformation increment [rad]. The bound
/// is close to the angle if rotation and strain are small. It can be infinite if one of them is
/// large; only a polar decomposition then gives the angle.
RVE_HD inline double bound_of_rotation(const Tensor2 &f)
{
  const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
  return twice_cosine > 0.0 ? std::fabs(twice_sine) / twice_cosine : NO_BOUND;
}

/// Returns the bound for an increment in space. F = R U gives F - F^T = R - R^T + (R - 1)(U - 1) -
/// (U - 1)(R - 1)^T. The length of the axial vector of F - F^T is at least 2 sin(angle) - sqrt(2)
/// angle |U - 1|. This lower bound is at least angle/0.55 if the angle is below 0.45 and |U - 1| is
/// below 1/40.
RVE_HD inline double bound_of_rotation(const Tensor3 &f)
{
  const Vec<double, 3> axis = axial_vector(f);
  // |U - 1| is about half of the norm of F^T F - 1. The trace of F exceeds 1 + 2 cos(angle) by at
  // most sqrt(3) |U - 1|.
  const bool turns_little = trace(f) > 2.85 && norm(transpose(f) * f - Tensor3::identity()) < 0.05;
  return turns_little ? 0.55 * std::sqrt(dot(axis, axis)) : NO_BOUND;
}

/// Returns the deformation after a share of the increment, from 0 to 1: R^share (1 + share (U -
/// 1)). The engine deforms an RVE along this path.
template <int D> Tensor<double, D> part_of_increment(const Tensor<double, D> &f, double share)
{
  const PolarDecomposition polar(f);
  return polar.part_of_rotation(share) * (Tensor<double, D>::identity() + share * polar.strain);
}

/// Returns exp(A): the deformation in the time t by the constant velocity gradient A/t. Exact zeros
/// are preserved, so that a motion along one axis does not change the other components of the
/// increment.
Tensor2 exponential(const Tensor2 &a);
Tensor3 exponential(const Tensor3 &a);

}    // namespace rve
