// What the MPM solver knows of a material: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement this; the solver knows neither.

#ifndef MPM_CONSTITUTIVE_H
#define MPM_CONSTITUTIVE_H

#include "rve/core/tensor.h"

namespace mpm {

class Constitutive {
 public:
  virtual ~Constitutive() = default;

  /// Advances `count` points over `dt` [time].
  ///
  /// point_index[count]: local indices of the points, ascending. The two arrays below are those of all local points and
  /// are read and written at these indices only.
  /// deformation_increment: ΔF = I + L dt of the increment, stretch and spin, F_new = ΔF F_old.
  /// stress: Cauchy stress [stress], tension positive, in the plane; in: before the increment, out: after it.
  virtual void update(int count, const int *point_index, const rve::Tensor2 *deformation_increment,
                      double dt, rve::Tensor2 *stress) = 0;

  /// Modulus of plane compression waves, ρ c² [stress], an upper estimate for the current state: the CFL check uses it.
  virtual double p_wave_modulus(int point_index) const = 0;
};

}    // namespace mpm

#endif
