// SPDX-License-Identifier: GPL-2.0-only
// One CPU thread with SIMD as a block.

#pragma once

#include "rve/block/block_serial.h"
#include "rve/core/pack_item.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// A BlockSerial that hands grains in packs to the phases that take packs, and what remains one by one.
  template <int Lanes> class BlockSimd : public BlockSerial {
   public:
    using Pack = PackItem<Lanes>;

    template <class F> RVE_INLINE void for_items(int n, F f)
    {
      int i = 0;
      if constexpr (std::is_invocable_v<F, Pack>)
        for (; i + Lanes <= n; i += Lanes) f(Pack{i});
      for (; i < n; ++i) f(i);
    }

    template <class F, class G> RVE_INLINE void for_items(int n, F f, int m, G g)
    {
      for_items(n, f);
      for (int k = 0; k < m; ++k) g(k);
    }

    template <class F> RVE_INLINE void own_items(int n, F f) { for_items(n, f); }

    template <class F> RVE_INLINE void for_places(int n, F f) { for_items(n, f); }
    template <class F> RVE_INLINE bool any_place(int n, F f) { return any_item(n, f); }

    /// A pack adds to the sums themselves.
    template <int M, class Term, class F>
    RVE_INLINE void survey_items(int n, F f, Survey<M> &survey)
    {
      survey = Survey<M>{};
      int i = 0;
      if constexpr (std::is_invocable_v<F, Pack, std::int64_t *, float &>)
        for (; i + Lanes <= n; i += Lanes) f(Pack{i}, survey.sum, survey.largest);
      for (; i < n; ++i) add_to_survey<M, Term>(i, f, survey);
    }

    template <int M, class Term, class F, class Then>
    RVE_INLINE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      for (int m = 0; m < M; ++m) sum[m] = 0;
      int i = 0;
      if constexpr (std::is_invocable_v<F, Pack, std::int64_t *>)
        for (; i + Lanes <= n; i += Lanes) f(Pack{i}, sum);
      for (; i < n; ++i) add_terms<M, Term>(i, f, sum);
      then();
    }

    template <class F> RVE_INLINE bool any_item(int n, F f)
    {
      bool result = false;
      int i = 0;
      if constexpr (std::is_invocable_v<F, Pack>)
        for (; i + Lanes <= n; i += Lanes) result = f(Pack{i}) | result;
      for (; i < n; ++i) result = f(i) | result;
      return result;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
