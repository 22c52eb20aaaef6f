// SPDX-License-Identifier: GPL-2.0-only
// One pair of grains in a step: grains and history give the force, the new history and the
// contributions to the sums of the grains. The functions take numbers or packs of numbers.
//
//   pair_geometry    geometry of the two grains
//   pair_force       normal force, tangential force and torques: evaluate() of physics/laws
//   store_history    stores the part of the history that steps read
//   add_pair         all of this for a pair, in order

#pragma once

#include "rve/algorithm/call_state.h"
#include "rve/algorithm/force_sum.h"
#include "rve/algorithm/grain_items.h"
#include "rve/physics/contact_geometry.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Constants of a step that all pairs share, in internal units.
  template <class Scene> struct StepConstants {
    typename Scene::Law law;
    Tensor<typename Scene::Wide, Scene::D> to_length;
    Tensor<typename Scene::Real, Scene::D> gradient;
    typename Scene::Real dt;    ///< zero evaluates without advancing the history [time]
  };

  /// Returns the constants of a step in numbers or packs of numbers, from a law and a plan in
  /// numbers.
  template <class Scene, class LawConstants, class Numbers>
  RVE_INLINE StepConstants<Scene> step_constants(const LawConstants &law,
                                                 const StepPlan<Numbers, Scene::D> &plan)
  {
    StepConstants<Scene> step;
    step.law.take(law);
    step.to_length = plan.to_length.template as<typename Scene::Wide>();
    step.gradient = plan.gradient.template as<typename Scene::Real>();
    step.dt = typename Scene::Real(law.dt);
    return step;
  }

  template <class Scene> using ContactOf = ContactGeometry<typename Scene::Real, Scene::D>;

  /// Returns the geometry of a pair. Grains touch if their overlap is positive; the law decides
  /// whether they act on each other.
  template <class Scene>
  RVE_INLINE ContactOf<Scene> pair_geometry(const StepConstants<Scene> &step,
                                            const ViewOf<Scene> &i, const ViewOf<Scene> &j)
  {
    const auto branch = step.to_length *
        fractional_difference<typename Scene::Numbers>(j.motion.position, i.motion.position);
    return contact_geometry<typename Scene::Real>(branch, i.radius + j.radius);
  }

  template <class Scene>
  RVE_INLINE auto pair_force(const StepConstants<Scene> &step, const ContactOf<Scene> &contact,
                             const ViewOf<Scene> &i, const ViewOf<Scene> &j,
                             typename Scene::History history)
  {
    using Real = typename Scene::Real;
    const GrainMotion<Real, Scene::D> motion_i{i.motion.velocity, i.spin,
                                               static_cast<Real>(i.radius)};
    const GrainMotion<Real, Scene::D> motion_j{j.motion.velocity, j.spin,
                                               static_cast<Real>(j.radius)};
    return evaluate(step.law, contact, motion_i, motion_j, step.gradient, history, step.dt);
  }

  /// Purpose for which the pairs of an RVE are computed.
  enum class Wanted {
    Forces,      ///< forces of a step
    LoveSums,    ///< forces and Love sums of a step with energy and stress bookkeeping
    Reduction    ///< last forces of a call, with Love sums, contacts and checks
  };

  /// Stores the history of a pair. Only the last forces of a call store numbers that no step reads.
  template <Wanted wanted, class Scene, class History>
  RVE_INLINE void store_history(const typename Scene::History &now, History &&history)
  {
    if constexpr (wanted == Wanted::Reduction)
      history = now;
    else
      history = Scene::Law::history_for_steps(now);
  }

  /// Clears the history of a pair, and with bookkeeping adds the energy of its springs.
  template <Wanted wanted, class Scene, class History>
  RVE_INLINE void release_history(bool tracks_energy, const StepConstants<Scene> &step,
                                  History &&history, GrainSum<Scene> &sum)
  {
    if constexpr (wanted != Wanted::Forces && Scene::books)
      if (tracks_energy) sum.dissipation.friction += step.law.released(history);
    store_history<wanted, Scene>(typename Scene::History(), history);
  }

  /// Updates the largest force, which sets the unit of forces.
  template <class Scene, class Call, class Force>
  RVE_INLINE void raise_largest_force(const Call &call, const Truth<typename Scene::Real> &acting,
                                      const Force &force, typename Scene::Real &largest)
  {
    largest = larger(largest, where(acting, fabs(force.normal_force)));
    if constexpr (Scene::books) {
      if (call.header.all_forces_count)
        largest = select(acting, Scene::Law::largest(force, largest), largest);
    }
  }

  /// Computes a pair, or a pack of pairs: advances its history, adds its force to `sum` of grain i,
  /// and calls add_to_j(force and torque on grain j). With tracks_energy it adds the dissipation,
  /// in kernels with energy bookkeeping.
  template <Wanted wanted, class Scene, class Call, class History, class AddToOther>
  RVE_INLINE void add_pair(const Call &call, bool tracks_energy, const StepConstants<Scene> &step,
                           const ViewOf<Scene> &grain_i, const ViewOf<Scene> &grain_j,
                           const ContactOf<Scene> &contact, typename Scene::Real overlap_limit,
                           History &&history, GrainSum<Scene> &sum, AddToOther add_to_j)
  {
    using Real = typename Scene::Real;
    // Packs use where() instead of this branch. Whole packs of spheres have no pairs in their last
    // slots.
    if constexpr (std::is_same_v<Truth<Real>, bool> || Scene::D == 3) {
      if (!any(step.law.acts(contact))) {
        if constexpr (Scene::has_friction)
          release_history<wanted>(tracks_energy, step, history, sum);
        return;
      }
    }
    const Truth<Real> acting = step.law.acts(contact);
    if constexpr (Scene::Law::has_reach) {
      static_assert(std::is_same_v<Truth<Real>, bool>, "packs of grains have no law with a reach");
      if (!(contact.overlap > Real(0))) release_history<wanted>(tracks_energy, step, history, sum);
    }
    const auto force = pair_force(step, contact, grain_i, grain_j, history);
    if constexpr (Scene::has_friction) {
      Truth<typename Scene::Spring> keeps;
      convert_truth(acting, keeps);
      store_history<wanted, Scene>(where(keeps, force.history()), history);
    }
    raise_largest_force<Scene>(call, acting, force, sum.largest_force);
    add_to_j(add_force_and_torque<Scene>(acting, force, sum));
    if constexpr (wanted != Wanted::Forces) add_love_term(acting, force.force, contact.branch, sum);
    if constexpr (wanted == Wanted::Reduction) {
      const Real ri = static_cast<Real>(grain_i.radius), rj = static_cast<Real>(grain_j.radius);
      sum.contacts += count(acting);
      sum.over_limit += count_without(acting, contact.overlap <= overlap_limit * smaller(ri, rj));
    }
    if constexpr (wanted != Wanted::Forces && Scene::books)
      if (tracks_energy) step.law.dissipate(contact, force, step.dt, sum.dissipation);
  }

}    // namespace RVE_ISA
}    // namespace rve
