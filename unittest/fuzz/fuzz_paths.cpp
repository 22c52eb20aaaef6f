// SPDX-License-Identifier: GPL-2.0-only
// Loading paths. Any text must be a path or cause an InputError that names the position. At every
// step along a path, the drive must be sound or an InputError must be thrown.

#include "fuzz_target.h"

#include "macro/load_path.h"

#include "rve/core/error.h"
#include "rve/engine/drive_record.h"

#include <cmath>
#include <string>
#include <vector>

namespace {

using rve::InputError;

constexpr const char *TABLE = "time a b\n0 0 -1e5\n0.5 1e-3 -2e5\n2 0 -1e5\n";

std::string table_of(const std::string &file)
{
  rve::require(file == "table", "there is no " + file);
  return TABLE;
}

/// Makes up to 40 steps along a path. The results of the steps are made up, with alternating
/// stresses that trigger the events of the path.
template <int D> void follow(const macro::LoadPathsOf<D> &paths, int path)
{
  const macro::PathStep step{1e-3, 10, 1e-2, 1.0};
  const std::vector<double> values(paths.script_names().size(), -1e5);
  macro::PathState<D> state;
  paths.begin(state, path, rve::Tensor<double, D>::identity());
  rve::ResultOf<D> result;
  for (int k = 0; k < 40 && !state.ended; ++k) {
    try {
      const rve::DriveOf<D> drive = paths.drive(state, step, values.data(), result.deformation);
      rve::check(drive);
      // Under a servo the deformation of the made-up result is left unchanged.
      result.deformation =
          (drive.has_servo() ? rve::Tensor<double, D>::identity() : drive.deformation) *
          result.deformation;
    } catch (const InputError &) {
      return;    // a value is too large for a step
    }
    result.stress = (k % 2 ? -1e5 : -3e5) * rve::Tensor<double, D>::identity();
    result.stress(0, 1) = result.stress(1, 0) = 1e4 * (k % 5 - 2);
    paths.follow(state, step, result, values.data());
    paths.check(state);
  }
}

template <int D> void read(const std::string &text, bool in_script)
{
  std::size_t used = 0;
  try {
    const auto words = macro::path_words(text, "text");
    const macro::LoadPathsOf<D> paths(words, table_of, in_script ? &used : nullptr);
    if (used > words.size()) fuzz::fail("a path takes more words than there are");
    for (int path = 0; path < paths.size(); ++path) follow(paths, path);
  } catch (const InputError &error) {
    if (std::string(error.what()).empty()) fuzz::fail("an error says nothing");
  }
}

}    // namespace

std::vector<std::string> fuzz::seeds()
{
  return {"path undrained\nstage rate zz -0.5 rate volume 0 stress xx-yy 0\nuntil strain zz < "
          "-0.02\nuntil ratio > 0.6\n"
          "path b\nstage rate zz -0.5\nstress xx -1e5 stress b zz yy xx 0.5\nreverse stress qz "
          "-2e4 2e4\nuntil cycles > 2\n",
          "stage stress p ramp 1e5 2e5 0.05 stress xx-yy 0\nrate xy wave 0 0.1 0.2 90\nuntil time "
          "> 0.02 repeat 3 1\n"
          "stage circle 1e5 2e4 1\nuntil void_ratio < 0.1\n",
          "stage strain xx table table a\nstrain xy table table 2 stress yy v_side # side\nuntil "
          "stress 2*xx-1e-1*yy > -4e5\n"
          "stage\nuntil time > 0.05\n"};
}

std::string fuzz::changed(const std::string &input, Mutator &mutator)
{
  return mutator.once_in(6) ? mutator.bytes(input) : mutator.lines(input);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
  const std::string text(reinterpret_cast<const char *>(data), size);
  for (const bool in_script : {false, true}) {
    read<2>(text, in_script);
    read<3>(text, in_script);
  }
  try {
    macro::PathTable(text, "table").column("2");
  } catch (const InputError &) {
  }
  return 0;
}
