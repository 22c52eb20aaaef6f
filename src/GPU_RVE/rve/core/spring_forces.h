// What a pair of grains remembers of its contact: the forces of its springs, as the first grain of the pair sees them.

#ifndef RVE_CORE_SPRING_FORCES_H
#define RVE_CORE_SPRING_FORCES_H

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// History of a pair with rolling resistance. Without, it is the tangential force alone, a number.
  template <class Number> struct SpringForces {
    Number
        tangential;    ///< on the first grain along t = (-n_y, n_x), n from the first to the second [force]
    Number rolling;    ///< moment on the first grain over the reduced radius [force]
  };

  /// In another unit of force.
  template <class Number>
  RVE_INLINE SpringForces<Number> operator*(Number factor, const SpringForces<Number> &history)
  {
    return {factor * history.tangential, factor * history.rolling};
  }

  template <class Number> RVE_INLINE Number tangential_of(const Number &tangential_force)
  {
    return tangential_force;
  }
  template <class Number> RVE_INLINE Number tangential_of(const SpringForces<Number> &history)
  {
    return history.tangential;
  }

  /// The history of a pair as its other grain sees it. The tangential force stays: it turns round, and so does t. The moments on the
  /// two grains are opposite.
  template <class Number> RVE_INLINE Number seen_from_partner(const Number &tangential_force)
  {
    return tangential_force;
  }
  template <class Number>
  RVE_INLINE SpringForces<Number> seen_from_partner(const SpringForces<Number> &history)
  {
    return {history.tangential, -history.rolling};
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
