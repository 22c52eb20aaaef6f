// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/force_bounds.h"

#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rve {

namespace {

  /// Returns the largest contribution of a contact to a sum of forces or torques, over its normal
  /// force f_n. The force is |f| = sqrt(1 + mu^2) f_n with the friction mu. The moment is (a mu + R
  /// mu_r) f_n with the rolling friction mu_r. In internal units a lever arm a is below 1/2 and the
  /// reduced radius R below 1/4. The result is infinite if the law does not bound tangential forces
  /// by the normal force. It is also infinite if contacts resist twisting, since the bound of a
  /// twisting moment contains a length of the material.
  double possible_obliquity(const Material &material)
  {
    const bool is_bounded =
        with_law(material, [](const auto &law) { return law.bounds_tangential_forces; });
    if (!is_bounded || resists_twisting(material)) return std::numeric_limits<double>::infinity();
    const double force = std::sqrt(1.0 + material.friction * material.friction);
    const double moment = 0.5 * material.friction + 0.25 * material.rolling_friction;
    return resists_rolling(material) ? std::max(force, moment) : force;
  }

  /// Largest obliquity (friction 10) for which the sums have capacity for all possible friction
  /// forces. This capacity takes less than four bits of the sums. A larger one would leave few bits
  /// for the actual forces.
  const double LARGEST_OBLIQUITY = std::sqrt(1.0 + 10.0 * 10.0);

}    // namespace

// The number of smallest grains (radius r) around the largest one (radius R) is pi / asin(r / (r +
// R)). Overlaps bring grains closer and add a fifth.
template <> int neighbor_bits<2>(double smallest_radius, double largest_radius)
{
  const double side_by_side = kPi / std::asin(smallest_radius / (smallest_radius + largest_radius));
  // The number is infinite if the quotient of the radii underflows.
  return static_cast<int>(
      std::fmin(std::ceil(std::log2(1.2 * side_by_side)), LARGEST_NEIGHBOR_BITS + 1));
}

// The number follows from solid angles: each smallest grain hides 2 pi (1 - cos a) of the 4 pi
// around the largest grain, with sin a = r / (r + R). All of them hide at most a share of 0.91, as
// a hexagonal packing of disks covers the plane. Overlaps add a fifth.
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

// If all forces count, the reference force for disks is the largest of f_n, f_t and f_r/2. Relative
// to it |f| is at most sqrt(2), and a moment at most 1/2 + 2/4. For spheres the reference contains
// the largest component of a vector, which is at least 1/sqrt(3) of its length. So |f| is at most
// sqrt(1 + 3). A moment is at most sqrt(3) times that of disks plus the twisting moment, which
// enters the reference like f_r/2.
double obliquity_of(const Material &material, int dimension)
{
  if (!all_forces_count(material)) return possible_obliquity(material);
  if (dimension == 2) return std::sqrt(2.0);
  return resists_twisting(material) ? 1.0 + std::sqrt(3.0) : 2.0;
}

}    // namespace rve
