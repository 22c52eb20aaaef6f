// How many DEM steps a macro step is worth.

#ifndef RVE_ENGINE_SUBSTEPS_H
#define RVE_ENGINE_SUBSTEPS_H

#include "rve/engine/engine.h"

namespace rve {

/// Mean size of the grains: 2 sqrt(<r^2>) in the plane, 2 cbrt(<r^3>) in space [length].
template <int D> double grain_size(const ResultOf<D> &result);

/// Inertial number I = rate d sqrt(rho/p) of an RVE [-], with rho = density mass_depth/thickness, since stress of disks
/// counts the thickness and mass the mass_depth; that is rate sqrt(m/(p h)) up to sqrt(4/pi) (da Cruz et al. 2005). Infinite without pressure,
/// zero at rest. `rate` is |D| [1/time].
template <int D>
double inertial_number(const ResultOf<D> &result, const Material &material, double rate);

/// rho of inertial numbers [mass/length^3]
double inertial_density(const Material &material);
/// Of this rho.
double inertial_number(double mean_stress, double grain_size, double density, double rate);

/// Substeps by the strain of the macro step: as few as keep the strain of a DEM step and the inertial number, in the time of the
/// RVE, below their bounds.
struct AdaptiveSubsteps {
  double strain_per_step = 0.0;    ///< > 0 [-]
  double inertial_number = 0.0;    ///< > 0 [-]
  int most = 0;                    ///< bound of the number, > 0

  /// For an increment of this strain_size() with DEM steps of dt, from the mean stress that the RVE answered last. An RVE without
  /// pressure has no inertial number: the strain per step decides. `density` is inertial_density().
  int of(double strain, double dt, double mean_stress, double grain_size, double density) const;
};

}    // namespace rve

#endif
