// SPDX-License-Identifier: GPL-2.0-only
// Loops over points with little work per point. They use several threads if that is faster
// (rve::LightWork).

#pragma once

#include "rve/core/threads.h"

namespace macro {

/// Calls f(k) for all k below `count`.
template <class F> void for_each(int count, int threads, const F &f)
{
  const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k) f(k);
}

/// Calls f(k) for all k below `count`. Returns true if at least one call returns true.
template <class F> bool for_each_any(int count, int threads, const F &f)
{
  bool any = false;
  const rve::LightWork work(count, threads);
#pragma omp parallel for num_threads(work.team) reduction(|| : any)
  for (int k = 0; k < count; ++k) {
    const bool is_one = f(k);
    any = any || is_one;
  }
  return any;
}

}    // namespace macro
