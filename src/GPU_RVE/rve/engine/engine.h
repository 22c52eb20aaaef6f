// SPDX-License-Identifier: GPL-2.0-only
// The RVE engine: a batch of periodic DEM packings, each advanced by its own prescribed motion, on
// CPU threads or on a GPU. Styles and the MPM adapter include this header. It uses neither LAMMPS
// nor CUDA.
//
// States, prescribed motions, results and engines are templates on the dimension D of the RVEs;
// their names without the suffix `Of` are those for disks, such as Engine for EngineOf<2>.

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

/// Returns the remedy for a status, to be appended to a message: "; use ..." or an empty text.
std::string remedy_of_status(std::uint32_t status);

/// Direction in which the stress servo changes the velocity gradient (made by
/// engine/servo_modes.h).
template <int D> struct ServoModeOf {
  /// Velocity gradient of amplitude one, whose largest component is 1 [-].
  Tensor<double, D> rate;
  Tensor<double, D> dual;    ///< dual : L is the amplitude [-]
  /// Weights of the controlled combination of stresses [-]: the goal of stress : sigma is stress :
  /// stress_goal.
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

  /// Deformation increment of the call: the cell matrix H becomes deformation * H, exactly. It is
  /// used if no stress is controlled.
  Matrix deformation = Matrix::identity();

  /// Components of the stress that the servo controls. If there are any, `velocity_gradient`
  /// prescribes the others and `deformation` is ignored.
  bool controlled[D][D] = {};    ///< none below the diagonal: the servo shears along x
  unsigned char unused_bytes[7 - (D * D - 1) % 8] = {};
  Matrix stress_goal = Matrix::zero();          ///< Cauchy, tension positive [stress]
  Matrix velocity_gradient = Matrix::zero();    ///< [1/time]
  /// Servo gain: L changes by gain * dt * (goal - stress) per step [1/(stress time^2)].
  double servo_gain = 0.0;
  double servo_max_rate = 0.5;    ///< bound of a controlled component of L [1/time]

  /// Servo modes, used instead of components. Their rates are added to `velocity_gradient`. They
  /// must live as long as the call.
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

  /// Returns the motion of a constant velocity gradient over substeps * dt: deformation = exp(L t).
  /// Throws InputError if that rotates the RVE by more than 3 rad, since a larger rotation is
  /// indistinguishable from a smaller one.
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
  double mean_overlap = 0.0;             ///< over contacts, overlap / sum of radii [-]
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

/// Result and affine stiffness of one configuration, for an RVE that may be skipped.
template <int D> struct ElasticResultOf {
  ResultOf<D> result;
  AffineStiffnessOf<D> stiffness;
};
using ElasticResult = ElasticResultOf<2>;

/// Short result for a macro step, which costs less than a Result. `stress` equals that of Result.
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

/// Prescribed motion by a deformation increment alone. Members as in DriveOf.
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

/// Interface by which an engine requests the increments of a call and delivers the results. It
/// passes some RVEs at a time, so that their data stay in caches. Macro steps of thousands of RVEs
/// use it. Several threads call it at once for different RVEs.
template <int D> class IncrementCallOf {
 public:
  virtual ~IncrementCallOf() = default;
  /// Writes increments[0] and following for the RVEs from `begin` to `end` - 1 of the call. Returns
  /// false if one of these RVEs needs a DriveOf; then the engine launches nothing.
  virtual bool give(int begin, int end, IncrementOf<D> *increments) = 0;
  /// Called when all increments are known and will be used. RVEs can be turned here for the last
  /// time before the steps.
  virtual void begin() = 0;
  virtual void take(int begin, int end, const IncrementOf<D> *increments,
                    const ResponseOf<D> *responses) = 0;
  /// Receives a diagnostic evaluation that the increment has requested, after a valid result.
  virtual void take_evaluation(int /*index*/, const EvaluationOf<D> & /*evaluation*/) {}
  /// Receives the deferred increment of an RVE that was quiescent and made no DEM steps
  /// (rve/engine/device_calls.h). Called after take_evaluation().
  virtual void take_deferred(int /*index*/, const Tensor<double, D> & /*pending*/) {}
};

template <int D> class DeviceCallsOf;    // rve/engine/device_calls.h

/// Memory in which an engine stores its RVEs.
struct Memory {
  std::string name;         ///< engines on one machine with the same name share the memory
  std::size_t free = 0;     ///< free for RVEs at present [bytes]
  bool is_known = false;    ///< false: `free` is undefined
  bool is_host = true;      ///< the data of the caller are in the same memory
};

/// An engine owns RVEs. An RVE is identified by the number that add() returned until it is removed.
/// Results do not depend on threads or on the order of the RVEs in a call; in strict arithmetic
/// they do not depend on the backend either.
template <int D> class EngineOf {
 public:
  virtual ~EngineOf() = default;

  /// Returns the contact model of the RVEs (Options::contacts).
  virtual const ContactModel &contacts() const = 0;
  /// Returns an engine without RVEs with the options of this one, on the same device, but with
  /// another contact model. Throws InputError if no kernel variant supports it.
  virtual std::unique_ptr<EngineOf> empty_with(const ContactModel &contacts) const = 0;

  /// Adds a copy of the state and returns the number of the RVE. Throws InputError if the state is
  /// not sound or needs another contact model than that of the engine.
  virtual int add(const RveStateOf<D> &state) = 0;
  /// Removes an RVE. Its number is free, and the next add() uses it.
  virtual void remove(int rve) = 0;
  virtual int size() const = 0;

  /// Returns the present state, without rounding. A copy of it in an engine with the same options
  /// continues bit for bit.
  virtual RveStateOf<D> state(int rve) const = 0;

  /// Changes only the material, for example its friction after the preparation. Throws InputError
  /// as add() does.
  virtual void set_material(int rve, const Material &material) = 0;

  /// Turns whole RVEs rigidly: cell, deformation and velocities rotate, all other data are
  /// unchanged in the turned axes. Throws InputError unless the tensors are rotations.
  virtual void turn(const std::vector<int> &rves,
                    const std::vector<Tensor<double, D>> &rotations) = 0;

  /// Advances rves[k] by drives[k] and returns its result in results[k]. RVEs are distinct; each
  /// may have its own number of substeps.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResultOf<D>> &results) = 0;
  /// Advances RVEs like the function above and also returns the affine stiffness. The stiffness
  /// costs as much as the rest of the result. Its bits depend on the state alone, not on the call.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ElasticResultOf<D>> &results) = 0;
  /// Advances RVEs like the functions above with short results. The full Result of the same
  /// configuration follows from another call with 0 substeps.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResponseOf<D>> &responses) = 0;

  /// Launches an advance by the increments of `call`. Request::fetch() delivers the short results
  /// to `call`. Returns null if one of the RVEs needs a DriveOf; then nothing has changed. `rves`
  /// and `call` must live until fetch(), and no other function of the engine may be called before
  /// fetch().
  virtual Request *begin(const std::vector<int> &rves, IncrementCallOf<D> &call) = 0;

  /// Finds lower bounds of the stable time steps of RVEs in their present states
  /// (rve::stable_time_step), on the device of the engine [time]. A bound below `enough` [time] is
  /// accurate to a few percent; a larger bound may be looser. The bound is 0 if none was found.
  /// Bounds depend on the state and on `enough` alone. The cost is about ten DEM steps.
  virtual void bound_time_steps(const std::vector<int> &rves, double enough,
                                std::vector<double> &bounds) = 0;

  /// Returns a line for the log: "NVIDIA H200, mixed, strict" or "2 CPU threads (x86-64-v3), mixed,
  /// strict".
  virtual std::string description() const = 0;

  /// Returns the memory that one RVE of this many grains needs [bytes].
  virtual std::size_t bytes_per_rve(int num_grains) const = 0;

  /// Returns the memory that a call of `num_rves` RVEs of at most `num_grains` grains needs in
  /// addition to the RVEs [bytes]; 0 without RVEs. Lists have their initial capacity.
  virtual std::size_t bytes_of_call(int num_rves, int num_grains) = 0;

  /// Returns the memory that contains the RVEs. Its free part is limited to the number of bytes in
  /// the environment variable GPU_RVE_MEMORY_LIMIT, if that is set. Throws InputError if the
  /// variable is not a number.
  virtual Memory memory() const = 0;

  /// Returns the interface for points on the device of the engine; null if there is none.
  virtual DeviceCallsOf<D> *device_calls() { return nullptr; }

  /// Returns the number of the engine's device in CUDA; -1 for CPU threads.
  virtual int cuda_device() const { return -1; }
};
using Engine = EngineOf<2>;

/// Returns the engine that the options request. Device::Auto uses a GPU if one is usable, otherwise
/// the CPU. `notice`, if given, receives the reason for such a fallback; it is empty if the build
/// has no CUDA and the arithmetic is as requested. Throws InputError if options are invalid, or if
/// Device::Cuda finds no usable device. It also throws on a fallback if the environment requires a
/// CUDA device (cuda/cuda_required.h).
template <int D = 2>
std::unique_ptr<EngineOf<D>> make_engine(const Options &options, std::string *notice = nullptr);

}    // namespace rve
