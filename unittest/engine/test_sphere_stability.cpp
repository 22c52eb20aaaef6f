// SPDX-License-Identifier: GPL-2.0-only
// Tests the largest stable time step of spheres. The tests compare frequencies with closed forms,
// run with steps slightly below and above the bound, and check the bound that an engine computes.

#include "rve/engine/stability.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double FIRST = 0.005, SECOND = 0.004;    // radii [m]

/// Returns two spheres that touch, far from their images.
Spheres two_spheres(const Material &material, double overlap)
{
  const double distance = FIRST + SECOND - overlap;
  return spheres(
      material, 0.2 * Tensor3::identity(), {FIRST, SECOND},
      {0.05, 0.05, 0.05, 0.05 + 0.48 * distance, 0.05 + 0.6 * distance, 0.05 + 0.64 * distance});
}

Material undamped_material()
{
  Material material = spheres_material();
  material.local_damping = 0.0;
  return material;
}

Options options_for(const Spheres &state)
{
  Options options = sphere_options();
  options.contacts = contacts_of(state);
  return options;
}

double engine_bound(const Spheres &state)
{
  const auto engine = make_engine<3>(options_for(state));
  std::vector<double> bounds;
  engine->bound_time_steps({engine->add(state)}, 1.0, bounds);
  return bounds[0];
}

/// Returns the kinetic energy after a number of steps of dt, divided by the initial one.
double growth_of_energy(const Spheres &state, double dt, int steps)
{
  SphereRig rig(state, options_for(state));
  const double before = rig.strain(Tensor3::zero(), dt, 0).kinetic_energy;
  return rig.strain(Tensor3::zero(), dt, steps).kinetic_energy / before;
}

/// Sets random velocities. They are so small that an unstable motion can grow by many orders of
/// magnitude before a contact opens or slides.
void disturb(Spheres &state, double speed)
{
  Random random(7);
  for (double &v : state.velocity) v = random.uniform(-speed, speed);
  for (double &w : state.spin) w = random.uniform(-speed, speed) / FIRST;
}

}    // namespace

TEST(SphereStability, TwoSpheresHaveTheClosedFormFrequencies)
{
  const double overlap = 1e-4;
  Material material = undamped_material();
  material.tangential_stiffness = 8e5;
  const double m1 = sphere_mass(material, FIRST), m2 = sphere_mass(material, SECOND);
  const auto expect_frequency = [&](double squared) {
    const Spheres state = two_spheres(material, overlap);
    EXPECT_NEAR(largest_frequency(state), std::sqrt(squared), 1e-12 * std::sqrt(squared));
  };

  // Tangential mode: w^2 = k_t (1/m_1 + 1/m_2 + a_1^2/I_1 + a_2^2/I_2), with the lever arms a and
  // the inertia I = 2 m r^2/5.
  const double arm1 = 1.0 - 0.5 * overlap / FIRST, arm2 = 1.0 - 0.5 * overlap / SECOND;
  expect_frequency(8e5 * ((1.0 + 2.5 * arm1 * arm1) / m1 + (1.0 + 2.5 * arm2 * arm2) / m2));

  material.friction = 0.0;
  expect_frequency(1e6 * (1.0 / m1 + 1.0 / m2));

  // Rolling has w^2 = k_r R^2 (1/I_1 + 1/I_2). Twisting has w^2 = k_q (1/I_1 + 1/I_2).
  const double reduced_radius = FIRST * SECOND / (FIRST + SECOND);
  const double turning = 2.5 * (1.0 / (m1 * FIRST * FIRST) + 1.0 / (m2 * SECOND * SECOND));
  material.rolling_stiffness = 1e7;
  material.rolling_friction = 0.1;
  expect_frequency(1e7 * reduced_radius * reduced_radius * turning);

  material.twisting_stiffness = 1e3;
  material.twisting_friction = 1e-3;
  expect_frequency(1e3 * turning);
}

TEST(SphereStability, FaceCentredCubicArrayHasTheClosedFormFrequencies)
{
  const double radius = 0.004, overlap = 2e-5;
  Material material = undamped_material();
  material.tangential_stiffness = 7e5;
  const double mass = sphere_mass(material, radius), arm = 1.0 - 0.5 * overlap / radius;
  const auto expect_frequency = [&](double squared) {
    const Spheres state = face_centred_cubic(material, 4, radius, overlap);
    EXPECT_NEAR(largest_frequency(state), std::sqrt(squared), 1e-8 * std::sqrt(squared));
  };

  // All spheres rotate by the same angle theta. Each contact slips by 2 a theta times the sine of
  // the angle between normal and axis. The mean square of this sine is 2/3.
  expect_frequency(40.0 * 7e5 / mass * arm * arm);

  // Layers of the cubic array move against each other. Each sphere has eight contacts at 45 degrees
  // to the motion.
  material.friction = 0.0;
  expect_frequency(8.0 * 1e6 / mass);
}

// Spheres with equal rotations neither roll nor twist on each other. In a simple cubic array, all
// neighbours can rotate by theta in opposite directions. Each sphere then has four contacts that
// roll by 2 R theta and two contacts that twist by 2 theta.
TEST(SphereStability, SimpleCubicArrayThatRollsOrTwistsHasTheClosedFormFrequencies)
{
  const double radius = 0.004, reduced_radius = 0.5 * radius, spacing = 2.0 * radius - 2e-5;
  std::vector<double> x;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k)
        x.insert(x.end(), {(i + 0.5) * spacing, (j + 0.5) * spacing, (k + 0.5) * spacing});
  Material material = undamped_material();
  material.friction = 0.0;
  const double inertia = 0.4 * sphere_mass(material, radius) * radius * radius;
  const auto expect_frequency = [&](double squared) {
    const Spheres state = spheres(material, (4.0 * spacing) * Tensor3::identity(),
                                  std::vector<double>(64, radius), x);
    EXPECT_NEAR(largest_frequency(state), std::sqrt(squared), 1e-8 * std::sqrt(squared));
  };

  material.rolling_stiffness = 1e8;
  material.rolling_friction = 0.1;
  expect_frequency(4.0 * 2.0 * 1e8 * reduced_radius * reduced_radius / inertia);

  material.rolling_stiffness = material.rolling_friction = 0.0;
  material.twisting_stiffness = 1e3;
  material.twisting_friction = 1e-3;
  expect_frequency(2.0 * 2.0 * 1e3 / inertia);
}

TEST(SphereStability, GasIsBoundedByOneContactOfItsLightestSpheres)
{
  Material material = spheres_material();
  const Spheres gas = two_spheres(material, -1e-3);
  const double m1 = sphere_mass(material, FIRST), m2 = sphere_mass(material, SECOND);
  const double frequency = std::sqrt(3.5 * 1e6 * (1.0 / m1 + 1.0 / m2));

  EXPECT_EQ(largest_frequency(gas), 0.0);
  EXPECT_NEAR(stable_time_step(gas), 2.0 / (frequency * std::sqrt(1.3)), 1e-12 * 2.0 / frequency);
}

// Without contacts, the bound follows from a contact that can form: from the highest frequency of
// two touching spheres that slide, roll and twist on each other.
TEST(SphereStability, RotatingSpheresWithoutContactsAreBoundedByTheLightestOne)
{
  for (const double rolling_stiffness : {1e5, 2e6, 2e7})
    for (const double twisting_stiffness : {0.0, 1e3}) {
      Material material = undamped_material();
      material.rolling_stiffness = rolling_stiffness;
      material.rolling_friction = 0.2;
      material.twisting_stiffness = twisting_stiffness;
      material.twisting_friction = 1e-3;
      const Spheres pair = two_spheres(material, 1e-12);
      EXPECT_NEAR(pair_frequency(pair), largest_frequency(pair), 1e-9 * pair_frequency(pair));
    }
}

TEST(SphereStability, StepsAboveTheBoundAreUnstableAndStepsBelowAreStable)
{
  struct {
    const char *what;
    double friction, rolling, twisting;
  } const cases[] = {{"all turn alike", 0.5, 0.0, 0.0},
                     {"layers against each other", 0.0, 0.0, 0.0},
                     {"rolling", 0.5, 1e8, 0.0},
                     {"twisting", 0.5, 0.0, 1e4}};
  for (const auto &one : cases) {
    SCOPED_TRACE(one.what);
    Material material = undamped_material();
    material.friction = one.friction;
    material.rolling_stiffness = one.rolling;
    material.rolling_friction = one.rolling > 0.0 ? 0.5 : 0.0;
    material.twisting_stiffness = one.twisting;
    material.twisting_friction = one.twisting > 0.0 ? 0.01 : 0.0;
    Spheres state = face_centred_cubic(material, 3, 0.004, 1e-6);
    disturb(state, 1e-12);
    const double bound = stable_time_step(state);

    // If the step exceeds the bound by the fraction e, the energy grows by a factor of exp(2 sqrt(8
    // e)) per step.
    EXPECT_GT(growth_of_energy(state, 1.002 * bound, 100), 1e6);
    EXPECT_LT(growth_of_energy(state, 0.998 * bound, 1000), 1e3);
  }
}

TEST(SphereStability, BoundOfTheEngineIsBelow)
{
  Material material = spheres_material();
  for (const double tangential : {2e5, 1e6, 5e6})
    for (const double viscosity : {0.0, 50.0}) {
      material.tangential_stiffness = tangential;
      material.normal_viscosity = material.tangential_viscosity = viscosity;
      Spheres dense = disordered_spheres(material, 6, 4);
      for (double &r : dense.radius) r *= 1.05;
      for (const Spheres &state : {dense, face_centred_cubic(material, 3, 0.004, 1e-5)}) {
        const double exact = stable_time_step(state), bound = engine_bound(state);
        EXPECT_LE(bound, exact * (1.0 + 1e-9));
        EXPECT_GE(bound, 0.45 * exact);
      }
    }
}
