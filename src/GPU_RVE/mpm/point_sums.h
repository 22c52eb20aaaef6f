// SPDX-License-Identifier: GPL-2.0-only
// Exact sums over the points of all ranks. The bits of a sum depend neither on the order of the
// points nor on their distribution over ranks.

#pragma once

#include "mpm/points.h"
#include "mpm/solver_options.h"
#include "rve/core/exact_sum.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace mpm {

struct PointSums {
  std::int64_t points;         ///< number of points
  std::vector<double> sums;    ///< one sum per quantity q
};

/// Returns `count` sums over the points p for which takes(p) is true. The terms of sum q are
/// value(p, q). For each sum, check(largest magnitude of a term, number of terms) throws if the
/// terms are too large. Collective.
template <int D, class Takes, class Value, class Check>
PointSums sum_over_points(const PointView<D> &points, const Communication &communication, int count,
                          const Takes &takes, const Value &value, const Check &check)
{
  std::vector<double> largest(count, 0.0);
  std::int64_t terms = 0;
  for (int p = 0; p < points.count; ++p) {
    if (!takes(p)) continue;
    ++terms;
    for (int q = 0; q < count; ++q) largest[q] = std::max(largest[q], std::abs(value(p, q)));
  }
  communication.max_over_ranks(largest.data(), largest.size());
  communication.sum_over_ranks(&terms, 1);
  std::vector<rve::FixedScale> scale;
  for (const double bound : largest) {
    check(bound, terms);
    scale.emplace_back(bound, terms);
  }
  std::vector<std::int64_t> integers(count, 0);
  for (int p = 0; p < points.count; ++p)
    for (int q = 0; takes(p) && q < count; ++q) integers[q] += scale[q].integer(value(p, q));
  communication.sum_over_ranks(integers.data(), integers.size());
  PointSums result = {terms, {}};
  for (int q = 0; q < count; ++q) result.sums.push_back(scale[q].real(integers[q]));
  return result;
}

}    // namespace mpm
