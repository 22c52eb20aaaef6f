// What a pair of grains remembers of its contact: the forces of its springs, as the first grain of the pair sees them.

#ifndef RVE_PHYSICS_LAWS_SPRING_FORCES_H
#define RVE_PHYSICS_LAWS_SPRING_FORCES_H

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// History of a pair with rolling resistance. Without, it is the tangential force alone, a number.
  template <class Number> struct SpringForces {
    Number
        tangential;    ///< on the first grain along t = (-n_y, n_x), n from the first to the second [force]
    Number rolling;    ///< moment on the first grain over the reduced radius [force]
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
