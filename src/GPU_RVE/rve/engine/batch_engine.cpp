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
#include <limits>
#include <map>
#include <numeric>
#include <omp.h>

namespace rve {

namespace {

  /// A call is repeated with a coarser force scale this often, by 16 each time, before the RVE fails: 16^8 covers any guess.
  constexpr int MAX_REPEATS = 8;

  /// Threads that may translate between the caller and the RVEs.
  int helpers(const Options &options)
  {
    return options.threads > 0 ? options.threads : omp_get_max_threads();
  }

  BatchConstants to_constants(const Options &options)
  {
    require(std::isfinite(options.skin) && options.skin >= 0.0,
            "skin must be 0 (automatic) or positive, got " + number(options.skin) + " [length]");
    require(options.overlap_limit > 0.0 && options.overlap_limit < 1.0,
            "overlap limit must be in (0, 1), got " + number(options.overlap_limit));
    require(options.threads >= 0,
            "threads must be 0 (automatic) or more, got " + std::to_string(options.threads));
    require_threads(helpers(options));
    return {options.skin, options.overlap_limit, options.arms == Arms::Contact ? 0.5 : 0.0,
            options.track_energy ? 1 : 0, 0};
  }

}    // namespace

template <int D>
BatchEngine<D>::BatchEngine(const Options &options_in) :
    options(options_in), constants(to_constants(options_in)),
    memory_layout(memory_program(options_in.contacts))
{
  needs.dashpots = options.arms == Arms::Lammps;    // compiled in with them
  needs.books = options.track_energy;
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

template <int D> Program BatchEngine<D>::usual_program() const
{
  CallNeeds usual;
  usual.friction = features_of(memory_layout).has.friction;
  return choose_program(memory_layout, usual);
}

template <int D> void BatchEngine<D>::require_contacts(const ContactModel &needed) const
{
  require(contacts().serves(needed), [&] {
    return "the RVE has " + to_string(needed) + ", and the engine was made for RVEs with " +
        to_string(contacts());
  });
}

template <int D> void BatchEngine<D>::note_needs(const Material &material)
{
  needs.dashpots = needs.dashpots || is_viscous(material);
  needs.books = needs.books || all_forces_count(material);
  needs.friction = needs.friction || material.friction > 0.0;
}

template <int D> int BatchEngine<D>::add(const RveStateOf<D> &state)
{
  state.check();
  const auto [smallest, largest] = std::minmax_element(state.radius.begin(), state.radius.end());
  require(neighbor_bits<D>(*smallest, *largest, state.material) <= LARGEST_NEIGHBOR_BITS,
          [&, this] {
            return "the largest grain must be at most " +
                number(largest_size_ratio<D>(reach_of(state.material) > 0.0)) +
                " times as large as the smallest, got " + number(*largest / *smallest);
          });
  require_contacts(contacts_of(state));
  const int n = state.num_grains();
  const bool is_new = free_numbers.empty();
  const int rve = is_new ? static_cast<int>(grains_of.size()) : free_numbers.back();
  put_image(rve, image_of(state));
  if (is_new) {
    grains_of.push_back(n);
  } else {
    free_numbers.pop_back();
    grains_of[rve] = n;
  }
  note_needs(state.material);
  needs.friction = needs.friction ||
      std::any_of(state.pairs.begin(), state.pairs.end(), [](const PairOf<D> &pair) {
                     return magnitude(pair.tangential_force) != 0.0;
                   });
  return rve;
}

template <int D> void BatchEngine<D>::remove(int rve)
{
  check_slot(rve);
  drop_image(rve);
  grains_of[rve] = 0;
  free_numbers.push_back(rve);
}

template <int D> int BatchEngine<D>::size() const
{
  return static_cast<int>(grains_of.size() - free_numbers.size());
}

namespace {

  /// Of lists with the skin of the mean radius, for contacts that do not reach farther.
  template <int D> double default_list_margin(const RveStateOf<D> &state)
  {
    return list_margin_of(state, 0.0) - reach_of(state.material);
  }

}    // namespace

template <int D> StateImage BatchEngine<D>::image_of(const RveStateOf<D> &state) const
{
  const auto with = [&](const RveStateOf<D> &one) {
    return build_image(options.format, one, initial_extra_capacity<D>(one.num_grains()),
                       memory_layout);    // may find no memory
  };
  if (state.list_fractional.empty()) return with(state);
  const double has = state.list_margin > 0.0 ? state.list_margin : default_list_margin(state);
  // radii are rounded to the format
  constexpr double ROUNDING = 1e-6;
  if (has >= (1.0 - ROUNDING) * list_margin_of(state, options.skin)) return with(state);
  RveStateOf<D> without_list = state;
  without_list.forget_list();
  return with(without_list);
}

template <int D> RveStateOf<D> BatchEngine<D>::state(int rve) const
{
  check_slot(rve);
  RveStateOf<D> state = read_image<D>(options.format, get_image(rve), memory_layout);
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
    ImageHeader<D> header = get_header(rve);
    set_material_in(header, material);
    put_header(rve, header);
  } else {    // neither its list nor the room of its sums serves
    const StateImage image = image_of(probe);
    drop_image(rve);
    put_image(rve, image);
  }
  note_needs(material);
}

template <int D>
void BatchEngine<D>::turn(const std::vector<int> &rves,
                          const std::vector<Tensor<double, D>> &rotations)
{
  require(rves.size() == rotations.size(),
          "one rotation per RVE is needed: " + std::to_string(rves.size()) + " RVEs, " +
              std::to_string(rotations.size()) + " rotations");
  for (std::size_t k = 0; k < rves.size(); ++k) {
    check_slot(rves[k]);
    const Tensor<double, D> &r = rotations[k];
    const Tensor<double, D> error = transpose(r) * r - Tensor<double, D>::identity();
    require(std::all_of(std::begin(error.component), std::end(error.component),
                        [](double x) {
                          return std::fabs(x) < 1e-12;
                        }) &&
                determinant(r) > 0.0,
            "an RVE can be turned by a rotation only, and the tensor is none");
  }
  if (!rves.empty()) turn_images(rves, rotations);
}

template <int D> std::size_t BatchEngine<D>::bytes_per_rve(int num_grains) const
{
  return image_bytes<D>(options.format, num_grains, initial_extra_capacity<D>(num_grains),
                        memory_layout);
}

template <int D> Memory BatchEngine<D>::memory() const
{
  Memory memory = backend_memory();
  const char *word = std::getenv("GPU_RVE_MEMORY_LIMIT");
  if (!word || !*word) return memory;
  char *end = nullptr;
  const double limit = std::strtod(word, &end);
  // beyond 2^53 a double does not count single bytes any more
  require(*end == '\0' && limit >= 0.0 && limit <= 9007199254740992.0,
          "GPU_RVE_MEMORY_LIMIT in the environment must be a number of bytes in [0, 2^53], got " +
              std::string(word));
  const std::size_t bytes = static_cast<std::size_t>(limit);
  memory.free = memory.is_known ? std::min(memory.free, bytes) : bytes;
  memory.is_known = true;
  return memory;
}

template <int D> void BatchEngine<D>::check_slot(int rve) const
{
  require(rve >= 0 && rve < static_cast<int>(grains_of.size()) && grains_of[rve] > 0, [&] {
    return "there is no RVE with number " + std::to_string(rve);
  });
}

template <int D> void BatchEngine<D>::prepare_repeat(int rve, const AnswerRecord<D> &result)
{
  ImageHeader<D> header = get_header(rve);
  ++header.repeats;
  if (result.status & status::ForceSaturated)
    header.largest_contact_force = 16.0 * result.expected_force;
  put_header(rve, header);
  if (result.needed_extra > header.extra_capacity) {
    const StateImage old = get_image(rve);
    const RveStateOf<D> state = read_image<D>(options.format, old, memory_layout);
    drop_image(rve);
    put_image(rve,
              build_image(options.format, state, result.needed_extra + result.needed_extra / 4 + 8,
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
  DriveRecord<D> *records = room_for_drives(count);
  call.rves = &rves;
  call.drives = records;
  int first_bad = count, largest = 0, longest = 0;
  std::int64_t all_substeps = 0;
  double least_cost = std::numeric_limits<double>::max(), most_cost = 0.0;
  bool servo = false, steered = false, by_modes = false;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(min                      \
                                                          : first_bad, least_cost) \
    reduction(max                                                                  \
              : largest, longest, most_cost) reduction(+                           \
                                                       : all_substeps)             \
        reduction(||                                                               \
                  : servo, steered, by_modes)
    for (int k = 0; k < count; ++k) {
      try {
        check_slot(rves[k]);
        check(drives[k]);
      } catch (const InputError &) {
        first_bad = std::min(first_bad, k);
        continue;
      }
      records[k] = to_record(drives[k]);
      largest = std::max(largest, grains_of[rves[k]]);
      longest = std::max(longest, drives[k].substeps);
      all_substeps += drives[k].substeps;
      const double cost = cost_of(rves[k], drives[k]);
      least_cost = std::min(least_cost, cost);
      most_cost = std::max(most_cost, cost);
      servo = servo || drives[k].has_servo();
      steered = steered || needs_steering(drives[k]);
      by_modes = by_modes || drives[k].num_modes > 0;
    }
  }
  if (first_bad < count) {    // says what is wrong
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
  call.largest = largest;
  call.longest = longest;
  call.mean = static_cast<double>(all_substeps) / count;
  call.pair_capacity = pair_capacity(largest);
  CallNeeds call_needs = needs;
  call_needs.servo = servo;
  call_needs.books = needs.books || kind == Answer::TimeStep;
  call.program = choose_program(memory_layout, call_needs);
  if (least_cost < most_cost) put_longest_first(call, drives, most_cost);
}

template <int D> double BatchEngine<D>::cost_of(int rve, const DriveOf<D> &drive) const
{
  return static_cast<double>(drive.substeps) * grains_of[rve];
}

template <int D>
void BatchEngine<D>::put_longest_first(Call &call, const std::vector<DriveOf<D>> &drives,
                                       double most_cost)
{
  // sorted roughly, in one pass: the last ones to run are short, and that is all that matters
  constexpr int classes = 256;
  const int count = static_cast<int>(call.rves->size());
  cost_class.resize(count);
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k) {
      const double share = cost_of((*call.rves)[k], drives[k]) / most_cost;
      cost_class[k] =
          static_cast<unsigned char>(classes - 1 - static_cast<int>(share * (classes - 1)));
    }
  }
  int start[classes + 1] = {};
  for (int k = 0; k < count; ++k) ++start[cost_class[k] + 1];
  std::partial_sum(start, start + classes + 1, start);
  call.order.resize(count);
  for (int k = 0; k < count; ++k) call.order[start[cost_class[k]]++] = k;
}

template <int D>
const AnswerRecord<D> *BatchEngine<D>::start(const std::vector<int> &rves,
                                             const std::vector<DriveOf<D>> &drives, Answer kind)
{
  require(rves.size() == drives.size(),
          "one drive per RVE is needed: " + std::to_string(rves.size()) + " RVEs, " +
              std::to_string(drives.size()) + " drives");
  if (rves.empty()) return nullptr;
  Call call;
  prepare(call, rves, drives, kind);
  call.with_details = kind != Answer::Short;
  call.constants = constants;
  if (kind == Answer::Longest) call.constants.extra_detail = kStiffnessDetail;
  if (kind == Answer::TimeStep) call.constants.extra_detail = kTimeStepDetail;
  return launch(call, details);
}

template <int D>
const AnswerRecord<D> *BatchEngine<D>::repeat(const std::vector<int> &rves,
                                              const std::vector<DriveOf<D>> &drives,
                                              const AnswerRecord<D> *answers, Answer kind)
{
  const bool with_details = kind != Answer::Short;
  mended.assign(answers, answers + rves.size());
  std::vector<DetailRecord<D>> all_details;    // `details` are those of the last start
  if (with_details) all_details = details;
  std::map<std::size_t, ImageHeader<D>> before;    // of the RVEs whose call is repeated
  for (int round = 0; round < MAX_REPEATS; ++round) {
    std::vector<std::size_t> again;
    for (std::size_t k = 0; k < rves.size(); ++k)
      if (must_repeat(mended[k])) again.push_back(k);
    if (again.empty()) break;
    std::vector<int> some_rves;
    std::vector<DriveOf<D>> some_drives;
    for (std::size_t k : again) {
      before.emplace(k, get_header(rves[k]));
      prepare_repeat(rves[k], mended[k]);
      some_rves.push_back(rves[k]);
      some_drives.push_back(drives[k]);
    }
    const AnswerRecord<D> *some_answers = start(some_rves, some_drives, kind);
    for (std::size_t m = 0; m < again.size(); ++m) {
      mended[again[m]] = some_answers[m];
      if (with_details) all_details[again[m]] = details[m];
    }
  }
  if (with_details) details = std::move(all_details);

  // a call that fails in the end leaves no trace of its repeats either
  for (const auto &[k, first] : before) {
    if (!(mended[k].status & status::Fatal)) continue;
    ImageHeader<D> header = get_header(rves[k]);
    header.repeats = first.repeats;
    header.largest_contact_force = first.largest_contact_force;
    put_header(rves[k], header);
  }
  return mended.data();
}

template <int D>
template <class AnyResult>
void BatchEngine<D>::advance_with_details(const std::vector<int> &rves,
                                          const std::vector<DriveOf<D>> &drives, Answer kind,
                                          std::vector<AnyResult> &results)
{
  const AnswerRecord<D> *answers = start(rves, drives, kind);
  const int count = static_cast<int>(rves.size());
  if (std::any_of(answers, answers + count, must_repeat<D>))
    answers = repeat(rves, drives, answers, kind);
  for (int k = 0; k < count; ++k)
    if (answers[k].status & status::Fatal) details[k] = details_of(get_header(rves[k]));
  results.resize(count);
  const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k) to_result(answers[k], details[k], results[k]);
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
          "a sufficient time step must be positive and finite, got " + number(enough) + " [time]");
  DriveOf<D> look;
  look.dt = enough;
  const std::vector<DriveOf<D>> drives(rves.size(), look);
  const AnswerRecord<D> *answers = start(rves, drives, Answer::TimeStep);
  const std::size_t count = rves.size();
  if (std::any_of(answers, answers + count, must_repeat<D>))
    answers = repeat(rves, drives, answers, Answer::TimeStep);
  bounds.resize(count);
  for (std::size_t k = 0; k < count; ++k)
    bounds[k] = answers[k].status & status::Fatal ? 0.0 : details[k].stiffness[0];
}

template <int D>
void BatchEngine<D>::advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                             std::vector<ResponseOf<D>> &responses)
{
  const AnswerRecord<D> *answers = start(rves, drives, Answer::Short);
  const int count = static_cast<int>(rves.size());
  responses.resize(count);
  const auto respond = [&] {
    bool unfinished = false;
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(|| : unfinished)
    for (int k = 0; k < count; ++k) {
      responses[k] = {answers[k].status, answers[k].num_contacts,
                      load_tensor<D>(answers[k].stress)};
      unfinished = unfinished || must_repeat(answers[k]);
    }
    return unfinished;
  };
  if (!respond()) return;
  answers = repeat(rves, drives, answers, Answer::Short);
  respond();
}

template class BatchEngine<2>;
template class BatchEngine<3>;

}    // namespace rve
