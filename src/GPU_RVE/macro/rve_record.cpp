// The record of an RVE and of its shadow, in which they travel between ranks and into restart files.

#include "macro/rve_points.h"

#include "rve/core/checksum.h"
#include "rve/core/error.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>

namespace macro {

namespace {

  // in front of the bytes of the state, and of those of its shadow if it has one
  struct RecordHead {
    std::uint64_t version;
    std::uint64_t checksum;    // of the head, with zero in this place; the states have their own
    std::uint64_t bytes, shadow_bytes;    // of the states
    std::uint64_t frozen, asleep;
    std::int32_t contacts, most_contacts;
    double grain_size, servo_gain;
    rve::Drive drive;
    rve::Tensor2 pending, shadow_stress;
    rve::Result result, rested;
  };
  static_assert(std::is_trivially_copyable<RecordHead>::value, "the head is copied as bytes");
  static_assert(sizeof(RecordHead) % sizeof(double) == 0, "the head is a whole number of doubles");

  constexpr std::size_t HEAD = sizeof(RecordHead) / sizeof(double);

  // "rve point", and a number that changes with the layout
  constexpr std::uint64_t RECORD_VERSION = 0x7276652070740004u;

  /// Of the bytes of a head, whatever lies between its members.
  std::uint64_t checksum_of_head(const double *record)
  {
    char head[sizeof(RecordHead)];
    std::memcpy(head, record, sizeof(head));
    std::memset(head + offsetof(RecordHead, checksum), 0, sizeof(RecordHead::checksum));
    return rve::checksum_of(head, sizeof(head));
  }

  std::size_t doubles_for(std::size_t bytes)
  {
    // bytes may be any number
    return bytes / sizeof(double) + (bytes % sizeof(double) ? 1 : 0);
  }

  /// The state whose bytes begin here.
  rve::RveState state_from(const double *begin, std::size_t bytes)
  {
    return rve::deserialize(reinterpret_cast<const char *>(begin), bytes);
  }

}    // namespace

std::vector<double> RvePoints::record(int slot) const
{
  const Point &point = this->point(slot);
  const std::vector<char> state = rve::serialize(engine->state(slot));
  std::vector<char> shadow;
  if (point.shadow >= 0) shadow = rve::serialize(shadows->state(point.shadow));
  const std::size_t begin_of_shadow = HEAD + doubles_for(state.size());
  std::vector<double> record(begin_of_shadow + doubles_for(shadow.size()), 0.0);
  RecordHead head{};
  head.version = RECORD_VERSION;
  head.bytes = state.size();
  head.shadow_bytes = shadow.size();
  head.frozen = point.frozen() ? 1 : 0;
  head.asleep = point.asleep() ? 1 : 0;
  head.contacts = point.contacts;
  head.most_contacts = point.most_contacts;
  head.grain_size = point.grain_size;
  head.servo_gain = point.servo_gain;
  head.drive = point.drive;
  head.pending = point.pending;
  head.shadow_stress = point.shadow_stress;
  head.result = point.result;
  head.rested = point.rested;
  std::memcpy(record.data(), &head, sizeof(head));
  const std::uint64_t checksum = checksum_of_head(record.data());
  std::memcpy(reinterpret_cast<char *>(record.data()) + offsetof(RecordHead, checksum), &checksum,
              sizeof(checksum));
  std::memcpy(record.data() + HEAD, state.data(), state.size());
  if (!shadow.empty()) std::memcpy(record.data() + begin_of_shadow, shadow.data(), shadow.size());
  record_sizes[slot] = static_cast<int>(record.size());
  return record;
}

int RvePoints::add_record(const double *record, std::size_t size)
{
  const auto require_whole = [size](bool whole, const char *what) {
    rve::require(whole, [&] {
      return "its record of " + std::to_string(size) + " numbers is damaged: " + what;
    });
  };
  require_whole(size > HEAD, "that is less than its head");
  RecordHead head;
  std::memcpy(static_cast<void *>(&head), record, sizeof(head));
  rve::require(head.version == RECORD_VERSION || head.version >> 16 != RECORD_VERSION >> 16, [&] {
    return "its record has version " + std::to_string(head.version & 0xffff) +
        "; this program reads version " + std::to_string(RECORD_VERSION & 0xffff);
  });
  require_whole(head.version == RECORD_VERSION, "it does not begin as one");
  require_whole(head.checksum == checksum_of_head(record),
                "the checksum of its head does not match");
  const std::size_t of_state = doubles_for(head.bytes), of_shadow = doubles_for(head.shadow_bytes);
  require_whole(of_state <= size && of_shadow <= size && HEAD + of_state + of_shadow == size,
                "its parts are not as long as the whole");
  const rve::RveState state = state_from(record + HEAD, head.bytes);
  std::optional<rve::RveState> shadow;
  if (of_shadow > 0) shadow = state_from(record + HEAD + of_state, head.shadow_bytes);

  expect(rve::contacts_of(state));
  if (shadow) expect(rve::contacts_of(*shadow));
  const int slot = engine->add(state);
  Point &point = settle(slot, state);
  point.result = head.result;
  point.rested = head.rested;
  point.state = head.frozen ? State::Frozen : head.asleep ? State::Asleep : State::Awake;
  point.contacts = head.contacts;
  point.most_contacts = head.most_contacts;
  point.grain_size = head.grain_size;
  point.servo_gain =
      head.servo_gain;    // of the radii that the packing had, before a format rounded them
  point.drive = head.drive;
  point.pending = head.pending;
  point.shadow_stress = head.shadow_stress;
  // a script that asks for no shadows leaves those of a restart file behind
  if (shadow && shadows) point.shadow = shadows->add(*shadow);
  return slot;
}

int RvePoints::record_size(int slot) const
{
  if (record_sizes[slot] == 0) record(slot);
  return record_sizes[slot];
}

int RvePoints::record_bound(int slot) const
{
  // per grain: radius, 2 coordinates, 2 velocities, spin, 2 list coordinates, place; the rest generously, with room for as many
  // pairs again
  constexpr int of_pair = sizeof(rve::Pair) / sizeof(double);
  const rve::Result &result = points[slot].result;
  const int of_state =
      9 * result.num_grains + 2 * of_pair * std::max(result.num_pairs, result.num_grains) + 256;
  return static_cast<int>(HEAD) + (points[slot].shadow >= 0 ? 2 : 1) * of_state;
}

}    // namespace macro
