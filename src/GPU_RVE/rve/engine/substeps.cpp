#include "rve/engine/substeps.h"

#include "rve/engine/finite_strain.h"

#include <algorithm>
#include <limits>

namespace rve {

double grain_size(const Result &result)
{
  const double pi = std::acos(-1.0);
  return 2.0 *
      std::sqrt(determinant(result.cell) / (1.0 + result.void_ratio) / (pi * result.num_grains));
}

double inertial_number(const Result &result, const Material &material, double rate)
{
  if (rate == 0.0) return 0.0;
  if (!(result.mean_stress() > 0.0)) return std::numeric_limits<double>::infinity();
  const double density = material.density * material.mass_depth / material.thickness;
  return rate * grain_size(result) * std::sqrt(density / result.mean_stress());
}

int AdaptiveSubsteps::of(double strain, double dt, const Result &last,
                         const Material &material) const
{
  double wanted = strain / strain_per_step;
  // n dt is the time that the RVE has for the strain
  if (last.mean_stress() > 0.0)
    wanted = std::max(wanted, rve::inertial_number(last, material, strain / dt) / inertial_number);
  return static_cast<int>(std::clamp(std::ceil(wanted), 1.0, static_cast<double>(most)));
}

}    // namespace rve
