// SPDX-License-Identifier: GPL-2.0-only
// How many threads share a job, and which part of it is whose; with OpenMP or without it.

#pragma once

#include "rve/core/error.h"
#include "rve/core/team_choice.h"
#include "rve/core/wall_time.h"

#include <algorithm>
#include <atomic>
#include <string>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace rve {

/// More is a slip of the pen: threads have memory of their own, and their creation fails somewhere.
constexpr int MOST_THREADS = 1024;

/// Throws InputError unless a number of threads, as given or as OpenMP has it, is sound.
inline void require_threads(int threads)
{
  require(threads >= 1 && threads <= MOST_THREADS, [=] {
    return "number of threads is " + std::to_string(threads) + "; it must be from 1 to " +
        std::to_string(MOST_THREADS) + " (keyword threads, or OMP_NUM_THREADS without it)";
  });
}

inline int usable_threads(int requested)
{
#ifdef _OPENMP
  return requested;
#else
  return std::min(requested, 1);
#endif
}

/// The most threads that team_for() gives, in this process. Beside a GPU, which does what is long, all of them wait for the next loop of
/// microseconds most of the time, and spin; where they take all cores of a machine, each loop now and then waits for a thread that has none.
inline std::atomic<int> &most_in_a_team()
{
  static std::atomic<int> most{MOST_THREADS};
  return most;
}

/// Threads for so many points, nodes or RVEs: all, or one where waking the others would take longer than the work. Nothing between:
/// where a team is smaller than the one before, libgomp ends the threads that are left over and creates new ones for the next.
inline int team_for(int items, int threads)
{
  constexpr int WORTH_A_TEAM = 512;
  return items < WORTH_A_TEAM ? 1 : std::min(threads, most_in_a_team().load());
}

/// A loop of light work over points, nodes or RVEs, for as long as this lives. `team` threads do it: one for few items, as in team_for(),
/// and for many items one or all, whichever has turned out to be faster. All loops of the calling thread are judged together.
class LightWork {
 public:
  LightWork(int items, int threads) : items_(items), team(choose(items, threads))
  {
    if (is_timed_) start_ = WallClock::now();
  }
  ~LightWork()
  {
    if (is_timed_) choice().done(items_, seconds_since(start_));
  }
  LightWork(const LightWork &) = delete;
  LightWork &operator=(const LightWork &) = delete;

 private:
  static TeamChoice &choice()
  {
    static thread_local TeamChoice choice_of_thread;
    return choice_of_thread;
  }
  int choose(int items, int threads)
  {
    const int most = team_for(items, threads);
    is_timed_ = most > 1;
    return is_timed_ && choice().alone() ? 1 : most;
  }

  int items_;
  bool is_timed_ = false;
  WallClock::time_point start_;

 public:
  const int team;
};

inline int this_thread()
{
#ifdef _OPENMP
  return omp_get_thread_num();
#else
  return 0;
#endif
}

/// Threads of the present parallel region.
inline int team_size()
{
#ifdef _OPENMP
  return omp_get_num_threads();
#else
  return 1;
#endif
}

/// Of `count` items those of the present thread: the same in every region of the same team, so that they stay in its caches.
struct ThreadShare {
  int begin, end;
  explicit ThreadShare(int count)
  {
    const long long thread = this_thread(), team = team_size();
    begin = static_cast<int>(count * thread / team);
    end = static_cast<int>(count * (thread + 1) / team);
  }
};

}    // namespace rve
