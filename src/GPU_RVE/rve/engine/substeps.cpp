#include "rve/engine/substeps.h"

#include "rve/core/pi.h"
#include "rve/engine/finite_strain.h"

#include <algorithm>
#include <limits>

namespace rve {

double grain_size(const Result &result)
{
  return 2.0 *
      std::sqrt(determinant(result.cell) / (1.0 + result.void_ratio) / (kPi * result.num_grains));
}

double inertial_number(const Result &result, const Material &material, double rate)
{
  return inertial_number(result.mean_stress(), grain_size(result), material, rate);
}

double inertial_number(double mean_stress, double grain_size, const Material &material, double rate)
{
  if (rate == 0.0) return 0.0;
  if (!(mean_stress > 0.0)) return std::numeric_limits<double>::infinity();
  const double density = material.density * material.mass_depth / material.thickness;
  return rate * grain_size * std::sqrt(density / mean_stress);
}

int AdaptiveSubsteps::of(double strain, double dt, double mean_stress, double grain_size,
                         const Material &material) const
{
  double wanted = strain / strain_per_step;
  // n dt is the time that the RVE has for the strain
  if (mean_stress > 0.0)
    wanted = std::max(wanted,
                      rve::inertial_number(mean_stress, grain_size, material, strain / dt) /
                          inertial_number);
  // a strain or a pressure that overflows asks for all of them
  if (!(wanted < most)) return most;
  return static_cast<int>(std::fmax(std::ceil(wanted), 1.0));
}

}    // namespace rve
