// What the MPM solver knows of a material: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement this; the solver knows neither.

#ifndef MPM_CONSTITUTIVE_H
#define MPM_CONSTITUTIVE_H

#include "rve/core/tensor.h"

#include <cstddef>
#include <string>
#include <vector>

namespace mpm {

/// A number that a law remembers of a point, besides the stress in the plane.
struct StateVariable {
  std::string name;    ///< a word without blanks: restart files and output know the variable by it
  std::string unit;    ///< "stress", ..., or "" for a plain number
};

using StateVariables = std::vector<StateVariable>;

/// What the laws of the points remember: a row of doubles for each point, which begins with the state variables of its law. Laws run
/// on the host, and so the rows are there only.
struct MemoryRows {
  double *first = nullptr;
  int width = 0;    ///< of a row: as many doubles as the law with the most state variables has
  double *operator[](int p) const { return first + static_cast<std::ptrdiff_t>(p) * width; }
};

/// A law of points in D dimensions.
template <int D> class Constitutive {
 public:
  virtual ~Constitutive() = default;

  /// The state variables, in the order of a row. They do not depend on the parameters of the law.
  virtual StateVariables state_variables() const { return {}; }

  /// Gives the state variables of a point their values at the beginning, when it has the Cauchy stress `stress` [stress].
  virtual void begin_memory(const rve::Tensor<double, D> & /*stress*/, double * /*memory*/) const {}

  /// What is probably not meant about points that begin with this Cauchy stress [stress], as the end of a sentence that names it; "" for
  /// nothing.
  virtual std::string doubt_about(const rve::Tensor<double, D> & /*stress*/) const { return ""; }

  /// Advances `count` points over `dt` [time].
  ///
  /// point_index[count]: local indices of the points, ascending. The three arrays below are those of all local points and
  /// are read and written at these indices only.
  /// deformation_increment: ΔF = I + L dt of the increment, stretch and spin, F_new = ΔF F_old.
  /// stress: Cauchy stress [stress], tension positive, in the plane; memory: the state variables. Both in: before
  /// the increment, out: after it.
  virtual void update(int count, const int *point_index,
                      const rve::Tensor<double, D> *deformation_increment, double dt,
                      rve::Tensor<double, D> *stress, MemoryRows memory) = 0;

  /// Whether update() may be called for parts of the points at the same time, from several threads.
  virtual bool takes_parts() const { return false; }

  /// p_wave_modulus() will be asked for many points, from several threads.
  virtual void expect_questions() {}

  /// Modulus of plane compression waves, ρ c² [stress], an upper estimate for the current state: the CFL check uses it.
  virtual double p_wave_modulus(int point_index) const = 0;

  /// Modulus of shear waves, ρ c² [stress], where the law knows it without a measurement; else 0.
  virtual double shear_modulus(int /*point_index*/) const { return 0.0; }
};

}    // namespace mpm

#endif
