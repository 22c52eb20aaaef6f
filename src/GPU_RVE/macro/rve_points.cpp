// SPDX-License-Identifier: GPL-2.0-only
#include "macro/rve_points.h"

#include "macro/light_loops.h"
#include "rve/core/wall_time.h"
#include "rve/engine/packing.h"

#include <algorithm>

namespace macro {

namespace {

  /// Returns the factor of the default servo gain that depends on the material.
  double gain_factor(const rve::Material &material)
  {
    return material.thickness / (material.density * material.mass_depth);
  }

}    // namespace

template <int D> std::vector<rve::DriveOf<D>> RvePointsOf<D>::drives_at_rest(std::size_t count)
{
  rve::DriveOf<D> drive;
  drive.dt = 1.0;    // a drive needs a positive time step, although it makes no step
  return std::vector<rve::DriveOf<D>>(count, drive);
}

template <int D>
rve::DriveOf<D> RvePointsOf<D>::path_drive(int slot, const LoadPathsOf<D> &paths,
                                           const PathStep &step, const double *script) const
{
  // strains need a complete result
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

/* ----------------------------------------------------------------------
   adding and removing RVEs
------------------------------------------------------------------------- */

/// Initialises the point of the RVE with this number in the engine, and returns the point.
template <int D>
typename RvePointsOf<D>::Point &RvePointsOf<D>::initialise(int slot,
                                                           const rve::RveStateOf<D> &state)
{
  points.grow_to(slot + 1);
  record_sizes.resize(points.size());
  record_sizes[slot] = 0;
  may_be_stiffer.resize(points.size());
  may_be_stiffer[slot] = 1;
  Point &point = points.modify(slot);
  point = Point();
  point.state = State::Awake;
  point.material = state.material;
  point.servo_gain = rve::default_servo_gain(state);
  return point;
}

template <int D>
std::vector<int> RvePointsOf<D>::add(const std::vector<const rve::RveStateOf<D> *> &states)
{
  Slots slots;
  for (const rve::RveStateOf<D> *state : states) {
    slots.push_back(engine->add(*state));
    initialise(slots.back(), *state);
  }
  evaluate_new(slots);
  return slots;
}

/// Sets the first results of new RVEs.
template <int D> void RvePointsOf<D>::evaluate_new(const Slots &slots)
{
  std::vector<rve::ResultOf<D>> results;
  call_and_widen(slots, drives_at_rest(slots.size()), results);
  for (std::size_t k = 0; k < slots.size(); ++k) {
    if (results[k].status & rve::status::Fatal) {
      freeze(slots[k], results[k].status);
      continue;
    }
    points.modify(slots[k]).begin_with(results[k]);
    limit_stiffening(slots[k]);
  }
}

template <int D> void RvePointsOf<D>::limit_stiffening(int slot)
{
  const CachedPoint<D> &cached = points.cached(slot);
  points.set_limit(slot,
                   rve::stiffening_limit(cached.stiffness(),
                                         points.unsynchronised(slot).result.num_grains,
                                         cached.of_contacts.is_linear()));
}

template <int D> void RvePointsOf<D>::reset(const Slots &slots)
{
  for (const int slot : slots) {
    const bool has_shadow = points.at(slot).shadow >= 0;
    rve::RveStateOf<D> state = engine->state(slot);
    rve::forget_past(state);
    remove(slot);
    engine->add(state);    // gets the number of the removed RVE
    initialise(slot, state);
    if (has_shadow) points.modify(slot).shadow = shadows->add(state);
  }
  evaluate_new(slots);
  for (const int slot : slots) {
    Point &point = points.modify(slot);
    point.shadow_stress = point.result.stress;
  }
}

template <int D>
std::vector<double> RvePointsOf<D>::bound_time_steps(const Slots &slots, double enough) const
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
  std::optional<rve::EnergyTerms> &begin = points.unsynchronised(slot).energy_at_start;
  if (at_start) begin = rve::energy_terms(point.last_steps());
  if (!begin) return {};
  return rve::advice_on_energy(*begin, rve::energy_terms(point.last_steps()));
}

template <int D> std::vector<rve::Advice> RvePointsOf<D>::advice_on_servo(int slot)
{
  Point &point = points.modify(slot);
  const auto list =
      rve::advice_on_servo(point.result, point.drive, point.out_of_reach, point.servo_error);
  point.out_of_reach = rve::stress_out_of_reach(point.result, point.drive, point.servo_error);
  return list;
}

template <int D> void RvePointsOf<D>::note_check(const Slots &slots)
{
  // if points have changed, the next plan is new and contains these limits
  const bool updates_device = device_plan == Plan::Valid && !points.is_changed();
  const int count = static_cast<int>(slots.size());
  std::vector<rve::NewLimit> limits(updates_device ? count : 0);
  for_each(count, threads, [&](int k) {
    const int slot = slots[k];
    limit_stiffening(slot);
    may_be_stiffer[slot] = 0;
    // the plan on the device numbers RVEs by their index in the call
    if (updates_device) limits[k] = {index_of_slot[slot], points.cached(slot).limit};
  });
  any_stiffened.set(false);
  if (!updates_device) return;
  const auto is_not_in_call = [](const rve::NewLimit &one) { return one.index < 0; };
  limits.erase(std::remove_if(limits.begin(), limits.end(), is_not_in_call), limits.end());
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
  points.modify(slot) = Point();
  record_sizes[slot] = 0;
}

template <int D> void RvePointsOf<D>::add_shadow(int slot)
{
  // a shadow begins with the state of its RVE
  rve::RveStateOf<D> state = engine->state(slot);
  Point &point = points.modify(slot);
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
  Point &point = points.modify(slot);
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
  device_plan = Plan::None;
}

/// Sets materials whose contacts the engine supports. If one of them is out of range, nothing has
/// changed.
template <int D>
void RvePointsOf<D>::set_materials_in_place(const Slots &slots,
                                            const std::vector<rve::Material> &materials)
{
  std::size_t done = 0;
  try {
    for (; done < slots.size(); ++done) {
      engine->set_material(slots[done], materials[done]);
      const int shadow = points.unsynchronised(slots[done]).shadow;
      if (shadow >= 0) shadows->set_material(shadow, materials[done]);
    }
  } catch (...) {
    for (std::size_t k = 0; k < done; ++k) engine->set_material(slots[k], material(slots[k]));
    throw;
  }
}

template <int D>
void RvePointsOf<D>::set_materials(const Slots &slots, const std::vector<rve::Material> &materials)
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
  const std::vector<rve::ElasticResultOf<D>> results = evaluate(slots);
  std::vector<rve::ResponseOf<D>> responses;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Point &point = points.modify(slots[k]);
    if (point.shadow >= 0) {
      shadows->advance({point.shadow}, drives_at_rest(1), responses);
      point.shadow_stress = responses[0].stress;
    }
    const double gain_before = gain_factor(point.material), gain = gain_factor(materials[k]);
    if (gain != gain_before) point.servo_gain *= gain / gain_before;
    point.material = materials[k];
    point.evaluation.reset();
    const rve::ResultOf<D> &result = results[k].result;
    if (point.frozen() || (result.status & rve::status::Fatal)) continue;
    if (!point.is_quiescent()) {
      point.result = result;
      continue;
    }
    point.rested = result;
    point.evaluation = PointOf<D>::Evaluation::of(results[k]);
    point.defer(point.quiescence());
  }
}

template <int D>
std::vector<typename RvePointsOf<D>::Kept> RvePointsOf<D>::keep(const Slots &slots,
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
  Slots slots;
  std::vector<rve::Material> materials;
  for (const Kept &kept : before) {
    slots.push_back(kept.slot);
    materials.push_back(kept.point.material);
  }
  set_materials(slots, materials);    // then the engine has the former contacts
  const auto replace = [](rve::EngineOf<D> &in, int number, const rve::RveStateOf<D> &state) {
    in.remove(number);
    in.add(state);    // gets the free number
  };
  for (const Kept &kept : before) {
    // contact springs can have changed while the RVE had the other material
    if (kept.state) replace(*engine, kept.slot, *kept.state);
    if (kept.shadow) replace(*shadows, kept.point.shadow, *kept.shadow);
    points.modify(kept.slot) = kept.point;
  }
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
