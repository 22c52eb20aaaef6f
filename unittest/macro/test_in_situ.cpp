// SPDX-License-Identifier: GPL-2.0-only
// Initial stress of the ground: the weight of levels, and RVEs that are brought to a given stress.

#include "macro/in_situ.h"

#include "rve/core/error.h"
#include "rve/engine/packing.h"
#include "support/messages.h"
#include "support/packings.h"

#include <algorithm>
#include <gtest/gtest.h>

using macro::GroundAtRest;
using macro::HeightProfile;
using macro::InSituReport;
using macro::StressGoal;
using rve::Tensor2;
using rve::Tensor3;

namespace {

constexpr double DT = 5e-5;

rve::Options cpu_options(int dimension = 2)
{
  rve::Options options;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  options.contacts.dimension = dimension;
  return options;
}

/// Returns 80 grains under an isotropic pressure of 20 kPa.
template <int D> const rve::RveStateOf<D> &packing()
{
  static const rve::RveStateOf<D> state = [] {
    rve::PackingRecipe recipe;
    recipe.material.normal_stiffness = recipe.material.tangential_stiffness = 1e6;
    recipe.material.density = 2650.0;
    recipe.material.friction = 0.5;
    recipe.material.local_damping = 0.3;
    if (D == 2) recipe.material.thickness = 0.075;
    recipe.num_grains = D == 2 ? 80 : 120;
    recipe.radius_min = 0.0025;
    recipe.radius_max = 0.005;
    recipe.pressure = 20e3;
    const auto engine = rve::make_engine<D>(cpu_options(D));
    return rve::generate_packing<D>(recipe, *engine);
  }();
  return state;
}

template <int D> struct Ground {
  macro::RvePointsOf<D> points{rve::make_engine<D>(cpu_options(D)), nullptr, {}};
  std::vector<int> slots;

  explicit Ground(int count)
  {
    slots = points.add(std::vector<const rve::RveStateOf<D> *>(count, &packing<D>()));
  }
};

/// Returns stresses from 2 kPa to 80 kPa with K0 = 0.5.
std::vector<StressGoal> depths(int vertical)
{
  std::vector<StressGoal> goals;
  for (const double pressure : {2e3, 20e3, 80e3})
    goals.push_back(StressGoal::at_rest(vertical, -pressure, 0.5, true));
  return goals;
}

template <int D> void expect_goals_are_met()
{
  constexpr double TOLERANCE = 1.0;    // [Pa]
  const std::vector<StressGoal> goals = depths(D - 1);
  Ground<D> ground(3);

  const InSituReport report = bring_to_stress(ground.points, ground.slots, goals, TOLERANCE, DT);

  EXPECT_LE(report.largest_error, TOLERANCE);
  for (int k = 0; k < 3; ++k) {
    const auto &point = ground.points.point(ground.slots[k]);
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b)
        EXPECT_NEAR(0.5 * (point.result.stress(a, b) + point.result.stress(b, a)),
                    goals[k].stress(a, b), TOLERANCE);
    EXPECT_EQ(point.result.counters.steps, 0);
    EXPECT_EQ(point.result.kinetic_energy, 0.0);
    EXPECT_EQ(point.drive.substeps, 0);
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) EXPECT_EQ(point.result.deformation(a, b), a == b ? 1.0 : 0.0);
  }
  // The stress does not change, since nothing moves in cells that are held.
  std::vector<rve::DriveOf<D>> held(3);
  for (auto &drive : held) {
    drive.dt = DT;
    drive.substeps = 1000;
  }
  ground.points.advance(ground.slots, held);
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < D; ++a)
      EXPECT_NEAR(ground.points.stress(ground.slots[k])(a, a), goals[k].stress(a, a),
                  2.0 * TOLERANCE);
}

}    // namespace

TEST(HeightProfile, CoverIsTheTrapezoidalSumOfTheWeightsOfLevels)
{
  const HeightProfile ground(1.0, 0.5, {2000.0, 1900.0, 1700.0});

  EXPECT_DOUBLE_EQ(ground.between(2.25, 2.5), 0.25 * 1700.0);
  EXPECT_DOUBLE_EQ(ground.between(1.75, 2.5), 0.25 * 1900.0 + 0.5 * 1700.0);
  // The layer between two levels has half of the weight of each of these levels.
  EXPECT_NEAR(ground.between(1.25, 2.5) - ground.between(1.75, 2.5), 0.25 * (2000.0 + 1900.0),
              1e-10);
  EXPECT_NEAR(ground.between(2.5, 3.0), 0.5 * 1700.0, 1e-10) << "density goes on above";
  EXPECT_NEAR(ground.between(0.0, 1.0), 2000.0, 1e-10) << "and below";
  EXPECT_LT(ground.between(2.6, 2.5), 0.0) << "above the surface";
}

TEST(HeightProfile, ALevelWithoutPointsHasTheDensityBelow)
{
  const HeightProfile ground(0.0, 1.0, {2000.0, 0.0, 1700.0});

  EXPECT_DOUBLE_EQ(ground.value(1), 2000.0);
  EXPECT_NEAR(ground.change_to(HeightProfile(0.0, 1.0, {2000.0, 2020.0, 1683.0})), 0.01, 1e-12);
}

TEST(HeightProfile, NamesInvalidInput)
{
  EXPECT_EQ(rve_test::message_of([] { HeightProfile(0.0, -1.0, {1.0}); }),
            "thickness of the levels of the ground is -1 [length]; it must be greater than 0");
  EXPECT_EQ(rve_test::message_of([] {
              HeightProfile(0.0, 1.0, {0.0, 1.0});
            }),
            "a profile over height needs a value of its lowest level");
}

// One level has two points and the next level has one. The stress of a level follows from its mean
// density, and rounds continue until densities converge.
TEST(GroundAtRest, DensityAndStressAreFoundInRounds)
{
  GroundAtRest::Points points;
  points.height = {0.5, 0.5, 1.5};
  points.surface = {2.0, 2.0, 2.0};
  points.surcharge = {100.0, 100.0, 100.0};
  points.k0 = {0.5, 0.5, 0.6};
  GroundAtRest ground(10.0, 1.0, 1, points, {1900.0, 2100.0, 1800.0}, {});

  EXPECT_NEAR(ground.vertical_pressure(2), 100.0 + 10.0 * 0.5 * 1800.0, 1e-9);
  EXPECT_NEAR(ground.vertical_pressure(0), 100.0 + 10.0 * (1800.0 + 0.5 * 2000.0), 1e-9);
  EXPECT_FALSE(ground.settles({2000.0, 2100.0, 1800.0}, {}));
  EXPECT_NEAR(ground.vertical_pressure(0), 100.0 + 10.0 * (1800.0 + 0.5 * 2050.0), 1e-9);
  EXPECT_TRUE(ground.settles({2000.1, 2100.0, 1800.1}, {}));
  EXPECT_NEAR(ground.density().at(0.5), 2050.0, 1e-9) << "that which the stress balances";
  EXPECT_EQ(ground.rounds(), 2);
  const StressGoal goal = ground.goal(2);
  EXPECT_NEAR(goal.stress(0, 0), 0.6 * goal.stress(1, 1), 1e-9);
  EXPECT_NEAR(goal.stress(2, 2), goal.stress(0, 0), 0.0);
  EXPECT_TRUE(goal.steered[0][0]);
}

TEST(GroundAtRest, K0IsTheMeanOfTheGrainsOfALevel)
{
  GroundAtRest::Points points;
  points.height = {0.5, 0.5};
  points.surface = {1.0, 1.0};
  points.surcharge = {0.0, 0.0};
  points.finds_k0 = true;
  GroundAtRest ground(10.0, 1.0, 2, points, {2000.0, 2000.0}, {});

  EXPECT_FALSE(ground.goal(0).steered[0][0]) << "sides are held";
  EXPECT_TRUE(ground.goal(0).steered[2][2]);
  EXPECT_FALSE(ground.settles({2000.0, 2000.0}, {0.4, 0.5}));
  EXPECT_TRUE(ground.goal(0).steered[0][0]);
  EXPECT_NEAR(ground.goal(1).stress(1, 1), 0.45 * ground.goal(1).stress(2, 2), 1e-9);
  EXPECT_TRUE(ground.settles({2000.0, 2000.0}, {0.45, 0.45}));
}

TEST(GroundAtRest, DensitiesThatDoNotConvergeAreAnError)
{
  GroundAtRest::Points points;
  points.height = points.surcharge = {0.5};
  points.surface = {1.0};
  points.k0 = {1.0};
  GroundAtRest ground(10.0, 1.0, 1, points, {1000.0}, {});
  double density = 1000.0;

  EXPECT_EQ(
      rve_test::message_of([&] {
        while (!ground.settles({density *= 1.25}, {})) {}
      }),
      "density and stress of the RVEs do not converge: in iteration 10 the relative change of the "
      "density of a level is still 0.25");
}

TEST(InSitu, DisksAreBroughtToTheStressOfTheirDepthAndStayThere)
{
  expect_goals_are_met<2>();
}

TEST(InSitu, SpheresAreBroughtToTheStressOfTheirDepthAndStayThere)
{
  expect_goals_are_met<3>();
}

TEST(InSitu, BitsDoNotDependOnTheOthersOrTheirOrder)
{
  const std::vector<StressGoal> goals = depths(1);
  Ground<2> together(3), backwards(3), alone(1);

  bring_to_stress(together.points, together.slots, goals, 1.0, DT);
  bring_to_stress(backwards.points, backwards.slots, {goals[2], goals[1], goals[0]}, 1.0, DT);
  bring_to_stress(alone.points, alone.slots, {goals[2]}, 1.0, DT);

  const auto bits = [](const Ground<2> &ground, int k) {
    return rve::serialize(ground.points.state(ground.slots[k]));
  };
  EXPECT_EQ(bits(together, 2), bits(alone, 0));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(bits(together, k), bits(backwards, 2 - k));
}

// Jaky's K0 = 1 - sin(phi) of granular soils lies between the active limit and 1.
TEST(InSitu, HeldSidesGiveTheLateralStressAtRest)
{
  Ground<2> ground(1);

  bring_to_stress(ground.points, ground.slots, {StressGoal::at_rest(1, -80e3, 1.0, false)}, 1.0,
                  DT);

  const Tensor2 stress = ground.points.stress(ground.slots[0]);
  const rve::RveState state = ground.points.state(ground.slots[0]);
  EXPECT_NEAR(stress(1, 1), -80e3, 1.0);
  EXPECT_LT(stress(0, 0) / stress(1, 1), 0.95);
  EXPECT_GT(stress(0, 0) / stress(1, 1), 0.3);
  EXPECT_EQ(state.cell(0, 0), packing<2>().cell(0, 0));
  EXPECT_LT(state.cell(1, 1), packing<2>().cell(1, 1));
}

TEST(InSitu, GrainsWithoutDampingComeToRestToo)
{
  Ground<2> ground(1);
  rve::Material material = ground.points.material(ground.slots[0]);
  material.local_damping = 0.0;
  ground.points.set_materials(ground.slots, {material});

  bring_to_stress(ground.points, ground.slots, {StressGoal::at_rest(1, -30e3, 0.6, true)}, 1.0, DT);

  EXPECT_EQ(ground.points.material(ground.slots[0]).local_damping, 0.0);
  EXPECT_EQ(ground.points.state(ground.slots[0]).material.local_damping, 0.0);
}

TEST(InSitu, StressBeyondTheStrengthIsAnError)
{
  Ground<2> ground(2);

  try {
    bring_to_stress(
        ground.points, ground.slots,
        {StressGoal::at_rest(1, -20e3, 1.0, true), StressGoal::at_rest(1, -20e3, 0.05, true)}, 1.0,
        DT);
    FAIL() << "grains bear it";
  } catch (const macro::InSituError &problem) {
    EXPECT_EQ(problem.index(), 1u);
    EXPECT_NE(std::string(problem.what()).find("cannot be brought to the stress -1000 -20000 0 "),
              std::string::npos)
        << problem.what();
  }
}

// Without early checks, each of these cases would run some million steps before the error.
TEST(InSitu, StressesThatCannotBeReachedAreErrorsSoon)
{
  const auto message = [](double xx, double yy, double xy, double tolerance) {
    Ground<2> ground(1);
    const Tensor2 stress{xx, xy, xy, yy};
    try {
      bring_to_stress(ground.points, ground.slots, {StressGoal::of<2>(stress)}, tolerance, DT);
    } catch (const macro::InSituError &problem) {
      return std::string(problem.what());
    }
    return std::string("none");
  };
  const auto expect_in = [](const std::string &part, const std::string &whole) {
    EXPECT_NE(whole.find(part), std::string::npos) << whole;
  };

  expect_in("its largest principal stress is 10000; it must be below 0",
            message(1e4, -3e4, 0.0, 1.0));
  expect_in("its largest principal stress is 5000; it must be below 0",
            message(-2e4, -2e4, 2.5e4, 1.0));
  expect_in("its largest principal stress is 0; it must be below 0", message(0.0, 0.0, 0.0, 0.0));
  expect_in("the tolerance of the stress in situ is 1e-30 [stress]; it must be at least 2e-09",
            message(-2e4, -2e4, 0.0, 1e-30));
  expect_in("the grains still flow", message(-4e3, -2e4, 0.0, 1.0));
  expect_in("the grains are at rest, but the stress differs from its goal by",
            message(-1e-30, -1e-30, 0.0, 1e-35));
}

TEST(InSitu, ShadowsAndFrozenRvesRestart)
{
  macro::MacroStepOptions options;
  macro::RvePoints points(rve::make_engine(cpu_options()), rve::make_engine(cpu_options()),
                          options);
  const std::vector<int> slots = points.add({&packing<2>()});
  points.add_shadow(slots[0]);

  bring_to_stress(points, slots, {StressGoal::at_rest(1, -30e3, 0.6, true)}, 1.0, DT);

  const auto &point = points.point(slots[0]);
  EXPECT_GE(point.shadow, 0);
  EXPECT_NEAR(point.shadow_stress(1, 1), -30e3, 1.0);
  EXPECT_EQ(point.shadow_deviation(), 0.0);
}
