// SPDX-License-Identifier: GPL-2.0-only
// What the MPM solver knows of a material: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement this; the solver knows neither.

#pragma once

#include "rve/core/tensor.h"

#include <cstddef>
#include <cstdint>
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

/// Of all local points, in the memory of a CUDA device.
template <int D> struct DeviceArrays {
  int device = -1;    ///< as CUDA counts; -1: there are none
  const rve::Tensor<double, D> *deformation_increment = nullptr;
  rve::Tensor<double, D> *stress = nullptr;
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

  /// The same, of which the rest may be done by settle(): a device works meanwhile, and the arrays stay where they are. Returns whether anything
  /// is left to be done.
  virtual bool begin_update(int count, const int *point_index,
                            const rve::Tensor<double, D> *deformation_increment, double dt,
                            rve::Tensor<double, D> *stress, MemoryRows memory)
  {
    update(count, point_index, deformation_increment, dt, stress, memory);
    return false;
  }
  /// Ends what begin_update() has left.
  virtual void settle() {}
  /// An update of these points comes later in this step: what does not depend on the increments can be found out now, while a device has something
  /// to do.
  virtual void expect_update(int /*count*/, const int * /*point_index*/) {}
  /// The same where the arrays are in the memory of a device, while none of the points of that device has another law. plan_update_there() has the
  /// device plan it, if that can be; when that has been done, can_update_there() says whether it can go so, and begin_update_there()
  /// begins it. `stress` is the array of the host, for stresses that come another way: settle() ends the update, and if then not
  /// stresses_are_there(), on the device, bring_stresses() makes them those of the host.
  virtual bool plan_update_there(int /*count*/, const int * /*point_index*/,
                                 const DeviceArrays<D> & /*arrays*/, double /*dt*/,
                                 rve::Tensor<double, D> * /*stress*/)
  {
    return false;
  }
  virtual bool can_update_there() { return false; }
  virtual void begin_update_there() {}
  /// In between, where no other law has points: may have the device begin what it has planned. If then not can_update_there(), no point has moved.
  virtual void begin_update_ahead() {}
  virtual bool stresses_are_there() const { return false; }
  /// In the memory of the device, while an update goes on there: above zero when it has ended and its stresses are not all there, which settle() sees to.
  virtual const std::int32_t *unfinished_there() const { return nullptr; }
  /// Whether it had to.
  virtual bool were_unfinished() const { return false; }
  virtual void bring_stresses() {}
  /// All ranks are in the same place, in a step behind the last update, and have settled: what they have to tell each other can be told.
  virtual void meet() {}

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
