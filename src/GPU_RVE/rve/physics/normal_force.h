// SPDX-License-Identifier: GPL-2.0-only
// Normal contact laws.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// Linear spring, equation (13a): f_n = k_n overlap [force], repulsion positive.
  template <class Real> struct LinearNormal {
    Real stiffness;    ///< k_n [force/length]

    RVE_INLINE Real force(Real overlap) const { return stiffness * overlap; }
    RVE_INLINE Real elastic_energy(Real overlap) const
    {
      return Real(0.5) * stiffness * overlap * overlap;
    }
  };

  /// Dashpot beside the spring, LAMMPS `pair granular hooke ... damping velocity`: f = -gamma_n v_n, v_n the normal velocity of
  /// j relative to i (separation positive).
  template <class Real> struct VelocityDamping {
    Real viscosity;    ///< gamma [force time/length]

    RVE_INLINE Real force(Real normal_velocity) const { return -viscosity * normal_velocity; }
  };

}    // namespace RVE_ISA
}    // namespace rve
