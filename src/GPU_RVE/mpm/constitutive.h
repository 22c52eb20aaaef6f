// SPDX-License-Identifier: GPL-2.0-only
// Interface of constitutive laws: deformation increments in, Cauchy stresses out.
//
// The RVE engine and the analytic laws implement it. The solver depends on neither.

#pragma once

#include "rve/core/request.h"
#include "rve/core/tensor.h"

#include <cstddef>
#include <string>
#include <vector>

namespace mpm {

/// A number that a law stores for each point in addition to the stress.
struct StateVariable {
  std::string name;    ///< name without blanks in restart files and output
  std::string unit;    ///< "stress", ..., or "" for a dimensionless number
};

using StateVariables = std::vector<StateVariable>;

/// State variables of points. Each point has a row of doubles that begins with the state variables
/// of its law. The rows exist on the host only, since laws with state variables run there.
struct MemoryRows {
  double *first = nullptr;
  int width = 0;    ///< doubles of a row: the largest number of state variables of all laws
  double *operator[](int p) const { return first + static_cast<std::ptrdiff_t>(p) * width; }
};

/// Hoop components of all local points in axisymmetry; null otherwise.
struct HoopArrays {
  const double *increment = nullptr;    ///< hoop component of ΔF [-]
  double *stress = nullptr;             ///< tension positive [stress]
};

/// Arrays of all local points in the memory of a CUDA device.
template <int D> struct DeviceArrays {
  int device = -1;    ///< CUDA device number; -1: there are no such arrays
  const rve::Tensor<double, D> *deformation_increment = nullptr;
  rve::Tensor<double, D> *stress = nullptr;
  HoopArrays hoop = {};
};

/// A constitutive law of points in D dimensions.
template <int D> class Constitutive {
 public:
  virtual ~Constitutive() = default;

  /// Returns the state variables in the order of a row. They do not depend on parameters of the
  /// law.
  virtual StateVariables state_variables() const { return {}; }

  /// Sets the initial state variables of a point with the initial Cauchy stress `stress` [stress].
  virtual void begin_memory(const rve::Tensor<double, D> & /*stress*/, double * /*memory*/) const {}

  /// Returns a warning about points with this initial Cauchy stress [stress], or "". The text is
  /// the end of a sentence whose subject is the stress.
  virtual std::string doubt_about(const rve::Tensor<double, D> & /*stress*/) const { return ""; }

  /// Advances `count` points over `dt` [time].
  ///
  /// point_index[count]: local indices of the points, ascending. The other arrays have all local
  /// points; only these indices are read and written.
  /// deformation_increment: ΔF = I + L dt with stretch and spin, F_new = ΔF F_old.
  /// stress: Cauchy stress [stress], tension positive; in 2D its in-plane components.
  /// memory: state variables.
  /// On entry, stress and memory are the state before the increment; on return, the state after.
  virtual void update(int count, const int *point_index,
                      const rve::Tensor<double, D> *deformation_increment, double dt,
                      rve::Tensor<double, D> *stress, MemoryRows memory) = 0;

  /// Begins the update that update() defines. Returns null if the update is complete. Otherwise
  /// finish() waits for the stresses, and the arrays must keep their addresses until then.
  virtual rve::Request *begin(int count, const int *point_index,
                              const rve::Tensor<double, D> *deformation_increment, double dt,
                              rve::Tensor<double, D> *stress, MemoryRows memory)
  {
    update(count, point_index, deformation_increment, dt, stress, memory);
    return nullptr;
  }
  /// Plans the update with increments and stresses in the memory of a device. Returns a request
  /// that has not been launched, or null if the law needs begin(). `stress` is the host array that
  /// receives the stresses if finish() returns OnHost. The request is launched only if the laws of
  /// all points return one.
  virtual rve::Request *plan(int /*count*/, const int * /*point_index*/,
                             const DeviceArrays<D> & /*arrays*/, double /*dt*/,
                             rve::Tensor<double, D> * /*stress*/)
  {
    return nullptr;
  }
  /// Waits for the stresses of a request and returns where they are.
  virtual rve::StressesAre finish(rve::Request & /*request*/) { return rve::StressesAre::OnHost; }
  /// Copies stresses that finish() has left on the device to the host array.
  virtual void copy_stresses_to_host() {}
  /// Announces an update of these points later in this step. Work that does not depend on the
  /// increments can be done now, while a device is busy.
  virtual void expect_update(int /*count*/, const int * /*point_index*/) {}
  /// Does the work of the law that needs all ranks, such as log notes and checks. Collective;
  /// called after the last update has finished.
  virtual void synchronise_ranks() {}

  /// True if the law updates hoop stresses after set_hoop().
  virtual bool takes_hoop() const { return false; }
  /// Sets the hoop components on the host for the next updates. Null pointers end axisymmetry. The
  /// arrays must keep their addresses until the updates have finished.
  virtual void set_hoop(const HoopArrays & /*hoop*/) {}

  /// True if several threads may call update() at the same time for different points.
  virtual bool takes_parts() const { return false; }

  /// Announces calls of p_wave_modulus() for many points, from several threads.
  virtual void expect_questions() {}

  /// Modulus of plane compression waves, ρ c² [stress]. It is an upper estimate for the current
  /// state, and the CFL check uses it.
  virtual double p_wave_modulus(int point_index) const = 0;

  /// Modulus of shear waves, ρ c² [stress], or 0 if the law has no closed form of it.
  virtual double shear_modulus(int /*point_index*/) const { return 0.0; }
};

}    // namespace mpm
