// SPDX-License-Identifier: GPL-2.0-only
// Kick and drift of a grain or of a pack of grains.

#pragma once

#include "rve/algorithm/grain_items.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

  /// Constants of a move, the same for all grains of an RVE, in internal units.
  template <class Numbers, int D> struct MoveConstants {
    using Leading = typename Numbers::Leading;

    Tensor<typename Numbers::Wide, D> to_fraction;    ///< velocity to fraction units in a step
    Tensor<typename Leading::Real, D> leading_to_length;    ///< 32-bit fraction units to lengths
    /// Square of the allowed displacement since the list was built [length^2]
    typename Leading::Real allowed_squared;
    std::uint32_t safe_box;    ///< as in StepPlan
    /// Coefficient of local damping, below zero for objective damping [-].
    typename Numbers::Real alpha;

    /// Sets the constants from a StepPlan, or from the MoveConstants of single numbers.
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

  /// Increments of velocity and spin in a step without damping: dt F/m and dt M/I.
  template <class Numbers, int D> struct Kick {
    Vec<typename Numbers::Real, D> velocity;
    Spin<typename Numbers::Real, D> spin;
  };

  /// Updates velocity and spin by the force and torque on a grain (leapfrog). Turns is true if the
  /// law has torques. A negative `alpha` selects objective damping, which is available only for
  /// spheres.
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
        spin = spin + Real(0);    // as for a zero torque: -0 becomes 0
      }
    }
    return increment;
  }

  /// Updates the position by a step in the current cell.
  template <class Numbers, int D>
  RVE_INLINE void drift_grain(const MoveConstants<Numbers, D> &step, Motion<Numbers, D> &motion)
  {
    const Vec<typename Numbers::Wide, D> displacement =
        step.to_fraction * motion.velocity.template as<typename Numbers::Wide>();
    for (int a = 0; a < D; ++a) drift<Numbers>(motion.position[a], displacement[a]);
  }

  /// Returns whether a grain is in the safe box (StepPlan) around its position when the list was
  /// built. A grain in the box has not moved farther than the list allows.
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

  /// Returns the squared displacement of a grain since the list was built, relative to the mean
  /// field [length^2].
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

  /// Returns whether a grain has moved farther than the list allows.
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
