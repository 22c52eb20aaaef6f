// SPDX-License-Identifier: GPL-2.0-only
// Tests whether two programs compute the same numbers except for rounding. Their difference must
// not exceed the change of a result if the last digits of the input change.

#pragma once

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace rve_test {

/// Returns x plus or minus one `digit`.
inline double with_another_digit(double x, double digit, Random &random)
{
  return x + (random.uniform(-1.0, 1.0) < 0.0 ? -digit : digit);
}

/// Returns x with a changed last digit.
inline double with_another_last_digit(double x, Random &random)
{
  return std::nextafter(x, random.uniform(-1.0, 1.0) < 0.0 ? -1e300 : 1e300);
}

struct RoundingErrors {
  double most = 0.0;             ///< largest number, in magnitude
  std::vector<double> errors;    ///< largest error of each step
  double of_digits = 0.0;        ///< largest change of a number if last digits of the input change
};

/// Expects that the forces agree with LAMMPS. In 99 % of the steps the error is at most 1e-12 of
/// the largest number or, if larger, the effect of the last digits. The effect of the last digits
/// is large for a displacement that is divided by the root of a nearly vanishing overlap. In one of
/// a hundred steps, LAMMPS leaves a part along the normal in the history, up to 1e-10 of the
/// sliding force. In every step the error is below `bound` times the largest number.
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
