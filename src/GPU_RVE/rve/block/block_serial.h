// SPDX-License-Identifier: GPL-2.0-only
// The functions of a block, with which kernels are written, and their implementation by one CPU
// thread.
//
// A kernel is written once, as a sequence of phases. A phase is a parallel loop over items, mostly
// grains. The kernel runs on a CPU thread (BlockSerial) or on a CUDA thread block (BlockCuda). A
// Block has these functions:
//
// Phases. Each ends in a barrier.
//   for_each(n, f)          f(item) for items 0 ... n - 1; `item` converts to int
//   for_each(n, f, aside)   the same, and aside() by one thread at the same time
//   once(f)                 f() by one thread
//   any(n, f)               returns whether f(item) was true for any item
//   any(n, f, aside)        the same, and aside() by one thread at the same time
//
// Collectives. Each returns its result to every thread.
//   sum_array(n, a)         sum of n doubles, in an order that depends on n only
//   max_array(n, a)         largest of n doubles, or 0 if all are negative
//   sum_integers<M>(n, f)   f(item, std::int64_t *term) adds to M terms; returns the exact sums
//   exclusive_scan(a, n)    replaces a[i] by a[0] + ... + a[i - 1]; returns the sum of all numbers
//   scan_to_starts(a, n)    the same, and a[n] becomes the total
//   order_by_class<Classes>(n, class_of, take)
//                           calls take(item, index) with new indices: items of class 0 come first,
//                           then items of class 1, ...; items of a class keep their order
//
// Integer accumulation from inside a phase.
//   add(p, v), fetch_min(p, v), fetch_add(p, v)
//   accumulate(sums, capacity, i, v)
//                           adds v to sum i of an array with `capacity` sums. The layout of the
//                           array depends on the block. Two other functions access the array:
//                           begin_sum(sums, capacity, i) clears a sum, and
//                           collect(sums, capacity, i) returns a sum and clears it
//
// Resident arrays: only item i accesses element i, so that a block can keep it in registers.
//   resident(array)         resident array whose elements are stored in `array`
//   for_items, any_item     as for_each and any, over the items of resident arrays only. If f takes
//                           `const auto i`, a block with packs passes a PackItem, which is several
//                           items. The template parameter `way` of for_items, any_item and
//                           reduce_items is a Visit
//   for_items(n, f, m, g)   for_items(n, f), and g(0) ... g(m - 1) at the same time
//   for_empty_registers(n, f)  f(i) in threads that have registers for an item but no item. There
//                           is no barrier
//   own_items(n, f)         as for_items, but without a barrier. f(item) must not access data that
//                           other items access before the next phase
//   reduce_items<M, Term>(n, f, rest, reduction)
//                           sums M terms and finds the largest number over all items.
//                           f(item, Term *term, float &largest) adds to the terms of the item and
//                           raises `largest`, which is not negative. A Term is an integer of 32 or
//                           64 bits (64 for a PackItem). rest(Term *term) is called once by each
//                           thread, after its items, and adds further terms. All threads can read
//                           the results in `reduction` afterwards
//   add_up_items<M, Term>(n, f, sum, then)
//                           sums M terms over all items: f(item, Term *term) adds to the terms. One
//                           thread writes the sums to `sum` and then calls then(). begin_add_up()
//                           and a barrier must precede this function
//
// The hints to the compiler are in compiler_hints.h.
//
// A kernel is correct on both machines under this contract:
//   1. a variable declared outside a phase is uniform: every thread holds the same value;
//   2. in a phase, item i writes only item i's data, or adds to an integer accumulator;
//   3. collectives return the result to every thread and are called in uniform control flow;
//   4. only numbers declared by `resident` are in registers across phases.

#pragma once

#include "rve/block/compiler_hints.h"
#include "rve/core/integer_sums.h"
#include "rve/core/pack_item.h"

#include <cstddef>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// A single CPU thread is the block: phases are plain loops, and barriers are empty.
  class BlockSerial : public NoCompilerHints {
   public:
    using Item = int;
    /// True if resident items are in registers.
    static constexpr bool kInRegisters = false;
    static constexpr bool kHasUniforms = false;
    /// Largest number of resident items if their arrays are on chip, at offsets from chip() that
    /// are known at compile time. Otherwise 0.
    static constexpr int kCapacity = 0;
    /// Number of reads in a loop that are issued together to hide their latency.
    static constexpr int kOnTheWay = 1;

    template <class F> RVE_INLINE void for_each(int n, F f)
    {
      for (int i = 0; i < n; ++i) f(i);
    }

    template <class F, class Aside> RVE_INLINE void for_each(int n, F f, Aside aside)
    {
      for_each(n, f);
      aside();
    }

    template <Visit = Visit::Items, class F> RVE_INLINE void for_items(int n, F f)
    {
      for_each(n, f);
    }
    template <Visit = Visit::Items, class F, class G>
    RVE_INLINE void for_items(int n, F f, int m, G g)
    {
      for_each(n, f);
      for (int k = 0; k < m; ++k) g(k);
    }
    template <Visit = Visit::Items, class F> RVE_INLINE bool any_item(int n, F f)
    {
      return any(n, f);
    }
    template <class F> static RVE_INLINE void for_empty_registers(int, F) {}
    template <class F> RVE_INLINE void own_items(int n, F f) { for_each(n, f); }
    template <int M, class Term, Visit = Visit::Items, class F, class Rest>
    RVE_INLINE void reduce_items(int n, F f, Rest rest, Reduction<M> &reduction)
    {
      reduction = Reduction<M>{};
      for (int i = 0; i < n; ++i) add_to_reduction<M, Term>(i, f, reduction);
      add_rest<M, Term>(rest, reduction);
    }
    static RVE_INLINE void begin_add_up() {}
    template <int M, class Term, class F, class Then>
    RVE_INLINE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      for (int m = 0; m < M; ++m) sum[m] = 0;
      for (int i = 0; i < n; ++i) add_terms<M, Term>(i, f, sum);
      then();
    }

    /// Distributes the numbers 0 ... count - 1 over n resident items and calls f(k) for each number
    /// k of item i.
    template <class F> static RVE_INLINE void share_out(int i, int n, int count, F f)
    {
      for (int k = i; k < count; k += n) f(k);
    }

    template <class F> RVE_INLINE void once(F f) { f(); }

    template <class F> RVE_INLINE bool any(int n, F f)
    {
      bool result = false;
      for (int i = 0; i < n; ++i) result = f(i) | result;
      return result;
    }

    template <class F, class Aside> RVE_INLINE bool any(int n, F f, Aside aside)
    {
      aside();
      return any(n, f);
    }

    /// Sums chunks of 32 items in order, then the chunks in order, as BlockCuda does.
    RVE_INLINE double sum_array(int n, const double *a)
    {
      double total = 0.0;
      for (int first = 0; first < n; first += 32) {
        double chunk = 0.0;
        for (int i = first; i < n && i < first + 32; ++i) chunk = chunk + a[i];
        total = total + chunk;
      }
      return total;
    }

    RVE_INLINE double max_array(int n, const double *a)
    {
      double largest = 0.0;
      for (int i = 0; i < n; ++i) largest = a[i] > largest ? a[i] : largest;
      return largest;
    }

    template <int M, class F> RVE_INLINE IntegerSums<M> sum_integers(int n, F f)
    {
      IntegerSums<M> sums;
      for (int m = 0; m < M; ++m) sums.value[m] = 0;
      for (int i = 0; i < n; ++i) f(i, sums.value);
      return sums;
    }

    RVE_INLINE int exclusive_scan(int *a, int n)
    {
      int total = 0;
      for (int i = 0; i < n; ++i) {
        const int x = a[i];
        a[i] = total;
        total += x;
      }
      return total;
    }

    RVE_INLINE int scan_to_starts(int *a, int n) { return a[n] = exclusive_scan(a, n); }

    template <int Classes, class ClassOf, class Take>
    RVE_INLINE void order_by_class(int n, ClassOf class_of, Take take)
    {
      int next[Classes + 1] = {};
      for (int i = 0; i < n; ++i) ++next[class_of(i) + 1];
      for (int k = 1; k < Classes; ++k) next[k] += next[k - 1];
      for (int i = 0; i < n; ++i) take(i, next[class_of(i)]++);
    }

    template <class Integer>
    static RVE_INLINE void begin_sum(Integer *sums, int /*capacity*/, int i)
    {
      sums[i] = 0;
    }
    template <class Integer>
    RVE_INLINE void accumulate(Integer *sums, int /*capacity*/, int i, Integer v)
    {
      sums[i] = wrapping_sum(sums[i], v);
    }
    template <class Integer> RVE_INLINE Integer collect(Integer *sums, int /*capacity*/, int i)
    {
      const Integer total = sums[i];
      sums[i] = 0;
      return total;
    }

    RVE_INLINE void add(std::int32_t *p, std::int32_t v) { *p += v; }
    RVE_INLINE int fetch_add(int *p, int v)
    {
      const int old = *p;
      *p += v;
      return old;
    }
    RVE_INLINE void fetch_min(int *p, int v)
    {
      if (v < *p) *p = v;
    }

    /// Array in which item i owns element i. A block can keep the element in a register across
    /// phases. Between load and save the register and memory can differ. Other items see a new
    /// value only after publish. load_whole and save_whole access memory as read_whole and
    /// write_whole do. BlockSerial uses the array itself.
    template <class T> using Resident = ItemsInArray<T>;
    template <class T> RVE_INLINE Resident<T> resident(T *array) { return Resident<T>{array}; }

   protected:
    template <int M, class Term, class F>
    static RVE_INLINE void add_terms(int i, const F &f, std::int64_t *sum)
    {
      Term term[M] = {};
      f(i, static_cast<Term *>(term));
      for (int m = 0; m < M; ++m) sum[m] = wrapping_sum(sum[m], static_cast<std::int64_t>(term[m]));
    }

    template <int M, class Term, class F>
    static RVE_INLINE void add_to_reduction(int i, F &f, Reduction<M> &reduction)
    {
      add_terms<M, Term>(
          i, [&](int item, Term *term) RVE_INLINE_LAMBDA { f(item, term, reduction.largest); },
          reduction.sum);
    }

    template <int M, class Term, class Rest>
    static RVE_INLINE void add_rest(Rest &rest, Reduction<M> &reduction)
    {
      add_terms<M, Term>(
          0, [&](int, Term *term) RVE_INLINE_LAMBDA { rest(term); }, reduction.sum);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
