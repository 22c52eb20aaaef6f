// SPDX-License-Identifier: GPL-2.0-only
// The RVEs behind the points of one rank: what the engine holds, with the last answer of each, its failure flag and the record in which it
// travels between ranks and into restart files; and how a macro step becomes DEM steps.

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

/// Deformation increments of a macro step, and who takes the stresses that answer them. Several threads ask at once, for different RVEs.
template <int D> class MacroIncrementsOf {
 public:
  virtual ~MacroIncrementsOf() = default;
  /// Of the RVE at a place of the step; the same whenever it is asked for.
  virtual rve::Tensor<double, D> increment(int place) const = 0;
  virtual void take_stress(int place, const rve::Tensor<double, D> &stress) = 0;

  double dt = 0.0;     ///< DEM time step [time]
  int substeps = 0;    ///< unless they are adaptive
};

/// What became of an RVE that failed, when a fresh one was to take its place.
template <int D> struct RenewalOf {
  int slot = -1;
  /// Of which it is; -1: none came to rest, and the RVE stays as it was, frozen.
  int packing = -1;
  double void_ratio_before = 0.0, void_ratio = 0.0;    ///< [-]
  rve::Tensor<double, D> stress_before, stress;        ///< [stress]
  std::int64_t steps = 0;                              ///< DEM steps that brought it there
};

/// A fresh RVE has arrived when the components of its stress are nearer to the wanted ones than this share of their norm, and its unbalanced ratio
/// is below this [-]; or after MOST_FRESH_STEPS. It is looked at every FRESH_STEPS_AT_ONCE DEM steps, none of which strains it by more than
/// FRESH_STRAIN_PER_STEP [-].
constexpr double FRESH_TOLERANCE = 1e-2;
constexpr int MOST_FRESH_STEPS = 20000, FRESH_STEPS_AT_ONCE = 200;
constexpr double FRESH_STRAIN_PER_STEP = 5e-5;
/// Packings that are tried for one.
constexpr int MOST_FRESH_TRIALS = 3;

template <int D> class RvePointsOf {
 public:
  using Matrix = rve::Tensor<double, D>;

  using State = PointState;

  using Point = PointOf<D>;

  using Slots = std::vector<int>;
  using Drives = std::vector<rve::DriveOf<D>>;

  /// `_shadows` is an engine in double precision, or none if there shall be no shadows. `_threads` are for what is done here.
  RvePointsOf(std::unique_ptr<rve::EngineOf<D>> _engine, std::unique_ptr<rve::EngineOf<D>> _shadows,
              const MacroStepOptions &_options, int _threads = 1) :
      engine(std::move(_engine)),
      shadows(std::move(_shadows)), options(_options), threads(_threads)
  {
  }

  /// What contacts of the RVEs may have.
  const rve::ContactModel &contacts() const { return engine->contacts(); }
  /// RVEs that need these contacts will come: where the engine has others, all RVEs move to a new one, to the same bits. Throws InputError
  /// if they do not fit into its memory, or have another contact law, and then changes nothing.
  void expect(const rve::ContactModel &contacts);
  /// Takes RVEs in and evaluates their stress; returns their slots.
  Slots add(const std::vector<const rve::RveStateOf<D> *> &states);
  void remove(int slot);

  /// Advances those that are not frozen; returns the slots that failed, which stay as they were and are frozen. With stress samples
  /// a macro step is several calls of the engine: a failed RVE then stays as it was before the call that failed.
  /// Without details the results have stress and status only until somebody asks for a point, which costs a call of the engine; the
  /// results are the same whenever they are asked for. Stress and status are those of the advance. The rest belongs to the same
  /// configuration: velocities have had their last kick (kinetic energy, forces of dashpots), and sums of forces may be rounded in
  /// another unit.
  Slots advance(const Slots &slots, const Drives &drives, bool with_details = true);
  /// Launches an advance by deformation increments: the engine reads them and delivers stresses while
  /// they are in the caches of a core. Null: this macro step needs drives, that is advance(), and
  /// nothing has changed. `slots` and `increments` live until finish(), before which only finish() and
  /// fetch_results() may be called.
  rve::Request *begin(const Slots &slots, MacroIncrementsOf<D> &increments);
  /// Plans the same with increments and stresses in the memory of the engine's device: the RVE of
  /// slots[k] belongs to the point point_of[k] there. The request has still to be launched. Null: some
  /// RVEs need the host, that is begin(). `increments` has the time step, and takes the stresses if
  /// finish() leaves them on the host. `is_as_before`: the arguments are those of the last plan.
  rve::Request *plan(const Slots &slots, const std::vector<int> &point_of, bool is_as_before,
                     const rve::PointsOnDevice &there, MacroIncrementsOf<D> &increments);
  /// True if slots and points are those of the last plan.
  bool is_as_before(const Slots &slots, const std::vector<int> &point_of) const
  {
    return planned_slots == slots && planned_points == point_of;
  }
  /// True from the launch of a request to finish().
  bool is_under_way() const { return under_way.request && under_way.request->is_running(); }
  /// Waits for the request that is under way. Returns the indices in `slots` of the RVEs that failed.
  std::vector<int> finish();
  /// Updates the points from results that the last advance has left on the device. Call it before any
  /// function but begin(), plan() and finish().
  void fetch_results();
  /// Completes the results of all points that an advance left without details.
  void complete() const;
  /// Those whose cells have become too narrow since this was asked last, and go on as copies of themselves side by side.
  Slots take_widened() { return std::exchange(widened, {}); }

  /// Fresh RVEs in place of these, which have failed: of these packings the one whose void ratio is nearest to that of the RVE, under the stress
  /// that it had, with its material and deformation, at rest. Where it had none, the packing is expanded to its void ratio. One that fails
  /// before it has made a macro step is not replaced again. `dt` is the DEM time step. They have no shadows.
  std::vector<RenewalOf<D>> renew(const Slots &slots,
                                  const std::vector<rve::RveStateOf<D>> &packings, double dt);

  /// What stands between macro steps and DEM steps from now on; the refinement of shadows stays. RVEs that sleep carry out what they
  /// slept through in their next step, if they may not go on sleeping.
  void set_options(const MacroStepOptions &_options);
  const MacroStepOptions &macro_step() const { return options; }
  /// Gives RVEs other materials, and their shadows, and evaluates their stress. A default gain of the servo follows. They may need other
  /// contacts than before: then all RVEs move to a new engine. Throws InputError if a material is out of range, if RVEs would have
  /// different contact laws, or if they do not fit into the memory of the new engine, and then changes none of these.
  void set_materials(const Slots &slots, const std::vector<rve::Material> &materials);
  /// All that a change of paths or, with its states, of materials can touch.
  struct Kept {
    int slot;
    Point point;
    std::optional<rve::RveStateOf<D>> state, shadow;
  };
  std::vector<Kept> keep(const Slots &slots, bool with_states) const;
  /// Undoes the changes of materials and paths since keep(), to the last bit.
  void restore(const std::vector<Kept> &before);

  /// Forgets all that has happened to RVEs: cells, grains and contacts stay, at rest; strains, counters, energies, servos and paths begin
  /// again, and so do those that were frozen. Slots and shadows stay theirs.
  void reset(const Slots &slots);

  /// Gives the RVE a shadow: a copy in double precision that goes its way with finer steps from now on, never skipped.
  void add_shadow(int slot);
  void remove_shadow(int slot);
  /// Wall time spent on shadows, and on all [seconds]
  double shadow_time() const { return seconds_for_shadows; }
  double total_time() const { return seconds; }
  /// Of it, in calls of the engine of the RVEs themselves [seconds]
  double engine_time() const { return seconds_in_engine; }
  /// Wall time of bound_time_steps(), which is in neither of them [seconds]
  double bounding_time() const { return seconds_for_bounds; }

  const Point &point(int slot) const
  {
    if (points.is_stale(slot)) complete();
    return points.at(slot);
  }
  /// Lower bounds of the stable DEM time steps, sharp below `enough` (rve::EngineOf<D>).
  std::vector<double> bound_time_steps(const Slots &slots, double enough) const;
  /// Their bounds have been looked at, and those of all that have stiffened.
  void note_check(const Slots &slots);
  /// Advice on its energy balance since the last call with `at_start`, which only notes its terms.
  std::vector<rve::Advice> advice_on_energy(int slot, bool at_start);
  /// Whether its servo has come no nearer to its goal since the last time that this was asked.
  std::vector<rve::Advice> advice_on_servo(int slot);
  /// True if the RVE has stiffened beyond its limit since its time-step bound was checked.
  bool has_stiffened(int slot) const
  {
    if (!may_be_stiffer[slot]) return false;
    const CachedPoint<D> &cached = points.cached(slot);
    return cached.state != State::Frozen && cached.limit.is_exceeded(cached.stiffness());
  }
  /// True if an RVE has.
  bool any_has_stiffened() const { return any_stiffened.is_set(); }
  // what is always up to date
  const Matrix &stress(int slot) const { return points.cached(slot).response.stress; }
  const rve::Material &material(int slot) const { return points.unsynchronised(slot).material; }
  /// Whether time has passed for it, here or before it came here.
  bool has_advanced(int slot) const
  {
    const CachedPoint<D> &cached = points.cached(slot);
    return cached.substeps > 0 || cached.state == State::Asleep;
  }
  bool frozen(int slot) const { return points.cached(slot).state == State::Frozen; }
  int copies(int slot) const { return points.unsynchronised(slot).copies; }
  int renewals(int slot) const { return points.unsynchronised(slot).renewals; }
  double servo_gain(int slot) const { return points.unsynchronised(slot).servo_gain; }
  /// The next step of an RVE that is on one of these paths, for advance(), and what comes of it there.
  rve::DriveOf<D> path_drive(int slot, const LoadPathsOf<D> &paths, const PathStep &step,
                             const double *script) const;
  void follow_path(int slot, const LoadPathsOf<D> &paths, const PathStep &step,
                   const double *script);
  PathState<D> &path(int slot) { return points.unsynchronised(slot).path; }
  const PathState<D> &path(int slot) const { return points.unsynchronised(slot).path; }
  /// Largest difference between a steered stress and its goal, after the last DEM steps [stress]
  double servo_error(int slot) const { return points.at(slot).servo_error; }
  rve::RveStateOf<D> state(int slot) const { return engine->state(slot); }
  std::string description() const { return engine->description(); }
  int size() const { return engine->size(); }
  /// Where the RVEs live. Their shadows live on the same device.
  rve::Memory memory() const { return engine->memory(); }
  /// rve::EngineOf::cuda_device()
  int cuda_device() const { return engine->cuda_device(); }
  /// Memory that `count` further RVEs take, of the first of these numbers of grains, with as many shadows as they may get, and calls
  /// of all that are then there [bytes]. An estimate: lists may grow.
  double bytes_for(const std::vector<int> &grains, int count, int num_shadows) const;
  double bytes(int slot) const
  {
    return engine->bytes_per_rve(points.unsynchronised(slot).result.num_grains);
  }

  /// Everything of one RVE as doubles.
  std::vector<double> record(int slot) const;
  /// Takes an RVE in from such doubles, `size` of them. Throws InputError if they are not what record() gave, in any bit that counts.
  int add_record(const double *record, std::size_t size);
  /// Length of record(); remembered until the next advance.
  int record_size(int slot) const;
  /// At least the length of record() while the list has at most twice the present pairs, and as many copies as there may be, without asking
  /// the engine.
  int record_bound(int slot) const;

 private:
  std::unique_ptr<rve::EngineOf<D>> engine, shadows;
  MacroStepOptions options;
  int threads;
  SharedFlag any_stiffened{false};    ///< since the last result at bounds
  /// By slot: whether it may have_stiffened(). Small, where few have and all are asked.
  std::vector<char> may_be_stiffer;
  bool any_copies = false;     ///< some RVE is as many as copies, or was
  std::vector<int> widened;    ///< slots, since they were taken
  double seconds = 0.0, seconds_for_shadows = 0.0;
  mutable double seconds_in_engine = 0.0, seconds_for_bounds = 0.0;
  mutable PointTable<D, Point> points;      // by slot
  mutable std::vector<int> record_sizes;    // by slot; 0: not known
  // of complete(), kept between calls
  mutable Slots stale_slots;
  mutable Drives resting;
  mutable std::vector<rve::ResultOf<D>> results;

  class IncrementCall;    // of the engine

  // of the advance by increments, kept between calls
  std::vector<int> call_indices, call_slots, separate_indices;
  /// The last request, until it has been finished.
  struct UnderWay {
    rve::Request *request = nullptr;
    const std::vector<int> *slots = nullptr;
    MacroIncrementsOf<D> *increments = nullptr;
    std::shared_ptr<IncrementCall> call;    ///< null: increments are on the device
  };
  UnderWay under_way;
  // of advances on the device
  std::vector<int> planned_slots,
      planned_points;                  ///< of the last plan, with those that are frozen
  rve::DeviceCallOf<D> device_call;    ///< its rves are call_slots
  std::vector<int> index_of_slot;      ///< in it; -1: none
  std::vector<rve::Rest> rests;
  /// State of device_call, the input of the last plan.
  enum class Plan {
    None,      ///< must be made again
    Valid,     ///< the device has it
    Refused    ///< the RVEs need the host until they change
  };
  Plan device_plan = Plan::None;
  bool results_on_device =
      false;    ///< the points have not received the results of the last advance
  /// By slot: whether it rests, or is as many as copies, which have calls of their own; and whether one of them does or is.
  std::vector<char> is_separate;
  bool any_separate = false;

  // of advance_plainly, kept between calls
  std::vector<rve::ResponseOf<D>> responses;
  std::vector<rve::ElasticResultOf<D>> evaluations;    ///< of those that are looked at
  // of advance_by_plan
  std::vector<Action> actions;    // of each slot that is given
  std::vector<int> working;       // indices of those that work among them, unless all do
  Slots working_slots;
  Drives working_drives;
  std::vector<char> must_turn, is_evaluated;    // as working_slots

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
  /// Of different slots by several threads.
  void limit_stiffening(int slot);
  void note_stiffening(int slot)
  {
    may_be_stiffer[slot] = 1;
    any_stiffened.set(true);
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
  void advance_with_samples(const Slots &slots, const Drives &drives);

  void freeze(int slot, std::uint32_t status);
  void evaluate_new(const Slots &slots);
  Point &initialise(int slot, const rve::RveStateOf<D> &state);
  /// Without DEM steps: they ask for the present results.
  static Drives drives_at_rest(std::size_t count);
  /// Those with an RVE.
  Slots used_slots() const;
  /// Materials by slot; null: as it is.
  using NewMaterials = std::vector<const rve::Material *>;
  rve::ContactModel contacts_with(const NewMaterials &materials) const;
  void move_to(const rve::ContactModel &contacts, const NewMaterials &materials);
  void set_materials_in_place(const Slots &slots, const std::vector<rve::Material> &materials);
  void complete_evaluations(const Slots &slots);
  bool choose_actions(const Slots &slots, const MacroIncrementsOf<D> &increments);
  Matrix defer_increment(int slot, const Matrix &increment);
  Matrix defer_until(int slot, const Matrix &pending);
  Slots newly_quiescent(const Slots &slots) const;
  void evaluate_working();
  static void turn(rve::EngineOf<D> &engine, const std::vector<int> &numbers, Drives &drives,
                   const std::vector<char> &must_turn);
  void find_resting();
  bool plan_device_call(const Slots &slots, const std::vector<int> &point_of);
  void fetch_results_of_stiffened();
  StepPlanner<D> planner() const { return {options, points}; }
  bool plan_actions(const Slots &slots, const Drives &drives);
  bool plan_work(const Slots &slots, const Drives &drives, bool all_work);
  void catch_up();
  void run(std::vector<SampledStep<D>> &steps);
  void advance_shadows(const Slots &slots, const Drives &drives);
};
using RvePoints = RvePointsOf<2>;

}    // namespace macro
