// SPDX-License-Identifier: GPL-2.0-only
// The execution vocabulary of block_serial.h on one CUDA thread block. The only place, beside the CUDA engine, that knows of
// threads. Works for any block size from 1 to 1024, which may change from launch to launch: that is why CUB's block
// primitives, whose size is a template parameter, are not used here.

#pragma once

#include "rve/block/reorder.h"
#include "rve/core/config.h"
#include "rve/core/integer_sums.h"

#include <cstdint>
#include <type_traits>

#define RVE_DEVICE __device__ __forceinline__
#define RVE_ROLLED _Pragma("unroll 1")

namespace rve {
inline namespace RVE_ISA {

  /// Shared memory of the collectives of a block with so many warps at most.
  template <int Warps> struct CudaScratch {
    static constexpr int kChunks = 8 * Warps;
    union {
      double chunk[kChunks];
      long long sum[16][Warps];
      int scan[Warps], of_class[16][Warps];
    };
    int largest[Warps];
  };

  /// One of the items of a thread. Which of them is known when the program is compiled: registers have no addresses.
  struct ItemOfThread {
    int index, place;
    RVE_DEVICE operator int() const { return index; }
  };
  RVE_DEVICE int register_of(int)
  {
    return 0;
  }
  RVE_DEVICE int register_of(ItemOfThread item)
  {
    return item.place;
  }

  /// Of a block with `MostThreads` at most. ItemsPerThread: 1 or 2, a phase over resident items has no more of them for each thread of the block, which keeps them in registers;
  /// 0: any number, in memory. What lies on chip has room for `Capacity` items.
  template <int ItemsPerThread, int MostThreads = 1024, int Capacity = ItemsPerThread *MostThreads>
  class BlockCuda {
   public:
    using Item = std::conditional_t<ItemsPerThread == 2, ItemOfThread, int>;
    static constexpr bool kInRegisters = ItemsPerThread > 0;
    static constexpr int kOnTheWay = 4;
    static constexpr int kCapacity = Capacity;
    /// A thread with one item has registers enough: the compiler would leave uniforms there.
    static constexpr bool kHasUniforms = ItemsPerThread == 2;

    template <class F> RVE_DEVICE void for_each(int n, F f)
    {
      visit_all(n, f);
      __syncthreads();
    }

    template <class F, class Aside> RVE_DEVICE void for_each(int n, F f, Aside aside)
    {
      visit_all(n, f);
      do_aside(aside);
      __syncthreads();
    }

    template <class F> RVE_DEVICE void for_items(int n, F f)
    {
      visit_items(n, f);
      __syncthreads();
    }

    template <class F, class G> RVE_DEVICE void for_items(int n, F f, int m, G g)
    {
      visit_items(n, f);
      for (int k = blockDim.x - 1 - threadIdx.x; k < m; k += blockDim.x) g(k);
      __syncthreads();
    }

    template <class F, class G> RVE_DEVICE void for_items_in_turn(int n, F f, int m, G g)
    {
      visit_in_turn(n, f);
      for (int k = blockDim.x - 1 - threadIdx.x; k < m; k += blockDim.x) g(k);
      __syncthreads();
    }

    template <class F> RVE_DEVICE void once(F f)
    {
      if (threadIdx.x == 0) f();
      __syncthreads();
    }

    template <class F> RVE_DEVICE bool any(int n, F f)
    {
      bool mine = false;
      visit_all(n, [&](Item i) { mine = f(i) | mine; });
      return __syncthreads_or(mine) != 0;
    }

    template <class F, class Aside> RVE_DEVICE bool any(int n, F f, Aside aside)
    {
      do_aside(aside);
      return any(n, f);
    }

    /// Of the items of a thread.
    static RVE_DEVICE bool is_first(Item item) { return register_of(item) == 0; }

    template <class F> RVE_DEVICE bool any_item(int n, F f)
    {
      bool mine = false;
      visit_items(n, [&](Item i) RVE_INLINE_LAMBDA { mine = f(i) | mine; });
      return __syncthreads_or(mine) != 0;
    }

    template <class F> RVE_DEVICE void for_places(int n, F f)
    {
      visit_places(n, f);
      __syncthreads();
    }

    template <class F> RVE_DEVICE bool any_place(int n, F f)
    {
      int mine = 0;
      visit_places(n, [&](Item i) RVE_INLINE_LAMBDA { mine = f(i) | mine; });
      return __syncthreads_or(mine) != 0;
    }

    template <class F> static RVE_DEVICE void for_empty_places(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        const int i = threadIdx.x;
        if (i >= n) f(i);
      }
    }

    RVE_DEVICE double sum_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) { return x + y; });
    }

    RVE_DEVICE double max_array(int n, const double *a)
    {
      return reduce(n, a, [](double x, double y) { return y > x ? y : x; });
    }

    template <int M, class F> RVE_DEVICE IntegerSums<M> sum_integers(int n, F f)
    {
      std::int64_t term[M];
      for (int m = 0; m < M; ++m) term[m] = 0;
      visit_all(n, [&](Item i) { f(i, term); });
      return add_up<M>(term);
    }

    template <int M, class F> RVE_DEVICE IntegerSums<M> sum_items(int n, F f)
    {
      std::int64_t term[M];
      for (int m = 0; m < M; ++m) term[m] = 0;
      visit_items(n, [&](Item i) { f(i, term); });
      return add_up<M>(term);
    }

    template <class F> RVE_DEVICE void own_items(int n, F f) { visit_items(n, f); }

    /// With two items of a thread they are the share of the first. Places without an item have none.
    template <class F> static RVE_DEVICE void share_out(Item i, int n, int count, F f)
    {
      if (register_of(i) != 0) return;
      if (ItemsPerThread == 1 && i >= n) return;
      const int stride = ItemsPerThread == 2 ? min(n, static_cast<int>(blockDim.x)) : n;
      for (int k = i; k < count; k += stride) f(k);
    }

    template <int M, class Term, class F>
    RVE_DEVICE void survey_items(int n, F f, Survey<M> &survey)
    {
      survey_visited<M, Term>([&](auto g) { visit_items(n, g); }, f, [](Term *) {}, survey);
    }
    template <int M, class Term, class F, class Rest>
    RVE_DEVICE void survey_items_in_turn(int n, F f, Rest rest, Survey<M> &survey)
    {
      survey_visited<M, Term>([&](auto g) { visit_in_turn(n, g); }, f, rest, survey);
    }

    /// visit(g) calls g(item) for the items of a thread, which then adds the rest.
    template <int M, class Term, class Visit, class F, class Rest>
    RVE_DEVICE void survey_visited(Visit visit, F f, Rest rest, Survey<M> &survey)
    {
      constexpr bool one_item = ItemsPerThread == 1;
      using Sum = std::conditional_t<one_item, Term, std::int64_t>;
      Sum sum[M];
      float largest = 0.0f;
      for (int m = 0; m < M; ++m) sum[m] = 0;
      // to terms of 32 bits, of which several can be more
      const auto add = [&](auto g) RVE_INLINE_LAMBDA {
        if constexpr (one_item) {
          g(sum);
        } else {
          Term term[M];
          for (int m = 0; m < M; ++m) term[m] = 0;
          g(term);
          for (int m = 0; m < M; ++m) sum[m] += term[m];
        }
      };
      visit([&](Item i) RVE_INLINE_LAMBDA {
        add([&](Term *term) RVE_INLINE_LAMBDA { f(i, term, largest); });
      });
      add(rest);
      // the bits are ordered as the numbers are, which are not negative
      const int of_warp = __reduce_max_sync(kAllLanes, __float_as_int(largest));
      if (lane() == 0) scratch().largest[warp()] = of_warp;
      sum_in_warps<M>(sum);
      for (int m = warp(); m <= M; m += num_warps()) {
        if (m == M) {
          int most = 0;
          for (int w = lane(); w < num_warps(); w += lanes_here())
            most = max(most, scratch().largest[w]);
          most = __reduce_max_sync(kAllLanes, most);
          if (lane() == 0) survey.largest = __int_as_float(most);
        } else {
          const long long total = sum_over_warps(m);
          if (lane() == 0) survey.sum[m] = total;
        }
      }
      __syncthreads();
    }

    static RVE_DEVICE void begin_add_up()
    {
      for (int k = threadIdx.x; k < kTotals; k += blockDim.x) totals()[k] = 0;
    }

    /// Each warp adds what it has to the totals on chip, in limbs that add up without carries: no other phase is needed until one thread knows them.
    template <int M, class Term, class F, class Then>
    RVE_DEVICE void add_up_items(int n, F f, std::int64_t *sum, Then then)
    {
      using Own = std::conditional_t<ItemsPerThread == 1, Term, std::int64_t>;
      Own own[M];
      for (int m = 0; m < M; ++m) own[m] = 0;
      visit_items(n, [&](Item i) RVE_INLINE_LAMBDA {
        Term term[M];
        for (int m = 0; m < M; ++m) term[m] = 0;
        f(i, term);
        for (int m = 0; m < M; ++m) own[m] += term[m];
      });
      // of a thread's one or two terms of 32 bits all limbs but the first have 17
      using Limbed = std::conditional_t<(ItemsPerThread > 0), Term, std::int64_t>;
      constexpr int limbs = kLimbs<Limbed>;
      static_assert(M * limbs <= kTotals, "a total for each limb");
      int of_warp[M * limbs];
      RVE_UNROLL
      for (int m = 0; m < M; ++m) { add_limbs_of_warp<Limbed>(own[m], of_warp + m * limbs); }
      if (lane() == 0) {
        RVE_UNROLL
        for (int m = 0; m < M * limbs; ++m) { atomicAdd(totals() + m, of_warp[m]); }
      }
      __syncthreads();
      if (threadIdx.x == 0) {
        sum_of_totals<M, Limbed>(sum);
        reread();    // the sums: kept, they would be spilled
        then();
      }
      __syncthreads();
    }

    RVE_DEVICE int exclusive_scan(int *a, int n)
    {
      const int total = scan(a, n);
      __syncthreads();
      return total;
    }
    RVE_DEVICE int scan_to_starts(int *a, int n)
    {
      const int total = scan(a, n);
      if (threadIdx.x == 0) a[n] = total;
      __syncthreads();
      return total;
    }

    template <int Classes, class ClassOf, class Take>
    RVE_DEVICE void order_by_class(int n, ClassOf class_of, Take take)
    {
      static_assert(Classes <= 16, "CudaScratch::of_class has room for 16 classes");
      // by all lanes: with __syncwarp() here spheres would have no uniforms (uniform())
      int next[Classes];
      RVE_UNROLL
      for (int k = 0; k < Classes; ++k) { next[k] = 0; }
      // asked for once where a thread has one item
      int first_class = -1;
      class_by_class(
          n,
          [&](int i) {
            first_class = class_of(i);
            return first_class;
          },
          next, [](int, int) {});
      if (lane() == 0) {
        RVE_UNROLL
        for (int k = 0; k < Classes; ++k) { scratch().of_class[k][warp()] = next[k]; }
      }
      __syncthreads();
      // the first place of each class in this warp's items: behind all of the classes before, and those of its own in the warps before
      int first = 0;
      RVE_UNROLL
      for (int k = 0; k < Classes; ++k) {
        const WarpCounts counts = sums_before_warp(scratch().of_class[k]);
        next[k] = first + counts.before;
        first += counts.all;
      }
      class_by_class(
          n, [&](int i) { return n <= static_cast<int>(blockDim.x) ? first_class : class_of(i); },
          next, take);
      __syncthreads();
    }

    template <class Place, class... T>
    RVE_DEVICE void reorder(int n, Place place, void *room, T *...array)
    {
      if constexpr (ItemsPerThread == 1) {
        // each thread has one of each array meanwhile
        const int i = threadIdx.x;
        carry(i < n ? i : -1, i < n ? place(i) : 0, array...);
        __syncthreads();
      } else {
        reorder_by_room(*this, n, place, room, array...);
      }
    }

    static RVE_DEVICE char *chip()
    {
      extern __shared__ __align__(16) char on_chip[];
      return on_chip;
    }

    /// What was read from memory before is not kept in registers: it is read again.
    static RVE_DEVICE void reread() { asm volatile("" ::: "memory"); }

    /// x, of which the compiler knows nothing: what follows from it is not kept in registers from step to step.
    static RVE_DEVICE int anew(int x)
    {
      asm("" : "+r"(x));
      return x;
    }
    static RVE_DEVICE float anew(float x)
    {
      asm("" : "+f"(x));
      return x;
    }
    static RVE_DEVICE double anew(double x)
    {
      asm("" : "+d"(x));
      return x;
    }

    /// x, which is the same for all threads, in the registers that a warp has once, beside those of its threads: products take them as an
    /// operand. The compiler (CUDA 13.0) leaves it there on three conditions. It must see that the threads of the warp are together: here
    /// it is told so. The kernel must be small, with all that it calls: up to about 15,000 instructions. And nothing that it calls may want
    /// more than about 160 registers. Else x takes ordinary registers, and what was there is spilled: bench/uniform_registers.sh sees it.
    template <class T> static RVE_DEVICE T uniform(const T &x)
    {
      constexpr int words = sizeof(T) / sizeof(unsigned);
      static_assert(words * sizeof(unsigned) == sizeof(T), "whole words");
      unsigned word[words];
      memcpy(word, &x, sizeof(T));
      __syncwarp();
      RVE_UNROLL
      for (int m = 0; m < words; ++m) { word[m] = __reduce_or_sync(kAllLanes, word[m]); }
      T same;
      memcpy(&same, word, sizeof(T));
      return same;
    }

    template <class T> static RVE_DEVICE T read_whole(const T &element)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        return element;
      } else {
        T x;
        const auto &pieces = reinterpret_cast<const PiecesOf<T> &>(element);
        const PiecesOf<T> copy = pieces;
        memcpy(&x, &copy, sizeof(T));
        return x;
      }
    }
    template <class T> static RVE_DEVICE void write_whole(T &element, const T &x)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        element = x;
      } else {
        PiecesOf<T> copy;
        memcpy(&copy, &x, sizeof(T));
        reinterpret_cast<PiecesOf<T> &>(element) = copy;
      }
    }

    /// x, in other registers than where it is: pieces of 16 bytes want four in a row, and what lives through all steps should not have to lie
    /// like that. The compiler does not know that the zero is one.
    template <class T> static RVE_DEVICE T in_other_registers(const T &x)
    {
      if constexpr (sizeof(T) % sizeof(Piece) != 0) {
        return x;
      } else {
        PiecesOf<T> copy;
        memcpy(&copy, &x, sizeof(T));
        const unsigned zero = blockDim.y - 1;
        for (Piece &piece : copy.piece)
          for (unsigned &word : piece.word) word ^= zero;
        T y;
        memcpy(&y, &copy, sizeof(T));
        return y;
      }
    }

    /// What the compiler may take for granted.
    static RVE_DEVICE void assume(bool condition) { __builtin_assume(condition); }

    static RVE_DEVICE void begin_sum(std::int32_t *sums, int, int i) { sums[i] = 0; }
    RVE_DEVICE void accumulate(std::int32_t *sums, int, int i, std::int32_t v)
    {
      atomicAdd(sums + i, v);
    }
    RVE_DEVICE std::int32_t collect(std::int32_t *sums, int, int i) { return taken(sums + i); }

    /// 64-bit atomics on shared memory are compare-and-swap loops. Two limbs, 24 bits and the rest, add up without carries: up
    /// to 256 terms of less than 2^55 / 256. Each has a row of its own: side by side, the limbs of many sums would meet in half of the banks.
    static RVE_DEVICE void begin_sum(std::int64_t *sums, int room, int i)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      limbs[i] = limbs[room + i] = 0;
    }
    RVE_DEVICE void accumulate(std::int64_t *sums, int room, int i, std::int64_t v)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      atomicAdd(limbs + i, static_cast<int>(v) & 0xffffff);
      atomicAdd(limbs + room + i, static_cast<int>(v >> 24));
    }
    RVE_DEVICE std::int64_t collect(std::int64_t *sums, int room, int i)
    {
      auto *limbs = reinterpret_cast<int *>(sums);
      const int low = taken(limbs + i), high = taken(limbs + room + i);
      return (static_cast<std::int64_t>(high) << 24) +
          static_cast<std::int64_t>(static_cast<unsigned>(low));
    }

    static RVE_DEVICE void add(std::int32_t *p, std::int32_t v) { atomicAdd(p, v); }
    static RVE_DEVICE int fetch_add(int *p, int v) { return atomicAdd(p, v); }
    static RVE_DEVICE void fetch_min(int *p, int v) { atomicMin(p, v); }

    template <class T, int Count> struct Copy {
      T value[Count];
      T *array;
      RVE_DEVICE T &operator[](Item item) { return value[register_of(item)]; }
      RVE_DEVICE void load(Item item) { value[register_of(item)] = array[item]; }
      RVE_DEVICE void save(Item item) { array[item] = value[register_of(item)]; }
      RVE_DEVICE void load_whole(Item item)
      {
        value[register_of(item)] = in_other_registers(read_whole(array[item]));
      }
      RVE_DEVICE void save_whole(Item item)
      {
        write_whole(array[item], in_other_registers(value[register_of(item)]));
      }
      RVE_DEVICE void keep(Item item, const T &x) { value[register_of(item)] = x; }
      RVE_DEVICE void publish(Item item, const T &x)
      {
        value[register_of(item)] = x;
        array[item] = x;
      }
    };
    template <class T> struct Copy<T, 0> {
      T *array;
      RVE_DEVICE T &operator[](int item) { return array[item]; }
      RVE_DEVICE void load(int) {}
      RVE_DEVICE void save(int) {}
      RVE_DEVICE void load_whole(int) {}
      RVE_DEVICE void save_whole(int) {}
      RVE_DEVICE void keep(int item, const T &x) { array[item] = x; }
      RVE_DEVICE void publish(int item, const T &x) { array[item] = x; }
    };
    template <class T> using Resident = Copy<T, ItemsPerThread>;

    template <class T> RVE_DEVICE Resident<T> resident(T *array)
    {
      // a value from the start, also for threads without an item: otherwise it would seem alive all over the kernel
      Resident<T> copy = Resident<T>();
      copy.array = array;
      return copy;
    }

   private:
    using Scratch = CudaScratch<MostThreads / 32>;

    /// What is read or written at a time. The arrays of an RVE begin at multiples of that.
    struct alignas(16) Piece {
      unsigned word[4];
    };
    template <class T> struct PiecesOf {
      Piece piece[sizeof(T) / sizeof(Piece)];
    };

    /// Where a thread has several items, every second round of threads goes backwards: spheres are numbered by how much there is to do, and no
    /// warp shall wait for one that has most twice. An item always has the same thread: some phases need no barrier for that.
    template <class F> static RVE_DEVICE void visit_all(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        // without names for its place: they would be kept in registers
        for (int i = threadIdx.x; i < n; i += blockDim.x) f(i);
      } else {
        const int threads = blockDim.x, me = threadIdx.x;
        if constexpr (ItemsPerThread == 2) {
          // a small kernel: uniform()
          RVE_ROLLED
          for (int i = me, hop = 2 * (threads - me) - 1; i < n; i += hop, hop = 2 * threads - hop) {
            f(Item{i, 0});
          }
        } else {
          for (int i = me, hop = 2 * (threads - me) - 1; i < n; i += hop, hop = 2 * threads - hop)
            f(i);
        }
      }
    }

    template <class F> static RVE_DEVICE void one_by_one(int first, int last, F f)
    {
      if constexpr (ItemsPerThread == 2) {
        // as in visit_all
        RVE_ROLLED
        for (int i = first; i < last; ++i) { f(i); }
      } else {
        for (int i = first; i < last; ++i) f(i);
      }
    }

    /// By the thread that most often has no item.
    template <class Aside> static RVE_DEVICE void do_aside(Aside aside)
    {
      if (threadIdx.x == blockDim.x - 1) aside();
    }

    /// f(item) for resident items: as many as a thread has, where they are in registers.
    template <class F> static RVE_DEVICE void visit_items(int n, F f)
    {
      if constexpr (ItemsPerThread == 1) {
        const int i = threadIdx.x;
        if (i < n) f(i);
      } else if constexpr (ItemsPerThread == 2) {
        const int first = place_again(), second = 2 * blockDim.x - 1 - first;
        if (first < n) f(Item{first, 0});
        if (second < n) f(Item{second, 1});
      } else {
        visit_all(n, f);
      }
    }

    /// f(place) for the items that a thread has registers for. With two of them each is in a branch of its own anyway.
    template <class F> static RVE_DEVICE void visit_places(int n, F f)
    {
      if constexpr (ItemsPerThread == 1)
        f(static_cast<int>(threadIdx.x));
      else
        visit_items(n, f);
    }

    /// f(item) for resident items, which all have the place of the first one in registers while it is their turn.
    template <class F> static RVE_DEVICE void visit_in_turn(int n, F f)
    {
      if constexpr (ItemsPerThread == 2) {
        const int first = threadIdx.x, second = 2 * blockDim.x - 1 - first;
        RVE_ROLLED
        for (int turn = 0; turn < 2; ++turn) {
          const int i = turn == 0 ? first : second;
          if (i < n) f(Item{i, 0});
        }
      } else {
        visit_items(n, f);
      }
    }

    /// threadIdx.x, read anew: the addresses of a second item, kept from step to step, would be spilled.
    static RVE_DEVICE int place_again()
    {
      int place;
      asm volatile("mov.u32 %0, %%tid.x;" : "=r"(place));
      return place;
    }

    /// What was there, of which zero is left.
    static RVE_DEVICE int taken(int *sum)
    {
      // on chip in one access, where reading it and a zero are two
      if constexpr (kInRegisters) return atomicExch(sum, 0);
      const int total = *sum;
      *sum = 0;
      return total;
    }

    /// A block is a thread block: what it is handed to needs no pointer to it.
    static RVE_DEVICE Scratch &scratch()
    {
      __shared__ Scratch memory;
      return memory;
    }

    static RVE_DEVICE int lane() { return threadIdx.x % 32; }
    static RVE_DEVICE int warp() { return threadIdx.x / 32; }
    static RVE_DEVICE int num_warps() { return (blockDim.x + 31) / 32; }
    /// Of this thread's warp: the last one may have fewer than 32.
    static RVE_DEVICE int lanes_here()
    {
      return min(32, static_cast<int>(blockDim.x) - 32 * warp());
    }
    /// All lanes of a warp. Those that are not there count as lanes that have ended, which nobody waits for; a mask that is not known when the
    /// program is compiled takes ten instructions of each exchange.
    static constexpr unsigned kAllLanes = 0xffffffffu;

    /// Sum over the threads of a warp: three limbs whose sums fit into 32 bits.
    static RVE_DEVICE long long sum_of_warp(std::int64_t term)
    {
      const unsigned low = static_cast<unsigned>(term) & 0x7ffffffu,
                     middle = static_cast<unsigned>(term >> 27) & 0x7ffffffu;
      const int high = static_cast<int>(term >> 54);
      return static_cast<long long>(__reduce_add_sync(kAllLanes, low)) +
          (static_cast<long long>(__reduce_add_sync(kAllLanes, middle)) << 27) +
          static_cast<long long>(static_cast<unsigned long long>(__reduce_add_sync(kAllLanes, high))
                                 << 54);
    }

    /// Two limbs.
    static RVE_DEVICE long long sum_of_warp(std::int32_t term)
    {
      const unsigned low = static_cast<unsigned>(term) & 0xffffu;
      const int high = term >> 16;
      return static_cast<long long>(__reduce_add_sync(kAllLanes, low)) +
          65536ll * __reduce_add_sync(kAllLanes, high);
    }

    /// Sums over the threads of each warp, in scratch().sum.
    template <int M, class Term> RVE_DEVICE void sum_in_warps(const Term *term)
    {
      static_assert(M <= 16, "CudaScratch::sum holds 16 numbers");
#pragma unroll
      for (int m = 0; m < M; ++m) {
        const long long sum = sum_of_warp(term[m]);
        if (lane() == 0) scratch().sum[m][warp()] = sum;
      }
      __syncthreads();
    }

    /// Of what sum_in_warps has left, by the threads of one warp.
    RVE_DEVICE long long sum_over_warps(int m)
    {
      std::int64_t mine = 0;
      for (int w = lane(); w < num_warps(); w += lanes_here()) mine += scratch().sum[m][w];
      return sum_of_warp(mine);
    }

    /// Limbs of a term of add_up_items: of so many bits but for the last one that those of 1024 threads add up in 32.
    template <class Limbed> static constexpr int kLimbs = sizeof(Limbed) > 4 ? 3 : 2;
    template <class Limbed> static constexpr int kLimbBits = sizeof(Limbed) > 4 ? 22 : 16;
    static constexpr int kTotals = 32;
    static RVE_DEVICE int *totals()
    {
      __shared__ int memory[kTotals];
      return memory;
    }

    template <class Limbed, class Own>
    static RVE_DEVICE void add_limbs_of_warp(Own term, int *of_warp)
    {
      constexpr int last = kLimbs<Limbed> - 1, bits = kLimbBits<Limbed>;
      RVE_UNROLL
      for (int k = 0; k < last; ++k) {
        const unsigned limb = static_cast<unsigned>(term >> (k * bits)) & ((1u << bits) - 1u);
        of_warp[k] = static_cast<int>(__reduce_add_sync(kAllLanes, limb));
      }
      of_warp[last] = __reduce_add_sync(kAllLanes, static_cast<int>(term >> (last * bits)));
    }

    template <int M, class Limbed> static RVE_DEVICE void sum_of_totals(std::int64_t *sum)
    {
      constexpr int last = kLimbs<Limbed> - 1, bits = kLimbBits<Limbed>;
      RVE_UNROLL
      for (int m = 0; m < M; ++m) {
        const int *const limb = totals() + m * kLimbs<Limbed>;
        std::uint64_t total = static_cast<std::uint64_t>(static_cast<std::int64_t>(limb[last]))
            << (last * bits);
        for (int k = 0; k < last; ++k)
          total += static_cast<std::uint64_t>(static_cast<unsigned>(limb[k])) << (k * bits);
        sum[m] = static_cast<std::int64_t>(total);
      }
    }

    /// Nothing, or number `from` of the first array and of the others to number `to`, when all threads have theirs.
    static RVE_DEVICE void carry(int /*from*/, int /*to*/)
    {
      __syncthreads();
    }
    template <class T, class... Others>
    static RVE_DEVICE void carry(int from, int to, T *array, Others *...others)
    {
      T held = {};
      if (from >= 0) held = array[from];
      carry(from, to, others...);
      if (from >= 0) array[to] = held;
    }

    /// visit(item, number[its class]), after which that number is one more for the next item of the class. Each warp has items in a row, and
    /// numbers of its own, of which all lanes know all.
    template <int Classes, class ClassOf, class Visit>
    static RVE_DEVICE void class_by_class(int n, ClassOf class_of, int (&number)[Classes],
                                          Visit visit)
    {
      const int threads = blockDim.x, lanes = lanes_here(), in_turn = 32 * num_warps();
      // most often without a division
      const int turns = n <= threads ? 1 : (n + in_turn - 1) / in_turn;
      const int begin = 32 * turns * warp(), end = min(begin + 32 * turns, n);
      const unsigned before = (1u << lane()) - 1u;
      RVE_ROLLED
      for (int first = begin; first < end; first += lanes) {
        const int i = first + lane();
        const int here = i < end ? class_of(i) : -1;
        int mine = 0;
        RVE_UNROLL
        for (int k = 0; k < Classes; ++k) {
          const unsigned same = __ballot_sync(kAllLanes, here == k);
          mine = here == k ? number[k] + __popc(same & before) : mine;
          number[k] += __popc(same);
        }
        if (here >= 0) visit(i, mine);
      }
    }

    /// The items of a thread where they follow each other.
    struct Share {
      int first, last;
    };
    static RVE_DEVICE Share share_of(int n)
    {
      const int threads = blockDim.x, me = threadIdx.x;
      // most often without a division
      const int share = n <= threads ? 1 : (n + threads - 1) / threads;
      const int first = min(me * share, n);
      return {first, min(first + share, n)};
    }

    /// Sum of the numbers of this warp's threads up to this one.
    static RVE_DEVICE int sum_of_lanes_up_to(int x)
    {
      // rolled loops, for a small kernel: uniform()
      RVE_ROLLED
      for (int offset = 1; offset < 32; offset *= 2) {
        const int left = __shfl_up_sync(kAllLanes, x, offset);
        if (lane() >= offset) x += left;
      }
      return x;
    }

    /// Of the numbers that warps have: the sum of those of the warps before, and of all. In each warp anew: another barrier would take longer.
    struct WarpCounts {
      int before, all;
    };
    static RVE_DEVICE WarpCounts sums_before_warp(const int *of_warps)
    {
      const int warps = num_warps(), mine = warp(), lanes = lanes_here();
      WarpCounts counts = {0, 0};
      RVE_ROLLED
      for (int w = lane(); w < warps; w += lanes) {
        const int of_warp = of_warps[w];
        counts.before += w < mine ? of_warp : 0;
        counts.all += of_warp;
      }
      return {__reduce_add_sync(kAllLanes, counts.before),
              __reduce_add_sync(kAllLanes, counts.all)};
    }

    /// a[i] becomes the sum of the numbers of the items before. Without a barrier at the end.
    RVE_DEVICE int scan(int *a, int n)
    {
      const Share share = share_of(n);
      int mine = 0;
      one_by_one(share.first, share.last, [&](int i) { mine += a[i]; });
      const int up_to = sum_of_lanes_up_to(mine);
      if (lane() == lanes_here() - 1) scratch().scan[warp()] = up_to;
      __syncthreads();
      const WarpCounts counts = sums_before_warp(scratch().scan);
      int before = counts.before + up_to - mine;
      one_by_one(share.first, share.last, [&](int i) {
        const int x = a[i];
        a[i] = before;
        before += x;
      });
      return counts.all;
    }

    /// Sums over the threads of the block.
    template <int M> RVE_DEVICE IntegerSums<M> add_up(const std::int64_t *term)
    {
      sum_in_warps<M>(term);
      IntegerSums<M> sums;
#pragma unroll
      for (int m = 0; m < M; ++m) sums.value[m] = sum_over_warps(m);
      __syncthreads();
      return sums;
    }

    /// Chunks of 32 items, each reduced in order, then the chunks in order, as BlockSerial does.
    template <class Operation> RVE_DEVICE double reduce(int n, const double *a, Operation operation)
    {
      double total = 0.0;
      const int num_chunks = (n + 31) / 32;
      for (int base = 0; base < num_chunks; base += Scratch::kChunks) {
        const int count = min(Scratch::kChunks, num_chunks - base);
        for (int c = threadIdx.x; c < count; c += blockDim.x) {
          double x = 0.0;
          for (int i = (base + c) * 32; i < n && i < (base + c + 1) * 32; ++i)
            x = operation(x, a[i]);
          scratch().chunk[c] = x;
        }
        __syncthreads();
        for (int c = 0; c < count; ++c) total = operation(total, scratch().chunk[c]);
        __syncthreads();
      }
      return total;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
