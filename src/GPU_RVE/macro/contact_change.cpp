// SPDX-License-Identifier: GPL-2.0-only
// Changes the contact law or the contact resistances (rolling, twisting) of all RVEs. The kernels
// and the memory layout of an engine are fixed, so the RVEs move to a new engine.

#include "macro/rve_points.h"

#include "rve/core/error.h"

#include <algorithm>
#include <string>

namespace macro {

namespace {

  /// States by number in the engine; empty where the number is free.
  template <int D> using StatesOf = std::vector<std::optional<rve::RveStateOf<D>>>;

  /// Returns the smallest possible RVE, which has only the first grain of a state.
  template <int D> rve::RveStateOf<D> first_grain_of(const rve::RveStateOf<D> &state)
  {
    rve::RveStateOf<D> grain;
    grain.material = state.material;
    grain.cell = state.cell;
    grain.radius = {state.radius[0]};
    grain.fractional.assign(state.fractional.begin(), state.fractional.begin() + D);
    grain.velocity.assign(D, 0.0);
    grain.spin.assign(rve::Space<D>::spins, 0.0);
    return grain;
  }

  /// Adds states to an empty engine. The engine assigns numbers in order, so an RVE with one grain
  /// is added for each number without a state and removed at the end.
  template <int D> void add_all(const StatesOf<D> &states, rve::EngineOf<D> &engine)
  {
    std::size_t end = states.size();
    while (end > 0 && !states[end - 1]) --end;
    std::vector<int> unused;
    for (std::size_t number = 0; number < end; ++number) {
      engine.add(states[number] ? *states[number] : first_grain_of(*states[end - 1]));
      if (!states[number]) unused.push_back(static_cast<int>(number));
    }
    for (const int number : unused) engine.remove(number);
  }

  void forget_rolling(rve::Pair &pair)
  {
    pair.rolling_force = 0.0;
  }
  void forget_rolling(rve::PairOf<3> &pair)
  {
    pair.rolling_force = rve::Vec<double, 3>::zero();
    pair.twisting_moment = 0.0;
  }

  /// Returns the memory of RVEs with these states plus the memory of a call that advances all of
  /// them [bytes].
  template <int D> double bytes_of(const StatesOf<D> &states, rve::EngineOf<D> &engine)
  {
    double bytes = 0.0;
    int count = 0, largest = 0;
    for (const auto &state : states) {
      if (!state) continue;
      bytes += static_cast<double>(engine.bytes_per_rve(state->num_grains()));
      ++count;
      largest = std::max(largest, state->num_grains());
    }
    return bytes + static_cast<double>(engine.bytes_of_call(count, largest));
  }

}    // namespace

template <int D> std::vector<int> RvePointsOf<D>::used_slots() const
{
  Slots slots;
  for (int slot = 0; slot < points.size(); ++slot)
    if (points.unsynchronised(slot).state != State::Empty) slots.push_back(slot);
  return slots;
}

template <int D> void RvePointsOf<D>::expect(const rve::ContactModel &contacts)
{
  const rve::ContactModel present = engine->contacts();
  if (present.serves(contacts)) return;
  rve::ContactModel both = contacts;
  if (engine->size() > 0) {
    rve::require(contacts.law == present.law, [&] {
      return std::string("new RVEs have contact law ") + rve::word_of(contacts.law) +
          ", but the present RVEs have " + rve::word_of(present.law) +
          "; all must have the same contact law";
    });
    both.rolling = both.rolling || present.rolling;
  }
  move_to(both, NewMaterials(points.size(), nullptr));
}

/// Returns a contact model that supports all RVEs with their new materials. If the present model
/// has rolling resistance, the new one keeps it unless the contact law changes. Throws InputError
/// if the RVEs would have different contact laws.
template <int D>
rve::ContactModel RvePointsOf<D>::contacts_with(const NewMaterials &materials) const
{
  const Slots slots = used_slots();
  const rve::ContactModel present = engine->contacts();
  rve::ContactModel all = present;
  for (const int slot : slots) {
    const rve::ContactModel one =
        rve::contacts_of(materials[slot] ? *materials[slot] : material(slot));
    if (slot == slots.front() && one.law != present.law) all = {one.law, false, D};
    rve::require(one.law == all.law, [&] {
      return std::string("some RVEs would have contact law ") + rve::word_of(all.law) +
          ", and others " + rve::word_of(one.law) + "; all must have the same";
    });
    all.rolling = all.rolling || one.rolling;
  }
  return all;
}

/// Moves all RVEs to a new engine. Pairs lose their rolling forces if the new contacts have no
/// rolling resistance. The present engine is deleted first, so that the new engine can use its
/// memory. Throws InputError if a material is out of range or the memory does not suffice; then
/// nothing has changed.
template <int D>
void RvePointsOf<D>::move_to(const rve::ContactModel &contacts, const NewMaterials &materials)
{
  using States = StatesOf<D>;
  const rve::ContactModel before = engine->contacts();
  std::unique_ptr<rve::EngineOf<D>> other = engine->empty_with(contacts), other_shadows;
  if (shadows) other_shadows = shadows->empty_with(contacts);

  States old(points.size()), old_shadows(points.size());    // states by slot
  for (const int slot : used_slots()) {
    old[slot] = engine->state(slot);
    const int shadow = points.unsynchronised(slot).shadow;
    if (shadow >= 0) old_shadows[slot] = shadows->state(shadow);
  }
  const auto changed = [&](States states) {
    for (std::size_t slot = 0; slot < states.size(); ++slot) {
      if (!states[slot]) continue;
      if (materials[slot]) states[slot]->material = *materials[slot];
      if (!contacts.rolling)
        for (rve::PairOf<D> &pair : states[slot]->pairs) forget_rolling(pair);
      states[slot]->check();
    }
    return states;
  };
  const States fresh = changed(old), fresh_shadows = changed(old_shadows);

  double more = bytes_of(fresh, *other) - bytes_of(old, *engine);
  if (shadows) more += bytes_of(fresh_shadows, *other_shadows) - bytes_of(old_shadows, *shadows);
  const rve::Memory memory = engine->memory();
  rve::require(!memory.is_known || more <= static_cast<double>(memory.free), [&] {
    constexpr double MB = 1048576.0;
    return "RVEs with " + rve::to_string(contacts) + " need " + rve::number(more / MB) +
        " MB more of " + memory.name + " than RVEs with " + rve::to_string(before) + ", but only " +
        rve::number(static_cast<double>(memory.free) / MB) + " MB are free";
  });

  const auto put = [this](const States &states, const States &of_shadows) {
    add_all(states, *engine);
    for (std::size_t slot = 0; slot < of_shadows.size(); ++slot)
      if (of_shadows[slot]) points.modify(slot).shadow = shadows->add(*of_shadows[slot]);
  };
  engine = std::move(other);
  device_plan = Plan::None;
  under_way = {};
  shadows = std::move(other_shadows);
  try {
    put(fresh, fresh_shadows);
  } catch (...) {
    engine = engine->empty_with(before);
    if (shadows) shadows = shadows->empty_with(before);
    put(old, old_shadows);
    throw;
  }
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
