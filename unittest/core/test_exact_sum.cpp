// SPDX-License-Identifier: GPL-2.0-only
// Tests FixedScale, which converts terms to integers so that their sum does not depend on the
// order.

#include "rve/core/exact_sum.h"

#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>

using rve::FixedScale;

TEST(FixedScale, SumOfTheLargestTermsCannotWrap)
{
  for (const double bound : {1e-290, 3.0, 1e290}) {
    const std::int64_t terms = 1000000;
    const FixedScale scale(bound, terms);

    const std::int64_t sum = terms * scale.integer(bound);    // by construction below 2^62

    EXPECT_LT(std::abs(static_cast<double>(sum)), std::ldexp(1.0, 62) + 1.0);
    EXPECT_NEAR(scale.real(sum), bound * terms, 1e-9 * bound * terms);
  }
}

TEST(FixedScale, RoundsSymmetrically)
{
  const FixedScale scale(1.0, 100);
  EXPECT_EQ(scale.integer(0.3), -scale.integer(-0.3));
  EXPECT_EQ(scale.integer(2.5 * scale.unit()), 3);
  EXPECT_EQ(scale.integer(-2.5 * scale.unit()), -3);
}
