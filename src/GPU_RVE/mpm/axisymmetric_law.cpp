// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/axisymmetric_law.h"

namespace mpm {

void AxisymmetricLaw::update(int count, const int *point_index,
                             const rve::Tensor2 *deformation_increment, double dt,
                             rve::Tensor2 *stress, MemoryRows memory)
{
  const int only = 0;
  for (int k = 0; k < count; ++k) {
    const int p = point_index[k];
    const rve::Tensor3 increment = in_space(deformation_increment[p], hoop_.increment[p]);
    rve::Tensor3 updated = in_space(stress[p], hoop_.stress[p]);
    law_->update(1, &only, &increment, dt, &updated, {memory[p], memory.width});
    stress[p] = rve::leading_components<2>(updated);
    hoop_.stress[p] = updated(2, 2);
  }
}

}    // namespace mpm
