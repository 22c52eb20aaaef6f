// When an increment turns an RVE so that its grains could not follow, it is turned rigidly, and the drive keeps the stretch.

#ifndef MACRO_RIGID_TURNS_H
#define MACRO_RIGID_TURNS_H

#include "rve/engine/finite_strain.h"
#include "rve/engine/increment_plan.h"

#include <cmath>

namespace macro {

/// Whether an RVE that wakes with this deformation must be turned rigidly.
template <int D> bool is_turned(double mean_overlap, const rve::Tensor<double, D> &deformation)
{
  return !(std::fabs(rve::PolarDecomposition(deformation).angle) <=
           rve::TURN_OF_OVERLAP * mean_overlap);
}

/// Leaves the stretch of an increment, and returns the rotation that it had.
template <int D> rve::Tensor<double, D> take_rotation(rve::Tensor<double, D> &increment)
{
  const rve::Tensor<double, D> rotation = rve::PolarDecomposition(increment).rotation;
  increment = increment * rve::transpose(rotation);
  return rotation;
}

}    // namespace macro

#endif
