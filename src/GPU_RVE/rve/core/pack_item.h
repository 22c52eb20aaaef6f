// SPDX-License-Identifier: GPL-2.0-only
// Several grains at a time as the item of a phase.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// The grains first, ..., first + Lanes - 1.
  template <int Lanes> struct PackItem {
    static constexpr int lanes = Lanes;
    int first;
  };

  /// Whether an item of a phase is a pack, in a phase that takes both: `const auto i`.
  template <class Item> struct IsPack {
    static constexpr bool value = false;
  };
  template <int Lanes> struct IsPack<PackItem<Lanes>> {
    static constexpr bool value = true;
  };

}    // namespace RVE_ISA
}    // namespace rve
