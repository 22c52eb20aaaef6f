// The M integers that Block::sum_integers returns.

#ifndef RVE_CORE_INTEGER_SUMS_H
#define RVE_CORE_INTEGER_SUMS_H

#include "rve/core/config.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  template <int M> struct IntegerSums {
    std::int64_t value[M];
    RVE_INLINE std::int64_t operator[](int m) const { return value[m]; }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
