// SPDX-License-Identifier: GPL-2.0-only
// Bounds of the sums of forces on a grain, and features that a material needs. Forces are added as
// integers, and the bounds set the unit of these integers (algorithm/call_state.h).

#pragma once

#include "rve/engine/contact_laws.h"
#include "rve/engine/state.h"

namespace rve {

/// Largest number of bits that a sum reserves for the number of neighbours. With more than 2^8
/// neighbours the two limbs of a sum in `double` would overflow.
constexpr int LARGEST_NEIGHBOR_BITS = 8;

/// Largest ratio of largest to smallest radius for which a grain has at most
/// 2^LARGEST_NEIGHBOR_BITS neighbours [-]. `has_reach`: grains act on each other before they touch.
template <int D> constexpr double largest_size_ratio(bool has_reach)
{
  return D == 2 ? (has_reach ? 15.0 : 60.0) : (has_reach ? 2.8 : 6.6);
}

/// Returns the number of bits for the number of neighbours: the largest number of grains of the
/// smallest radius that touch a grain of the largest radius. The result is at most
/// LARGEST_NEIGHBOR_BITS + 1.
template <int D> int neighbor_bits(double smallest_radius, double largest_radius);
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius);
template <> int neighbor_bits<3>(double smallest_radius, double largest_radius);

/// Returns neighbor_bits() for grains that act on each other within the reach of the material. A
/// reach of at most the smallest radius increases the number of neighbours at most by a factor of
/// four.
template <int D>
int neighbor_bits(double smallest_radius, double largest_radius, const Material &material)
{
  return neighbor_bits<D>(smallest_radius, largest_radius) + (reach_of(material) > 0.0 ? 2 : 0);
}

/// Returns true if contacts have dashpots.
bool is_viscous(const Material &material);

/// Returns true if the unit of forces must account for all forces, and not just for the normal
/// force and its possible friction.
bool all_forces_count(const Material &material);

/// Returns the largest contribution of a contact to a sum of forces or torques, over the force that
/// sets the unit [-].
double obliquity_of(const Material &material, int dimension);

}    // namespace rve
