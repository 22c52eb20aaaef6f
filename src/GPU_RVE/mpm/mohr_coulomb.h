// SPDX-License-Identifier: GPL-2.0-only
// Mohr-Coulomb and Tresca plasticity: the return in principal stresses, and the law made of it.
//
// Why: ground that needs no grains, and the bearing capacities that are known in closed form for it.

#pragma once

#include "mpm/frictional_law.h"
#include "rve/core/config.h"

namespace mpm {

/// Perfect plasticity with the yield function and the plastic potential, for σ1 >= σ2 >= σ3, tension positive,
///   f = k σ1 - σ3 - s,    g = m σ1 - σ3,
///   k = (1 + sin φ)/(1 - sin φ),  m = (1 + sin ψ)/(1 - sin ψ),  s = 2 c sqrt(k),
/// and its permutations: a pyramid in principal stresses, whose apex is the tension c cot φ in all directions. φ = ψ = 0 is
/// Tresca's prism of the strength c, which has no apex. Since the planes are flat and nothing hardens, the return of the
/// implicit Euler step is exact, and goes to a plane, an edge or the apex (Clausen, Damkilde & Andersen 2007, Comput.
/// Struct. 85, 1795; de Souza Neto, Peric & Owen 2008, Computational Methods for Plasticity, section 8.2).
struct MohrCoulombReturn {
  double lame_first;           ///< λ [stress]
  double shear_modulus;        ///< μ [stress]
  double friction_ratio;       ///< k
  double dilatancy_ratio;      ///< m
  double uniaxial_strength;    ///< s, in compression [stress]

  /// Principal stresses [stress].
  struct Principal {
    double value[3];    ///< descending
  };

  RVE_INLINE double yield(const Principal &stress) const
  {
    return friction_ratio * stress.value[0] - stress.value[2] - uniaxial_strength;
  }

  /// The stress after an elastic trial stress; the trial itself if it is admissible.
  RVE_INLINE Principal operator()(const Principal &trial) const
  {
    const double k = friction_ratio;
    const double m = dilatancy_ratio;
    const double f = yield(trial);
    if (!(f > 0.0)) return trial;

    // plane: σ = trial - Δλ C b with b = (m, 0, -1); C b = λ tr(b) 1 + 2 μ b, and a·C b with a = (k, 0, -1)
    const double bulk = lame_first * (m - 1.0);
    const double first = bulk + 2.0 * shear_modulus * m;
    const double third = bulk - 2.0 * shear_modulus;
    const double on_plane = f / (k * first - third);
    Principal stress = {{trial.value[0] - on_plane * first, trial.value[1] - on_plane * bulk,
                         trial.value[2] - on_plane * third}};
    if (stress.value[0] >= stress.value[1] && stress.value[1] >= stress.value[2]) return stress;

    // Edge: the order is lost, so the neighbouring plane is active too. By symmetry its two planes may be replaced by one with
    // the two stresses that meet in the edge at their mean, and b likewise.
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

    // beyond the tip of the edge; k > 1, as Tresca's edges have no end
    const double apex = uniaxial_strength / (k - 1.0);
    return {{apex, apex, apex}};
  }
};

/// Elastic, perfectly plastic: Hughes-Winget's elastic trial as in LinearElastic, and the return above in its principal axes. In the
/// plane that is plane strain, and the stress out of the plane is the third principal one. Flow at the apex and on the edges is
/// included; there is no tension cut-off below the apex.
template <int D> class MohrCoulomb : public FrictionalLaw<D> {
  using Tensor = rve::Tensor<double, D>;

 public:
  using FrictionalLaw<D>::OutOfPlaneStress, FrictionalLaw<D>::PlasticStrain;

  /// young_modulus > 0, cohesion >= 0 [stress]; 0 <= poisson_ratio < 0.5; 0 <= dilation <= friction < 90 [degrees];
  /// cohesion and friction not both 0. rve::InputError otherwise.
  MohrCoulomb(double young_modulus, double poisson_ratio, double cohesion, double friction_degrees,
              double dilation_degrees);

  void update(int count, const int *point_index, const Tensor *deformation_increment, double dt,
              Tensor *stress, MemoryRows memory) override;

  /// The yield function k σ1 - σ3 - s of a point's stress [stress]; positive outside.
  double yield(const Tensor &stress, const double *memory) const;

 private:
  MohrCoulombReturn return_;
};

}    // namespace mpm
