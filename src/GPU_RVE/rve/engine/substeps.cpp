// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/substeps.h"

#include "rve/physics/grain_shape.h"

#include <cmath>

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

template double grain_size(const ResultOf<2> &);
template double grain_size(const ResultOf<3> &);
template double inertial_number(const ResultOf<2> &, const Material &, double);
template double inertial_number(const ResultOf<3> &, const Material &, double);

}    // namespace rve
