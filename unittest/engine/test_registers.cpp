// SPDX-License-Identifier: GPL-2.0-only
// Tests on a CPU the code that keeps grains in registers, as a thread block of a GPU does.

#include "support/rve_run.h"

#include <algorithm>
#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

template <class Numbers> class Registers : public testing::Test {
};
TYPED_TEST_SUITE(Registers, Formats);

}    // namespace

TYPED_TEST(Registers, PlainAndGeneralProgramsGiveTheBitsOfArrays)
{
  RveRun<2> arrays = disks<TypeParam>(0.5), plain = arrays, general = arrays;
  const auto drives = calls<2>(DISK_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, VariantConfig<KernelVariant::Plain, TypeParam>>(arrays, drives[k],
                                                                         with_details);
    advance<BlockInRegisters, VariantConfig<KernelVariant::Plain, TypeParam>>(plain, drives[k],
                                                                              with_details);
    advance<BlockInRegisters, VariantConfig<KernelVariant::General, TypeParam>>(general, drives[k],
                                                                                with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(plain, arrays, KernelVariant::General);
    expect_same_bits<TypeParam>(general, arrays, KernelVariant::General);
  }
  const RveState end = state_of<TypeParam>(arrays, KernelVariant::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(Registers, FrictionlessProgramGivesTheBitsOfArraysWithACoefficientOfZero)
{
  RveRun<2> arrays = disks<TypeParam>(0.0), frictionless = arrays;
  const auto drives = calls<2>(DISK_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, VariantConfig<KernelVariant::Plain, TypeParam>>(arrays, drives[k],
                                                                         with_details);
    advance<BlockInRegisters, VariantConfig<KernelVariant::Frictionless, TypeParam>>(
        frictionless, drives[k], with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(frictionless, arrays, KernelVariant::General);
  }
  const RveState end = state_of<TypeParam>(arrays, KernelVariant::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(Registers, SteeredAndGeneralProgramsGiveTheBitsOfArraysWithAServo)
{
  RveRun<2> arrays = disks<TypeParam>(0.5), steered = arrays, two = arrays, general = arrays;
  const SteeringRecord<2> steering = servo_of_disks();
  for (const int substeps : {10, 300, 1, 0, 70}) {
    SCOPED_TRACE(substeps);
    const DriveRecord<2> drive = shear<2>(0.0, substeps, DISK_DT);
    const bool with_details = substeps == 300;

    advance<BlockSerial, VariantConfig<KernelVariant::Steered, TypeParam>>(
        arrays, drive, with_details, 0.0, false, steering);
    advance<BlockInRegisters, VariantConfig<KernelVariant::Steered, TypeParam>>(
        steered, drive, with_details, 0.0, false, steering);
    advance<BlockOfTwo, VariantConfig<KernelVariant::Steered, TypeParam>>(two, drive, with_details,
                                                                          0.0, false, steering);
    advance<BlockInRegisters, VariantConfig<KernelVariant::General, TypeParam>>(
        general, drive, with_details, 0.0, false, steering);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(steered, arrays, KernelVariant::General);
    expect_same_bits<TypeParam>(two, arrays, KernelVariant::General);
    expect_same_bits<TypeParam>(general, arrays, KernelVariant::General);
  }
  const RveState end = state_of<TypeParam>(arrays, KernelVariant::General);
  EXPECT_GT(end.counters.rebuilds, 3);
  EXPECT_NE(end.servo_velocity_gradient(0, 0), 0.0);
  // Without bookkeeping, energies stay zero.
  EXPECT_EQ(end.energy.friction, 0.0);
  EXPECT_EQ(end.energy.work, 0.0);
}

// In `double` the histories of pairs are streamed from memory in rows.
template <class Numbers> class SpheresInRegisters : public ::testing::Test {
};
TYPED_TEST_SUITE(SpheresInRegisters, Formats);

TYPED_TEST(SpheresInRegisters, GiveTheBitsOfArrays)
{
  using Config = VariantConfig<KernelVariant::Spheres, TypeParam>;
  RveRun<3> arrays = run_of<TypeParam>(disordered_spheres(spheres_material(), 7, 1),
                                       KernelVariant::Spheres),
            registers = arrays;
  const auto drives = calls<3>(SPHERE_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, Config>(arrays, drives[k], with_details);
    advance<BlockInRegisters, Config>(registers, drives[k], with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    EXPECT_GT(arrays.answer.num_contacts, 100);
    expect_same_bits<TypeParam>(registers, arrays, KernelVariant::Spheres);
  }
  const Spheres end = state_of<TypeParam>(arrays, KernelVariant::Spheres);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(SpheresInRegisters, UniformRegistersGiveTheBitsOfArrays)
{
  using Config = VariantConfig<KernelVariant::PlainSpheres, TypeParam>;
  static_assert(KernelTraits<BlockOfUniforms, Config>::uniform_constants);
  RveRun<3> arrays = run_of<TypeParam>(disordered_spheres(spheres_material(), 7, 1),
                                       KernelVariant::Spheres),
            uniforms = arrays;

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    SCOPED_TRACE(drive.substeps);
    advance<BlockSerial, Config>(arrays, drive, false);
    advance<BlockOfUniforms, Config>(uniforms, drive, false);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(uniforms, arrays, KernelVariant::Spheres);
  }
}

template <class Numbers, KernelVariant variant>
void expect_that_spheres_may_pass_by(const Material &material, bool with_ledger = false,
                                     const SteeringRecord<3> &steering = SteeringRecord<3>())
{
  using Config = VariantConfig<variant, Numbers>;
  constexpr KernelVariant memory = VariantTraits<variant>::prepared_like;
  RveRun<3> stay = run_of<Numbers>(disordered_spheres(material, 7, 1), memory), pass = stay;

  for (const bool with_details : {false, true})
    for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
      SCOPED_TRACE(drive.substeps);
      advance<BlockSerial, Config>(stay, drive, with_details, 0.0, with_ledger, steering);
      advance<BlockSerial, InMemory<Config>>(pass, drive, with_details, 0.0, with_ledger, steering);

      EXPECT_EQ(stay.answer.status & status::Fatal, 0u) << describe_status(stay.answer.status);
      EXPECT_GT(stay.answer.num_contacts, 100);
      expect_same_bits<Numbers>(pass, stay, memory);
    }
  EXPECT_GT(state_of<Numbers>(stay, memory).counters.rebuilds, 10);
}

/// Returns a material whose contacts are as stiff as the linear springs if spheres of 4 mm overlap
/// by 1 % of their radius.
Material hertz_material(ContactLaw law)
{
  Material material = spheres_material();
  material.law = law;
  const double contact_radius = std::sqrt(2e-3 * 4e-5);
  material.hertz_stiffness = material.normal_stiffness / contact_radius;
  material.mindlin_stiffness = material.tangential_stiffness / contact_radius;
  return material;
}

SteeringRecord<3> servo_of_spheres()
{
  SteeringRecord<3> steering = SteeringRecord<3>();
  steering.controlled[0] = steering.controlled[4] = 1;
  steering.stress_goal[0] = steering.stress_goal[4] = -1e5;
  steering.velocity_gradient[1] = 100.0;
  steering.velocity_gradient[8] = -10.0;
  steering.servo_gain = default_servo_gain(disordered_spheres(spheres_material(), 7, 1));
  steering.servo_max_rate = 100.0;
  return steering;
}

TYPED_TEST(SpheresInRegisters, StreamedSpheresHaveTheBitsOfResidentOnes)
{
  expect_that_spheres_may_pass_by<TypeParam, KernelVariant::PlainSpheres>(spheres_material());
}

TYPED_TEST(SpheresInRegisters, StreamedSpheresWithAServoHaveTheBitsOfResidentOnes)
{
  expect_that_spheres_may_pass_by<TypeParam, KernelVariant::SteeredSpheres>(
      spheres_material(), false, servo_of_spheres());
}

// Pairs have histories of tangential springs, rolling and twisting. Friction and dashpots dissipate
// energy. One of two runs has a servo.
TYPED_TEST(SpheresInRegisters, StreamedSpheresWithEnergyHaveTheBitsOfResidentOnes)
{
  Material material = spheres_material();
  material.normal_viscosity = 3.0;
  material.tangential_viscosity = 1.5;
  material.rolling_stiffness = material.twisting_stiffness = 0.5 * material.normal_stiffness;
  material.rolling_friction = material.twisting_friction = 0.1;
  for (const bool servo : {false, true})
    expect_that_spheres_may_pass_by<TypeParam, KernelVariant::SpheresRolling>(
        material, true, servo ? servo_of_spheres() : SteeringRecord<3>());
}

// If a pair does not touch but is within the reach of the adhesion, it loses its history before its
// force is computed.
TYPED_TEST(SpheresInRegisters, StreamedSpheresWithinReachHaveTheBitsOfResidentOnes)
{
  Material material = hertz_material(ContactLaw::Dmt);
  material.surface_energy = 5.0;
  material.adhesion_reach = 4e-4;
  expect_that_spheres_may_pass_by<TypeParam, KernelVariant::SphereDmt>(material, true);
}

// Without rescaling (mindlin/force), the engine uses a kernel variant that stores no contact radii
// between steps.
TYPED_TEST(SpheresInRegisters, HertzWithStoredForcesHasTheBitsOfTheGeneralProgram)
{
  using All = VariantConfig<KernelVariant::SphereHertz, TypeParam>;
  using Own = VariantConfig<KernelVariant::SphereMindlinForce, TypeParam>;
  Material material = hertz_material(ContactLaw::Hertz);
  material.mindlin_displacement = 0.0;
  RveRun<3> all = run_of<TypeParam>(disordered_spheres(material, 7, 1), KernelVariant::SphereHertz),
            arrays = all, registers = all, two = all, uniforms = all, pass = all;

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    SCOPED_TRACE(drive.substeps);
    advance<BlockSerial, All>(all, drive, false);
    advance<BlockSerial, Own>(arrays, drive, false);
    advance<BlockInRegisters, Own>(registers, drive, false);
    advance<BlockOfTwo, Own>(two, drive, false);
    advance<BlockOfUniforms, Own>(uniforms, drive, false);
    advance<BlockSerial, InMemory<Own>>(pass, drive, false);

    EXPECT_EQ(all.answer.status & status::Fatal, 0u) << describe_status(all.answer.status);
    for (const RveRun<3> *run : {&arrays, &registers, &two, &uniforms, &pass})
      expect_same_bits<TypeParam>(*run, all, KernelVariant::SphereHertz);
    const Spheres now = state_of<TypeParam>(registers, KernelVariant::SphereHertz);
    EXPECT_GT(std::count_if(now.pairs.begin(), now.pairs.end(),
                            [](const PairOf<3> &pair) { return pair.contact_radius > 0.0; }),
              100);
  }
}

TEST(TwoSpheresOfAThread, AddLossesOfExtraPairsInTheOrderOfGrains)
{
  using Config = VariantConfig<KernelVariant::Spheres, MixedNumbers>;
  const Spheres begin = disordered_spheres(spheres_material(), 6, 2);
  RveRun<3> arrays = run_of<MixedNumbers>(begin, KernelVariant::Spheres), two = arrays;
  // With this skin there are more pairs than grains can own.
  const double skin = 2.0 * *std::min_element(begin.radius.begin(), begin.radius.end());

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    advance<BlockSerial, Config>(arrays, drive, false, skin, true);
    advance<BlockOfTwo, Config>(two, drive, false, skin, true);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<MixedNumbers>(two, arrays, KernelVariant::Spheres);
  }
  const Spheres end = state_of<MixedNumbers>(arrays, KernelVariant::Spheres);
  EXPECT_GT(end.pairs.size(), static_cast<std::size_t>(4 * end.num_grains()));
  EXPECT_GT(end.energy.friction, 0.0);
}
