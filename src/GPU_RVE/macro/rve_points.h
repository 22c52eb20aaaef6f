// SPDX-License-Identifier: GPL-2.0-only
// Holds the RVEs of the points of one rank. The class advances the RVEs by macro steps, keeps their
// last results, changes their materials and packings, and makes records of RVEs for messages
// between ranks and for restart files.

#pragma once

#include "macro/load_path.h"
#include "macro/point_table.h"
#include "macro/rve_point.h"
#include "macro/sampled_step.h"
#include "macro/step_planner.h"
#include "macro/way_to_stress.h"
#include "rve/engine/advice.h"
#include "rve/engine/affine_stiffness.h"
#include "rve/engine/device_calls.h"
#include "rve/engine/finite_strain.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace macro {

/// Interface that supplies the deformation increments of a macro step and receives its stresses.
/// `index` is the index of an RVE in the macro step. Several threads call the functions at the same
/// time for different RVEs.
template <int D> class MacroIncrementsOf {
 public:
  virtual ~MacroIncrementsOf() = default;
  /// Returns the increment of an RVE. Repeated calls must return the same increment.
  virtual rve::Tensor<double, D> increment(int index) const = 0;
  virtual void take_stress(int index, const rve::Tensor<double, D> &stress) = 0;

  double dt = 0.0;     ///< DEM time step [time]
  int substeps = 0;    ///< number of DEM steps, unless it is adaptive
};

/// Result of the replacement of a failed RVE by a fresh one.
template <int D> struct RenewalOf {
  int slot = -1;
  /// Index of the packing of the fresh RVE; -1: no packing came to rest, and the failed RVE stays
  /// frozen.
  int packing = -1;
  double void_ratio_before = 0.0, void_ratio = 0.0;    ///< [-]
  rve::Tensor<double, D> stress_before, stress;        ///< [stress]
  std::int64_t steps = 0;    ///< DEM steps of the fresh RVE on its way to the stress
};

/// A fresh RVE has reached its stress if the error of each component is at most this share of the
/// norm of the goal, and if the unbalanced force ratio is at most this value [-].
constexpr double FRESH_TOLERANCE = 1e-2;
/// Most DEM steps of a fresh RVE, and DEM steps between checks.
constexpr int MOST_FRESH_STEPS = 20000, FRESH_STEPS_AT_ONCE = 200;
/// Largest strain of a fresh RVE in a DEM step [-].
constexpr double FRESH_STRAIN_PER_STEP = 5e-5;
/// Most packings that are tried for one fresh RVE.
constexpr int MOST_FRESH_TRIALS = 3;

template <int D> class RvePointsOf {
 public:
  using Matrix = rve::Tensor<double, D>;
  using State = PointState;
  using Point = PointOf<D>;
  using Slots = std::vector<int>;
  using Drives = std::vector<rve::DriveOf<D>>;

  /// `_shadows` is an engine in double precision, or null for runs without shadows. `_threads` is
  /// the number of threads for loops over points.
  RvePointsOf(std::unique_ptr<rve::EngineOf<D>> _engine, std::unique_ptr<rve::EngineOf<D>> _shadows,
              const MacroStepOptions &_options, int _threads = 1) :
      engine(std::move(_engine)),
      shadows(std::move(_shadows)), options(_options), threads(_threads)
  {
  }

  /// Contact law and resistances that the engine supports.
  const rve::ContactModel &contacts() const { return engine->contacts(); }
  /// Makes the engine support these contacts. If the present engine does not, all RVEs move to a
  /// new engine, bit for bit. Throws InputError if the RVEs do not fit into the memory or have
  /// another contact law; then nothing has changed.
  void expect(const rve::ContactModel &contacts);
  /// Adds RVEs, evaluates their stress and returns their slots.
  Slots add(const std::vector<const rve::RveStateOf<D> *> &states);
  void remove(int slot);

  /// Advances RVEs that are not frozen. Returns the slots of the RVEs that failed. A failed RVE is
  /// frozen in its state before the macro step. With stress samples, a macro step is several calls
  /// of the engine, and a failed RVE is frozen in its state before the call that failed.
  ///
  /// Without details, a result has only stress and status until a point is read. Reading a point
  /// then costs one call of the engine, which evaluates the other results but changes neither
  /// stress nor status. The other results do not depend on when the point is read. They belong to
  /// the configuration of the advance, but to the velocities after the last half step. This half
  /// step changes the kinetic energy and the forces of dashpots. Sums of forces can differ by
  /// rounding from the sums in the advance.
  Slots advance(const Slots &slots, const Drives &drives, bool with_details = true);
  /// Launches an advance by deformation increments. The engine reads the increment of an RVE and
  /// delivers its stress while the data of the RVE are in the cache of a core. Returns null if the
  /// macro step needs drives; then nothing has changed, and the caller must use advance(). `slots`
  /// and `increments` must live until finish(). Between begin() and finish(), only fetch_results()
  /// may be called.
  rve::Request *begin(const Slots &slots, MacroIncrementsOf<D> &increments);
  /// Plans an advance with increments and stresses in the memory of the engine's device. The RVE of
  /// slots[k] belongs to the point point_of[k] there. The caller launches the request. Returns null
  /// if some RVEs need the host; the caller must then use begin(). `increments` gives the time
  /// step, and receives the stresses if finish() leaves them on the host. `is_as_before`: `slots`
  /// and `point_of` are those of the last plan.
  rve::Request *plan(const Slots &slots, const std::vector<int> &point_of, bool is_as_before,
                     const rve::PointsOnDevice &there, MacroIncrementsOf<D> &increments);
  /// True if the last plan had these slots and points.
  bool is_as_before(const Slots &slots, const std::vector<int> &point_of) const
  {
    return planned_slots == slots && planned_points == point_of;
  }
  /// True from the launch of a request to finish().
  bool is_under_way() const { return under_way.request && under_way.request->is_running(); }
  /// Synchronises with the request that is under way. Returns the indices in `slots` of failed
  /// RVEs.
  std::vector<int> finish();
  /// Updates the points from results that the last advance left on the device. Must be called
  /// before any function other than begin(), plan() and finish().
  void fetch_results();
  /// Completes the results of all points that an advance left without details.
  void complete() const;
  /// Slots of the RVEs whose cells became too narrow since the last call. Each of these RVEs now
  /// consists of copies of itself side by side.
  Slots take_widened() { return std::exchange(widened, {}); }

  /// Replaces failed RVEs by fresh ones. A fresh RVE begins as the packing whose void ratio is
  /// nearest to the void ratio of the failed RVE. It comes to rest under the stress of the failed
  /// RVE, and takes over the material and the deformation of the failed RVE. If the failed RVE had
  /// no pressure, the packing is instead expanded to the void ratio of the failed RVE. A fresh RVE
  /// that fails before its first macro step is not replaced again. `dt` is the DEM time step. Fresh
  /// RVEs have no shadows.
  std::vector<RenewalOf<D>> renew(const Slots &slots,
                                  const std::vector<rve::RveStateOf<D>> &packings, double dt);

  /// Sets the options, except the refinement of shadows. Quiescent RVEs that may not be skipped any
  /// more carry out their deferred increments in the next step.
  void set_options(const MacroStepOptions &_options);
  const MacroStepOptions &macro_step() const { return options; }
  /// Changes the materials of RVEs and of their shadows and evaluates their stress. The default
  /// gain of the servo is scaled accordingly. If new materials need other contacts, all RVEs move
  /// to a new engine. Throws InputError if a material is out of range, if contact laws would
  /// differ, or if the RVEs do not fit into the memory of the new engine; then nothing has changed.
  void set_materials(const Slots &slots, const std::vector<rve::Material> &materials);
  /// Saved data of an RVE for restore(). To undo a change of paths, the point suffices. To undo a
  /// change of materials, the states are needed too.
  struct Kept {
    int slot;
    Point point;
    std::optional<rve::RveStateOf<D>> state, shadow;
  };
  std::vector<Kept> keep(const Slots &slots, bool with_states) const;
  /// Undoes all changes of materials and paths since keep(), bit for bit.
  void restore(const std::vector<Kept> &before);

  /// Resets RVEs, also frozen ones. Cells, grains, contacts and slots stay. Velocities, strains,
  /// counters, energies, servos and paths become those of a new RVE. A shadow becomes a copy of the
  /// reset RVE.
  void reset(const Slots &slots);

  /// Adds a shadow: a copy in double precision that makes the same macro steps with finer DEM steps
  /// and is never skipped.
  void add_shadow(int slot);
  void remove_shadow(int slot);
  /// Wall time of shadows, and of all advances [seconds].
  double shadow_time() const { return seconds_for_shadows; }
  double total_time() const { return seconds; }
  /// Part of total_time() in the engine of the RVEs, without shadows [seconds].
  double engine_time() const { return seconds_in_engine; }
  /// Wall time of bound_time_steps() [seconds]. The other times do not contain it.
  double bounding_time() const { return seconds_for_bounds; }

  const Point &point(int slot) const
  {
    if (points.is_stale(slot)) complete();
    return points.at(slot);
  }
  /// Lower bounds of the critical DEM time steps [time]. Bounds below `enough` are accurate
  /// (rve::EngineOf::bound_time_steps()).
  std::vector<double> bound_time_steps(const Slots &slots, double enough) const;
  /// Sets new stiffening limits after the time-step bounds of these RVEs were checked.
  /// Precondition: the caller has checked all RVEs that have stiffened.
  void note_check(const Slots &slots);
  /// Advice on the energy balance since the last call with `at_start`. A call with `at_start`
  /// stores the present terms of the balance.
  std::vector<rve::Advice> advice_on_energy(int slot, bool at_start);
  /// Advice on a servo that has come no nearer to its goal since the last call.
  std::vector<rve::Advice> advice_on_servo(int slot);
  /// True if the RVE has stiffened beyond its limit since its time-step bound was checked.
  bool has_stiffened(int slot) const
  {
    if (!may_be_stiffer[slot]) return false;
    const CachedPoint<D> &cached = points.cached(slot);
    return cached.state != State::Frozen && cached.limit.is_exceeded(cached.stiffness());
  }
  /// True if at least one RVE has stiffened.
  bool any_has_stiffened() const { return any_stiffened.is_set(); }

  // Functions that need neither complete() nor synchronisation.
  const Matrix &stress(int slot) const { return points.cached(slot).response.stress; }
  const rve::Material &material(int slot) const { return points.unsynchronised(slot).material; }
  bool frozen(int slot) const { return points.cached(slot).state == State::Frozen; }
  int copies(int slot) const { return points.unsynchronised(slot).copies; }
  int renewals(int slot) const { return points.unsynchronised(slot).renewals; }
  double servo_gain(int slot) const { return points.unsynchronised(slot).servo_gain; }

  /// Drive of the next step of an RVE on one of these paths, for advance().
  rve::DriveOf<D> path_drive(int slot, const LoadPathsOf<D> &paths, const PathStep &step,
                             const double *script) const;
  /// Updates the position on the path after the step of path_drive().
  void follow_path(int slot, const LoadPathsOf<D> &paths, const PathStep &step,
                   const double *script);
  PathState<D> &path(int slot) { return points.unsynchronised(slot).path; }
  const PathState<D> &path(int slot) const { return points.unsynchronised(slot).path; }
  /// Largest difference between a steered stress and its goal after the last DEM steps [stress].
  double servo_error(int slot) const { return points.at(slot).servo_error; }
  rve::RveStateOf<D> state(int slot) const { return engine->state(slot); }
  std::string description() const { return engine->description(); }
  int size() const { return engine->size(); }
  /// Memory that holds the RVEs. Shadows are on the same device.
  rve::Memory memory() const { return engine->memory(); }
  /// rve::EngineOf::cuda_device()
  int cuda_device() const { return engine->cuda_device(); }
  /// Estimates the memory [bytes] of `count` more RVEs, of at most `num_shadows` shadows, and of
  /// calls that advance all RVEs. `grains` has the numbers of grains; only the first `count` are
  /// used. The estimate does not include later growth of the pair lists.
  double bytes_for(const std::vector<int> &grains, int count, int num_shadows) const;
  double bytes(int slot) const
  {
    return engine->bytes_per_rve(points.unsynchronised(slot).result.num_grains);
  }

  /// All data of one RVE as doubles.
  std::vector<double> record(int slot) const;
  /// Adds an RVE from a record of `size` doubles and returns its slot. Throws InputError if the
  /// record is damaged or of an unknown version.
  int add_record(const double *record, std::size_t size);
  /// Length of record(), stored until the next advance.
  int record_size(int slot) const;
  /// Upper bound of the length of record() for any number of copies. It holds while the pair list
  /// has at most twice its present length. The function does not call the engine.
  int record_bound(int slot) const;

 private:
  std::unique_ptr<rve::EngineOf<D>> engine, shadows;
  MacroStepOptions options;
  int threads;
  SharedFlag any_stiffened{false};    ///< an RVE has stiffened since the last note_check()
  /// Compact filter for has_stiffened(), by slot: 0 if the RVE has not stiffened since its last
  /// check.
  std::vector<char> may_be_stiffer;
  bool any_copies = false;    ///< true once an RVE consists of several copies
  Slots widened;              ///< slots for take_widened()
  double seconds = 0.0, seconds_for_shadows = 0.0;
  mutable double seconds_in_engine = 0.0, seconds_for_bounds = 0.0;
  mutable PointTable<D, Point> points;
  mutable std::vector<int> record_sizes;    ///< length of record() by slot; 0: unknown

  // Buffers of complete().
  mutable Slots stale_slots;
  mutable Drives resting;
  mutable std::vector<rve::ResultOf<D>> results;

  // Advance by increments.
  class IncrementCall;
  Slots call_slots;                 ///< slots of the call of the engine
  std::vector<int> call_indices;    ///< their indices in the macro step; empty: same as in the call
  std::vector<int> separate_indices;    ///< indices of RVEs that are advanced separately
  /// The last request, until finish().
  struct UnderWay {
    rve::Request *request = nullptr;
    const Slots *slots = nullptr;
    MacroIncrementsOf<D> *increments = nullptr;
    std::shared_ptr<IncrementCall> call;    ///< null: increments are on the device
  };
  UnderWay under_way;

  // Advance by increments on the device.
  Slots planned_slots;                 ///< slots of the last plan, frozen ones included
  std::vector<int> planned_points;     ///< points of these slots on the device
  rve::DeviceCallOf<D> device_call;    ///< call of call_slots
  std::vector<int> index_of_slot;      ///< index in device_call by slot; -1: none
  std::vector<rve::Rest> rests;        ///< buffer of find_resting()
  /// State of device_call, the input of the last plan.
  enum class Plan {
    None,      ///< the plan must be made again
    Valid,     ///< the device has the plan
    Refused    ///< the RVEs need the host until they change
  };
  Plan device_plan = Plan::None;
  /// True if the points lack the results of the last advance.
  bool results_on_device = false;
  /// By slot: true if the RVE is frozen or consists of several copies. RVEs with copies get
  /// separate calls of the engine.
  std::vector<char> is_separate;
  bool any_separate = false;

  // Buffers of advances by drives.
  std::vector<rve::ResponseOf<D>> responses;
  std::vector<rve::ElasticResultOf<D>> evaluations;
  std::vector<Action> actions;    ///< action of each RVE of the macro step
  std::vector<int> working;       ///< indices of the RVEs that make DEM steps
  Slots working_slots;            ///< slots of these RVEs
  Drives working_drives;
  std::vector<char> must_turn, is_evaluated;    ///< flags of working RVEs

  template <class Answers>
  void call_engine(const Slots &slots, const Drives &drives, Answers &answers) const;
  template <class Answers>
  void call_and_widen(const Slots &slots, const Drives &drives, Answers &answers);
  template <class Answers>
  void widen_and_repeat(const Slots &slots, const Drives &drives, Answers &answers);
  std::vector<rve::ElasticResultOf<D>> evaluate(const Slots &slots) const;
  bool widen(int slot);
  struct Fresh;
  using Way = WayToStress<D>;
  bool begin_fresh(Fresh &fresh, const std::vector<rve::RveStateOf<D>> &packings);
  void bring_to_stress(std::vector<Fresh> &all, const std::vector<Way> &ways);
  void end_fresh(Fresh &fresh);
  void widen_shadows(const Slots &slots, const Drives &drives,
                     std::vector<rve::ResponseOf<D>> &responses);
  bool has_memory_for_copies(int num_grains) const;
  static bool replace(rve::EngineOf<D> &engine, int number, const rve::RveStateOf<D> &state);
  /// Sets the stiffening limit from the present state. Several threads may call it for different
  /// slots.
  void limit_stiffening(int slot);
  void note_stiffening(int slot)
  {
    may_be_stiffer[slot] = 1;
    any_stiffened.set(true);
  }
  /// Notes that an RVE has stiffened if `response` exceeds its limit.
  void note_response(int slot, const rve::ResponseOf<D> &response)
  {
    if (points.cached(slot).limit.is_exceeded(rve::stiffness_measures(response)))
      note_stiffening(slot);
  }
  bool is_plain(const Slots &slots) const;
  Slots advance_plainly(const Slots &slots, const Drives &drives,
                        const std::vector<char> &is_evaluated = {});
  void call_and_evaluate(const Slots &slots, const Drives &drives,
                         const std::vector<char> &is_evaluated);
  Slots advance_by_plan(const Slots &slots, const Drives &drives);
  void find_separate();
  void choose_slots(const Slots &slots, bool any_quiescent);
  void end_failures(IncrementCall &call, std::vector<int> &failed);
  void advance_separately(const Slots &slots, const std::vector<int> &indices,
                          MacroIncrementsOf<D> &increments, std::vector<int> &failed);
  void advance_with_samples();

  void freeze(int slot, std::uint32_t status);
  void evaluate_new(const Slots &slots);
  Point &initialise(int slot, const rve::RveStateOf<D> &state);
  /// Drives without DEM steps. They evaluate the present results.
  static Drives drives_at_rest(std::size_t count);
  /// Slots that have an RVE.
  Slots used_slots() const;
  /// New materials by slot; null: no change.
  using NewMaterials = std::vector<const rve::Material *>;
  rve::ContactModel contacts_with(const NewMaterials &materials) const;
  void move_to(const rve::ContactModel &contacts, const NewMaterials &materials);
  void set_materials_in_place(const Slots &slots, const std::vector<rve::Material> &materials);
  void complete_evaluations(const Slots &slots);
  bool choose_actions(const Slots &slots, const MacroIncrementsOf<D> &increments);
  Matrix defer_increment(int slot, const Matrix &increment);
  Matrix defer_until(int slot, const Matrix &pending);
  Slots newly_quiescent(const Slots &slots) const;
  static void turn(rve::EngineOf<D> &engine, const std::vector<int> &numbers, Drives &drives,
                   const std::vector<char> &must_turn);
  void find_resting();
  bool plan_device_call(const Slots &slots, const std::vector<int> &point_of);
  void fetch_results_of_stiffened();
  StepPlanner<D> planner() const { return {options, points}; }
  bool plan_actions(const Slots &slots, const Drives &drives);
  bool plan_work(const Slots &slots, const Drives &drives);
  void catch_up();
  void advance_shadows(const Slots &slots, const Drives &drives);
};
using RvePoints = RvePointsOf<2>;

}    // namespace macro
