// SPDX-License-Identifier: GPL-2.0-only
// How large the sums of forces on a grain can become, and what a material asks of a program: for the unit of the integers
// (algorithm/call_state.h).

#pragma once

#include "rve/engine/contact_laws.h"
#include "rve/engine/state.h"

namespace rve {

/// More neighbours than 2^8 would let the two limbs of a sum in `double` overflow.
constexpr int LARGEST_NEIGHBOR_BITS = 8;

/// Largest over smallest radius that always has no more [-], of grains that act on each other beyond touching or not.
template <int D> constexpr double largest_size_ratio(bool has_reach)
{
  return D == 2 ? (has_reach ? 15.0 : 60.0) : (has_reach ? 2.8 : 6.6);
}

/// Bits for the number of the smallest grains that touch the largest one; at most one more than are allowed.
template <int D> int neighbor_bits(double smallest_radius, double largest_radius);
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius);
template <> int neighbor_bits<3>(double smallest_radius, double largest_radius);

/// The same of those that act on it. A reach of up to the smallest radius makes the layer around the largest grain in which their centres lie
/// no more than four times as full.
template <int D>
int neighbor_bits(double smallest_radius, double largest_radius, const Material &material)
{
  return neighbor_bits<D>(smallest_radius, largest_radius) + (reach_of(material) > 0.0 ? 2 : 0);
}

/// Whether contacts have dashpots.
bool is_viscous(const Material &material);

/// Whether all forces count for the unit of forces, not the normal one and what friction could add to it.
bool all_forces_count(const Material &material);

/// Largest number that a contact may add to a sum of forces or torques, over its force that counts.
double obliquity_of(const Material &material, int dimension);

}    // namespace rve
