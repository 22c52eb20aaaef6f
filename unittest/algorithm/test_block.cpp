// SPDX-License-Identifier: GPL-2.0-only
// Compares every collective function of a block with a plain loop, for several numbers of threads.

#include "rve/algorithm/reorder.h"
#include "support/block_runner.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

using namespace rve_test;

namespace {

class Block : public BlockTest {
 protected:
  /// Calls check(threads, count) for all combinations.
  template <class Check> void for_sizes(Check check)
  {
    for (const int threads : block_sizes())
      for (const int count : {0, 1, 7, 33, 257, 1000, 10000}) {
        SCOPED_TRACE(std::to_string(threads) + " threads, " + std::to_string(count) + " items");
        check(threads, count);
      }
  }

  /// Calls check(threads, count, in_registers) for all valid combinations. Items in registers
  /// require at least one thread per item.
  template <class Check> void for_resident_sizes(Check check)
  {
    for_sizes([&](int threads, int count) {
      check(threads, count, false);
      if (count <= threads) {
        SCOPED_TRACE("in registers");
        check(threads, count, true);
      }
    });
  }
};

std::vector<double> random_numbers(int count, std::uint64_t seed)
{
  Random random(seed);
  std::vector<double> numbers(count);
  for (double &x : numbers) x = std::ldexp(random.uniform(-1.0, 1.0), random.integer(-40, 40));
  return numbers;
}

/// Returns 64-bit numbers whose sum carries between the 32-bit halves, in both directions.
std::vector<std::int64_t> random_integers(int count, std::uint64_t seed)
{
  Random random(seed);
  const std::int64_t carriers[] = {
      0xffffffffll, -1, 1, 0x80000000ll, -0x80000000ll, 0x100000000ll, -0x100000000ll, 0};
  std::vector<std::int64_t> numbers(count);
  for (std::int64_t &x : numbers)
    x = random.integer(0, 1) ? carriers[random.integer(0, 7)]
                             : static_cast<std::int64_t>(random.bits()) >> random.integer(14, 40);
  return numbers;
}

struct VisitAll {
  int count;
  int *visits;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) { visits[i] += 1 + i; });
    block.for_each(count, [&](typename Block::Item i) { visits[i] += 2; });
  }
};

/// In each phase, an item reads what another item computed in the previous phase.
struct ReverseTwice {
  int count;
  int *numbers, *mirror;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) { mirror[i] = numbers[count - 1 - i]; });
    block.for_each(count, [&](typename Block::Item i) { numbers[i] = 10 * mirror[count - 1 - i]; });
  }
};

/// A phase can have additional work besides its items. This work runs once, and its results are
/// visible after the phase.
struct CountAside {
  int count;
  int *visits, *calls;    ///< (count), (5)
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(
        count, [&](typename Block::Item i) { ++visits[i]; }, [&] { ++calls[0]; });
    block.for_items(
        count, [&](typename Block::Item i) { visits[i] += 10 * calls[0]; }, 4,
        [&](int k) { calls[1 + k] += k; });
    block.for_each(count, [&](typename Block::Item i) {
      visits[i] += 100 * (calls[1] + calls[2] + calls[3] + calls[4]);
    });
  }
};

struct CountOnce {
  int *calls;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.once([&] { ++*calls; });
    block.once([&] { *calls += 10; });
  }
};

struct AnyIsSet {
  int count;
  const int *flags;
  int *answers;    // (count); every thread must get the same answer
  int *asides;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    const auto is_set = [&](typename Block::Item i) { return flags[i] != 0; };
    const bool answer = block.any(count, is_set);
    const bool the_same = block.any(count, is_set, [&] { ++*asides; });
    const int seen = *asides;
    block.for_each(count, [&](typename Block::Item i) {
      answers[i] = answer == the_same && seen == 1 ? (answer ? 1 : 0) : -1;
    });
  }
};

struct SumAndMaximum {
  int count;
  const double *numbers;
  double *sums, *maxima;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    const double sum = block.sum_array(count, numbers);
    const double maximum = block.max_array(count, numbers);
    block.for_each(count, [&](typename Block::Item i) {
      sums[i] = sum;
      maxima[i] = maximum;
    });
    block.once([&] {
      sums[count] = sum;
      maxima[count] = maximum;
    });
  }
};

struct SumIntegers {
  int count;
  const std::int64_t *numbers;
  std::int64_t *answers;    // (count + 1, 3)
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    for (int round = 0; round < 2; ++round) {    // twice, to reuse the scratch memory
      const auto sums =
          block.template sum_integers<3>(count, [&](typename Block::Item i, std::int64_t *term) {
            term[0] += numbers[i];
            term[1] -= numbers[i];
            term[2] += i;
          });
      block.for_each(count + 1, [&](typename Block::Item i) {
        for (int m = 0; m < 3; ++m) answers[3 * i + m] = sums[m];
      });
    }
  }
};

struct Scan {
  int count;
  int *numbers, *totals, *starts;    // (count), (count + 1), (count + 1)
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    const int total = block.exclusive_scan(numbers, count);
    const int same = block.scan_to_starts(starts, count);
    block.for_each(count + 1,
                   [&](typename Block::Item i) { totals[i] = total == same ? total : -2; });
  }
};

/// Three numbers of a grain. Size and alignment of the struct differ from the size and alignment of
/// one number.
struct Triple {
  double number[3];
};

/// Sorts items by their keys; items of the same key keep their order.
struct OrderByKey {
  static constexpr int KEYS = 4;
  int count;
  const int *keys;
  int *places, *order;    // (count), (count)
  Triple *triples;
  int *numbers;
  char *room;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.template order_by_class<KEYS>(
        count, [&](int i) { return keys[i]; },
        [&](int i, int place) {
          places[i] = place;
          order[place] = i;
        });
    rve::reorder(
        block, count, [&](int i) { return places[i]; }, room, triples, numbers);
  }
};

/// Many items add to one number.
struct AddToCounters {
  static constexpr int COUNTERS = 5;
  int count;
  const std::int32_t *numbers;
  std::int32_t *counters;
  template <class Block> RVE_HD void operator()(Block &block, char *fast_memory) const
  {
    auto *fast = reinterpret_cast<std::int32_t *>(fast_memory);
    block.for_each(COUNTERS, [&](typename Block::Item a) { fast[a] = counters[a]; });
    block.for_each(count,
                   [&](typename Block::Item i) { block.add(&fast[i % COUNTERS], numbers[i]); });
    block.for_each(COUNTERS, [&](typename Block::Item a) { counters[a] = fast[a]; });
  }
};

/// Item i adds to sum i % num_sums. Every sum is filled and collected twice. It is then collected a
/// third time, when it is empty.
template <class Integer> struct AccumulateAndCollect {
  int count, num_sums;
  const Integer *numbers;
  Integer *collected;    // (3, num_sums)
  template <class Block> RVE_HD void operator()(Block &block, char *fast_memory) const
  {
    auto *sums = reinterpret_cast<Integer *>(fast_memory);
    block.for_each(num_sums, [&](typename Block::Item a) { Block::begin_sum(sums, num_sums, a); });
    for (int round = 0; round < 3; ++round) {
      if (round < 2)
        block.for_each(count, [&](typename Block::Item i) {
          block.accumulate(sums, num_sums, i % num_sums,
                           round == 0 ? numbers[i] : numbers[count - 1 - i]);
        });
      block.for_each(num_sums, [&](typename Block::Item a) {
        collected[round * num_sums + a] = block.collect(sums, num_sums, a);
      });
    }
  }
};

struct TicketsAndMinima {
  int count;
  int *next, *tickets, *minima;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) {
      tickets[i] = block.fetch_add(next, 1);
      block.fetch_min(&minima[i % 3], (i * 7919) % 1009 - 500);
    });
  }
};

struct ItemState {
  double number;
  int slots[3];
};

/// Items change their own numbers over several phases and read the published numbers of neighbours.
struct KeepResident {
  int count;
  ItemState *states;
  double *published;
  double *answers;    // (count); item i reads the saved state of another item
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    using Item = typename Block::Item;
    auto state = block.resident(states);
    auto shown = block.resident(published);
    block.for_items(count, [&](Item i) {
      state.load(i);
      shown.load(i);
    });
    block.for_items(count, [&](Item i) {
      state[i].number += 0.5 * i;
      for (int k = 0; k < 3; ++k) state[i].slots[k] += 3 * i + k;
    });
    for (int round = 0; round < 2; ++round) {
      block.for_items(count, [&](Item i) { shown.publish(i, shown[i] + state[i].number); });
      block.for_items(count, [&](Item i) {
        state[i].number += published[(i + 1) % count] + state[i].slots[1];
      });
    }
    block.for_items(count, [&](Item i) { state.save(i); });
    block.for_each(count, [&](Item i) {
      const ItemState &other = states[count - 1 - i];
      answers[i] = other.number + other.slots[2];
    });
  }
};

std::vector<ItemState> item_states(int count)
{
  std::vector<ItemState> states(count);
  for (int i = 0; i < count; ++i) states[i] = {1000.0 + i, {7, 8, 9 * i}};
  return states;
}

/// Visits all places of a block. Each item has a place, and each thread without an item has an
/// empty place. A phase over registers adds two to the place of an item and one to an empty place.
/// A phase over empty registers adds one to an empty place.
struct VisitPlaces {
  int count;
  int *visits;    ///< (places)
  int *found;     ///< (2) 1 if the last item was visited; 1 if an item before the first was
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    using Item = typename Block::Item;
    block.for_empty_registers(count, [&](Item i) { visits[i] += 1; });
    block.template for_items<rve::Visit::Registers>(
        count, [&](Item i) { visits[i] += i < count ? 2 : 1; });
    const bool last = block.template any_item<rve::Visit::Registers>(
        count, [&](Item i) { return i == count - 1; });
    const bool before_all =
        block.template any_item<rve::Visit::Registers>(count, [&](Item i) { return i < 0; });
    block.once([&] {
      found[0] = last ? 1 : 0;
      found[1] = before_all ? 1 : 0;
    });
  }
};

/// Tests the collective functions over items in registers. `count` items and one more item store
/// the answers.
struct CollectFromItems {
  int count;
  const float *sizes;    // not negative
  const std::int64_t *numbers;
  float *largest;                  // (count + 1)
  std::int64_t *sums;              // (count + 1, 2)
  int *any_above, *any_at_all;     // (count + 1) 1 if a size exceeds 1e3; 1 if a size exceeds -1
  rve::Reduction<2> *reduction;    // in memory that all threads can read
  std::int64_t *added;             // (3) two sums, and a number that one thread computes from them
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    using Item = typename Block::Item;
    auto size = block.resident(const_cast<float *>(sizes));
    block.own_items(count, [&](Item i) { size.load(i); });
    for (int round = 0; round < 2; ++round) {    // twice, to reuse the scratch memory
      block.template reduce_items<2, std::int64_t>(
          count,
          [&](Item i, std::int64_t *term, float &most) {
            term[0] += numbers[i];
            term[1] += size[i] > 1e3f ? -i : 1;
            most = size[i] > most ? size[i] : most;
          },
          [](std::int64_t *) {}, *reduction);
      const bool above = block.any_item(count, [&](Item i) { return size[i] > 1e3f; });
      const bool at_all = block.any_item(count, [&](Item i) { return size[i] > -1.0f; });
      const auto total = block.template sum_integers<2>(count, [&](Item i, std::int64_t *term) {
        term[0] += numbers[i];
        term[1] += size[i] > 1e3f ? -i : 1;
      });
      block.begin_add_up();
      block.once([] {});
      block.template add_up_items<2, std::int64_t>(
          count,
          [&](Item i, std::int64_t *term) {
            term[0] += numbers[i];
            term[1] += size[i] > 1e3f ? -i : 1;
          },
          added, [&] { added[2] += added[0] - added[1]; });
      block.for_each(count + 1, [&](Item i) {
        largest[i] = reduction->largest;
        any_above[i] = above ? 1 : 0;
        any_at_all[i] = at_all ? 1 : 0;
        const bool same = added[2] == (round + 1) * (total[0] - total[1]);
        for (int m = 0; m < 2; ++m)
          sums[2 * i + m] = same && total[m] == reduction->sum[m] && total[m] == added[m] ? total[m]
                                                                                          : -1;
      });
    }
  }
};

}    // namespace

TEST_F(Block, ForEachVisitsEveryItemOncePerPhase)
{
  for_sizes([](int threads, int count) {
    BlockArray<int> visits(std::vector<int>(count, 0));

    run_block(threads, VisitAll{count, visits.data()});

    const auto result = visits.values();
    for (int i = 0; i < count; ++i) ASSERT_EQ(result[i], i + 3);
  });
}

TEST_F(Block, PhasesAreSeparatedByABarrier)
{
  for_sizes([](int threads, int count) {
    std::vector<int> numbers(count);
    std::iota(numbers.begin(), numbers.end(), 5);
    BlockArray<int> array(numbers), mirror(std::vector<int>(count, 0));

    run_block(threads, ReverseTwice{count, array.data(), mirror.data()});

    const auto result = array.values();
    for (int i = 0; i < count; ++i) ASSERT_EQ(result[i], 10 * numbers[i]);
  });
}

TEST_F(Block, AsideWorkRunsOnceAndIsVisibleAfterThePhase)
{
  for_sizes([](int threads, int count) {
    BlockArray<int> visits(std::vector<int>(count, 0)), calls(std::vector<int>(5, 0));

    run_block(threads, CountAside{count, visits.data(), calls.data()});

    EXPECT_EQ(calls.values(), (std::vector<int>{1, 0, 1, 2, 3}));
    const auto result = visits.values();
    for (int i = 0; i < count; ++i) ASSERT_EQ(result[i], 611) << i;
  });
}

TEST_F(Block, OnceRunsOnce)
{
  for (const int threads : block_sizes()) {
    BlockArray<int> calls(std::vector<int>{0});

    run_block(threads, CountOnce{calls.data()});

    EXPECT_EQ(calls.values()[0], 11);
  }
}

TEST_F(Block, AnyIsTrueOnEveryThreadForASingleItem)
{
  for_sizes([](int threads, int count) {
    for (const int set : {-1, 0, count / 2, count - 1}) {
      std::vector<int> flags(count, 0);
      if (set >= 0 && set < count) flags[set] = 1;
      const int expected = set >= 0 && set < count ? 1 : 0;
      BlockArray<int> array(flags), answers(std::vector<int>(count, -1)),
          asides(std::vector<int>(1, 0));

      run_block(threads, AnyIsSet{count, array.data(), answers.data(), asides.data()});

      for (const int answer : answers.values()) ASSERT_EQ(answer, expected);
    }
  });
}

TEST_F(Block, SumOfDoublesHasTheSameBitsForAnyNumberOfThreads)
{
  for_sizes([](int threads, int count) {
    const auto numbers = random_numbers(count, 1);
    double expected = 0.0;    // chunks of 32 in order, then the chunks in order
    for (int first = 0; first < count; first += 32) {
      double chunk = 0.0;
      for (int i = first; i < std::min(count, first + 32); ++i) chunk += numbers[i];
      expected += chunk;
    }
    const double largest = count ? std::max(0.0, *std::max_element(numbers.begin(), numbers.end()))
                                 : 0.0;
    BlockArray<double> array(numbers), sums(std::vector<double>(count + 1, -1.0)),
        maxima(std::vector<double>(count + 1, -1.0));

    run_block(threads, SumAndMaximum{count, array.data(), sums.data(), maxima.data()});

    for (const double sum : sums.values()) ASSERT_EQ(sum, expected);
    for (const double maximum : maxima.values()) ASSERT_EQ(maximum, largest);
  });
}

TEST_F(Block, LargestOfNegativeNumbersIsZero)
{
  for (const int threads : block_sizes()) {
    BlockArray<double> array(std::vector<double>(70, -2.0)), sums(std::vector<double>(71)),
        maxima(std::vector<double>(71));

    run_block(threads, SumAndMaximum{70, array.data(), sums.data(), maxima.data()});

    EXPECT_EQ(maxima.values()[70], 0.0);
    EXPECT_EQ(sums.values()[70], -140.0);
  }
}

TEST_F(Block, IntegerSumsAreExactWithNegativeNumbersAndCarries)
{
  for_sizes([](int threads, int count) {
    const auto numbers = random_integers(count, 2);
    std::int64_t expected[3] = {0, 0, 0};
    for (int i = 0; i < count; ++i) {
      expected[0] += numbers[i];
      expected[1] -= numbers[i];
      expected[2] += i;
    }
    BlockArray<std::int64_t> array(numbers),
        answers(std::vector<std::int64_t>(3 * (count + 1), -77));

    run_block(threads, SumIntegers{count, array.data(), answers.data()});

    const auto result = answers.values();
    for (std::size_t k = 0; k < result.size(); ++k) ASSERT_EQ(result[k], expected[k % 3]);
  });
}

TEST_F(Block, ExclusiveScanReplacesEachNumberByTheSumOfThoseBefore)
{
  for_sizes([](int threads, int count) {
    Random random(3);
    std::vector<int> numbers(count);
    for (int &x : numbers) x = random.integer(0, 9);
    BlockArray<int> array(numbers), totals(std::vector<int>(count + 1, -1));
    numbers.push_back(-7);
    BlockArray<int> starts(numbers);

    run_block(threads, Scan{count, array.data(), totals.data(), starts.data()});

    const auto result = array.values(), with_total = starts.values();
    int before = 0;
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(result[i], before);
      ASSERT_EQ(with_total[i], before);
      before += numbers[i];
    }
    ASSERT_EQ(with_total[count], before);
    for (const int total : totals.values()) ASSERT_EQ(total, before);
  });
}

TEST_F(Block, ItemsAreOrderedByAKeyWithAllArraysAndKeepTheirOrderWithinIt)
{
  for_resident_sizes([](int threads, int count, bool in_registers) {
    Random random(5);
    std::vector<int> keys(count), sorted(count), numbers(count);
    std::vector<Triple> triples(count);
    for (int i = 0; i < count; ++i) {
      keys[i] = random.integer(0, OrderByKey::KEYS - 1);
      sorted[i] = i;
      numbers[i] = 7 * i + 1;
      triples[i] = {{0.5 * i, i + 0.25, -1.0 * i}};
    }
    std::stable_sort(sorted.begin(), sorted.end(), [&](int a, int b) { return keys[a] < keys[b]; });
    BlockArray<int> key_array(keys), places(std::vector<int>(count, -1)),
        order(std::vector<int>(count, -1)), number_array(numbers);
    BlockArray<Triple> triple_array(triples);
    BlockArray<double> room(std::vector<double>(4 * count + 1, 0.0));

    run_block(threads,
              OrderByKey{count, key_array.data(), places.data(), order.data(), triple_array.data(),
                         number_array.data(), reinterpret_cast<char *>(room.data())},
              in_registers);

    EXPECT_EQ(order.values(), sorted);
    const auto ordered = number_array.values(), place = places.values();
    const auto moved = triple_array.values();
    for (int k = 0; k < count; ++k) {
      ASSERT_EQ(place[sorted[k]], k);
      ASSERT_EQ(ordered[k], numbers[sorted[k]]);
      for (int m = 0; m < 3; ++m) ASSERT_EQ(moved[k].number[m], triples[sorted[k]].number[m]);
    }
  });
}

TEST_F(Block, ConcurrentAdditionsAreExact)
{
  for_sizes([](int threads, int count) {
    std::vector<std::int32_t> numbers(count), counters(AddToCounters::COUNTERS, -5);
    const auto wide = random_integers(count, 4);
    for (int i = 0; i < count; ++i) {
      numbers[i] = static_cast<std::int32_t>(wide[i] >> 40);
      counters[i % AddToCounters::COUNTERS] += numbers[i];
    }
    BlockArray<std::int32_t> array(numbers),
        counter_array(std::vector<std::int32_t>(AddToCounters::COUNTERS, -5));

    run_block(threads, AddToCounters{count, array.data(), counter_array.data()});

    EXPECT_EQ(counter_array.values(), counters);
  });
}

TEST_F(Block, AccumulatedSumsAreCollectedExactlyAndLeaveZero)
{
  // A 64-bit sum is stored as two limbs: the low 24 bits and the rest. 256 terms below 2^55 / 256
  // fit, even if all terms are at one end of the range or carry from limb to limb.
  constexpr std::int64_t LIMIT = std::int64_t(1) << 47;
  constexpr int MOST_TERMS = 256;
  const std::vector<std::vector<std::int64_t>> mixtures = {
      {LIMIT - 1},
      {-LIMIT},
      {-1},
      {0xffffff},
      {-0x1000000},
      {LIMIT - 1, -LIMIT, 0, -1, 1, 0xffffff, 0x1000000, -0xffffff, -0x1000001, 0x7fffffffll,
       -0x80000000ll, 0xffffffffll}};
  for_sizes([&](int threads, int count) {
    const int num_sums = std::max((count + MOST_TERMS - 1) / MOST_TERMS, 1);
    for (const auto &mixture : mixtures) {
      SCOPED_TRACE("terms like " + std::to_string(mixture[0]));
      Random random(5);
      std::vector<std::int64_t> wide(count);
      std::vector<std::int32_t> narrow(count);
      for (int i = 0; i < count; ++i) {
        wide[i] = mixture[random.integer(0, static_cast<int>(mixture.size()) - 1)];
        if (mixture.size() > 1 && random.integer(0, 1))
          wide[i] = static_cast<std::int64_t>(random.bits()) >> random.integer(17, 50);
        narrow[i] = static_cast<std::int32_t>(wide[i] >> 24);
      }
      std::vector<std::int64_t> wide_sums(3 * num_sums, 0);
      std::vector<std::int32_t> narrow_sums(3 * num_sums, 0);
      for (int i = 0; i < count; ++i)
        for (int round = 0; round < 2; ++round) {
          const int from = round == 0 ? i : count - 1 - i;
          wide_sums[round * num_sums + i % num_sums] += wide[from];
          narrow_sums[round * num_sums + i % num_sums] += narrow[from];
        }
      BlockArray<std::int64_t> wide_array(wide),
          wide_collected(std::vector<std::int64_t>(3 * num_sums, -77));
      BlockArray<std::int32_t> narrow_array(narrow),
          narrow_collected(std::vector<std::int32_t>(3 * num_sums, -77));

      run_block(threads,
                AccumulateAndCollect<std::int64_t>{count, num_sums, wide_array.data(),
                                                   wide_collected.data()});
      run_block(threads,
                AccumulateAndCollect<std::int32_t>{count, num_sums, narrow_array.data(),
                                                   narrow_collected.data()});

      EXPECT_EQ(wide_collected.values(), wide_sums);
      EXPECT_EQ(narrow_collected.values(), narrow_sums);
    }
  });
}

TEST_F(Block, FetchAddGivesEachItemItsOwnTicketAndFetchMinTheSmallest)
{
  for_sizes([](int threads, int count) {
    std::vector<int> smallest(3, std::numeric_limits<int>::max());
    for (int i = 0; i < count; ++i)
      smallest[i % 3] = std::min(smallest[i % 3], (i * 7919) % 1009 - 500);
    BlockArray<int> next(std::vector<int>{100}), tickets(std::vector<int>(count, -1));
    BlockArray<int> minima(std::vector<int>(3, std::numeric_limits<int>::max()));

    run_block(threads, TicketsAndMinima{count, next.data(), tickets.data(), minima.data()});

    auto drawn = tickets.values();
    std::sort(drawn.begin(), drawn.end());
    for (int i = 0; i < count; ++i) ASSERT_EQ(drawn[i], 100 + i);
    EXPECT_EQ(next.values()[0], 100 + count);
    EXPECT_EQ(minima.values(), smallest);
  });
}

TEST_F(Block, ResidentNumbersPersistAcrossPhasesAndArePublishedAndSaved)
{
  for_resident_sizes([](int threads, int count, bool in_registers) {
    std::vector<ItemState> expected = item_states(count);
    std::vector<double> shown(count, 0.25);
    for (int i = 0; i < count; ++i) {
      expected[i].number += 0.5 * i;
      for (int k = 0; k < 3; ++k) expected[i].slots[k] += 3 * i + k;
    }
    for (int round = 0; round < 2; ++round) {
      for (int i = 0; i < count; ++i) shown[i] += expected[i].number;
      for (int i = 0; i < count; ++i)
        expected[i].number += shown[(i + 1) % count] + expected[i].slots[1];
    }
    BlockArray<ItemState> states(item_states(count));
    BlockArray<double> published(std::vector<double>(count, 0.25)),
        answers(std::vector<double>(count, -1.0));

    run_block(threads, KeepResident{count, states.data(), published.data(), answers.data()},
              in_registers);

    const auto saved = states.values();
    const auto seen = answers.values();
    EXPECT_EQ(published.values(), shown);
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(saved[i].number, expected[i].number);
      for (int k = 0; k < 3; ++k) ASSERT_EQ(saved[i].slots[k], expected[i].slots[k]);
      ASSERT_EQ(seen[i], expected[count - 1 - i].number + expected[count - 1 - i].slots[2]);
    }
  });
}

TEST_F(Block, PlacesAreThoseOfAllItemsAndOfThreadsWithoutOne)
{
  for_resident_sizes([](int threads, int count, bool in_registers) {
    const int places = std::max(threads, count);
    BlockArray<int> visits(std::vector<int>(places, 0)), found(std::vector<int>(2, -1));

    run_block(threads, VisitPlaces{count, visits.data(), found.data()}, in_registers);

    const auto result = visits.values();
    for (int i = 0; i < count; ++i) ASSERT_EQ(result[i], 2);
    // The places of threads without an item are visited in both phases or in none.
    for (int i = count; i < places; ++i) {
      ASSERT_EQ(result[i], result.back());
      ASSERT_NE(result[i], 1);
    }
    EXPECT_EQ(found.values()[0], count > 0 ? 1 : 0);
    EXPECT_EQ(found.values()[1], 0);
  });
}

TEST_F(Block, CollectivesOverResidentItemsAgreeOnAllThreads)
{
  for_resident_sizes([](int threads, int count, bool in_registers) {
    // index of the item above 1e3; -1: none
    for (const int giant : {-1, 0, count / 2, count - 1}) {
      SCOPED_TRACE("giant " + std::to_string(giant));
      Random random(6);
      std::vector<float> sizes(count);
      for (float &x : sizes)
        x = random.integer(0, 3)
            ? static_cast<float>(std::ldexp(random.uniform(0.0, 1.0), random.integer(-120, 9)))
            : 0.0f;
      if (giant >= 0 && giant < count) sizes[giant] = 12345.5f;
      const auto numbers = random_integers(count, 7);
      const float largest = count ? *std::max_element(sizes.begin(), sizes.end()) : 0.0f;
      std::int64_t total[2] = {0, 0};
      for (int i = 0; i < count; ++i) {
        total[0] += numbers[i];
        total[1] += i == giant ? -i : 1;
      }
      BlockArray<float> size_array(sizes), maxima(std::vector<float>(count + 1, -1.0f));
      BlockArray<std::int64_t> number_array(numbers),
          sums(std::vector<std::int64_t>(2 * (count + 1), -77));
      BlockArray<int> above(std::vector<int>(count + 1, -1)),
          at_all(std::vector<int>(count + 1, -1));
      BlockArray<rve::Reduction<2>> reduction(
          std::vector<rve::Reduction<2>>{rve::Reduction<2>{{-1, -1}, -1.0f}});
      BlockArray<std::int64_t> added(std::vector<std::int64_t>(3, 0));

      run_block(threads,
                CollectFromItems{count, size_array.data(), number_array.data(), maxima.data(),
                                 sums.data(), above.data(), at_all.data(), reduction.data(),
                                 added.data()},
                in_registers);

      for (const float x : maxima.values()) ASSERT_EQ(x, largest);
      for (const int x : above.values()) ASSERT_EQ(x, giant >= 0 && giant < count ? 1 : 0);
      for (const int x : at_all.values()) ASSERT_EQ(x, count > 0 ? 1 : 0);
      const auto result = sums.values();
      for (std::size_t k = 0; k < result.size(); ++k) ASSERT_EQ(result[k], total[k % 2]);
    }
  });
}
