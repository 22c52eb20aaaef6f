// SPDX-License-Identifier: GPL-2.0-only
// Kick and drift of a grain, from numbers to numbers: those of one grain, or packs of those of several.

#pragma once

#include "rve/algorithm/grain_items.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

  /// What a move needs to know that is the same for all grains of an RVE, in internal units.
  template <class Numbers, int D> struct MoveConstants {
    using Leading = typename Numbers::Leading;

    Tensor<typename Numbers::Wide, D> to_fraction;    ///< velocity to fraction units in a step
    Tensor<typename Leading::Real, D> leading_to_length;    ///< 32-bit fraction units to lengths
    typename Leading::Real allowed_squared;    ///< displacement since the list was built [length^2]
    std::uint32_t safe_box;                    ///< of StepPlan
    /// Of local damping, below zero for that which knows no axes [-].
    typename Numbers::Real alpha;

    /// From a StepPlan, or from these in single numbers.
    template <class Constants, class Number>
    RVE_INLINE MoveConstants(const Constants &constants, Number damping) :
        to_fraction(constants.to_fraction.template as<typename Numbers::Wide>()),
        leading_to_length(constants.list_to_length().template as<typename Leading::Real>()),
        allowed_squared(constants.allowed_squared), safe_box(constants.safe_box), alpha(damping)
    {
    }

    RVE_INLINE const Tensor<typename Leading::Real, D> &list_to_length() const
    {
      return leading_to_length;
    }
  };

  /// What a step would add to the velocity and the spin of a grain without damping: dt F/m and dt M/I.
  template <class Numbers, int D> struct Kick {
    Vec<typename Numbers::Real, D> velocity;
    Spin<typename Numbers::Real, D> spin;
  };

  /// Leapfrog update of the velocity and the spin from the force and the torque on a grain. Turns: torques there are. Below zero `alpha` is that
  /// of objective damping, which spheres may have.
  template <bool Turns, class Numbers, int D>
  RVE_INLINE Kick<Numbers, D>
  kick_grain(GrainView<Numbers, D> &grain,
             const Vec<typename Numbers::Sum, Space<D>::freedoms> &force,
             const GrainResponse<Numbers, D> &response, typename Numbers::Real alpha)
  {
    using Real = typename Numbers::Real;
    Kick<Numbers, D> increment;
    if constexpr (D == 3) {
      if (any(alpha < Real(0))) {
        for (int a = 0; a < D; ++a) {
          increment.velocity[a] = static_cast<Real>(force[a]) * response.velocity_unit;
          increment.spin[a] = Turns ? static_cast<Real>(force[D + a]) * response.spin_unit
                                    : Real(0);
        }
        grain.motion.velocity = kick_objectively(grain.motion.velocity, increment.velocity, -alpha);
        grain.spin = kick_objectively(grain.spin, increment.spin, -alpha);
        return increment;
      }
    }
    constexpr bool by_sign = kRelaxedSpheres<D>;
    for (int a = 0; a < D; ++a) {
      increment.velocity[a] = static_cast<Real>(force[a]) * response.velocity_unit;
      grain.motion.velocity[a] =
          kick<by_sign>(grain.motion.velocity[a], increment.velocity[a], alpha);
    }
    for (int k = 0; k < Space<D>::spins; ++k) {
      Real &spin = spin_component(grain.spin, k), &added = spin_component(increment.spin, k);
      if constexpr (Turns) {
        added = static_cast<Real>(force[D + k]) * response.spin_unit;
        spin = kick<by_sign>(spin, added, alpha);
      } else {
        added = Real(0);
        spin = spin + Real(0);    // as by a torque of zero: -0 turns into 0
      }
    }
    return increment;
  }

  /// The position after a step in the present cell.
  template <class Numbers, int D>
  RVE_INLINE void drift_grain(const MoveConstants<Numbers, D> &step, Motion<Numbers, D> &motion)
  {
    const Vec<typename Numbers::Wide, D> displacement =
        step.to_fraction * motion.velocity.template as<typename Numbers::Wide>();
    for (int a = 0; a < D; ++a) drift<Numbers>(motion.position[a], displacement[a]);
  }

  /// Whether a grain is so near to where it was when the list was built that it has not left the list, whatever the direction.
  template <class Numbers, int D>
  RVE_INLINE bool is_in_safe_box(const MoveConstants<Numbers, D> &step,
                                 const Motion<Numbers, D> &motion,
                                 const GrainResponse<Numbers, D> &response)
  {
    bool inside = true;
    for (int a = 0; a < D; ++a)
      inside = inside &&
          leading_bits(motion.position[a]) - response.list_position[a] + step.safe_box <
              2 * step.safe_box;
    return inside;
  }

  /// Displacement of a grain since the list was built, without that of the mean field [length^2].
  template <class Numbers, int D>
  RVE_INLINE typename Numbers::Leading::Real
  squared_displacement(const MoveConstants<Numbers, D> &step, const Motion<Numbers, D> &motion,
                       const GrainResponse<Numbers, D> &response)
  {
    using Leading = typename Numbers::Leading;
    Vec<typename Leading::Coordinate, D> now;
    for (int a = 0; a < D; ++a) now[a] = leading_bits(motion.position[a]);
    const Vec<typename Leading::Real, D> moved =
        step.leading_to_length * fractional_difference<Leading>(now, response.list_position);
    return dot(moved, moved);
  }

  /// Whether a grain has left the safety of the list.
  template <class Numbers, int D>
  RVE_INLINE Truth<typename Numbers::Leading::Real>
  has_left_list(const MoveConstants<Numbers, D> &step, const Motion<Numbers, D> &motion,
                const GrainResponse<Numbers, D> &response)
  {
    if constexpr (std::is_same_v<typename Numbers::Leading::Real, float>)
      if (is_in_safe_box(step, motion, response)) return false;
    return squared_displacement(step, motion, response) > step.allowed_squared;
  }

}    // namespace RVE_ISA
}    // namespace rve
