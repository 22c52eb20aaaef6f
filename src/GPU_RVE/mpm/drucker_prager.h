// SPDX-License-Identifier: GPL-2.0-only
// Drucker-Prager plasticity. With a friction angle of zero it is von Mises plasticity.

#pragma once

#include "mpm/frictional_law.h"

namespace mpm {

/// Elastic, perfectly plastic Drucker-Prager law. The yield function f and the plastic potential g
/// are, with I1 = tr σ, J2 = s:s/2 and the deviator s of the stress σ, tension positive:
///   f = sqrt(J2) + α I1 - k,    g = sqrt(J2) + β I1,
///   α = 2 sin φ/(sqrt(3) (3 - sin φ)),  k = 6 c cos φ/(sqrt(3) (3 - sin φ))
/// with the friction angle φ and the cohesion c [stress]. β is α with the dilation angle ψ in place
/// of φ. The cone passes through those edges of the Mohr-Coulomb pyramid that belong to triaxial
/// compression (Drucker & Prager 1952, Q. Appl. Math. 10, 157; de Souza Neto, Peric & Owen 2008,
/// Computational Methods for Plasticity, section 8.3). An increment is first elastic, as in
/// LinearElastic. Nothing hardens, so the implicit step returns along a line to the cone or to its
/// apex, the isotropic tension c cot φ. In 2D the law is for plane strain.
template <int D> class DruckerPrager : public FrictionalLaw<D> {
  using Tensor = rve::Tensor<double, D>;

 public:
  using FrictionalLaw<D>::OutOfPlaneStress, FrictionalLaw<D>::PlasticStrain;

  /// Throws rve::InputError as FrictionalLaw does.
  DruckerPrager(double young_modulus, double poisson_ratio, double cohesion,
                double friction_degrees, double dilation_degrees);

  void update(int count, const int *point_index, const Tensor *deformation_increment, double dt,
              Tensor *stress, MemoryRows memory) override;

  /// Yield function f for the stress of a point [stress]. f is positive outside of the cone.
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
