// SPDX-License-Identifier: GPL-2.0-only
// How the items of a phase are visited: one by one or several at a time, and in what way by a thread of a GPU.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// The grains first, ..., first + Lanes - 1.
  template <int Lanes> struct PackItem {
    static constexpr int lanes = Lanes;
    int first;
  };

  /// How a thread of a GPU visits the items that it has registers for. On a CPU there is one way.
  enum class Visit {
    Items,    ///< one after the other, each in registers of its own
    Places,    ///< also the registers without an item, with a number from n on: no branch around items
    InTurn    ///< one after the other by the same code, in the registers of the first one
  };

  /// Whether an item of a phase is a pack, in a phase that takes both: `const auto i`.
  template <class Item> constexpr bool kIsPack = false;
  template <int Lanes> constexpr bool kIsPack<PackItem<Lanes>> = true;

}    // namespace RVE_ISA
}    // namespace rve
