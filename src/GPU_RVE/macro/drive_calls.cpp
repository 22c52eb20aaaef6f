// SPDX-License-Identifier: GPL-2.0-only
// Macro steps in which each RVE has a drive of its own: a deformation increment or a servo.

#include "macro/rve_points.h"

#include "macro/light_loops.h"
#include "rve/core/wall_time.h"
#include "rve/engine/finite_strain.h"

namespace macro {

namespace {

  /// Some RVEs of a call, in the order of the call.
  template <int D> struct PartOfCall {
    std::vector<std::size_t> index;    ///< indices in the call
    std::vector<int> slots;
    std::vector<rve::DriveOf<D>> drives;

    /// Selects the RVEs for whose index belongs(k) is true.
    template <class Belongs>
    PartOfCall(const std::vector<int> &all_slots, const std::vector<rve::DriveOf<D>> &all_drives,
               const Belongs &belongs)
    {
      for (std::size_t k = 0; k < all_slots.size(); ++k) {
        if (!belongs(k)) continue;
        index.push_back(k);
        slots.push_back(all_slots[k]);
        drives.push_back(all_drives[k]);
      }
    }
    /// Copies the results of the part to their indices in the call.
    template <class Answers> void scatter(const Answers &part, Answers &all) const
    {
      for (std::size_t m = 0; m < index.size(); ++m) all[index[m]] = part[m];
    }
  };

}    // namespace

/// Advances RVEs and adds the wall time to seconds_in_engine. RVEs that consist of several copies
/// get a separate call, because the largest RVE of a call determines how much of a GPU each RVE of
/// the call occupies.
template <int D>
template <class Answers>
void RvePointsOf<D>::call_engine(const Slots &slots, const Drives &drives, Answers &answers) const
{
  const auto start = rve::WallClock::now();
  if (any_copies) {
    answers.resize(slots.size());
    for (const bool has_copies : {false, true}) {
      const PartOfCall<D> part(slots, drives,
                               [&](std::size_t k) { return (copies(slots[k]) > 1) == has_copies; });
      if (part.slots.empty()) continue;
      Answers some;
      engine->advance(part.slots, part.drives, some);
      part.scatter(some, answers);
    }
  } else {
    engine->advance(slots, drives, answers);
  }
  seconds_in_engine += rve::seconds_since(start);
}

/// Advances RVEs. If the cell of an RVE is too narrow, copies side by side replace the RVE, and the
/// call is repeated for it.
template <int D>
template <class Answers>
void RvePointsOf<D>::call_and_widen(const Slots &slots, const Drives &drives, Answers &answers)
{
  call_engine(slots, drives, answers);
  widen_and_repeat(slots, drives, answers);
}

/// Widens RVEs whose cells were too narrow and repeats the call for them. Ends if no cell is too
/// narrow or no RVE with a narrow cell can be widened.
template <int D>
template <class Answers>
void RvePointsOf<D>::widen_and_repeat(const Slots &slots, const Drives &drives, Answers &answers)
{
  if (options.most_copies == 1) return;
  for (;;) {
    const PartOfCall<D> narrow(slots, drives, [&](std::size_t k) {
      return (answers[k].status & rve::status::CellTooNarrow) && widen(slots[k]);
    });
    if (narrow.slots.empty()) return;
    Answers some;
    call_engine(narrow.slots, narrow.drives, some);
    narrow.scatter(some, answers);
  }
}

/// Returns results and stiffnesses of the present configurations, without DEM steps.
template <int D>
std::vector<rve::ElasticResultOf<D>> RvePointsOf<D>::evaluate(const Slots &slots) const
{
  std::vector<rve::ElasticResultOf<D>> results;
  call_engine(slots, drives_at_rest(slots.size()), results);
  return results;
}

template <int D> void RvePointsOf<D>::freeze(int slot, std::uint32_t status)
{
  Point &point = points.modify(slot);
  point.state = State::Frozen;
  point.result.status = status;
}

/// Defers an increment and returns the stress after it.
template <int D>
rve::Tensor<double, D> RvePointsOf<D>::defer_increment(int slot, const Matrix &increment)
{
  return defer_until(slot, increment * points.pending(slot));
}

template <int D> rve::Tensor<double, D> RvePointsOf<D>::defer_until(int slot, const Matrix &pending)
{
  points.cached(slot);    // makes the cached copy valid
  const Matrix stress = points.quiescence(slot).stress_after(pending);
  points.defer(slot, pending, stress);
  return stress;
}

/// Slots of RVEs that are skipped in this step and whose cached copy has no deferred increment yet.
template <int D> std::vector<int> RvePointsOf<D>::newly_quiescent(const Slots &slots) const
{
  std::vector<int> some;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (actions[k] == Action::Skip && !points.was_deferred(slots[k])) some.push_back(slots[k]);
  return some;
}

/// Evaluates the stiffness of RVEs at rest that were read from a record. Records do not contain the
/// stiffness.
template <int D> void RvePointsOf<D>::complete_evaluations(const Slots &slots)
{
  std::vector<int> some;
  for (const int slot : slots)
    if (!points.is_dirty(slot) && points.at(slot).evaluation &&
        !points.at(slot).evaluation->is_whole())
      some.push_back(slot);
  if (some.empty()) return;
  const std::vector<rve::ElasticResultOf<D>> found = evaluate(some);
  for (std::size_t m = 0; m < some.size(); ++m)
    points.synchronised(some[m]).evaluation->stiffness = found[m].stiffness;
}

/// Turns the RVEs with `must_turn` rigidly by the rotations of their drives, because contacts would
/// slip if DEM steps applied these rotations. Only the stretches remain in the drives.
template <int D>
void RvePointsOf<D>::turn(rve::EngineOf<D> &engine, const std::vector<int> &numbers, Drives &drives,
                          const std::vector<char> &must_turn)
{
  std::vector<int> some;
  std::vector<Matrix> rotations;
  for (std::size_t m = 0; m < numbers.size(); ++m) {
    if (!must_turn[m]) continue;
    some.push_back(numbers[m]);
    rotations.push_back(rve::take_rotation(drives[m].deformation));
  }
  if (!some.empty()) engine.turn(some, rotations);
}

/// Sets `actions`. Returns true if all RVEs make DEM steps.
template <int D> bool RvePointsOf<D>::plan_actions(const Slots &slots, const Drives &drives)
{
  const int count = static_cast<int>(slots.size());
  actions.resize(count);
  return !for_each_any(count, threads, [&](int k) {
    actions[k] = frozen(slots[k]) ? Action::None : planner().action(slots[k], drives[k]);
    return !advances(actions[k]);
  });
}

/// Sets the drives of the RVEs that make DEM steps. A drive includes the deferred increment of its
/// RVE, unless it has a servo, which ignores deformations. Returns true if an RVE with a servo has
/// a deferred increment.
template <int D> bool RvePointsOf<D>::plan_work(const Slots &slots, const Drives &drives)
{
  working.clear();
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (advances(actions[k])) working.push_back(static_cast<int>(k));
  const int count = static_cast<int>(working.size());
  working_slots.resize(count);
  working_drives.resize(count);
  must_turn.resize(count);
  is_evaluated.resize(count);
  const bool any_deferred = for_each_any(count, threads, [&](int m) {
    const int k = working[m], slot = slots[k];
    rve::DriveOf<D> &drive = working_drives[m];
    working_slots[m] = slot;
    drive = drives[k];
    must_turn[m] = 0;
    is_evaluated[m] = actions[k] == Action::AdvanceAndEvaluate;
    const bool has_deferred = points.cached(slot).has_deferred, has_servo = drive.has_servo();
    if (has_servo || drive.substeps == 0) return has_servo && has_deferred;
    if (has_deferred) drive.deformation = drive.deformation * points.at(slot).pending;
    drive.substeps = planner().substeps(slot, drive);
    must_turn[m] = planner().needs_turn(slot, drive.deformation, drive.dt, drive.substeps);
    return false;
  });
  turn(*engine, working_slots, working_drives, must_turn);
  // by rounding, the strain of the remaining stretch differs from the strain of the whole increment
  for (int m = 0; m < count; ++m)
    if (must_turn[m])
      working_drives[m].substeps = planner().substeps(working_slots[m], working_drives[m]);
  return any_deferred;
}

/// Carries out deferred increments of RVEs that have a servo in this step. RVEs that fail are
/// frozen and removed from `working_slots`.
template <int D> void RvePointsOf<D>::catch_up()
{
  Slots slots;
  Drives drives;
  must_turn.clear();
  for (std::size_t m = 0; m < working_slots.size(); ++m) {
    const rve::DriveOf<D> &wanted = working_drives[m];
    const Point &point = points.at(working_slots[m]);
    if (!wanted.has_servo() || is_identity(point.pending)) continue;
    rve::DriveOf<D> drive;
    drive.dt = wanted.dt;
    drive.substeps = wanted.substeps;
    drive.deformation = point.pending;
    slots.push_back(working_slots[m]);
    drives.push_back(drive);
    must_turn.push_back(rve::is_turned(point.mean_overlap(), point.pending));
  }
  if (slots.empty()) return;
  turn(*engine, slots, drives, must_turn);
  std::vector<rve::ResponseOf<D>> responses;
  call_and_widen(slots, drives, responses);
  for (std::size_t k = 0; k < slots.size(); ++k) {
    if (responses[k].status & rve::status::Fatal) {
      freeze(slots[k], responses[k].status);
      continue;
    }
    Point &point = points.modify(slots[k]);
    point.state = State::Awake;
    point.pending = Matrix::identity();
  }
  std::size_t left = 0;
  for (std::size_t m = 0; m < working_slots.size(); ++m) {
    if (frozen(working_slots[m])) continue;
    working_slots[left] = working_slots[m];
    is_evaluated[left] = is_evaluated[m];
    working_drives[left++] = working_drives[m];
  }
  working_slots.resize(left);
  working_drives.resize(left);
  is_evaluated.resize(left);
}

template <int D> void RvePointsOf<D>::advance_shadows(const Slots &slots, const Drives &drives)
{
  std::vector<int> originals, numbers;
  Drives finer;
  std::vector<char> turned;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const Point &point = points.at(slots[k]);
    if (point.shadow < 0 || point.frozen()) continue;
    originals.push_back(slots[k]);
    numbers.push_back(point.shadow);
    finer.push_back(drives[k]);
    finer.back().dt /= options.shadow_refinement;
    finer.back().substeps = planner().substeps(slots[k], drives[k]) * options.shadow_refinement;
    turned.push_back(
        options.adaptive && !drives[k].has_servo() && drives[k].substeps > 0 &&
        planner().slips(slots[k], drives[k].deformation, finer.back().dt, finer.back().substeps));
  }
  if (numbers.empty()) return;
  turn(*shadows, numbers, finer, turned);
  std::vector<rve::ResponseOf<D>> responses;
  shadows->advance(numbers, finer, responses);
  widen_shadows(originals, finer, responses);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    Point &point = points.modify(originals[k]);
    if (responses[k].status & rve::status::Fatal)
      remove_shadow(originals[k]);    // the caller may add another shadow
    else
      point.shadow_stress = responses[k].stress;
  }
}

template <int D>
std::vector<int> RvePointsOf<D>::advance(const Slots &slots, const Drives &drives,
                                         bool with_details)
{
  fetch_results();
  device_plan = Plan::None;
  const auto start = rve::WallClock::now();
  const std::vector<int> failed = is_plain(slots) ? advance_plainly(slots, drives)
                                                  : advance_by_plan(slots, drives);
  // the velocities in the results of the call itself are half a step old, so the details are
  // evaluated
  if (with_details) complete();
  if (shadows) {
    const auto shadows_start = rve::WallClock::now();
    advance_shadows(slots, drives);
    seconds_for_shadows += rve::seconds_since(shadows_start);
  }
  seconds += rve::seconds_since(start);
  return failed;
}

/* ----------------------------------------------------------------------
   One call of the engine with unchanged drives. A step can have thousands of RVEs,
   so the work for each of them must be small.
------------------------------------------------------------------------- */

/// True if all RVEs make exactly the DEM steps of their drives: no option changes the drives, and
/// no RVE is frozen, quiescent or has a deferred increment.
template <int D> bool RvePointsOf<D>::is_plain(const Slots &slots) const
{
  if (options.adaptive || options.quiescent_strain > 0.0 || options.stress_from != StressFrom::End)
    return false;
  return !for_each_any(static_cast<int>(slots.size()), threads, [&](int k) {
    const CachedPoint<D> &cached = points.cached(slots[k]);
    return cached.state != State::Awake || cached.has_deferred;
  });
}

/// Advances RVEs by one call of the engine. `is_evaluated` marks the RVEs that are evaluated after
/// the steps. If it is empty, no RVE is evaluated. Returns the slots that failed.
template <int D>
std::vector<int> RvePointsOf<D>::advance_plainly(const Slots &slots, const Drives &drives,
                                                 const std::vector<char> &is_evaluated)
{
  const int count = static_cast<int>(slots.size());
  if (count == 0) return {};
  std::vector<int> evaluated;
  for (std::size_t k = 0; k < is_evaluated.size(); ++k)
    if (is_evaluated[k]) evaluated.push_back(static_cast<int>(k));
  if (evaluated.empty())
    call_engine(slots, drives, responses);
  else
    call_and_evaluate(slots, drives, is_evaluated);
  record_sizes.assign(points.size(), 0);

  const auto has_failed = [&](int k) { return (responses[k].status & rve::status::Fatal) != 0; };
  const auto store = [&](int k) {
    points.store(slots[k], responses[k], drives[k]);
    note_response(slots[k], responses[k]);
  };
  const bool any_failed = for_each_any(count, threads, [&](int k) {
    if (has_failed(k)) return true;
    store(k);
    return false;
  });
  for (std::size_t m = 0; m < evaluated.size(); ++m)
    if (!has_failed(evaluated[m]))
      points.synchronised(slots[evaluated[m]]).evaluation =
          PointOf<D>::Evaluation::of(evaluations[m]);
  if (!any_failed) return {};

  std::vector<int> failed, failures;
  for (int k = 0; k < count; ++k)
    if (has_failed(k)) failures.push_back(k);
  widen_and_repeat(slots, drives, responses);
  for (const int k : failures) {
    if (!has_failed(k)) {
      store(k);
      continue;
    }
    freeze(slots[k], responses[k].status);
    failed.push_back(slots[k]);
  }
  return failed;
}

/// Advances RVEs by two calls of the engine. One call returns results with stiffnesses of the
/// evaluated RVEs, the other call returns responses of the other RVEs. Sets `responses` and
/// `evaluations`.
template <int D>
void RvePointsOf<D>::call_and_evaluate(const Slots &slots, const Drives &drives,
                                       const std::vector<char> &is_evaluated)
{
  const PartOfCall<D> evaluated(slots, drives, [&](std::size_t k) { return is_evaluated[k] != 0; }),
      others(slots, drives, [&](std::size_t k) { return is_evaluated[k] == 0; });
  std::vector<rve::ResponseOf<D>> of_others;
  if (!others.slots.empty()) call_engine(others.slots, others.drives, of_others);
  call_engine(evaluated.slots, evaluated.drives, evaluations);
  responses.resize(slots.size());
  others.scatter(of_others, responses);
  for (std::size_t m = 0; m < evaluations.size(); ++m) {
    const rve::ResultOf<D> &result = evaluations[m].result;
    responses[evaluated.index[m]] = {result.status, result.num_contacts, result.peak_force,
                                     result.stress};
  }
}

template <int D> void RvePointsOf<D>::complete() const
{
  if (!points.any_stale()) return;
  stale_slots.clear();
  for (int slot = 0; slot < points.size(); ++slot)
    if (points.is_stale(slot)) stale_slots.push_back(slot);
  const int count = static_cast<int>(stale_slots.size());
  if (count == 0) {
    points.clear_any_stale();
    return;
  }
  // some callers read thousands of points in every step, so the buffers are kept and several
  // threads copy the results
  if (static_cast<int>(resting.size()) != count) resting = drives_at_rest(count);
  call_engine(stale_slots, resting, results);
  for_each(count, threads, [&](int k) {
    Point &point = points.synchronised(stale_slots[k]);
    point.stale = false;
    if (!(results[k].status & rve::status::Fatal)) point.take_details(results[k]);
  });
  points.clear_any_stale();
}

template <int D>
std::vector<int> RvePointsOf<D>::advance_by_plan(const Slots &slots, const Drives &drives)
{
  record_sizes.assign(points.size(), 0);
  const bool all_advance = plan_actions(slots, drives);
  if (!all_advance && options.quiescent_strain > 0.0) {
    complete_evaluations(newly_quiescent(slots));
    for_each(static_cast<int>(slots.size()), threads, [&](int k) {
      if (actions[k] == Action::Skip) defer_increment(slots[k], drives[k].deformation);
    });
  }

  const bool any_deferred = plan_work(slots, drives);
  const std::size_t planned = working_slots.size();
  if (any_deferred) catch_up();
  if (options.stress_from != StressFrom::End)
    advance_with_samples();
  else if (advance_plainly(working_slots, working_drives, is_evaluated).empty() &&
           working_slots.size() == planned)
    return {};    // the usual case needs no loop over points

  std::vector<int> failed;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (advances(actions[k]) && frozen(slots[k])) failed.push_back(slots[k]);
  return failed;
}

/// Advances `working_slots` by macro steps that are divided into parts. The stress of a macro step
/// is the average or regression of the stresses at the ends of its parts. The n-th call of the
/// engine advances all RVEs by their n-th parts.
template <int D> void RvePointsOf<D>::advance_with_samples()
{
  std::vector<SampledStep<D>> steps;
  for (std::size_t m = 0; m < working_slots.size(); ++m)
    steps.emplace_back(working_slots[m], working_drives[m], options);
  for (int part = 0;; ++part) {
    std::vector<SampledStep<D> *> some;
    Slots slots;
    Drives drives;
    for (SampledStep<D> &macro : steps) {
      if (macro.failed || part >= macro.parts) continue;
      some.push_back(&macro);
      slots.push_back(macro.slot);
      drives.push_back(macro.of_part(part));
    }
    if (some.empty()) break;
    call_and_widen(slots, drives, responses);
    for (std::size_t k = 0; k < some.size(); ++k) {
      SampledStep<D> &macro = *some[k];
      rve::ResponseOf<D> &response = responses[k];
      macro.failed = (response.status & rve::status::Fatal) != 0;
      if (macro.failed) {
        freeze(macro.slot, response.status);
        continue;
      }
      macro.samples.push_back(response.stress);
      if (part + 1 < macro.parts) continue;
      note_response(macro.slot, response);
      if (macro.parts > 1) response.stress = macro.stress(options.stress_from);
      points.store(macro.slot, response, macro.drive);
    }
  }

  Slots evaluated;
  for (std::size_t m = 0; m < working_slots.size(); ++m)
    if (is_evaluated[m] && !frozen(working_slots[m])) evaluated.push_back(working_slots[m]);
  if (evaluated.empty()) return;
  const std::vector<rve::ElasticResultOf<D>> found = evaluate(evaluated);
  for (std::size_t m = 0; m < evaluated.size(); ++m)
    if (!(found[m].result.status & rve::status::Fatal))
      points.synchronised(evaluated[m]).evaluation = Point::Evaluation::of(found[m]);
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

// Instances of member templates that other source files of this class call.
#define RVE_INSTANTIATE(D)                                                           \
  template void RvePointsOf<D>::widen_and_repeat(const Slots &, const Drives &,      \
                                                 std::vector<rve::ResponseOf<D>> &); \
  template void RvePointsOf<D>::call_and_widen(const Slots &, const Drives &,        \
                                               std::vector<rve::ResultOf<D>> &);     \
  template void RvePointsOf<D>::call_engine(const Slots &, const Drives &,           \
                                            std::vector<rve::ResultOf<D>> &) const;
RVE_INSTANTIATE(2)
RVE_INSTANTIATE(3)
#undef RVE_INSTANTIATE

}    // namespace macro
