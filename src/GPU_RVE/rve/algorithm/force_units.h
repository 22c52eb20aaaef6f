// SPDX-License-Identifier: GPL-2.0-only
// Unit of forces of a call, chosen by the expected forces.

#pragma once

#include "rve/algorithm/call_state.h"
#include "rve/physics/laws/law.h"

namespace rve {
inline namespace RVE_ISA {

  /// Smallest ratio of overlap to mean radius for which the force scale is chosen. A packing with
  /// smaller overlaps would be too stiff for all formats.
  constexpr double kLeastOverlapShare = 1e-9;

  /// Returns the contact law in `double` and in units of the script.
  template <class Config> RVE_INLINE auto law_of_script(const PreparedCall<Config> &call)
  {
    using Law = typename Config::Law::template In<DoubleNumbers>;
    typename Law::Constants constants;
    constants.set(call.header.material, LawUnits::same(), call.batch.velocity_arm);
    Law law;
    law.take(constants);
    return law;
  }

  /// Chooses the internal units, and the contact law in these units.
  template <class Block, class Config> struct ForceUnits {
    using Item = typename Block::Item;
    using Real = typename Config::Real;
    using Wide = typename Config::Wide;

    /// Chooses the force unit and the contact law in internal units. One thread calls it.
    static RVE_INLINE void choose_units(PreparedCall<Config> &call)
    {
      const StateHeader<Config::D> &header = call.header;
      // The last call can have ended at the first touch of a collision. If the unit were chosen for
      // the small force of this touch, the allowed repeats of a call would not reach the unit that
      // the collision needs.
      const double radius = header.mean_radius;
      const double least = law_of_script<Config>(call)
                               .stiffness({kGasOverlapShare * radius, radius, radius})
                               .normal *
          (kLeastOverlapShare * radius);
      if (!(call.expected_force > least)) call.expected_force = least;
      call.units.choose_force(Config::sum_bits, header.neighbor_bits, call.expected_force,
                              header.obliquity, header.inverse_obliquity);
      call.law.set(header.material, LawUnits{call.units.length, call.units.per_force},
                   call.batch.velocity_arm);
      call.law.dt = static_cast<Real>(call.drive.substeps > 0 ? call.drive.dt : 0.0);
      call.alpha = static_cast<Real>(header.material.objective_damping > 0.0
                                         ? -header.material.local_damping
                                         : header.material.local_damping);
      // The factor covers the rounding of forces to float.
      call.sound_force = static_cast<float>(
          (1.0 - 1e-6) * smaller(force_at_overlap_limit(call), call.units.force_limit));
      const double per_length = call.units.per_length;
      call.velocity_factor = call.drive.dt * (call.units.force * per_length) *
          times_power<Config::D>(1.0, per_length) / call.mass_factor;
    }

    /// Estimates the largest contact force if the last call has left none: from the overlaps, or by
    /// a guess for a packing without contacts.
    static RVE_COLD void estimate_force(Block block, CallState<Config> &call,
                                        PairView<Config> pairs)
    {
      const StateHeader<Config::D> &header = call.header;
      const SeenMotions<Config> motion = call.shared.motion;
      const int n = call.num_grains;
      const double length = call.units.length;
      const auto to_length =
          fraction_to_length<typename Config::Numbers>(call.units.per_length * call.cell);
      block.for_each(n, [&](Item i) {
        double most = 0.0;
        for (int k = 0; k < Config::owned_pairs; ++k) {
          const int j = pairs.partner[k * n + i];
          if (j == i) continue;
          const Vec<Wide, Config::D> branch = to_length *
              fractional_difference<typename Config::Numbers>(motion[j].position,
                                                              motion[i].position);
          const double overlap =
              static_cast<double>(call.shared.radius[i] + call.shared.radius[j]) -
              std::sqrt(static_cast<double>(dot(branch, branch)));
          most = overlap > most ? overlap : most;
        }
        call.work.scratch[i] = most;
      });
      const double overlap = length * block.max_array(n, call.work.scratch);
      block.once([&] {
        const double radius = header.mean_radius;
        call.expected_force = law_of_script<Config>(call).force_scale(
            {overlap > 0.0 ? overlap : kGasOverlapShare * radius, radius, radius});
      });
    }

    /// Returns the spring force of two of the largest grains at the overlap limit [internal force].
    /// Two grains of any size with a larger spring force exceed the overlap limit. At smaller
    /// spring forces the overlaps themselves are checked, at the end of a call.
    static RVE_INLINE double force_at_overlap_limit(const PreparedCall<Config> &call)
    {
      const double largest = call.header.largest_radius;
      const ContactSite deep{call.batch.overlap_limit * largest, largest, largest};
      return law_of_script<Config>(call).spring_force(deep) * call.units.per_force;
    }

    /// Returns whether a force of this call was beyond the range of the sums, so that all results
    /// are wrong. The grains must be in memory.
    static RVE_INLINE bool is_saturated(Block &block, const CallState<Config> &call)
    {
      const Real limit = static_cast<Real>(call.units.force_limit);
      return block.any(call.num_grains,
                       [&](Item i) { return !(call.shared.largest_force[i] <= limit); });
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
