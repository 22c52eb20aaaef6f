// SPDX-License-Identifier: GPL-2.0-only
// Bounds of the sum of forces on a grain, and functions that return if a material needs dashpots or
// a larger bound. Forces are added as integers, and the bounds set the unit of these integers
// (algorithm/call_state.h).

#pragma once

#include "rve/engine/contact_laws.h"
#include "rve/engine/state.h"

namespace rve {

/// Largest number of bits that an integer sum reserves for the number of neighbours. With more than
/// 2^8 neighbours a sum in `double`, which consists of two integers, would overflow.
constexpr int LARGEST_NEIGHBOR_BITS = 8;

/// Largest ratio of largest to smallest radius for which a grain has at most
/// 2^LARGEST_NEIGHBOR_BITS neighbours [-]. `has_reach` is true if grains act on each other before
/// they touch.
template <int D> constexpr double largest_size_ratio(bool has_reach)
{
  return D == 2 ? (has_reach ? 15.0 : 60.0) : (has_reach ? 2.8 : 6.6);
}

/// Returns the number of bits that the largest number of neighbours takes. This is the number of
/// grains of the smallest radius that fit around a grain of the largest radius. The result is at
/// most LARGEST_NEIGHBOR_BITS + 1.
template <int D> int neighbor_bits(double smallest_radius, double largest_radius);
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius);
template <> int neighbor_bits<3>(double smallest_radius, double largest_radius);

/// Returns neighbor_bits() for grains that act on each other within the reach of the material. The
/// reach is at most the smallest radius, so it increases the number of neighbours at most by a
/// factor of four.
template <int D>
int neighbor_bits(double smallest_radius, double largest_radius, const Material &material)
{
  return neighbor_bits<D>(smallest_radius, largest_radius) + (reach_of(material) > 0.0 ? 2 : 0);
}

/// Returns true if contacts have dashpots.
bool is_viscous(const Material &material);

/// Returns true if the force unit must be set from the largest force of any kind. It is false if
/// the normal forces bound all other forces closely enough to set the unit.
bool all_forces_count(const Material &material);

/// Returns the ratio of the largest contribution of a contact to a sum of forces or torques, to the
/// force that sets the unit [-].
double obliquity_of(const Material &material, int dimension);

}    // namespace rve
