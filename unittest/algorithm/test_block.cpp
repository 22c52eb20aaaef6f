// The execution vocabulary: every collective against a plain loop, for any number of threads.

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
};

std::vector<double> random_numbers(int count, std::uint64_t seed)
{
  Random random(seed);
  std::vector<double> numbers(count);
  for (double &x : numbers) x = std::ldexp(random.uniform(-1.0, 1.0), random.integer(-40, 40));
  return numbers;
}

/// 64-bit numbers whose sum carries between the halves, in both directions.
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
    block.for_each(count, [&](typename Block::Item i) {
      visits[i] += 1 + i;
    });
    block.for_each(count, [&](typename Block::Item i) {
      visits[i] += 2;
    });
  }
};

/// Each phase reads what other items wrote in the phase before.
struct ReverseTwice {
  int count;
  int *numbers, *mirror;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) {
      mirror[i] = numbers[count - 1 - i];
    });
    block.for_each(count, [&](typename Block::Item i) {
      numbers[i] = 10 * mirror[count - 1 - i];
    });
  }
};

struct CountOnce {
  int *calls;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.once([&] {
      ++*calls;
    });
    block.once([&] {
      *calls += 10;
    });
  }
};

struct AnyIsSet {
  int count;
  const int *flags;
  int *answers;    // one per item: every thread must have the same
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    const bool answer = block.any(count, [&](typename Block::Item i) {
      return flags[i] != 0;
    });
    block.for_each(count, [&](typename Block::Item i) {
      answers[i] = answer ? 1 : 0;
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
  std::int64_t *answers;    // three per item, and three more
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    for (int round = 0; round < 2; ++round) {    // twice: the scratch memory is used again
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
  int *numbers, *totals;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    const int total = block.exclusive_scan(numbers, count);
    block.for_each(count + 1, [&](typename Block::Item i) {
      totals[i] = total;
    });
  }
};

struct Accumulate {
  static constexpr int ACCUMULATORS = 5;
  int count;
  const std::int64_t *numbers;
  std::int64_t *wide;
  std::int32_t *narrow;
  template <class Block> RVE_HD void operator()(Block &block, char *fast_memory) const
  {
    auto *fast_wide = reinterpret_cast<std::int64_t *>(fast_memory);
    auto *fast_narrow =
        reinterpret_cast<std::int32_t *>(fast_memory + ACCUMULATORS * sizeof(std::int64_t));
    block.for_each(ACCUMULATORS, [&](typename Block::Item a) {
      fast_wide[a] = wide[a];
      fast_narrow[a] = narrow[a];
    });
    block.for_each(count, [&](typename Block::Item i) {
      block.add(&fast_wide[i % ACCUMULATORS], numbers[i]);
      block.add(&fast_narrow[i % ACCUMULATORS], static_cast<std::int32_t>(numbers[i] >> 40));
    });
    block.for_each(ACCUMULATORS, [&](typename Block::Item a) {
      wide[a] = fast_wide[a];
      narrow[a] = fast_narrow[a];
    });
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

struct KeepPerItem {
  int count;
  double *answers;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    auto state = block.template per_item<ItemState>(count);
    block.for_each(count, [&](typename Block::Item i) {
      state[i].number = 0.5 * i;
      for (int k = 0; k < 3; ++k) state[i].slots[k] = 3 * i + k;
    });
    block.for_each(count, [&](typename Block::Item i) {
      state[i].number += state[i].slots[1];
    });
    block.for_each(count, [&](typename Block::Item i) {
      answers[i] = state[i].number + state[i].slots[2];
    });
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

TEST_F(Block, OnceIsDoneOnce)
{
  for (const int threads : block_sizes()) {
    BlockArray<int> calls(std::vector<int>{0});

    run_block(threads, CountOnce{calls.data()});

    EXPECT_EQ(calls.values()[0], 11);
  }
}

TEST_F(Block, AnyTellsEveryThreadOfASingleItem)
{
  for_sizes([](int threads, int count) {
    for (const int set : {-1, 0, count / 2, count - 1}) {
      std::vector<int> flags(count, 0);
      if (set >= 0 && set < count) flags[set] = 1;
      const int expected = set >= 0 && set < count ? 1 : 0;
      BlockArray<int> array(flags), answers(std::vector<int>(count, -1));

      run_block(threads, AnyIsSet{count, array.data(), answers.data()});

      for (const int answer : answers.values()) ASSERT_EQ(answer, expected);
    }
  });
}

TEST_F(Block, SumOfDoublesHasTheSameBitsForAnyNumberOfThreads)
{
  for_sizes([](int threads, int count) {
    const auto numbers = random_numbers(count, 1);
    double expected = 0.0;    // chunks of 32, each in order, then the chunks in order
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

    run_block(threads, Scan{count, array.data(), totals.data()});

    const auto result = array.values();
    int before = 0;
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(result[i], before);
      before += numbers[i];
    }
    for (const int total : totals.values()) ASSERT_EQ(total, before);
  });
}

TEST_F(Block, AddsOfBothWidthsAreExactWhereManyItemsMeet)
{
  for_sizes([](int threads, int count) {
    constexpr int ACCUMULATORS = Accumulate::ACCUMULATORS;
    const auto numbers = random_integers(count, 4);
    std::vector<std::int64_t> wide = {0, -1, 0xffffffffll, -0x7fffffffffll, 0x3fffffff00000000ll};
    std::vector<std::int32_t> narrow(ACCUMULATORS, -5);
    BlockArray<std::int64_t> array(numbers), wide_array(wide);
    BlockArray<std::int32_t> narrow_array(narrow);
    for (int i = 0; i < count; ++i) {
      wide[i % ACCUMULATORS] += numbers[i];
      narrow[i % ACCUMULATORS] += static_cast<std::int32_t>(numbers[i] >> 40);
    }

    run_block(threads, Accumulate{count, array.data(), wide_array.data(), narrow_array.data()});

    EXPECT_EQ(wide_array.values(), wide);
    EXPECT_EQ(narrow_array.values(), narrow);
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

TEST_F(Block, ItemStateLivesAcrossPhases)
{
  for_sizes([](int threads, int count) {
    for (const bool in_registers : {false, true}) {
      if (in_registers && count > threads) continue;
      BlockArray<double> answers(std::vector<double>(count, -1.0));

      run_block(threads, KeepPerItem{count, answers.data()}, count * sizeof(ItemState),
                in_registers);

      const auto result = answers.values();
      for (int i = 0; i < count; ++i) ASSERT_EQ(result[i], 0.5 * i + 6 * i + 3);
    }
  });
}
