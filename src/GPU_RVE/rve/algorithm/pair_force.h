// SPDX-License-Identifier: GPL-2.0-only
// Computes one pair of grains in a step. From the two grains and the history of the pair it
// computes the force, the new history and the contributions to the sums of both grains. The
// functions take numbers or packs of numbers.
//
//   pair_geometry    geometry of the two grains
//   pair_force       normal force, tangential force and torques: evaluate() of physics/laws
//   store_history    stores the part of the history that steps read
//   add_pair         calls the other functions and adds the force to the sums of both grains

#pragma once

#include "rve/algorithm/call_state.h"
#include "rve/algorithm/force_sum.h"
#include "rve/algorithm/grain_items.h"
#include "rve/physics/contact_geometry.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Constants of a step that all pairs share, in internal units.
  template <class Config> struct StepConstants {
    typename Config::Law law;
    Tensor<typename Config::Wide, Config::D> to_length;
    Tensor<typename Config::Real, Config::D> gradient;
    typename Config::Real dt;    ///< time step; if zero, the history is not advanced [time]
  };

  /// Returns the constants of a step in numbers or packs of numbers, from a law and a plan in
  /// numbers.
  template <class Config, class LawConstants, class Numbers>
  RVE_INLINE StepConstants<Config> step_constants(const LawConstants &law,
                                                  const StepPlan<Numbers, Config::D> &plan)
  {
    StepConstants<Config> step;
    step.law.take(law);
    step.to_length = plan.to_length.template as<typename Config::Wide>();
    step.gradient = plan.gradient.template as<typename Config::Real>();
    step.dt = typename Config::Real(law.dt);
    return step;
  }

  template <class Config> using ContactOf = ContactGeometry<typename Config::Real, Config::D>;

  /// Returns the geometry of a pair. Grains touch if their overlap is positive; the law decides
  /// whether they act on each other.
  template <class Config>
  RVE_INLINE ContactOf<Config> pair_geometry(const StepConstants<Config> &step,
                                             const ViewOf<Config> &i, const ViewOf<Config> &j)
  {
    const auto branch = step.to_length *
        fractional_difference<typename Config::Numbers>(j.motion.position, i.motion.position);
    return contact_geometry<typename Config::Real>(branch, i.radius + j.radius);
  }

  template <class Config>
  RVE_INLINE auto pair_force(const StepConstants<Config> &step, const ContactOf<Config> &contact,
                             const ViewOf<Config> &i, const ViewOf<Config> &j,
                             typename Config::History history)
  {
    using Real = typename Config::Real;
    const GrainMotion<Real, Config::D> motion_i{i.motion.velocity, i.spin,
                                                static_cast<Real>(i.radius)};
    const GrainMotion<Real, Config::D> motion_j{j.motion.velocity, j.spin,
                                                static_cast<Real>(j.radius)};
    return evaluate(step.law, contact, motion_i, motion_j, step.gradient, history, step.dt);
  }

  /// Purpose for which the pairs of an RVE are computed.
  enum class Wanted {
    Forces,      ///< forces of a step
    LoveSums,    ///< forces and Love sums of a step with energy and stress bookkeeping
    Reduction    ///< last forces of a call, with Love sums, contacts and checks
  };

  /// Stores the history of a pair. Numbers that no step reads are stored only by the last force
  /// evaluation of a call.
  template <Wanted wanted, class Config, class History>
  RVE_INLINE void store_history(const typename Config::History &now, History &&history)
  {
    if constexpr (wanted == Wanted::Reduction)
      history = now;
    else
      history = Config::Law::history_for_steps(now);
  }

  /// Clears the history of a pair. With tracks_energy it adds the energy of the springs to the
  /// dissipation by friction.
  template <Wanted wanted, class Config, class History>
  RVE_INLINE void release_history(bool tracks_energy, const StepConstants<Config> &step,
                                  History &&history, GrainSum<Config> &sum)
  {
    if constexpr (wanted != Wanted::Forces && Config::has_bookkeeping)
      if (tracks_energy) sum.dissipation.friction += step.law.released(history);
    store_history<wanted, Config>(typename Config::History(), history);
  }

  /// Updates the largest force, which sets the unit of forces.
  template <class Config, class Call, class Force>
  RVE_INLINE void raise_largest_force(const Call &call, const Truth<typename Config::Real> &acting,
                                      const Force &force, typename Config::Real &largest)
  {
    largest = larger(largest, where(acting, fabs(force.normal_force)));
    if constexpr (Config::has_bookkeeping) {
      if (call.header.all_forces_count)
        largest = select(acting, Config::Law::largest(force, largest), largest);
    }
  }

  /// Computes a pair, or a pack of pairs: advances its history, adds its force to `sum` of grain i,
  /// and calls add_to_j(force and torque on grain j). With tracks_energy it adds the dissipation,
  /// in kernels with energy bookkeeping.
  template <Wanted wanted, class Config, class Call, class History, class AddToOther>
  RVE_INLINE void add_pair(const Call &call, bool tracks_energy, const StepConstants<Config> &step,
                           const ViewOf<Config> &grain_i, const ViewOf<Config> &grain_j,
                           const ContactOf<Config> &contact, typename Config::Real overlap_limit,
                           History &&history, GrainSum<Config> &sum, AddToOther add_to_j)
  {
    using Real = typename Config::Real;
    // Packs of disks use where() instead of this branch. Packs of spheres use the branch, since
    // often no grain of a pack has a touching pair in the last slots.
    if constexpr (std::is_same_v<Truth<Real>, bool> || Config::D == 3) {
      if (!any(step.law.acts(contact))) {
        if constexpr (Config::has_friction)
          release_history<wanted>(tracks_energy, step, history, sum);
        return;
      }
    }
    const Truth<Real> acting = step.law.acts(contact);
    if constexpr (Config::Law::has_reach) {
      static_assert(std::is_same_v<Truth<Real>, bool>, "packs of grains have no law with a reach");
      if (!(contact.overlap > Real(0))) release_history<wanted>(tracks_energy, step, history, sum);
    }
    const auto force = pair_force(step, contact, grain_i, grain_j, history);
    if constexpr (Config::has_friction) {
      Truth<typename Config::Spring> keeps;
      convert_truth(acting, keeps);
      store_history<wanted, Config>(where(keeps, force.history()), history);
    }
    raise_largest_force<Config>(call, acting, force, sum.largest_force);
    add_to_j(add_force_and_torque<Config>(acting, force, sum));
    if constexpr (wanted != Wanted::Forces) add_love_term(acting, force.force, contact.branch, sum);
    if constexpr (wanted == Wanted::Reduction) {
      const Real ri = static_cast<Real>(grain_i.radius), rj = static_cast<Real>(grain_j.radius);
      sum.contacts += count(acting);
      sum.over_limit += count_without(acting, contact.overlap <= overlap_limit * smaller(ri, rj));
    }
    if constexpr (wanted != Wanted::Forces && Config::has_bookkeeping)
      if (tracks_energy) step.law.dissipate(contact, force, step.dt, sum.dissipation);
  }

}    // namespace RVE_ISA
}    // namespace rve
