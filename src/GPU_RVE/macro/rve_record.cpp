// SPDX-License-Identifier: GPL-2.0-only
// Record of an RVE and of its shadow, for messages between ranks and for restart files.

#include "macro/rve_points.h"

#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/no_padding.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <type_traits>

namespace macro {

namespace {

  // Head of a record. It is followed by the bytes of the state and, if there is a shadow, of the
  // state of the shadow.
  template <int D> struct RecordHead {
    std::uint64_t version;
    std::uint64_t checksum;    // checksum of the head with checksum = 0; states have their own
    std::uint64_t bytes, shadow_bytes;    // sizes of the states
    std::uint32_t frozen, further_copies, rest, renewals;
    std::int32_t contacts, limit_contacts;
    double peak_force, limit_force, limit_pressure;
    double grain_size, servo_gain;
    rve::DriveOf<D> drive;
    double servo_error;
    PathState<D> path;
    rve::Tensor<double, D> pending, shadow_stress;
    rve::ResultOf<D> result, rested;
  };

  /// True if neither the head nor a struct in it has padding.
  template <int D> constexpr bool is_without_padding()
  {
    using rve::Counters, rve::has_no_padding;
    using Head = RecordHead<D>;
    using Drive = rve::DriveOf<D>;
    using Path = PathState<D>;
    using Result = rve::ResultOf<D>;
    using Energy = rve::EnergyTotals;
    return has_no_padding(&Head::version, &Head::checksum, &Head::bytes, &Head::shadow_bytes,
                          &Head::frozen, &Head::further_copies, &Head::rest, &Head::renewals,
                          &Head::contacts, &Head::limit_contacts, &Head::peak_force,
                          &Head::limit_force, &Head::limit_pressure, &Head::grain_size,
                          &Head::servo_gain, &Head::drive, &Head::servo_error, &Head::path,
                          &Head::pending, &Head::shadow_stress, &Head::result, &Head::rested) &&
        has_no_padding(&Drive::dt, &Drive::substeps, &Drive::unused, &Drive::deformation,
                       &Drive::controlled, &Drive::unused_bytes, &Drive::stress_goal,
                       &Drive::velocity_gradient, &Drive::servo_gain, &Drive::servo_max_rate,
                       &Drive::modes, &Drive::num_modes, &Drive::modes_begin) &&
        has_no_padding(&Path::path, &Path::stage, &Path::direction, &Path::limit, &Path::reversals,
                       &Path::rounds, &Path::ended, &Path::steered, &Path::time, &Path::begin) &&
        has_no_padding(&Result::status, &Result::unused, &Result::stress, &Result::cell,
                       &Result::deformation, &Result::fabric, &Result::void_ratio,
                       &Result::coordination_number, &Result::mechanical_coordination_number,
                       &Result::sliding_fraction, &Result::unbalanced_ratio,
                       &Result::kinetic_energy, &Result::elastic_energy, &Result::largest_overlap,
                       &Result::mean_overlap, &Result::largest_contact_force, &Result::peak_force,
                       &Result::servo_velocity_gradient, &Result::num_grains, &Result::num_contacts,
                       &Result::num_pairs, &Result::num_rattlers, &Result::counters,
                       &Result::energy) &&
        has_no_padding(&Counters::steps, &Counters::rebuilds, &Counters::lattice_reductions,
                       &Counters::repeats) &&
        has_no_padding(&Energy::work, &Energy::friction, &Energy::local_damping, &Energy::viscous);
  }

  /// Size of the head in doubles.
  template <int D> constexpr std::size_t head_size()
  {
    using Head = RecordHead<D>;
    static_assert(std::is_trivially_copyable<Head>::value, "the head is copied as bytes");
    static_assert(sizeof(Head) % sizeof(double) == 0, "the head is a whole number of doubles");
    static_assert(is_without_padding<D>(), "all bytes of the head are set");
    return sizeof(Head) / sizeof(double);
  }

  // "rve pt" for disks or "rve sp" for spheres, and a number that changes with the layout
  template <int D>
  constexpr std::uint64_t RECORD_VERSION = D == 2 ? 0x7276652070740009u : 0x7276652073700006u;
  // Version of the records of RVEs that consist of several copies or have replaced a failed RVE.
  // Records of other RVEs stay readable for older programs.
  template <int D> constexpr std::uint64_t VERSION_WITH_COPIES = RECORD_VERSION<D> + 1;
  /// Values of RecordHead::rest.
  constexpr rve::Rest RESTS[] = {rve::Rest::Unknown, rve::Rest::Quiescent, rve::Rest::Rests,
                                 rve::Rest::Moves, rve::Rest::Wakes};

  template <int D> std::uint64_t checksum_of_head(RecordHead<D> head)
  {
    head.checksum = 0;
    return rve::checksum_of(&head, sizeof(head));
  }

  /// Calls copy(a, b) for each member that a head and a point have in common.
  template <class Head, class Point, class Copy>
  void for_common(Head &head, Point &point, const Copy &copy)
  {
    copy(head.contacts, point.contacts);
    copy(head.peak_force, point.peak_force);
    copy(head.limit_contacts, point.limit.num_contacts);
    copy(head.limit_force, point.limit.peak_force);
    copy(head.limit_pressure, point.limit.pressure);
    copy(head.grain_size, point.grain_size);
    // the gain is stored because its default follows from radii that were not yet rounded by a
    // number format
    copy(head.servo_gain, point.servo_gain);
    copy(head.drive, point.drive);
    copy(head.servo_error, point.servo_error);
    copy(head.path, point.path);
    copy(head.pending, point.pending);
    copy(head.shadow_stress, point.shadow_stress);
    copy(head.result, point.result);
    copy(head.rested, point.rested);
  }

  std::size_t doubles_for(std::size_t bytes)
  {
    // (bytes + 7) / 8 could overflow, since `bytes` of a damaged record can be any number
    return bytes / sizeof(double) + (bytes % sizeof(double) ? 1 : 0);
  }

  /// Reads a state from its bytes.
  template <int D> rve::RveStateOf<D> state_from(const double *begin, std::size_t bytes)
  {
    return rve::deserialize<D>(reinterpret_cast<const char *>(begin), bytes);
  }

}    // namespace

template <int D> std::vector<double> RvePointsOf<D>::record(int slot) const
{
  const Point &point = this->point(slot);
  const std::vector<char> state = rve::serialize(engine->state(slot));
  std::vector<char> shadow;
  if (point.shadow >= 0) shadow = rve::serialize(shadows->state(point.shadow));
  const std::size_t begin_of_shadow = head_size<D>() + doubles_for(state.size());
  std::vector<double> record(begin_of_shadow + doubles_for(shadow.size()), 0.0);
  RecordHead<D> head{};
  head.version =
      point.copies == 1 && point.renewals == 0 ? RECORD_VERSION<D> : VERSION_WITH_COPIES<D>;
  head.bytes = state.size();
  head.shadow_bytes = shadow.size();
  head.frozen = point.frozen() ? 1 : 0;
  head.rest = static_cast<std::uint32_t>(
      std::find(std::begin(RESTS), std::end(RESTS), point.rest()) - std::begin(RESTS));
  head.further_copies = static_cast<std::uint32_t>(point.copies - 1);
  head.renewals = static_cast<std::uint32_t>(point.renewals);
  for_common(head, point, [](auto &to, const auto &from) { to = from; });
  head.checksum = checksum_of_head(head);
  std::memcpy(record.data(), &head, sizeof(head));
  std::memcpy(record.data() + head_size<D>(), state.data(), state.size());
  if (!shadow.empty()) std::memcpy(record.data() + begin_of_shadow, shadow.data(), shadow.size());
  record_sizes[slot] = static_cast<int>(record.size());
  return record;
}

template <int D> int RvePointsOf<D>::add_record(const double *record, std::size_t size)
{
  const auto require_whole = [size](bool whole, const char *what) {
    rve::require(whole, [&] {
      return "its record of " + std::to_string(size) + " numbers is damaged: " + what;
    });
  };
  require_whole(size > head_size<D>(), "it is shorter than its header");
  RecordHead<D> head;
  std::memcpy(static_cast<void *>(&head), record, sizeof(head));
  const bool is_known = head.version >= RECORD_VERSION<D> && head.version <= VERSION_WITH_COPIES<D>;
  rve::require(is_known || head.version >> 16 != RECORD_VERSION<D> >> 16, [&] {
    return "its record has version " + std::to_string(head.version & 0xffff) +
        "; this program reads versions " + std::to_string(RECORD_VERSION<D> & 0xffff) + " to " +
        std::to_string(VERSION_WITH_COPIES<D> & 0xffff);
  });
  require_whole(is_known, "it does not begin like a record of an RVE");
  require_whole(head.checksum == checksum_of_head(head),
                "the checksum of its header does not match");
  const std::size_t of_state = doubles_for(head.bytes), of_shadow = doubles_for(head.shadow_bytes);
  require_whole(of_state <= size && of_shadow <= size &&
                    head_size<D>() + of_state + of_shadow == size,
                "the lengths of its parts do not add up to its length");
  const rve::RveStateOf<D> state = state_from<D>(record + head_size<D>(), head.bytes);
  constexpr std::uint32_t most = std::numeric_limits<std::int32_t>::max();
  const std::uint64_t copies = std::uint64_t{head.further_copies} + 1;
  require_whole(head.renewals <= most && copies <= most && (copies & (copies - 1)) == 0 &&
                    static_cast<std::uint64_t>(state.num_grains()) % copies == 0,
                "its number of copies does not fit its number of grains");
  require_whole(head.rest < std::size(RESTS), "its quiescent state is unknown");
  std::optional<rve::RveStateOf<D>> shadow;
  if (of_shadow > 0) shadow = state_from<D>(record + head_size<D>() + of_state, head.shadow_bytes);

  expect(rve::contacts_of(state));
  if (shadow) expect(rve::contacts_of(*shadow));
  const int slot = engine->add(state);
  Point &point = initialise(slot, state);
  for_common(head, point, [](const auto &from, auto &to) { to = from; });
  const rve::Rest rest = RESTS[head.rest];
  point.state = head.frozen     ? State::Frozen
      : rve::has_deferred(rest) ? State::Quiescent
                                : State::Awake;
  if (rest != rve::Rest::Unknown)
    point.evaluation = {rest == rve::Rest::Quiescent || rest == rve::Rest::Rests,
                        point.last_steps().mean_overlap, std::nullopt};
  point.copies = static_cast<std::int32_t>(copies);
  point.renewals = static_cast<std::int32_t>(head.renewals);
  any_copies = any_copies || copies > 1;
  // a script without shadows ignores the shadow of a restart file
  if (shadow && shadows) point.shadow = shadows->add(*shadow);
  return slot;
}

template <int D> int RvePointsOf<D>::record_size(int slot) const
{
  if (record_sizes[slot] == 0) record(slot);
  return record_sizes[slot];
}

template <int D> int RvePointsOf<D>::record_bound(int slot) const
{
  // A grain has radius, coordinates, velocities, spins, list coordinates and index. The number of
  // pairs can double.
  constexpr int of_grain = 1 + 3 * D + rve::Space<D>::spins + 1;
  constexpr int of_pair = sizeof(rve::PairOf<D>) / sizeof(double);
  const Point &point = points.unsynchronised(slot);
  const rve::ResultOf<D> &result = point.result;
  const int of_state = of_grain * result.num_grains +
      2 * of_pair * std::max(result.num_pairs, result.num_grains) + 256;
  const int times = std::max(1, options.most_copies / point.copies);    // growth by further copies
  return static_cast<int>(head_size<D>()) + (point.shadow >= 0 ? 2 : 1) * times * of_state;
}

template class RvePointsOf<2>;
template class RvePointsOf<3>;

}    // namespace macro
