// SPDX-License-Identifier: GPL-2.0-only
// RVEs that sleep through macro steps: what is known of one after a look at it, and the stress that follows. One text for the host and for a device,
// to the same bits on both.

#pragma once

#include "rve/engine/affine_stiffness.h"
#include "rve/engine/finite_strain.h"

#include <cstdint>

namespace rve {

/// What is known of whether an RVE rests.
enum class Rest : std::int32_t {
  Unknown,    ///< it has not been looked at since its last DEM steps
  Moves,      ///< it has, and is not at rest
  Rests,      ///< it has, and may sleep
  Sleeps,     ///< it was skipped in the last macro step
  Wakes       ///< the same, but it may not be skipped again
};

/// Whether a deformation is pending.
RVE_HD inline bool owes(Rest rest)
{
  return rest == Rest::Sleeps || rest == Rest::Wakes;
}

/// Whether it may be skipped while the strain is small.
RVE_HD inline bool may_sleep_on(Rest rest)
{
  return rest == Rest::Rests || rest == Rest::Sleeps;
}

/// Whether the next DEM steps may end with a look. One that was not at rest has some to come to rest.
RVE_HD inline bool may_be_looked_at(Rest rest)
{
  return rest == Rest::Unknown || rest == Rest::Sleeps;
}

/// Of an RVE that sleeps, or may: what its stress follows from.
template <int D> struct SleepOf {
  using Matrix = Tensor<double, D>;

  Matrix pending = Matrix::identity();    ///< deformation since its last DEM step
  Matrix stress = Matrix::zero();         ///< of that step [stress]
  AffineStiffnessOf<D> stiffness;
  double mean_overlap = 0.0;    ///< of that step [-]

  /// sigma + C:eps after this deformation since that step, turned with the RVE [stress].
  RVE_HD Matrix stress_after(const Matrix &deformation) const
  {
    const RotationAndStrain<D> parts(deformation);
    return parts.rotation * (stress + stiffness(parts.strain)) * transpose(parts.rotation);
  }
};

}    // namespace rve
