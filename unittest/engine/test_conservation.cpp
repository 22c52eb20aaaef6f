// SPDX-License-Identifier: GPL-2.0-only
// Conservation laws: momentum and energy.

#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <random>

using namespace rve;
using namespace rve_test;

namespace {

/// Returns equal disks on a disturbed square grid that overlap their neighbours, with velocities
/// whose sum is exactly zero.
RveState disturbed_grid(int side, const Material &material, double radius, double overlap)
{
  std::mt19937_64 random(7);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  const double distance = 2.0 * radius - overlap;
  std::vector<double> xy, radii(side * side, radius);
  for (int i = 0; i < side * side; ++i) {
    xy.push_back((i % side + 0.5) * distance + 0.5 * overlap * uniform());
    xy.push_back((i / side + 0.5) * distance + 0.5 * overlap * uniform());
  }
  RveState state = state_of(material, side * distance * Tensor2::identity(), radii, xy);
  for (int i = 0; i + 1 < side * side; i += 2)
    for (int a = 0; a < 2; ++a) {
      const double c = std::ldexp(std::round(std::ldexp(0.01 * uniform(), 20)), -20);
      state.velocity[2 * i + a] = c;
      state.velocity[2 * i + 2 + a] = -c;
    }
  return state;
}

struct Momentum {
  long double component[2];    ///< sum of m c
  long double size;            ///< sum of m |c|
};

Momentum momentum(const RveState &state)
{
  Momentum sum = {{0.0L, 0.0L}, 0.0L};
  for (int i = 0; i < state.num_grains(); ++i) {
    const long double mass = state.material.density * state.material.mass_depth * M_PI *
        state.radius[i] * state.radius[i];
    for (int a = 0; a < 2; ++a) {
      sum.component[a] += mass * state.velocity[2 * i + a];
      sum.size += mass * std::fabs(state.velocity[2 * i + a]);
    }
  }
  return sum;
}

/// Returns a density for which the engine computes exactly `mass`, a power of two, as the mass of a
/// disk of this radius.
double density_for_mass(double radius, double mass)
{
  double density = mass / (M_PI * radius * radius);
  for (int k = 0; k < 4 && density * M_PI * radius * radius != mass; ++k)
    density = std::nextafter(density, k < 2 ? 0.0 : 1e9);
  EXPECT_EQ(density * M_PI * radius * radius, mass);
  return density;
}

}    // namespace

// ---- momentum ----

// Each contact adds an integer to one grain and subtracts it from the other. The forces of a step
// therefore add up to exactly zero in every format. Only the kick c + dt F/m is rounded and can
// change the momentum. If masses and time step are powers of two, the kick is exact as long as
// forces and velocities fit the mantissa. Momentum is then conserved to the last bit.
TEST(Momentum, IsConservedToTheLastBitForPowerOfTwoMassesAndStep)
{
  Material material = paper_material();
  material.local_damping =
      0.0;    // Cundall's damping is an external force, which does not conserve momentum
  const double radius = 0x1p-8;
  material.density = density_for_mass(radius, 0x1p-3);
  RveState state = disturbed_grid(8, material, radius, 1e-5);
  // The unit of force is so coarse that sums of forces and velocities fit 53 bits. The largest
  // force, 10 N, is only 2^52 / 2^12 = 2^40 units.
  state.largest_contact_force = 10.0 * 4096.0;
  RveRig rig(state);

  rig.strain(gradient(0, 1, 0.3), 0x1p-15, 500);

  EXPECT_GT(rig.result().num_contacts, 20);
  EXPECT_NE(rig.state().velocity, state.velocity);
  const Momentum after = momentum(rig.state());
  EXPECT_GT(after.size, 0.0L);
  EXPECT_EQ(after.component[0], 0.0L);
  EXPECT_EQ(after.component[1], 0.0L);
}

// Each kick rounds the acceleration, its product with dt, and the new velocity.
TEST(Momentum, DriftsByNoMoreThanTheRoundingOfTheKicks)
{
  RveState packing = paper_packing();
  packing.material.local_damping = 0.0;
  const int steps = 2000;
  for (const Format format : ALL_FORMATS) {
    RveRig rig(packing, cpu_options(format));
    const double epsilon = format == Format::Double ? 0x1p-53 : 0x1p-24;

    double largest_size = 0.0;
    for (int call = 0; call < 20; ++call) {
      rig.strain(gradient(1, 1, -0.2), 5e-5, steps / 20);
      largest_size = std::max(largest_size, static_cast<double>(momentum(rig.state()).size));
    }

    // Rounding errors have no preferred direction. Their sum over N grains and all steps grows as
    // sqrt(N steps) m |c|, with m |c| = size / N. The factor of ten allows for unequal grains and
    // several roundings per kick.
    const Momentum after = momentum(rig.state());
    EXPECT_GT(largest_size, 1e-6);
    for (int a = 0; a < 2; ++a)
      EXPECT_LT(std::fabs(static_cast<double>(after.component[a])),
                10.0 * std::sqrt(steps / 400.0) * epsilon * largest_size)
          << to_string(format);
  }
}

// ---- energy ----

namespace {

struct EnergyBalance {
  double work, friction, damping, viscous, elastic_change, kinetic_change, sliding;

  double residual() const
  {
    return work - (friction + damping + viscous + elastic_change + kinetic_change);
  }
};

EnergyBalance balance_of(const RveState &state, const Tensor2 &l, double dt, int substeps,
                         int calls, Format format = Format::Double)
{
  Options options = cpu_options(format);
  options.track_energy = true;
  RveRig rig(state, options);
  const Result before = rig.evaluate();
  rig.strain(l, dt, substeps, calls);
  const Result &after = rig.result();
  EXPECT_EQ(after.status, status::Ok);
  EnergyBalance balance = {after.energy.work,
                           after.energy.friction,
                           after.energy.local_damping,
                           after.energy.viscous,
                           after.elastic_energy - before.elastic_energy,
                           after.kinetic_energy - before.kinetic_energy,
                           after.sliding_fraction};
  return balance;
}

}    // namespace

TEST(Energy, WorkOfShearGoesIntoSpringsFrictionDampingAndMotion)
{
  const RveState packing = paper_packing();

  const EnergyBalance balance =
      balance_of(packing, gradient(0, 1, 0.05), 5e-5, 4000, 2);    // to 2 %

  EXPECT_GT(balance.sliding, 0.03);
  EXPECT_GT(balance.friction, 0.1 * balance.work);
  EXPECT_LT(std::fabs(balance.residual()), 1e-3 * balance.work);
}

TEST(Energy, ResidualFallsWithTheTimeStep)
{
  const RveState packing = paper_packing();

  const EnergyBalance coarse = balance_of(packing, gradient(1, 1, -0.05), 8e-5, 1000, 1);
  const EnergyBalance fine = balance_of(packing, gradient(1, 1, -0.05), 4e-5, 2000, 1);

  EXPECT_LT(std::fabs(fine.residual()), 0.7 * std::fabs(coarse.residual()));
}

TEST(Energy, DashpotsDissipateTheRestOfTheBalance)
{
  RveState packing = paper_packing();
  packing.material.local_damping = 0.0;
  packing.material.normal_viscosity = 60.0;    // a tenth of the critical damping
  packing.material.tangential_viscosity = 30.0;

  const EnergyBalance balance = balance_of(packing, gradient(0, 1, 0.2), 2e-5, 2000, 1);

  EXPECT_GT(balance.viscous, 0.001 * balance.work);
  EXPECT_LT(std::fabs(balance.residual()), 1e-3 * balance.work);
}

TEST(Energy, UndampedFrictionlessGrainsKeepTheirEnergy)
{
  Material material = paper_material();
  material.local_damping = 0.0;
  material.friction = 0.0;
  const RveState state = disturbed_grid(8, material, 0.004, 1e-5);
  RveRig rig(state);
  const Result before = rig.evaluate();
  const double energy = before.elastic_energy + before.kinetic_energy;

  rig.strain(Tensor2::zero(), 2e-6, 5000);

  // The kinetic energy belongs to a time half a step before the elastic energy. The sum therefore
  // oscillates by w dt/2 ~ 1e-2 of the energy that motion and springs exchange. The exchanged
  // energy is a thirtieth of the total energy.
  EXPECT_NEAR(rig.result().elastic_energy + rig.result().kinetic_energy, energy, 3e-4 * energy);
  EXPECT_GT(rig.result().kinetic_energy, 1.5 * before.kinetic_energy);
}
