// SPDX-License-Identifier: GPL-2.0-only
// Collisions of two disks: closed forms of the contact laws, through the whole engine.

#include "support/rve_rig.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005;
constexpr double STIFFNESS = 1e6;

double disk_mass()
{
  return 2650.0 * M_PI * RADIUS * RADIUS;
}
double contact_frequency()
{
  return std::sqrt(STIFFNESS / (0.5 * disk_mass()));
}

Material without_losses()
{
  Material material = paper_material();
  material.friction = 0.0;
  material.local_damping = 0.0;
  return material;
}

struct Collision {
  double restitution;
  double duration;
  double tangential_change;    ///< change of the relative velocity of the centres
  double spin;                 ///< final spin of the first disk
};

Collision collide(const RveState &before, double dt, Format format = Format::Double)
{
  RveRig rig(before, cpu_options(format));
  const double approach = before.velocity[0] - before.velocity[2];
  int in_contact = 0, steps = 0;
  do {
    rig.strain(Tensor2::zero(), dt, 1);
    EXPECT_EQ(rig.result().status & status::Fatal, 0u);
    in_contact += rig.result().num_contacts;
  } while ((rig.result().num_contacts > 0 || steps < 10) && ++steps < 100000);
  const RveState after = rig.state();
  const double relative_before = before.velocity[3] - before.velocity[1];
  return {(after.velocity[2] - after.velocity[0]) / approach, in_contact * dt,
          (after.velocity[3] - after.velocity[1]) - relative_before, after.spin[0]};
}

}    // namespace

// A contact takes pi/(w dt) = 4000 steps, with the frequency w of the contact. It starts and ends
// within a step. Therefore the error of the restitution is O((w dt)^2), and the error of the
// duration is up to two steps.
class TwoDiskCollision : public ::testing::Test {
 protected:
  const double dt = M_PI / contact_frequency() / 4000.0;
  const double restitution_error = 2.0 * std::pow(contact_frequency() * dt, 2);    // 1.2e-6
};

TEST_F(TwoDiskCollision, WithoutDampingReturnsTheSpeedAfterHalfAPeriod)
{
  const Collision collision = collide(approaching_disks(RADIUS, without_losses(), 0.1), dt);

  EXPECT_NEAR(collision.restitution, 1.0, restitution_error);
  EXPECT_NEAR(collision.duration, M_PI / contact_frequency(), 2.0 * dt);
}

TEST_F(TwoDiskCollision, CundallDampingScalesTheForceOnApproachAndRebound)
{
  for (const double alpha : {0.1, 0.3, 0.7}) {
    Material material = without_losses();
    material.local_damping = alpha;

    const Collision collision = collide(approaching_disks(RADIUS, material, 0.1), dt);

    // In the step in which the velocity changes sign, local damping changes the factor of the force
    // from 1+alpha to 1-alpha. In this step the velocity has an error of up to one kick. Since the
    // velocity is nearly zero, the error of the energy is of second order in w dt = 8e-4. The
    // duration changes by up to (1+alpha)/(1-alpha) steps.
    EXPECT_NEAR(collision.restitution, std::sqrt((1.0 - alpha) / (1.0 + alpha)), 1e-5);
    EXPECT_NEAR(collision.duration,
                0.5 * M_PI / contact_frequency() *
                    (1.0 / std::sqrt(1.0 + alpha) + 1.0 / std::sqrt(1.0 - alpha)),
                (2.0 + (1.0 + alpha) / (1.0 - alpha)) * dt);
  }
}

TEST_F(TwoDiskCollision, DashpotGivesTheRestitutionOfADampedOscillator)
{
  for (const double ratio : {0.05, 0.3}) {    // of critical damping
    Material material = without_losses();
    material.normal_viscosity = 2.0 * ratio * 0.5 * disk_mass() * contact_frequency();

    const Collision collision = collide(approaching_disks(RADIUS, material, 0.1), dt);

    // The dashpot uses the velocity half a step earlier. The resulting error is of first order in w
    // dt = 8e-4, times the damping ratio.
    const double damped = contact_frequency() * std::sqrt(1.0 - ratio * ratio);
    EXPECT_NEAR(collision.restitution, std::exp(-ratio * contact_frequency() * M_PI / damped),
                2.0 * ratio * 8e-4);
    EXPECT_NEAR(collision.duration, M_PI / damped, 2.0 * dt);
  }
}

TEST_F(TwoDiskCollision, ErrorOfTheDashpotHalvesWithTheTimeStep)
{
  Material material = without_losses();
  material.normal_viscosity = 0.6 * 0.5 * disk_mass() * contact_frequency();
  const double exact = std::exp(-0.3 * M_PI / std::sqrt(1.0 - 0.09));

  const double coarse =
      collide(approaching_disks(RADIUS, material, 0.1), 8.0 * dt).restitution - exact;
  const double fine = collide(approaching_disks(RADIUS, material, 0.1), dt).restitution - exact;

  EXPECT_LT(std::fabs(fine), 0.25 * std::fabs(coarse));
}

TEST_F(TwoDiskCollision, EveryFormatHasTheRestitution)
{
  Material material = without_losses();
  material.local_damping = 0.3;

  for (const Format format : ALL_FORMATS) {
    const Collision collision =
        collide(approaching_disks(RADIUS, material, 0.1), 10.0 * dt, format);

    // In `fast`, each of 400 steps rounds positions to 0.1 m / 2^32 = 2e-11 m and the overlap of
    // 3e-5 m to fp32. The roundings of a step change the restitution by at most 1e-6.
    EXPECT_NEAR(collision.restitution, std::sqrt(0.7 / 1.3), 4e-4) << to_string(format);
  }
}

TEST_F(TwoDiskCollision, GrossSlidingTransfersTheCoulombImpulse)
{
  // The velocities are so small that neither the overlap (6e-7 of the radius) nor the rotation of
  // the normal (3e-6 rad) matters.
  const double normal_velocity = 1e-5, tangential_velocity = 3e-5;
  Material material = without_losses();
  material.friction = 0.1;

  const Collision collision =
      collide(approaching_disks(RADIUS, material, normal_velocity, tangential_velocity), dt);

  // The impulse J = mu m* (1 + e) v_n changes the velocities of the centres along the tangent. The
  // angular impulse r J, with the radius r, changes the spins of the disks, whose moments of
  // inertia are I = m r^2/2. The second disk moves down relative to the first. Friction on the
  // second disk therefore points up, and both disks rotate clockwise.
  EXPECT_NEAR(collision.restitution, 1.0, 1e-5);
  EXPECT_NEAR(collision.tangential_change, 0.1 * 2.0 * normal_velocity, 1e-5 * normal_velocity);
  EXPECT_NEAR(std::fabs(collision.spin), 0.1 * 2.0 * normal_velocity / RADIUS,
              1e-5 * normal_velocity / RADIUS);
  // The first disk moves up and the second disk moves down. Disks that roll on each other in this
  // way rotate clockwise.
  EXPECT_LT(collision.spin, 0.0);
}

TEST_F(TwoDiskCollision, ObliqueImpactConservesAngularMomentum)
{
  Material material = without_losses();
  material.friction = 0.3;
  const RveState before = approaching_disks(RADIUS, material, 0.02, 0.01);
  RveRig rig(before);
  const auto angular_momentum = [](const RveState &state) {
    const Vec<double, 2> c{
        {state.velocity[2] - state.velocity[0], state.velocity[3] - state.velocity[1]}};
    const std::vector<double> x = state.positions();
    const Vec<double, 2> branch{{x[2] - x[0], x[3] - x[1]}};
    return 0.5 * disk_mass() * cross(branch, c) +
        0.5 * disk_mass() * RADIUS * RADIUS * (state.spin[0] + state.spin[1]);
  };

  rig.strain(Tensor2::zero(), dt, 8000);

  // The lever arms of both torques add up to the length of the branch vector, so that the torques
  // balance the couple of the forces at every instant. Two errors remain: the rounding of torques
  // to integers, 2^-52 of the largest torque, and the half step between positions and velocities.
  ASSERT_EQ(rig.result().num_contacts, 0);
  EXPECT_NE(rig.state().spin[0], 0.0);
  EXPECT_NEAR(angular_momentum(rig.state()) / angular_momentum(before), 1.0, 1e-9);
}
