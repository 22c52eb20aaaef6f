// Forces of all contacts of one RVE: scheme D. Every pair is computed once, by its owner; each component of the force is
// rounded once to an integer and added with opposite signs to the two grains, so that the sum has no order and momentum is
// conserved to the last bit.

#ifndef RVE_ALGORITHM_CONTACT_FORCES_H
#define RVE_ALGORITHM_CONTACT_FORCES_H

#include "rve/algorithm/system_view.h"
#include "rve/core/integer_sums.h"
#include "rve/core/status.h"
#include "rve/physics/contact_law.h"
#include "rve/physics/stress.h"

namespace rve {
inline namespace RVE_ISA {

  /// Powers of two that turn forces and torques into integers. From the largest contact force of the
  /// last call, with headroom, so that stiff and soft packings keep the same relative resolution.
  template <class Format> struct ForceScale {
    typename Format::Real force, inverse_force;      ///< [1/force], [force]
    typename Format::Real torque, inverse_torque;    ///< [1/(force length)], [force length]
    typename Format::Real
        limit;               ///< components of contact forces above are refused [force units]
    double stress;           ///< of a Love term in 64 bits [1/(force length)]
    double contact_force;    ///< of |f| of a contact or a grain in 64 bits [1/force]
    double energy;           ///< of a contact's elastic energy in 64 bits [1/(force length)]

    /// 2^neighbor_bits grains or more find room around the largest one, so that many saturated contacts
    /// still fit into the sum: it never wraps. The largest force to expect lies 4 to 8 times lower;
    /// resolution beyond the 53 bits of a double would be lost anyway.
    RVE_INLINE ForceScale(double largest_contact_force, double largest_radius, int neighbor_bits)
    {
      using Real = typename Format::Real;
      const int limit_bits = Format::sum_bits - neighbor_bits;
      const int largest_bits = limit_bits - 3 < 52 ? limit_bits - 3 : 52;
      const int force_bits = largest_bits - floor_log2(largest_contact_force);
      // arm <= 2^radius_bits / 2 and |f_t| <= sqrt(2) times the limit: no torque needs more bits than a force
      const int radius_bits = floor_log2(largest_radius) + 2;
      force = static_cast<Real>(power_of_two(force_bits));
      inverse_force = static_cast<Real>(power_of_two(-force_bits));
      torque = static_cast<Real>(power_of_two(force_bits - radius_bits));
      inverse_torque = static_cast<Real>(power_of_two(radius_bits - force_bits));
      limit = static_cast<Real>(power_of_two(limit_bits));
      // The integer that the largest force may become, when sums over 2^17 contacts shall stay within
      // 62 bits and each may be saturated.
      const int room =
          62 - 17 - (limit_bits - largest_bits) - 1 - floor_log2(largest_contact_force);
      contact_force = power_of_two(room);
      stress = power_of_two(room - radius_bits);
      energy = power_of_two(room - radius_bits);
    }
  };

  /// What a step needs to know of its RVE that is the same for all grains.
  template <class Format, bool Viscous> struct StepConstants {
    LinearFrictionLaw<typename Format::Real, typename Format::History, Viscous> law;
    Tensor<typename Format::Wide, 2> to_length;            ///< H * fraction_unit
    Tensor<typename Format::Real, 2> velocity_gradient;    ///< L [1/time]
    typename Format::Real dt;    ///< zero evaluates without advancing the history [time]
  };

  /// One contact as the algorithms above the law see it.
  template <class Format> struct PairForce {
    ContactGeometry<typename Format::Real, 2> contact;
    ContactForce<typename Format::Real, typename Format::History> force;
  };

  /// Evaluates the pair (i, j) if it touches. Returns whether it does.
  template <class Format, bool Viscous>
  RVE_INLINE bool evaluate_pair(const SharedView<Format> &shared,
                                const StepConstants<Format, Viscous> &step, int i, int j,
                                typename Format::History history, PairForce<Format> &pair)
  {
    using Real = typename Format::Real;
    using Wide = typename Format::Wide;
    const Wide sum_of_radii = shared.radius[i] + shared.radius[j];
    const Vec<Wide, 2> branch =
        step.to_length * fractional_difference<Format>(shared.position[j], shared.position[i]);
    const Wide gap = gap_squared(branch, sum_of_radii);
    if (!(gap > Wide(0)) || i == j) return false;
    pair.contact = contact_geometry<Real>(branch, sum_of_radii, gap);
    const DiskMotion<Real> motion_i{shared.velocity[i], shared.spin[i],
                                    static_cast<Real>(shared.radius[i])};
    const DiskMotion<Real> motion_j{shared.velocity[j], shared.spin[j],
                                    static_cast<Real>(shared.radius[j])};
    pair.force = step.law.evaluate(pair.contact, motion_i, motion_j, step.velocity_gradient,
                                   history, step.dt);
    return true;
  }

  /// Energy that contacts turned into heat [force length].
  struct Dissipation {
    double friction, viscous;
  };

  /// Where the force of a grain's own pairs gathers, and what else the phase asks for.
  template <class Format> struct GrainSum {
    Vec<typename Format::Sum, 2> force;    ///< [force units]
    typename Format::Sum torque;           ///< [torque units]
    std::int32_t trouble;                  ///< bits of the status word
    std::int64_t *stress;                  ///< (4) Love sums, with WithStress
    Dissipation heat;                      ///< with WithHeat
  };

  /// Computes the pair and adds its force to both grains.
  template <bool WithStress, bool WithHeat, class Block, class Format, bool Viscous>
  RVE_INLINE void add_pair(Block &block, const SharedView<Format> &shared,
                           const StepConstants<Format, Viscous> &step,
                           const ForceScale<Format> &scale, int i, int j,
                           typename Format::History &history, GrainSum<Format> &sum)
  {
    using Real = typename Format::Real;
    using Sum = typename Format::Sum;
    PairForce<Format> pair;
    if (!evaluate_pair(shared, step, i, j, history, pair)) {
      history = typename Format::History(0);
      return;
    }
    history = pair.force.spring;
    const Vec<Real, 2> scaled = scale.force * pair.force.force;
    // a NaN fails the comparison too
    if (!(std::fabs(scaled[0]) <= scale.limit && std::fabs(scaled[1]) <= scale.limit)) {
      const bool number = scaled[0] == scaled[0] && scaled[1] == scaled[1];
      sum.trouble |= static_cast<std::int32_t>(number ? status::ForceSaturated : status::NonFinite);
      return;
    }
    for (int a = 0; a < 2; ++a) {
      Sum units;
      round_to(scaled[a], units);
      sum.force[a] += units;
      block.add(&shared.force[j][a], static_cast<Sum>(-units));
    }
    Sum torque_i, torque_j;
    round_to(scale.torque * pair.force.torque_i, torque_i);
    round_to(scale.torque * pair.force.torque_j, torque_j);
    sum.torque += torque_i;
    block.add(&shared.torque[j], torque_j);
    if constexpr (WithStress) {
      const auto term = love_term(pair.force.force.template as<double>(),
                                  pair.contact.branch.template as<double>());
      for (int k = 0; k < 4; ++k) {
        std::int64_t units;
        round_to(scale.stress * term.component[k], units);
        sum.stress[k] += units;
      }
    }
    if constexpr (WithHeat) {
      const double dt = step.dt, vt = pair.force.tangential_velocity,
                   vn = pair.force.normal_velocity;
      const double capped = static_cast<double>(pair.force.tangential);
      const double stiffness = static_cast<double>(step.law.tangential.stiffness);
      if (stiffness > 0.0)
        sum.heat.friction += capped * static_cast<double>(pair.force.slipped) / stiffness;
      else
        sum.heat.friction += capped * vt * dt;
      sum.heat.viscous += static_cast<double>(step.law.normal_damping.viscosity) * vn * vn * dt;
      if (!pair.force.sliding)
        sum.heat.viscous += static_cast<double>(step.law.tangential.viscosity) * vt * vt * dt;
    }
  }

  /// All owned and extra pairs of the RVE. With `WithStress` the Love sums are returned, scaled by scale.stress.
  template <bool WithStress, bool WithHeat, class Block, class States, class Format, bool Viscous>
  RVE_HD IntegerSums<4> contact_forces(Block &block, States &state,
                                       const SharedView<Format> &shared,
                                       const WorkspaceView<Format> &work, int num_grains,
                                       int num_extra, const StepConstants<Format, Viscous> step,
                                       const ForceScale<Format> scale, Dissipation &heat)
  {
    using Item = typename Block::Item;
    using Sum = typename Format::Sum;
    const auto grain_forces = [&](Item i, std::int64_t *stress) RVE_INLINE_LAMBDA {
      auto &grain = state[i];
      GrainSum<Format> own{Vec<Sum, 2>::zero(), Sum(0), 0, stress, {0.0, 0.0}};
      for (int k = 0; k < kOwnedPairs; ++k)
        add_pair<WithStress, WithHeat>(block, shared, step, scale, i, grain.partner[k],
                                       grain.history[k], own);
      grain.force = own.force;
      grain.torque = own.torque;
      // extra pairs ride along with the grains of the same numbers: no phase of their own
      for (int m = i; m < num_extra; m += num_grains) {
        const int first = work.extra_first[m];
        own.force = Vec<Sum, 2>::zero();
        own.torque = Sum(0);
        add_pair<WithStress, WithHeat>(block, shared, step, scale, first, work.extra_second[m],
                                       work.extra_history[m], own);
        block.add(&shared.force[first][0], own.force[0]);
        block.add(&shared.force[first][1], own.force[1]);
        block.add(&shared.torque[first], own.torque);
      }
      grain.trouble |= own.trouble;
      if constexpr (WithHeat) {
        work.scratch[i] = own.heat.friction;
        work.scratch[num_grains + i] = own.heat.viscous;
      }
    };

    IntegerSums<4> sums{{0, 0, 0, 0}};
    if constexpr (WithStress) {
      sums = block.template sum_integers<4>(num_grains, grain_forces);
    } else {
      block.for_each(num_grains, [&](Item i) RVE_INLINE_LAMBDA {
        grain_forces(i, nullptr);
      });
    }
    if constexpr (WithHeat) {
      heat.friction += block.sum_array(num_grains, work.scratch);
      heat.viscous += block.sum_array(num_grains, work.scratch + num_grains);
    }
    return sums;
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
