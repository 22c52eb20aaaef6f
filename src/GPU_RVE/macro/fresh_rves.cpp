// SPDX-License-Identifier: GPL-2.0-only
// Replaces failed RVEs by fresh ones. A fresh RVE is a packing that is brought to the stress of the
// failed RVE.

#include "macro/rve_points.h"

#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace macro {

/// Data of a replacement.
template <int D> struct RvePointsOf<D>::Fresh {
  RenewalOf<D> renewal;
  rve::RveStateOf<D> before;    ///< state of the failed RVE
  bool is_open = false;         ///< the failed RVE had no pressure
  Matrix goal = Matrix::zero();
  std::vector<int> candidates;    ///< packings that have not been tried, the best one last
  int copies_before = 1;
  double gain = 0.0;
  rve::Counters of_packing;    ///< counters of the packing

  /// Returns the way to the stress of the failed RVE. If the failed RVE had no pressure, there is
  /// no stress to reach, and the way ends after one call without a servo.
  WayToStress<D> way(std::size_t index, double dt) const
  {
    rve::DriveOf<D> drive;
    drive.substeps = FRESH_STEPS_AT_ONCE;
    drive.dt = dt;
    if (is_open) return {index, renewal.slot, drive, HUGE_VAL, HUGE_VAL};
    drive = WayToStress<D>::servo(StressGoal::of<D>(goal), FRESH_STEPS_AT_ONCE);
    drive.dt = dt;
    drive.servo_gain = gain;
    drive.servo_max_rate = FRESH_STRAIN_PER_STEP / dt;
    return {index, renewal.slot, drive, FRESH_TOLERANCE * rve::norm(goal), FRESH_TOLERANCE};
  }
};

/// Replaces the RVE by its next candidate. Returns false if there is no candidate left.
template <int D>
bool RvePointsOf<D>::begin_fresh(Fresh &fresh, const std::vector<rve::RveStateOf<D>> &packings)
{
  const int slot = fresh.renewal.slot;
  while (!fresh.candidates.empty()) {
    fresh.renewal.packing = fresh.candidates.back();
    fresh.candidates.pop_back();
    rve::RveStateOf<D> state = packings[fresh.renewal.packing];
    state.material = points.at(slot).material;
    if (fresh.is_open) {
      const double stretch =
          std::pow((1.0 + fresh.renewal.void_ratio_before) / (1.0 + state.void_ratio()), 1.0 / D);
      if (stretch > 1.0) {
        state.cell = stretch * state.cell;
        state.pairs.clear();
        state.forget_list();
      }
    }
    fresh.of_packing = state.counters;
    fresh.gain = rve::default_servo_gain(state);
    if (replace(*engine, slot, state)) return true;
  }
  return false;
}

/// Advances fresh RVEs until they have reached their stresses or have failed.
template <int D>
void RvePointsOf<D>::bring_to_stress(std::vector<Fresh> &all, const std::vector<Way> &ways)
{
  std::vector<rve::ResultOf<D>> results;
  lead(
      ways,
      [](const std::vector<Way> &some, const Slots &) {
        Drives calls;
        for (const Way &way : some) calls.push_back(way.drive);
        return calls;
      },
      [&](const Slots &slots, const Drives &calls) { call_engine(slots, calls, results); },
      [&](const Way &way, std::size_t k) {
        if (results[k].status & rve::status::Fatal) return true;
        if (!way.is_at_rest(results[k]) && way.steps < MOST_FRESH_STEPS) return false;
        end_fresh(all[way.index]);
        return true;
      });
}

/// Completes a replacement. The fresh RVE takes over the deformation of the failed RVE and adds the
/// counters of the failed RVE to its own.
template <int D> void RvePointsOf<D>::end_fresh(Fresh &fresh)
{
  RenewalOf<D> &renewal = fresh.renewal;
  Point &point = points.modify(renewal.slot);
  rve::RveStateOf<D> state = engine->state(renewal.slot);
  renewal.steps = state.counters.steps - fresh.of_packing.steps;
  const auto go_on = [&](std::int64_t rve::Counters::*count) {
    state.counters.*count += fresh.before.counters.*count - fresh.of_packing.*count;
  };
  go_on(&rve::Counters::steps);
  go_on(&rve::Counters::rebuilds);
  go_on(&rve::Counters::lattice_reductions);
  go_on(&rve::Counters::repeats);
  state.deformation = fresh.before.deformation;
  state.servo_velocity_gradient = fresh.before.servo_velocity_gradient;
  state.energy = rve::EnergyTotals();
  std::vector<rve::ResultOf<D>> results;
  if (replace(*engine, renewal.slot, state))
    engine->advance({renewal.slot}, drives_at_rest(1), results);
  if (results.empty() || (results[0].status & rve::status::Fatal)) return;
  remove_shadow(renewal.slot);
  point.begin_with(results[0]);
  point.stale = false;
  point.state = State::Awake;
  point.servo_gain = fresh.gain;
  point.limit = rve::StiffeningLimit();    // always exceeded, so that the bound is checked
  note_stiffening(renewal.slot);
  point.drive = rve::DriveOf<D>();
  point.servo_error = point.out_of_reach = 0.0;
  point.rested = rve::ResultOf<D>();
  point.pending = Matrix::identity();
  point.evaluation.reset();
  point.energy_at_start.reset();
  ++point.renewals;
  renewal.stress = point.result.stress;
  renewal.void_ratio = point.result.void_ratio;
}

template <int D>
std::vector<RenewalOf<D>> RvePointsOf<D>::renew(const Slots &slots,
                                                const std::vector<rve::RveStateOf<D>> &packings,
                                                double dt)
{
  complete();
  std::vector<Fresh> all(slots.size());
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Fresh &fresh = all[k];
    const Point &point = points.at(slots[k]);
    fresh.renewal.slot = slots[k];
    fresh.before = engine->state(slots[k]);
    fresh.renewal.void_ratio_before = point.result.void_ratio;
    fresh.renewal.stress_before = point.result.stress;
    fresh.goal = 0.5 * (point.result.stress + rve::transpose(point.result.stress));
    fresh.is_open = !(point.result.mean_stress() > 0.0);
    fresh.candidates.resize(packings.size());
    std::iota(fresh.candidates.begin(), fresh.candidates.end(), 0);
    const auto distance = [&](int packing) {
      return std::fabs(packings[packing].void_ratio() - point.result.void_ratio);
    };
    std::stable_sort(fresh.candidates.begin(), fresh.candidates.end(),
                     [&](int a, int b) { return distance(a) > distance(b); });
    const auto best = std::max(0, static_cast<int>(packings.size()) - MOST_FRESH_TRIALS);
    fresh.candidates.erase(fresh.candidates.begin(), fresh.candidates.begin() + best);
    const bool was_just_made = point.renewals > 0 && point.drive.substeps == 0;
    if (was_just_made) fresh.candidates.clear();
    fresh.copies_before = point.copies;
  }
  for (const int slot : slots) points.modify(slot).copies = 1;

  // if an RVE fails on the way, its next packing is tried
  for (int trial = 0; trial < MOST_FRESH_TRIALS; ++trial) {
    std::vector<Way> ways;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (points.at(slots[k]).frozen() && begin_fresh(all[k], packings))
        ways.push_back(all[k].way(k, dt));
    bring_to_stress(all, ways);
  }

  std::vector<RenewalOf<D>> renewals;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    Fresh &fresh = all[k];
    if (points.at(slots[k]).frozen()) {    // the failed RVE is restored
      replace(*engine, slots[k], fresh.before);
      points.modify(slots[k]).copies = fresh.copies_before;
      fresh.renewal.packing = -1;
    }
    record_sizes[slots[k]] = 0;
    renewals.push_back(fresh.renewal);
  }
  return renewals;
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
