// SPDX-License-Identifier: GPL-2.0-only
// Byte images of states. Damaged images must be refused. A damaged image with a corrected checksum
// must be refused or give a state that the engine can use.

#include "engine/test_states.h"
#include "engine_check.h"
#include "rve/core/checksum.h"
#include "support/packings.h"

#include <cstring>

namespace {

using namespace rve;

// Byte positions in an image of serialize(): magic, version and number of grains, size, checksum of
// the bytes after the header.
constexpr std::size_t PLACE_OF_SIZE = 16, PLACE_OF_CHECKSUM = 24, HEADER = 32;

/// Returns the image with correct size and checksum.
std::string sealed(std::string image)
{
  if (image.size() < HEADER) return image;
  const std::uint64_t size = image.size();
  const std::uint64_t checksum = checksum_of(image.data() + HEADER, image.size() - HEADER);
  std::memcpy(&image[PLACE_OF_SIZE], &size, sizeof(size));
  std::memcpy(&image[PLACE_OF_CHECKSUM], &checksum, sizeof(checksum));
  return image;
}

void treat(const std::string &image)
{
  RveState state;
  try {
    state = deserialize(image.data(), image.size());
  } catch (const InputError &) {
    return;
  }
  const std::vector<char> again = serialize(state);
  if (std::string(again.begin(), again.end()) != image)
    fuzz::fail("an image that is read and written is another one");
  fuzz::check_in_engine(state);
}

}    // namespace

std::vector<std::string> fuzz::seeds()
{
  std::vector<RveState> states = {rve_test::two_disks(1e-4), rve_test::crowded_state(5, 1)};
  states.push_back(rve_test::triangular_packing(rve_test::paper_material(), 4, 4, 0.0037, 1));
  // The last state comes from the middle of a run. It has a Verlet list, contact histories and an
  // order of its grains.
  Options options;
  options.format = Format::Double;
  options.device = Device::Cpu;
  options.threads = 1;
  RveState shaken = states.back();
  shaken.material.rolling_stiffness = 5e5;
  shaken.material.rolling_friction = 0.3;
  rve_test::shake(shaken, 0.2, 2);
  options.contacts = contacts_of(shaken);
  const auto engine = make_engine(options);
  const int rve = engine->add(shaken);
  std::vector<Result> results;
  engine->advance({rve},
                  {Drive::constant_velocity_gradient(Tensor2{{-0.1, 0.3, 0.0, 0.0}}, 5e-5, 40)},
                  results);
  states.push_back(engine->state(rve));
  std::vector<std::string> inputs;
  for (const RveState &state : states) {
    const std::vector<char> image = serialize(state);
    inputs.emplace_back(image.begin(), image.end());
  }
  return inputs;
}

std::string fuzz::changed(const std::string &input, Mutator &mutator)
{
  return mutator.bytes(input);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
  const std::string image(reinterpret_cast<const char *>(data), size);
  treat(image);
  treat(sealed(image));
  return 0;
}
