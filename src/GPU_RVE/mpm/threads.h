// Threads of the MPM solver, with OpenMP or without it.

#ifndef MPM_THREADS_H
#define MPM_THREADS_H

#include <algorithm>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace mpm {

inline int usable_threads(int requested)
{
#ifdef _OPENMP
  return requested;
#else
  return std::min(requested, 1);
#endif
}

/// Threads for so many points or nodes: all, or one where waking the others would take longer than the work. Not something between:
/// teams of changing size cost more.
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

}    // namespace mpm

#endif
