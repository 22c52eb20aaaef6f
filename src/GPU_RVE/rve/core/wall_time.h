// Wall time, which is measured and decides nothing.

#ifndef RVE_CORE_WALL_TIME_H
#define RVE_CORE_WALL_TIME_H

#include <chrono>

namespace rve {

using WallClock = std::chrono::steady_clock;

/// [seconds]
inline double seconds_since(WallClock::time_point start)
{
  return std::chrono::duration<double>(WallClock::now() - start).count();
}

}    // namespace rve

#endif
