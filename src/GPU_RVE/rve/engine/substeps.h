// SPDX-License-Identifier: GPL-2.0-only
// Number of DEM steps of a macro step.

#pragma once

#include "rve/core/config.h"
#include "rve/engine/engine.h"
#include "rve/physics/grain_shape.h"

#include <cmath>
#include <limits>

namespace rve {

/// Returns the mean size of the grains: 2 sqrt(<r^2>) in the plane, 2 cbrt(<r^3>) in space
/// [length].
template <int D> double grain_size(const ResultOf<D> &result)
{
  // `power` is r^D of a grain with the mean volume.
  const double power = determinant(result.cell) / (1.0 + result.void_ratio) /
      (GrainShape<D>::volume * result.num_grains);
  return 2.0 * (D == 2 ? std::sqrt(power) : std::cbrt(power));
}

/// Returns the density rho in the definition of the inertial number [mass/length^3].
inline double inertial_density(const Material &material)
{
  return material.density * material.mass_depth / material.thickness;
}
constexpr double WITHOUT_PRESSURE = std::numeric_limits<double>::infinity();

/// Returns the inertial number [-]. `density` is inertial_density().
RVE_HD inline double inertial_number(double mean_stress, double grain_size, double density,
                                     double rate)
{
  if (rate == 0.0) return 0.0;
  if (!(mean_stress > 0.0)) return WITHOUT_PRESSURE;
  return rate * grain_size * std::sqrt(density / mean_stress);
}

/// Returns the inertial number I = rate d sqrt(rho/p) of an RVE [-], infinite without pressure and
/// zero at rest. `rate` is |D| [1/time], d the grain_size() [length], p the mean stress [stress].
/// The density is rho = density mass_depth/thickness, since the stress of disks includes the
/// thickness h, and their mass m includes the mass_depth. For disks I equals rate sqrt(m/(p h)) (da
/// Cruz et al. 2005) except for a factor of sqrt(4/pi).
template <int D>
double inertial_number(const ResultOf<D> &result, const Material &material, double rate)
{
  return inertial_number(result.mean_stress(), grain_size(result), inertial_density(material),
                         rate);
}

/// Adaptive number of substeps: the smallest number for which neither the strain of a DEM step nor
/// the inertial number exceeds its bound. The inertial number refers to the time of the RVE.
struct AdaptiveSubsteps {
  double strain_per_step = 0.0;    ///< > 0 [-]
  double inertial_number = 0.0;    ///< > 0 [-]
  int most = 0;                    ///< upper bound of the number, > 0

  /// Returns the number of DEM steps of length dt for an increment. `strain` is its strain_size(),
  /// `mean_stress` the mean stress of the last result, `density` the inertial_density(). Without
  /// pressure only the strain per step counts.
  RVE_HD int of(double strain, double dt, double mean_stress, double grain_size,
                double density) const
  {
    double wanted = strain / strain_per_step;
    // With n steps the strain takes the time n dt, so the inertial number is 1/n of that for one
    // step.
    if (mean_stress > 0.0) {
      const double by_inertia =
          rve::inertial_number(mean_stress, grain_size, density, strain / dt) / inertial_number;
      wanted = wanted < by_inertia ? by_inertia : wanted;
    }
    // If the quotient overflows or is not a number, the result is the largest number of steps.
    if (!(wanted < most)) return most;
    return static_cast<int>(std::fmax(std::ceil(wanted), 1.0));
  }
};

}    // namespace rve
