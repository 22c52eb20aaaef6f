// SPDX-License-Identifier: GPL-2.0-only
// Geometry of one contact of two disks (or spheres): numbers in, numbers out.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/tensor.h"

namespace rve {
inline namespace RVE_ISA {

  /// R^2 - d^2 [length^2]: positive when two grains touch, equation (7). One rounding of the small difference, where R - d
  /// would carry the rounding of the root: this is what keeps stiff grains accurate.
  template <class Wide, int D>
  RVE_INLINE Wide gap_squared(const Vec<Wide, D> &branch, Wide sum_of_radii)
  {
    Wide gap = sum_of_radii * sum_of_radii;
    for (int a = 0; a < D; ++a) gap = fma(-branch[a], branch[a], gap);
    return gap;
  }

  /// A touching pair seen from grain i. Under exchange of i and j the branch and the normal change sign exactly and everything
  /// else keeps its bits, so the force does not depend on which of the two grains owns the pair.
  template <class Real, int D> struct ContactGeometry {
    Vec<Real, D> branch;    ///< from grain i to the nearest image of grain j [length]
    Vec<Real, D> normal;    ///< unit, from i to j
    Real distance;          ///< |branch| [length]
    Real curvature;         ///< 1/|branch| [1/length]
    Real overlap;           ///< R_i + R_j - |branch| [length]
  };

  /// Added to squared distances [internal length^2]: far below the rounding of any that physics knows. Coinciding centres get a
  /// normal of zero and their full overlap instead of NaN, which integer sums would turn into any number.
  constexpr double kLeastSquaredDistance = 1e-30;

  /// Equations (8)-(10). The grains touch when the overlap is positive.
  ///
  /// With a wider format for the branch the overlap is (R^2 - d^2) / (R + d), whose numerator alone needs the wide format;
  /// otherwise R - d is as good.
  template <class Real, class Wide, int D>
  RVE_INLINE ContactGeometry<Real, D> contact_geometry(const Vec<Wide, D> &branch,
                                                       Wide sum_of_radii)
  {
    ContactGeometry<Real, D> contact;
    contact.branch = branch.template as<Real>();
    Real squared = Real(kLeastSquaredDistance);
    for (int a = 0; a < D; ++a) squared = fma(contact.branch[a], contact.branch[a], squared);
    const auto distance = root_and_inverse(squared);
    contact.distance = distance.root;
    contact.curvature = distance.inverse;
    contact.normal = distance.inverse * contact.branch;
    if constexpr (sizeof(Wide) > sizeof(Real))
      contact.overlap = static_cast<Real>(gap_squared(branch, sum_of_radii)) *
          reciprocal(static_cast<Real>(sum_of_radii) + contact.distance);
    else
      contact.overlap = sum_of_radii - contact.distance;
    return contact;
  }

}    // namespace RVE_ISA
}    // namespace rve
