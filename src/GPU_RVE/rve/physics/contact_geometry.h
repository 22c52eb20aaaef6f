// SPDX-License-Identifier: GPL-2.0-only
// Geometry of the contact of two disks or spheres.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/tensor.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns R^2 - d^2 [length^2], equation (7), with the sum of radii R and the distance d of the
  /// centres. It is positive if the grains touch. Stiff grains need this form: R - d would also
  /// contain the rounding of the root.
  template <class Wide, int D>
  RVE_INLINE Wide gap_squared(const Vec<Wide, D> &branch, Wide sum_of_radii)
  {
    Wide gap = sum_of_radii * sum_of_radii;
    for (int a = 0; a < D; ++a) gap = fma(-branch[a], branch[a], gap);
    return gap;
  }

  /// Geometry of a pair as seen from grain i. If i and j are exchanged, branch and normal change
  /// sign exactly and all other numbers keep their bits, so that the force does not depend on the
  /// owner of the pair.
  template <class Real, int D> struct ContactGeometry {
    Vec<Real, D> branch;    ///< from grain i to the nearest image of grain j [length]
    Vec<Real, D> normal;    ///< unit, from i to j
    Real distance;          ///< |branch| [length]
    Real curvature;         ///< 1/|branch| [1/length]
    Real overlap;           ///< R_i + R_j - |branch| [length]
  };

  /// Number added to squared distances [internal length^2]. It is far below the rounding of
  /// physical distances. With it, grains with coinciding centres have a normal of zero and their
  /// full overlap. Without it these numbers would be NaN, which rounding to integers would turn
  /// into an arbitrary number.
  constexpr double kLeastSquaredDistance = 1e-30;

  /// Returns the geometry by equations (8)-(10). The grains touch if the overlap is positive.
  ///
  /// If the branch has a wider format, the overlap is computed as (R^2 - d^2) / (R + d), since only
  /// the numerator then needs the wide format. Otherwise it is computed as R - d, which is as
  /// accurate.
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
