// SPDX-License-Identifier: GPL-2.0-only
// Numbers of components in a space of D dimensions.

#pragma once

namespace rve {

template <int D> struct Space {
  static constexpr int axes = D;
  static constexpr int spins = D * (D - 1) / 2;      ///< planes of rotation of a body
  static constexpr int freedoms = axes + spins;      ///< degrees of freedom of a rigid body
  static constexpr int components = D * D;           ///< components of a tensor
  static constexpr int strains = D * (D + 1) / 2;    ///< components of a symmetric tensor
};

}    // namespace rve
