// SPDX-License-Identifier: GPL-2.0-only
// The mixing function gives its published values.

#include "rve/core/splitmix64.h"

#include <gtest/gtest.h>

using rve::splitmix64;

TEST(SplitMix64, HasTheKnownOutputsOfTheGenerator)
{
  // Output k of the generator, counted from 0, is the mix of seed + k gamma. Vigna's splitmix64.c
  // gives these outputs for the seed 1234567.
  constexpr std::uint64_t SEED = 1234567u, GAMMA = 0x9e3779b97f4a7c15u;
  const std::uint64_t outputs[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u,
                                   4593380528125082431u, 16408922859458223821u};

  for (std::uint64_t k = 0; k < 5; ++k) EXPECT_EQ(splitmix64(SEED + k * GAMMA), outputs[k]);
}
