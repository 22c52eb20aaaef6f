// SPDX-License-Identifier: GPL-2.0-only
// An engine with one RVE, and comparisons of states.

#pragma once

#include "engine/test_states.h"
#include "rve/engine/engine.h"
#include "rve/engine/packing_io.h"

#include <algorithm>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace rve_test {

constexpr rve::Format ALL_FORMATS[] = {rve::Format::Double, rve::Format::Mixed, rve::Format::Fast};

inline rve::Options cpu_options(rve::Format format = rve::Format::Double, int threads = 1)
{
  rve::Options options;
  options.format = format;
  options.device = rve::Device::Cpu;
  options.threads = threads;
  return options;
}

/// Returns 400 disks at rest at 100 kPa (20 kPa: A20_h0075.rve), without tangential forces.
inline rve::RveState paper_packing(const std::string &file = "A_h0075.rve")
{
  return rve::read_packing(std::string(RVE_PACKINGS_DIR) + "/" + file);
}

/// Returns the paper's packing with halved radii and no contacts (gaps of a few millimetres).
inline rve::RveState paper_gas()
{
  rve::RveState state = paper_packing();
  for (double &r : state.radius) r *= 0.5;
  return state;
}

/// Returns a velocity gradient with one component.
inline rve::Tensor2 gradient(int a, int b, double rate)
{
  rve::Tensor2 l = rve::Tensor2::zero();
  l(a, b) = rate;
  return l;
}

inline rve::Tensor2 spin_gradient(double rate)
{
  return gradient(1, 0, rate) + gradient(0, 1, -rate);
}

/// Returns the options with the contact model of these RVEs.
inline rve::Options with_contacts_of(const std::vector<rve::RveState> &states, rve::Options options)
{
  options.contacts = rve::contacts_of(states);
  return options;
}

class RveRig {
 public:
  explicit RveRig(const rve::RveState &state, const rve::Options &options = cpu_options()) :
      engine(rve::make_engine(with_contacts_of({state}, options))), number(engine->add(state))
  {
  }

  const rve::Result &advance(const rve::Drive &drive)
  {
    engine->advance({number}, {drive}, results);
    return results[0];
  }

  /// Applies a constant velocity gradient in `calls` calls of `substeps` steps.
  const rve::Result &strain(const rve::Tensor2 &l, double dt, int substeps, int calls = 1)
  {
    const rve::Drive drive = rve::Drive::constant_velocity_gradient(l, dt, substeps);
    for (int k = 0; k < calls; ++k) advance(drive);
    return results[0];
  }

  const rve::Result &evaluate() { return advance(rve::Drive()); }
  const rve::Result &result() const { return results[0]; }
  rve::RveState state() const { return engine->state(number); }
  rve::Engine &owner() { return *engine; }
  int rve_number() const { return number; }

 private:
  std::unique_ptr<rve::Engine> engine;
  int number;
  std::vector<rve::Result> results;
};

/// Returns the nonzero tangential forces, sorted by the numbers of their grains. The order of the
/// list has no influence.
inline std::vector<std::tuple<int, int, double>> histories(const rve::RveState &state)
{
  std::vector<std::tuple<int, int, double>> all;
  for (const rve::Pair &pair : state.pairs)
    if (pair.tangential_force != 0.0)
      all.emplace_back(std::min(pair.first, pair.second), std::max(pair.first, pair.second),
                       pair.tangential_force);
  std::sort(all.begin(), all.end());
  return all;
}

/// Returns the nonzero rolling forces, sorted by the numbers of their grains. The sign is that for
/// the grain with the lower number.
inline std::vector<std::tuple<int, int, double>> rolling_histories(const rve::RveState &state)
{
  std::vector<std::tuple<int, int, double>> all;
  for (const rve::Pair &pair : state.pairs)
    if (pair.rolling_force != 0.0)
      all.emplace_back(std::min(pair.first, pair.second), std::max(pair.first, pair.second),
                       pair.first < pair.second ? pair.rolling_force : -pair.rolling_force);
  std::sort(all.begin(), all.end());
  return all;
}

template <int D> std::vector<double> components(const rve::Tensor<double, D> &t)
{
  return std::vector<double>(std::begin(t.component), std::end(t.component));
}

/// Returns the state after it is written to bytes and read again.
inline rve::RveState restarted(const rve::RveState &state)
{
  const std::vector<char> image = rve::serialize(state);
  return rve::deserialize(image.data(), image.size());
}

/// Returns the packing with its grains in reverse order. Pairs then have other owners, and every
/// sum has another order. The packing must not have a list or a history.
inline rve::RveState numbered_backwards(const rve::RveState &packing)
{
  const int n = packing.num_grains();
  rve::RveState backwards = packing;
  for (int i = 0; i < n; ++i) {
    backwards.radius[i] = packing.radius[n - 1 - i];
    for (int a = 0; a < 2; ++a)
      backwards.fractional[2 * i + a] = packing.fractional[2 * (n - 1 - i) + a];
  }
  return backwards;
}

/// Returns true if cell, positions, velocities, spins and contact histories are the same to the
/// last bit; the pair lists can differ.
inline bool same_motion(const rve::RveState &a, const rve::RveState &b)
{
  return components(a.cell) == components(b.cell) &&
      components(a.deformation) == components(b.deformation) && a.fractional == b.fractional &&
      a.velocity == b.velocity && a.spin == b.spin && histories(a) == histories(b) &&
      rolling_histories(a) == rolling_histories(b);
}

/// Returns true if all results from contacts are the same to the last bit.
inline bool same_answer(const rve::Result &a, const rve::Result &b)
{
  return a.status == b.status && components(a.stress) == components(b.stress) &&
      components(a.fabric) == components(b.fabric) && a.num_contacts == b.num_contacts &&
      a.sliding_fraction == b.sliding_fraction && a.elastic_energy == b.elastic_energy &&
      a.kinetic_energy == b.kinetic_energy && a.largest_contact_force == b.largest_contact_force &&
      a.unbalanced_ratio == b.unbalanced_ratio;
}

}    // namespace rve_test
