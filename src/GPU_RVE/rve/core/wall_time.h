// SPDX-License-Identifier: GPL-2.0-only
// Wall time.

#pragma once

#include <chrono>

namespace rve {

using WallClock = std::chrono::steady_clock;

/// Returns the wall time since `start` [s].
inline double seconds_since(WallClock::time_point start)
{
  return std::chrono::duration<double>(WallClock::now() - start).count();
}

}    // namespace rve
