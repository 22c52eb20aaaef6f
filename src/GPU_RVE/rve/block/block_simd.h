// SPDX-License-Identifier: GPL-2.0-only
// A block of one CPU thread with SIMD.

#pragma once

#include "rve/block/block_serial.h"
#include "rve/core/pack_item.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// A BlockSerial with packs. A phase that accepts packs gets packs of grains, and single grains
  /// for the remainder.
  template <int Lanes> class BlockSimd : public BlockSerial {
   public:
    using Pack = PackItem<Lanes>;

    using BlockSerial::for_items;
    template <Visit = Visit::Items, class F> RVE_INLINE void for_items(int n, F f)
    {
      visit<std::is_invocable_v<F, Pack>>(n, f, f);
    }

    template <class F> RVE_INLINE void own_items(int n, F f) { for_items(n, f); }

    template <Visit = Visit::Items, class F> RVE_INLINE bool any_item(int n, F f)
    {
      bool result = false;
      const auto add = [&](const auto i) RVE_INLINE_LAMBDA { result = f(i) | result; };
      visit<std::is_invocable_v<F, Pack>>(n, add, add);
      return result;
    }

    /// A pack adds directly to the sums.
    template <int M, class Term, Visit = Visit::Items, class F, class Rest>
    RVE_INLINE void reduce_items(int n, F f, Rest rest, Reduction<M> &reduction)
    {
      reduction = Reduction<M>{};
      visit<std::is_invocable_v<F, Pack, std::int64_t *, float &>>(
          n, [&](const auto i) RVE_INLINE_LAMBDA { f(i, reduction.sum, reduction.largest); },
          [&](int i) RVE_INLINE_LAMBDA { add_to_reduction<M, Term>(i, f, reduction); });
      add_rest<M, Term>(rest, reduction);
    }

    template <int M, class Term, class F, class Then>
    RVE_INLINE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      for (int m = 0; m < M; ++m) sum[m] = 0;
      visit<std::is_invocable_v<F, Pack, std::int64_t *>>(
          n, [&](const auto i) RVE_INLINE_LAMBDA { f(i, sum); },
          [&](int i) RVE_INLINE_LAMBDA { add_terms<M, Term>(i, f, sum); });
      then();
    }

   private:
    template <bool in_packs, class InPacks, class OneByOne>
    static RVE_INLINE void visit(int n, const InPacks &of_pack, const OneByOne &of_one)
    {
      int i = 0;
      if constexpr (in_packs)
        for (; i + Lanes <= n; i += Lanes) of_pack(Pack{i});
      for (; i < n; ++i) of_one(i);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
