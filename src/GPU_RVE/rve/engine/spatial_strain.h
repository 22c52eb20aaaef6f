// SPDX-License-Identifier: GPL-2.0-only
// Rotation and stretch of a deformation increment in space, and what a constant velocity gradient makes of a cell. finite_strain.h has those of the
// plane, and what is alike in both.

#pragma once

#include "rve/core/pi.h"
#include "rve/core/tensor.h"

#include <cmath>

namespace rve {

/// The rotation about the direction of `turn` by its length [rad], right-handed: Rodrigues' formula.
Tensor3 spatial_rotation(const Vec<double, 3> &turn);

/// Direction and angle of a rotation, as one vector: the angle is its length, in [0, pi] [rad]. At pi its sign is anybody's.
Vec<double, 3> rotation_vector(const Tensor3 &rotation);

RVE_HD inline double largest_component(const Tensor3 &t)
{
  double largest = 0.0;
  for (const double x : t.component) largest = std::fmax(largest, std::fabs(x));
  return largest;
}

/// R of F = R U, det F > 0. By Newton's iteration R <- (R + R^-T)/2 (Higham 1986, "Computing the polar decomposition, with applications", SIAM
/// J. Sci. Stat. Comput. 7), which doubles its digits in each step. On a device to the same bits.
RVE_HD inline Tensor3 rotation_of(const Tensor3 &f)
{
  constexpr int MOST = 100;    // 2^100 of stretch; a handful for any increment
  Tensor3 rotation = f;
  for (int k = 0; k < MOST; ++k) {
    const Tensor3 next = 0.5 * (rotation + transpose(inverse(rotation)));
    const double change = largest_component(next - rotation);
    rotation = next;
    if (!(change > 1e-15)) break;    // a NaN ends here too
  }
  return rotation;
}

/// The angle in [0, pi] of this sine and cosine, whose squares have a sum of one [rad]: on a device to the same bits. Halved until the series of the
/// arcsine has its last digit.
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
  // 1/6, 3/40, 15/336, ...: each term is (2n - 1)^2/(2n (2n + 1)) of the one before
  const double square = sine * sine;
  double term = sine, sum = sine;
  for (int n = 1; n <= 8; ++n) {
    term = term * square * ((2.0 * n - 1.0) * (2.0 * n - 1.0) / (2.0 * n * (2.0 * n + 1.0)));
    sum += term;
  }
  return is_obtuse ? kPi - doublings * sum : doublings * sum;
}

/// Biot's U - 1 where F = R U, symmetric to the last bit [-].
template <int D>
RVE_HD Tensor<double, D> biot_strain(const Tensor<double, D> &f, const Tensor<double, D> &rotation)
{
  const Tensor<double, D> stretch = transpose(rotation) * f;
  return 0.5 * (stretch + transpose(stretch)) - Tensor<double, D>::identity();
}

/// F = R U, det F > 0.
struct SpatialPolarDecomposition {
  Tensor3 rotation;       ///< R
  Vec<double, 3> turn;    ///< of R: rotation_vector [rad]
  Tensor3 strain;         ///< Biot's U - 1, symmetric [-]

  explicit SpatialPolarDecomposition(const Tensor3 &f);
};

/// exp(A), the deformation that a velocity gradient A/t makes in t: by its series of A/2^n, squared n times. What A leaves apart stays
/// apart: zeros of a drive along one axis are zeros of the increment, to the bit.
Tensor3 exponential(const Tensor3 &a);

}    // namespace rve
