// SPDX-License-Identifier: GPL-2.0-only
// A spring with a Coulomb limit for a force vector: the tangential force of two spheres, and their
// rolling force.

#pragma once

#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Number added to squared forces [internal force^2], so that a force of zero does not give 0/0.
  /// It is far below the rounding of relevant forces.
  constexpr double kLeastSquaredForce = 1e-30;

  /// Rotation of a contact in the last step [rad]. `tilt` is the change of the normal n, a vector
  /// perpendicular to n. `twist` = dt/2 (w_i + w_j) . n is the mean angle by which both grains
  /// turned about n, with their spins w.
  template <class Real> struct ContactTurn {
    Vec<Real, 3> tilt;
    Real twist;
  };

  /// Returns the normal at the middle of the step at whose end the normal is n.
  template <class Real>
  RVE_INLINE Vec<Real, 3> middle_normal(const Vec<Real, 3> &n, const ContactTurn<Real> &turn)
  {
    return fma(Real(-0.5), turn.tilt, n);
  }

  /// Tangential force of a contact of spheres after the rotation of the contact in a step. The
  /// stored force h turns with the contact,
  ///
  ///   h <- h - (n - tilt/2) (n . h) + twist n x h - twist^2/2 h,
  ///
  /// with the new normal n, and with tilt and twist of ContactTurn. The term with n . h is the
  /// smallest rotation from the plane of the old normal n - tilt to the plane of n. The terms with
  /// twist are the rotation about n by the angle twist. Both rotations are exact to second order in
  /// the angles of a step. A rigid rotation of the pair about any axis therefore turns the force
  /// with the pair. LAMMPS uses the projection h - n (n . h) onto the new plane and omits the
  /// twist. The projection shortens h in one direction only. In each revolution of the pair this
  /// turns h by about the angle of one step. If the grains are exchanged, only the signs change.
  /// Without a rotation, as in a step of zero time, the force keeps its bits.
  ///
  /// The turned force is `kept` + `change`. Before it forms this sum, a caller can add further
  /// terms to `change`. The sum is rounded once, in the format of `kept`.
  template <class Real, class History> struct TurnedForce {
    Vec<History, 3> kept;
    Vec<Real, 3> change;

    RVE_INLINE Vec<History, 3> sum() const { return kept + change.template as<History>(); }
  };

  template <class Real, class History>
  RVE_INLINE TurnedForce<Real, History>
  turned_with_contact(const Vec<History, 3> &force, const Vec<Real, 3> &normal,
                      const Vec<Real, 3> &middle, Real twist, const Truth<Real> &moves)
  {
    const Vec<Real, 3> h = force.template as<Real>();
    // Rounding of the normal also makes n . h nonzero. Without motion it must not change the force.
    const Real lift = select(moves, dot(normal, h), Real(0));
    const Real shrink = Real(-0.5) * twist * twist;
    const Vec<Real, 3> aside = cross(normal, h);
    TurnedForce<Real, History> turned{force, {}};
    for (int a = 0; a < 3; ++a)
      turned.change[a] = fma(twist, aside[a], fma(shrink, h[a], -(lift * middle[a])));
    return turned;
  }

  /// LinearTangential for vectors: the limit is a circle, and a sliding force keeps its direction.
  /// The change in a step and the length of the force have the format Real; only the spring, which
  /// accumulates over many steps, has the format History.
  template <class Real, class History, bool Viscous> struct VectorSpring {
    Real stiffness;    ///< [force/length]
    Real friction;     ///< [-]
    Real viscosity;    ///< [force time/length]

    RVE_INLINE LimitedForce<Real, History, 3> advance(const Vec<History, 3> &spring,
                                                      const Vec<Real, 3> &velocity,
                                                      Real normal_force, Real dt) const
    {
      return advance(TurnedForce<Real, History>{spring, Vec<Real, 3>::zero()}, velocity,
                     normal_force, dt);
    }

    /// Advances the spring by one step; `velocity` is that of j relative to i [length/time].
    RVE_INLINE LimitedForce<Real, History, 3> advance(const TurnedForce<Real, History> &spring,
                                                      const Vec<Real, 3> &velocity,
                                                      Real normal_force, Real dt) const
    {
      const Vec<Real, 3> change = fma(stiffness * dt, velocity, spring.change);
      const Vec<History, 3> elastic = spring.kept + change.template as<History>();
      Vec<Real, 3> trial = elastic.template as<Real>();
      if constexpr (Viscous)
        if (viscosity != Real(0)) trial = fma(viscosity, velocity, trial);
      const Real limit = friction * fabs(normal_force);
      const Real squared = dot(trial, trial), squared_limit = limit * limit;
      // A force at the limit must keep its bits and be at the limit when it is evaluated again. The
      // slack covers the rounding of its length.
      constexpr double kSlack = 16.0 * kEpsilon<Real>;
      const auto beyond = squared > Real(1.0 + kSlack) * squared_limit;
      LimitedForce<Real, History, 3> result{trial, elastic, Vec<History, 3>::zero(), {}};
      convert_truth(squared >= Real(1.0 - kSlack) * squared_limit, result.sliding);
      if (any(beyond)) {
        Truth<History> slips;
        convert_truth(beyond, slips);
        const Real share = limit * root_and_inverse(squared + Real(kLeastSquaredForce)).inverse;
        const History kept_share = History(share);
        for (int a = 0; a < 3; ++a) {
          History capped = kept_share * elastic[a];
          if constexpr (Viscous)
            if (viscosity != Real(0))
              capped = capped - History((Real(1) - share) * (viscosity * velocity[a]));
          result.spring[a] = select(slips, capped, elastic[a]);
          result.slipped[a] = elastic[a] - result.spring[a];
          // A later evaluation of the spring must give the same force.
          result.force[a] = select(beyond, Real(capped), trial[a]);
          if constexpr (Viscous)
            if (viscosity != Real(0)) result.force[a] = select(beyond, share * trial[a], trial[a]);
        }
      }
      return result;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
