// SPDX-License-Identifier: GPL-2.0-only
// Tests RVEs of spheres in the whole engine.

#include "engine/test_states.h"
#include "rve/core/pi.h"
#include "rve/engine/engine.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "rve/engine/stability.h"
#include "rve/physics/grain_shape.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

using Vector = Vec<double, 3>;

constexpr Format FORMATS[] = {Format::Double, Format::Mixed, Format::Fast};

}    // namespace

TEST(SphereCollision, GrossSlidingTransfersTheCoulombImpulse)
{
  // The contact slides throughout: v_t > 7/2 mu (1 + e) v_n.
  const double r = 0.005, v_n = 0.05, v_t = 0.02, mu = 0.02;
  Material material = spheres_material();
  material.local_damping = 0.0;
  material.friction = mu;
  material.tangential_stiffness = 100.0 * material.normal_stiffness;    // reaches the limit at once
  Spheres state = spheres(material, 0.1 * Tensor3::identity(), {r, r},
                          {0.05 - r, 0.05, 0.05, 0.05 + r, 0.05, 0.05});
  // The direction of sliding is perpendicular to the normal and oblique to the other axes.
  state.velocity = {0.5 * v_n,  0.5 * 0.6 * v_t,  0.5 * 0.8 * v_t,
                    -0.5 * v_n, -0.5 * 0.6 * v_t, -0.5 * 0.8 * v_t};
  const double m = sphere_mass(material, r);
  const double duration = kPi / std::sqrt(material.normal_stiffness / (0.5 * m));

  for (const Format format : FORMATS) {
    SphereRig rig(state, sphere_options(format));
    rig.strain(Tensor3::zero(), duration / 4000.0, 6000);
    const Spheres after = rig.state();

    const double impulse = 0.5 * m * 2.0 * v_n * mu;    // mu m* (1 + e) v_n with e = 1
    // The error comes from the steps within which the contact starts and ends.
    const double error = format == Format::Fast ? 2e-3 : 1e-3;
    EXPECT_NEAR(after.velocity[0], -0.5 * v_n, error * v_n) << to_string(format);
    EXPECT_NEAR(after.velocity[1], 0.6 * (0.5 * v_t - impulse / m), error * v_t);
    EXPECT_NEAR(after.velocity[2], 0.8 * (0.5 * v_t - impulse / m), error * v_t);
    // Both spheres get the same spin about n x t, w = r J / (2/5 m r^2), with the impulse J.
    const double turn = 2.5 * impulse / (m * r);
    for (int grain = 0; grain < 2; ++grain) {
      EXPECT_NEAR(after.spin[3 * grain], 0.0, error * turn);
      EXPECT_NEAR(after.spin[3 * grain + 1], 0.8 * turn, error * v_t / r);
      EXPECT_NEAR(after.spin[3 * grain + 2], -0.6 * turn, error * v_t / r);
    }
    // Momentum is conserved to the last bit.
    for (int a = 0; a < 3; ++a)
      EXPECT_EQ(after.velocity[a], -after.velocity[3 + a]) << to_string(format);
  }
}

TEST(FaceCentredCubic, HasThePressureOfItsContacts)
{
  const double r = 0.005, overlap = 1e-3 * r;
  const Material material = spheres_material();
  const Spheres state = face_centred_cubic(material, 4, r, overlap);
  const double force = material.normal_stiffness * overlap, distance = 2.0 * r - overlap;
  const double pressure = 2.0 * std::sqrt(2.0) * force / (distance * distance);

  for (const Format format : FORMATS) {
    const ResultOf<3> result = SphereRig(state, sphere_options(format)).advance(DriveOf<3>());

    EXPECT_EQ(result.num_contacts, 6 * state.num_grains());
    // `fast` rounds the gap in fp32 to 2^-24 of a diameter. A diameter is 2000 overlaps, so that
    // the relative error is 1.2e-4. `mixed` has forces in fp32.
    const double error = format == Format::Fast ? 2e-4 : format == Format::Mixed ? 1e-6 : 1e-9;
    EXPECT_NEAR(result.mean_stress() / pressure, 1.0, error) << to_string(format);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        EXPECT_NEAR(result.stress(a, b), a == b ? -pressure : 0.0, error * pressure);
        EXPECT_NEAR(result.fabric(a, b), a == b ? 1.0 / 3.0 : 0.0, 1e-6);
      }
    EXPECT_NEAR(result.void_ratio,
                6.0 / (kPi * std::sqrt(2.0)) * std::pow(distance / (2 * r), 3) - 1.0, 1e-6);
  }
}

TEST(FaceCentredCubic, HasTheElasticConstantsOfItsLattice)
{
  const double r = 0.005, overlap = 1e-9 * r;    // negligible stress
  Material material = spheres_material();
  material.tangential_stiffness = 0.3 * material.normal_stiffness;
  const Spheres state = face_centred_cubic(material, 4, r, overlap);
  const double kn = material.normal_stiffness, kt = material.tangential_stiffness,
               distance = 2.0 * r - overlap;
  SphereRig rig(state);
  const ElasticResultOf<3> result = rig.stiffness();
  const auto &c = result.stiffness.component;

  const double root = std::sqrt(2.0);
  const double c11 = root / distance * (kn + kt), c12 = root / (2 * distance) * (kn - kt),
               c44 = root / (2 * distance) * (kn + kt);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(c[4 * a][b], a == b ? c11 : c12, 1e-8 * c11);
  // The shear strain has both components eps_xy = eps_yx, so d sigma_xy / d eps_xy = 2 C44.
  EXPECT_NEAR(c[1][3], 2.0 * c44, 1e-8 * c11);
  EXPECT_NEAR(c[2][4], 2.0 * c44, 1e-8 * c11);
  EXPECT_NEAR(c[5][5], 2.0 * c44, 1e-8 * c11);
  EXPECT_NEAR(c[1][0], 0.0, 1e-8 * c11);
}

namespace {

Spheres disordered(int m, unsigned seed)
{
  Material material = spheres_material();
  material.local_damping = 0.0;
  return disordered_spheres(material, m, seed);
}

constexpr double DT = 2e-6;

Tensor3 shear()
{
  return Tensor3{{-2.0, 3.0, 1.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.5}};
}

}    // namespace

TEST(Spheres, ConserveMomentumWhateverTheyDo)
{
  for (const Format format : FORMATS) {
    const Spheres before = disordered(6, 1);
    SphereRig rig(before, sphere_options(format));
    for (int call = 0; call < 5; ++call) rig.strain(shear(), DT, 200);
    const Spheres after = rig.state();

    double largest = 0.0;
    Vector total = Vector::zero();
    for (int i = 0; i < after.num_grains(); ++i) {
      const double m = sphere_mass(after.material, after.radius[i]);
      for (int a = 0; a < 3; ++a) {
        total[a] += m * (after.velocity[3 * i + a] - before.velocity[3 * i + a]);
        largest = std::fmax(largest, std::fabs(m * after.velocity[3 * i + a]));
      }
    }
    // Velocities are rounded in each step.
    const double error = (format == Format::Double ? 1e-13 : 2e-4) * largest;
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(total[a], 0.0, error) << to_string(format);
  }
}

namespace {

/// Returns a density for which the engine computes exactly `mass`, a power of two, as the mass of a
/// sphere.
double density_for_mass(double radius, double mass)
{
  const double of_unit_density = grain_volume<3>(radius);
  double density = mass / of_unit_density;
  for (int k = 0; k < 4 && density * grain_volume<3>(1.0) * radius * radius * radius != mass; ++k)
    density = std::nextafter(density, k < 2 ? 0.0 : 1e9);
  EXPECT_EQ(density * grain_volume<3>(1.0) * radius * radius * radius, mass);
  return density;
}

}    // namespace

// Contact forces are integers: one grain of a contact gains what the other loses. If masses and
// time step are powers of two, kicks are exact too, as long as velocities fit the mantissa.
TEST(Spheres, ConserveMomentumToTheLastBitWithMassesAndAStepOfPowersOfTwo)
{
  Spheres state = disordered(5, 8);
  const double radius = 0x1p-8;
  for (double &r : state.radius) r = radius;
  state.cell = (5 * 1.95 * radius) * Tensor3::identity();
  state.material.density = density_for_mass(radius, 0x1p-11);
  for (double &v : state.velocity) v = std::ldexp(std::round(std::ldexp(v, 20)), -20);
  // The force unit is so coarse that sums of forces and velocities fit 53 bits: 100 N are 2^52/2^14
  // units.
  state.largest_contact_force = 100.0 * 0x1p14;
  SphereRig rig(state);
  const ResultOf<3> last = rig.strain(Tensor3{{0, 0.3, 0, 0, 0, -0.2, 0.1, 0, 0}}, 0x1p-19, 500);
  const Spheres after = rig.state();

  EXPECT_GT(last.num_contacts, 100);
  EXPECT_GT(last.sliding_fraction, 0.0);
  for (int a = 0; a < 3; ++a) {
    // long doubles make the sums exact
    long double gained = 0.0L, moved = 0.0L;
    for (int i = 0; i < state.num_grains(); ++i) {
      gained += static_cast<long double>(after.velocity[3 * i + a]) - state.velocity[3 * i + a];
      moved += std::fabs(after.velocity[3 * i + a] - state.velocity[3 * i + a]);
    }
    EXPECT_GT(moved, 0.1L);
    EXPECT_EQ(gained, 0.0L);
  }
}

// The shear is slow, so that friction, and not impacts, dissipates the energy.
TEST(Spheres, WorkOfShearGoesIntoSpringsFrictionDampingAndMotion)
{
  PackingRecipe recipe;
  recipe.material = spheres_material();
  recipe.num_grains = 100;
  recipe.radius_min = 0.004;
  recipe.radius_max = 0.006;
  recipe.pressure = 1e5;
  const Spheres packing = generate_packing(recipe, *make_engine<3>(sphere_options(Format::Mixed)));
  for (const Format format : FORMATS) {
    Options options = sphere_options(format);
    options.track_energy = true;
    SphereRig rig(packing, options);
    const ResultOf<3> first = rig.advance(DriveOf<3>());
    const double dt = 0.5 * stable_time_step(packing);
    ResultOf<3> last;
    for (int call = 0; call < 10; ++call)    // to 2 %
      last = rig.strain(Tensor3{{0, 0.2, 0, 0, 0, 0, 0, 0, 0}}, dt, static_cast<int>(0.01 / dt));

    const double stored =
        last.kinetic_energy + last.elastic_energy - first.kinetic_energy - first.elastic_energy;
    const double residual =
        last.energy.work - (stored + last.energy.friction + last.energy.local_damping);
    EXPECT_GT(last.sliding_fraction, 0.05);
    EXPECT_GT(last.energy.friction, 0.2 * last.energy.work);
    EXPECT_LT(std::fabs(residual), 1e-3 * last.energy.work) << to_string(format);
  }
}

TEST(Spheres, BalanceTheirEnergy)
{
  Options options = sphere_options(Format::Double);
  options.track_energy = true;
  Spheres state = disordered(6, 2);
  state.material.local_damping = 0.2;
  state.material.normal_viscosity = 2.0;
  state.material.tangential_viscosity = 1.0;
  SphereRig rig(state, options);
  const ResultOf<3> first = rig.advance(DriveOf<3>());
  ResultOf<3> last;
  for (int call = 0; call < 5; ++call) last = rig.strain(shear(), DT, 200);

  const double gained =
      last.kinetic_energy + last.elastic_energy - first.kinetic_energy - first.elastic_energy;
  const double lost = last.energy.friction + last.energy.local_damping + last.energy.viscous;
  EXPECT_GT(last.energy.friction, 0.0);
  EXPECT_GT(last.energy.viscous, 0.0);
  EXPECT_NEAR(last.energy.work, gained + lost, 0.01 * (std::fabs(last.energy.work) + lost));
}

namespace {

/// Deforms a packing, and the same packing in a rotated frame. Transforms both stresses to the same
/// frame, and returns their largest difference divided by the mean stress.
double difference_of_a_turned(const Spheres &plain)
{
  const Tensor3 turn = spatial_rotation({{0.7, -0.4, 1.1}});
  Spheres turned = plain;
  turned.cell = turn * plain.cell;
  for (int i = 0; i < plain.num_grains(); ++i) {
    const Vector c{{plain.velocity[3 * i], plain.velocity[3 * i + 1], plain.velocity[3 * i + 2]}},
        w{{plain.spin[3 * i], plain.spin[3 * i + 1], plain.spin[3 * i + 2]}};
    const Vector tc = turn * c, tw = turn * w;
    for (int a = 0; a < 3; ++a) {
      turned.velocity[3 * i + a] = tc[a];
      turned.spin[3 * i + a] = tw[a];
    }
  }
  SphereRig here(plain), there(turned);
  ResultOf<3> one, other;
  for (int call = 0; call < 3; ++call) {
    one = here.strain(shear(), DT, 100);
    other = there.strain(turn * shear() * transpose(turn), DT, 100);
  }

  const Tensor3 difference = other.stress - turn * one.stress * transpose(turn);
  double largest = 0.0;
  for (const double component : difference.component)
    largest = std::max(largest, std::fabs(component));
  return largest / std::fabs(one.mean_stress());
}

}    // namespace

TEST(Spheres, ResponseDoesNotDependOnTheOrientation)
{
  EXPECT_LT(difference_of_a_turned(disordered(6, 3)), 1e-9);
}

TEST(Spheres, OnlyDampingAlongAxesDependsOnTheOrientation)
{
  Spheres state = disordered(6, 3);
  state.material.local_damping = 0.3;
  EXPECT_GT(difference_of_a_turned(state), 1e-5);
  state.material.objective_damping = 1.0;
  EXPECT_LT(difference_of_a_turned(state), 1e-9);
}

TEST(Spheres, ComeToRestWithObjectiveDampingAsWithCundalls)
{
  // Velocities of a packing without forces decay, and the lost energy is counted.
  Options options = sphere_options(Format::Double);
  options.track_energy = true;
  double kinetic[2];
  for (const bool objective : {false, true}) {
    Spheres state = disordered(6, 2);
    state.material.friction = 0.0;
    state.material.local_damping = 0.4;
    state.material.objective_damping = objective ? 1.0 : 0.0;
    SphereRig rig(state, options);
    const ResultOf<3> first = rig.advance(DriveOf<3>());
    const ResultOf<3> last = rig.strain(Tensor3::zero(), DT, 12000);
    const double lost = last.energy.local_damping;
    EXPECT_NEAR(first.kinetic_energy + first.elastic_energy,
                last.kinetic_energy + last.elastic_energy + lost, 0.01 * lost);
    kinetic[objective] = last.kinetic_energy;
    EXPECT_LT(last.kinetic_energy, 5e-4 * lost);
  }
  EXPECT_LT(kinetic[1], 10.0 * kinetic[0]);
}

TEST(Spheres, KeepTheirStressThroughARigidRotationAboutAnyAxis)
{
  // The lattice is at rest under pressure and shear stress. In the rotation, tangential forces
  // rotate with their contacts, also about the normals.
  Spheres state = face_centred_cubic(spheres_material(), 3, 0.005, 2e-6);
  state.material.local_damping = 0.5;
  SphereRig prepared(state);
  const Tensor3 shearing{{0.0, 1.0, 0.4, 0.0, 0.0, -0.7, 0.0, 0.0, 0.0}};
  prepared.strain(shearing, DT, 50);    // a strain of 1e-4; contacts slide at twice this strain
  prepared.strain(Tensor3::zero(), DT, 20000);
  Spheres still = prepared.state();
  const Vector axis{{0.48, 0.6, 0.64}};
  const int steps = 20000;
  const double rate = 0.5 * kPi / (steps * DT);
  for (int i = 0; i < still.num_grains(); ++i)
    for (int a = 0; a < 3; ++a) {
      still.velocity[3 * i + a] = 0.0;
      still.spin[3 * i + a] = rate * axis[a];
    }
  const Tensor3 spin{{0.0, -rate * axis[2], rate * axis[1], rate * axis[2], 0.0, -rate * axis[0],
                      -rate * axis[1], rate * axis[0], 0.0}};
  SphereRig rig(still);
  const ResultOf<3> before = rig.advance(DriveOf<3>());
  const ResultOf<3> after = rig.strain(spin, DT, steps);

  const Tensor3 turn = spatial_rotation((0.5 * kPi) * axis);
  const Tensor3 expected = turn * before.stress * transpose(turn);
  EXPECT_GT(std::fabs(before.stress(0, 1)), 0.1 * before.mean_stress());
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      EXPECT_NEAR(after.stress(a, b), expected(a, b), 1e-4 * before.mean_stress());
}

TEST(Spheres, HaveTheSameStateAfterARecord)
{
  SphereRig rig(disordered(6, 5));
  rig.strain(shear(), DT, 300);
  const Spheres state = rig.state();
  const std::vector<char> record = serialize(state);
  const Spheres again = deserialize<3>(record.data(), record.size());
  SphereRig one(state), other(again);
  one.strain(shear(), DT, 300);
  other.strain(shear(), DT, 300);

  EXPECT_EQ(serialize(one.state()), serialize(other.state()));
  EXPECT_THROW(deserialize<2>(record.data(), record.size()), std::exception);
}

TEST(Spheres, ContinueThroughLatticeReductions)
{
  SphereRig rig(disordered(6, 6));
  ResultOf<3> last;
  // a shear strain of 2.4
  for (int call = 0; call < 40; ++call)
    last = rig.strain(Tensor3{{0.0, 60.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}}, DT, 500);

  EXPECT_GT(last.counters.lattice_reductions, 2);
  EXPECT_GT(last.counters.rebuilds, 5);
}

TEST(Spheres, PacksGiveTheBitsOfSingleGrains)
{
  // With energy bookkeeping, the engine uses the kernel variant that computes grains one by one.
  Spheres state = disordered(7, 4);
  state.material.local_damping = 0.3;
  for (const bool objective : {false, true})
    for (const Format format : FORMATS) {
      state.material.objective_damping = objective ? 1.0 : 0.0;
      Options options = sphere_options(format);
      SphereRig packs(state, options);
      options.track_energy = true;
      SphereRig one_by_one(state, options);
      for (int call = 0; call < 3; ++call) {
        packs.strain(shear(), DT, 200);
        one_by_one.strain(shear(), DT, 200);
      }
      Spheres expected = one_by_one.state();
      expected.energy = EnergyTotals();
      EXPECT_EQ(serialize(packs.state()), serialize(expected)) << to_string(format);
      EXPECT_GT(packs.state().counters.rebuilds, 1);
    }
}
