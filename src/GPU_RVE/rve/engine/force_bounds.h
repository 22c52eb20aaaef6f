// How large the sums of forces on a grain can become, and what a material asks of a program: for the unit of the integers
// (algorithm/call_state.h).

#ifndef RVE_ENGINE_FORCE_BOUNDS_H
#define RVE_ENGINE_FORCE_BOUNDS_H

#include "rve/engine/state.h"

namespace rve {

/// More neighbours than 2^8 would let the two limbs of a sum in `double` overflow.
constexpr int LARGEST_NEIGHBOR_BITS = 8;

/// Largest over smallest radius that always has no more [-].
template <int D> constexpr double LARGEST_SIZE_RATIO = D == 2 ? 60.0 : 6.6;

/// Bits for the number of the smallest grains that touch the largest one; at most one more than are allowed.
template <int D> int neighbor_bits(double smallest_radius, double largest_radius);
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius);
template <> int neighbor_bits<3>(double smallest_radius, double largest_radius);

/// Whether contacts have dashpots.
bool is_viscous(const Material &material);

/// Whether all forces count for the unit of forces, not the normal one and what friction could add to it.
bool all_forces_count(const Material &material);

/// Largest number that a contact may add to a sum of forces or torques, over its force that counts.
double obliquity_of(const Material &material, int dimension);

}    // namespace rve

#endif
