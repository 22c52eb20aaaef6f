// SPDX-License-Identifier: GPL-2.0-only
// Tests two copies of a packing side by side in a cell of twice the width. The copies must have the
// same forces as the packing, whichever face of the cell a contact crosses. They must also move
// like the packing.

#include "support/rve_rig.h"
#include "support/small_packings.h"

#include "rve/engine/copies.h"
#include "rve/engine/finite_strain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

template <int D> struct Rig {
  std::unique_ptr<EngineOf<D>> engine;
  std::vector<ResultOf<D>> results;

  Rig(const RveStateOf<D> &state, Format format)
  {
    engine = make_engine<D>(options_of_dimension(D, format));
    engine->add(state);
  }
  const ResultOf<D> &advance(const DriveOf<D> &drive)
  {
    engine->advance({0}, {drive}, results);
    EXPECT_EQ(results[0].status & status::Fatal, 0u) << describe_status(results[0].status);
    return results[0];
  }
  const ResultOf<D> &evaluate() { return advance(DriveOf<D>()); }
  /// Applies an extension along the first axis and a shear, both at constant volume.
  const ResultOf<D> &shear(int steps)
  {
    Tensor<double, D> l = Tensor<double, D>::zero();
    l(0, 0) = 0.5;
    l(D - 1, D - 1) = -0.5;
    l(0, 1) = D == 2 ? 2.0 : 10.0;
    return advance(DriveOf<D>::constant_velocity_gradient(l, DT_OF_SMALL_PACKINGS<D>, steps));
  }
};

/// Returns a packing after a shear with at least one lattice reduction. It has sticking and sliding
/// contacts.
template <int D> RveStateOf<D> sheared_packing(Format format)
{
  Rig<D> rig(small_packing<D>(), format);
  for (int call = 0; call < 10; ++call) rig.shear(1500);
  EXPECT_GT(rig.results[0].counters.lattice_reductions, 0);
  EXPECT_GT(rig.results[0].sliding_fraction, 0.0);
  return rig.engine->state(0);
}

/// Returns the relative rounding error of forces. It includes the rounding of positions for
/// overlaps of 1e-3 of the diameter.
double rounding(Format format)
{
  return format == Format::Fast ? 2e-4 : format == Format::Mixed ? 1e-6 : 1e-11;
}

template <int D>
void expect_same_medium(const ResultOf<D> &one, const ResultOf<D> &other, double times,
                        double tolerance)
{
  EXPECT_LE(norm(one.stress - other.stress), tolerance * norm(one.stress));
  EXPECT_LE(norm(one.fabric - other.fabric), tolerance);
  EXPECT_NEAR(other.elastic_energy, times * one.elastic_energy,
              tolerance * times * one.elastic_energy);
  EXPECT_NEAR(other.kinetic_energy, times * one.kinetic_energy,
              tolerance * times * one.kinetic_energy);
  EXPECT_NEAR(other.energy.work, times * one.energy.work,
              tolerance * times * std::fabs(one.energy.work));
  EXPECT_NEAR(other.energy.friction, times * one.energy.friction,
              tolerance * times * one.energy.friction);
  EXPECT_NEAR(other.energy.local_damping, times * one.energy.local_damping,
              tolerance * times * one.energy.local_damping);
  EXPECT_NEAR(other.void_ratio, one.void_ratio, 1e-12);
  EXPECT_NEAR(other.unbalanced_ratio, one.unbalanced_ratio, tolerance);
  EXPECT_NEAR(other.largest_overlap, one.largest_overlap, tolerance * one.largest_overlap);
  EXPECT_LE(norm(other.deformation - one.deformation), 1e-12 * norm(one.deformation));
}

template <class Dimension> class Copies : public OnDeviceOf<testing::Test> {
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Copies, Dimensions);

}    // namespace

TYPED_TEST(Copies, HaveTheSameForcesForContactsThroughAnyFace)
{
  constexpr int D = TypeParam::value;
  for (const Format format : ALL_FORMATS) {
    const RveStateOf<D> state = sheared_packing<D>(format);
    const ResultOf<D> narrow = Rig<D>(state, format).evaluate();

    RveStateOf<D> wide = state;
    for (int times = 2; times <= 8; times *= 2) {
      wide = side_by_side(wide);
      wide.check();
      const ResultOf<D> result = Rig<D>(wide, format).evaluate();

      EXPECT_EQ(result.num_grains, times * narrow.num_grains);
      EXPECT_EQ(result.num_contacts, times * narrow.num_contacts);
      EXPECT_EQ(result.num_rattlers, times * narrow.num_rattlers);
      expect_same_medium(narrow, result, times, rounding(format));
    }
  }
}

// A sheared packing is chaotic. The copies agree only as long as their difference has not grown.
TYPED_TEST(Copies, MoveAsTheOriginal)
{
  constexpr int D = TypeParam::value;
  const RveStateOf<D> state = sheared_packing<D>(Format::Double);
  Rig<D> narrow(state, Format::Double), wide(side_by_side(state), Format::Double);

  narrow.shear(200);
  wide.shear(200);

  expect_same_medium(narrow.results[0], wide.results[0], 2.0, 1e-8);
  const RveStateOf<D> end = wide.engine->state(0);
  const int n = state.num_grains();
  double fastest = 0.0;
  for (const double c : end.velocity) fastest = std::max(fastest, std::fabs(c));
  for (int k = 0; k < D * n; ++k)
    EXPECT_NEAR(end.velocity[k], end.velocity[D * n + k], 2.0 * PARTING * fastest);
  // Control: the copies must differ in their last bits. Copies with the same bits would stay equal
  // for ever.
  EXPECT_NE(end.velocity[0], end.velocity[D * n]);
}

TYPED_TEST(Copies, DoubleTheNarrowestDirection)
{
  constexpr int D = TypeParam::value;
  const RveStateOf<D> state = small_packing<D>();
  RveStateOf<D> flat = state;
  for (int b = 0; b < D; ++b) flat.cell(D - 1, b) *= 0.7;

  const Tensor<double, D> wide = side_by_side(flat).cell;

  for (int a = 0; a < D; ++a)
    EXPECT_DOUBLE_EQ(wide(a, a), (a == D - 1 ? 2.0 : 1.0) * flat.cell(a, a));
}

TYPED_TEST(Copies, CountAsOneGrainWideWhenTheyAreCloseAndEqual)
{
  constexpr int D = TypeParam::value;
  RveStateOf<D> state = small_packing<D>();
  const double largest = *std::max_element(state.radius.begin(), state.radius.end());
  const auto squeezed = [&](double width) {
    RveStateOf<D> flat = state;
    for (int b = 0; b < D; ++b) flat.cell(0, b) *= width / state.cell(0, 0);
    return side_by_side(flat);
  };

  EXPECT_FALSE(is_one_grain_across(state, 1));
  EXPECT_FALSE(is_one_grain_across(squeezed(3.1 * largest), 2));
  RveStateOf<D> near = squeezed(2.9 * largest);
  EXPECT_TRUE(is_one_grain_across(near, 2));
  EXPECT_TRUE(is_one_grain_across(side_by_side(near), 4));

  // Each grain of the first copy moves by 0.2 to 0.3 diameters of the largest grain. The second
  // copy does not move.
  Random random(1);
  for (int i = 0; i < state.num_grains(); ++i)
    near.fractional[D * i + D - 1] += static_cast<std::uint64_t>(
        std::ldexp(random.uniform(0.4, 0.6) * largest / state.cell(D - 1, D - 1), 64));
  EXPECT_FALSE(is_one_grain_across(near, 2));
}
