// SPDX-License-Identifier: GPL-2.0-only
// Reordering of arrays through temporary memory.

#pragma once

#include "rve/core/config.h"

namespace rve {
inline namespace RVE_ISA {

  /// Sets array[index_of(item)] = array[item] for n items and all arrays, in two phases. `memory`
  /// has space for all arrays, one after the other. Arrays with stricter alignment must come first.
  template <class Block, class IndexOf, class... T>
  RVE_INLINE void reorder(Block &block, int n, IndexOf index_of, void *memory, T *...array)
  {
    block.for_each(n, [&](int i) {
      char *moved = static_cast<char *>(memory);
      ((reinterpret_cast<T *>(moved)[index_of(i)] = array[i], moved += sizeof(T) * n), ...);
    });
    block.for_each(n, [&](int i) {
      const char *moved = static_cast<const char *>(memory);
      ((array[i] = reinterpret_cast<const T *>(moved)[i], moved += sizeof(T) * n), ...);
    });
  }

}    // namespace RVE_ISA
}    // namespace rve
