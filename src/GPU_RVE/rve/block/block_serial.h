// The execution vocabulary of a block program, and its implementation by one CPU thread.
//
// A block program is written once, as phases over items, and runs on a CPU thread (BlockSerial) or on a CUDA thread block
// (BlockCuda). A Block offers
//
//   for_each(n, f)          f(item) for items 0..n-1; a phase: ends in a barrier. `item` converts to int
//   once(f)                 f() by one thread; ends in a barrier
//   any(n, f)               a phase that returns whether f(item) was true for any item
//   sum_array(n, a)         sum of the n doubles of an array, in an order that does not depend on the number of threads
//   max_array(n, a)         largest of the n doubles of an array, or 0
//   sum_integers<M>(n, f)   f(item, std::int64_t *term) adds to term[0..M-1]; returns the M sums, exact
//   exclusive_scan(a, n)    in place; returns the total
//   add(p, v), fetch_min(p, v), fetch_add(p, v)    integer accumulation from inside a phase
//   per_item<State>(n)      storage that is private to an item and lives across phases; reached as state[item] in for_each
//
// The contract that makes one text correct on both:
//   1. a variable declared outside a phase is uniform: every thread holds the same value;
//   2. in a phase, item i writes only item i's data, or adds to an integer accumulator;
//   3. collectives return the result to every thread and stand in uniform control flow;
//   4. what is private to an item across phases is declared by per_item, and is the only thing that is.

#ifndef RVE_BLOCK_BLOCK_SERIAL_H
#define RVE_BLOCK_BLOCK_SERIAL_H

#include "rve/core/integer_sums.h"

#include <cstddef>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// One CPU thread is the block: phases are plain loops, barriers are nothing.
  class BlockSerial {
   public:
    /// `item_storage` serves per_item; `item_storage_size` is checked by the caller with item_bytes().
    RVE_HD explicit BlockSerial(void *item_storage) : storage(item_storage) {}

    using Item = int;

    template <class F> RVE_INLINE void for_each(int n, F f)
    {
      for (int i = 0; i < n; ++i) f(i);
    }

    template <class F> RVE_INLINE void once(F f) { f(); }

    template <class F> RVE_INLINE bool any(int n, F f)
    {
      bool result = false;
      for (int i = 0; i < n; ++i) result = f(i) | result;
      return result;
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

    template <class Integer> RVE_INLINE void add(Integer *p, Integer v) { *p += v; }
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

    template <class State> struct PerItem {
      State *state;
      RVE_INLINE State &operator[](int item) { return state[item]; }
    };

    template <class State> RVE_INLINE PerItem<State> per_item(int)
    {
      return PerItem<State>{static_cast<State *>(storage)};
    }

   private:
    void *storage;
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
