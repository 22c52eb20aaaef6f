// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/force_bounds.h"

#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rve {

namespace {

  /// Returns the ratio of the largest contribution of a contact to a sum of forces or torques, to
  /// its normal force f_n [-]. The force |f| is at most sqrt(1 + mu^2) f_n with the friction mu.
  /// The moment is at most (a mu + R mu_r) f_n with the rolling friction mu_r. In internal units a
  /// lever arm a is below 1/2 and the reduced radius R below 1/4. The result is infinite if the law
  /// does not bound tangential forces by the normal force. It is also infinite if contacts resist
  /// twisting, since the bound of a twisting moment contains a length of the material.
  double possible_obliquity(const Material &material)
  {
    const bool is_bounded =
        with_law(material, [](const auto &law) { return law.bounds_tangential_forces; });
    if (!is_bounded || resists_twisting(material)) return std::numeric_limits<double>::infinity();
    const double force = std::sqrt(1.0 + material.friction * material.friction);
    const double moment = 0.5 * material.friction + 0.25 * material.rolling_friction;
    return resists_rolling(material) ? std::max(force, moment) : force;
  }

  /// Largest obliquity, that of friction 10, for which the force unit is set from the normal
  /// forces. The sums then have capacity for all possible friction forces, which takes less than
  /// four bits. A larger capacity would leave too few bits for the actual forces.
  const double LARGEST_OBLIQUITY = std::sqrt(1.0 + 10.0 * 10.0);

}    // namespace

// The number of smallest grains (radius r) around the largest one (radius R) is pi / asin(r / (r +
// R)). Overlaps bring grains closer and add a fifth.
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius)
{
  const double side_by_side = kPi / std::asin(smallest_radius / (smallest_radius + largest_radius));
  // fmin() is needed because the number is infinite if the quotient of the radii underflows.
  return static_cast<int>(
      std::fmin(std::ceil(std::log2(1.2 * side_by_side)), LARGEST_NEIGHBOR_BITS + 1));
}

// The number follows from solid angles. Seen from the centre of the largest grain, a smallest grain
// covers the solid angle 2 pi (1 - cos a) of 4 pi, with sin a = r / (r + R). Together the grains
// cover at most a share of 0.91, the share of the plane that a hexagonal packing of disks covers.
// Overlaps add a fifth.
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

// If all forces count, the force that sets the unit is, for disks, the largest of f_n, f_t and
// f_r/2. In units of this force |f| is at most sqrt(2), and a moment is at most 1/2 + 2/4. For
// spheres the force is found from the largest component of a vector, which is at least 1/sqrt(3) of
// its length. So |f| is at most sqrt(1 + 3). A moment is at most sqrt(3) times the moment of disks,
// plus the twisting moment, which is compared in the same way as f_r/2.
double obliquity_of(const Material &material, int dimension)
{
  if (!all_forces_count(material)) return possible_obliquity(material);
  if (dimension == 2) return std::sqrt(2.0);
  return resists_twisting(material) ? 1.0 + std::sqrt(3.0) : 2.0;
}

}    // namespace rve
