// SPDX-License-Identifier: GPL-2.0-only
// Integer sums: wrapping sums, and sums over the items of a block.

#pragma once

#include "rve/core/config.h"

#include <cstdint>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// wrapping_sum() and wrapping_difference() return x + y and x - y modulo 2^b, where b is the
  /// number of bits of Integer. Overflow must not be undefined behaviour: a force beyond the range
  /// of the sums is detected only at the end of a call, whose results are then discarded.
  template <class Integer> RVE_INLINE Integer wrapping_sum(Integer x, Integer y)
  {
    using Bits = std::make_unsigned_t<Integer>;
    return static_cast<Integer>(static_cast<Bits>(x) + static_cast<Bits>(y));
  }
  template <class Integer> RVE_INLINE Integer wrapping_difference(Integer x, Integer y)
  {
    using Bits = std::make_unsigned_t<Integer>;
    return static_cast<Integer>(static_cast<Bits>(x) - static_cast<Bits>(y));
  }

  /// Returns the contribution of an integer, or of a pack of integers, to a sum of 64 bits.
  template <class Integer> RVE_INLINE std::int64_t total(Integer x)
  {
    return static_cast<std::int64_t>(x);
  }

  template <int M> struct IntegerSums {
    std::int64_t value[M];
    RVE_INLINE std::int64_t operator[](int m) const { return value[m]; }
  };

  /// Result of Block::reduce_items().
  template <int M> struct Reduction {
    std::int64_t sum[M];
    float largest;
  };

}    // namespace RVE_ISA
}    // namespace rve
