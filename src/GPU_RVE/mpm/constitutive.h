// SPDX-License-Identifier: GPL-2.0-only
// What the MPM solver knows of a material: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement this; the solver knows neither.

#pragma once

#include "rve/core/request.h"
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

  /// Begins the same update. Null: the stresses are there. Otherwise finish() waits for them, and the
  /// arrays stay where they are until then.
  virtual rve::Request *begin(int count, const int *point_index,
                              const rve::Tensor<double, D> *deformation_increment, double dt,
                              rve::Tensor<double, D> *stress, MemoryRows memory)
  {
    update(count, point_index, deformation_increment, dt, stress, memory);
    return nullptr;
  }
  /// Plans the same update with increments and stresses in the memory of a device, if no point on
  /// that device has a law of another kind. Null: the law needs the host, that is begin(). The request
  /// has still to be launched. `stress`: array of the host for the stresses that finish() leaves there.
  virtual rve::Request *plan(int /*count*/, const int * /*point_index*/,
                             const DeviceArrays<D> & /*arrays*/, double /*dt*/,
                             rve::Tensor<double, D> * /*stress*/)
  {
    return nullptr;
  }
  /// Waits for the stresses of a request and returns where they are.
  virtual rve::StressesAre finish(rve::Request & /*request*/) { return rve::StressesAre::OnHost; }
  /// Copies stresses that finish() has left on the device to the array of the host.
  virtual void copy_stresses_to_host() {}
  /// Announces an update of these points later in this step: work that does not depend on the
  /// increments can be done now, while a device is busy.
  virtual void expect_update(int /*count*/, const int * /*point_index*/) {}
  /// Exchanges notes and checks between ranks. Collective, after the last update was finished.
  virtual void synchronise_ranks() {}

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
