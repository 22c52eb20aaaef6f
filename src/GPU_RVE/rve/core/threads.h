// How many threads share a job, and which part of it is whose; with OpenMP or without it.

#ifndef RVE_CORE_THREADS_H
#define RVE_CORE_THREADS_H

#include "rve/core/error.h"

#include <algorithm>
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

/// Threads for so many points, nodes or RVEs: all, or one where waking the others would take longer than the work. Nothing between:
/// where a team is smaller than the one before, libgomp ends the threads that are left over and creates new ones for the next.
inline int team_for(int items, int threads)
{
  constexpr int WORTH_A_TEAM = 512;
  return items < WORTH_A_TEAM ? 1 : threads;
}

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

#endif
