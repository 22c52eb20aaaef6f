// SPDX-License-Identifier: GPL-2.0-only
// The RVE engine: a batch of periodic DEM packings, each advanced by its own drive, on CPU threads or on a GPU.
// This is the header that styles and the MPM adapter see. No LAMMPS, no CUDA in it.
//
// States, drives, answers and engines are templates on the dimension D of the RVEs; their names without it are those of disks.

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

/// Words for a status, e.g. "overlap too large, no contacts"; "ok" for zero.
std::string describe_status(std::uint32_t status);

/// What a user can do about a status, behind a message: "; use ..." or nothing.
std::string remedy_of_status(std::uint32_t status);

/// A direction in which the stress servo changes the velocity gradient (engine/servo_modes.h makes them).
template <int D> struct ServoModeOf {
  Tensor<double, D> rate;    ///< velocity gradient of amplitude one, its largest component is 1 [-]
  Tensor<double, D> dual;    ///< dual : L is the amplitude [-]
  Tensor<double, D> stress;    ///< stress : sigma is what has a goal, stress : stress_goal [-]
  double weight;               ///< of the gain [-]
};

/// What one RVE shall do in one call: `substeps` DEM steps of `dt`.
template <int D> struct DriveOf {
  using Matrix = Tensor<double, D>;

  double dt = 0.0;    ///< DEM time step [time], > 0
  /// >= 0; 0 evaluates forces and results of the present configuration and changes nothing.
  std::int32_t substeps = 0;
  std::int32_t unused = 0;    ///< drives and results are part of records that are copied as bytes

  /// Deformation increment of the call: H goes from H to deformation * H, exactly. Used when no stress is controlled.
  Matrix deformation = Matrix::identity();

  /// Stress servo. With any component controlled, `velocity_gradient` drives the others and `deformation` is ignored.
  bool controlled[D][D] = {};    ///< none below the diagonal: the servo shears along x
  unsigned char unused_bytes[7 - (D * D - 1) % 8] = {};
  Matrix stress_goal = Matrix::zero();          ///< Cauchy, tension positive [stress]
  Matrix velocity_gradient = Matrix::zero();    ///< [1/time]
  /// L changes by gain * dt * (goal - stress) per step [1/(stress time^2)].
  double servo_gain = 0.0;
  double servo_max_rate = 0.5;    ///< bound of a controlled component of L [1/time]

  /// Modes to steer in place of components; `velocity_gradient` is what they are added to. They live as long as the call.
  const ServoModeOf<D> *modes = nullptr;
  std::int32_t num_modes = 0;
  std::int32_t modes_begin = 0;    ///< with amplitudes zero, not with those of the call before

  bool has_servo() const
  {
    bool has = num_modes > 0;
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) has = has || controlled[a][b];
    return has;
  }

  /// Drives by a constant velocity gradient over substeps * dt: deformation = exp(L t).
  /// Throws InputError when that turns the RVE by more than 3 rad: a larger rotation cannot be told from a smaller one.
  static DriveOf constant_velocity_gradient(const Matrix &velocity_gradient, double dt,
                                            int substeps);
};
using Drive = DriveOf<2>;

/// p = tr(stress)/D, compression positive [stress]
template <int D> double mean_stress(const Tensor<double, D> &stress)
{
  return -(1.0 / D) * trace(stress);
}

/// Homogenised answer of one RVE after a call. Stress and fabric are full tensors.
template <int D> struct ResultOf {
  using Matrix = Tensor<double, D>;

  std::uint32_t status = status::Ok;
  std::int32_t unused = 0;
  Matrix stress = Matrix::zero();             ///< Love, Cauchy, tension positive [stress]
  Matrix cell = Matrix::identity();           ///< H [length]
  Matrix deformation = Matrix::identity();    ///< F since the packing was made [-]
  Matrix fabric = Matrix::zero();             ///< mean of n (x) n over contacts [-], trace 1
  double void_ratio = 0.0;             ///< cell volume / solid volume - 1, areas in the plane [-]
  double coordination_number = 0.0;    ///< 2 N_c / N [-]
  /// Without rattlers (grains with fewer than two contacts) [-].
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
  EnergyLedger energy;

  /// p [stress]
  double mean_stress() const { return rve::mean_stress(stress); }
  /// q = sqrt(s'_ij s'_ij / 2) in the plane, equation (25b), n = 2; sqrt(3/2 s'_ij s'_ij) in space, n = 3 [stress]
  double deviatoric_stress() const;
};
using Result = ResultOf<2>;

/// A Result with the affine stiffness of the same configuration: the longest answer, for an RVE that may be skipped.
template <int D> struct ElasticResultOf {
  ResultOf<D> result;
  AffineStiffnessOf<D> stiffness;
};
using ElasticResult = ElasticResultOf<2>;

/// What a macro step needs of an RVE: the short answer, which costs less than a Result. `stress` is that of Result.
template <int D> struct ResponseOf {
  std::uint32_t status = status::Ok;
  std::int32_t num_contacts = 0;
  double peak_force = 0.0;    ///< largest contact force of the call [force]
  /// Love, Cauchy, tension positive [stress].
  Tensor<double, D> stress = Tensor<double, D>::zero();
};
using Response = ResponseOf<2>;

template <int D> StiffnessMeasures stiffness_measures(const ResponseOf<D> &response)
{
  return {response.num_contacts, response.peak_force, mean_stress(response.stress)};
}

/// A drive by a deformation increment alone, as DriveOf has it.
template <int D> struct IncrementOf {
  double dt = 0.0;
  std::int32_t substeps = 0;
  std::int32_t is_looked_at =
      0;    ///< at its end, whether the RVE rests: IncrementCallOf::take_look
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

/// Who gives the increments of a call and takes its answers, some RVEs at a time, while they are in caches: what macro steps ask of thousands of
/// RVEs. Several threads ask at once, for different RVEs.
template <int D> class IncrementCallOf {
 public:
  virtual ~IncrementCallOf() = default;
  /// Writes increments[0] and on for the RVEs from `begin` to `end` - 1 of the call. False: one of them cannot be driven so, and there is no call.
  virtual bool give(int begin, int end, IncrementOf<D> *increments) = 0;
  /// All have been given, and will be driven so: the last occasion to turn RVEs before.
  virtual void begin() = 0;
  virtual void take(int begin, int end, const IncrementOf<D> *increments,
                    const ResponseOf<D> *responses) = 0;
  /// Behind a sound answer to an increment that asks for it.
  virtual void take_look(int /*place*/, const LookOf<D> & /*look*/) {}
  /// Instead of DEM steps the RVE has slept, until this deformation is pending (rve/engine/device_calls.h). Behind a look.
  virtual void take_sleep(int /*place*/, const Tensor<double, D> & /*pending*/) {}
};

template <int D> class DeviceCallsOf;    // rve/engine/device_calls.h

/// The memory in which an engine keeps its RVEs.
struct Memory {
  std::string name;         ///< engines on one machine that give the same name share it
  std::size_t free = 0;     ///< for RVEs, as it is now [bytes]
  bool is_known = false;    ///< otherwise `free` says nothing
  bool is_host = true;      ///< the caller's own data are there too
};

/// Owns RVEs. An RVE is named by the number that add() returned until it is removed.
/// Results do not depend on threads, on the order of the RVEs in a call, or on the backend (strict arithmetic).
template <int D> class EngineOf {
 public:
  virtual ~EngineOf() = default;

  /// What the contacts of its RVEs have, from the beginning (Options::contacts).
  virtual const ContactModel &contacts() const = 0;
  /// An engine without RVEs that has the options of this one, on the same device, but other contacts. Throws InputError if no program
  /// serves them.
  virtual std::unique_ptr<EngineOf> empty_with(const ContactModel &contacts) const = 0;

  /// Takes a copy of the state; throws InputError if it is not sound, or needs other contacts than the engine has.
  virtual int add(const RveStateOf<D> &state) = 0;
  /// The number is free, and the next add() takes it.
  virtual void remove(int rve) = 0;
  virtual int size() const = 0;

  /// The state as it is now, exact: adding it to an engine of the same options continues bit for bit.
  virtual RveStateOf<D> state(int rve) const = 0;

  /// Changes the material (friction after preparation, say) without touching anything else. Throws InputError as add() does.
  virtual void set_material(int rve, const Material &material) = 0;

  /// Turns whole RVEs rigidly: cell, deformation and velocities follow, all else is the same in the turned axes. Throws InputError
  /// unless these are rotations.
  virtual void turn(const std::vector<int> &rves,
                    const std::vector<Tensor<double, D>> &rotations) = 0;

  /// Advances rves[k] by drives[k]; results[k] answers it. RVEs are distinct; each may have its own number of substeps.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResultOf<D>> &results) = 0;
  /// The same motion with the longest answer. The stiffness costs as much as the rest of the long answer; its
  /// bits depend on the state alone, not on the call that asks.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ElasticResultOf<D>> &results) = 0;
  /// The same motion with the short answer. A Result of the same configuration is had by a call with no substeps.
  virtual void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                       std::vector<ResponseOf<D>> &responses) = 0;

  /// Launches the same motion by increments, with short answers, which Request::fetch() delivers to
  /// `call`. Returns null if a drive is needed for one of the RVEs; then nothing has changed. `rves`
  /// and `call` live until fetch(), and no other function of the engine may be called before.
  virtual Request *begin(const std::vector<int> &rves, IncrementCallOf<D> &call) = 0;

  /// Lower bounds of the stable time steps of RVEs as they are (rve::stable_time_step of their states), found where they live [time]:
  /// within a few percent where they are below `enough`, and as loose as may be above. 0 where none was found. They depend on the
  /// state and on `enough` alone. Costs about ten DEM steps.
  virtual void bound_time_steps(const std::vector<int> &rves, double enough,
                                std::vector<double> &bounds) = 0;

  /// "NVIDIA H200, mixed, strict" or "2 CPU threads (x86-64-v3), mixed, strict": a line for the log.
  virtual std::string description() const = 0;

  /// Memory that one RVE of this many grains takes [bytes].
  virtual std::size_t bytes_per_rve(int num_grains) const = 0;

  /// Memory that calls take beside the RVEs, when they advance this many of at most this many grains, while lists are no longer than
  /// at first [bytes]. 0 without RVEs.
  virtual std::size_t bytes_of_call(int num_rves, int num_grains) = 0;

  /// Where the RVEs live, and what is free there; at most the bytes that the environment has in GPU_RVE_MEMORY_LIMIT.
  /// Throws InputError when that is no number.
  virtual Memory memory() const = 0;

  /// For points on its device; null: none are served.
  virtual DeviceCallsOf<D> *device_calls() { return nullptr; }

  /// The CUDA device that it is on, as CUDA counts; -1 on CPU threads.
  virtual int cuda_device() const { return -1; }
};
using Engine = EngineOf<2>;

/// The engine that the options ask for. Device::Auto takes the GPU when one is there; `notice`, if given, receives the reason
/// when it falls back to the CPU. Throws InputError on wrong options, on Device::Cuda without a device, and on any fallback
/// or missing device when the environment demands one (cuda/cuda_required.h).
template <int D = 2>
std::unique_ptr<EngineOf<D>> make_engine(const Options &options, std::string *notice = nullptr);

}    // namespace rve
