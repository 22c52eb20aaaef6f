// SPDX-License-Identifier: GPL-2.0-only
// Drucker-Prager plasticity, and von Mises' without friction.
//
// Why: a smooth yield surface with friction, for ground and for comparison with codes that have no other.

#pragma once

#include "mpm/frictional_law.h"

namespace mpm {

/// Elastic, perfectly plastic, with the yield function and the plastic potential, tension positive, I1 = tr σ, J2 = s:s/2,
///   f = sqrt(J2) + α I1 - k,    g = sqrt(J2) + β I1,
///   α = 2 sin φ/(sqrt(3) (3 - sin φ)),  k = 6 c cos φ/(sqrt(3) (3 - sin φ)),  β as α with ψ:
/// the cone through the edges of Mohr-Coulomb's pyramid on which triaxial compression fails (Drucker & Prager 1952, Q. Appl. Math. 10,
/// 157; de Souza Neto, Peric & Owen 2008, Computational Methods for Plasticity, section 8.3). The elastic trial is Hughes-Winget's, as in
/// LinearElastic; the implicit step goes back to the cone along a line, as nothing hardens, or to its apex, the tension c cot φ in all
/// directions. In the plane that is plane strain.
template <int D> class DruckerPrager : public FrictionalLaw<D> {
  using Tensor = rve::Tensor<double, D>;

 public:
  using FrictionalLaw<D>::OutOfPlaneStress, FrictionalLaw<D>::PlasticStrain;

  /// young_modulus > 0, cohesion >= 0 [stress]; 0 <= poisson_ratio < 0.5; 0 <= dilation <= friction < 90 [degrees];
  /// cohesion and friction not both 0. rve::InputError otherwise.
  DruckerPrager(double young_modulus, double poisson_ratio, double cohesion,
                double friction_degrees, double dilation_degrees);

  void update(int count, const int *point_index, const Tensor *deformation_increment, double dt,
              Tensor *stress, MemoryRows memory) override;

  /// f of a point's stress [stress]; positive outside.
  double yield(const Tensor &stress, const double *memory) const;

 private:
  /// I1 and sqrt(J2) [stress].
  struct Invariants {
    double trace, root;
  };
  static Invariants invariants_of(const Tensor &stress, double out_of_plane);

  using ElasticLaw<D>::lame_first_, ElasticLaw<D>::shear_modulus_;
  double friction_, dilatancy_;    ///< α, β
  double strength_;                ///< k [stress]
};

}    // namespace mpm
