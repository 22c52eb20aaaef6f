// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/linear_elastic.h"

#include "rve/core/error.h"

namespace mpm {

using rve::require;
using rve::Tensor;

template <int D>
LinearElastic<D>::LinearElastic(double young_modulus, double poisson_ratio) :
    ElasticLaw<D>(young_modulus, poisson_ratio)
{
  require(young_modulus > 0.0, "Young's modulus must be positive, got ", young_modulus,
          " [stress]");
  require(poisson_ratio > -1.0 && poisson_ratio < 0.5, "Poisson's ratio must be in (-1, 0.5), got ",
          poisson_ratio);
}

template <int D>
void LinearElastic<D>::update(int count, const int *point_index,
                              const Tensor<double, D> *deformation_increment, double /*dt*/,
                              Tensor<double, D> *stress, MemoryRows /*memory*/)
{
  for (int k = 0; k < count; ++k) {
    const int p = point_index[k];
    const MidpointIncrement<D> increment = midpoint_increment(deformation_increment[p]);
    stress[p] = elastic_stress(stress[p], increment, lame_first_, shear_modulus_);
  }
}

template class LinearElastic<2>;
template class LinearElastic<3>;

}    // namespace mpm
