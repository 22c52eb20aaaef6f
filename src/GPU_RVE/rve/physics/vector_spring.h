// SPDX-License-Identifier: GPL-2.0-only
// A spring with a Coulomb limit for a force that is a vector: along the contact of two spheres, or for what is turned.

#pragma once

#include "rve/physics/tangential_force.h"

namespace rve {
inline namespace RVE_ISA {

  /// Added to squared forces [internal force^2], to keep a force of zero from 0/0: far below the rounding of any that counts.
  constexpr double kLeastSquaredForce = 1e-30;

  /// How a contact turned in the step that led to where it is: its normal changed by `tilt` = dt times its rate, across it, and the mean of
  /// both grains turned by `twist` = dt/2 (w_i + w_j) . n about it [rad].
  template <class Real> struct ContactTurn {
    Vec<Real, 3> tilt;
    Real twist;
  };

  /// The normal of the middle of the step that led to n.
  template <class Real>
  RVE_INLINE Vec<Real, 3> middle_normal(const Vec<Real, 3> &n, const ContactTurn<Real> &turn)
  {
    return fma(Real(-0.5), turn.tilt, n);
  }

  /// What a contact of spheres remembers is a force in its plane, which turns with it,
  ///
  ///   h <- h - (n - tilt/2) (n . h) + twist n x h - twist^2/2 h:
  ///
  /// from the plane of the old normal n - tilt to that of the new one by the least rotation, then about the normal, both to second order of
  /// the angles of a step. A rigid rotation of the pair turns the force with it, about any axis. Falling onto the new plane, as it is often
  /// written, h - n (n . h), shortens h in one direction and not in the other, which turns it by as much as the angle of a step in a whole
  /// turn; LAMMPS does so, and leaves the twist out. Under exchange of the grains all signs change, and no bits. Without a turn, as in a
  /// step of no time, the force stays to the bit.
  ///
  /// The sum of what was kept and this change is left to who adds more in the same step: it is rounded once, in the numbers of what is kept.
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
    // out of the plane by the rounding of the normal, too
    const Real lift = select(moves, dot(normal, h), Real(0));
    const Real shrink = Real(-0.5) * twist * twist;
    const Vec<Real, 3> aside = cross(normal, h);
    TurnedForce<Real, History> turned{force, {}};
    for (int a = 0; a < 3; ++a)
      turned.change[a] = fma(twist, aside[a], fma(shrink, h[a], -(lift * middle[a])));
    return turned;
  }

  /// As LinearTangential, for vectors: the limit is a circle, and what slides keeps its direction. The changes of a step and the length of
  /// the force have the numbers of forces: only what adds up over many steps needs better ones.
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

    /// `velocity` is of j relative to i [length/time].
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
      // a force at the limit, looked at again, must keep its bits and be at the limit: its length is rounded a few times
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
          // what looks at the spring again shall see the same force
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
