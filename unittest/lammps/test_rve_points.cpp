// The layer of fix rve that knows no LAMMPS: what an advance leaves in the results, with details and without.

#include "rve_points.h"

#include "support/packings.h"

#include <cstring>
#include <gtest/gtest.h>

using LAMMPS_NS::MacroStepOptions;
using LAMMPS_NS::RvePoints;
using rve::Tensor2;

namespace {

constexpr double DT = 5e-5;
constexpr int RVES = 3;

RvePoints three_points(std::vector<int> &slots, double skin = 0.0)
{
  rve::Options options;
  options.skin = skin;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  RvePoints points(rve::make_engine(options), nullptr, MacroStepOptions());
  const rve::RveState packing = rve_test::packing_of_400();
  slots = points.add(std::vector<const rve::RveState *>(RVES, &packing));
  return points;
}

/// Each RVE is sheared and compressed at a rate of its own.
std::vector<rve::Drive> drives(int substeps)
{
  std::vector<rve::Drive> drives(RVES);
  for (int k = 0; k < RVES; ++k)
    drives[k] =
        rve::Drive::constant_velocity_gradient({{-0.1 * (k + 1), 0.3, 0.0, 0.0}}, DT, substeps);
  return drives;
}

template <class T> bool same_bits(const T &a, const T &b)
{
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}    // namespace

TEST(RvePoints, StressHasTheSameBitsWithDetailsAndWithout)
{
  std::vector<int> slots, other_slots;
  RvePoints with = three_points(slots), without = three_points(other_slots);

  for (int step = 0; step < 5; ++step) {
    with.advance(slots, drives(20), true);
    without.advance(other_slots, drives(20), false);
    for (int k = 0; k < RVES; ++k)
      EXPECT_TRUE(same_bits(with.stress(slots[k]), without.stress(other_slots[k])));
  }
}

TEST(RvePoints, DetailsThatAreAskedForLaterAreThoseOfTheSameConfiguration)
{
  std::vector<int> slots, other_slots;
  RvePoints with = three_points(slots), without = three_points(other_slots);
  with.advance(slots, drives(40), true);
  without.advance(other_slots, drives(40), false);

  for (int k = 0; k < RVES; ++k) {
    const rve::Result &a = with.point(slots[k]).result;
    const rve::Result &b = without.point(other_slots[k]).result;
    EXPECT_TRUE(same_bits(a.stress, b.stress));
    EXPECT_TRUE(same_bits(a.cell, b.cell));
    EXPECT_TRUE(same_bits(a.deformation, b.deformation));
    EXPECT_EQ(a.void_ratio, b.void_ratio);
    EXPECT_EQ(a.coordination_number, b.coordination_number);
    EXPECT_EQ(a.num_contacts, b.num_contacts);
    EXPECT_EQ(a.num_pairs, b.num_pairs);
    EXPECT_EQ(a.num_rattlers, b.num_rattlers);
    EXPECT_TRUE(same_bits(a.counters, b.counters));
    // forces are the same to the rounding of their sums; contacts at the Coulomb limit stay there
    EXPECT_EQ(a.sliding_fraction, b.sliding_fraction);
    EXPECT_NEAR(a.elastic_energy, b.elastic_energy, 1e-6 * a.elastic_energy);
    EXPECT_NEAR(a.largest_contact_force, b.largest_contact_force, 1e-6 * a.largest_contact_force);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(a.fabric.component[c], b.fabric.component[c], 1e-9);
  }
}

TEST(RvePoints, LookingChangesNothing)
{
  std::vector<int> slots, other_slots;
  RvePoints looked_at = three_points(slots), left_alone = three_points(other_slots);

  for (int step = 0; step < 3; ++step) {
    looked_at.advance(slots, drives(20), false);
    left_alone.advance(other_slots, drives(20), false);
    looked_at.complete();
  }

  for (int k = 0; k < RVES; ++k) {
    EXPECT_TRUE(same_bits(looked_at.stress(slots[k]), left_alone.stress(other_slots[k])));
    EXPECT_EQ(rve::serialize(looked_at.state(slots[k])),
              rve::serialize(left_alone.state(other_slots[k])));
  }
}

TEST(RvePoints, ImagesWithLongListsOfPairsAreWithinTheirBound)
{
  // lists take most of the image: the bound must know how large a pair is
  std::vector<int> slots;
  RvePoints points = three_points(slots, 0.01);
  points.advance(slots, drives(20));

  const rve::Result &result = points.point(slots[1]).result;
  ASSERT_GT(result.num_pairs, 4 * result.num_grains);
  EXPECT_LE(points.image_size(slots[1]), points.image_bound(slots[1]));
}

TEST(RvePoints, AnImageHoldsACompleteResult)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots);
  points.advance(slots, drives(20), false);

  const std::vector<double> image = points.image(slots[1]);

  EXPECT_LE(static_cast<int>(image.size()), points.image_bound(slots[1]));
  const int again = points.add_image(image.data());
  EXPECT_FALSE(points.point(again).stale);
  EXPECT_TRUE(same_bits(points.point(again).result.fabric, points.point(slots[1]).result.fabric));
}
