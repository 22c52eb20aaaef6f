// SPDX-License-Identifier: GPL-2.0-only
// Linear elasticity, for verification and for material without grains.

#pragma once

#include "mpm/elastic_law.h"

namespace mpm {

/// Isotropic linear elasticity, in 2D for plane strain, as an objective hypoelastic law:
///   σ_new = R σ Rᵀ + λ tr(D) I + 2 μ D
/// with the strain increment D, the rotation R and Lamé's constants λ, μ. D and R follow from the
/// displacement gradient with respect to the configuration in the middle of the increment (Hughes &
/// Winget 1980, Int. J. Numer. Meth. Engng 15, 1862; it integrates the Jaumann rate). The law needs
/// no state variables, starts from any initial stress, and is exact for rigid rotations of any size
/// and for small strains. It does not derive from an energy: closed cycles of large strain gain or
/// lose work of the order (σ/E)².
template <int D> class LinearElastic : public ElasticLaw<D> {
 public:
  /// Throws rve::InputError unless young_modulus > 0 [stress] and -1 < poisson_ratio < 0.5.
  LinearElastic(double young_modulus, double poisson_ratio);

  void update(int count, const int *point_index,
              const rve::Tensor<double, D> *deformation_increment, double dt,
              rve::Tensor<double, D> *stress, MemoryRows memory) override;

 private:
  using ElasticLaw<D>::lame_first_, ElasticLaw<D>::shear_modulus_;
};

}    // namespace mpm
