// SPDX-License-Identifier: GPL-2.0-only
// Records of points, as in restart files and in the exchange between ranks. A damaged record must
// be refused. Damaged records are also tested with corrected checksums: such a record must be
// refused, or give a point whose advance ends normally or with an InputError.

#include "fuzz_target.h"
#include "macro/rve_points.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "support/packings.h"

#include <cstring>

namespace {

using namespace rve;
using macro::MacroStepOptions;
using macro::RvePoints;

RvePoints make_points(bool with_shadows)
{
  Options options;
  options.device = Device::Cpu;
  options.threads = 1;
  Options precise = options;
  precise.format = Format::Double;
  MacroStepOptions macro;
  macro.quiescent_strain = 1e-6;
  return RvePoints(make_engine(options), with_shadows ? make_engine(precise) : nullptr, macro);
}

// Byte positions in the head of a record. The head has the version, the checksum of the head, and
// the sizes in bytes of two images: of the state and of its shadow. While the checksum is computed,
// its own bytes are zero.
constexpr std::size_t PLACE_OF_CHECKSUM = 8, PLACE_OF_BYTES = 16, PLACE_OF_SHADOW = 24;
// positions in an image of a state
constexpr std::size_t STATE_CHECKSUM = 24, STATE_HEADER = 32;

std::uint64_t word_at(const std::string &bytes, std::size_t place)
{
  std::uint64_t word = 0;
  if (place + 8 <= bytes.size()) std::memcpy(&word, &bytes[place], 8);
  return word;
}

std::size_t in_doubles(std::uint64_t bytes)
{
  return (bytes + 7) / 8 * 8;
}

/// Returns the size of the head of an undamaged record in bytes.
std::size_t head_size(const std::string &record)
{
  return record.size() - in_doubles(word_at(record, PLACE_OF_BYTES)) -
      in_doubles(word_at(record, PLACE_OF_SHADOW));
}

std::size_t size_of_heads = 0;

/// Returns the record with correct checksums of its head and its state.
std::string sealed(std::string record)
{
  if (size_of_heads == 0) fuzz::seeds();
  const std::size_t head = size_of_heads;
  const std::uint64_t bytes = word_at(record, PLACE_OF_BYTES);
  if (record.size() < head + STATE_HEADER) return record;
  if (bytes > STATE_HEADER && bytes <= record.size() - head) {
    const std::uint64_t of_state = checksum_of(&record[head + STATE_HEADER], bytes - STATE_HEADER);
    std::memcpy(&record[head + STATE_CHECKSUM], &of_state, 8);
  }
  std::memset(&record[PLACE_OF_CHECKSUM], 0, 8);
  const std::uint64_t of_head = checksum_of(record.data(), head);
  std::memcpy(&record[PLACE_OF_CHECKSUM], &of_head, 8);
  return record;
}

std::string bytes_of(const std::vector<double> &record)
{
  return {reinterpret_cast<const char *>(record.data()), record.size() * sizeof(double)};
}

/// Adds a point from a record and advances it. If `is_sealed` is false, an accepted record must
/// equal a seed.
void treat(const std::string &bytes, bool is_sealed)
{
  std::vector<double> record(bytes.size() / sizeof(double));
  if (record.empty()) return;
  std::memcpy(record.data(), bytes.data(), record.size() * sizeof(double));
  for (const bool with_shadows : {false, true}) {
    RvePoints points = make_points(with_shadows);
    int slot;
    try {
      slot = points.add_record(record.data(), record.size());
    } catch (const InputError &) {
      continue;
    }
    if (!is_sealed) {
      const std::vector<std::string> seeds = fuzz::seeds();
      const auto is_this = [&](const std::string &seed) {
        // Up to 7 bytes of the last double are unused.
        return seed.size() == record.size() * 8 &&
            std::memcmp(seed.data(), bytes.data(), seed.size() - 7) == 0;
      };
      if (std::none_of(seeds.begin(), seeds.end(), is_this))
        fuzz::fail("a damaged record is accepted");
    }
    points.record(slot);
    const Drive drive = Drive::constant_velocity_gradient(Tensor2{{-0.1, 0.3, 0.0, 0.0}}, 1e-6, 2);
    try {
      points.advance({slot}, {drive}, true);
      points.advance({slot}, {drive}, false);
      points.point(slot);
    } catch (const InputError &) {
    }
  }
}

}    // namespace

std::vector<std::string> fuzz::seeds()
{
  static const std::vector<std::string> records = [] {
    Material material;
    material.normal_stiffness = 1e6;
    material.tangential_stiffness = 8e5;
    material.friction = 0.5;
    material.density = 2650.0;
    material.local_damping = 0.3;
    material.thickness = 0.075;
    RveState packing = rve_test::triangular_packing(material, 4, 4, 0.0037, 1);
    RvePoints points = make_points(true);
    const std::vector<int> slots = points.add({&packing, &packing, &packing});
    points.add_shadow(slots[1]);
    const Drive works = Drive::constant_velocity_gradient(Tensor2{{-0.1, 0.3, 0.0, 0.0}}, 5e-5, 20),
                sleeps =
                    Drive::constant_velocity_gradient(Tensor2{{-1e-9, 0.0, 0.0, 0.0}}, 5e-5, 20);
    for (int step = 0; step < 3; ++step) points.advance(slots, {works, works, sleeps}, true);
    std::vector<std::string> list;
    for (const int slot : slots) list.push_back(bytes_of(points.record(slot)));
    size_of_heads = head_size(list.front());
    return list;
  }();
  return records;
}

std::string fuzz::changed(const std::string &input, Mutator &mutator)
{
  return mutator.bytes(input);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
  const std::string record(reinterpret_cast<const char *>(data), size);
  treat(record, false);
  treat(sealed(record), true);
  return 0;
}
