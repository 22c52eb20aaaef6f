// SPDX-License-Identifier: GPL-2.0-only
// RVEs whose cells become too narrow for their grains. Such an RVE is replaced by copies of itself
// side by side. The copies form the same periodic medium.

#include "macro/rve_points.h"

#include "rve/engine/copies.h"

#include <algorithm>
#include <exception>

namespace macro {

/// Replaces the RVE with this number. Returns false if the engine cannot add the state, for example
/// for lack of memory; then nothing has changed.
template <int D>
bool RvePointsOf<D>::replace(rve::EngineOf<D> &engine, int number, const rve::RveStateOf<D> &state)
{
  const rve::RveStateOf<D> before = engine.state(number);
  engine.remove(number);
  // the next RVE gets the free number
  try {
    engine.add(state);
  } catch (const std::exception &) {
    engine.add(before);
    return false;
  }
  return true;
}

/// Estimates whether the memory suffices for an RVE with twice this number of grains and for its
/// calls. The estimate does not include later growth of the pair lists.
template <int D> bool RvePointsOf<D>::has_memory_for_copies(int num_grains) const
{
  const rve::Memory memory = engine->memory();
  if (!memory.is_known) return true;
  const int wanted = 2 * num_grains;
  int of_copies = 1, largest = 0;
  for (const int other : used_slots()) {
    if (copies(other) == 1) continue;
    ++of_copies;
    largest = std::max(largest, points.unsynchronised(other).result.num_grains);
  }
  double bytes = static_cast<double>(engine->bytes_per_rve(wanted)) -
      static_cast<double>(engine->bytes_per_rve(num_grains));
  if (wanted > largest)
    bytes += static_cast<double>(engine->bytes_of_call(of_copies, wanted)) -
        static_cast<double>(largest > 0 ? engine->bytes_of_call(of_copies - 1, largest) : 0);
  return bytes <= static_cast<double>(memory.free);
}

/// Replaces an RVE by two copies of itself side by side and evaluates the result. Returns false,
/// without a change, if the number of copies is at its limit, if the medium is one grain across
/// (rve::is_one_grain_across()), or if the memory does not suffice.
template <int D> bool RvePointsOf<D>::widen(int slot)
{
  Point &point = points.modify(slot);
  if (2 * point.copies > options.most_copies) return false;
  const rve::RveStateOf<D> state = engine->state(slot);
  if (rve::is_one_grain_across(state, point.copies)) return false;
  if (!has_memory_for_copies(state.num_grains())) return false;
  if (!replace(*engine, slot, rve::side_by_side(state))) return false;

  any_copies = true;
  point.copies *= 2;
  point.contacts *= 2;
  point.limit.num_contacts *= 2;
  point.evaluation.reset();
  point.energy_at_start.reset();
  widened.push_back(slot);
  std::vector<rve::ResultOf<D>> results;
  engine->advance({slot}, drives_at_rest(1), results);
  // a cell that is still too narrow fails again in the next call
  if (!(results[0].status & rve::status::Fatal)) point.take_details(results[0]);
  return true;
}

/// Replaces each shadow whose cell is too narrow by two copies of itself, and repeats its call.
/// Shadows and RVEs have the same largest number of copies.
template <int D>
void RvePointsOf<D>::widen_shadows(const Slots &slots, const Drives &drives,
                                   std::vector<rve::ResponseOf<D>> &responses)
{
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const Point &point = points.unsynchronised(slots[k]);
    while (responses[k].status & rve::status::CellTooNarrow) {
      const rve::RveStateOf<D> state = shadows->state(point.shadow);
      const int copies = state.num_grains() * point.copies / engine->state(slots[k]).num_grains();
      if (2 * copies > options.most_copies || rve::is_one_grain_across(state, copies) ||
          !replace(*shadows, point.shadow, rve::side_by_side(state)))
        break;
      record_sizes[slots[k]] = 0;
      std::vector<rve::ResponseOf<D>> again;
      shadows->advance({point.shadow}, {drives[k]}, again);
      responses[k] = again[0];
    }
  }
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
