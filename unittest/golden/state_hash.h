// SPDX-License-Identifier: GPL-2.0-only
// Hashes of the state of an RVE. They do not depend on the order in which an engine keeps grains
// and pairs, or on which grain of a pair owns it.

#pragma once

#include "rve/engine/state.h"
#include "support/bit_hash.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace golden {

/// Returns -value. A zero keeps its sign, as in the states that an engine returns.
inline double opposite(double value)
{
  return value == 0.0 ? value : -value;
}

/// Describes a pair of disks from its second grain, which becomes the first. The moment on it is
/// the opposite one. So are the tangential force and the tangent: its number stays.
inline void see_from_partner(rve::Pair &pair)
{
  std::swap(pair.first, pair.second);
  pair.rolling_force = opposite(pair.rolling_force);
}

/// Describes a pair of spheres from its second grain, which becomes the first. The tangential force
/// on it is the opposite one. So are the moments, and the normal too: their numbers stay.
inline void see_from_partner(rve::PairOf<3> &pair)
{
  std::swap(pair.first, pair.second);
  for (int a = 0; a < 3; ++a) pair.tangential_force[a] = opposite(pair.tangential_force[a]);
}

/// Returns all pairs, each from its grain with the lower number, sorted by the numbers of both
/// grains. The order is unique, since two grains have one pair at most (RveStateOf::check).
template <int D> std::vector<rve::PairOf<D>> canonical_pairs(const rve::RveStateOf<D> &state)
{
  std::vector<rve::PairOf<D>> pairs = state.pairs;
  for (rve::PairOf<D> &pair : pairs)
    if (pair.first > pair.second) see_from_partner(pair);
  std::sort(pairs.begin(), pairs.end(), [](const rve::PairOf<D> &a, const rve::PairOf<D> &b) {
    return std::make_pair(a.first, a.second) < std::make_pair(b.first, b.second);
  });
  return pairs;
}

inline bool has_bits(double value)
{
  return value != 0.0 || std::signbit(value);
}

/// Returns false if all numbers are zero: the pair is in the list because its grains are near.
template <int D> bool remembers(const rve::PairOf<D> &pair)
{
  for (const rve::RememberedNumber<D> &number : rve::pair_memory<D>())
    if (has_bits(number.of(pair))) return true;
  return false;
}

/// Adds parameters by their names and without those that are zero: a new parameter changes no hash.
inline void add_material(rve_test::BitHash &hash, const rve::Material &material)
{
  hash.add(std::string(rve::word_of(material.law)));
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
    if (has_bits(material.*parameter.member))
      hash.add(std::string(parameter.name)).add(material.*parameter.member);
}

/// Adds all that the motion depends on: material, cell, grains, memory of pairs, servo and scale of
/// forces. Lists of neighbours, counters and energies are left out.
template <int D> void add_state(rve_test::BitHash &hash, const rve::RveStateOf<D> &state)
{
  add_material(hash, state.material);
  hash.add(state.cell).add(state.deformation);
  hash.add(state.radius).add(state.fractional).add(state.velocity).add(state.spin);
  std::vector<rve::PairOf<D>> pairs = canonical_pairs(state);
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [](const rve::PairOf<D> &pair) { return !remembers(pair); }),
              pairs.end());
  hash.add(static_cast<std::uint64_t>(pairs.size()));
  for (const rve::PairOf<D> &pair : pairs) {
    hash.add(pair.first).add(pair.second);
    for (const rve::RememberedNumber<D> &number : rve::pair_memory<D>()) hash.add(number.of(pair));
  }
  hash.add(state.servo_velocity_gradient).add(state.largest_contact_force);
}

/// Adds the Verlet list: where grains were when it was built, and which pairs it has.
template <int D> void add_list(rve_test::BitHash &hash, const rve::RveStateOf<D> &state)
{
  hash.add(state.list_cell).add(state.list_fractional).add(state.list_margin);
  hash.add(static_cast<std::uint64_t>(state.pairs.size()));
  for (const rve::PairOf<D> &pair : canonical_pairs(state)) hash.add(pair.first).add(pair.second);
}

}    // namespace golden
