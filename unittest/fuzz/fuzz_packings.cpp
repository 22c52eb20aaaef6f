// SPDX-License-Identifier: GPL-2.0-only
// Packing files and libraries. For any text, the readers either return packings that the engine can
// use, or throw an InputError that names the file.

#include "engine/test_states.h"
#include "engine_check.h"
#include "rve/engine/packing_io.h"
#include "support/packings.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

namespace {

using namespace rve;

/// Returns the path of a file of this process.
std::string path_for(const std::string &name)
{
  static const std::filesystem::path folder = [] {
    const auto path = std::filesystem::temp_directory_path() /
        ("fuzz_packings_" + std::to_string(static_cast<long>(getpid())));
    std::filesystem::create_directories(path);
    return path;
  }();
  return (folder / name).string();
}

std::string content_of(const std::string &path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void expect_named(const InputError &error, const std::string &path)
{
  if (std::string(error.what()).find(path) == std::string::npos)
    fuzz::fail("an error does not name the file: " + std::string(error.what()));
}

template <int D> void read_as_packing(const std::string &path)
{
  RveStateOf<D> state;
  try {
    state = read_packing<D>(path);
  } catch (const InputError &error) {
    expect_named(error, path);
    return;
  }
  // Comments and contacts without forces are not written. The first copy may therefore differ from
  // the input, but the second copy must equal the first.
  const std::string copy = path_for("copy"), copy_of_copy = path_for("copy_of_copy");
  try {
    write_packing(copy, state);
  } catch (const InputError &error) {
    fuzz::fail("a packing that was read cannot be written: " + std::string(error.what()));
  }
  write_packing(copy_of_copy, read_packing<D>(copy));
  if (content_of(copy) != content_of(copy_of_copy))
    fuzz::fail("a packing that is written and read is another one");
  fuzz::check_in_engine(state);
}

/// Checks that dimension_of_packing() returns 2 or 3, or throws an InputError that names the file.
void read_dimension(const std::string &path)
{
  try {
    const int dimension = dimension_of_packing(path);
    if (dimension != 2 && dimension != 3) fuzz::fail("a packing has no such dimension");
  } catch (const InputError &error) {
    expect_named(error, path);
  }
}

template <int D> void read_as_library(const std::string &path)
{
  PackingLibraryOf<D> library;
  try {
    library = read_library<D>(path);
  } catch (const InputError &error) {
    expect_named(error, path);
    return;
  }
  library.check();
  const std::string copy = path_for("copy");
  write_library(copy, library);
  if (read_library<D>(copy).packings.size() != library.packings.size())
    fuzz::fail("a library that is written and read is another one");
}

/// Replaces the checksum of a file by `none`. With a checksum, the reader would refuse every
/// change.
std::string without_checksum(const std::string &text)
{
  std::vector<std::string> lines = fuzz::Mutator::split(text, '\n');
  for (std::string &line : lines)
    if (line.rfind("checksum", 0) == 0) line = "checksum none";
  return fuzz::Mutator::joined(lines, "\n") + "\n";
}

}    // namespace

std::vector<std::string> fuzz::seeds()
{
  Material material;
  material.normal_stiffness = 1e6;
  material.tangential_stiffness = 8e5;
  material.friction = 0.5;
  material.density = 2650.0;
  material.thickness = 0.075;
  RveState state = rve_test::triangular_packing(material, 4, 4, 0.0037, 1);
  rve_test::shake(state, 0.1, 2);
  for (int i = 0; i + 1 < state.num_grains(); ++i) state.pairs.push_back({i, i + 1, 0.1 * i});
  RveState rolling = state;
  rolling.material.rolling_stiffness = 5e5;
  rolling.material.rolling_friction = 0.3;
  for (Pair &pair : rolling.pairs) pair.rolling_force = 0.2;
  PackingLibrary library;
  for (const RveState &packing : {state, rolling}) {
    LibraryRow row{};
    row.num_grains = packing.num_grains();
    row.void_ratio = packing.void_ratio();
    row.overconsolidation_ratio = 1.0;
    row.pressure = 1e5;
    library.add(row, packing);
  }
  std::vector<std::string> inputs;
  const std::string path = path_for("seed");
  for (const RveState &packing : {state, rolling}) {
    write_packing(path, packing);
    inputs.push_back(content_of(path));
  }
  write_library(path, library);
  inputs.push_back(content_of(path));

  const RveStateOf<3> spheres = rve_test::crowded_spheres(12, 5);
  write_packing(path, spheres);
  inputs.push_back(content_of(path));
  PackingLibraryOf<3> library_of_spheres;
  LibraryRow row{};
  row.num_grains = spheres.num_grains();
  row.void_ratio = spheres.void_ratio();
  row.overconsolidation_ratio = 1.0;
  library_of_spheres.add(row, spheres);
  write_library(path, library_of_spheres);
  inputs.push_back(content_of(path));
  return inputs;
}

std::string fuzz::changed(const std::string &input, Mutator &mutator)
{
  if (mutator.once_in(10)) return mutator.bytes(input);
  const std::string text = mutator.once_in(8) ? input : without_checksum(input);
  return mutator.once_in(6) ? mutator.bytes(text) : mutator.lines(text);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
  const std::string path = path_for("input");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char *>(data), static_cast<std::streamsize>(size));
  read_dimension(path);
  read_as_packing<2>(path);
  read_as_library<2>(path);
  read_as_packing<3>(path);
  read_as_library<3>(path);
  return 0;
}
