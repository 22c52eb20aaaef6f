// SPDX-License-Identifier: GPL-2.0-only
// Ownership of pairs and preservation of the contact history.

#include "list_harness.h"
#include "rve/engine/packing_io.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

using namespace rve_test;

namespace {

template <class Format> class PairOwnership : public BlockTest {
};
using Formats = ::testing::Types<rve::FastNumbers, rve::MixedNumbers, rve::DoubleNumbers>;
TYPED_TEST_SUITE(PairOwnership, Formats);

const rve::Tensor2 SQUARE{{1.0, 0.0, 0.0, 1.0}};

int count_extra(const std::vector<ListedPair> &pairs)
{
  return static_cast<int>(
      std::count_if(pairs.begin(), pairs.end(), [](const ListedPair &pair) { return pair.extra; }));
}

/// Returns a history that identifies its pair. It is exact in fp32.
double mark(int i, int j)
{
  return 1.0 + 1024.0 * std::min(i, j) + std::max(i, j);
}

/// Builds a list, gives each pair a mark as its history, moves the grains and the cell, and builds
/// the list again. Returns how many owned and how many extra pairs kept their mark.
template <class Format>
std::pair<int, int> marks_after_rebuild(Throw grains, double skin, int threads)
{
  Random random(11);
  ListHarness<Format> list(grains.cell, grains.radius, grains.fractional, skin);
  list.build(threads);
  std::set<std::pair<int, int>> before;
  std::set<std::pair<int, int>> were_extra;
  for (const ListedPair &pair : list.pairs()) {
    before.insert(std::minmax(pair.owner, pair.partner));
    if (pair.extra) were_extra.insert(std::minmax(pair.owner, pair.partner));
  }
  list.set_histories(mark);
  for (auto &s : grains.fractional)
    s += static_cast<std::uint64_t>(random.uniform(0.0, 1.0) * 0x1p58);    // up to 1/64 cell
  list.move_to(grains.fractional);
  list.cell = rve::Tensor2{{1.0, 0.05, 0.0, 1.0}} * list.cell;

  list.build(threads);

  int kept = 0, kept_extra = 0, fresh = 0;
  for (const ListedPair &pair : list.pairs()) {
    const std::pair<int, int> name = std::minmax(pair.owner, pair.partner);
    if (before.count(name)) {
      EXPECT_EQ(pair.history, mark(pair.owner, pair.partner))
          << "pair " << name.first << " " << name.second;
      ++(were_extra.count(name) || pair.extra ? kept_extra : kept);
    } else {
      EXPECT_EQ(pair.history, 0.0) << "new pair " << name.first << " " << name.second;
      ++fresh;
    }
  }
  EXPECT_GT(fresh, 10);    // pairs appear and disappear, so that the test is significant
  EXPECT_LT(kept + kept_extra, static_cast<int>(before.size()));
  return {kept, kept_extra};
}

}    // namespace

TYPED_TEST(PairOwnership, OfAPackingLeavesNoPairOver)
{
  // A grain has three slots for pairs. A_h1 has 2.8 to 2.9 pairs per grain, so that the search for
  // free slots can end while the last few pairs have none.
  for (const char *name : {"/A_h0075.rve", "/A_h1.rve", "/A20_h0075.rve"}) {
    const auto packing = rve::read_packing(std::string(RVE_PACKINGS_DIR) + name);
    double mean = 0.0;
    for (double r : packing.radius) mean += r / packing.num_grains();
    for (const double share : {0.05, 0.1, 0.3}) {
      ListHarness<TypeParam> list(packing.cell, packing.radius, packing.fractional, share * mean);

      const int num_pairs = list.build(512);

      EXPECT_GT(num_pairs, 2.0 * packing.num_grains());
      const double filling = static_cast<double>(num_pairs) / (3.0 * packing.num_grains());
      EXPECT_LE(count_extra(list.pairs()), filling > 0.92 ? num_pairs / 200 : 0)
          << name << " skin " << share << ": " << num_pairs << " pairs";
    }
  }
}

TYPED_TEST(PairOwnership, OfATriangularLatticeIsNearlyPerfect)
{
  // This is the most difficult case: three pairs per grain use all three slots of each grain.
  const int side = 16;
  std::vector<double> radius(side * side, 1.0);
  std::vector<std::uint64_t> fractional;
  for (int k = 0; k < side * side; ++k) {
    fractional.push_back(static_cast<std::uint64_t>(k % side) << 60);
    fractional.push_back(static_cast<std::uint64_t>(k / side) << 60);
  }
  const rve::Tensor2 cell{{2.0 * side, 1.0 * side, 0.0, std::sqrt(3.0) * side}};
  ListHarness<TypeParam> list(cell, radius, fractional, 0.1);

  const int num_pairs = list.build(256);

  EXPECT_EQ(num_pairs, 3 * side * side);
  EXPECT_LE(count_extra(list.pairs()),
            // a few pairs can remain without an owner, since the search for owners ends after a
            // limited number of rounds
            side * side / 32);
}

TYPED_TEST(PairOwnership, OverloadedListsPutTheSurplusIntoExtraPairs)
{
  for (const double solid_fraction : {0.6, 1.0, 1.6, 3.0}) {
    const auto grains = throw_grains(SQUARE, 257, 2.0, solid_fraction, 0.3, 3);
    ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.3);

    const int num_pairs = list.build(128);

    const auto pairs = list.pairs();
    std::vector<int> owned(257, 0);
    std::set<std::pair<int, int>> names;
    for (const ListedPair &pair : pairs) {
      names.insert(std::minmax(pair.owner, pair.partner));
      if (!pair.extra) ++owned[pair.owner];
    }
    EXPECT_EQ(static_cast<int>(pairs.size()), num_pairs);
    EXPECT_EQ(static_cast<int>(names.size()), num_pairs);    // each pair exactly once
    for (const ListedPair &pair : pairs)    // extra pairs exist only if the slots are full
      EXPECT_EQ(owned[pair.owner] < rve::PairCounts<2>::owned && pair.extra, false);
    EXPECT_GE(count_extra(pairs), num_pairs - rve::PairCounts<2>::owned * 257);
  }
}

TYPED_TEST(PairOwnership, HistoryOfOwnedPairsIsCarriedOver)
{
  const auto grains = throw_grains(SQUARE, 257, 2.0, 0.8, 0.3, 4);
  for (const int threads : block_sizes()) {
    const auto marks = marks_after_rebuild<TypeParam>(grains, 0.3, threads);

    EXPECT_GT(marks.first, 100);
  }
}

TYPED_TEST(PairOwnership, HistoryOfExtraPairsIsCarriedOver)
{
  const auto grains = throw_grains(SQUARE, 257, 2.0, 2.5, 0.3, 5);
  for (const int threads : block_sizes()) {
    const auto marks = marks_after_rebuild<TypeParam>(grains, 0.3, threads);

    EXPECT_GT(marks.first, 100);
    EXPECT_GT(marks.second, 100);
  }
}

TYPED_TEST(PairOwnership, ListsHaveTheSameBitsForAnyNumberOfThreads)
{
  for (const int n : {7, 33, 257, 1000})
    for (const double solid_fraction : {0.8, 2.0}) {
      auto grains = throw_grains(SQUARE, n, 2.5, solid_fraction, 0.3, n);
      ListHarness<TypeParam> serial(grains.cell, grains.radius, grains.fractional, 0.3);
      const int num_pairs = serial.build_serial();
      serial.set_histories(mark);
      serial.build_serial();
      for (const int threads : block_sizes()) {
        SCOPED_TRACE(std::to_string(n) + " grains, " + std::to_string(threads) + " threads");
        ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.3);

        EXPECT_EQ(list.build(threads), num_pairs);
        list.set_histories(mark);
        list.build(threads);

        EXPECT_TRUE(list.image ==
                    serial.image);    // partners, histories and extra pairs, in their order
      }
    }
}
