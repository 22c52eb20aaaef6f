// SPDX-License-Identifier: GPL-2.0-only
// Macro steps in which a deformation increment drives each RVE. Increments and stresses are either
// on the host, or in the memory of the device that advances the RVEs.

#include "macro/rve_points.h"

#include "macro/light_loops.h"
#include "rve/core/wall_time.h"
#include "rve/engine/finite_strain.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace macro {

/* ----------------------------------------------------------------------
   on the host
------------------------------------------------------------------------- */

/// Gives the increments of a macro step to the engine and stores the responses. This is the usual
/// macro step and must be fast. Each RVE is therefore planned, and its response stored, while its
/// data are in the cache of a core.
template <int D> class RvePointsOf<D>::IncrementCall final : public rve::IncrementCallOf<D> {
 public:
  /// If `macro` is null, responses are stored in `owner.points`, and no stresses are passed on.
  /// `has_actions` is true if RvePointsOf::actions were set for this macro step.
  IncrementCall(RvePointsOf &owner, MacroIncrementsOf<D> *macro, bool has_actions = false) :
      owner_(owner), macro_(macro), has_actions_(has_actions)
  {
  }

  bool give(int begin, int end, rve::IncrementOf<D> *increments) override
  {
    for (int m = begin; m < end; ++m) {
      rve::IncrementOf<D> &increment = increments[m - begin];
      if (!plan(owner_.call_slots[m], macro_->increment(index(m)), increment)) return false;
      increment.is_evaluated =
          has_actions_ && owner_.actions[index(m)] == Action::AdvanceAndEvaluate;
    }
    return true;
  }

  void begin() override
  {
    if (!turned_.empty()) owner_.engine->turn(turned_, rotations_);
  }

  void take(int begin, int end, const rve::IncrementOf<D> *increments,
            const rve::ResponseOf<D> *responses) override
  {
    for (int m = begin; m < end; ++m)
      if (increments[m - begin].substeps != rve::BEFORE_THE_CALL)
        take_one(m, increments[m - begin], responses[m - begin]);
  }
  void take_evaluation(int m, const rve::EvaluationOf<D> &evaluation) override
  {
    owner_.points.synchronised(owner_.call_slots[m]).evaluation = typename Point::Evaluation{
        evaluation.is_at_rest, evaluation.mean_overlap, evaluation.stiffness};
  }
  void take_deferred(int m, const Matrix &pending) override
  {
    deliver_stress(m, owner_.defer_until(owner_.call_slots[m], pending));
  }
  /// Stores the response of an RVE, or adds a failed RVE to `failed`. end_failures() can repeat the
  /// increment of a failed RVE.
  void take_one(int m, const rve::IncrementOf<D> &increment, const rve::ResponseOf<D> &response)
  {
    if (response.status & rve::status::Fatal) {
#pragma omp critical(rves_that_failed)
      failed.push_back({m, increment, response});
      return;
    }
    const int slot = owner_.call_slots[m];
    owner_.points.store(slot, response, increment);
    owner_.note_response(slot, response);
    deliver_stress(m, response.stress);
  }

  /// Converts the index of an RVE in the call to its index in the macro step.
  int index(int m) const
  {
    return owner_.call_indices.empty() ? m : owner_.call_indices[m];
  }

  /// Failed RVE: its index in the call, its increment and response.
  struct Failure {
    int m;
    rve::IncrementOf<D> increment;
    rve::ResponseOf<D> response;
  };
  std::vector<Failure> failed;

 private:
  /// Sets the increment of an RVE: its deferred increment followed by `deformation`. Returns false
  /// if the RVE needs a drive.
  bool plan(int slot, const Matrix &deformation, rve::IncrementOf<D> &increment)
  {
    const CachedPoint<D> &cached = owner_.points.cached(slot);
    if (cached.state != State::Awake && cached.state != State::Quiescent) return false;
    increment.dt = macro_->dt;
    increment.substeps = macro_->substeps;
    increment.deformation = deformation;
    if (macro_->substeps == 0) return !cached.has_deferred;
    // the engine rejects this increment
    if (!rve::finite(deformation)) return true;
    if (cached.has_deferred) increment.deformation = deformation * owner_.points.at(slot).pending;
    find_substeps(slot, increment);
    if (owner_.planner().needs_turn(slot, increment.deformation, macro_->dt, increment.substeps))
      turn(slot, increment);
    return true;
  }

  void find_substeps(int slot, rve::IncrementOf<D> &increment) const
  {
    if (owner_.options.adaptive)
      increment.substeps =
          owner_.planner().substeps(slot, rve::strain_size(increment.deformation), macro_->dt);
  }

  void deliver_stress(int m, const Matrix &stress)
  {
    if (macro_) macro_->take_stress(index(m), stress);
  }

  /// Adds the rotation of an increment to `rotations_` and leaves its stretch in the increment.
  void turn(int slot, rve::IncrementOf<D> &increment)
  {
    const Matrix rotation = rve::take_rotation(increment.deformation);
    // by rounding, the strain of the stretch differs from the strain of the whole increment
    find_substeps(slot, increment);
#pragma omp critical(rves_that_turn)
    {
      turned_.push_back(slot);
      rotations_.push_back(rotation);
    }
  }

  RvePointsOf &owner_;
  MacroIncrementsOf<D> *macro_;
  const bool has_actions_;
  std::vector<int> turned_;          // slots that are turned rigidly before the call
  std::vector<Matrix> rotations_;    // rotations of these slots
};

template <int D>
rve::Request *RvePointsOf<D>::begin(const Slots &slots, MacroIncrementsOf<D> &increments)
{
  fetch_results();
  device_plan = Plan::None;
  under_way = {};
  if (options.stress_from != StressFrom::End || shadows || slots.empty()) return nullptr;
  const auto start = rve::WallClock::now();
  find_separate();
  const bool has_actions = choose_actions(slots, increments);
  const bool any_quiescent =
      has_actions && std::find(actions.begin(), actions.end(), Action::Skip) != actions.end();
  if (any_quiescent) complete_evaluations(newly_quiescent(slots));
  choose_slots(slots, any_quiescent);
  auto call = std::make_shared<IncrementCall>(*this, &increments, has_actions);
  const auto engine_start = rve::WallClock::now();
  rve::Request *const request = engine->begin(call_slots, *call);
  seconds_in_engine += rve::seconds_since(engine_start);
  if (!request) return nullptr;
  if (any_quiescent)
    for_each(static_cast<int>(slots.size()), threads, [&](int k) {
      if (actions[k] == Action::Skip)
        increments.take_stress(k, defer_increment(slots[k], increments.increment(k)));
    });
  under_way = {request, &slots, &increments, std::move(call)};
  seconds += rve::seconds_since(start);
  return request;
}

/// Sets the slots of the call of the engine and their indices in the macro step. The call contains
/// neither RVEs that are advanced separately nor RVEs that are skipped in this step.
template <int D> void RvePointsOf<D>::choose_slots(const Slots &slots, bool any_quiescent)
{
  call_slots.clear();
  call_indices.clear();
  separate_indices.clear();
  if (!any_separate && !any_quiescent) {
    call_slots = slots;
    return;
  }
  for (int k = 0; k < static_cast<int>(slots.size()); ++k) {
    if (is_separate[slots[k]]) {
      separate_indices.push_back(k);
      continue;
    }
    if (any_quiescent && actions[k] == Action::Skip) continue;
    call_slots.push_back(slots[k]);
    call_indices.push_back(k);
  }
}

/// Sets the action of each RVE if the options allow quiescent RVEs; an RVE that is advanced
/// separately gets Advance. Returns true if an action is not Advance.
template <int D>
bool RvePointsOf<D>::choose_actions(const Slots &slots, const MacroIncrementsOf<D> &increments)
{
  if (!(options.quiescent_strain > 0.0) || increments.substeps == 0) return false;
  const int count = static_cast<int>(slots.size());
  actions.resize(count);
  return for_each_any(count, threads, [&](int k) {
    actions[k] = is_separate[slots[k]]
        ? Action::Advance
        : planner().action(slots[k], increments.increment(k), increments.dt, increments.substeps);
    return actions[k] != Action::Advance;
  });
}

template <int D> std::vector<int> RvePointsOf<D>::finish()
{
  const auto start = rve::WallClock::now();
  const UnderWay advance = std::exchange(under_way, {});
  std::vector<int> failed;
  if (!advance.request) return failed;
  std::shared_ptr<IncrementCall> call = advance.call;
  const rve::StressesAre stresses_are = advance.request->fetch();
  if (!call) {
    results_on_device = stresses_are != rve::StressesAre::OnHost;
    if (results_on_device) {
      fetch_results_of_stiffened();
    } else {
      call = std::make_shared<IncrementCall>(*this, advance.increments);
      engine->device_calls()->deliver(*call);
      device_plan = Plan::None;
    }
  }
  seconds_in_engine += rve::seconds_since(start);
  record_sizes.assign(points.size(), 0);
  if (call && !call->failed.empty()) end_failures(*call, failed);
  if (!separate_indices.empty())
    advance_separately(*advance.slots, separate_indices, *advance.increments, failed);
  seconds += rve::seconds_since(start);
  return failed;
}

/* ----------------------------------------------------------------------
   On a device that has the increments and receives the stresses. The host fetches
   results when points are read, or when an RVE has failed or stiffened.
------------------------------------------------------------------------- */

/// Sets device_call. Returns true if the device can plan the steps of all RVEs that advance. On the
/// device, the stresses of frozen RVEs do not change.
template <int D>
bool RvePointsOf<D>::plan_device_call(const Slots &slots, const std::vector<int> &point_of)
{
  find_separate();
  planned_slots = slots;
  planned_points = point_of;
  call_slots = slots;
  call_indices.clear();
  device_call.point_of = point_of;
  if (any_separate) {
    call_slots.clear();
    device_call.point_of.clear();
    for (int k = 0; k < static_cast<int>(slots.size()); ++k) {
      if (frozen(slots[k])) continue;
      call_slots.push_back(slots[k]);
      call_indices.push_back(k);
      device_call.point_of.push_back(point_of[k]);
    }
  }
  device_call.rves = call_slots;
  find_resting();
  const int count = static_cast<int>(call_slots.size());
  index_of_slot.assign(points.size(), -1);
  for (int k = 0; k < count; ++k) index_of_slot[call_slots[k]] = k;
  device_call.planned.resize(count);
  const bool any_misfit = for_each_any(count, threads, [&](int k) {
    const int slot = call_slots[k];
    const CachedPoint<D> &cached = points.cached(slot);
    const ContactResponse<D> &contacts = cached.of_contacts;
    const bool is_as_planned = cached.state == State::Quiescent ||
        (cached.state == State::Awake && !cached.has_deferred);
    rve::PlannedRve &planned = device_call.planned[k];
    planned.pressure = cached.pressure;
    planned.grain_size = contacts.grain_size();
    planned.density = contacts.density();
    planned.contacts = contacts.linear();
    planned.limit = cached.limit;
    planned.status = cached.response.status;
    return !is_as_planned || copies(slot) > 1 || (!contacts.is_linear() && options.adaptive);
  });
  return count > 0 && !any_misfit;
}

/// Sets device_call.resting: the states of rest of its RVEs, where they are known.
template <int D> void RvePointsOf<D>::find_resting()
{
  device_call.resting.clear();
  // RVEs can have deferred increments from earlier steps even if the options do not allow skipping
  // now
  const bool any_deferred = std::any_of(call_slots.begin(), call_slots.end(), [this](int slot) {
    return points.cached(slot).has_deferred;
  });
  if (!(options.quiescent_strain > 0.0) && !any_deferred) return;
  complete_evaluations(call_slots);
  const int count = static_cast<int>(call_slots.size());
  rests.resize(count);
  for_each(count, threads, [&](int k) { rests[k] = points.rest(call_slots[k]); });
  for (int k = 0; k < count; ++k)
    if (rests[k] != rve::Rest::Unknown)
      device_call.resting.push_back({k, rests[k], points.quiescence(call_slots[k])});
}

template <int D>
rve::Request *RvePointsOf<D>::plan(const Slots &slots, const std::vector<int> &point_of,
                                   bool is_as_before, const rve::PointsOnDevice &there,
                                   MacroIncrementsOf<D> &increments)
{
  under_way = {};
  rve::DeviceCallsOf<D> *const device = engine->device_calls();
  if (!device || there.device < 0 || there.device != engine->cuda_device() ||
      options.stress_from != StressFrom::End || shadows || slots.empty() ||
      increments.substeps == 0)
    return nullptr;
  const auto start = rve::WallClock::now();
  const bool is_unchanged = !points.is_changed() && is_as_before;
  if (is_unchanged && device_plan == Plan::Refused) return nullptr;
  device_call.is_new = !is_unchanged || device_plan != Plan::Valid;
  if (device_call.is_new) {
    fetch_results();
    device_plan = plan_device_call(slots, point_of) ? Plan::Valid : Plan::Refused;
    if (device_plan == Plan::Refused) return nullptr;
  }
  device_call.points = there;
  device_call.options.dt = increments.dt;
  device_call.options.substeps = increments.substeps;
  device_call.options.is_adaptive = options.adaptive ? 1 : 0;
  if (options.adaptive) device_call.options.adaptive = *options.adaptive;
  device_call.options.quiescent_strain = options.quiescent_strain;
  separate_indices.clear();
  device->plan(device_call);
  under_way = {device, &planned_slots, &increments, nullptr};
  seconds += rve::seconds_since(start);
  return device;
}

/// Fetches the results of the RVEs that have stiffened, except those that the host has already
/// marked as stiffened. If there are many, fetches the results of all RVEs.
template <int D> void RvePointsOf<D>::fetch_results_of_stiffened()
{
  constexpr int MANY = 16;
  std::vector<int> indices = engine->device_calls()->stiffened();
  const bool are_all = indices.size() < rve::DeviceCallsOf<D>::MOST_STIFFENED;
  const auto is_known = [this](int index) { return has_stiffened(device_call.rves[index]); };
  if (are_all)
    indices.erase(std::remove_if(indices.begin(), indices.end(), is_known), indices.end());
  if (indices.size() >= MANY) {
    fetch_results();
    return;
  }
  IncrementCall call(*this, nullptr);
  for (const int index : indices) engine->device_calls()->deliver_one(index, call);
}

template <int D> void RvePointsOf<D>::fetch_results()
{
  if (!std::exchange(results_on_device, false)) return;
  IncrementCall call(*this, nullptr);
  engine->device_calls()->deliver(call);
}

/// Updates is_separate if points have changed.
template <int D> void RvePointsOf<D>::find_separate()
{
  if (!points.is_changed()) return;
  const int count = points.size();
  is_separate.resize(count);
  any_separate = for_each_any(count, threads, [&](int slot) {
    is_separate[slot] = frozen(slot) || copies(slot) > 1;
    return is_separate[slot] != 0;
  });
  points.clear_changed();
}

/// Advances the RVEs with these indices by drives, except frozen ones, and passes on the stresses
/// of all of them. `indices` has few elements.
template <int D>
void RvePointsOf<D>::advance_separately(const Slots &slots, const std::vector<int> &indices,
                                        MacroIncrementsOf<D> &increments, std::vector<int> &failed)
{
  Slots some;
  Drives drives;
  for (const int index : indices) {
    if (frozen(slots[index])) continue;
    some.push_back(slots[index]);
    rve::DriveOf<D> &drive = drives.emplace_back();
    drive.dt = increments.dt;
    drive.substeps = increments.substeps;
    drive.deformation = increments.increment(index);
  }
  if (!some.empty()) {
    const Slots lost = is_plain(some) ? advance_plainly(some, drives)
                                      : advance_by_plan(some, drives);
    for (const int index : indices)
      if (std::find(lost.begin(), lost.end(), slots[index]) != lost.end()) failed.push_back(index);
  }
  for (const int index : indices) increments.take_stress(index, stress(slots[index]));
}

/// Repeats the failed increment of each RVE whose cell is too narrow, with copies of the RVE side
/// by side. Freezes all RVEs that still fail.
template <int D> void RvePointsOf<D>::end_failures(IncrementCall &call, std::vector<int> &failed)
{
  auto failures = std::exchange(call.failed, {});
  std::sort(failures.begin(), failures.end(),
            [](const auto &one, const auto &other) { return one.m < other.m; });
  Slots slots;
  Drives drives;
  std::vector<rve::ResponseOf<D>> answers;
  for (const auto &one : failures) {
    slots.push_back(call_slots[one.m]);
    drives.push_back(one.increment.drive());
    answers.push_back(one.response);
  }
  widen_and_repeat(slots, drives, answers);
  for (std::size_t k = 0; k < slots.size(); ++k)
    call.take_one(failures[k].m, failures[k].increment, answers[k]);
  for (const auto &one : call.failed) {
    freeze(call_slots[one.m], one.response.status);
    failed.push_back(call.index(one.m));
  }
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
