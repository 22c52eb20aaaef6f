// SPDX-License-Identifier: GPL-2.0-only
// A run misses no contact: after every step the list contains each touching pair, for any motion of
// the cell and the grains.

#include "oracle/all_pairs.h"
#include "rve/algorithm/verlet_list.h"
#include "rve/engine/engine.h"
#include "support/packings.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <utility>

using namespace rve;
using namespace rve_test;

namespace {

struct Course {
  const char *name;
  double loosening;             // edges of the initial cell, relative to the dense packing
  Tensor2 velocity_gradient;    // [1/time]
  double shaking;               // [length/time]
  double skin;                  // [length]; 0: automatic
  int steps, steps_per_look;
  int rebuilds_expected;
};

constexpr double DT = 5e-5;

const Course COURSES[] = {
    {"simple shear", 1.03, {{0.0, 30.0, 0.0, 0.0}}, 0.0, 0.0, 800, 1, 20},
    {"simple shear in long calls", 1.03, {{0.0, 30.0, 0.0, 0.0}}, 0.0, 0.0, 1600, 20, 40},
    {"pure shear", 1.03, {{-20.0, 0.0, 0.0, 20.0}}, 0.0, 0.0, 500, 1, 10},
    {"expansion of a shaken packing", 1.0, {{10.0, 0.0, 0.0, 10.0}}, 2.0, 0.0, 500, 1, 5},
    {"rotation", 1.0, {{0.0, -100.0, 100.0, 0.0}}, 0.0, 0.0, 300, 1, 1},
    {"shaking", 1.0, {{0.0, 0.0, 0.0, 0.0}}, 3.0, 2e-4, 400, 1, 20},
    {"thin skin", 1.03, {{0.0, 20.0, 0.0, 0.0}}, 0.5, 1e-4, 300, 1, 60},
};

class ListDuringARun : public ::testing::TestWithParam<Course> {};
std::string name_of(const ::testing::TestParamInfo<Course> &info)
{
  std::string name = info.param.name;
  for (char &c : name)
    if (c == ' ') c = '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Courses, ListDuringARun, ::testing::ValuesIn(COURSES), name_of);

}    // namespace

TEST_P(ListDuringARun, HoldsEveryContact)
{
  const Course &course = GetParam();
  for (const Format format : {Format::Fast, Format::Double}) {
    SCOPED_TRACE(to_string(format));
    RveState start = packing_of_400();
    start.cell = course.loosening * start.cell;
    if (course.shaking > 0.0) shake(start, course.shaking, 2);
    Options options;
    options.format = format;
    options.device = Device::Cpu;
    options.threads = 1;
    options.skin = course.skin;
    const auto engine = make_engine(options);
    const int rve = engine->add(start);
    std::vector<Result> results;
    // The engine and the oracle can disagree about contacts whose overlap is below the rounding
    // error of a length.
    const double doubt = format == Format::Fast ? 1e-8 : 1e-14;

    for (int step = 0; step < course.steps; step += course.steps_per_look) {
      engine->advance(
          {rve},
          {Drive::constant_velocity_gradient(course.velocity_gradient, DT, course.steps_per_look)},
          results);

      ASSERT_EQ(results[0].status & status::Fatal, 0u)
          << describe_status(results[0].status) << " at step " << step;
      const RveState state = engine->state(rve);
      std::set<std::pair<int, int>> listed;
      for (const Pair &pair : state.pairs) listed.insert(std::minmax(pair.first, pair.second));
      int touching = 0, certain = 0;
      for (const OraclePair &pair :
           all_pairs(state.cell, state.radius, state.fractional, doubt, 0)) {
        ++touching;
        if (pair.gap > -doubt) continue;
        ++certain;
        ASSERT_TRUE(listed.count({pair.first, pair.second}))
            << "step " << step << ": contact " << pair.first << " " << pair.second
            << " is not in the list";
      }
      ASSERT_LE(results[0].num_contacts, touching) << "step " << step;
      ASSERT_GE(results[0].num_contacts, certain) << "step " << step;
    }
    EXPECT_GE(results[0].counters.rebuilds, course.rebuilds_expected);
    EXPECT_LE(results[0].counters.rebuilds,
              course.steps / 2);    // the list is not rebuilt in every step
  }
}

TEST(AllowedDisplacement, KeepsUnlistedPairsApartForAnyStrain)
{
  // The gap of a pair is just too large for the list. Then the cell is strained, and both grains
  // move towards each other as far as is allowed before a rebuild.
  Random random(1);
  const Tensor2 list_cell{{2.0, 0.3, -0.2, 1.7}};
  const double skin = 0.05, smallest = 0.1, largest = 0.4;
  double closest = 1.0;
  for (int sample = 0; sample < 200000; ++sample) {
    Tensor2 g = Tensor2::identity();
    for (double &x : g.component) x += random.uniform(-0.06, 0.06);
    const double allowed =
        allowed_displacement(g * list_cell, inverse(list_cell), 2.0 * largest, skin);
    if (allowed <= 0.0) continue;    // the list must be rebuilt at once
    const double sum = random.integer(0, 1) ? 2.0 * smallest
                                            : random.uniform(2.0 * smallest, 2.0 * largest);
    const double angle = random.uniform(0.0, 6.2831853);
    const Vec<double, 2> branch{{(sum + skin) * std::cos(angle), (sum + skin) * std::sin(angle)}};

    const Vec<double, 2> strained = g * branch;
    const double gap = std::sqrt(dot(strained, strained)) - 2.0 * allowed - sum;

    ASSERT_GT(gap, -1e-8 * sum) << "sum of radii " << sum << ", smallest stretch "
                                << smallest_stretch(g);    // error of smallest_stretch()
    closest = std::min(closest, gap);
  }
  EXPECT_LT(closest, 0.01 * skin);    // the bound is sharp: it is nearly reached
}
