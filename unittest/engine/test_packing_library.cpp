// SPDX-License-Identifier: GPL-2.0-only
// Libraries of packings: their preparation in a batch, their file, and the choice of a packing.

#include "rve/core/error.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_library.h"
#include "support/files.h"
#include "support/messages.h"
#include "support/rve_rig.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

using namespace rve;
using namespace rve_test;

namespace {

PackingRecipe small_recipe(std::uint64_t seed, double friction)
{
  PackingRecipe recipe;
  recipe.material = paper_material();
  recipe.num_grains = 60;
  recipe.radius_min = 0.0025;
  recipe.radius_max = 0.005;
  recipe.pressure = 20e3;
  recipe.seed = seed;
  recipe.preparation_friction = friction;
  return recipe;
}

PackingLibrary library_of(int count)
{
  PackingLibrary library;
  for (int k = 0; k < count; ++k) {
    RveState packing = crowded_state(30 + k, 7 + k);
    const LibraryRow row{UINT64_MAX - k, packing.void_ratio(), 0.1 * k, 1.0 + k,
                         2e4 / 3,        packing.num_grains()};
    library.add(row, std::move(packing));
  }
  return library;
}

/// Replaces `from` by `to` in the text of a library, reads this library and returns the error
/// message without the path.
std::string message_after(std::string text, const std::string &from, const std::string &to)
{
  const std::string path = temporary_path("broken.lib");
  text.replace(text.find(from), from.size(), to);
  std::ofstream(path) << text;
  const std::string message = message_of([&] { read_library(path); });
  return message.rfind(path, 0) == 0 ? message.substr(path.size()) : message;
}

/// Returns the sum of (observed - expected)^2 / expected.
double chi_square(const std::vector<int> &observed, double expected)
{
  double sum = 0.0;
  for (const int count : observed) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

/// Expects a uniform distribution. With k degrees of freedom, chi-square has the mean k and the
/// variance 2 k. Its distribution is nearly normal for large k.
void expect_uniform(const std::vector<int> &observed, double expected)
{
  const double degrees = static_cast<double>(observed.size()) - 1.0;
  EXPECT_NEAR(chi_square(observed, expected), degrees, 4.5 * std::sqrt(2.0 * degrees));
}

}    // namespace

// ---- the batch ----

TEST(PackingBatch, EachPackingHasTheBitsOfASinglePreparation)
{
  std::vector<PackingRecipe> recipes;
  for (const std::uint64_t seed : {1, 2, 3})
    for (const double friction : {0.0, 0.2, 0.8}) recipes.push_back(small_recipe(seed, friction));
  recipes.push_back(small_recipe(4, 0.0));
  recipes.back().void_ratio = 0.22;
  recipes.back().void_ratio_tolerance = 0.02;
  const auto engine = make_engine(cpu_options(Format::Mixed, 2));

  const std::vector<PreparedPacking> batch = generate_packings(recipes, *engine);

  ASSERT_EQ(batch.size(), recipes.size());
  for (std::size_t k = 0; k < recipes.size(); ++k) {
    const auto alone = make_engine(cpu_options(Format::Mixed));
    ASSERT_TRUE(batch[k].ready()) << batch[k].failure;
    EXPECT_EQ(serialize(batch[k].state), serialize(generate_packing(recipes[k], *alone)));
  }
  EXPECT_EQ(batch[1].preparation_friction, 0.2);
  EXPECT_NEAR(batch.back().state.void_ratio(), 0.22, 0.02);
  EXPECT_EQ(engine->size(), 0);
}

TEST(PackingBatch, UnfinishedPackingsAdvanceInOneCall)
{
  std::vector<PackingRecipe> recipes;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) recipes.push_back(small_recipe(seed, 0.1));
  const auto engine = make_engine(cpu_options(Format::Mixed, 2));
  std::vector<std::int64_t> steps(recipes.size(), 0);
  std::int64_t apart = 0;

  generate_packings(recipes, *engine,
                    [&](std::size_t k, const PackingReport &report, const PreparedPacking &one) {
                      steps[k] = report.step;
                      if (one.ready()) steps[k] = 0;
                      std::int64_t least = INT64_MAX, most = 0;
                      for (const std::int64_t n : steps)
                        if (n > 0) {
                          least = std::min(least, n);
                          most = std::max(most, n);
                        }
                      if (most > 0) apart = std::max(apart, most - least);
                    });

  EXPECT_EQ(apart, 250);    // packings are at most one call of 250 steps apart
}

TEST(PackingBatch, FailureIsReportedAndDoesNotStopTheOthers)
{
  std::vector<PackingRecipe> recipes(3, small_recipe(1, 0.1));
  recipes[1].void_ratio = 0.6;
  recipes[2].num_grains = 4;
  const auto engine = make_engine(cpu_options(Format::Mixed));

  const auto batch = generate_packings(recipes, *engine);

  EXPECT_TRUE(batch[0].ready());
  EXPECT_FALSE(batch[1].ready());
  EXPECT_EQ(batch[1].failure.find("void ratio 0.6 cannot be reached at this pressure"), 0u);
  EXPECT_NE(batch[2].failure.find("cell too narrow"), std::string::npos) << batch[2].failure;
  EXPECT_EQ(engine->size(), 0);
}

TEST(PackingBatch, AWrongRecipeIsAnErrorBeforeAnythingRuns)
{
  std::vector<PackingRecipe> recipes(2, small_recipe(1, 0.1));
  recipes[1].pressure = -3.0;
  const auto engine = make_engine(cpu_options(Format::Mixed));

  EXPECT_EQ(message_of([&] {
              generate_packings(recipes, *engine, [](std::size_t, const auto &, const auto &) {
                FAIL() << "something ran";
              });
            }).find("pressure of the packing is -3 [stress]"),
            0u);
}

// ---- the file ----

TEST(PackingLibrary, PackingsAndIndexAreRestoredToTheLastBit)
{
  const std::string path = temporary_path("three.lib");
  const PackingLibrary library = library_of(3);

  write_library(path, library);
  const PackingLibrary copy = read_library(path);

  ASSERT_EQ(copy.packings.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(same_motion(copy.packings[k], library.packings[k]));
    EXPECT_EQ(copy.packings[k].radius, library.packings[k].radius);
    EXPECT_EQ(copy.index[k].seed, library.index[k].seed);
    EXPECT_EQ(copy.index[k].void_ratio, library.index[k].void_ratio);
    EXPECT_EQ(copy.index[k].preparation_friction, library.index[k].preparation_friction);
    EXPECT_EQ(copy.index[k].overconsolidation_ratio, library.index[k].overconsolidation_ratio);
    EXPECT_EQ(copy.index[k].pressure, library.index[k].pressure);
    EXPECT_EQ(copy.index[k].num_grains, library.index[k].num_grains);
  }
}

TEST(PackingLibrary, APackingFileIsALibraryOfOne)
{
  const PackingLibrary library = read_library(std::string(RVE_PACKINGS_DIR) + "/A_h0075.rve");

  ASSERT_EQ(library.packings.size(), 1u);
  EXPECT_EQ(library.index[0].num_grains, 400);
  EXPECT_EQ(library.index[0].void_ratio, paper_packing().void_ratio());
}

TEST(PackingLibrary, IsNoPackingFile)
{
  const std::string path = temporary_path("two.lib");
  write_library(path, library_of(2));

  EXPECT_EQ(message_of([&] { read_packing(path); }),
            path + ":3: this is a library; a single packing was expected");
}

TEST(PackingLibrary, MayHoldSpheres)
{
  const std::string path = temporary_path("spheres.lib");
  PackingLibraryOf<3> library;
  for (const unsigned seed : {3u, 4u}) {
    const RveStateOf<3> packing = crowded_spheres(20 + static_cast<int>(seed), seed);
    LibraryRow row;
    row.void_ratio = packing.void_ratio();
    row.num_grains = packing.num_grains();
    library.add(row, packing);
  }
  write_library(path, library);

  EXPECT_EQ(dimension_of_packing(path), 3);
  const PackingLibraryOf<3> copy = read_library<3>(path);
  ASSERT_EQ(copy.packings.size(), 2u);
  for (int k = 0; k < 2; ++k)
    EXPECT_EQ(copy.packings[k].fractional, library.packings[k].fractional);
  // All packings of a library have one dimension.
  EXPECT_NE(
      message_of([&] {
        read_library(path);
      }).find("the packing has spheres (dimension 3); a packing of plane disks (dimension 2)"),
      std::string::npos);
  write_library(path, library_of(2));
  EXPECT_EQ(dimension_of_packing(path), 2);
}

TEST(PackingLibrary, BrokenFilesAreRefusedWithLineNumber)
{
  const std::string path = temporary_path("two.lib");
  write_library(path, library_of(2));
  const std::string text = text_of(path);

  EXPECT_EQ(message_after(text, "library 1", "library 2"),
            ":3: version of the library is '2'; it must be an integer from 1 to 1");
  EXPECT_EQ(message_after(text, "packings 2", "packings 0")
                .find(":5: number of packings of the library is '0'; it must be"),
            0u);
  EXPECT_EQ(message_after(text, "packings 2", "packings 3"),
            ":10: 'packing 0' has 2 words; expected 'number seed void_ratio friction "
            "overconsolidation_ratio pressure grains'");
  EXPECT_EQ(message_after(text, "\n1 18446744073709551614", "\n1 -4"),
            ":8: seed is '-4'; it must be an integer from 0 to 18446744073709551615");
  EXPECT_NE(message_after(text, "\npacking 1\n", "\npacking 7\n")
                .find("number of the packing is '7'; it must be an integer from 1 to 1"),
            std::string::npos);
  EXPECT_NE(
      message_after(text, "end_library", "").find("file ends where 'end_library' was expected"),
      std::string::npos);
  EXPECT_EQ(message_of([&] { read_library(path + ".none"); }),
            "cannot open packing file " + path + ".none: No such file or directory");
  EXPECT_NE(message_after(text, "end_library", "end_library\npacking 2")
                .find("found 'packing' after 'end_library'"),
            std::string::npos);
}

// The index contains numbers that the packings do not contain: seeds, frictions and pressures of
// the preparation.
TEST(PackingLibrary, EveryChangedDigitIsFound)
{
  const std::string path = temporary_path("digits.lib");
  write_library(path, library_of(2));
  const std::string text = text_of(path);
  for (std::size_t k = 0, step; k < text.size(); k += step) {
    step = k < text.find("\npacking 0") ? 1 : 17;    // the whole index and samples of the packings
    const bool in_comment =
        text.rfind('#', k) != std::string::npos && text.rfind('#', k) > text.rfind('\n', k);
    if (in_comment || text[k] < '0' || text[k] > '9') continue;
    std::string changed = text;
    changed[k] = static_cast<char>('0' + (text[k] - '0' + 1 + k % 9) % 10);
    std::ofstream(path) << changed;
    const std::string message = message_of([&] { read_library(path); });
    EXPECT_EQ(message.rfind(path + ":", 0), 0u) << "byte " << k << ": " << message;
  }
}

TEST(PackingLibrary, ItsChecksumCoversTheIndexAndMayBeLeftOut)
{
  const std::string path = temporary_path("two.lib");
  write_library(path, library_of(2));
  std::string text = text_of(path);
  const std::size_t pressure = text.find(" 6666.6");
  text.replace(pressure, 7, " 7777.7");    // of a row
  const auto message = [&] {
    std::ofstream(path) << text;
    return message_of([&] { read_library(path); });
  };

  EXPECT_NE(message().find("the file is damaged, or was changed by hand"), std::string::npos);
  const std::size_t last = text.rfind("checksum ");
  text.replace(last, 25, "checksum none");
  EXPECT_EQ(message(), "no error");
  text.erase(last, 14);
  EXPECT_NE(message().find("there is no checksum before 'end_library'"), std::string::npos);
}

TEST(PackingLibrary, InconsistentIndexIsRefused)
{
  const std::string path = temporary_path("liar.lib");
  PackingLibrary library = library_of(2);
  write_library(path, library);
  std::string text = text_of(path);
  const std::size_t row = text.find("\n1 18446744073709551614 ") + 24;
  text.replace(row, text.find(' ', row) - row, "0.25");
  text.replace(text.rfind("checksum "), 25, "checksum none");
  std::ofstream(path) << text;

  EXPECT_NE(message_of([&] { read_library(path); }).find("packing 1 of the library has void ratio"),
            std::string::npos);
  library.index[0].num_grains = 31;
  EXPECT_EQ(message_of([&] { write_library(path, library); }),
            path + ": packing 0 of the library has 30 grains, but its index gives 31");
}

TEST(PackingLibrary, AnEmptyOneIsNotWritten)
{
  const std::string path = temporary_path("empty.lib");

  EXPECT_EQ(message_of([&] { write_library(path, PackingLibrary()); }),
            path + ": the library is empty; it must have at least one packing");
  EXPECT_FALSE(std::ifstream(path).is_open());
}

TEST(PackingLibrary, IsWrittenCompletelyOrNotAtAll)
{
  const std::string path = temporary_path("kept.lib");
  write_library(path, library_of(2));
  const std::string before = text_of(path);
  PackingLibrary unsound = library_of(3);
  unsound.packings[2].spin[0] = NAN;

  EXPECT_NE(message_of([&] { write_library(path, unsound); }).find("packing 2: spin of grain 1"),
            std::string::npos);
  EXPECT_EQ(text_of(path), before);
  EXPECT_EQ(message_of([&] { write_library("/no/such/folder/x.lib", library_of(1)); }),
            "cannot write file /no/such/folder/x.lib: No such file or directory");
}

// ---- the draw: statistics over consecutive ids, as atoms have them ----

TEST(Draw, EveryPackingIsEquallyProbable)
{
  constexpr int POINTS = 200000;
  for (const int count : {2, 7, 16, 100})
    for (const std::uint64_t seed : {0u, 1u, 4711u}) {
      std::vector<int> times(count, 0);
      for (int id = 1; id <= POINTS; ++id) ++times[draw(seed, id, count)];
      expect_uniform(times, static_cast<double>(POINTS) / count);
    }
}

TEST(Draw, NeighbouringSeedsAndPurposesAreIndependent)
{
  constexpr int POINTS = 200000, COUNT = 8;
  const auto pairs = [&](auto &&other) {
    std::vector<int> times(COUNT * COUNT, 0);
    for (int id = 1; id <= POINTS; ++id) ++times[COUNT * draw(1, id, COUNT) + other(id)];
    expect_uniform(times, static_cast<double>(POINTS) / (COUNT * COUNT));
  };

  pairs([](int id) { return draw(1, id + 1, COUNT); });      // the next atom
  pairs([](int id) { return draw(1, id + 100, COUNT); });    // the one above in a grid
  pairs([](int id) { return draw(2, id, COUNT); });          // the next seed
  pairs([](int id) { return draw(1, id, COUNT, 1); });       // another purpose
  pairs([](int id) { return draw(id, 1, COUNT); });          // seed and id exchanged
}

TEST(Draw, IsTheSameOnEveryMachine)
{
  // The numbers are from an independent Python program. For the seed 1234567, its mixing function
  // gives the known first output of SplitMix64, 6457827717110365317.
  const auto first = [](std::uint64_t seed, std::uint64_t purpose) {
    std::vector<int> numbers;
    for (int id = 1; id <= 8; ++id) numbers.push_back(draw(seed, id, 1000, purpose));
    return numbers;
  };

  EXPECT_EQ(first(1, 0), (std::vector<int>{423, 113, 856, 489, 135, 532, 869, 222}));
  EXPECT_EQ(first(4711, 1), (std::vector<int>{478, 859, 914, 727, 835, 224, 758, 904}));
}

// ---- choice by void ratio ----

TEST(VoidRatioIndex, TheNearestIsFound)
{
  const VoidRatioIndex index({0.20, 0.18, 0.24, 0.18, 0.22});

  EXPECT_EQ(index.least(), 0.18);
  EXPECT_EQ(index.most(), 0.24);
  EXPECT_EQ(index.nearest(0.201, 0.01), 0);
  EXPECT_EQ(index.nearest(0.2125, 0.01), 4);
  EXPECT_EQ(index.nearest(0.17, 0.02), 1);    // the first of two equal ones
  EXPECT_EQ(index.nearest(0.25, 0.02), 2);
  EXPECT_EQ(index.nearest(0.18, 0.0), 1);
}

TEST(VoidRatioIndex, NoneIsFoundBeyondTheTolerance)
{
  const VoidRatioIndex index({0.18, 0.20});

  EXPECT_FALSE(index.nearest(0.19, 0.009));
  EXPECT_FALSE(index.nearest(0.25, 0.03));
  EXPECT_FALSE(index.nearest(NAN, 1.0));
  EXPECT_FALSE(index.draw_within(0.19, 0.009, 1, 1));
  EXPECT_FALSE(index.draw_within(NAN, 1.0, 1, 1));
  EXPECT_EQ(message_of([] { VoidRatioIndex none({}); }), "there are no packings to choose from");
}

TEST(VoidRatioIndex, AllWithinTheToleranceAreEquallyProbable)
{
  const VoidRatioIndex index({0.20, 0.18, 0.24, 0.19, 0.21});
  std::vector<int> times(5, 0);

  for (int id = 1; id <= 30000; ++id) ++times[*index.draw_within(0.2, 0.0101, 3, id)];

  EXPECT_EQ(times[1] + times[2], 0);
  // The three counts have two degrees of freedom. With them, chi-square exceeds 18.4 once in ten
  // thousand times.
  EXPECT_LT(chi_square({times[0], times[3], times[4]}, 10000.0), 18.4);
}

// ---- levels of stress ----

TEST(StressLevels, NearestIsByRatio)
{
  const StressLevels levels({20e3, 5.01e3, 80e3, 5e3, 20.1e3});

  ASSERT_EQ(levels.count(), 3);
  EXPECT_EQ(levels.packings(0), (std::vector<int>{1, 3}));
  EXPECT_EQ(levels.packings(1), (std::vector<int>{0, 4}));
  EXPECT_NEAR(levels.stress(1), 20.05e3, 1e-9);
  EXPECT_EQ(levels.nearest(1.0), 0);
  EXPECT_EQ(levels.nearest(9.9e3), 0);
  EXPECT_EQ(levels.nearest(10.1e3), 1);
  EXPECT_EQ(levels.nearest(39e3), 1);
  EXPECT_EQ(levels.nearest(41e3), 2);
  EXPECT_EQ(levels.nearest(1e9), 2);
  EXPECT_FALSE(levels.nearest(0.0));
  EXPECT_FALSE(levels.nearest(NAN));
}

TEST(StressLevels, PackingsWithoutStressAreRefused)
{
  EXPECT_EQ(message_of([] {
              StressLevels({1.0, 0.0});
            }),
            "stress of packing 1 is 0 [stress], compression positive; it must be greater than 0");
}
