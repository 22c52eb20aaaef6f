// SPDX-License-Identifier: GPL-2.0-only
// Number of threads of a loop and the share of each thread, with or without OpenMP.

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

/// Largest allowed number of threads. A larger number is an input error: each thread needs memory,
/// and the creation of too many threads fails.
constexpr int MOST_THREADS = 1024;

/// Throws InputError unless a number of threads, given or from OpenMP, is valid.
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

/// Largest number of threads that team_for() returns in this process. fix rve lowers it if a GPU
/// does the long work. Host threads then mostly spin until the next short loop. If they occupied
/// all cores, a loop would sometimes have to wait for a thread that is not scheduled.
inline std::atomic<int> &most_in_a_team()
{
  static std::atomic<int> most{MOST_THREADS};
  return most;
}

/// Returns the number of threads for `items` points, nodes or RVEs: all threads, or one if waking
/// the others takes longer than the work. The function never returns a number in between: if a team
/// is smaller than the previous one, libgomp ends the other threads and creates new ones for the
/// next team.
inline int team_for(int items, int threads)
{
  constexpr int WORTH_A_TEAM = 512;
  return items < WORTH_A_TEAM ? 1 : std::min(threads, most_in_a_team().load());
}

/// Times a loop of light work over points, nodes or RVEs during its lifetime. `team` is the number
/// of threads for the loop. For few items it is one, as in team_for(). For many items it is one or
/// all, whichever has been faster. All loops of the calling thread share one TeamChoice.
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

/// Number of threads of the current parallel region.
inline int team_size()
{
#ifdef _OPENMP
  return omp_get_num_threads();
#else
  return 1;
#endif
}

/// Share of the current thread in `count` items. In all regions with the same team a thread has the
/// same share, so that its items stay in its caches.
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
