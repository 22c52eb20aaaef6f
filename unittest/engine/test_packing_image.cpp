// SPDX-License-Identifier: GPL-2.0-only
// Tests images of packings, which are mirrored or rotated packings. If the deformation is mirrored
// or rotated in the same way, the stress must be mirrored or rotated, too.

#include "oracle/love_sum.h"
#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/packing_image.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

/// Returns the paper's packing after 1 % of shear, with tangential forces at all contacts,
/// velocities, spins, a list and a tilted cell.
RveState sheared_packing(Format format, double rolling_friction)
{
  RveState packing = paper_packing();
  packing.material.rolling_stiffness = 5e5;
  packing.material.rolling_friction = rolling_friction;
  RveRig rig(packing, cpu_options(format));
  rig.strain(gradient(0, 1, 0.5) + gradient(1, 1, -0.05), 5e-5, 200, 2);
  return rig.state();
}

Tensor2 seen_in(int image, const Tensor2 &tensor)
{
  const Tensor2 q = image_rotation(image);
  return q * tensor * transpose(q);
}

int image_with(const Tensor2 &q)
{
  for (int k = 0; k < NUM_IMAGES; ++k)
    if (components(image_rotation(k)) == components(q)) return k;
  return -1;
}

/// Returns true for rotations by 0 and 180 degrees and for mirrors along the axes. These images
/// keep the order of the terms in every sum. The other images exchange x and y.
bool keeps_axes(int image)
{
  return image % 2 == 0;
}

constexpr Format FORMATS_OF_64_BITS[] = {Format::Double, Format::Mixed};

}    // namespace

TEST(PackingImage, NumbersAreTurnsAndTheirMirrorImages)
{
  EXPECT_EQ(components(image_rotation(0)), (std::vector<double>{1, 0, 0, 1}));
  EXPECT_EQ(components(image_rotation(1)),
            (std::vector<double>{0, -1, 1, 0}));    // counter-clockwise
  EXPECT_EQ(components(image_rotation(4)), (std::vector<double>{-1, 0, 0, 1}));    // x reversed
  for (int k = 0; k < NUM_IMAGES; ++k) {
    EXPECT_EQ(determinant(image_rotation(k)), k < 4 ? 1.0 : -1.0);
    const Tensor2 next = image_rotation(1) * image_rotation(k);
    EXPECT_EQ(components(next), components(image_rotation((k + 1) % 4 + k / 4 * 4)));
  }
}

TEST(PackingImage, ImagesOfImagesAreImagesToTheLastBit)
{
  const RveState state = crowded_state(40, 7);    // no member is zero or round

  for (int first = 0; first < NUM_IMAGES; ++first)
    for (int second = 0; second < NUM_IMAGES; ++second) {
      const int both = image_with(image_rotation(second) * image_rotation(first));
      ASSERT_GE(both, 0);
      EXPECT_EQ(serialize(image_of(image_of(state, first), second)),
                serialize(image_of(state, both)))
          << first << ", then " << second;
    }
  EXPECT_EQ(serialize(image_of(state, 0)), serialize(state));
}

TEST(PackingImage, GrainsAreAtTheirMirrorImages)
{
  const RveState state = crowded_state(40, 7);
  const std::vector<double> xy = state.positions();

  for (int k = 0; k < NUM_IMAGES; ++k) {
    const RveState image = image_of(state, k);
    image.check();
    const Tensor2 q = image_rotation(k), to_fractional = inverse(image.cell);
    const std::vector<double> image_xy = image.positions();
    for (int i = 0; i < state.num_grains(); ++i) {
      const Vec<double, 2> shown = q * Vec<double, 2>{{xy[2 * i], xy[2 * i + 1]}};
      // the same position modulo the lattice
      const Vec<double, 2> apart = to_fractional *
          Vec<double, 2>{{image_xy[2 * i] - shown[0], image_xy[2 * i + 1] - shown[1]}};
      EXPECT_NEAR(apart[0], std::round(apart[0]), 1e-14);
      EXPECT_NEAR(apart[1], std::round(apart[1]), 1e-14);
    }
  }
}

TEST(PackingImage, UprightCellStaysUpright)
{
  const RveState packing = paper_packing();

  for (int k = 0; k < NUM_IMAGES; ++k) {
    const RveState image = image_of(packing, k);
    EXPECT_GT(image.cell(0, 0), 0.0);
    EXPECT_GT(image.cell(1, 1), 0.0);
    EXPECT_EQ(image.cell(0, 1), 0.0);
    EXPECT_EQ(image.cell(0, 0), packing.cell(k % 2, k % 2));
    EXPECT_EQ(image.void_ratio(), packing.void_ratio());
  }
}

TEST(SpringStress, IsLovesSumOverAllPairsAndImages)
{
  RveState packing = paper_packing();
  const LoveSum oracle = love_sum(packing);
  const double pressure = -0.5 * (oracle.stress(0, 0) + oracle.stress(1, 1));

  const Tensor2 normal_forces = spring_stress(packing);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(normal_forces.component[k], oracle.stress.component[k], 1e-12 * pressure);

  // A tangential force f on the first grain adds f t (x) l / V to the stress, with the tangent t,
  // the branch vector l and the volume V. The added stress does not depend on the owner of the
  // pair.
  const TouchingPair contact = find_contacts(packing).front();
  packing.pairs = {{contact.second, contact.first, 3.0}};
  const Tensor2 more = spring_stress(packing);
  const double volume = packing.cell_volume() * packing.material.thickness;
  const double along[2] = {-contact.normal[1], contact.normal[0]};
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b)
      EXPECT_NEAR(more(a, b) - normal_forces(a, b), 3.0 * along[a] * contact.branch[b] / volume,
                  1e-12 * pressure);
}

TEST(SpringStress, OfAnImageIsTheImageOfTheStress)
{
  RveState packing = paper_packing();
  packing.pairs = {
      {find_contacts(packing).front().first, find_contacts(packing).front().second, 3.0}};
  const Tensor2 stress = spring_stress(packing);

  for (int k = 0; k < NUM_IMAGES; ++k) {
    const Tensor2 of_image = spring_stress(image_of(packing, k)), image = image_of(stress, k);
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(of_image.component[c], image.component[c], 1e-12 * std::fabs(stress(0, 0)));
  }
}

class ResponseOfImage : public ::testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(ResponseOfImage, IsTheImageOfTheResponse)
{
  const auto [image, rolling_friction] = GetParam();
  const Tensor2 l = gradient(0, 1, 0.3) + gradient(1, 0, 0.1) + gradient(1, 1, -0.2);
  for (const Format format : FORMATS_OF_64_BITS) {
    const RveState state = sheared_packing(format, rolling_friction);
    RveRig rig(state, cpu_options(format)), seen(image_of(state, image), cpu_options(format));

    rig.strain(l, 5e-5, 50, 4);
    seen.strain(seen_in(image, l), 5e-5, 50, 4);

    const Tensor2 expected = seen_in(image, rig.result().stress);
    if (keeps_axes(image)) {
      EXPECT_EQ(components(seen.result().stress), components(expected));
      EXPECT_EQ(histories(seen.state()), histories(image_of(rig.state(), image)));
      EXPECT_EQ(rolling_histories(seen.state()), rolling_histories(image_of(rig.state(), image)));
      EXPECT_EQ(seen.state().fractional, image_of(rig.state(), image).fractional);
    } else {
      // Squared components of distances are added in another order. The tolerance is ten times the
      // epsilon of forces in the format, times 200 steps.
      const double rounding = 2000.0 * (format == Format::Double ? 0x1p-53 : 0x1p-24);
      for (int k = 0; k < 4; ++k)
        EXPECT_NEAR(seen.result().stress.component[k], expected.component[k],
                    rounding * rig.result().mean_stress());
    }
    // Distances are rounded differently. Two grains that just touch can therefore be in contact in
    // only one of the runs.
    EXPECT_NEAR(seen.result().num_contacts, rig.result().num_contacts, keeps_axes(image) ? 0 : 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Images, ResponseOfImage,
                         ::testing::Combine(::testing::Range(0, NUM_IMAGES),
                                            ::testing::Values(0.0, 0.3)));

TEST(PackingImage, StressServoControlsTheImage)
{
  const RveState packing = paper_packing();
  for (const int image : {1, 4}) {
    RveRig rig(packing), seen(image_of(packing, image));
    const auto biaxial = [&](int a) {
      Drive drive;
      drive.dt = 5e-5;
      drive.substeps = 400;
      drive.controlled[1 - a][1 - a] = true;
      drive.stress_goal(1 - a, 1 - a) = -1e5;
      drive.velocity_gradient(a, a) = -0.2;
      drive.servo_gain = 1e-4;
      return drive;
    };

    rig.advance(biaxial(1));
    seen.advance(biaxial(image == 1 ? 0 : 1));

    const Tensor2 expected = seen_in(image, rig.result().stress);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(seen.result().stress.component[k], expected.component[k],
                  1e-9 * rig.result().mean_stress());
  }
}

// Control: without the change of sign of tangential forces in a mirror, the packing is out of
// balance.
TEST(PackingImage, TangentialForcesChangeSignInAMirror)
{
  RveRig loaded(paper_packing());
  loaded.strain(gradient(0, 1, 0.05), 5e-5, 2000, 2);
  loaded.strain(Tensor2::zero(), 5e-5, 4000);
  const RveState state = loaded.state();
  RveState wrong = image_of(state, 4);
  for (Pair &pair : wrong.pairs) pair.tangential_force = -pair.tangential_force;

  EXPECT_LT(RveRig(image_of(state, 4)).evaluate().unbalanced_ratio, 1e-5);
  EXPECT_GT(RveRig(wrong).evaluate().unbalanced_ratio, 0.05);
}

TEST(PackingImage, NumbersOutOfRangeAreNamed)
{
  EXPECT_THROW(image_rotation(-1), InputError);
  try {
    image_of(paper_packing(), 8);
    FAIL();
  } catch (const InputError &error) {
    EXPECT_STREQ(error.what(), "image of a packing is 8; it must be from 0 to 7");
  }
}

namespace {

Tensor3 seen_in_space(int image, const Tensor3 &tensor)
{
  const Tensor3 q = image_rotation<3>(image);
  return q * tensor * transpose(q);
}

/// Returns spheres in motion and under load, with sliding contacts and tangential forces.
Spheres sheared_spheres()
{
  SphereRig rig(disordered_spheres(spheres_material(), 5, 3));
  rig.strain(Tensor3{{-30.0, 9.0, 3.0, -6.0, -24.0, 6.0, 1.5, 3.0, -36.0}}, 5e-6, 300);
  return rig.state();
}

}    // namespace

TEST(ImageOfSpheres, AreAllSymmetriesOfTheCube)
{
  std::vector<std::vector<double>> all;
  int mirrors = 0;
  for (int k = 0; k < NUM_IMAGES_OF<3>; ++k) {
    const Tensor3 q = image_rotation<3>(k);
    EXPECT_EQ(components(q * transpose(q)), components(Tensor3::identity()));
    mirrors += determinant(q) < 0.0;
    EXPECT_EQ(std::fabs(q(2, 2)), k < 16 ? 1.0 : 0.0);
    if (k < NUM_IMAGES) {
      const Tensor2 plane = image_rotation(k);
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) EXPECT_EQ(q(a, b), plane(a, b));
      EXPECT_EQ(q(2, 2), 1.0);
    }
    all.push_back(components(q));
  }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(mirrors, 24);
  // image 16 maps x to the position of y
  EXPECT_EQ(image_rotation<3>(16)(1, 0), 1.0);
  EXPECT_THROW(image_rotation<3>(48), InputError);
}

TEST(ImageOfSpheres, ImagesOfImagesAreImagesToTheLastBit)
{
  const Spheres state = crowded_spheres(20, 7);
  for (int first = 0; first < NUM_IMAGES_OF<3>; ++first)
    for (int second = 0; second < NUM_IMAGES_OF<3>; second += 5) {
      const Tensor3 q = image_rotation<3>(second) * image_rotation<3>(first);
      int both = 0;
      while (components(image_rotation<3>(both)) != components(q)) ++both;
      EXPECT_EQ(serialize(image_of(image_of(state, first), second)),
                serialize(image_of(state, both)))
          << first << ", then " << second;
    }
}

TEST(ImageOfSpheres, ImageOfAStrainGivesTheImageOfTheStress)
{
  const Spheres state = sheared_spheres();
  const Tensor3 l{{-1.0, 3.0, 2.0, 1.0, -2.0, 0.5, 4.0, -1.0, -3.0}};
  SphereRig rig(state);
  const ResultOf<3> result = rig.strain(l, 5e-6, 200);
  ASSERT_GT(result.num_contacts, 250);

  for (int image = 0; image < NUM_IMAGES_OF<3>; ++image) {
    SphereRig seen(image_of(state, image));
    const ResultOf<3> of_image = seen.strain(seen_in_space(image, l), 5e-6, 200);

    const Tensor3 expected = seen_in_space(image, result.stress);
    for (int k = 0; k < 9; ++k)
      EXPECT_NEAR(of_image.stress.component[k], expected.component[k], 1e-9 * result.mean_stress())
          << image;
    EXPECT_EQ(of_image.num_contacts, result.num_contacts);
  }
}

// Control: a mirror transforms spins as axial vectors and forces as vectors. The wrong
// transformation gives other stresses.
TEST(ImageOfSpheres, WrongTransformationOfSpinsOrForcesChangesTheResponse)
{
  const Spheres state = sheared_spheres();
  const auto stress_after = [](const Spheres &start) {
    return SphereRig(start).strain(Tensor3::zero(), 5e-6, 50).stress;
  };
  Spheres spins = image_of(state, 8), forces = spins;
  const Tensor3 right = stress_after(spins);
  for (double &spin : spins.spin) spin = -spin;
  for (PairOf<3> &pair : forces.pairs) pair.tangential_force = -1.0 * pair.tangential_force;

  for (const Spheres &wrong : {spins, forces}) {
    const Tensor3 stress = stress_after(wrong);
    double most = 0.0;
    for (int k = 0; k < 9; ++k)
      most = std::fmax(most, std::fabs(stress.component[k] - right.component[k]));
    EXPECT_GT(most, 1e-5 * std::fabs(trace(right)));
  }
}

TEST(ImageOfSpheres, HasTheImageOfTheStressOfItsSprings)
{
  const Spheres state = sheared_spheres();
  const Tensor3 stress = spring_stress(state);
  for (int image = 0; image < NUM_IMAGES_OF<3>; ++image) {
    const Tensor3 of_image = spring_stress(image_of(state, image)),
                  expected = image_of(stress, image);
    for (int k = 0; k < 9; ++k)
      EXPECT_NEAR(of_image.component[k], expected.component[k], 1e-12 * std::fabs(trace(stress)));
  }
}
