// SPDX-License-Identifier: GPL-2.0-only
#include "rve/physics/normal_force.h"

#include <gtest/gtest.h>

using namespace rve;

TEST(LinearNormal, ForceIsProportionalToOverlap)
{
  const LinearNormal<double> law{1e6};

  EXPECT_DOUBLE_EQ(law.force(2e-5), 20.0);
  EXPECT_DOUBLE_EQ(law.force(4e-5), 40.0);
  EXPECT_EQ(law.force(0.0), 0.0);
}

TEST(LinearNormal, ForceIsTheDerivativeOfTheEnergy)
{
  const LinearNormal<double> law{3e6};
  const double overlap = 7e-5, h = 1e-5;

  const double slope =
      (law.elastic_energy(overlap + h) - law.elastic_energy(overlap - h)) / (2.0 * h);

  EXPECT_NEAR(slope, law.force(overlap), 1e-12 * slope);    // exact for a parabola, up to rounding
  EXPECT_DOUBLE_EQ(law.elastic_energy(2e-5), 0.5 * 3e6 * 4e-10);
}

TEST(VelocityDamping, OpposesApproachAndSeparation)
{
  const VelocityDamping<double> dashpot{50.0};

  EXPECT_DOUBLE_EQ(dashpot.force(-0.1), 5.0);    // approaching grains repel
  EXPECT_DOUBLE_EQ(dashpot.force(0.1), -5.0);
}
