// SPDX-License-Identifier: GPL-2.0-only
// Hashes of the state of an RVE. The order of grains and pairs in an engine does not change the
// hash. Exchanging the two grains of a pair, with its history, does not change it either.

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

/// Returns -value, or a zero unchanged: the states of an engine have no negative zeros.
inline double opposite(double value)
{
  return value == 0.0 ? value : -value;
}

/// Exchanges the two grains of a pair of disks. The rolling force changes its sign. The tangential
/// force is stored as its component along the tangent vector. This component stays the same, since
/// the force and the tangent vector both change sign.
inline void see_from_partner(rve::Pair &pair)
{
  std::swap(pair.first, pair.second);
  pair.rolling_force = opposite(pair.rolling_force);
}

/// Exchanges the two grains of a pair of spheres. The tangential force changes its sign. The stored
/// numbers of rolling and twisting stay the same, since the moments and the normal both change
/// sign.
inline void see_from_partner(rve::PairOf<3> &pair)
{
  std::swap(pair.first, pair.second);
  for (int a = 0; a < 3; ++a) pair.tangential_force[a] = opposite(pair.tangential_force[a]);
}

/// Returns all pairs, sorted by the numbers of their grains. The first grain of each pair is the
/// one with the lower number. The order is unique, since two grains have at most one pair
/// (RveStateOf::check).
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

/// Returns true if the pair has a history. The numbers of a pair without history are all zero; the
/// pair is listed only because its grains are near.
template <int D> bool remembers(const rve::PairOf<D> &pair)
{
  for (const rve::RememberedNumber<D> &number : rve::pair_memory<D>())
    if (has_bits(number.of(pair))) return true;
  return false;
}

/// Adds the contact law, and the names and values of all parameters that are not zero. A new
/// parameter that is zero therefore changes no hash.
inline void add_material(rve_test::BitHash &hash, const rve::Material &material)
{
  hash.add(std::string(rve::word_of(material.law)));
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
    if (has_bits(material.*parameter.member))
      hash.add(std::string(parameter.name)).add(material.*parameter.member);
}

/// Adds everything on which the motion depends: material, cell, grains, histories of pairs, servo
/// and force scale. Verlet lists, counters and energies are omitted.
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

/// Adds the Verlet list: the positions of the grains when it was built, and its pairs.
template <int D> void add_list(rve_test::BitHash &hash, const rve::RveStateOf<D> &state)
{
  hash.add(state.list_cell).add(state.list_fractional).add(state.list_margin);
  hash.add(static_cast<std::uint64_t>(state.pairs.size()));
  for (const rve::PairOf<D> &pair : canonical_pairs(state)) hash.add(pair.first).add(pair.second);
}

}    // namespace golden
