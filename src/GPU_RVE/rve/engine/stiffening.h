// SPDX-License-Identifier: GPL-2.0-only
// Test if an RVE has become so much stiffer that the bound of its time step must be checked again.
// The same test runs on the host and on a device.

#pragma once

#include "rve/core/config.h"

#include <cstdint>
#include <limits>

namespace rve {

/// Measures on which the stiffness of a packing depends.
struct StiffnessMeasures {
  std::int32_t num_contacts = 0;
  double peak_force = 0.0;    ///< largest contact force of the last call [force]
  double pressure = 0.0;      ///< mean stress, compression positive [stress]
};

/// Measures above which the time-step bound of an RVE is checked again.
///
/// The largest eigenvalue of a packing, its highest frequency squared, grows with the number of
/// contacts and with their moduli. A modulus of Hertz' law grows with the cube root of the force.
/// The limit allows the number of contacts and the moduli to grow by a tenth each. The eigenvalue
/// then grows by a fifth, and the bound falls by a tenth. This is the initial margin of `dt auto`.
struct StiffeningLimit {
  std::int32_t num_contacts = -1;
  double peak_force = -1.0;    ///< [force]
  double pressure = -1.0;      ///< [stress]

  RVE_HD bool is_exceeded(const StiffnessMeasures &now) const
  {
    return now.num_contacts > num_contacts || now.peak_force > peak_force ||
        now.pressure > pressure;
  }
};

/// Allowed growth of the number of contacts: a share of the contacts plus a share of the grains.
/// The share of the grains matters in a packing with few contacts, where a single new contact would
/// exceed the first share.
constexpr double CONTACT_GROWTH = 0.1, CONTACT_GROWTH_PER_GRAIN = 0.02;
/// Allowed ratio of the new force to the old force, for moduli that depend on forces. At this ratio
/// a modulus of Hertz' law has grown by a tenth.
constexpr double FORCE_GROWTH = 1.1 * 1.1 * 1.1;

/// Returns the limit for an RVE whose bound has just been checked. With constant moduli only the
/// number of contacts has a limit.
inline StiffeningLimit stiffening_limit(const StiffnessMeasures &now, std::int32_t num_grains,
                                        bool has_constant_moduli)
{
  constexpr double NONE = std::numeric_limits<double>::infinity();
  return {static_cast<std::int32_t>((1.0 + CONTACT_GROWTH) * now.num_contacts +
                                    CONTACT_GROWTH_PER_GRAIN * num_grains),
          has_constant_moduli ? NONE : FORCE_GROWTH * now.peak_force,
          has_constant_moduli ? NONE : FORCE_GROWTH * (now.pressure > 0.0 ? now.pressure : 0.0)};
}

}    // namespace rve
