// SPDX-License-Identifier: GPL-2.0-only
// Whether two ways to compute the same numbers differ by rounding only: as much as what goes in does, with another last digit.

#pragma once

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace rve_test {

/// x and one `digit`, with either sign.
inline double with_another_digit(double x, double digit, Random &random)
{
  return x + (random.uniform(-1.0, 1.0) < 0.0 ? -digit : digit);
}

/// x with another last digit.
inline double with_another_last_digit(double x, Random &random)
{
  return std::nextafter(x, random.uniform(-1.0, 1.0) < 0.0 ? -1e300 : 1e300);
}

struct RoundingErrors {
  double most = 0.0;             ///< of the numbers themselves
  std::vector<double> errors;    ///< the largest one of each step
  double of_digits = 0.0;        ///< the largest change by other last digits
};

/// Against the forces of LAMMPS: 1e-12 of the largest number, or what the last digit decides where that is more. It is more for a displacement
/// that is kept over the root of an overlap that is nearly nothing. In a step of a hundred LAMMPS leaves in the history what lies along the
/// normal, up to 1e-10 of the force of sliding: no error is more than `bound`.
inline void expect_rounding_only(RoundingErrors found, double bound)
{
  EXPECT_GT(found.most, 0.0);
  EXPECT_LT(found.of_digits, 1e-10 * found.most)
      << "the digits decide so much that this says little";
  std::sort(found.errors.begin(), found.errors.end());
  EXPECT_LT(found.errors[(found.errors.size() - 1) * 99 / 100],
            std::fmax(1e-12 * found.most, found.of_digits));
  EXPECT_LT(found.errors.back(), bound * found.most);
}

}    // namespace rve_test
