// SPDX-License-Identifier: GPL-2.0-only
// The tangential spring with Coulomb limit.

#include "rve/physics/laws/law.h"
#include "rve/physics/tangential_force.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using rve_test::Random;

namespace {

constexpr double STIFFNESS = 1e6;    // [force/length]
constexpr double FRICTION = 0.5;
constexpr double NORMAL_FORCE = 20.0;
constexpr double LIMIT = FRICTION * NORMAL_FORCE;
constexpr double DT = 1e-4;

const LinearTangential<double, double, false> FRICTIONAL{STIFFNESS, FRICTION, 0.0};

/// Returns the velocity that changes the spring force by `share` of the Coulomb limit in one step.
double velocity_for(double share)
{
  return share * LIMIT / (STIFFNESS * DT);
}

}    // namespace

TEST(LinearTangential, StickingSpringGrowsByStiffnessTimesSlip)
{
  const double velocity = velocity_for(0.25);

  const auto first = FRICTIONAL.advance(0.0, velocity, NORMAL_FORCE, DT);
  const auto second = FRICTIONAL.advance(first.spring, velocity, NORMAL_FORCE, DT);

  EXPECT_NEAR(first.force, 0.25 * LIMIT, 1e-14 * LIMIT);
  EXPECT_NEAR(second.force, 0.50 * LIMIT, 1e-14 * LIMIT);
  EXPECT_EQ(second.spring, second.force);
  EXPECT_EQ(second.slipped, 0.0);
  EXPECT_FALSE(second.sliding);
}

TEST(LinearTangential, CoulombLimitCapsTheForceInBothDirections)
{
  for (const double direction : {1.0, -1.0}) {
    const auto shear = FRICTIONAL.advance(direction * 0.9 * LIMIT, direction * velocity_for(0.25),
                                          NORMAL_FORCE, DT);

    EXPECT_EQ(shear.force, direction * LIMIT);
    EXPECT_EQ(shear.spring, direction * LIMIT);
    EXPECT_NEAR(shear.slipped, direction * 0.15 * LIMIT, 1e-14 * LIMIT);
    EXPECT_TRUE(shear.sliding);
  }
}

TEST(LinearTangential, ReversedLoadUnloadsTheSpringAndSlidesTheOtherWay)
{
  double spring = 0.0;
  for (int k = 0; k < 12; ++k)
    spring = FRICTIONAL.advance(spring, velocity_for(0.1), NORMAL_FORCE, DT).spring;
  ASSERT_EQ(spring, LIMIT);

  // Equation (14) of the paper adds magnitudes of forces. As printed, it would keep the force at
  // the limit under reversed loading.
  for (int k = 1; k <= 19; ++k) {
    const auto shear = FRICTIONAL.advance(spring, -velocity_for(0.1), NORMAL_FORCE, DT);
    EXPECT_NEAR(shear.force, LIMIT * (1.0 - 0.1 * k), 1e-13 * LIMIT)
        << "step " << k;    // each step has one rounding
    EXPECT_FALSE(shear.sliding);
    spring = shear.spring;
  }
  for (int k = 0; k < 3; ++k)
    spring = FRICTIONAL.advance(spring, -velocity_for(0.1), NORMAL_FORCE, DT).spring;

  EXPECT_EQ(spring, -LIMIT);
}

TEST(LinearTangential, DecreasingNormalForceReducesTheSpring)
{
  const auto shear = FRICTIONAL.advance(0.9 * LIMIT, 0.0, 0.5 * NORMAL_FORCE, DT);

  EXPECT_EQ(shear.force, 0.5 * LIMIT);
  EXPECT_EQ(shear.spring, 0.5 * LIMIT);
  EXPECT_TRUE(shear.sliding);
}

TEST(LinearTangential, WithoutFrictionThereIsNoForce)
{
  const LinearTangential<double, double, false> smooth{STIFFNESS, 0.0, 0.0};

  const auto shear = smooth.advance(0.0, 0.3, NORMAL_FORCE, DT);

  EXPECT_EQ(shear.force, 0.0);
  EXPECT_EQ(shear.spring, 0.0);
}

TEST(LinearTangential, ZeroTimeStepKeepsTheHistory)
{
  const auto shear = FRICTIONAL.advance(0.7 * LIMIT, 12.0, NORMAL_FORCE, 0.0);

  EXPECT_EQ(shear.spring, 0.7 * LIMIT);
  EXPECT_EQ(shear.slipped, 0.0);
}

TEST(LinearTangential, WorkIsStoredOrLostInSliding)
{
  const double amplitude = velocity_for(0.07);
  double spring = 0.0, work = 0.0, lost = 0.0;
  int onsets = 0;
  bool was_sliding = false;
  for (int k = 0; k < 4000; ++k) {
    const double velocity = amplitude * std::sin(k * 0.01);
    const auto shear = FRICTIONAL.advance(spring, velocity, NORMAL_FORCE, DT);
    work += 0.5 * (spring + shear.spring) * velocity * DT;
    lost += shear.force * shear.slipped / STIFFNESS;
    if (shear.sliding && !was_sliding) ++onsets;
    was_sliding = shear.sliding;
    spring = shear.spring;
  }
  const double stored = energy_of_spring(spring, FRICTIONAL.stiffness);

  ASSERT_GT(onsets, 8);    // the contact sticks and slides in both directions
  ASSERT_GT(lost, 100.0 * LIMIT * LIMIT / STIFFNESS);
  // The work uses the mean of the forces before and after a step. The mean is exact except in a
  // step in which sliding begins. The error of such a step is at most (k v dt)^2 / (8 k), with the
  // stiffness k and the velocity v.
  const double slip = STIFFNESS * amplitude * DT;
  EXPECT_NEAR(work, stored + lost, onsets * slip * slip / (8.0 * STIFFNESS) + 1e-12 * lost);
}

TEST(LinearTangential, DashpotSharesTheLimitAsInLammps)
{
  // The loop repeats the model tangential linear_history of LAMMPS' pair granular. There the
  // history is a displacement, and the force is opposite to it.
  Random random(5);
  const LinearTangential<double, double, true> law{STIFFNESS, FRICTION, 40.0};
  double spring = 0.0, displacement = 0.0;
  int slides = 0, sticks = 0;
  for (int k = 0; k < 5000; ++k) {
    const double velocity = random.uniform(-1.0, 1.0) * velocity_for(0.6);
    const double normal_force = random.uniform(0.5, 1.5) * NORMAL_FORCE;
    const double v = -velocity;    // LAMMPS: velocity of i relative to j
    displacement += v * DT;
    double force = -STIFFNESS * displacement - 40.0 * v;
    const double critical = FRICTION * normal_force;
    if (std::fabs(force) > critical) {
      displacement = -1.0 / STIFFNESS * (critical * force / std::fabs(force) + 40.0 * v);
      force *= critical / std::fabs(force);
      ++slides;
    } else {
      ++sticks;
    }

    const auto shear = law.advance(spring, velocity, normal_force, DT);
    spring = shear.spring;

    ASSERT_NEAR(shear.force, force, 1e-11 * LIMIT);    // the history accumulates roundings
    ASSERT_NEAR(spring, -STIFFNESS * displacement, 1e-11 * LIMIT);
  }
  EXPECT_GT(slides, 500);
  EXPECT_GT(sticks, 500);
}
