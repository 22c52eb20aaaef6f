// SPDX-License-Identifier: GPL-2.0-only
// Sums over the pairs of a grain. Each component of a force is rounded once to an integer and added
// with opposite signs to the two grains. The sums therefore do not depend on the order of the
// pairs, and momentum is conserved to the last bit.

#pragma once

#include "rve/algorithm/kernel_traits.h"
#include "rve/core/fixed_point.h"
#include "rve/core/integer_sums.h"
#include "rve/physics/laws/law.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  template <class Config> struct GrainSum {
    Vec<typename Config::Sum, Config::freedoms> own;    ///< force and torque on the owner
    /// With kRelaxedSpheres: sum of torques, until round_torque() writes it to `own`.
    Vec<typename Config::Real, Config::spins> torque;
    typename Config::Real largest_force;                     ///< force that sets the unit of forces
    Vec<typename Config::Sum, Config::components> stress;    ///< Love terms, if requested
    /// With kRelaxedSpheres: sum of Love terms, until round_love() writes it to `stress`.
    Vec<typename Config::Real, Config::components> love;
    std::int32_t contacts,
        over_limit;             ///< contacts, and contacts beyond the overlap limit, if requested
    Dissipation dissipation;    ///< in kernels with energy bookkeeping
  };

  /// Returns an empty sum whose largest force is that of earlier contacts.
  template <class Config> RVE_INLINE GrainSum<Config> begin_sum(typename Config::Real largest_force)
  {
    GrainSum<Config> sum = {};
    sum.largest_force = largest_force;
    return sum;
  }

  /// Adds the force and the torque of a pair to the sum of grain i. Returns the force and the
  /// torque on grain j.
  template <class Config, class Force>
  RVE_INLINE Vec<typename Config::Sum, Config::freedoms>
  add_force_and_torque(const Truth<typename Config::Real> &acting, const Force &force,
                       GrainSum<Config> &sum)
  {
    using Sum = typename Config::Sum;
    constexpr int D = Config::D;
    Vec<Sum, Config::freedoms> on_j;
    Vec<Sum, Config::spins> torque_i;
    for (int a = 0; a < D; ++a) round_to(where(acting, -force.force[a]), on_j[a]);
    for (int k = 0; k < Config::spins; ++k) {
      on_j[D + k] = torque_i[k] = Sum(0);
      if constexpr (Config::has_friction) {
        round_to(where(acting, spin_component(force.torque_j, k)), on_j[D + k]);
        const auto mine = where(acting, spin_component(force.torque_i, k));
        if constexpr (kRelaxedSpheres<D>)
          sum.torque[k] = sum.torque[k] + mine;
        else
          round_to(mine, torque_i[k]);
      }
    }
    for (int a = 0; a < D; ++a) sum.own[a] = wrapping_difference(sum.own[a], on_j[a]);
    if constexpr (!kRelaxedSpheres<D>)
      for (int k = 0; k < Config::spins; ++k)
        sum.own[D + k] = wrapping_sum(sum.own[D + k], torque_i[k]);
    return on_j;
  }

  /// Adds the Love terms of one contact: the force on grain i times the branch from i to j
  /// (equation 24, tension positive). A term is no larger than the force, since a branch is no
  /// longer than one internal length. The term does not depend on which grain is i, since both
  /// factors change sign if the grains are exchanged. A kinetic term is not needed: with c' = F/m
  /// the energy balance closes without it.
  template <class Config>
  RVE_INLINE void add_love_term(const Truth<typename Config::Real> &acting,
                                const Vec<typename Config::Real, Config::D> &force,
                                const Vec<typename Config::Real, Config::D> &branch,
                                GrainSum<Config> &sum)
  {
    const auto stress = dyad(force, branch);
    for (int k = 0; k < Config::components; ++k) {
      const auto mine = where(acting, stress.component[k]);
      if constexpr (kRelaxedSpheres<Config::D>) {
        sum.love[k] = sum.love[k] + mine;
      } else {
        typename Config::Sum units;
        round_to(mine, units);
        sum.stress[k] = wrapping_sum(sum.stress[k], units);
      }
    }
  }

  template <class Config> RVE_INLINE void round_torque(GrainSum<Config> &sum)
  {
    if constexpr (kRelaxedSpheres<Config::D>)
      for (int k = 0; k < Config::spins; ++k) round_to(sum.torque[k], sum.own[Config::D + k]);
  }

  template <class Config> RVE_INLINE void round_love(GrainSum<Config> &sum)
  {
    if constexpr (kRelaxedSpheres<Config::D>)
      for (int k = 0; k < Config::components; ++k) round_to(sum.love[k], sum.stress[k]);
  }

}    // namespace RVE_ISA
}    // namespace rve
