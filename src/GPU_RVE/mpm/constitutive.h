// What the MPM solver knows of a material: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement this; the solver knows neither.

#ifndef MPM_CONSTITUTIVE_H
#define MPM_CONSTITUTIVE_H

#include "rve/core/tensor.h"

namespace mpm {

/// What a point remembers besides its stress in the plane; a law that needs none of it leaves it alone.
struct PointMemory {
  double out_of_plane_stress;    ///< σ_zz, tension positive [stress]
  double plastic_strain;         ///< accumulated, sqrt(2/3 dε^p:dε^p) of the deviator

  /// At the beginning. σ_zz between the principal stresses in the plane: admissible to an isotropic law if they are.
  static PointMemory at_stress(const rve::Tensor2 &stress)
  {
    return {0.5 * (stress(0, 0) + stress(1, 1)), 0.0};
  }
};

class Constitutive {
 public:
  virtual ~Constitutive() = default;

  /// Advances `count` points over `dt` [time].
  ///
  /// point_index[count]: local indices of the points, ascending. The three arrays below are those of all local points and
  /// are read and written at these indices only.
  /// deformation_increment: ΔF = I + L dt of the increment, stretch and spin, F_new = ΔF F_old.
  /// stress: Cauchy stress [stress], tension positive, in the plane; memory: the rest of a point's state. Both in: before
  /// the increment, out: after it.
  virtual void update(int count, const int *point_index, const rve::Tensor2 *deformation_increment,
                      double dt, rve::Tensor2 *stress, PointMemory *memory) = 0;

  /// Whether update() may be called for parts of the points at the same time, from several threads.
  virtual bool takes_parts() const { return false; }

  /// p_wave_modulus() will be asked for many points, from several threads.
  virtual void expect_questions() {}

  /// Modulus of plane compression waves, ρ c² [stress], an upper estimate for the current state: the CFL check uses it.
  virtual double p_wave_modulus(int point_index) const = 0;
};

}    // namespace mpm

#endif
