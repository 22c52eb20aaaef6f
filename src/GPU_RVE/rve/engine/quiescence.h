// SPDX-License-Identifier: GPL-2.0-only
// State of rest of RVEs, and the stress of quiescent RVEs, which make no DEM steps. A diagnostic
// evaluation determines whether an RVE is at rest. The same code runs on the host and on a device,
// with the same bits.

#pragma once

#include "rve/engine/affine_stiffness.h"
#include "rve/engine/finite_strain.h"

#include <cstdint>

namespace rve {

/// State of rest of an RVE, as far as it is known.
enum class Rest : std::int32_t {
  Unknown,      ///< not evaluated since its last DEM steps
  Moves,        ///< evaluated, and not at rest
  Rests,        ///< evaluated, and may become quiescent
  Quiescent,    ///< quiescent: skipped in the last macro step
  Wakes         ///< skipped in the last macro step, must make DEM steps in the next one
};

/// Returns true if the RVE has a deferred increment.
RVE_HD inline bool has_deferred(Rest rest)
{
  return rest == Rest::Quiescent || rest == Rest::Wakes;
}

/// Returns true if the RVE may be skipped while the strain is small.
RVE_HD inline bool may_stay_quiescent(Rest rest)
{
  return rest == Rest::Rests || rest == Rest::Quiescent;
}

/// Returns true if the next DEM steps may end with an evaluation. An RVE that was found moving
/// (Rest::Moves) first makes steps without an evaluation, in which it can come to rest.
RVE_HD inline bool may_be_evaluated(Rest rest)
{
  return rest == Rest::Unknown || rest == Rest::Quiescent;
}

/// Data from which the stress of a quiescent RVE follows. They are also set for an RVE that can
/// become quiescent.
template <int D> struct QuiescentStateOf {
  using Matrix = Tensor<double, D>;

  Matrix pending = Matrix::identity();    ///< deformation since the last DEM step
  Matrix stress = Matrix::zero();         ///< stress after the last DEM step [stress]
  AffineStiffnessOf<D> stiffness;
  double mean_overlap = 0.0;    ///< mean overlap after the last DEM step [-]

  /// Returns the stress after this deformation since the last DEM step: sigma + C:eps, rotated with
  /// the RVE [stress].
  RVE_HD Matrix stress_after(const Matrix &deformation) const
  {
    const RotationAndStrain<D> parts(deformation);
    return parts.rotation * (stress + stiffness(parts.strain)) * transpose(parts.rotation);
  }
};

}    // namespace rve
