// SPDX-License-Identifier: GPL-2.0-only
// Linear elasticity, for verification and for parts of scenes that need no grains.

#pragma once

#include "mpm/elastic_law.h"

namespace mpm {

/// Isotropic linear elasticity, in the plane that of plane strain, as a hypoelastic law with the rotation of the increment taken out:
///   σ_new = R σ Rᵀ + λ tr(D) I + 2 μ D
/// with D and the rotation R from the displacement gradient with respect to the middle of the increment
/// (Hughes & Winget 1980, Int. J. Numer. Meth. Engng 15, 1862; it integrates the Jaumann rate).
/// Chosen because it needs no memory but the stress, starts from any initial stress, and is exact for a rigid rotation
/// of any size and for small strains. It is not the derivative of an energy: over closed cycles of large strain it gains
/// or loses work of the order (σ/E)².
template <int D> class LinearElastic : public ElasticLaw<D> {
 public:
  /// young_modulus > 0 [stress], -1 < poisson_ratio < 0.5; rve::InputError otherwise.
  LinearElastic(double young_modulus, double poisson_ratio);

  void update(int count, const int *point_index,
              const rve::Tensor<double, D> *deformation_increment, double dt,
              rve::Tensor<double, D> *stress, MemoryRows memory) override;

 private:
  using ElasticLaw<D>::lame_first_, ElasticLaw<D>::shear_modulus_;
};

}    // namespace mpm
