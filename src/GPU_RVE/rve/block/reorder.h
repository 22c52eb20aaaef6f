// SPDX-License-Identifier: GPL-2.0-only
// Elements of arrays to other places, by way of other memory.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// Block::reorder in two phases.
  template <class Block, class Place, class... T>
  RVE_INLINE void reorder_by_room(Block &block, int n, Place place, void *room, T *...array)
  {
    block.for_each(n, [&](int i) {
      char *moved = static_cast<char *>(room);
      ((reinterpret_cast<T *>(moved)[place(i)] = array[i], moved += sizeof(T) * n), ...);
    });
    block.for_each(n, [&](int i) {
      const char *moved = static_cast<const char *>(room);
      ((array[i] = reinterpret_cast<const T *>(moved)[i], moved += sizeof(T) * n), ...);
    });
  }

}    // namespace RVE_ISA
}    // namespace rve
