#include "rve/engine/substeps.h"

#include "rve/physics/grain_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rve {

template <int D> double grain_size(const ResultOf<D> &result)
{
  // r^D of a grain of the mean volume
  const double power = determinant(result.cell) / (1.0 + result.void_ratio) /
      (GrainShape<D>::volume * result.num_grains);
  return 2.0 * (D == 2 ? std::sqrt(power) : std::cbrt(power));
}

template <int D>
double inertial_number(const ResultOf<D> &result, const Material &material, double rate)
{
  return inertial_number(result.mean_stress(), grain_size(result), inertial_density(material),
                         rate);
}

double inertial_density(const Material &material)
{
  return material.density * material.mass_depth / material.thickness;
}

double inertial_number(double mean_stress, double grain_size, double density, double rate)
{
  if (rate == 0.0) return 0.0;
  if (!(mean_stress > 0.0)) return std::numeric_limits<double>::infinity();
  return rate * grain_size * std::sqrt(density / mean_stress);
}

int AdaptiveSubsteps::of(double strain, double dt, double mean_stress, double grain_size,
                         double density) const
{
  double wanted = strain / strain_per_step;
  // n dt is the time that the RVE has for the strain
  if (mean_stress > 0.0)
    wanted = std::max(wanted,
                      rve::inertial_number(mean_stress, grain_size, density, strain / dt) /
                          inertial_number);
  // a strain or a pressure that overflows asks for all of them
  if (!(wanted < most)) return most;
  return static_cast<int>(std::fmax(std::ceil(wanted), 1.0));
}

template double grain_size(const ResultOf<2> &);
template double grain_size(const ResultOf<3> &);
template double inertial_number(const ResultOf<2> &, const Material &, double);
template double inertial_number(const ResultOf<3> &, const Material &, double);

}    // namespace rve
