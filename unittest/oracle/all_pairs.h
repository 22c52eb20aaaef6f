// SPDX-License-Identifier: GPL-2.0-only
// Oracle: pairs of neighbours from a loop over all pairs and near images, in double precision.

#pragma once

#include "rve/core/tensor.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace rve_test {

struct OraclePair {
  int first, second;             ///< first < second
  rve::Vec<double, 2> branch;    ///< from first to the nearest image of second [length]
  double gap;                    ///< |branch| - sum of radii [length]
};

/// Returns the pairs with a gap below `reach` [length]. `fractional` has the fractional coordinates
/// times 2^64. The search for the nearest image starts from the image with the smallest fractional
/// difference and covers `images` cells in each direction. One cell suffices if the cell is wider
/// than twice the distance of two grains at this gap.
inline std::vector<OraclePair> all_pairs(const rve::Tensor2 &cell,
                                         const std::vector<double> &radius,
                                         const std::vector<std::uint64_t> &fractional, double reach,
                                         int images = 1)
{
  const int n = static_cast<int>(radius.size());
  std::vector<OraclePair> pairs;
  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j) {
      // The subtraction of unsigned integers wraps around. Its result, read as a signed integer, is
      // the smallest fractional difference between images.
      const double dx =
          static_cast<double>(static_cast<std::int64_t>(fractional[2 * j] - fractional[2 * i])) *
          0x1p-64;
      const double dy = static_cast<double>(static_cast<std::int64_t>(fractional[2 * j + 1] -
                                                                      fractional[2 * i + 1])) *
          0x1p-64;
      OraclePair pair{i, j, {{0.0, 0.0}}, 0.0};
      double shortest = -1.0;
      for (int a = -images; a <= images; ++a)
        for (int b = -images; b <= images; ++b) {
          const double x = cell(0, 0) * (dx + a) + cell(0, 1) * (dy + b);
          const double y = cell(1, 0) * (dx + a) + cell(1, 1) * (dy + b);
          const double squared = x * x + y * y;
          if (shortest >= 0.0 && squared >= shortest) continue;
          shortest = squared;
          pair.branch = {{x, y}};
        }
      pair.gap = std::sqrt(shortest) - (radius[i] + radius[j]);
      if (pair.gap < reach) pairs.push_back(pair);
    }
  return pairs;
}

}    // namespace rve_test
