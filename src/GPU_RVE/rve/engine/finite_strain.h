// Rotation and stretch of a deformation increment, on the host.

#ifndef RVE_ENGINE_FINITE_STRAIN_H
#define RVE_ENGINE_FINITE_STRAIN_H

#include "rve/engine/spatial_strain.h"

#include <cmath>

namespace rve {

inline Tensor2 plane_rotation(double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  return Tensor2{{c, -s, s, c}};
}

/// F = R U, det F > 0.
template <int D> struct PolarDecomposition;

template <> struct PolarDecomposition<2> {
  double angle;        ///< of R, counter-clockwise, in (-pi, pi] [rad]
  Tensor2 rotation;    ///< R
  Tensor2 strain;      ///< Biot's U - 1, symmetric [-]

  explicit PolarDecomposition(const Tensor2 &f) :
      angle(std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1))), rotation(plane_rotation(angle)),
      strain(transpose(rotation) * f - Tensor2::identity())
  {
    strain(0, 1) = strain(1, 0) = 0.5 * (strain(0, 1) + strain(1, 0));    // to the last bit
  }

  /// R^share
  Tensor2 part_of_rotation(double share) const { return plane_rotation(share * angle); }
};

template <> struct PolarDecomposition<3> : SpatialPolarDecomposition {
  double angle;    ///< of R, in [0, pi] [rad]

  explicit PolarDecomposition(const Tensor3 &f) :
      SpatialPolarDecomposition(f), angle(std::sqrt(dot(turn, turn)))
  {
  }

  Tensor3 part_of_rotation(double share) const { return spatial_rotation(share * turn); }
};
template <int D> PolarDecomposition(const Tensor<double, D> &) -> PolarDecomposition<D>;

/// sqrt(a_ij a_ij)
template <int D> double norm(const Tensor<double, D> &a)
{
  double sum = 0.0;
  for (const double x : a.component) sum += x * x;
  return std::sqrt(sum);
}

/// Size of the strain in a deformation increment, |U - 1| [-]: zero for a rotation.
template <int D> double strain_size(const Tensor<double, D> &f)
{
  return norm(PolarDecomposition(f).strain);
}

/// The deformation after a share of the increment, 0 to 1: R^share (1 + share (U - 1)), the path that the engine takes.
template <int D> Tensor<double, D> part_of_increment(const Tensor<double, D> &f, double share)
{
  const PolarDecomposition polar(f);
  return polar.part_of_rotation(share) * (Tensor<double, D>::identity() + share * polar.strain);
}

}    // namespace rve

#endif
