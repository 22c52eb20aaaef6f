// SPDX-License-Identifier: GPL-2.0-only
#include "macro/rve_points.h"

#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/core/wall_time.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "rve/engine/servo_modes.h"

#include <algorithm>

namespace macro {

namespace {

  template <int D> bool is_identity(const rve::Tensor<double, D> &f)
  {
    const auto one = rve::Tensor<double, D>::identity();
    return std::equal(std::begin(f.component), std::end(f.component), one.component);
  }

  template <int D> typename RvePointsOf<D>::Point::Look look_of(const rve::ElasticResultOf<D> &look)
  {
    return {look.result.unbalanced_ratio <= rve::QUIET_UNBALANCED_RATIO, look.result.mean_overlap,
            look.stiffness};
  }

  /// What a default gain of the servo is proportional to, of what a material says.
  double gain_factor(const rve::Material &material)
  {
    return material.thickness / (material.density * material.mass_depth);
  }

}    // namespace

template <int D> double RvePointsOf<D>::Point::strain_rate() const
{
  if (drive.substeps == 0) return 0.0;
  if (drive.has_servo())
    return std::max(rve::norm(last_steps().servo_velocity_gradient),
                    rve::norm(drive.velocity_gradient));
  return rve::strain_size(drive.deformation) / (drive.substeps * drive.dt);
}

template <int D> void RvePointsOf<D>::Point::note(const rve::DriveOf<D> &last)
{
  drive = last;
  drive.modes = nullptr;    // they live elsewhere
  servo_error = last.has_servo() ? rve::servo_error(last, result.stress) : 0.0;
}

template <int D>
void RvePointsOf<D>::Point::hear(const rve::ResponseOf<D> &response, const rve::DriveOf<D> &last)
{
  state = State::Awake;
  result.status = response.status;
  result.stress = response.stress;
  stale = true;
  contacts = response.num_contacts;
  peak_force = response.peak_force;
  look.reset();
  if (last.substeps == 0) return;
  pending = Matrix::identity();
  note(last);
}

template <int D> rve::SleepOf<D> RvePointsOf<D>::Point::sleep() const
{
  return {pending, last_steps().stress,
          look && look->stiffness ? *look->stiffness : rve::AffineStiffnessOf<D>(), mean_overlap()};
}

template <int D> rve::Rest RvePointsOf<D>::Point::rest() const
{
  const bool is_at_rest = look && look->is_at_rest;
  if (asleep()) return is_at_rest ? rve::Rest::Sleeps : rve::Rest::Wakes;
  return is_at_rest ? rve::Rest::Rests : look ? rve::Rest::Moves : rve::Rest::Unknown;
}

template <int D> void RvePointsOf<D>::Point::sleep_on(const rve::SleepOf<D> &sleep)
{
  if (!asleep()) rested = result;
  state = State::Asleep;
  pending = sleep.pending;
  result.stress = sleep.stress_after(pending);
  follow_pending();
}

template <int D> void RvePointsOf<D>::Point::follow_pending()
{
  const Matrix stress = result.stress, rotation = rve::rotation_of(pending);
  result = rested;
  result.stress = stress;
  result.fabric = rotation * rested.fabric * rve::transpose(rotation);
  result.cell = pending * rested.cell;
  result.deformation = pending * rested.deformation;
  result.void_ratio = (1.0 + rested.void_ratio) * rve::determinant(pending) - 1.0;
}

template <int D> PointFront<D> RvePointsOf<D>::Point::front() const
{
  PointFront<D> front;
  front.is_current = true;
  if (state == State::Empty) return front;
  front.state = state;
  front.owes = !is_identity(pending);
  front.limit = limit;
  front.response = {result.status, contacts, peak_force, result.stress};
  front.pressure = last_steps().mean_stress();
  front.of_contacts = ContactResponse<D>(material, grain_size);
  front.substeps = drive.substeps;
  return front;
}

template <int D> void RvePointsOf<D>::Point::take_details(const rve::ResultOf<D> &look)
{
  rve::ResultOf<D> &last = asleep() ? rested : result;
  const Matrix stress = last.stress;
  const std::uint32_t status = last.status;
  last = look;
  last.stress = stress;
  last.status = status;
  stale = false;
  if (asleep()) follow_pending();
}

template <int D> std::vector<rve::DriveOf<D>> RvePointsOf<D>::drives_at_rest(std::size_t count)
{
  rve::DriveOf<D> drive;
  drive.dt = 1.0;    // of no step; a drive wants a positive one
  return std::vector<rve::DriveOf<D>>(count, drive);
}

template <int D>
rve::DriveOf<D> RvePointsOf<D>::path_drive(int slot, const LoadPathsOf<D> &paths,
                                           const PathStep &step, const double *script) const
{
  // strains are known when an advance was with details
  const Matrix now = paths.needs_details() ? point(slot).result.deformation : Matrix::identity();
  return paths.drive(path(slot), step, script, now);
}

template <int D>
void RvePointsOf<D>::follow_path(int slot, const LoadPathsOf<D> &paths, const PathStep &step,
                                 const double *script)
{
  if (frozen(slot)) return;
  const rve::ResultOf<D> &result = paths.needs_details() ? point(slot).result
                                                         : points.at(slot).result;
  paths.follow(path(slot), step, result, script);
}

template <int D> rve::Tensor<double, D> RvePointsOf<D>::Point::rate_of_deformation() const
{
  if (drive.substeps == 0) return Matrix::zero();
  if (!drive.has_servo()) {
    const rve::PolarDecomposition polar(drive.deformation);
    return (1.0 / (drive.substeps * drive.dt)) *
        (polar.rotation * polar.strain * rve::transpose(polar.rotation));
  }
  // modes steer sums of components: there L is known as a whole
  Matrix rate = drive.num_modes > 0 ? last_steps().servo_velocity_gradient
                                    : drive.velocity_gradient;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      if (drive.controlled[a][b]) rate(a, b) = last_steps().servo_velocity_gradient(a, b);
  return 0.5 * (rate + rve::transpose(rate));
}

template <int D> double RvePointsOf<D>::Point::shadow_deviation() const
{
  const double difference = rve::norm(result.stress - shadow_stress);
  // of the larger one: a shadow without contacts makes it 1, not infinite
  const double size = std::max(rve::norm(result.stress), rve::norm(shadow_stress));
  return size > 0.0 ? difference / size : 0.0;
}

/* ----------------------------------------------------------------------
   the RVEs that are there
------------------------------------------------------------------------- */

template <int D>
typename RvePointsOf<D>::Point &RvePointsOf<D>::settle(int slot, const rve::RveStateOf<D> &state)
{
  points.grow_to(slot + 1);
  record_sizes.resize(points.size());
  record_sizes[slot] = 0;
  may_be_stiffer.resize(points.size());
  may_be_stiffer[slot] = 1;
  Point &point = points[slot];
  point = Point();
  point.state = State::Awake;
  point.material = state.material;
  point.servo_gain = rve::default_servo_gain(state);
  return point;
}

template <int D>
std::vector<int> RvePointsOf<D>::add(const std::vector<const rve::RveStateOf<D> *> &states)
{
  std::vector<int> slots;
  for (const rve::RveStateOf<D> *state : states) {
    slots.push_back(engine->add(*state));
    settle(slots.back(), *state);
  }
  evaluate_new(slots);
  return slots;
}

/// The first answer of RVEs that have just been taken in.
template <int D> void RvePointsOf<D>::evaluate_new(const std::vector<int> &slots)
{
  std::vector<rve::ResultOf<D>> results;
  call_and_widen(slots, drives_at_rest(slots.size()), results);
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Point &point = points[slots[k]];
    if (results[k].status & rve::status::Fatal) {
      point.state = State::Frozen;
      point.result.status = results[k].status;
      continue;
    }
    point.result = results[k];
    point.grain_size = rve::grain_size(point.result);
    point.contacts = point.result.num_contacts;
    point.peak_force = point.result.peak_force;
    limit_stiffening(slots[k]);
  }
}

template <int D> void RvePointsOf<D>::limit_stiffening(int slot)
{
  const PointFront<D> &front = points.front(slot);
  points.set_limit(slot,
                   rve::stiffening_limit(front.stiffness(), points.unheard(slot).result.num_grains,
                                         front.of_contacts.is_linear()));
}

template <int D> void RvePointsOf<D>::begin_anew(const std::vector<int> &slots)
{
  for (const int slot : slots) {
    const bool has_shadow = points.at(slot).shadow >= 0;
    rve::RveStateOf<D> state = engine->state(slot);
    rve::forget_past(state);
    remove(slot);
    engine->add(state);    // takes the number that is free
    settle(slot, state);
    if (has_shadow) points[slot].shadow = shadows->add(state);
  }
  evaluate_new(slots);
  for (const int slot : slots) points[slot].shadow_stress = points[slot].result.stress;
}

template <int D>
std::vector<double> RvePointsOf<D>::bound_time_steps(const std::vector<int> &slots,
                                                     double enough) const
{
  const auto start = rve::WallClock::now();
  std::vector<double> bounds;
  engine->bound_time_steps(slots, enough, bounds);
  seconds_for_bounds += rve::seconds_since(start);
  return bounds;
}

template <int D> std::vector<rve::Advice> RvePointsOf<D>::advice_on_energy(int slot, bool at_start)
{
  const Point &point = this->point(slot);
  std::optional<rve::EnergyTerms> &begin = points.unheard(slot).energy_at_start;
  if (at_start) begin = rve::energy_terms(point.last_steps());
  if (!begin) return {};
  return rve::advice_on_energy(*begin, rve::energy_terms(point.last_steps()));
}

template <int D> std::vector<rve::Advice> RvePointsOf<D>::advice_on_servo(int slot)
{
  Point &point = points[slot];
  const auto list =
      rve::advice_on_servo(point.result, point.drive, point.out_of_reach, point.servo_error);
  point.out_of_reach = rve::stress_out_of_reach(point.result, point.drive, point.servo_error);
  return list;
}

template <int D> void RvePointsOf<D>::note_check(const std::vector<int> &slots)
{
  // where RVEs have come or gone the next plan is new, and has these numbers
  const bool tells_device = device_knows && !points.is_changed();
  const int count = static_cast<int>(slots.size());
  std::vector<rve::NewLimit> limits(tells_device ? count : 0);
  {
    const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k) {
      const int slot = slots[k];
      limit_stiffening(slot);
      may_be_stiffer[slot] = 0;
      // the plan of a device knows those of its call by their places
      if (tells_device) limits[k] = {place_of_slot[slot], points.front(slot).limit};
    }
  }
  any_stiffened.set(false);
  if (!tells_device) return;
  const auto is_elsewhere = [](const rve::NewLimit &one) { return one.place < 0; };
  limits.erase(std::remove_if(limits.begin(), limits.end(), is_elsewhere), limits.end());
  engine->device_calls()->set_limits(limits);
}

template <int D>
double RvePointsOf<D>::bytes_for(const std::vector<int> &grains, int count, int num_shadows) const
{
  if (count == 0) return 0.0;
  const int largest = *std::max_element(grains.begin(), grains.begin() + count);
  double bytes = static_cast<double>(engine->bytes_of_call(engine->size() + count, largest));
  for (int k = 0; k < count; ++k) bytes += static_cast<double>(engine->bytes_per_rve(grains[k]));
  if (engine->memory().is_host) bytes += static_cast<double>(count) * sizeof(Point);
  const int some = shadows ? std::min(count, num_shadows) : 0;
  if (some > 0)
    bytes += static_cast<double>(shadows->bytes_of_call(some, largest)) +
        static_cast<double>(some) * static_cast<double>(shadows->bytes_per_rve(largest));
  return bytes;
}

template <int D> void RvePointsOf<D>::remove(int slot)
{
  engine->remove(slot);
  remove_shadow(slot);
  points[slot] = Point();
  record_sizes[slot] = 0;
}

template <int D> void RvePointsOf<D>::add_shadow(int slot)
{
  // a shadow begins where its RVE is
  rve::RveStateOf<D> state = engine->state(slot);
  Point &point = points[slot];
  point.shadow = shadows->add(state);
  record_sizes[slot] = 0;
  rve::DriveOf<D> drive = point.drive;
  drive.deformation = point.pending;
  if (is_identity(point.pending)) drive.substeps = drive.num_modes = 0;
  std::vector<rve::ResponseOf<D>> responses;
  shadows->advance({point.shadow}, {drive}, responses);
  point.shadow_stress = responses[0].stress;
  if (responses[0].status & rve::status::Fatal) remove_shadow(slot);
}

template <int D> void RvePointsOf<D>::remove_shadow(int slot)
{
  Point &point = points[slot];
  if (point.shadow >= 0) shadows->remove(point.shadow);
  point.shadow = -1;
  record_sizes[slot] = 0;
}

/* ----------------------------------------------------------------------
   changes between macro steps
------------------------------------------------------------------------- */

template <int D> void RvePointsOf<D>::set_options(const MacroStepOptions &_options)
{
  const int refinement = options.shadow_refinement;
  options = _options;
  options.shadow_refinement = refinement;
  device_knows = has_refused = false;
}

template <int D>
void RvePointsOf<D>::set_materials_in_place(const std::vector<int> &slots,
                                            const std::vector<rve::Material> &materials)
{
  std::size_t done = 0;
  try {
    for (; done < slots.size(); ++done) {
      engine->set_material(slots[done], materials[done]);
      const int shadow = points.unheard(slots[done]).shadow;
      if (shadow >= 0) shadows->set_material(shadow, materials[done]);
    }
  } catch (...) {
    for (std::size_t k = 0; k < done; ++k) engine->set_material(slots[k], material(slots[k]));
    throw;
  }
}

template <int D>
void RvePointsOf<D>::set_materials(const std::vector<int> &slots,
                                   const std::vector<rve::Material> &materials)
{
  complete();
  record_sizes.assign(points.size(), 0);
  NewMaterials by_slot(points.size(), nullptr);
  for (std::size_t k = 0; k < slots.size(); ++k) by_slot[slots[k]] = &materials[k];
  const rve::ContactModel contacts = contacts_with(by_slot);
  if (engine->contacts().serves(contacts))
    set_materials_in_place(slots, materials);
  else
    move_to(contacts, by_slot);
  std::vector<rve::ElasticResultOf<D>> looks;
  call_engine(slots, drives_at_rest(slots.size()), looks);
  std::vector<rve::ResponseOf<D>> look_at_shadow;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Point &point = points[slots[k]];
    if (point.shadow >= 0) {
      shadows->advance({point.shadow}, drives_at_rest(1), look_at_shadow);
      point.shadow_stress = look_at_shadow[0].stress;
    }
    const double gain_before = gain_factor(point.material), gain = gain_factor(materials[k]);
    if (gain != gain_before) point.servo_gain *= gain / gain_before;
    point.material = materials[k];
    point.look.reset();
    const rve::ResultOf<D> &look = looks[k].result;
    if (point.frozen() || (look.status & rve::status::Fatal)) continue;
    if (!point.asleep()) {
      point.result = look;
      continue;
    }
    point.rested = look;
    point.look = look_of<D>(looks[k]);
    point.sleep_on(point.sleep());
  }
}

template <int D>
std::vector<typename RvePointsOf<D>::Kept> RvePointsOf<D>::keep(const std::vector<int> &slots,
                                                                bool with_states) const
{
  std::vector<Kept> kept;
  for (const int slot : slots) {
    kept.push_back({slot, point(slot), std::nullopt, std::nullopt});
    if (!with_states) continue;
    kept.back().state = engine->state(slot);
    if (kept.back().point.shadow >= 0)
      kept.back().shadow = shadows->state(kept.back().point.shadow);
  }
  return kept;
}

template <int D> void RvePointsOf<D>::restore(const std::vector<Kept> &before)
{
  std::vector<int> slots;
  std::vector<rve::Material> materials;
  for (const Kept &kept : before) {
    slots.push_back(kept.slot);
    materials.push_back(kept.point.material);
  }
  set_materials(slots, materials);    // an engine with the contacts of before
  const auto replace = [](rve::EngineOf<D> &in, int number, const rve::RveStateOf<D> &state) {
    in.remove(number);
    in.add(state);    // takes the number that has become free
  };
  for (const Kept &kept : before) {
    // forces between grains whose material had changed have moved the springs of their contacts
    if (kept.state) replace(*engine, kept.slot, *kept.state);
    if (kept.shadow) replace(*shadows, kept.point.shadow, *kept.shadow);
    points[kept.slot] = kept.point;
  }
}

/* ----------------------------------------------------------------------
   from a macro step to DEM steps
------------------------------------------------------------------------- */

template <int D>
template <class Answers>
void RvePointsOf<D>::call_engine(const std::vector<int> &slots,
                                 const std::vector<rve::DriveOf<D>> &drives, Answers &answers) const
{
  const auto start = rve::WallClock::now();
  if (any_copies)
    call_engine_apart(slots, drives, answers);
  else
    engine->advance(slots, drives, answers);
  seconds_in_engine += rve::seconds_since(start);
}

/// RVEs of copies in a call of their own: the largest one of a call decides how much of a GPU each of them gets.
template <int D>
template <class Answers>
void RvePointsOf<D>::call_engine_apart(const std::vector<int> &slots,
                                       const std::vector<rve::DriveOf<D>> &drives,
                                       Answers &answers) const
{
  answers.resize(slots.size());
  for (const bool of_copies : {false, true}) {
    std::vector<std::size_t> places;
    std::vector<int> some_slots;
    std::vector<rve::DriveOf<D>> some_drives;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      if ((copies(slots[k]) > 1) != of_copies) continue;
      places.push_back(k);
      some_slots.push_back(slots[k]);
      some_drives.push_back(drives[k]);
    }
    if (places.empty()) continue;
    Answers some;
    engine->advance(some_slots, some_drives, some);
    for (std::size_t m = 0; m < places.size(); ++m) answers[places[m]] = some[m];
  }
}

/// Those whose cells are too narrow stay as they were before the call, and repeat it as copies of themselves side by side.
template <int D>
template <class Answers>
void RvePointsOf<D>::call_and_widen(const std::vector<int> &slots,
                                    const std::vector<rve::DriveOf<D>> &drives, Answers &answers)
{
  call_engine(slots, drives, answers);
  widen_and_repeat(slots, drives, answers);
}

template <int D>
template <class Answers>
void RvePointsOf<D>::widen_and_repeat(const std::vector<int> &slots,
                                      const std::vector<rve::DriveOf<D>> &drives, Answers &answers)
{
  if (options.most_copies == 1) return;
  for (bool any_narrow = true; any_narrow;) {
    std::vector<int> places, some_slots;
    std::vector<rve::DriveOf<D>> some_drives;
    for (int k = 0; k < static_cast<int>(slots.size()); ++k) {
      if (!(answers[k].status & rve::status::CellTooNarrow) || !widen(slots[k])) continue;
      places.push_back(k);
      some_slots.push_back(slots[k]);
      some_drives.push_back(drives[k]);
    }
    any_narrow = !places.empty();
    if (!any_narrow) return;
    Answers some;
    call_engine(some_slots, some_drives, some);
    for (std::size_t m = 0; m < places.size(); ++m) answers[places[m]] = some[m];
  }
}

/// What one RVE does in a macro step: parts that end where its stress is wanted.
template <int D> struct RvePointsOf<D>::Macro {
  int slot;
  rve::DriveOf<D> drive;
  // DEM steps of the first part, and of each other one
  int parts = 1, first_steps = 0, spacing = 0;
  std::vector<Matrix> samples;    // of stress, at the end of each part
  bool failed = false;

  int steps(int part) const { return part == 0 ? first_steps : spacing; }

  rve::DriveOf<D> of_part(int part) const
  {
    if (parts == 1) return drive;
    rve::DriveOf<D> some = drive;
    some.substeps = steps(part);
    const auto end = [&](int p) {
      return static_cast<double>(first_steps + p * spacing) / drive.substeps;
    };
    // the last part ends where the macro step does, to the last bit but one
    const Matrix after = part + 1 == parts ? drive.deformation
                                           : rve::part_of_increment(drive.deformation, end(part));
    some.deformation = part == 0
        ? after
        : after * rve::inverse(rve::part_of_increment(drive.deformation, end(part - 1)));
    return some;
  }

  /// Mean of the samples, or the value at the end of the straight line through them.
  Matrix stress(StressFrom from) const
  {
    const int n = static_cast<int>(samples.size());
    Matrix mean = Matrix::zero(), slope = Matrix::zero();
    double spread = 0.0;
    for (int k = 0; k < n; ++k) {
      const double place = k - 0.5 * (n - 1);
      mean = mean + (1.0 / n) * samples[k];
      slope = slope + place * samples[k];
      spread += place * place;
    }
    return from == StressFrom::Average ? mean : mean + (0.5 * (n - 1) / spread) * slope;
  }
};

/// What an RVE does that is not frozen.
template <int D>
typename RvePointsOf<D>::Part RvePointsOf<D>::part_of(int slot, const rve::DriveOf<D> &drive) const
{
  if (!(options.quiescent_strain > 0.0) || drive.has_servo() || drive.substeps == 0)
    return Part::Works;
  return part_of(slot, drive.deformation, drive.dt, drive.substeps);
}

/// The same of an increment alone: it sleeps where the strain since its last DEM steps is too small for others, and a look at their end has found
/// it at rest.
template <int D>
typename RvePointsOf<D>::Part RvePointsOf<D>::part_of(int slot, const Matrix &increment, double dt,
                                                      int substeps) const
{
  const PointFront<D> &front = points.front(slot);
  const double limit = options.quiescent_strain, strain = rve::strain_size(increment);
  // most strain by more
  if (front.response.status != rve::status::Ok || !(strain < limit)) return Part::Works;
  const double of_all = front.owes ? rve::strain_size(increment * points.pending(slot)) : strain;
  switch (rve::skipping_of(points.rest(slot), strain, of_all, limit, [&] {
    return options.adaptive ? substeps_of(slot, strain, dt) : substeps;
  })) {
    case rve::Skipping::Sleep:
      return Part::Sleeps;
    case rve::Skipping::Look:
      return Part::WorksAndIsLookedAt;
    default:
      return Part::Works;
  }
}

/// Through an increment; returns its stress.
template <int D> rve::Tensor<double, D> RvePointsOf<D>::sleep_on(int slot, const Matrix &increment)
{
  return sleep_until(slot, increment * points.pending(slot));
}

template <int D> rve::Tensor<double, D> RvePointsOf<D>::sleep_until(int slot, const Matrix &pending)
{
  points.front(slot);    // is current from here on
  const Matrix stress = points.sleep(slot).stress_after(pending);
  points.slept(slot, pending, stress);
  return stress;
}

/// Slots whose RVEs sleep in this step.
template <int D>
std::vector<int> RvePointsOf<D>::those_that_sleep(const std::vector<int> &slots) const
{
  std::vector<int> some;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (parts[k] == Part::Sleeps && !points.sleeps_on(slots[k])) some.push_back(slots[k]);
  return some;
}

/// Those that came with a record and rest have not brought their stiffness.
template <int D> void RvePointsOf<D>::complete_looks(const std::vector<int> &slots)
{
  std::vector<int> some;
  for (const int slot : slots)
    if (!points.is_ahead(slot) && points.at(slot).look && !points.at(slot).look->is_whole())
      some.push_back(slot);
  if (some.empty()) return;
  std::vector<rve::ElasticResultOf<D>> found;
  call_engine(some, drives_at_rest(some.size()), found);
  for (std::size_t m = 0; m < some.size(); ++m)
    points.told(some[m]).look->stiffness = found[m].stiffness;
}

template <int D> int RvePointsOf<D>::substeps_of(int slot, const rve::DriveOf<D> &drive) const
{
  if (!options.adaptive || drive.substeps == 0 || drive.has_servo()) return drive.substeps;
  return substeps_of(slot, rve::strain_size(drive.deformation), drive.dt);
}

template <int D> int RvePointsOf<D>::substeps_of(int slot, double strain, double dt) const
{
  const PointFront<D> &front = points.front(slot);
  return options.adaptive->of(strain, dt, front.pressure, front.of_contacts.grain_size(),
                              front.of_contacts.density());
}

/// Whether a rotation lets contacts slip, in as few DEM steps as the strain asks for. The overlap is that of its mean stress: what is
/// known whatever the last advance was asked for.
template <int D>
bool RvePointsOf<D>::slips(int slot, const Matrix &increment, double dt, int substeps) const
{
  const PointFront<D> &front = points.front(slot);
  const double overlap =
      front.of_contacts.contact_strain(std::fmax(front.pressure, 0.0), material(slot));
  return rve::slips(increment, substeps, dt, overlap,
                    [&] { return front.of_contacts.frequency(overlap, material(slot)); });
}

/// Whether it must be turned rigidly before an increment, which has what it owes.
template <int D>
bool RvePointsOf<D>::needs_turn(int slot, const Matrix &increment, double dt, int substeps) const
{
  return (points.front(slot).owes && rve::is_turned(points.at(slot).mean_overlap(), increment)) ||
      (options.adaptive && slips(slot, increment, dt, substeps));
}

/// Carries out rotations that grains could not follow: the drives keep the stretch.
template <int D>
void RvePointsOf<D>::turn(rve::EngineOf<D> &engine, const std::vector<int> &numbers,
                          std::vector<rve::DriveOf<D>> &drives, const std::vector<char> &must_turn)
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

/// What each RVE does. Returns whether all work.
template <int D>
bool RvePointsOf<D>::plan_parts(const std::vector<int> &slots,
                                const std::vector<rve::DriveOf<D>> &drives)
{
  const int count = static_cast<int>(slots.size());
  parts.resize(count);
  bool all_work = true;
  const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team) reduction(&& : all_work)
  for (int k = 0; k < count; ++k) {
    parts[k] = frozen(slots[k]) ? Part::Nothing : part_of(slots[k], drives[k]);
    all_work = all_work && works(parts[k]);
  }
  return all_work;
}

/// The drives of those that work, with what they slept through; but under a servo, which takes no deformation. Returns whether one of them
/// has slept and is under a servo.
template <int D>
bool RvePointsOf<D>::plan_work(const std::vector<int> &slots,
                               const std::vector<rve::DriveOf<D>> &drives, bool all_work)
{
  working.clear();
  if (!all_work)
    for (std::size_t k = 0; k < slots.size(); ++k)
      if (works(parts[k])) working.push_back(static_cast<int>(k));
  const int count = static_cast<int>(all_work ? slots.size() : working.size());
  working_slots.resize(count);
  working_drives.resize(count);
  must_turn.resize(count);
  is_looked_at.resize(count);
  bool some_owe = false, some_turn = false;
  {
    const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team) reduction(|| : some_owe, some_turn)
    for (int m = 0; m < count; ++m) {
      const int k = all_work ? m : working[m], slot = slots[k];
      rve::DriveOf<D> &drive = working_drives[m];
      working_slots[m] = slot;
      drive = drives[k];
      must_turn[m] = 0;
      is_looked_at[m] = parts[k] == Part::WorksAndIsLookedAt;
      const bool wakes = points.front(slot).owes, has_servo = drive.has_servo();
      some_owe = some_owe || (wakes && has_servo);
      if (has_servo || drive.substeps == 0) continue;
      if (wakes) drive.deformation = drive.deformation * points.at(slot).pending;
      drive.substeps = substeps_of(slot, drive);
      must_turn[m] = needs_turn(slot, drive.deformation, drive.dt, drive.substeps);
      some_turn = some_turn || must_turn[m];
    }
  }
  if (!some_turn) return some_owe;
  turn(*engine, working_slots, working_drives, must_turn);
  // the strain of what is left, to its last digit
  for (int m = 0; m < count; ++m)
    if (must_turn[m]) working_drives[m].substeps = substeps_of(working_slots[m], working_drives[m]);
  return some_owe;
}

/// What an RVE under a servo slept through under another drive is carried out before. Who fails there is frozen and works no more.
template <int D> void RvePointsOf<D>::catch_up()
{
  std::vector<int> slots;
  std::vector<rve::DriveOf<D>> drives;
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
    Point &point = points[slots[k]];
    point.state = responses[k].status & rve::status::Fatal ? State::Frozen : State::Awake;
    if (point.frozen())
      point.result.status = responses[k].status;
    else
      point.pending = Matrix::identity();
  }
  std::size_t left = 0;
  for (std::size_t m = 0; m < working_slots.size(); ++m) {
    if (frozen(working_slots[m])) continue;
    working_slots[left] = working_slots[m];
    is_looked_at[left] = is_looked_at[m];
    working_drives[left++] = working_drives[m];
  }
  working_slots.resize(left);
  working_drives.resize(left);
  is_looked_at.resize(left);
}

/// All parts of all macro steps, the n-th parts of all RVEs at once.
template <int D> void RvePointsOf<D>::run(std::vector<Macro> &macros)
{
  for (int part = 0;; ++part) {
    std::vector<Macro *> last, others;
    for (Macro &macro : macros)
      if (!macro.failed && part < macro.parts)
        (part + 1 == macro.parts ? last : others).push_back(&macro);
    if (last.empty() && others.empty()) return;

    const auto slots_of = [](const std::vector<Macro *> &some) {
      std::vector<int> slots;
      for (const Macro *macro : some) slots.push_back(macro->slot);
      return slots;
    };
    const auto drives_of = [part](const std::vector<Macro *> &some) {
      std::vector<rve::DriveOf<D>> drives;
      for (const Macro *macro : some) drives.push_back(macro->of_part(part));
      return drives;
    };
    if (!others.empty()) {
      std::vector<rve::ResponseOf<D>> responses;
      call_and_widen(slots_of(others), drives_of(others), responses);
      for (std::size_t k = 0; k < others.size(); ++k) {
        others[k]->samples.push_back(responses[k].stress);
        others[k]->failed = (responses[k].status & rve::status::Fatal) != 0;
        if (others[k]->failed) points[others[k]->slot].result.status = responses[k].status;
      }
    }
    if (!last.empty()) {
      std::vector<rve::ResponseOf<D>> responses;
      call_and_widen(slots_of(last), drives_of(last), responses);
      for (std::size_t k = 0; k < last.size(); ++k) {
        Macro &macro = *last[k];
        Point &point = points[macro.slot];
        point.result.status = responses[k].status;
        macro.failed = (responses[k].status & rve::status::Fatal) != 0;
        if (macro.failed) continue;
        point.contacts = responses[k].num_contacts;
        point.peak_force = responses[k].peak_force;
        if (point.limit.is_exceeded(rve::stiffness_measures(responses[k])))
          note_stiffening(macro.slot);
        macro.samples.push_back(responses[k].stress);
        point.result.stress = macro.parts == 1 ? responses[k].stress
                                               : macro.stress(options.stress_from);
      }
    }
  }
}

template <int D>
void RvePointsOf<D>::advance_shadows(const std::vector<int> &slots,
                                     const std::vector<rve::DriveOf<D>> &drives)
{
  std::vector<int> originals, numbers;
  std::vector<rve::DriveOf<D>> finer;
  std::vector<char> turned;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const Point &point = points.at(slots[k]);
    if (point.shadow < 0 || point.frozen()) continue;
    originals.push_back(slots[k]);
    numbers.push_back(point.shadow);
    finer.push_back(drives[k]);
    finer.back().dt /= options.shadow_refinement;
    finer.back().substeps = substeps_of(slots[k], drives[k]) * options.shadow_refinement;
    turned.push_back(
        options.adaptive && !drives[k].has_servo() && drives[k].substeps > 0 &&
        slips(slots[k], drives[k].deformation, finer.back().dt, finer.back().substeps));
  }
  if (numbers.empty()) return;
  turn(*shadows, numbers, finer, turned);
  std::vector<rve::ResponseOf<D>> responses;
  shadows->advance(numbers, finer, responses);
  widen_shadows(originals, finer, responses);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    Point &point = points[originals[k]];
    if (responses[k].status & rve::status::Fatal)
      remove_shadow(originals[k]);    // its RVE will have another one, or fail as well
    else
      point.shadow_stress = responses[k].stress;
  }
}

template <int D>
std::vector<int> RvePointsOf<D>::advance(const std::vector<int> &slots,
                                         const std::vector<rve::DriveOf<D>> &drives,
                                         bool with_details)
{
  hear();
  device_knows = false;
  const auto start = rve::WallClock::now();
  const std::vector<int> failed = is_plain(slots) ? advance_plainly(slots, drives)
                                                  : advance_by_plan(slots, drives);
  // of the same kind as what is asked for later: the long answer of the call itself has the velocities of half a step before
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
   nothing stands between macro steps and DEM steps: one call of the engine, with the drives as they are.
   thousands of RVEs get there in every step, and what is done for each of them counts
------------------------------------------------------------------------- */

template <int D> bool RvePointsOf<D>::is_plain(const std::vector<int> &slots) const
{
  if (options.adaptive || options.quiescent_strain > 0.0 || options.stress_from != StressFrom::End)
    return false;
  const int count = static_cast<int>(slots.size());
  bool plain = true;
  const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team) reduction(&& : plain)
  for (int k = 0; k < count; ++k) {
    const PointFront<D> &front = points.front(slots[k]);
    plain = plain && front.state == State::Awake && !front.owes;
  }
  return plain;
}

template <int D>
std::vector<int> RvePointsOf<D>::advance_plainly(const std::vector<int> &slots,
                                                 const std::vector<rve::DriveOf<D>> &drives,
                                                 const std::vector<char> &looked_at)
{
  const int count = static_cast<int>(slots.size());
  if (count == 0) return {};
  std::vector<int> looked_places;
  for (std::size_t k = 0; k < looked_at.size(); ++k)
    if (looked_at[k]) looked_places.push_back(static_cast<int>(k));
  if (looked_places.empty())
    call_engine(slots, drives, responses);
  else
    call_and_look(slots, drives, looked_at);
  record_sizes.assign(points.size(), 0);

  const auto has_failed = [&](int k) { return (responses[k].status & rve::status::Fatal) != 0; };
  bool any_failed = false;
  const auto take = [&](int k) {
    points.answered(slots[k], responses[k], drives[k]);
    if (points.front(slots[k]).limit.is_exceeded(rve::stiffness_measures(responses[k])))
      note_stiffening(slots[k]);
  };
  {
    const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team) reduction(|| : any_failed)
    for (int k = 0; k < count; ++k) {
      if (has_failed(k))
        any_failed = true;
      else
        take(k);
    }
  }
  for (std::size_t m = 0; m < looked_places.size(); ++m)
    if (!has_failed(looked_places[m]))
      points.told(slots[looked_places[m]]).look = look_of<D>(found_looks[m]);
  if (!any_failed) return {};

  std::vector<int> failed, in_trouble;
  for (int k = 0; k < count; ++k)
    if (has_failed(k)) in_trouble.push_back(k);
  widen_and_repeat(slots, drives, responses);
  for (const int k : in_trouble) {
    if (!has_failed(k)) {
      take(k);
      continue;
    }
    Point &point = points[slots[k]];
    point.state = State::Frozen;
    point.result.status = responses[k].status;
    failed.push_back(slots[k]);
  }
  return failed;
}

/// Those that shall be looked at have the longest answer, in a call of their own.
template <int D>
void RvePointsOf<D>::call_and_look(const std::vector<int> &slots,
                                   const std::vector<rve::DriveOf<D>> &drives,
                                   const std::vector<char> &looked_at)
{
  std::vector<int> some_slots[2], some_places[2];
  std::vector<rve::DriveOf<D>> some_drives[2];
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const int looked = looked_at[k] ? 1 : 0;
    some_slots[looked].push_back(slots[k]);
    some_places[looked].push_back(static_cast<int>(k));
    some_drives[looked].push_back(drives[k]);
  }
  responses.resize(slots.size());
  std::vector<rve::ResponseOf<D>> of_others;
  if (!some_slots[0].empty()) call_engine(some_slots[0], some_drives[0], of_others);
  call_engine(some_slots[1], some_drives[1], found_looks);
  for (std::size_t m = 0; m < of_others.size(); ++m) responses[some_places[0][m]] = of_others[m];
  for (std::size_t m = 0; m < found_looks.size(); ++m) {
    const rve::ResultOf<D> &result = found_looks[m].result;
    responses[some_places[1][m]] = {result.status, result.num_contacts, result.peak_force,
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
    points.deny_stale();
    return;
  }
  // whoever looks in every step does so at thousands: no memory is asked for each time, and threads share the copies
  if (static_cast<int>(resting.size()) != count) resting = drives_at_rest(count);
  call_engine(stale_slots, resting, looks);
  const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k) {
    Point &point = points.told(stale_slots[k]);
    point.stale = false;
    if (!(looks[k].status & rve::status::Fatal)) point.take_details(looks[k]);
  }
  points.deny_stale();
}

template <int D>
std::vector<int> RvePointsOf<D>::advance_by_plan(const std::vector<int> &slots,
                                                 const std::vector<rve::DriveOf<D>> &drives)
{
  record_sizes.assign(points.size(), 0);
  const bool all_work = plan_parts(slots, drives);
  if (!all_work && options.quiescent_strain > 0.0) {
    complete_looks(those_that_sleep(slots));
    const int count = static_cast<int>(slots.size());
    const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k)
      if (parts[k] == Part::Sleeps) sleep_on(slots[k], drives[k].deformation);
  }

  const bool some_owe = plan_work(slots, drives, all_work);
  const std::size_t planned = working_slots.size();
  if (some_owe) catch_up();
  if (options.stress_from != StressFrom::End)
    advance_with_samples(working_slots, working_drives);
  else if (advance_plainly(working_slots, working_drives, is_looked_at).empty() &&
           working_slots.size() == planned)
    return {};    // as nearly always: thousands of points need not be asked

  std::vector<int> failed;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if ((all_work || works(parts[k])) && frozen(slots[k])) failed.push_back(slots[k]);
  return failed;
}

/// The stress is that of several parts of the macro step.
template <int D>
void RvePointsOf<D>::advance_with_samples(const std::vector<int> &slots,
                                          const std::vector<rve::DriveOf<D>> &drives)
{
  std::vector<Macro> macros(slots.size());
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Macro &macro = macros[k];
    macro.slot = slots[k];
    macro.drive = drives[k];
    const int substeps = macro.drive.substeps;
    if (substeps < 2) continue;
    macro.parts = std::min(options.stress_samples, substeps);
    macro.spacing = std::min(options.stress_spacing, (substeps - 1) / (macro.parts - 1));
    macro.first_steps = substeps - (macro.parts - 1) * macro.spacing;
  }
  run(macros);
  for (const Macro &macro : macros) {
    Point &point = points[macro.slot];
    point.state = macro.failed ? State::Frozen : State::Awake;
    if (macro.failed) continue;
    point.stale = true;
    point.look.reset();
    if (macro.drive.substeps == 0) continue;
    point.pending = Matrix::identity();
    point.note(macro.drive);
  }
  look_at_working();
}

/// A look of its own, at those that shall be looked at after their last DEM steps.
template <int D> void RvePointsOf<D>::look_at_working()
{
  std::vector<int> some;
  for (std::size_t m = 0; m < working_slots.size(); ++m)
    if (is_looked_at[m] && !frozen(working_slots[m])) some.push_back(working_slots[m]);
  if (some.empty()) return;
  std::vector<rve::ElasticResultOf<D>> found;
  call_engine(some, drives_at_rest(some.size()), found);
  for (std::size_t m = 0; m < some.size(); ++m)
    if (!(found[m].result.status & rve::status::Fatal))
      points.told(some[m]).look = look_of<D>(found[m]);
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;
// for increment_calls.cpp
template void RvePointsOf<2>::widen_and_repeat(const std::vector<int> &,
                                               const std::vector<rve::DriveOf<2>> &,
                                               std::vector<rve::ResponseOf<2>> &);
template void RvePointsOf<3>::widen_and_repeat(const std::vector<int> &,
                                               const std::vector<rve::DriveOf<3>> &,
                                               std::vector<rve::ResponseOf<3>> &);
// for fresh_rves.cpp
template void RvePointsOf<2>::call_engine(const std::vector<int> &,
                                          const std::vector<rve::DriveOf<2>> &,
                                          std::vector<rve::ResultOf<2>> &) const;
template void RvePointsOf<3>::call_engine(const std::vector<int> &,
                                          const std::vector<rve::DriveOf<3>> &,
                                          std::vector<rve::ResultOf<3>> &) const;

}    // namespace macro
