// SPDX-License-Identifier: GPL-2.0-only
// Checks that each state which a reader accepts is usable in the engine.

#pragma once

#include "fuzz_target.h"
#include "rve/core/error.h"
#include "rve/engine/engine.h"

#include <cmath>
#include <string>

namespace fuzz {

/// Returns true if all material parameters, cell components and radii are zero or have a magnitude
/// between 1e-60 and 1e60. Products of four such numbers, and sums of these products, stay within
/// the range of doubles.
template <int D> bool is_moderate(const rve::RveStateOf<D> &state)
{
  constexpr double MOST = 1e60;
  const auto moderate = [](double x) {
    return x == 0.0 || (std::fabs(x) <= MOST && std::fabs(x) >= 1.0 / MOST);
  };
  const rve::Material &m = state.material;
  bool all = true;
  for (const double x :
       {m.normal_stiffness, m.tangential_stiffness, m.friction, m.rolling_stiffness,
        m.rolling_friction, m.density, m.thickness, m.mass_depth})
    all = all && moderate(x);
  for (const double x : state.cell.component) all = all && moderate(x);
  for (const double x : state.radius) all = all && moderate(x);
  return all;
}

/// Checks in every format that the engine refuses the state, reports a failed call, or returns
/// finite numbers. Results of states that are not moderate are allowed to be infinite or NaN.
template <int D> void check_in_engine(const rve::RveStateOf<D> &state)
{
  constexpr int MOST_GRAINS = 5000;    // a changed file can have too many grains for a short test
  if (state.num_grains() > MOST_GRAINS) return;
  for (const rve::Format format :
       {rve::Format::Fast, rve::Format::Mixed, rve::Format::Double, rve::Format::Single}) {
    rve::Options options;
    options.format = format;
    options.device = rve::Device::Cpu;
    options.threads = 1;
    std::vector<rve::ResultOf<D>> results;
    options.contacts = rve::contacts_of(state);
    try {
      const auto engine = rve::make_engine<D>(options);
      const int rve = engine->add(state);
      engine->advance({rve}, {rve::DriveOf<D>()}, results);
    } catch (const rve::InputError &) {
      continue;
    }
    const rve::ResultOf<D> &result = results[0];
    if ((result.status & rve::status::Fatal) || !is_moderate(state)) continue;
    for (const double s : result.stress.component)
      if (!std::isfinite(s))
        fail("stress " + rve::number(s) + " in format " + to_string(format) +
             " without a fatal status: " + rve::describe_status(result.status));
    if (!std::isfinite(result.void_ratio) || !std::isfinite(result.elastic_energy))
      fail("void ratio " + rve::number(result.void_ratio) + ", elastic energy " +
           rve::number(result.elastic_energy) + " in format " + to_string(format) +
           " without a fatal status");
  }
}

}    // namespace fuzz
