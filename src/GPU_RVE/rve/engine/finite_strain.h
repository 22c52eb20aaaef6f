// Rotation and stretch of a plane deformation increment, on the host.

#ifndef RVE_ENGINE_FINITE_STRAIN_H
#define RVE_ENGINE_FINITE_STRAIN_H

#include "rve/engine/state.h"

#include <cmath>

namespace rve {

inline Tensor2 plane_rotation(double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  return Tensor2{{c, -s, s, c}};
}

/// F = R U, det F > 0.
struct PolarDecomposition {
  double angle;        ///< of R, counter-clockwise, in (-pi, pi] [rad]
  Tensor2 rotation;    ///< R
  Tensor2 strain;      ///< Biot's U - 1, symmetric [-]

  explicit PolarDecomposition(const Tensor2 &f) :
      angle(std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1))), rotation(plane_rotation(angle)),
      strain(transpose(rotation) * f - Tensor2::identity())
  {
    strain(0, 1) = strain(1, 0) = 0.5 * (strain(0, 1) + strain(1, 0));    // to the last bit
  }
};

/// sqrt(a_ij a_ij)
inline double norm(const Tensor2 &a)
{
  return std::sqrt(a(0, 0) * a(0, 0) + a(0, 1) * a(0, 1) + a(1, 0) * a(1, 0) + a(1, 1) * a(1, 1));
}

/// Size of the strain in a deformation increment, |U - 1| [-]: zero for a rotation.
inline double strain_size(const Tensor2 &f)
{
  return norm(PolarDecomposition(f).strain);
}

/// The deformation after a share of the increment, 0 to 1: R^share (1 + share (U - 1)), the path that the engine takes.
inline Tensor2 part_of_increment(const Tensor2 &f, double share)
{
  const PolarDecomposition polar(f);
  return plane_rotation(share * polar.angle) * (Tensor2::identity() + share * polar.strain);
}

}    // namespace rve

#endif
