// SPDX-License-Identifier: GPL-2.0-only
// The RVE engine: a batch of periodic DEM packings, each advanced by its own prescribed motion, on
// CPU threads or on a GPU. Styles and the MPM adapter include this header. It uses neither LAMMPS
// nor CUDA.
//
// States, prescribed motions, results and engines are templates on the dimension D of the RVEs. A
// name without the suffix `Of` is the type for disks: Engine is EngineOf<2>.

#pragma once

#include "rve/core/request.h"
#include "rve/core/status.h"
#include "rve/engine/affine_stiffness.h"
#include "rve/engine/options.h"
#include "rve/engine/state.h"
#include "rve/engine/stiffening.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace rve {

/// Returns the words for a status, such as "overlap too large, no contacts"; "ok" for zero.
std::string describe_status(std::uint32_t status);

/// Returns a remedy to append to the message about a status, such as "; use ..."; empty if there is
/// none.
std::string remedy_of_status(std::uint32_t status);

/// Direction in which the stress servo changes the velocity gradient L. ServoModesOf
/// (engine/servo_modes.h) computes such modes.
template <int D> struct ServoModeOf {
  /// Change of L at amplitude 1; its largest component is 1 in size [-].
  Tensor<double, D> rate;
  Tensor<double, D> dual;    ///< weights of L: the sum dual_ij L_ij is the amplitude [-]
  /// Weights of the stress components in the controlled sum stress_ij sigma_ij [-]. The goal of the
  /// sum is stress_ij stress_goal_ij.
  Tensor<double, D> stress;
  double weight;    ///< factor of the gain [-]
};

/// Prescribed motion or boundary condition of one RVE in one call of `substeps` DEM steps of `dt`.
template <int D> struct DriveOf {
  using Matrix = Tensor<double, D>;

  double dt = 0.0;    ///< DEM time step [time], > 0
  /// Number of DEM steps, >= 0. With 0 the call evaluates forces and results of the present
  /// configuration and changes nothing.
  std::int32_t substeps = 0;
  /// Placeholder for padding, since the struct is part of records that are copied as bytes.
  std::int32_t unused = 0;

  /// Deformation increment of the call: the cell matrix H becomes deformation * H, exactly. The
  /// increment is ignored if the servo controls a stress.
  Matrix deformation = Matrix::identity();

  /// Components of the stress that the servo controls. If there are any, `velocity_gradient`
  /// prescribes the other components, and `deformation` is ignored.
  bool controlled[D][D] = {};    ///< false below the diagonal, since the servo shears along x
  unsigned char unused_bytes[7 - (D * D - 1) % 8] = {};
  Matrix stress_goal = Matrix::zero();          ///< Cauchy, tension positive [stress]
  Matrix velocity_gradient = Matrix::zero();    ///< [1/time]
  /// Servo gain: L changes by gain * dt * (goal - stress) per step [1/(stress time^2)].
  double servo_gain = 0.0;
  double servo_max_rate = 0.5;    ///< bound of a controlled component of L [1/time]

  /// Servo modes, which are used instead of `controlled`. The servo adds their rates to
  /// `velocity_gradient`. The modes must exist until the call has ended.
  const ServoModeOf<D> *modes = nullptr;
  std::int32_t num_modes = 0;
  /// Nonzero if amplitudes start from zero and not from their values in the previous call.
  std::int32_t modes_begin = 0;

  bool has_servo() const
  {
    bool has = num_modes > 0;
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) has = has || controlled[a][b];
    return has;
  }

  /// Returns the prescribed motion for a constant velocity gradient L during the time t = substeps
  /// * dt: deformation = exp(L t). Throws InputError if the RVE rotates by more than 3 rad, since
  /// the increment is the same for rotations by pi and -pi.
  static DriveOf constant_velocity_gradient(const Matrix &velocity_gradient, double dt,
                                            int substeps);
};
using Drive = DriveOf<2>;

/// Returns p = -tr(stress)/D, compression positive [stress].
template <int D> double mean_stress(const Tensor<double, D> &stress)
{
  return -(1.0 / D) * trace(stress);
}

/// Homogenised result of one RVE after a call. Stress and fabric are full tensors.
template <int D> struct ResultOf {
  using Matrix = Tensor<double, D>;

  std::uint32_t status = status::Ok;
  std::int32_t unused = 0;
  Matrix stress = Matrix::zero();             ///< Love's Cauchy stress, tension positive [stress]
  Matrix cell = Matrix::identity();           ///< H [length]
  Matrix deformation = Matrix::identity();    ///< F since the packing was made [-]
  Matrix fabric = Matrix::zero();             ///< mean of n (x) n over contacts [-], trace 1
  double void_ratio = 0.0;             ///< cell volume / solid volume - 1, areas in the plane [-]
  double coordination_number = 0.0;    ///< 2 N_c / N [-]
  /// Coordination number without rattlers (grains with fewer than two contacts) [-].
  double mechanical_coordination_number = 0.0;
  double sliding_fraction = 0.0;         ///< share of contacts at the Coulomb limit [-]
  double unbalanced_ratio = 0.0;         ///< mean |grain force| / mean |contact force| [-]
  double kinetic_energy = 0.0;           ///< of peculiar velocities and spins [force length]
  double elastic_energy = 0.0;           ///< stored in contact springs [force length]
  double largest_overlap = 0.0;          ///< overlap / sum of radii [-]
  double mean_overlap = 0.0;             ///< mean over contacts of overlap / sum of radii [-]
  double largest_contact_force = 0.0;    ///< [force]
  double peak_force = 0.0;               ///< largest contact force of the call [force]
  Matrix servo_velocity_gradient = Matrix::zero();    ///< L at the end of the call [1/time]
  std::int32_t num_grains = 0;
  std::int32_t num_contacts = 0;
  std::int32_t num_pairs = 0;
  std::int32_t num_rattlers = 0;
  Counters counters;
  EnergyTotals energy;

  /// Returns p [stress].
  double mean_stress() const { return rve::mean_stress(stress); }
  /// Returns the deviatoric stress q [stress] from the deviator s' of the stress: sqrt(s'_ij s'_ij
  /// / 2) in the plane and sqrt(3/2 s'_ij s'_ij) in space (equation (25b) of the paper with n = 2
  /// and n = 3).
  double deviatoric_stress() const;
};
using Result = ResultOf<2>;

/// Result and affine stiffness of one configuration. While the RVE is quiescent, its stress follows
/// from both.
template <int D> struct ElasticResultOf {
  ResultOf<D> result;
  AffineStiffnessOf<D> stiffness;
};
using ElasticResult = ElasticResultOf<2>;

/// Short result for a macro step. It costs less than a Result and has the same stress.
template <int D> struct ResponseOf {
  std::uint32_t status = status::Ok;
  std::int32_t num_contacts = 0;
  double peak_force = 0.0;    ///< largest contact force of the call [force]
  /// Love's Cauchy stress, tension positive [stress].
  Tensor<double, D> stress = Tensor<double, D>::zero();
};
using Response = ResponseOf<2>;

template <int D> StiffnessMeasures stiffness_measures(const ResponseOf<D> &response)
{
  return {response.num_contacts, response.peak_force, mean_stress(response.stress)};
}

/// Prescribed motion that consists of a deformation increment only. Members of the same names are
/// explained in DriveOf.
template <int D> struct IncrementOf {
  double dt = 0.0;
  std::int32_t substeps = 0;
  std::int32_t is_evaluated =
      0;    ///< nonzero: diagnostic evaluation after the steps (IncrementCallOf::take_evaluation)
  Tensor<double, D> deformation = Tensor<double, D>::identity();

  DriveOf<D> drive() const
  {
    DriveOf<D> drive;
    drive.dt = dt;
    drive.substeps = substeps;
    drive.deformation = deformation;
    return drive;
  }
};

/// Interface by which an engine requests the increments of a call and delivers the results, for
/// macro steps of thousands of RVEs. The engine passes some RVEs at a time, so that their data stay
/// in caches. Several threads of the engine call the functions at once, for different RVEs.
template <int D> class IncrementCallOf {
 public:
  virtual ~IncrementCallOf() = default;
  /// Writes the increments of the RVEs with the indices `begin` to `end` - 1 in the call; the first
  /// one goes to increments[0]. Returns false if one of these RVEs needs a DriveOf. The engine then
  /// launches nothing.
  virtual bool give(int begin, int end, IncrementOf<D> *increments) = 0;
  /// Called after all give() have returned true, before the DEM steps. This is the last opportunity
  /// to turn RVEs before the steps.
  virtual void begin() = 0;
  virtual void take(int begin, int end, const IncrementOf<D> *increments,
                    const ResponseOf<D> *responses) = 0;
  /// Receives the last diagnostic evaluation of an RVE, after its result. It describes the end of
  /// the DEM steps of this call or, if the RVE is quiescent, the end of its last DEM steps. The
  /// function is not called for an RVE whose call failed.
  virtual void take_evaluation(int /*index*/, const EvaluationOf<D> & /*evaluation*/) {}
  /// Receives the deferred increment of a quiescent RVE, after take_evaluation(). Only calls on a
  /// device (rve/engine/device_calls.h) deliver deferred increments.
  virtual void take_deferred(int /*index*/, const Tensor<double, D> & /*pending*/) {}
};

template <int D> class DeviceCallsOf;    // rve/engine/device_calls.h

/// Memory in which an engine stores its RVEs.
struct Memory {
  std::string name;         ///< engines on one machine with the same name share the memory
  std::size_t free = 0;     ///< free for RVEs at present [bytes]
  bool is_known = false;    ///< false: `free` is undefined
  bool is_host = true;      ///< true if the caller keeps its data in the same memory
};

/// An engine owns RVEs. An RVE is identified by the number that add() returned until it is removed.
/// Results do not depend on threads or on the order of the RVEs in a call; in strict arithmetic
/// they do not depend on the backend either.
template <int D> class EngineOf {
 public:
  virtual ~EngineOf() = default;

  /// Returns the contact model of the RVEs (Options::contacts).
  virtual const ContactModel &contacts() const = 0;
  /// Returns a new engine without RVEs. It has the options and the device of this engine, but
  /// another contact model. Throws InputError if no kernel variant supports it.
  virtual std::unique_ptr<EngineOf> empty_with(const ContactModel &contacts) const = 0;

  /// Adds a copy of the state and returns the number of the RVE. Throws InputError if the state is
  /// not sound, or if the engine does not support the contact model that it needs.
  virtual int add(const RveStateOf<D> &state) = 0;
  /// Removes an RVE. Its number is free, and the next add() uses it.
  virtual void remove(int rve) = 0;
  virtual int size() const = 0;

  /// Returns the present state, without rounding. If the state is added to an engine with the same
  /// options, the copy gives the same bits as the RVE.
  virtual RveStateOf<D> state(int rve) const = 0;

  /// Changes only the material, for example its friction after the preparation. Throws InputError
  /// as add() does.
  virtual void set_material(int rve, const Material &material) = 0;

  /// Turns RVEs rigidly. The cell, the deformation and the velocities rotate; for spheres also the
  /// spins and the contact forces. Fractional coordinates and scalars do not change. Throws
  /// InputError unless the tensors are rotations.
  virtual void turn(const std::vector<int> &rves,
                    const std::vector<Tensor<double, D>> &rotations) = 0;

  /// Advances rves[k] by drives[k] and returns its result in results[k]. No RVE may occur twice.
  /// Each RVE can have its own number of substeps.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResultOf<D>> &results) = 0;
  /// Advances RVEs like the function above and also returns the affine stiffness. The stiffness
  /// costs as much as the rest of the result. The bits of the stiffness depend on the state only,
  /// not on the call.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ElasticResultOf<D>> &results) = 0;
  /// Advances RVEs like the functions above but returns short results. Another call with 0 substeps
  /// returns the full Result of the same configuration.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResponseOf<D>> &responses) = 0;

  /// Launches an advance by the increments of `call`. Request::fetch() delivers the short results
  /// to `call`. Returns null if one of the RVEs needs a DriveOf; nothing has changed then. `rves`
  /// and `call` must exist until fetch(). No other function of the engine may be called before
  /// fetch().
  virtual Request *begin(const std::vector<int> &rves, IncrementCallOf<D> &call) = 0;

  /// Finds lower bounds of the stable time steps of RVEs in their present states
  /// (rve::stable_time_step), on the device of the engine [time]. A bound below `enough` [time] is
  /// accurate to a few percent. A larger bound can be farther below the stable time step. The bound
  /// is 0 if none was found. A bound depends only on the state and on `enough`. The cost is about
  /// ten DEM steps.
  virtual void bound_time_steps(const std::vector<int> &rves, double enough,
                                std::vector<double> &bounds) = 0;

  /// Returns a line for the log: "NVIDIA H200, mixed, strict" or "2 CPU threads (x86-64-v3), mixed,
  /// strict".
  virtual std::string description() const = 0;

  /// Returns the memory that one RVE of this many grains needs [bytes].
  virtual std::size_t bytes_per_rve(int num_grains) const = 0;

  /// Returns the memory that a call needs in addition to the RVEs [bytes]. The call has `num_rves`
  /// RVEs of at most `num_grains` grains, and lists have their initial capacity. The result is 0
  /// without RVEs.
  virtual std::size_t bytes_of_call(int num_rves, int num_grains) = 0;

  /// Returns the memory that contains the RVEs. If the environment variable GPU_RVE_MEMORY_LIMIT is
  /// set, `free` is at most its value [bytes]. Throws InputError if the value is not a number from
  /// 0 to 2^53.
  virtual Memory memory() const = 0;

  /// Returns the interface for calls with increments and stresses on the device of the engine; null
  /// if there is none.
  virtual DeviceCallsOf<D> *device_calls() { return nullptr; }

  /// Returns the number of the engine's device in CUDA; -1 for CPU threads.
  virtual int cuda_device() const { return -1; }
};
using Engine = EngineOf<2>;

/// Returns the engine that the options request. Device::Auto uses a GPU if one is usable, otherwise
/// the CPU; format `single` always uses the CPU. If no GPU is usable, `notice` receives the reason.
/// `notice` stays empty in a build without CUDA, unless relaxed arithmetic was requested. Throws
/// InputError if options are invalid, or if Device::Cuda finds no usable device. It also throws if
/// Device::Auto would use the CPU although the environment requires a CUDA device
/// (cuda/cuda_required.h).
template <int D = 2>
std::unique_ptr<EngineOf<D>> make_engine(const Options &options, std::string *notice = nullptr);

}    // namespace rve
