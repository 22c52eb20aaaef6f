// SPDX-License-Identifier: GPL-2.0-only
// Macro steps of RVEs of spheres, also as the material of a plane continuum.

#include "macro/rve_constitutive.h"

#include "rve/core/error.h"
#include "rve/engine/finite_strain.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

using macro::MacroStepOptions;
using rve::Tensor2;
using rve::Tensor3;
using namespace rve_test;

namespace {

using Points = macro::RvePointsOf<3>;
using Drive = rve::DriveOf<3>;
using Vector = rve::Vec<double, 3>;

constexpr double DT = 4e-6, RADIUS = 0.005;

Points points_of(const Spheres &state, int count, std::vector<int> &slots,
                 const MacroStepOptions &macro = MacroStepOptions(), bool with_shadows = false)
{
  Points points(rve::make_engine<3>(sphere_options(rve::Format::Mixed)),
                with_shadows ? rve::make_engine<3>(sphere_options(rve::Format::Mixed)) : nullptr,
                macro);
  slots = points.add(std::vector<const Spheres *>(count, &state));
  return points;
}

/// Returns a face-centred cubic array under pressure with overlaps of a thousandth of the radius.
Spheres pressed_lattice()
{
  return face_centred_cubic(spheres_material(), 2, RADIUS, 1e-3 * RADIUS);
}

Spheres packing()
{
  return disordered_spheres(spheres_material(), 6, 1);
}

MacroStepOptions adaptive()
{
  MacroStepOptions macro;
  macro.adaptive = rve::AdaptiveSubsteps{1e-5, 1e-2, 1000};
  return macro;
}

MacroStepOptions quiescent_steps()
{
  MacroStepOptions macro = adaptive();
  macro.quiescent_strain = 1e-4;
  return macro;
}

Drive drive_of(const Tensor3 &deformation, int substeps = 20)
{
  Drive drive;
  drive.dt = DT;
  drive.substeps = substeps;
  drive.deformation = deformation;
  return drive;
}

std::vector<Drive> shears()
{
  std::vector<Drive> drives;
  for (int k = 0; k < 3; ++k)
    drives.push_back(Drive::constant_velocity_gradient(
        Tensor3{{-0.1 * (k + 1), 0.3, 0.1, 0.0, -0.1, -0.2, 0.0, 0.0, 0.05 * k}}, DT, 20));
  return drives;
}

template <class T> bool same_bits(const T &a, const T &b)
{
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}    // namespace

TEST(PointsOfSpheres, ContinueFromTheirRecordBitForBit)
{
  std::vector<int> slots, others;
  Points points = points_of(packing(), 3, slots, quiescent_steps());
  Points next = points_of(packing(), 0, others, quiescent_steps());
  std::vector<Drive> drives = shears();
  drives[1] = drive_of(Tensor3::identity());    // comes to rest and is finally quiescent
  for (int step = 0; step < 5; ++step) points.advance(slots, drives, false);

  for (const int slot : slots) {
    const std::vector<double> record = points.record(slot);
    EXPECT_EQ(static_cast<int>(record.size()), points.record_size(slot));
    EXPECT_LE(points.record_size(slot), points.record_bound(slot));
    others.push_back(next.add_record(record.data(), record.size()));
  }
  for (int step = 0; step < 5; ++step) {
    points.advance(slots, drives, false);
    next.advance(others, drives, step % 2 == 0);
  }

  for (std::size_t k = 0; k < slots.size(); ++k) {
    EXPECT_TRUE(same_bits(points.stress(slots[k]), next.stress(others[k])));
    EXPECT_EQ(rve::serialize(points.state(slots[k])), rve::serialize(next.state(others[k])));
    EXPECT_EQ(points.point(slots[k]).contacts, next.point(others[k]).contacts);
  }
}

TEST(PointsOfSpheres, RefuseARecordOfDisksAndOneWithAFlippedBit)
{
  std::vector<int> slots;
  Points points = points_of(pressed_lattice(), 1, slots);
  rve::Options options = sphere_options();
  options.contacts.dimension = 2;
  macro::RvePoints disks(rve::make_engine(options), nullptr, MacroStepOptions());
  const rve::RveState two = two_disks(1e-6);
  const std::vector<double> of_disks = disks.record(disks.add({&two})[0]);
  EXPECT_THROW(points.add_record(of_disks.data(), of_disks.size()), rve::InputError);
  std::vector<double> record = points.record(slots[0]);
  EXPECT_THROW(disks.add_record(record.data(), record.size()), rve::InputError);

  auto *byte = reinterpret_cast<unsigned char *>(record.data());
  const std::size_t bytes = record.size() * sizeof(double);
  for (std::size_t k = 0; k + 8 < bytes; k += k < 4096 ? 3 : 397) {
    byte[k] ^= 4;
    EXPECT_THROW(points.add_record(record.data(), record.size()), rve::InputError) << k;
    byte[k] ^= 4;
  }
  EXPECT_EQ(points.size(), 1);
}

TEST(PointsOfSpheres, QuiescentRvesUseTheRotatedStiffnessOfTheirLattice)
{
  Spheres lattice = pressed_lattice();
  lattice.material.tangential_stiffness = 0.3 * lattice.material.normal_stiffness;
  std::vector<int> slots;
  Points points = points_of(lattice, 1, slots, quiescent_steps());
  points.advance(slots, {drive_of(Tensor3::identity())});
  const Tensor3 before = points.stress(slots[0]);
  const Vector turn{{2e-5, -1e-5, 3e-5}};
  const Tensor3 strain{{1e-5, 4e-6, 0.0, 4e-6, -2e-5, 3e-6, 0.0, 3e-6, 5e-6}};
  const Tensor3 rotation = rve::spatial_rotation(turn);

  points.advance(slots, {drive_of(rotation * (Tensor3::identity() + strain))});

  ASSERT_TRUE(points.point(slots[0]).is_quiescent());
  const CubicConstants c = face_centred_constants(lattice.material, RADIUS);
  Tensor3 expected = before;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      expected(a, b) += a == b ? (c.c11 - c.c12) * strain(a, a) + c.c12 * rve::trace(strain)
                               : 2.0 * c.c44 * strain(a, b);
  expected = rotation * expected * rve::transpose(rotation);
  // The tolerance is relative to the stress that the strain causes. The rotation and stretch of
  // contact forces change this stress by a share of the order of the relative overlap.
  const double size = c.c11 * rve::norm(strain);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(points.stress(slots[0]).component[k], expected.component[k], 2e-3 * size);
  EXPECT_NEAR(points.point(slots[0]).result.void_ratio,
              (1.0 + points.point(slots[0]).rested.void_ratio) * (1.0 + rve::trace(strain)) - 1.0,
              1e-8);
}

TEST(PointsOfSpheres, ApplyTheDeferredRotationWhenTheyResume)
{
  // The RVE is quiescent during a rotation about a tilted axis. If the grains did not rotate with
  // the cell, contacts would slide afterwards.
  const Spheres lattice = pressed_lattice();
  const Vector axis{{0.48, 0.6, 0.64}};
  std::vector<int> slots;
  Points points = points_of(lattice, 1, slots, quiescent_steps());
  points.advance(slots, {drive_of(Tensor3::identity())});
  const Tensor3 before = points.stress(slots[0]);
  for (int step = 0; step < 50; ++step)
    points.advance(slots, {drive_of(rve::spatial_rotation(0.01 * axis))}, false);
  ASSERT_TRUE(points.point(slots[0]).is_quiescent());

  Tensor3 stretch = Tensor3::identity();
  stretch(2, 2) = 1.0 - 2e-4;
  points.advance(slots, {drive_of(stretch)});

  ASSERT_EQ(points.point(slots[0]).state, Points::State::Awake);
  EXPECT_EQ(points.point(slots[0]).result.sliding_fraction, 0.0);
  const Tensor3 turn = rve::spatial_rotation(0.5 * axis);
  const Tensor3 turned = turn * before * rve::transpose(turn);
  const CubicConstants c = face_centred_constants(lattice.material, RADIUS);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(points.stress(slots[0]).component[k], turned.component[k], 3.0 * c.c11 * 2e-4);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(points.point(slots[0]).result.deformation.component[k],
                (stretch * turn).component[k], 1e-9);
}

TEST(PointsOfSpheres, RotateTheStressAboutAnyAxisAtAnySpeed)
{
  // The lattice is sheared first and then bears shear stress at rest.
  Spheres lattice = pressed_lattice();
  lattice.material.local_damping = 0.7;
  for (const Vector &axis : {Vector{{1.0, 0.0, 0.0}}, Vector{{0.48, -0.6, 0.64}}})
    for (const int steps : {100, 1000}) {
      std::vector<int> slots;
      Points points = points_of(lattice, 1, slots);
      points.advance(slots, {drive_of(Tensor3{{1, 2e-4, 1e-4, 0, 1, 0, 0, 0, 1}}, 200)});
      points.advance(slots, {drive_of(Tensor3::identity(), 5000)});
      const Tensor3 still = points.stress(slots[0]);
      const double p = points.point(slots[0]).result.mean_stress();
      ASSERT_GT(std::fabs(still(0, 1)), 0.05 * p);

      points.set_options(adaptive());
      const double angle = 1.0;
      for (int step = 0; step < steps; ++step)
        points.advance(slots, {drive_of(rve::spatial_rotation((angle / steps) * axis))}, false);

      const Tensor3 turn = rve::spatial_rotation(angle * axis);
      const Tensor3 expected = turn * still * rve::transpose(turn);
      for (int k = 0; k < 9; ++k)
        EXPECT_NEAR(points.stress(slots[0]).component[k], expected.component[k], 1e-3 * p) << steps;
      EXPECT_EQ(points.point(slots[0]).result.counters.steps, 5200 + steps);
    }
}

TEST(PointsOfSpheres, AverageTheStressOfARotatingIncrement)
{
  // The lattice only rotates, so all samples have the same stress in axes that rotate with it.
  MacroStepOptions average;
  average.stress_from = macro::StressFrom::Average;
  average.stress_samples = 4;
  average.stress_spacing = 5;
  std::vector<int> slots, other_slots;
  Points points = points_of(pressed_lattice(), 1, slots, average),
         plain = points_of(pressed_lattice(), 1, other_slots);
  const Vector turn{{1e-4, 2e-4, -1e-4}};
  const double p = points.point(slots[0]).result.mean_stress();

  for (int step = 0; step < 3; ++step) {
    points.advance(slots, {drive_of(rve::spatial_rotation(turn))});
    plain.advance(other_slots, {drive_of(rve::spatial_rotation(turn))});
  }

  EXPECT_NEAR(points.point(slots[0]).result.mean_stress(), p, 1e-3 * p);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(points.point(slots[0]).result.deformation.component[k],
                plain.point(other_slots[0]).result.deformation.component[k], 1e-12);
}

TEST(PointsOfSpheres, HaveShadowsThatAgreeInQuasiStaticDeformation)
{
  std::vector<int> slots;
  Points points = points_of(pressed_lattice(), 1, slots, MacroStepOptions(), true);
  points.add_shadow(slots[0]);
  for (int step = 0; step < 20; ++step) points.advance(slots, {shears()[0]}, step % 5 == 0);

  EXPECT_GT(rve::norm(points.point(slots[0]).shadow_stress), 0.0);
  EXPECT_LT(points.point(slots[0]).shadow_deviation(), 1e-2);
}

TEST(PointsOfSpheres, TakeANewMaterial)
{
  std::vector<int> slots;
  Points points = points_of(pressed_lattice(), 2, slots);
  rve::Material stiff = points.material(slots[1]);
  stiff.normal_stiffness *= 2.0;
  stiff.density *= 4.0;
  const double p = points.point(slots[0]).result.mean_stress(), gain = points.servo_gain(slots[1]);

  points.set_materials({slots[1]}, {stiff});

  EXPECT_NEAR(points.point(slots[1]).result.mean_stress(), 2.0 * p, 1e-6 * p);
  EXPECT_NEAR(points.servo_gain(slots[1]), gain / 4.0, 1e-12 * gain);
}

TEST(SlipOfRotationOfSpheres, IsTheRotationInOneStepAndLessWhereGrainsFollow)
{
  const rve::Material material = spheres_material();
  const macro::ContactResponse<3> response(material, 2.0 * RADIUS);
  const double frequency = response.frequency(1e-3, material);
  const double all = rve::slip_of_rotation(1e-3, 1, DT, frequency);
  const double some = rve::slip_of_rotation(1e-3, 1000, DT, frequency);

  EXPECT_EQ(all, 1e-3);
  EXPECT_LT(some, 0.1 * all);
  EXPECT_GT(some, 0.0);
}

TEST(GrainSizeOfSpheres, IsTheDiameterOfEqualOnes)
{
  std::vector<int> slots;
  Points points = points_of(pressed_lattice(), 1, slots);
  EXPECT_NEAR(points.point(slots[0]).grain_size, 2.0 * RADIUS, 1e-9 * RADIUS);
}

// ---- RVEs under a continuum ---------------------------------------------------------------------

namespace {

/// Owns RVEs of spheres; slots[i] is the RVE of point i.
class Owner final : public macro::RveOwner<3> {
 public:
  Owner(const Spheres &state, int count) : points(points_of(state, count, slots)) {}

  macro::RveClock clock(double dt) const override { return {dt / 200, 200}; }
  rve::Request *begin(const std::vector<int> &atoms,
                      macro::MacroIncrementsOf<3> &increments) override
  {
    return points.begin(atoms, increments);
  }
  rve::Request *plan(const std::vector<int> &, bool, const rve::PointsOnDevice &,
                     macro::MacroIncrementsOf<3> &) override
  {
    return nullptr;
  }
  void finish() override { points.finish(); }
  bool is_as_before(const std::vector<int> &) override { return false; }
  void synchronise_ranks() override {}
  const Tensor3 &stress(int atom) const override { return points.stress(atom); }
  const Points::Point &point(int atom) const override { return points.point(atom); }
  void complete() override { points.complete(); }

  std::vector<int> slots;
  Points points;
};

/// Returns the normal stress per uniaxial strain along a direction for grains that move with the
/// mean field [stress].
double stiffness_along(const rve::AffineStiffnessOf<3> &stiffness, const Vector &direction)
{
  const Tensor3 strain = rve::dyad(direction, direction);
  return rve::dot(direction, stiffness(strain) * direction);
}

rve::AffineStiffnessOf<3> stiffness_of(const Spheres &state)
{
  const auto engine = rve::make_engine<3>(sphere_options(rve::Format::Mixed));
  std::vector<rve::ElasticResultOf<3>> results;
  engine->advance({engine->add(state)}, {drive_of(Tensor3::identity(), 0)}, results);
  return results[0].stiffness;
}

}    // namespace

TEST(SpheresUnderAPlane, PlaneStrainHasAStressAcrossThePlane)
{
  // The strain is quasi-static and so small that no contact slides.
  Spheres lattice = pressed_lattice();
  lattice.material.tangential_stiffness = 0.3 * lattice.material.normal_stiffness;
  lattice.material.local_damping = 0.7;
  Owner owner(lattice, 3);
  macro::RveConstitutive<2, 3> law(owner);
  const double p = face_centred_pressure(lattice.material, RADIUS, 1e-3 * RADIUS);
  const Tensor2 strain{{-2e-5, 6e-6, 6e-6, 5e-6}};
  const std::vector<int> some = {0, 2};
  std::vector<Tensor2> increments(3, Tensor2::identity()), stress(3, Tensor2::zero());
  for (const int k : some) increments[k] = Tensor2::identity() + strain;

  law.update(2, some.data(), increments.data(), 200 * DT, stress.data(), {});
  for (int k : some) increments[k] = Tensor2::identity();
  for (int rest = 0; rest < 20; ++rest)
    law.update(2, some.data(), increments.data(), 200 * DT, stress.data(), {});

  EXPECT_EQ(rve::norm(stress[1]), 0.0);    // the results were not requested
  const CubicConstants c = face_centred_constants(lattice.material, RADIUS);
  const double volume = rve::trace(strain);
  const double error = 5e-3 * c.c11 * rve::norm(strain);
  for (const int k : some) {
    EXPECT_NEAR(stress[k](0, 0), -p + (c.c11 - c.c12) * strain(0, 0) + c.c12 * volume, error);
    EXPECT_NEAR(stress[k](1, 1), -p + (c.c11 - c.c12) * strain(1, 1) + c.c12 * volume, error);
    EXPECT_NEAR(stress[k](0, 1), 2.0 * c.c44 * strain(0, 1), error);
    EXPECT_NEAR(owner.stress(k)(2, 2), -p + c.c12 * volume, error);
    EXPECT_EQ(owner.point(k).result.deformation(2, 2), 1.0);
  }
}

TEST(SpheresUnderASpace, AllStressComponentsAreReturned)
{
  Owner owner(pressed_lattice(), 1);
  macro::RveConstitutive<3> law(owner);
  const int first = 0;
  Tensor3 increment = Tensor3::identity(), stress = Tensor3::zero();
  increment(2, 2) = 1.0 - 1e-4;

  law.update(1, &first, &increment, 200 * DT, &stress, {});

  EXPECT_TRUE(same_bits(stress, owner.stress(0)));
  EXPECT_LT(stress(2, 2), stress(0, 0));
}

TEST(PWaveModulusOfSpheres, IsThatOfAnIsotropicLattice)
{
  // For k_n = k_t the stiffness is the same in all directions, and Voigt's bound is reached.
  const Spheres lattice = face_centred_cubic(spheres_material(), 2, RADIUS, 1e-8 * RADIUS);
  Owner owner(lattice, 1);
  const double c11 = face_centred_constants(lattice.material, RADIUS).c11;

  EXPECT_NEAR((macro::RveConstitutive<2, 3>(owner).p_wave_modulus(0)), c11, 1e-6 * c11);
  EXPECT_NEAR(macro::RveConstitutive<3>(owner).p_wave_modulus(0), c11, 1e-6 * c11);
}

TEST(PWaveModulusOfSpheres, FromATangentIsThatOfTheLattice)
{
  // For k_t = 0.3 k_n the lattice moves affinely because it is centrosymmetric. Waves along the
  // diagonal of the cube are the fastest. The bound uses k_n for k_t.
  Spheres lattice = pressed_lattice();
  lattice.material.tangential_stiffness = 0.3 * lattice.material.normal_stiffness;
  Owner owner(lattice, 2);
  macro::RveConstitutive<3> law(owner);
  const double bound = law.p_wave_modulus(0);
  const CubicConstants c = face_centred_constants(lattice.material, RADIUS);
  const double fastest = std::fmax(std::fmax(c.c11, 0.5 * (c.c11 + c.c12) + c.c44),
                                   (c.c11 + 2.0 * c.c12 + 4.0 * c.c44) / 3.0);
  macro::TangentProbesOf<3> probes(
      rve::make_engine<3>(sphere_options()),
      macro::TangentOptions::of(rve::Format::Double, macro::TangentKind::Elastic));

  const double share = law.measured_wave_share(
      {0, 1}, probes, [&](int point) { return owner.points.state(owner.slots[point]); });

  // The constants c neglect the overlap, which is 1e-3 of the radius.
  EXPECT_NEAR(share * bound, fastest, 5e-3 * fastest);
  EXPECT_LT(share, 0.9);
  law.scale_waves(share);
  EXPECT_NEAR(law.p_wave_modulus(1), share * bound, 1e-12 * bound);
  EXPECT_EQ(law.measured_wave_share({}, probes, nullptr), 0.0);
}

TEST(PWaveModulusOfSpheres, BoundsTheAffineStiffnessInAllDirections)
{
  // After compression along one axis, the fabric is larger along it.
  for (const double ratio : {0.3, 1.0}) {
    Spheres state = packing();
    state.material.tangential_stiffness = ratio * state.material.normal_stiffness;
    for (const int axis : {0, 2}) {
      Spheres pressed = state;
      pressed.cell(axis, axis) *= 0.97;
      Owner owner(pressed, 1);
      const rve::AffineStiffnessOf<3> stiffness = stiffness_of(pressed);
      const double in_space = macro::RveConstitutive<3>(owner).p_wave_modulus(0);
      const double in_plane = macro::RveConstitutive<2, 3>(owner).p_wave_modulus(0);
      double most = 0.0, most_in_plane = 0.0;
      for (int i = 0; i < 36; ++i)
        for (int j = 0; j <= 18; ++j) {
          const double phi = i * 0.1745, theta = j * 0.08727;
          const Vector n{
              {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}};
          most = std::fmax(most, stiffness_along(stiffness, n));
          if (j == 18) most_in_plane = std::fmax(most_in_plane, stiffness_along(stiffness, n));
        }
      // Radii differ. Large spheres have more contacts than the mean sphere and longer branch
      // vectors.
      constexpr double OF_RADII = 0.97;
      EXPECT_GT(in_space, OF_RADII * most) << ratio;
      EXPECT_LT(in_space, 2.5 * most) << ratio;
      EXPECT_GT(in_plane, OF_RADII * most_in_plane) << ratio;
      EXPECT_LE(in_plane, in_space * (1.0 + 1e-12)) << ratio;
    }
  }
}
