// SPDX-License-Identifier: GPL-2.0-only
// Compares the Verlet list with a loop over all pairs.

#include "list_harness.h"
#include "oracle/all_pairs.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

using namespace rve_test;

namespace {

struct Shape {
  const char *name;
  rve::Tensor2 cell;
};

const Shape SHAPES[] = {
    {"square", {{1.0, 0.0, 0.0, 1.0}}},
    {"leaning as far as a reduced cell does", {{1.0, 0.59, 0.0, 1.0}}},
    {"sheared by three", {{1.0, -3.0, 0.0, 1.0}}},
    {"long and turned", {{4.0, 0.3, 1.5, 0.8}}},
    {"mirrored", {{0.0, 1.0, 1.2, 0.4}}},
};

/// Expects that the list has each pair with a gap below the skin once, and no other pair. A pair
/// whose gap differs from the skin by less than the rounding error `doubt` is allowed to be in the
/// list or not.
template <class Format>
void expect_all_pairs(ListHarness<Format> &list, int num_pairs, double doubt, int images = 1)
{
  std::set<std::pair<int, int>> listed;
  for (const ListedPair &pair : list.pairs()) {
    ASSERT_NE(pair.owner, pair.partner);
    const bool is_new = listed.insert(std::minmax(pair.owner, pair.partner)).second;
    ASSERT_TRUE(is_new) << "pair " << pair.owner << " " << pair.partner << " is listed twice";
  }
  ASSERT_EQ(static_cast<int>(listed.size()), num_pairs);
  for (const OraclePair &pair :
       all_pairs(list.cell, list.radii(), list.fractions(), list.skin + doubt, images)) {
    const bool found = listed.erase({pair.first, pair.second}) > 0;
    ASSERT_TRUE(found || pair.gap >= list.skin - doubt)
        << "pair " << pair.first << " " << pair.second << " is missing, gap " << pair.gap;
  }
  ASSERT_TRUE(listed.empty()) << "pair " << listed.begin()->first << " " << listed.begin()->second
                              << " is too far";
}

template <class Format> class VerletList : public BlockTest {
 public:
  /// Relative rounding error of a branch vector. In `fast`, fractional coordinates are exact and
  /// lengths are fp32.
  static constexpr double doubt = sizeof(typename Format::Wide) == 4 ? 1e-5 : 1e-12;
};
using Formats = ::testing::Types<rve::FastNumbers, rve::MixedNumbers, rve::DoubleNumbers>;
TYPED_TEST_SUITE(VerletList, Formats);

}    // namespace

TYPED_TEST(VerletList, HoldsAllPairsWithinTheSkinAndNoOther)
{
  for (const Shape &shape : SHAPES)
    for (const int n : {2, 3, 7, 33, 257, 1000}) {
      const auto grains = throw_grains(shape.cell, n, 3.0, 0.8, 0.4, 17 * n);
      for (const int threads : block_sizes()) {
        SCOPED_TRACE(std::string(shape.name) + ", " + std::to_string(n) + " grains, " +
                     std::to_string(threads) + " threads");
        ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.4);

        const int num_pairs = list.build(threads);

        expect_all_pairs(list, num_pairs, TestFixture::doubt * 6.0);
        if (this->HasFatalFailure()) return;
      }
    }
}

/// Each point of the cell is covered by about nine grains. Some grains then own more pairs than
/// their share of the scratch memory holds.
TYPED_TEST(VerletList, HoldsAllPairsOfGrainsWithManyPairs)
{
  const int n = 257, room = rve::kScratch<2> * sizeof(double) / sizeof(std::int32_t);
  const auto grains = throw_grains(SHAPES[1].cell, n, 3.0, 9.0, 0.4, 11);
  for (const int threads : block_sizes()) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.4);

    const int num_pairs = list.build(threads);

    ASSERT_GT(num_pairs, room * n);
    expect_all_pairs(list, num_pairs, TestFixture::doubt * 6.0);
    if (this->HasFatalFailure()) return;
  }
}

TYPED_TEST(VerletList, FollowsGrainsAndCellFromBuildToBuild)
{
  auto grains = throw_grains(SHAPES[0].cell, 200, 2.0, 0.85, 0.3, 5);
  Random random(6);
  ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.3);
  for (int build = 0; build < 8; ++build) {
    for (auto &s : grains.fractional)
      s += static_cast<std::uint64_t>(random.uniform(0.0, 1.0) * 0x1p58);
    list.cell = rve::Tensor2{{1.0, 0.1, 0.0, 1.0}} * list.cell;
    list.move_to(grains.fractional);

    const int num_pairs = list.build(256);

    expect_all_pairs(list, num_pairs, TestFixture::doubt * 6.0);
    if (this->HasFatalFailure()) return;
  }
}

TYPED_TEST(VerletList, KeepsTheOldListIfTheNewOneDoesNotFit)
{
  auto grains = throw_grains(SHAPES[0].cell, 100, 2.0, 0.8, 0.3, 7);
  ListHarness<TypeParam> list(grains.cell, grains.radius, grains.fractional, 0.3);
  const int first_count = list.build(128);
  list.set_histories([](int i, int j) { return i + 2.0 * j; });
  list.cell = 0.8 * list.cell;
  const auto before = list.image;
  list.set_pair_capacity(first_count);

  const int second_count = list.build(128);

  EXPECT_GT(second_count, first_count);    // the count is the capacity that the list needs
  EXPECT_EQ(list.image, before);
  list.set_pair_capacity(second_count);
  EXPECT_EQ(list.build(128), second_count);
  expect_all_pairs(list, second_count, TestFixture::doubt * 6.0);
}

using LargeVerletList = BlockTest;

TEST_F(LargeVerletList, OfTwentyThousandGrainsHoldsAllPairs)
{
  const auto grains = throw_grains(rve::Tensor2{{1.0, 0.45, 0.0, 1.3}}, 20000, 2.0, 0.85, 0.15, 8);
  ListHarness<rve::DoubleNumbers> list(grains.cell, grains.radius, grains.fractional, 0.15);

  const int num_pairs = list.build(1024);

  ASSERT_GT(num_pairs, 30000);
  expect_all_pairs(list, num_pairs, 1e-11,
                   0);    // in a wide cell the nearest image has the smallest fractional difference
}
