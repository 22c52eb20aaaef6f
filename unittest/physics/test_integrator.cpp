// SPDX-License-Identifier: GPL-2.0-only
// Leapfrog velocity update with Cundall's damping.

#include "rve/physics/integrator.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using rve_test::Random;

TEST(LocalDamping, ReducesAccelerationAndIncreasesDeceleration)
{
  EXPECT_DOUBLE_EQ(locally_damped(0.3, 2.0, 5.0), 2.0 * 0.7);
  EXPECT_DOUBLE_EQ(locally_damped(0.3, -2.0, -5.0), -2.0 * 0.7);
  EXPECT_DOUBLE_EQ(locally_damped(0.3, -2.0, 5.0), -2.0 * 1.3);
  EXPECT_DOUBLE_EQ(locally_damped(0.3, 2.0, -5.0), 2.0 * 1.3);
}

TEST(LocalDamping, SignOfZeroIsZero)
{
  EXPECT_EQ(locally_damped(0.3, 2.0, 0.0), 2.0);
  EXPECT_EQ(locally_damped(0.3, 2.0, -0.0), 2.0);
  EXPECT_EQ(locally_damped(0.3, 0.0, 5.0), 0.0);
}

TEST(LocalDamping, DoesNotDependOnTheUnits)
{
  // The product of these numbers underflows in fp32.
  EXPECT_FLOAT_EQ(locally_damped(0.3f, 1e-30f, 1e-30f), 0.7f * 1e-30f);
  EXPECT_FLOAT_EQ(locally_damped(0.3f, -1e-30f, 1e-30f), -1.3f * 1e-30f);
}

TEST(ObjectiveDamping, ScalesTheWholeVectorByTheSignOfItsPower)
{
  const Vec<double, 3> a{{2.0, -1.0, 0.5}}, along{{1.0, 1.0, 3.0}}, across{{1.0, 2.0, 0.0}};
  for (int k = 0; k < 3; ++k) {
    EXPECT_DOUBLE_EQ(objectively_damped(0.3, a, along)[k], 0.7 * a[k]);
    EXPECT_DOUBLE_EQ(objectively_damped(0.3, a, -1.0 * along)[k], 1.3 * a[k]);
    EXPECT_EQ(objectively_damped(0.3, a, across)[k], a[k]);
  }
}

TEST(Kick, IsEquationThreeWithTheDampingOfEquationFour)
{
  Random random(1);
  for (int sample = 0; sample < 10000; ++sample) {
    const double v = random.uniform(-1.0, 1.0), a = random.uniform(-1000.0, 1000.0);
    const double alpha = random.uniform(0.0, 0.99), dt = random.uniform(1e-5, 5e-3);
    // Equation (4) with the velocity at the full step, then equation (3a) with the damped force.
    // The mass is 1.
    const double full_step = v + a * dt / 2.0;
    const double damped = a -
        alpha * std::fabs(a) *
            (full_step > 0.0       ? 1.0
                 : full_step < 0.0 ? -1.0
                                   : 0.0);
    const double expected = v + damped * dt;

    ASSERT_NEAR(kick(v, a * dt, alpha), expected, 4e-15 * (std::fabs(v) + std::fabs(a * dt)));
  }
}

TEST(Kick, WithoutDampingIsTimeReversible)
{
  const double v = 0.37, a = -12.0, dt = 1e-3;

  EXPECT_NEAR(kick(kick(v, a * dt, 0.0), -a * dt, 0.0), v, 1e-16);
}

TEST(Kick, GrainAtRestUnderNoForceStaysAtRest)
{
  EXPECT_EQ(kick(0.0, 0.0, 0.3), 0.0);
}

namespace {

/// Returns the ratio of the rebound speed of a unit mass on a spring to its approach speed. A
/// contact takes `steps` steps.
double rebound(double alpha, int steps)
{
  const double pi = 3.14159265358979323846, dt = pi / steps;    // stiffness 1
  double x = 0.0, v = -1.0;
  for (;;) {
    x += dt * v;
    if (x >= 0.0) return v;
    v = kick(v, -x * dt, alpha);
  }
}

}    // namespace

TEST(Kick, CollisionWithoutDampingReturnsTheSpeed)
{
  EXPECT_NEAR(rebound(0.0, 20000), 1.0,
              1e-3);    // error of order dt: the contact ends within a step
}

TEST(Kick, CollisionWithLocalDampingReturnsRootOfOneMinusAlphaOverOnePlusAlpha)
{
  // Damping multiplies the spring force by 1 + alpha on approach and by 1 - alpha on rebound.
  for (const double alpha : {0.1, 0.3, 0.7})
    EXPECT_NEAR(rebound(alpha, 20000), std::sqrt((1.0 - alpha) / (1.0 + alpha)), 1e-3)
        << "alpha " << alpha;
}
