// How many numbers describe something in a space of D dimensions.

#ifndef RVE_CORE_SPACE_H
#define RVE_CORE_SPACE_H

namespace rve {

template <int D> struct Space {
  static constexpr int axes = D;
  static constexpr int spins = D * (D - 1) / 2;      ///< planes that a body can turn in
  static constexpr int freedoms = axes + spins;      ///< of a rigid body
  static constexpr int components = D * D;           ///< of a tensor
  static constexpr int strains = D * (D + 1) / 2;    ///< components of a symmetric tensor
};

}    // namespace rve

#endif
