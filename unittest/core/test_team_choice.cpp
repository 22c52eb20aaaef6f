// SPDX-License-Identifier: GPL-2.0-only
// Tests TeamChoice, which chooses between one thread and a team of threads for short loops. The
// machine is simulated: a formula gives the time of a loop.

#include "rve/core/team_choice.h"
#include "rve/core/threads.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace {

constexpr int ITEMS = 1000;
constexpr double ALONE = 40e-6;    // time of a loop with one thread [s]

/// Totals of a run on a simulated machine: time [s], number of loops with one thread, number of all
/// loops, and the longest sequence of loops with a team.
struct Outcome {
  double seconds = 0.0;
  int alone = 0, loops = 0, in_a_row = 0;
};

Outcome work(rve::TeamChoice &choice, double seconds, const std::function<double(bool)> &loop)
{
  Outcome outcome;
  int in_a_row = 0;
  while (outcome.seconds < seconds) {
    const bool alone = choice.alone();
    const double took = loop(alone);
    choice.done(ITEMS, took);
    outcome.seconds += took;
    outcome.alone += alone ? 1 : 0;
    in_a_row = alone ? 0 : in_a_row + 1;
    outcome.in_a_row = std::max(outcome.in_a_row, in_a_row);
    ++outcome.loops;
  }
  return outcome;
}

/// Returns the time of a loop if all cores are free [s]. A team divides the work among its threads
/// and needs 2 us to synchronise.
double quiet(bool alone, int threads)
{
  return alone ? ALONE : ALONE / threads + 2e-6;
}

/// Returns the time of a loop if other programs use the cores [s]. In a `share` of the loops, the
/// team waits 4 ms for a thread that gets no core.
double busy(bool alone, rve_test::Random &random, double share)
{
  return alone ? ALONE : ALONE / 2 + (random.uniform(0.0, 1.0) < share ? 4e-3 : 2e-6);
}

TEST(TeamChoice, KeepsTheTeamOnFreeCores)
{
  for (const int threads : {2, 4, 16, 64}) {
    rve::TeamChoice choice;
    const auto loop = [&](bool alone) { return quiet(alone, threads); };
    work(choice, 0.1, loop);
    const Outcome outcome = work(choice, 10.0, loop);
    EXPECT_LT(outcome.seconds, 1.02 * outcome.loops * quiet(false, threads)) << threads;
    EXPECT_GT(outcome.alone, 0) << "one thread is never tried, " << threads;
  }
}

TEST(TeamChoice, UsesOneThreadIfTheTeamWaits)
{
  for (const double share : {0.05, 0.3, 1.0}) {
    rve::TeamChoice choice;
    rve_test::Random random(1);
    const auto loop = [&](bool alone) { return busy(alone, random, share); };
    const Outcome begin = work(choice, 1.0, loop);
    EXPECT_LT(begin.seconds, begin.loops * ALONE + 0.05) << "a short run, " << share;
    const Outcome outcome = work(choice, 30.0, loop);
    EXPECT_LT(outcome.seconds, 1.05 * outcome.loops * ALONE) << share;
    EXPECT_LT(outcome.alone, outcome.loops) << "the team is never tried, " << share;
    if (share == 1.0) { EXPECT_LE(outcome.in_a_row, 5) << "a hopeless trial goes on"; }
  }
}

/// In at most one of a thousand loops, the team waits 8 ms for a thread that gets no core.
/// TeamChoice times windows of 64 loops. A window with such a wait is slow, but on average the team
/// is still faster than one thread.
TEST(TeamChoice, KeepsTheTeamIfWaitsAreRare)
{
  for (const double share : {1e-4, 1e-3}) {
    double seconds = 0.0, best = 0.0;
    for (int seed = 1; seed <= 20; ++seed) {
      rve::TeamChoice choice;
      rve_test::Random random(seed);
      const auto loop = [&](bool alone) {
        return alone ? ALONE : 10e-6 + (random.uniform(0.0, 1.0) < share ? 8e-3 : 0.0);
      };
      work(choice, 0.1, loop);
      const Outcome outcome = work(choice, 1.0, loop);
      seconds += outcome.seconds;
      best += outcome.loops * (10e-6 + share * 8e-3);
    }
    EXPECT_LT(seconds, 1.1 * best) << share;
  }
}

TEST(TeamChoice, UsesOneThreadIfATeamIsAlwaysSlower)
{
  rve::TeamChoice choice;
  const auto loop = [](bool alone) { return alone ? 5e-6 : 9e-6; };
  work(choice, 0.1, loop);
  const Outcome outcome = work(choice, 5.0, loop);
  EXPECT_LT(outcome.seconds, 1.02 * outcome.loops * 5e-6);
}

TEST(TeamChoice, FollowsTheLoadOfOtherPrograms)
{
  rve::TeamChoice choice;
  rve_test::Random random(2);
  const auto free_cores = [&](bool alone) { return quiet(alone, 2); };
  const auto taken_cores = [&](bool alone) { return busy(alone, random, 0.3); };
  work(choice, 20.0, free_cores);
  EXPECT_FALSE(choice.alone());
  // Other programs start. The choice returns to one thread before the team has lost a second.
  const Outcome came = work(choice, 2.0, taken_cores);
  EXPECT_LT(came.seconds, came.loops * ALONE + 1.0);
  EXPECT_TRUE(choice.alone());
  // Other programs end. The next trial selects the team again.
  work(choice, 10.0, free_cores);
  const Outcome gone = work(choice, 5.0, free_cores);
  EXPECT_LT(gone.seconds, 1.02 * gone.loops * quiet(false, 2));
}

TEST(LightWork, FewItemsUseOneThread)
{
  for (int loop = 0; loop < 1000; ++loop) {
    const rve::LightWork work(511, 4);
    EXPECT_EQ(work.team, 1);
  }
  // The choice starts with one thread and tries the team after a window of 64 loops. The loops
  // above have no influence, since loops over few items are not timed.
  int loops = 0;
  while (rve::LightWork(512, 4).team == 1) ASSERT_LT(++loops, 100);
  EXPECT_GT(loops, 50);
  EXPECT_EQ(rve::LightWork(512, 1).team, 1);
}

TEST(LightWork, ThreadsAreLimitedWithAGpu)
{
  const int before = rve::most_in_a_team().exchange(3);
  EXPECT_EQ(rve::team_for(512, 8), 3);
  EXPECT_EQ(rve::team_for(512, 2), 2);
  EXPECT_EQ(rve::team_for(511, 8), 1);
  for (int loop = 0; loop < 1000; ++loop) {
    const rve::LightWork work(512, 8);
    EXPECT_TRUE(work.team == 1 || work.team == 3) << work.team;
  }
  rve::most_in_a_team() = before;
}

}    // namespace
