// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/force_bounds.h"

#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rve {

namespace {

  /// Largest number that a contact may add to a sum of forces or torques, over its normal force: |f| = sqrt(1 + mu^2) f_n, or the moment
  /// (a mu + R mu_r) f_n. In internal units an arm a is below 1/2 and the reduced radius R below 1/4. Infinite where the normal force
  /// bounds no other, and where it bounds a twisting moment, by a length of the material.
  double possible_obliquity(const Material &material)
  {
    const bool is_bounded =
        with_law(material, [](const auto &law) { return law.bounds_tangential_forces; });
    if (!is_bounded || resists_twisting(material)) return std::numeric_limits<double>::infinity();
    const double force = std::sqrt(1.0 + material.friction * material.friction);
    const double moment = 0.5 * material.friction + 0.25 * material.rolling_friction;
    return resists_rolling(material) ? std::max(force, moment) : force;
  }

  /// Up to this obliquity, of friction 10, room for all that friction could do costs the sums less than four bits. Beyond it they
  /// would have few left for the forces that are there.
  const double LARGEST_OBLIQUITY = std::sqrt(1.0 + 10.0 * 10.0);

}    // namespace

// pi / asin(r / (r + R)) of the smallest grains stand side by side around the largest one, and a fifth more where overlaps bring them
// closer
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius)
{
  const double side_by_side = kPi / std::asin(smallest_radius / (smallest_radius + largest_radius));
  // the number is infinite where the quotient of the radii underflows
  return static_cast<int>(
      std::fmin(std::ceil(std::log2(1.2 * side_by_side)), LARGEST_NEIGHBOR_BITS + 1));
}

// Solid angles: of the sphere around the largest grain, 4 pi, each of the smallest ones hides 2 pi (1 - cos a), sin a = r / (r + R). They
// cover no more than 0.91 of it, in the plane of hexagons; a fifth more for overlaps.
template <> int neighbor_bits<3>(double smallest_radius, double largest_radius)
{
  const double sine = smallest_radius / (smallest_radius + largest_radius);
  const double hidden = 0.5 * sine * sine / (1.0 + std::sqrt(1.0 - sine * sine));
  const double around = 0.91 / hidden;
  return static_cast<int>(std::fmin(std::ceil(std::log2(1.2 * around)), LARGEST_NEIGHBOR_BITS + 1));
}

bool is_viscous(const Material &material)
{
  return with_law(material, [](const auto &law) {
    const ContactModuli dashpots = law.viscosity({1.0, 1.0, 1.0});
    return dashpots.largest() > 0.0;
  });
}

bool all_forces_count(const Material &material)
{
  return possible_obliquity(material) > LARGEST_OBLIQUITY;
}

// over the largest of f_n, f_t and f_r/2, |f| is at most sqrt(2), and a moment 1/2 + 2/4. In space that is of components, which are at
// least 1/sqrt(3) of a vector: sqrt(1 + 3), and of moments sqrt(3) as much and the twisting one, which counts beside f_r/2.
double obliquity_of(const Material &material, int dimension)
{
  if (!all_forces_count(material)) return possible_obliquity(material);
  if (dimension == 2) return std::sqrt(2.0);
  return resists_twisting(material) ? 1.0 + std::sqrt(3.0) : 2.0;
}

}    // namespace rve
