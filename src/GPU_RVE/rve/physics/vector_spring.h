// A spring with a Coulomb limit for a force that is a vector: along the contact of two spheres, or for what is turned.

#ifndef RVE_PHYSICS_VECTOR_SPRING_H
#define RVE_PHYSICS_VECTOR_SPRING_H

#include "rve/core/vec.h"

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

  /// What a contact of spheres remembers is a force in its plane, which turns with it,
  ///
  ///   h <- h - (n - tilt/2) (n . h) + twist n x h - twist^2/2 h:
  ///
  /// from the plane of the old normal n - tilt to that of the new one by the least rotation, then about the normal, both to second order of
  /// the angles of a step. A rigid rotation of the pair turns the force with it, about any axis. Falling onto the new plane, as it is often
  /// written, h - n (n . h), shortens h in one direction and not in the other, which turns it by as much as the angle of a step in a whole
  /// turn; LAMMPS does so, and leaves the twist out. Under exchange of the grains all signs change, and no bits. Without a turn, as in a
  /// step of no time, the force stays to the bit.
  template <class Real, class History>
  RVE_INLINE Vec<History, 3>
  turned_with_contact(const Vec<History, 3> &force, const Vec<Real, 3> &normal,
                      const ContactTurn<Real> &turn, const Truth<Real> &moves)
  {
    Truth<History> keeps;
    convert_truth(moves, keeps);
    const Vec<Real, 3> h = force.template as<Real>();
    const Real lift = dot(normal, h), shrink = Real(-0.5) * turn.twist * turn.twist;
    const Vec<Real, 3> aside = cross(normal, h);
    Vec<History, 3> turned;
    for (int a = 0; a < 3; ++a) {
      const Real between = fma(Real(-0.5), turn.tilt[a], normal[a]);
      const Real change = fma(turn.twist, aside[a], fma(shrink, h[a], -(lift * between)));
      turned[a] = select(keeps, force[a] + static_cast<History>(change), force[a]);
    }
    return turned;
  }

  template <class Real, class History> struct VectorForce {
    Vec<Real, 3> force;        ///< on grain i [force]
    Vec<History, 3> spring;    ///< part of it that the spring carries on to the next step [force]
    Vec<History, 3>
        slipped;    ///< spring force that the limit took away; zero when sticking [force]
    Truth<History> sliding;    ///< at the limit
  };

  /// As LinearTangential, for vectors: the limit is a circle, and what slides keeps its direction.
  template <class Real, class History, bool Viscous> struct VectorSpring {
    History stiffness;    ///< [force/length]
    Real friction;        ///< [-]
    Real viscosity;       ///< [force time/length]

    /// `velocity` is of j relative to i [length/time].
    RVE_INLINE VectorForce<Real, History> advance(const Vec<History, 3> &spring,
                                                  const Vec<Real, 3> &velocity, Real normal_force,
                                                  Real dt) const
    {
      const Vec<History, 3> speed = velocity.template as<History>();
      Vec<History, 3> elastic, trial;
      for (int a = 0; a < 3; ++a) {
        elastic[a] = fma(stiffness * static_cast<History>(dt), speed[a], spring[a]);
        trial[a] = elastic[a];
        if constexpr (Viscous)
          if (viscosity != Real(0))
            trial[a] = elastic[a] + static_cast<History>(viscosity) * speed[a];
      }
      const History limit = static_cast<History>(friction * fabs(normal_force));
      const History squared = dot(trial, trial);
      // a force at the limit, looked at again, must keep its bits and be at the limit: its length is rounded a few times
      constexpr double kSlack = 16.0 * kEpsilon<History>;
      const History squared_limit = limit * limit;
      const auto beyond = squared > History(1.0 + kSlack) * squared_limit;
      VectorForce<Real, History> result;
      result.sliding = squared >= History(1.0 - kSlack) * squared_limit;
      History share = History(1);
      if (any(beyond)) {
        const auto length = root_and_inverse(squared + History(kLeastSquaredForce));
        share = select(beyond, limit * length.inverse, share);
      }
      for (int a = 0; a < 3; ++a) {
        const History capped = share * trial[a];
        result.force[a] = static_cast<Real>(capped);
        result.slipped[a] = trial[a] - capped;
        result.spring[a] = capped;
        if constexpr (Viscous)
          if (viscosity != Real(0))
            result.spring[a] = select(beyond, capped - (trial[a] - elastic[a]), elastic[a]);
      }
      return result;
    }

    /// Energy stored in the spring [force length]; zero without stiffness.
    RVE_INLINE double elastic_energy(const Vec<History, 3> &spring) const
    {
      const Vec<double, 3> force = spring.template as<double>();
      return stiffness > History(0) ? 0.5 * dot(force, force) / static_cast<double>(stiffness)
                                    : 0.0;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
