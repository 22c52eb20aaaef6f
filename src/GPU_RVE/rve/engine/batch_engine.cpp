// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/batch_engine.h"

#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/engine/answers.h"
#include "rve/engine/cell_width.h"
#include "rve/engine/drive_record.h"
#include "rve/engine/force_bounds.h"
#include "rve/physics/laws/law.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <new>
#include <omp.h>
#include <utility>

namespace rve {

namespace {

  /// Largest number of repetitions of a call before the RVE fails. Each repetition coarsens the
  /// force scale by a factor of 16. Eight repetitions, a factor of 16^8, correct any initial guess.
  constexpr int MAX_REPEATS = 8;

  /// Returns the number of host threads that convert data between the caller and the records.
  int helpers(const Options &options)
  {
    return options.threads > 0 ? options.threads : omp_get_max_threads();
  }

  /// Number of RVEs that a thread converts at a time. The increments and answers of so many RVEs
  /// fit into the caches of a core.
  constexpr int RVES_OF_PART = 64;

  /// Calls f(begin, end) for parts of the present thread's share of `count` items.
  template <class F> void for_parts(int count, const F &f)
  {
    const ThreadShare mine(count);
    for (int begin = mine.begin; begin < mine.end; begin += RVES_OF_PART)
      f(begin, std::min(begin + RVES_OF_PART, mine.end));
  }

  template <int D> auto drives_at(const std::vector<DriveOf<D>> &drives)
  {
    return [&drives](std::size_t index) { return drives[index]; };
  }

  BatchConstants to_constants(const Options &options)
  {
    require(std::isfinite(options.skin) && options.skin >= 0.0,
            "skin must be 0 (automatic) or positive, got ", options.skin, " [length]");
    require(options.overlap_limit > 0.0 && options.overlap_limit < 1.0,
            "overlap limit must be in (0, 1), got ", options.overlap_limit);
    require(options.threads >= 0, "threads must be 0 (automatic) or more, got ", options.threads);
    require_threads(helpers(options));
    return {options.skin, options.overlap_limit, options.arms == Arms::Contact ? 0.5 : 0.0,
            options.track_energy ? 1 : 0, 0};
  }

}    // namespace

template <int D>
BatchEngine<D>::BatchEngine(const Options &options_in) :
    options(options_in), constants(to_constants(options_in)),
    memory_layout(memory_variant(options_in.contacts))
{
  needs.dashpots = options.arms == Arms::Lammps;    // these arms need a variant with dashpots
  needs.has_bookkeeping = options.track_energy;
}

template <int D>
std::unique_ptr<EngineOf<D>> BatchEngine<D>::empty_with(const ContactModel &contacts) const
{
  Options other = options;
  other.contacts = contacts;
  std::unique_ptr<BatchEngine<D>> engine = make_alike(other);
  engine->pairs_per_grain = pairs_per_grain;
  return engine;
}

template <int D> KernelVariant BatchEngine<D>::usual_variant() const
{
  CallNeeds usual;
  usual.friction = features_of(memory_layout).has.friction;
  return choose_variant(memory_layout, usual);
}

template <int D> void BatchEngine<D>::require_contacts(const ContactModel &needed) const
{
  require(contacts().serves(needed), "the RVE has ", to_string(needed),
          ", but the engine was created for RVEs with ", to_string(contacts()));
}

template <int D> void BatchEngine<D>::note_needs(const Material &material)
{
  needs.dashpots = needs.dashpots || is_viscous(material);
  needs.has_bookkeeping = needs.has_bookkeeping || all_forces_count(material);
  needs.friction = needs.friction || material.friction > 0.0;
  needs.rescaling = needs.rescaling ||
      (features_of(memory_layout).has.rescaling && material.mindlin_displacement != 0.0);
}

template <int D> int BatchEngine<D>::add(const RveStateOf<D> &state)
{
  state.check();
  const auto [smallest, largest] = std::minmax_element(state.radius.begin(), state.radius.end());
  require(neighbor_bits<D>(*smallest, *largest, state.material) <= LARGEST_NEIGHBOR_BITS,
          "ratio of largest to smallest radius must be at most ",
          largest_size_ratio<D>(reach_of(state.material) > 0.0), ", got ", *largest / *smallest);
  require_contacts(contacts_of(state));
  const int n = state.num_grains();
  const bool is_new = free_numbers.empty();
  const int rve = is_new ? static_cast<int>(grains_of.size()) : free_numbers.back();
  put_device_state(rve, device_state_of(state));
  if (is_new) {
    grains_of.push_back(n);
  } else {
    free_numbers.pop_back();
    grains_of[rve] = n;
  }
  note_needs(state.material);
  needs.friction = needs.friction ||
      std::any_of(state.pairs.begin(), state.pairs.end(),
                  [](const PairOf<D> &pair) { return magnitude(pair.tangential_force) != 0.0; });
  return rve;
}

template <int D> void BatchEngine<D>::remove(int rve)
{
  check_slot(rve);
  drop_device_state(rve);
  grains_of[rve] = 0;
  free_numbers.push_back(rve);
}

namespace {

  /// Returns the margin of lists with the default skin, without the reach of the material [length].
  template <int D> double default_list_margin(const RveStateOf<D> &state)
  {
    return list_margin_of(state, 0.0) - reach_of(state.material);
  }

}    // namespace

template <int D> DeviceState BatchEngine<D>::device_state_of(const RveStateOf<D> &state) const
{
  const auto with = [&](const RveStateOf<D> &one) {
    return build_device_state(options.format, one, initial_extra_capacity<D>(one.num_grains()),
                              memory_layout);    // may throw std::bad_alloc
  };
  if (state.list_fractional.empty()) return with(state);
  const double has = state.list_margin > 0.0 ? state.list_margin : default_list_margin(state);
  // Radii are rounded to the number format.
  constexpr double ROUNDING = 1e-6;
  if (has >= (1.0 - ROUNDING) * list_margin_of(state, options.skin)) return with(state);
  RveStateOf<D> without_list = state;
  without_list.forget_list();
  return with(without_list);
}

template <int D> RveStateOf<D> BatchEngine<D>::state(int rve) const
{
  check_slot(rve);
  RveStateOf<D> state = read_device_state<D>(options.format, get_device_state(rve), memory_layout);
  if (!state.list_fractional.empty()) {
    const double margin = list_margin_of(state, options.skin);
    state.list_margin = margin == default_list_margin(state) ? 0.0 : margin;
  }
  return state;
}

template <int D> void BatchEngine<D>::set_material(int rve, const Material &material)
{
  check_slot(rve);
  RveStateOf<D> probe = state(rve);
  const double reach_before = reach_of(probe.material);
  probe.material = material;
  probe.check();
  ContactModel need = contacts_of(material);
  need.dimension = D;
  require_contacts(need);
  if (reach_of(material) == reach_before) {
    StateHeader<D> header = get_header(rve);
    set_material_in(header, material);
    put_header(rve, header);
  } else {    // a change of reach needs another list and another capacity of the sums
    const DeviceState device_state = device_state_of(probe);
    drop_device_state(rve);
    put_device_state(rve, device_state);
  }
  note_needs(material);
}

template <int D>
void BatchEngine<D>::turn(const std::vector<int> &rves,
                          const std::vector<Tensor<double, D>> &rotations)
{
  require(rves.size() == rotations.size(), "number of rotations must be that of the RVEs, ",
          rves.size(), ", got ", rotations.size());
  for (std::size_t k = 0; k < rves.size(); ++k) {
    check_slot(rves[k]);
    const Tensor<double, D> &r = rotations[k];
    const Tensor<double, D> error = transpose(r) * r - Tensor<double, D>::identity();
    require(std::all_of(std::begin(error.component), std::end(error.component),
                        [](double x) { return std::fabs(x) < 1e-12; }) &&
                determinant(r) > 0.0,
            "tensor that rotates an RVE must be orthogonal with a positive determinant");
  }
  if (!rves.empty()) turn_device_states(rves, rotations);
}

template <int D> std::size_t BatchEngine<D>::bytes_per_rve(int num_grains) const
{
  return device_state_bytes<D>(options.format, num_grains, initial_extra_capacity<D>(num_grains),
                               memory_layout);
}

template <int D> Memory BatchEngine<D>::memory() const
{
  Memory memory = backend_memory();
  const char *word = std::getenv("GPU_RVE_MEMORY_LIMIT");
  if (!word || !*word) return memory;
  char *end = nullptr;
  const double limit = std::strtod(word, &end);
  // A double above 2^53 does not resolve single bytes.
  require(*end == '\0' && limit >= 0.0 && limit <= 9007199254740992.0,
          "GPU_RVE_MEMORY_LIMIT in the environment must be a number of bytes in [0, 2^53], got ",
          word);
  const std::size_t bytes = static_cast<std::size_t>(limit);
  memory.free = memory.is_known ? std::min(memory.free, bytes) : bytes;
  memory.is_known = true;
  return memory;
}

template <int D> bool BatchEngine<D>::is_there(int rve) const
{
  return rve >= 0 && rve < static_cast<int>(grains_of.size()) && grains_of[rve] > 0;
}

template <int D> void BatchEngine<D>::check_slot(int rve) const
{
  require(is_there(rve), "there is no RVE with number ", rve);
}

template <int D> ResponseOf<D> BatchEngine<D>::to_response(const AnswerRecord<D> &answer)
{
  return {answer.status, answer.num_contacts, answer.peak_force, load_tensor<D>(answer.stress)};
}

template <int D> void BatchEngine<D>::require_nothing_under_way() const
{
  require(!increment_request.is_running(),
          "a call of the engine is still running; it must be finished before the next one");
}

template <int D> void BatchEngine<D>::prepare_repeat(int rve, const AnswerRecord<D> &result)
{
  StateHeader<D> header = get_header(rve);
  ++header.repeats;
  if (result.status & status::ForceSaturated)
    header.largest_contact_force = 16.0 * result.expected_force;
  put_header(rve, header);
  if (result.needed_extra > header.extra_capacity) {
    const DeviceState old = get_device_state(rve);
    const RveStateOf<D> state = read_device_state<D>(options.format, old, memory_layout);
    drop_device_state(rve);
    put_device_state(rve,
                     build_device_state(options.format, state,
                                        result.needed_extra + result.needed_extra / 4 + 8,
                                        memory_layout));
  }
  pairs_per_grain = std::max(pairs_per_grain,
                             (result.needed_pairs + result.needed_pairs / 4) / grains_of[rve] + 1);
}

template <int D>
void BatchEngine<D>::prepare(Call &call, const std::vector<int> &rves,
                             const std::vector<DriveOf<D>> &drives, Answer kind)
{
  const int count = static_cast<int>(rves.size());
  DriveRecord<D> *records = drive_buffer(count);
  call.rves = &rves;
  call.drives = records;
  costs.resize(count);
  Extent extent;
  int first_bad = count;
  bool servo = false, steered = false, by_modes = false;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel num_threads(work.team) reduction(min          \
                                                      : first_bad) \
    reduction(||                                                   \
              : servo, steered, by_modes)
    {
      Extent mine;
#pragma omp for
      for (int k = 0; k < count; ++k) {
        const DriveOf<D> &drive = drives[k];
        if (!is_there(rves[k]) || !is_simple(drive)) {
          try {
            check_slot(rves[k]);
            check(drive);
          } catch (const InputError &) {
            first_bad = std::min(first_bad, k);
            continue;
          }
          servo = servo || drive.has_servo();
          steered = steered || needs_steering(drive);
          by_modes = by_modes || drive.num_modes > 0;
        }
        new (records + k) DriveRecord<D>(to_record(drive));
        costs[k] = cost_of(grains_of[rves[k]], drive.substeps);
        mine.add(grains_of[rves[k]], drive.substeps);
      }
#pragma omp critical(extent_of_a_call)
      extent.add(mine);
    }
  }
  if (first_bad < count) {    // throws InputError
    check_slot(rves[first_bad]);
    check(drives[first_bad]);
  }
  if (steered) {
    call.steering.resize(count);
    for (int k = 0; k < count; ++k) call.steering[k] = to_steering(drives[k], records[k]);
  }
  if (by_modes) {
    call.modes.resize(count);
    for (int k = 0; k < count; ++k) {
      if (drives[k].num_modes == 0) continue;
      call.modes[k] = to_modes(drives[k]);
      call.steering[k].modes = &call.modes[k];
    }
  }
  plan(call, extent, servo, kind);
}

template <int D>
void BatchEngine<D>::plan(Call &call, const Extent &extent, bool servo, Answer kind)
{
  call.num_rves = static_cast<int>(call.rves->size());
  call.largest = extent.largest;
  call.longest = extent.longest;
  call.mean = static_cast<double>(extent.steps) / call.num_rves;
  call.pair_capacity = pair_capacity(extent.largest);
  CallNeeds call_needs = needs;
  call_needs.servo = servo;
  call_needs.has_bookkeeping = needs.has_bookkeeping || kind == Answer::TimeStep;
  call.variant = choose_variant(memory_layout, call_needs);
  call.constants = constants;
  if (extent.least_cost < extent.most_cost) put_longest_first(call, extent.most_cost);
}

template <int D>
typename BatchEngine<D>::Call
BatchEngine<D>::call_of_increments(const std::vector<int> &rves, int largest, int longest,
                                   std::int64_t steps, int num_details)
{
  Call call;
  call.rves = &rves;
  Extent extent;
  extent.largest = largest;
  extent.longest = longest;
  extent.steps = steps;
  plan(call, extent, false, Answer::Short);
  if (num_details > 0) request_evaluations(call, num_details);
  return call;
}

template <int D> void BatchEngine<D>::request_evaluations(Call &call, int num_details)
{
  call.with_details = true;
  call.num_details = num_details;
  call.constants.extra_detail = kStiffnessDetail;
}

template <int D> void BatchEngine<D>::put_longest_first(Call &call, double most_cost)
{
  // The counting sort is coarse: only the last RVEs to run must be short.
  constexpr int classes = 256;
  const int count = call.num_rves;
  cost_class.resize(count);
  order.resize(count);
  const LightWork work(count, helpers(options));
  class_begin.assign(static_cast<std::size_t>(classes) * work.team, 0);
#pragma omp parallel num_threads(work.team)
  {
    const ThreadShare mine(count);
    int *const begin = &class_begin[static_cast<std::size_t>(classes) * this_thread()];
    for (int k = mine.begin; k < mine.end; ++k) {
      const double share = costs[k] / most_cost;
      cost_class[k] =
          static_cast<unsigned char>(classes - 1 - static_cast<int>(share * (classes - 1)));
      ++begin[cost_class[k]];
    }
#pragma omp barrier
#pragma omp single
    {
      int next = 0;
      for (int c = 0; c < classes; ++c)
        for (int thread = 0; thread < team_size(); ++thread) {
          int &first = class_begin[static_cast<std::size_t>(classes) * thread + c];
          next += std::exchange(first, next);
        }
    }
    for (int k = mine.begin; k < mine.end; ++k) order[begin[cost_class[k]]++] = k;
  }
  call.order = &order;
}

template <int D>
typename BatchEngine<D>::Answers BatchEngine<D>::start(const std::vector<int> &rves,
                                                       const std::vector<DriveOf<D>> &drives,
                                                       Answer kind)
{
  require(rves.size() == drives.size(), "number of prescribed motions must be that of the RVEs, ",
          rves.size(), ", got ", drives.size());
  if (rves.empty()) return {};
  require_nothing_under_way();
  Call call;
  prepare(call, rves, drives, kind);
  call.with_details = kind != Answer::Short;
  if (kind == Answer::Longest) call.constants.extra_detail = kStiffnessDetail;
  if (kind == Answer::TimeStep) call.constants.extra_detail = kTimeStepDetail;
  const Answers answers = begin_launch(call);
  end_launch();
  return answers;
}

template <int D>
typename BatchEngine<D>::Answers BatchEngine<D>::repeat(const std::vector<int> &rves,
                                                        const DriveAt &drive_at,
                                                        const Answers &first, Answer kind)
{
  const std::size_t count = rves.size();
  repeated.assign(first.answers, first.answers + count);
  repeated_details.assign(kind == Answer::Short ? 0 : count, DetailRecord<D>());
  if (first.details) std::copy_n(first.details, count, repeated_details.begin());
  std::map<std::size_t, StateHeader<D>> before;    // headers of repeated RVEs
  for (int round = 0; round < MAX_REPEATS; ++round) {
    std::vector<std::size_t> again;
    for (std::size_t k = 0; k < count; ++k)
      if (must_repeat(repeated[k])) again.push_back(k);
    if (again.empty()) break;
    std::vector<int> some_rves;
    std::vector<DriveOf<D>> some_drives;
    for (std::size_t k : again) {
      before.emplace(k, get_header(rves[k]));
      prepare_repeat(rves[k], repeated[k]);
      some_rves.push_back(rves[k]);
      some_drives.push_back(drive_at(k));
    }
    const Answers some = start(some_rves, some_drives, kind);
    for (std::size_t m = 0; m < again.size(); ++m) {
      repeated[again[m]] = some.answers[m];
      if (some.details) repeated_details[again[m]] = some.details[m];
    }
  }

  // If the call of an RVE fails in spite of the repetitions, the header gets back its former
  // values.
  for (const auto &[k, header_before] : before) {
    if (!(repeated[k].status & status::Fatal)) continue;
    StateHeader<D> header = get_header(rves[k]);
    header.repeats = header_before.repeats;
    header.largest_contact_force = header_before.largest_contact_force;
    put_header(rves[k], header);
  }
  return {repeated.data(), kind == Answer::Short ? nullptr : repeated_details.data()};
}

template <int D>
template <class AnyResult>
void BatchEngine<D>::advance_with_details(const std::vector<int> &rves,
                                          const std::vector<DriveOf<D>> &drives, Answer kind,
                                          std::vector<AnyResult> &results)
{
  Answers all = start(rves, drives, kind);
  const int count = static_cast<int>(rves.size());
  if (std::any_of(all.answers, all.answers + count, must_repeat<D>))
    all = repeat(rves, drives_at(drives), all, kind);
  results.resize(count);
  bool any_failed = false;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(|| : any_failed)
    for (int k = 0; k < count; ++k) {
      if (all.answers[k].status & status::Fatal)
        any_failed = true;
      else
        to_result(all.answers[k], all.details[k], results[k]);
    }
  }
  for (int k = 0; any_failed && k < count; ++k)
    if (all.answers[k].status & status::Fatal)
      to_result(all.answers[k], details_of(get_header(rves[k])), results[k]);
}

template <int D>
void BatchEngine<D>::advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                             std::vector<ResultOf<D>> &results)
{
  advance_with_details(rves, drives, Answer::Long, results);
}

template <int D>
void BatchEngine<D>::advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                             std::vector<ElasticResultOf<D>> &results)
{
  advance_with_details(rves, drives, Answer::Longest, results);
}

template <int D>
void BatchEngine<D>::bound_time_steps(const std::vector<int> &rves, double enough,
                                      std::vector<double> &bounds)
{
  require(std::isfinite(enough) && enough > 0.0,
          "a sufficient time step must be positive and finite, got ", enough, " [time]");
  DriveOf<D> evaluation;
  evaluation.dt = enough;
  // The array is kept, since it is large and `enough` rarely changes from call to call.
  if (!drives_of_bounds.empty() && drives_of_bounds.front().dt != enough) drives_of_bounds.clear();
  drives_of_bounds.resize(rves.size(), evaluation);
  Answers all = start(rves, drives_of_bounds, Answer::TimeStep);
  const int count = static_cast<int>(rves.size());
  if (std::any_of(all.answers, all.answers + count, must_repeat<D>))
    all = repeat(rves, drives_at(drives_of_bounds), all, Answer::TimeStep);
  bounds.resize(count);
  const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k)
    bounds[k] = all.answers[k].status & status::Fatal ? 0.0 : all.details[k].stiffness[0];
}

template <int D>
void BatchEngine<D>::advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                             std::vector<ResponseOf<D>> &responses)
{
  Answers all = start(rves, drives, Answer::Short);
  const int count = static_cast<int>(rves.size());
  responses.resize(count);
  const auto respond = [&] {
    bool unfinished = false;
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(|| : unfinished)
    for (int k = 0; k < count; ++k) {
      responses[k] = to_response(all.answers[k]);
      unfinished = unfinished || must_repeat(all.answers[k]);
    }
    return unfinished;
  };
  if (!respond()) return;
  all = repeat(rves, drives_at(drives), all, Answer::Short);
  respond();
}

template <int D>
Request *BatchEngine<D>::begin(const std::vector<int> &rves, IncrementCallOf<D> &caller)
{
  require_nothing_under_way();
  const int count = static_cast<int>(rves.size());
  if (count == 0) return &increment_request;
  Call call;
  DriveRecord<D> *records = drive_buffer(count);
  call.rves = &rves;
  call.drives = records;
  costs.resize(count);
  increments.resize(count);
  Extent extent;
  bool all_serve = true;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel num_threads(work.team) reduction(&& : all_serve)
    {
      Extent mine;
      for_parts(count, [&](int begin, int end) {
        all_serve = all_serve && caller.give(begin, end, &increments[begin]);
        for (int k = begin; all_serve && k < end; ++k) {
          const IncrementOf<D> &one = increments[k];
          all_serve = is_there(rves[k]) && is_simple(one);
          if (!all_serve) break;
          new (records + k) DriveRecord<D>(to_record(one));
          costs[k] = cost_of(grains_of[rves[k]], one.substeps);
          mine.add(grains_of[rves[k]], one.substeps);
        }
      });
#pragma omp critical(extent_of_a_call)
      extent.add(mine);
    }
  }
  if (!all_serve) return nullptr;
  plan(call, extent, false, Answer::Short);
  number_evaluations(call);
  caller.begin();
  increment_request.set(rves, caller, begin_launch(call));
  return &increment_request;
}

/// Numbers the details of the RVEs whose increments request diagnostic evaluations.
template <int D> void BatchEngine<D>::number_evaluations(Call &call)
{
  detail_of.clear();
  int evaluations = 0;
  for (const IncrementOf<D> &one : increments)
    detail_of.push_back(one.is_evaluated ? evaluations++ : -1);
  if (evaluations == 0) return;
  request_evaluations(call, evaluations);
  call.detail_of = &detail_of;
}

template <int D>
void BatchEngine<D>::IncrementRequest::set(const std::vector<int> &rves, IncrementCallOf<D> &caller,
                                           const Answers &first)
{
  rves_ = &rves;
  caller_ = &caller;
  first_ = first;
  this->note_launch();
}

template <int D> StressesAre BatchEngine<D>::IncrementRequest::wait()
{
  engine_.end_launch();
  engine_.answer(*rves_, *caller_, first_);
  return StressesAre::OnHost;
}

template <int D>
void BatchEngine<D>::answer(const std::vector<int> &rves, IncrementCallOf<D> &caller,
                            const Answers &first)
{
  const int count = static_cast<int>(rves.size());
  std::vector<int> again;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel num_threads(work.team)
    for_parts(count, [&](int begin, int end) {
      ResponseOf<D> some[RVES_OF_PART];
      bool is_whole = true;
      for (int k = begin; k < end; ++k) {
        some[k - begin] = to_response(first.answers[k]);
        is_whole = is_whole && !must_repeat(first.answers[k]);
      }
      if (is_whole) {
        caller.take(begin, end, &increments[begin], some);
        return;
      }
      for (int k = begin; k < end; ++k) {
        if (!must_repeat(first.answers[k])) {
          caller.take(k, k + 1, &increments[k], &some[k - begin]);
          continue;
        }
#pragma omp critical(calls_to_repeat)
        again.push_back(k);
      }
    });
  }
  if (first.details) {
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k)
      if (increments[k].is_evaluated && is_sound(first.answers[k]))
        caller.take_evaluation(k, to_evaluation(first.details[detail_of[k]]));
  }
  if (again.empty()) return;
  const bool evaluations =
      std::any_of(again.begin(), again.end(), [this](int k) { return increments[k].is_evaluated; });
  const Answers last = repeat(
      rves, [this](std::size_t index) { return increments[index].drive(); },
      {first.answers, nullptr}, evaluations ? Answer::Longest : Answer::Short);
  for (const int k : again) {
    const ResponseOf<D> one = to_response(last.answers[k]);
    caller.take(k, k + 1, &increments[k], &one);
    if (increments[k].is_evaluated && is_sound(last.answers[k]))
      caller.take_evaluation(k, to_evaluation(last.details[k]));
  }
}

template <int D>
void BatchEngine<D>::report_rest(int count, const Rest *rest, const QuiescentStateOf<D> *states,
                                 IncrementCallOf<D> &caller) const
{
  const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k) {
    if (rest[k] == Rest::Unknown) continue;
    const QuiescentStateOf<D> &state = states[k];
    caller.take_evaluation(k, {may_stay_quiescent(rest[k]), state.mean_overlap, state.stiffness});
    if (has_deferred(rest[k])) caller.take_deferred(k, state.pending);
  }
}

template class BatchEngine<2>;
template class BatchEngine<3>;

}    // namespace rve
