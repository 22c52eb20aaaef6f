// SPDX-License-Identifier: GPL-2.0-only
// RVEs are stretched until their cells are too narrow for their grains. They continue as several
// copies side by side.

#include "macro/rve_points.h"

#include "rve/core/error.h"
#include "rve/engine/copies.h"
#include "rve/engine/finite_strain.h"
#include "support/environment.h"
#include "support/increments.h"
#include "support/messages.h"
#include "support/small_packings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

using macro::MacroStepOptions;
using rve::Format;
using namespace rve_test;

namespace {

template <int D> using Points = macro::RvePointsOf<D>;
template <int D> using Matrix = rve::Tensor<double, D>;

constexpr int STEPS = 20;    // DEM steps of a macro step

MacroStepOptions with_copies(int most)
{
  MacroStepOptions macro;
  macro.most_copies = most;
  return macro;
}

template <int D>
Points<D> points_of(const rve::RveStateOf<D> &state, const MacroStepOptions &macro, int count = 1,
                    bool with_shadows = false)
{
  Points<D> points(rve::make_engine<D>(options_of_dimension(D)),
                   with_shadows ? rve::make_engine<D>(options_of_dimension(D)) : nullptr, macro);
  points.add(std::vector<const rve::RveStateOf<D> *>(count, &state));
  return points;
}

/// Returns a velocity gradient that narrows the first axis at constant volume. It is nearly
/// quasi-static with 2e-5 of strain per DEM step.
template <int D> Matrix<D> stretch()
{
  const double rate = 2e-5 / DT_OF_SMALL_PACKINGS<D>;
  Matrix<D> l = Matrix<D>::zero();
  l(0, 0) = -rate;
  l(D - 1, D - 1) = rate;
  return l;
}

template <int D> rve::DriveOf<D> drive_of(const Matrix<D> &gradient)
{
  return rve::DriveOf<D>::constant_velocity_gradient(gradient, DT_OF_SMALL_PACKINGS<D>, STEPS);
}

/// Returns the small packing as it is five macro steps before stretch() makes its cell too narrow.
template <int D> const rve::RveStateOf<D> &stretched_packing()
{
  static const rve::RveStateOf<D> state = [] {
    constexpr int BEFORE = 5;    // macro steps
    std::vector<rve::RveStateOf<D>> last;
    Points<D> points = points_of<D>(small_packing<D>(), with_copies(2));
    for (int step = 0; step < 5000 && points.copies(0) == 1; ++step) {
      last.push_back(points.state(0));
      if (last.size() > BEFORE) last.erase(last.begin());
      EXPECT_TRUE(points.advance({0}, {drive_of<D>(stretch<D>())}).empty());
    }
    EXPECT_EQ(points.copies(0), 2);
    return last.front();
  }();
  return state;
}

/// Returns true if grains, list, history, counters, stress and contacts are the same to the last
/// bit.
template <int D> bool same_bits(const Points<D> &a, int slot, const Points<D> &b, int other)
{
  return rve::serialize(a.state(slot)) == rve::serialize(b.state(other)) &&
      std::memcmp(&a.stress(slot), &b.stress(other), sizeof(Matrix<D>)) == 0 &&
      a.point(slot).contacts == b.point(other).contacts &&
      a.point(slot).limit.num_contacts == b.point(other).limit.num_contacts &&
      a.copies(slot) == b.copies(other);
}

template <class Dimension> class NarrowCell : public OnDeviceOf<testing::Test> {
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(NarrowCell, Dimensions);

class NarrowCells : public OnDeviceOf<testing::Test> {};

}    // namespace

// A flowing packing is chaotic, so the two RVEs agree only until their difference has grown.
TYPED_TEST(NarrowCell, ContinuesAsAPackingThatHadTheWideCellBefore)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = stretched_packing<D>();
  Points<D> narrow = points_of<D>(state, with_copies(2));
  Points<D> wide = points_of<D>(rve::side_by_side(state), with_copies(1));
  ASSERT_EQ(narrow.copies(0), 1);

  for (int step = 0; step < 10; ++step)
    for (Points<D> *points : {&narrow, &wide})
      ASSERT_TRUE(points->advance({0}, {drive_of<D>(stretch<D>())}).empty());

  EXPECT_EQ(narrow.copies(0), 2);
  EXPECT_EQ(narrow.take_widened(), std::vector<int>{0});
  EXPECT_TRUE(narrow.take_widened().empty());
  const rve::ResultOf<D> &one = narrow.point(0).result, &other = wide.point(0).result;
  EXPECT_EQ(one.num_grains, other.num_grains);
  EXPECT_EQ(one.num_contacts, other.num_contacts);
  EXPECT_GT(other.mean_stress(), 0.0);
  EXPECT_LE(rve::norm(one.stress - other.stress), 1e-8 * rve::norm(other.stress));
  EXPECT_NEAR(one.elastic_energy, other.elastic_energy, 1e-8 * other.elastic_energy);
  EXPECT_NEAR(one.void_ratio, other.void_ratio, 1e-12);
}

// The RVE advances in one call with others, once by increments and once by drives.
TYPED_TEST(NarrowCell, ContinuesTogetherWithOtherRves)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> narrow = stretched_packing<D>(), &wide = small_packing<D>();
  const std::vector<const rve::RveStateOf<D> *> states{&wide, &narrow, &wide};
  Points<D> by_increments(rve::make_engine<D>(options_of_dimension(D)), nullptr, with_copies(2));
  Points<D> by_drives(rve::make_engine<D>(options_of_dimension(D)), nullptr, with_copies(2));
  const std::vector<int> slots = by_increments.add(states);
  ASSERT_EQ(by_drives.add(states), slots);
  const std::vector<rve::DriveOf<D>> drives(states.size(), drive_of<D>(stretch<D>()));

  for (int step = 0; step < 12; ++step) {
    IncrementsOf<D> increments(drives);
    std::vector<int> failed;
    ASSERT_TRUE(advance(by_increments, slots, increments, false, failed));
    EXPECT_TRUE(failed.empty());
    by_drives.advance(slots, drives, false);
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(
          std::memcmp(&increments.stresses[k], &by_drives.stress(slots[k]), sizeof(Matrix<D>)), 0)
          << step << " " << k;
  }

  EXPECT_EQ(by_increments.copies(slots[1]), 2);
  EXPECT_EQ(by_increments.take_widened(), std::vector<int>{slots[1]});
  for (const int slot : slots) EXPECT_TRUE(same_bits<D>(by_increments, slot, by_drives, slot));
}

// The energy balance of springs, motion, friction and damping holds across the doubling of the
// cell.
TYPED_TEST(NarrowCell, KeepsItsEnergyPerVolume)
{
  constexpr int D = TypeParam::value;
  Points<D> points = points_of<D>(stretched_packing<D>(), with_copies(2));
  const auto missing = [&] {
    const rve::ResultOf<D> &r = points.point(0).result;
    const rve::EnergyTotals &e = r.energy;
    return (e.work - e.friction - e.local_damping - e.viscous - r.kinetic_energy -
            r.elastic_energy) /
        points.copies(0);
  };
  const double missing_at_first = missing();

  double work = 0.0;
  for (int step = 0; step < 50; ++step) {
    ASSERT_TRUE(points.advance({0}, {drive_of<D>(stretch<D>())}).empty());
    work = points.point(0).result.energy.work / points.copies(0);
    EXPECT_NEAR(missing(), missing_at_first, 1e-3 * work) << step;
  }

  EXPECT_EQ(points.copies(0), 2);
}

// Local damping depends on the axes and is therefore off.
TYPED_TEST(NarrowCell, RotatesWithItsDrive)
{
  constexpr int D = TypeParam::value;
  rve::RveStateOf<D> state = stretched_packing<D>();
  state.material.local_damping = 0.0;
  Matrix<D> rotation = Matrix<D>::identity();
  rotation(0, 0) = rotation(1, 1) = 0.6;
  rotation(1, 0) = 0.8;
  rotation(0, 1) = -0.8;
  const auto engine = rve::make_engine<D>(options_of_dimension(D));
  engine->add(state);
  engine->turn({0}, {rotation});
  const auto turned = [&](const Matrix<D> &x) { return rotation * x * rve::transpose(rotation); };
  Points<D> one = points_of<D>(state, with_copies(2)),
            other = points_of<D>(engine->state(0), with_copies(2));

  for (int step = 0; step < 20; ++step) {
    one.advance({0}, {drive_of<D>(stretch<D>())});
    other.advance({0}, {drive_of<D>(turned(stretch<D>()))});
  }

  EXPECT_EQ(one.copies(0), 2);
  EXPECT_EQ(other.copies(0), 2);
  EXPECT_LE(rve::norm(turned(one.stress(0)) - other.stress(0)), 1e-7 * rve::norm(one.stress(0)));
}

TYPED_TEST(NarrowCell, ContinuesFromItsRecordToTheSameBits)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = stretched_packing<D>();
  Points<D> points = points_of<D>(state, with_copies(2)),
            before = points_of<D>(state, with_copies(2));
  const auto advance = [](Points<D> &some, int steps) {
    for (int step = 0; step < steps; ++step) some.advance({0}, {drive_of<D>(stretch<D>())});
  };
  ASSERT_LE(points.record_size(0), points.record_bound(0));
  const int bound = points.record_bound(0);
  const auto continued = [](const Points<D> &some) {
    Points<D> other(rve::make_engine<D>(options_of_dimension(D)), nullptr, with_copies(2));
    const std::vector<double> record = some.record(0);
    other.add_record(record.data(), record.size());
    return other;
  };

  advance(points, 8);
  Points<D> after = continued(points);
  Points<D> from_before = continued(before);
  ASSERT_EQ(after.copies(0), 2);
  ASSERT_EQ(from_before.copies(0), 1);
  advance(points, 5);
  advance(after, 5);
  advance(from_before, 13);

  EXPECT_TRUE(same_bits(points, 0, after, 0));
  EXPECT_TRUE(same_bits(points, 0, from_before, 0));
  EXPECT_LE(points.record_size(0), bound);
}

TYPED_TEST(NarrowCell, DoesNotChangeOtherRves)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = stretched_packing<D>();
  Points<D> three = points_of<D>(state, with_copies(2), 3),
            one = points_of<D>(state, with_copies(2));
  const Matrix<D> back = -1.0 * stretch<D>();

  for (int step = 0; step < 10; ++step) {
    three.advance({0, 1, 2}, {drive_of<D>(back), drive_of<D>(stretch<D>()), drive_of<D>(back)});
    one.advance({0}, {drive_of<D>(back)});
  }

  EXPECT_EQ(three.copies(0), 1);
  EXPECT_EQ(three.copies(1), 2);
  EXPECT_EQ(three.copies(2), 1);
  EXPECT_TRUE(same_bits(three, 0, one, 0));
  EXPECT_TRUE(same_bits(three, 2, one, 0));
}

TYPED_TEST(NarrowCell, FailsIfCopiesAreForbiddenOrMemoryIsShort)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = stretched_packing<D>();
  for (const bool by_memory : {false, true}) {
    Points<D> points = points_of<D>(state, with_copies(by_memory ? 2 : 1), 2);
    const Environment memory("GPU_RVE_MEMORY_LIMIT", by_memory ? "100" : nullptr);
    const Matrix<D> back = -1.0 * stretch<D>();

    std::vector<int> failed;
    for (int step = 0; step < 10 && failed.empty(); ++step)
      failed = points.advance({0, 1}, {drive_of<D>(stretch<D>()), drive_of<D>(back)});

    EXPECT_EQ(failed, std::vector<int>{0});
    EXPECT_EQ(points.point(0).result.status & rve::status::Fatal, rve::status::CellTooNarrow);
    EXPECT_EQ(points.state(0).num_grains(), state.num_grains());
    EXPECT_FALSE(points.frozen(1));
  }
}

TYPED_TEST(NarrowCell, DoublesItsShadowAndAveragesItsStress)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = stretched_packing<D>();
  MacroStepOptions macro = with_copies(2);
  macro.shadow_refinement = 1;
  macro.stress_from = macro::StressFrom::Average;
  macro.stress_samples = 2;
  macro.stress_spacing = 1;
  Points<D> points = points_of<D>(state, macro, 1, true);
  points.add_shadow(0);

  for (int step = 0; step < 10; ++step) points.advance({0}, {drive_of<D>(stretch<D>())});

  EXPECT_EQ(points.copies(0), 2);
  EXPECT_FALSE(points.frozen(0));
  ASSERT_GE(points.point(0).shadow, 0);
  // The stress of the RVE is the mean of the last two steps, and the stress of the shadow is the
  // stress in the last step.
  EXPECT_LT(points.point(0).shadow_deviation(), 0.1);
}

// Copies in a narrow cell diverge, so the RVE flows like one with many grains. If the copies stayed
// equal, the grains would be in rows, and rows of grains bear a stress ratio q/p of 0.9.
TEST_F(NarrowCells, ContinueAsPackingsWithIndependentCopies)
{
  Points<2> points(rve::make_engine<2>(options_of_dimension(2, Format::Fast)), nullptr,
                   with_copies(8));
  const rve::RveState packing = small_packing<2>();
  points.add({&packing});
  rve::Drive drive;
  drive.dt = DT_OF_SMALL_PACKINGS<2>;
  drive.substeps = STEPS;
  drive.velocity_gradient(0, 0) = stretch<2>()(0, 0);
  drive.controlled[1][1] = true;
  drive.stress_goal(1, 1) = -1e5;
  drive.servo_gain = points.servo_gain(0);
  drive.servo_max_rate = -3.0 * drive.velocity_gradient(0, 0);

  // The mean is taken from 1.2 to 2 times the strain at which the cell became too narrow.
  double ratio = 0.0, void_ratio = 0.0;
  int evaluations = 0, narrow = 0, step = 0;
  for (; narrow == 0 || step < 2 * narrow; ++step) {
    ASSERT_TRUE(points.advance({0}, {drive}).empty()) << step;
    if (narrow == 0 && points.copies(0) > 1) narrow = step;
    if (narrow == 0 || step < narrow + narrow / 5) continue;
    const rve::Result &result = points.point(0).result;
    ratio += result.deviatoric_stress() / result.mean_stress();
    void_ratio += result.void_ratio;
    ++evaluations;
  }

  EXPECT_GE(points.copies(0), 4);
  EXPECT_FALSE(rve::is_one_grain_across(points.state(0), points.copies(0)));
  EXPECT_LT(ratio / evaluations, 0.6);
  EXPECT_GT(void_ratio / evaluations, 0.15);
}

// Copies of grains that only move with the cell stay equal. Once the cell is one grain wide, grains
// are their own neighbours, and more copies would give no new information.
TEST_F(NarrowCells, AreNotDoubledAgainOnceTheyAreOneGrainWide)
{
  rve::RveState state = small_packing<2>();
  state.cell = 1.1 * state.cell;
  state.pairs.clear();
  state.list_fractional.clear();
  state.list_cell = Matrix<2>::zero();
  Points<2> points = points_of<2>(state, with_copies(8));
  rve::Drive drive;
  drive.dt = DT_OF_SMALL_PACKINGS<2>;
  drive.substeps = STEPS;
  drive.deformation(0, 0) = 0.999;
  drive.deformation(1, 1) = 1.01;

  std::vector<int> failed;
  for (int step = 0; step < 3000 && failed.empty(); ++step) failed = points.advance({0}, {drive});

  EXPECT_EQ(points.copies(0), 2);
  EXPECT_EQ(points.point(0).result.num_grains, 2 * state.num_grains());
  EXPECT_EQ(points.point(0).result.status & rve::status::Fatal, rve::status::CellTooNarrow);
  EXPECT_TRUE(rve::is_one_grain_across(points.state(0), 2));
}

// A column that is stretched becomes narrow across two axes.
TEST_F(NarrowCells, OfSpheresAreDoubledAcrossBothAxes)
{
  Points<3> points = points_of<3>(small_packing<3>(), with_copies(4));
  const double rate = 8e-5 / DT_OF_SMALL_PACKINGS<3>;
  Matrix<3> pull = Matrix<3>::zero();
  pull(0, 0) = pull(1, 1) = -0.5 * rate;
  pull(2, 2) = rate;

  std::vector<int> failed;
  for (int step = 0; step < 1000 && failed.empty() && points.copies(0) < 4; ++step)
    failed = points.advance({0}, {drive_of<3>(pull)});

  EXPECT_TRUE(failed.empty());
  EXPECT_EQ(points.copies(0), 4);
  const Matrix<3> cell = points.state(0).cell, at_first = small_packing<3>().cell;
  for (int a = 0; a < 2; ++a)
    EXPECT_NEAR(cell(a, a) / at_first(a, a), 2.0 / std::sqrt(cell(2, 2) / at_first(2, 2)), 1e-3);
}
