// SPDX-License-Identifier: GPL-2.0-only
// Packs of grains as items of a phase, and the order in which a thread of a GPU visits its items.
// block/block_serial.h defines items and phases.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// The grains first, ..., first + Lanes - 1.
  template <int Lanes> struct PackItem {
    static constexpr int lanes = Lanes;
    int first;
  };

  /// Way in which a thread of a GPU visits the items that it keeps in registers. A CPU ignores it.
  enum class Visit {
    /// The items are visited one after the other. Each item has its own registers.
    Items,
    /// The registers of all items are visited without a branch, even if they hold no item. The
    /// index is then n or larger.
    Registers,
    /// The items are visited one after the other by the same code, in the registers of the first
    /// item.
    InTurn
  };

  /// Array with the interface of a resident array (block/block_serial.h), but without copies in
  /// registers: loads and saves do nothing, and the other functions access the array itself.
  template <class T, class Array = T *> struct ItemsInArray {
    Array array;
    RVE_INLINE decltype(auto) operator[](int item) const { return array[item]; }
    RVE_INLINE void load(int) const {}
    RVE_INLINE void save(int) const {}
    RVE_INLINE void load_whole(int) const {}
    RVE_INLINE void save_whole(int) const {}
    RVE_INLINE void keep(int item, const T &x) const { array[item] = x; }
    RVE_INLINE void publish(int item, const T &x) const { array[item] = x; }
  };

  /// True if Item, the type of an item of a phase, is a pack of grains.
  template <class Item> constexpr bool kIsPack = false;
  template <int Lanes> constexpr bool kIsPack<PackItem<Lanes>> = true;

}    // namespace RVE_ISA
}    // namespace rve
