// SPDX-License-Identifier: GPL-2.0-only
// A fresh RVE that replaces a failed RVE has the stress and the deformation of the failed RVE, and
// nearly its density.

#include "macro/rve_points.h"

#include "rve/engine/finite_strain.h"
#include "support/small_packings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>
#include <vector>

using macro::MacroStepOptions;
using namespace rve_test;

namespace {

template <int D> using Points = macro::RvePointsOf<D>;
template <int D> using Matrix = rve::Tensor<double, D>;
template <int D> using States = std::vector<rve::RveStateOf<D>>;

/// Returns a dense packing and a loose one.
template <int D> const States<D> &packings()
{
  static const States<D> both = {small_packing<D>(), small_packing<D>(0.5)};
  return both;
}

template <int D> Points<D> points_of(const States<D> &states)
{
  Points<D> points(rve::make_engine<D>(options_of_dimension(D)), nullptr, MacroStepOptions());
  for (const rve::RveStateOf<D> &state : states) points.add({&state});
  return points;
}

template <int D> rve::DriveOf<D> drive_of(const Matrix<D> &gradient, int steps)
{
  return rve::DriveOf<D>::constant_velocity_gradient(gradient, DT_OF_SMALL_PACKINGS<D>, steps);
}

/// Compresses RVEs by a few per cent along the last axis, without a failure. Then compresses them
/// by half of their height in one call. All RVEs fail in this call.
template <int D> void load_and_fail(Points<D> &points, const std::vector<int> &slots)
{
  const double rate = 1e-5 / DT_OF_SMALL_PACKINGS<D>;
  Matrix<D> l = Matrix<D>::zero();
  l(D - 1, D - 1) = -rate;
  l(0, 0) = 0.8 * rate;
  for (int step = 0; step < 20; ++step)
    ASSERT_TRUE(
        points.advance(slots, std::vector<rve::DriveOf<D>>(slots.size(), drive_of<D>(l, 100)))
            .empty());
  l = Matrix<D>::zero();
  l(D - 1, D - 1) = -0.5 / (20.0 * DT_OF_SMALL_PACKINGS<D>);
  ASSERT_EQ(points.advance(slots, std::vector<rve::DriveOf<D>>(slots.size(), drive_of<D>(l, 20))),
            slots);
}

template <class Dimension> class FreshRve : public OnDeviceOf<testing::Test> {
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(FreshRve, Dimensions);

}    // namespace

TYPED_TEST(FreshRve, HasStressDeformationAndTimeOfTheFailedOne)
{
  constexpr int D = TypeParam::value;
  Points<D> points = points_of<D>({packings<D>()[0]});
  load_and_fail<D>(points, {0});
  const rve::ResultOf<D> before = points.point(0).result;
  ASSERT_GT(before.deviatoric_stress(), 0.1 * before.mean_stress());

  const auto renewals = points.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>);

  ASSERT_EQ(renewals.size(), 1u);
  const rve::ResultOf<D> &result = points.point(0).result;
  EXPECT_EQ(renewals[0].packing, 0);    // the packing whose void ratio is nearer
  EXPECT_GT(renewals[0].steps, 0);
  EXPECT_EQ(renewals[0].void_ratio, result.void_ratio);
  EXPECT_EQ(renewals[0].void_ratio_before, before.void_ratio);
  EXPECT_FALSE(points.frozen(0));
  EXPECT_EQ(points.renewals(0), 1);
  // Each component is within the tolerance times the norm. The wanted stress is the symmetric part
  // of Love's stress, which is not exactly symmetric.
  const Matrix<D> wanted = 0.5 * (before.stress + rve::transpose(before.stress));
  EXPECT_LE(rve::norm(result.stress - wanted), D * macro::FRESH_TOLERANCE * rve::norm(wanted));
  EXPECT_LE(result.unbalanced_ratio, 2.0 * macro::FRESH_TOLERANCE);
  EXPECT_NEAR(result.void_ratio, before.void_ratio, 0.05);
  EXPECT_EQ(rve::norm(result.deformation - before.deformation), 0.0);
  EXPECT_EQ(result.counters.steps, before.counters.steps + renewals[0].steps);
  EXPECT_EQ(result.energy.work, 0.0);

  // The fresh RVE continues: a small strain changes the stress little.
  const Matrix<D> stress = result.stress;
  Matrix<D> l = Matrix<D>::zero();
  l(D - 1, D - 1) = -1e-7 / DT_OF_SMALL_PACKINGS<D>;
  EXPECT_TRUE(points.advance({0}, {drive_of<D>(l, 100)}).empty());
  EXPECT_LE(rve::norm(points.stress(0) - stress), 0.05 * rve::norm(stress));
}

TYPED_TEST(FreshRve, ComesFromThePackingWithTheNearestVoidRatio)
{
  constexpr int D = TypeParam::value;
  const double dense = packings<D>()[0].void_ratio(), loose = packings<D>()[1].void_ratio();
  ASSERT_GT(loose, dense + 0.01);
  Points<D> points = points_of<D>({packings<D>()[1]});
  Matrix<D> l = Matrix<D>::zero();
  l(D - 1, D - 1) = -0.5 / (20.0 * DT_OF_SMALL_PACKINGS<D>);
  ASSERT_EQ(points.advance({0}, {drive_of<D>(l, 20)}), std::vector<int>{0});

  const auto renewals = points.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>);

  EXPECT_EQ(renewals[0].packing, 1);
  EXPECT_NEAR(renewals[0].void_ratio, loose, 0.25 * (loose - dense));
}

// An RVE that has lost all contacts keeps its density and has no stress.
TYPED_TEST(FreshRve, KeepsTheDensityOfARveWithoutContacts)
{
  constexpr int D = TypeParam::value;
  Points<D> points = points_of<D>({packings<D>()[0]});
  Matrix<D> l = Matrix<D>::zero();
  for (int a = 0; a < D; ++a) l(a, a) = 2e-5 / DT_OF_SMALL_PACKINGS<D>;
  for (int step = 0; step < 100; ++step) points.advance({0}, {drive_of<D>(l, 50)});
  ASSERT_EQ(points.point(0).result.status, rve::status::NoContacts);
  const double void_ratio = points.point(0).result.void_ratio;
  rve::DriveOf<D> broken = drive_of<D>(l, 20);
  broken.deformation(0, 0) = 0.2;    // too narrow
  ASSERT_EQ(points.advance({0}, {broken}), std::vector<int>{0});

  const auto renewals = points.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>);

  ASSERT_GE(renewals[0].packing, 0);
  EXPECT_FALSE(points.frozen(0));
  EXPECT_EQ(rve::norm(points.stress(0)), 0.0);
  EXPECT_EQ(points.point(0).result.status, rve::status::NoContacts);
  EXPECT_NEAR(points.point(0).result.void_ratio, void_ratio, 1e-9);
}

TYPED_TEST(FreshRve, IsNotReplacedIfItFailsAtOnce)
{
  constexpr int D = TypeParam::value;
  Points<D> points = points_of<D>({packings<D>()[0]});
  load_and_fail<D>(points, {0});
  ASSERT_GE(points.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>)[0].packing, 0);
  const std::vector<char> fresh = rve::serialize(points.state(0));
  Matrix<D> l = Matrix<D>::zero();
  l(D - 1, D - 1) = -0.5 / (20.0 * DT_OF_SMALL_PACKINGS<D>);
  ASSERT_EQ(points.advance({0}, {drive_of<D>(l, 20)}), std::vector<int>{0});

  EXPECT_EQ(points.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>)[0].packing, -1);

  EXPECT_TRUE(points.frozen(0));
  EXPECT_EQ(points.renewals(0), 1);
  EXPECT_TRUE(rve::serialize(points.state(0)) == fresh);
}

TYPED_TEST(FreshRve, HasTheSameBitsWithOtherReplacementsAndAfterARecord)
{
  constexpr int D = TypeParam::value;
  Points<D> two = points_of<D>({packings<D>()[1], packings<D>()[0]}),
            one = points_of<D>({packings<D>()[0]});
  load_and_fail<D>(two, {0, 1});
  load_and_fail<D>(one, {0});

  two.renew({0, 1}, packings<D>(), DT_OF_SMALL_PACKINGS<D>);
  one.renew({0}, packings<D>(), DT_OF_SMALL_PACKINGS<D>);

  ASSERT_FALSE(one.frozen(0));
  EXPECT_TRUE(rve::serialize(two.state(1)) == rve::serialize(one.state(0)));
  const std::vector<double> record = one.record(0);
  const int slot = two.add_record(record.data(), record.size());
  EXPECT_EQ(two.renewals(slot), 1);
  EXPECT_EQ(two.copies(slot), 1);
}
