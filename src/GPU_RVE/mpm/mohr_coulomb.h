// SPDX-License-Identifier: GPL-2.0-only
// Mohr-Coulomb and Tresca plasticity: the return mapping in principal stresses, and the
// constitutive law. The law is for material points without RVEs, and for verification against
// bearing capacities in closed form.

#pragma once

#include "mpm/frictional_law.h"
#include "rve/core/config.h"

namespace mpm {

/// Return mapping of perfect plasticity. The yield function f and the plastic potential g are, for
/// principal stresses σ1 >= σ2 >= σ3, tension positive:
///   f = k σ1 - σ3 - s,    g = m σ1 - σ3,
///   k = (1 + sin φ)/(1 - sin φ),  m = (1 + sin ψ)/(1 - sin ψ),  s = 2 c sqrt(k)
/// with the friction angle φ, the dilation angle ψ and the cohesion c [stress]. For all orders of
/// the principal stresses together, f = 0 is a pyramid in the space of principal stresses. Its apex
/// is the isotropic tension c cot φ. For φ = ψ = 0 the pyramid becomes Tresca's prism of the
/// strength c, which has no apex. The sides of the pyramid are planes, and nothing hardens. The
/// return of the implicit Euler step is therefore exact and ends on a plane, an edge or the apex
/// (Clausen, Damkilde & Andersen 2007, Comput. Struct. 85, 1795; de Souza Neto, Peric & Owen 2008,
/// Computational Methods for Plasticity, section 8.2).
struct MohrCoulombReturn {
  double lame_first;           ///< λ [stress]
  double shear_modulus;        ///< μ [stress]
  double friction_ratio;       ///< k
  double dilatancy_ratio;      ///< m
  double uniaxial_strength;    ///< s, uniaxial compressive strength [stress]

  /// Principal stresses [stress].
  struct Principal {
    double value[3];    ///< in descending order
  };

  RVE_INLINE double yield(const Principal &stress) const
  {
    return friction_ratio * stress.value[0] - stress.value[2] - uniaxial_strength;
  }

  /// Returns the stress after an elastic trial stress, or the trial stress if it is admissible.
  RVE_INLINE Principal operator()(const Principal &trial) const
  {
    const double k = friction_ratio;
    const double m = dilatancy_ratio;
    const double f = yield(trial);
    if (!(f > 0.0)) return trial;

    // Plane: σ = trial - Δλ C b with the plastic multiplier Δλ = f/(a·C b). The gradients of f and
    // g are a = (k, 0, -1) and b = (m, 0, -1). The elastic stiffness C gives C b = λ tr(b) 1 + 2 μ
    // b.
    const double bulk = lame_first * (m - 1.0);
    const double first = bulk + 2.0 * shear_modulus * m;
    const double third = bulk - 2.0 * shear_modulus;
    const double on_plane = f / (k * first - third);
    Principal stress = {{trial.value[0] - on_plane * first, trial.value[1] - on_plane * bulk,
                         trial.value[2] - on_plane * third}};
    if (stress.value[0] >= stress.value[1] && stress.value[1] >= stress.value[2]) return stress;

    // Edge: the return to the plane has changed the order, so the neighbouring plane is active too.
    // By symmetry one plane replaces both. It uses the mean of the two stresses that are equal on
    // the edge, and the mean of both gradients b.
    const double *t = trial.value;
    if (stress.value[1] > stress.value[0]) {
      // σ1 = σ2: triaxial compression; b = (m/2, m/2, -1)
      const double mean = 0.5 * (t[0] + t[1]);
      const double upper = bulk + shear_modulus * m;
      const double step = (k * mean - t[2] - uniaxial_strength) / (k * upper - third);
      stress.value[0] = stress.value[1] = mean - step * upper;
      stress.value[2] = k * stress.value[0] - uniaxial_strength;
    } else {
      // σ2 = σ3: triaxial extension; b = (m, -1/2, -1/2)
      const double mean = 0.5 * (t[1] + t[2]);
      const double lower = bulk - shear_modulus;
      const double step = (k * t[0] - mean - uniaxial_strength) / (k * first - lower);
      stress.value[0] = t[0] - step * first;
      stress.value[1] = stress.value[2] = k * stress.value[0] - uniaxial_strength;
    }
    if (stress.value[0] >= stress.value[2]) return stress;

    // the stress is beyond the end of the edge; k > 1, since Tresca's edges have no end
    const double apex = uniaxial_strength / (k - 1.0);
    return {{apex, apex, apex}};
  }
};

/// Elastic, perfectly plastic Mohr-Coulomb law. An increment is first elastic, as in LinearElastic.
/// MohrCoulombReturn then returns the principal stresses. In 2D the law is for plane strain, and
/// the out-of-plane stress is one of the three principal stresses. Flow at the apex and on edges is
/// included. There is no tension cut-off below the apex.
template <int D> class MohrCoulomb : public FrictionalLaw<D> {
  using Tensor = rve::Tensor<double, D>;

 public:
  using FrictionalLaw<D>::OutOfPlaneStress, FrictionalLaw<D>::PlasticStrain;

  /// Throws rve::InputError as FrictionalLaw does.
  MohrCoulomb(double young_modulus, double poisson_ratio, double cohesion, double friction_degrees,
              double dilation_degrees);

  void update(int count, const int *point_index, const Tensor *deformation_increment, double dt,
              Tensor *stress, MemoryRows memory) override;

  /// Yield function f for the stress of a point [stress]. f is positive outside of the pyramid.
  double yield(const Tensor &stress, const double *memory) const;

 private:
  MohrCoulombReturn return_;
};

}    // namespace mpm
