// SPDX-License-Identifier: GPL-2.0-only
// How many DEM steps a macro step is worth.

#pragma once

#include "rve/core/config.h"
#include "rve/engine/engine.h"
#include "rve/physics/grain_shape.h"

#include <cmath>
#include <limits>

namespace rve {

/// Mean size of the grains: 2 sqrt(<r^2>) in the plane, 2 cbrt(<r^3>) in space [length].
template <int D> double grain_size(const ResultOf<D> &result)
{
  // r^D of a grain of the mean volume
  const double power = determinant(result.cell) / (1.0 + result.void_ratio) /
      (GrainShape<D>::volume * result.num_grains);
  return 2.0 * (D == 2 ? std::sqrt(power) : std::cbrt(power));
}

/// rho of inertial numbers [mass/length^3]
inline double inertial_density(const Material &material)
{
  return material.density * material.mass_depth / material.thickness;
}
constexpr double WITHOUT_PRESSURE = std::numeric_limits<double>::infinity();

/// Of this rho.
RVE_HD inline double inertial_number(double mean_stress, double grain_size, double density,
                                     double rate)
{
  if (rate == 0.0) return 0.0;
  if (!(mean_stress > 0.0)) return WITHOUT_PRESSURE;
  return rate * grain_size * std::sqrt(density / mean_stress);
}

/// Inertial number I = rate d sqrt(rho/p) of an RVE [-], with rho = density mass_depth/thickness, since stress of disks
/// counts the thickness and mass the mass_depth; that is rate sqrt(m/(p h)) up to sqrt(4/pi) (da Cruz et al. 2005). Infinite without pressure,
/// zero at rest. `rate` is |D| [1/time].
template <int D>
double inertial_number(const ResultOf<D> &result, const Material &material, double rate)
{
  return inertial_number(result.mean_stress(), grain_size(result), inertial_density(material),
                         rate);
}

/// Substeps by the strain of the macro step: as few as keep the strain of a DEM step and the inertial number, in the time of the
/// RVE, below their bounds.
struct AdaptiveSubsteps {
  double strain_per_step = 0.0;    ///< > 0 [-]
  double inertial_number = 0.0;    ///< > 0 [-]
  int most = 0;                    ///< bound of the number, > 0

  /// For an increment of this strain_size() with DEM steps of dt, from the mean stress that the RVE answered last. An RVE without
  /// pressure has no inertial number: the strain per step decides. `density` is inertial_density().
  RVE_HD int of(double strain, double dt, double mean_stress, double grain_size,
                double density) const
  {
    double wanted = strain / strain_per_step;
    // n dt is the time that the RVE has for the strain
    if (mean_stress > 0.0) {
      const double by_inertia =
          rve::inertial_number(mean_stress, grain_size, density, strain / dt) / inertial_number;
      wanted = wanted < by_inertia ? by_inertia : wanted;
    }
    // a strain or a pressure that overflows asks for all of them
    if (!(wanted < most)) return most;
    return static_cast<int>(std::fmax(std::ceil(wanted), 1.0));
  }
};

}    // namespace rve
