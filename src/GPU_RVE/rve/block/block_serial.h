// SPDX-License-Identifier: GPL-2.0-only
// The execution vocabulary of a block program, and its implementation by one CPU thread.
//
// A block program is written once, as phases over items, and runs on a CPU thread (BlockSerial) or on a CUDA thread block
// (BlockCuda). A Block offers
//
//   for_each(n, f)          f(item) for items 0..n-1; a phase: ends in a barrier. `item` converts to int
//   for_each(n, f, aside)   the same, and aside() by one thread meanwhile
//   once(f)                 f() by one thread; ends in a barrier
//   any(n, f)               a phase that returns whether f(item) was true for any item
//   any(n, f, aside)        the same, and aside() by one thread meanwhile
//   sum_array(n, a)         sum of the n doubles of an array, in an order that does not depend on the number of threads
//   max_array(n, a)         largest of the n doubles of an array, or 0
//   sum_integers<M>(n, f)   f(item, std::int64_t *term) adds to term[0..M-1]; returns the M sums, exact
//   exclusive_scan(a, n)    in place; returns the total
//   scan_to_starts(a, n)    the same, and a[n] becomes the total
//   order_by_class<Classes>(n, class_of, take)    a phase: take(item, place) with places for the items of class 0 first, then for those of class 1, ...;
//                           those of a class keep their order
//   reorder(n, place, room, a...)    a phase: a[place(item)] = a[item] for all resident items at once; `room` holds that of all arrays, which
//                           follow in it one another, those that are aligned most first
//   add(p, v), fetch_min(p, v), fetch_add(p, v)    integer accumulation from inside a phase
//   accumulate(sums, room, i, v)   adds to the i-th sum of an array with room for so many, which lies as a block wants it: nothing else touches
//       it but collect(sums, room, i), which takes the sum and leaves zero, and begin_sum(sums, room, i)
//   resident(array)         an item's own numbers in array[item], which may live in registers across phases
//   for_items, any_item, sum_items<M>    as for_each, any, sum_integers, over the items of resident arrays, and only over them
//       A phase whose f takes `const auto i` may also get a PackItem, several items at a time (block/block_simd.h)
//   for_items(n, f, m, g)   and g(0) ... g(m - 1) meanwhile, by those who most often have no item
//   for_places(n, f), any_place(n, f)    as for_items, any_item, and f(place) as well where a GPU's thread has registers for an item and none in
//       them: without a branch around f. for_empty_places(n, f) is for those places alone, and ends in no barrier
//   own_items(n, f)         as for_items, but f(item) neither reads nor writes what another item does before the next phase: no barrier
//   survey_items<M, Term>(n, f, survey)    f(item, Term *term, float &largest) adds to the item's terms, 32-bit or 64-bit
//                           integers, and raises `largest`, which is not negative; leaves the sums over the items and the largest
//                           number where all threads can read them. A PackItem gets 64-bit integers
//   for_items_in_turn, survey_items_in_turn    as these, where a GPU's thread shall take its items one after the other by the same code. Behind
//                           its last one rest(Term *term) of a survey adds what it has kept beside
//   reread()                what was read from memory before is read again; nothing on a CPU
//   anew(x)                 x; on a GPU what follows from it is computed again, not kept
//   read_whole(a[i]), write_whole(a[i], x)    of an array in the memory of an RVE: a GPU moves 16 bytes at a time, where elements have 16, 32, ...
//   uniform(x)              x, which is the same for all threads; a GPU keeps it once for many of them (kHasUniforms)
//   add_up_items<M, Term>(n, f, sum, then)    f(item, Term *term) alike; leaves the sums in `sum`; then() by one thread when they are there. Behind
//                           begin_add_up() and a barrier, each time
//
// The contract that makes one text correct on both:
//   1. a variable declared outside a phase is uniform: every thread holds the same value;
//   2. in a phase, item i writes only item i's data, or adds to an integer accumulator;
//   3. collectives return the result to every thread and stand in uniform control flow;
//   4. what an item keeps across phases in registers is declared by `resident`, and is the only thing that is.

#pragma once

#include "rve/block/reorder.h"
#include "rve/core/integer_sums.h"

#include <cstddef>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// One CPU thread is the block: phases are plain loops, barriers are nothing.
  class BlockSerial {
   public:
    using Item = int;
    /// Whether resident items live in registers.
    static constexpr bool kInRegisters = false;
    static constexpr bool kHasUniforms = false;
    /// Resident items at most where arrays lie on a chip at places that are known when the program is compiled, from chip() on; 0: they do not.
    static constexpr int kCapacity = 0;
    /// How much of what a loop reads should be on its way at a time, where each would be waited for.
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

    template <class F> RVE_INLINE void for_items(int n, F f) { for_each(n, f); }
    template <class F, class G> RVE_INLINE void for_items(int n, F f, int m, G g)
    {
      for_each(n, f);
      for (int k = 0; k < m; ++k) g(k);
    }
    template <class F, class G> RVE_INLINE void for_items_in_turn(int n, F f, int m, G g)
    {
      for_items(n, f, m, g);
    }
    template <class F> RVE_INLINE bool any_item(int n, F f) { return any(n, f); }
    template <class F> RVE_INLINE void for_places(int n, F f) { for_items(n, f); }
    template <class F> RVE_INLINE bool any_place(int n, F f) { return any_item(n, f); }
    template <class F> static RVE_INLINE void for_empty_places(int, F) {}
    template <int M, class F> RVE_INLINE IntegerSums<M> sum_items(int n, F f)
    {
      return sum_integers<M>(n, f);
    }
    template <class F> RVE_INLINE void own_items(int n, F f) { for_each(n, f); }
    template <int M, class Term, class F>
    RVE_INLINE void survey_items(int n, F f, Survey<M> &survey)
    {
      survey = Survey<M>{};
      for (int i = 0; i < n; ++i) add_to_survey<M, Term>(i, f, survey);
    }
    template <int M, class Term, class F, class Rest>
    RVE_INLINE void survey_items_in_turn(int n, F f, Rest rest, Survey<M> &survey)
    {
      survey_items<M, Term>(n, f, survey);
      const auto add_rest = [&](int, Term *term) RVE_INLINE_LAMBDA { rest(term); };
      add_terms<M, Term>(n, add_rest, survey.sum);
    }
    static RVE_INLINE void reread() {}
    template <class T> static RVE_INLINE T anew(T x) { return x; }
    template <class T> static RVE_INLINE T uniform(const T &x) { return x; }
    template <class T> static RVE_INLINE T read_whole(const T &element) { return element; }
    template <class T> static RVE_INLINE void write_whole(T &element, const T &x) { element = x; }
    static RVE_INLINE void begin_add_up() {}
    template <int M, class Term, class F, class Then>
    RVE_INLINE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      for (int m = 0; m < M; ++m) sum[m] = 0;
      for (int i = 0; i < n; ++i) add_terms<M, Term>(i, f, sum);
      then();
    }

    /// f(k) for those of 0 ... count - 1 that are the share of resident item i of n.
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

    /// Chunks of 32 items, each summed in order, then the chunks in order: BlockCuda does the same.
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

    template <class Place, class... T>
    RVE_INLINE void reorder(int n, Place place, void *room, T *...array)
    {
      reorder_by_room(*this, n, place, room, array...);
    }

    template <class Integer> static RVE_INLINE void begin_sum(Integer *sums, int /*room*/, int i)
    {
      sums[i] = 0;
    }
    template <class Integer>
    RVE_INLINE void accumulate(Integer *sums, int /*room*/, int i, Integer v)
    {
      sums[i] = wrapping_sum(sums[i], v);
    }
    template <class Integer> RVE_INLINE Integer collect(Integer *sums, int /*room*/, int i)
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

    /// An item's own numbers in arrays[item], which it may keep in registers across phases: between load and save it may keep
    /// another value, and only publish shows the others what it does. load_whole, save_whole: as read_whole. Here it is the array itself.
    template <class T> struct Resident {
      T *array;
      RVE_INLINE T &operator[](int item) const { return array[item]; }
      RVE_INLINE void load(int) const {}
      RVE_INLINE void save(int) const {}
      RVE_INLINE void load_whole(int) const {}
      RVE_INLINE void save_whole(int) const {}
      RVE_INLINE void keep(int item, const T &value) const { array[item] = value; }
      RVE_INLINE void publish(int item, const T &value) const { array[item] = value; }
    };

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
    static RVE_INLINE void add_to_survey(int i, F &f, Survey<M> &survey)
    {
      Term term[M] = {};
      f(i, static_cast<Term *>(term), survey.largest);
      for (int m = 0; m < M; ++m)
        survey.sum[m] = wrapping_sum(survey.sum[m], static_cast<std::int64_t>(term[m]));
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
