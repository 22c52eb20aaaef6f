// SPDX-License-Identifier: GPL-2.0-only
// Tests the preparation of packings of spheres on the CPU engine, and a packing from another
// program.

#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/packing.h"
#include "support/messages.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

using namespace rve;
using namespace rve_test;

namespace {

PackingRecipe sphere_recipe(int num_grains, double pressure)
{
  PackingRecipe recipe;
  recipe.material = spheres_material();
  recipe.num_grains = num_grains;
  recipe.radius_min = 0.0025;
  recipe.radius_max = 0.005;
  recipe.pressure = pressure;
  return recipe;
}

std::unique_ptr<EngineOf<3>> cpu_engine(int threads = 1)
{
  Options options = sphere_options(Format::Mixed);
  options.threads = threads;
  return make_engine<3>(options);
}

ResultOf<3> evaluate(EngineOf<3> &engine, const Spheres &state)
{
  const int rve = engine.add(state);
  DriveOf<3> drive;
  drive.dt = 1e-6;
  std::vector<ResultOf<3>> results;
  engine.advance({rve}, {drive}, results);
  engine.remove(rve);
  return results[0];
}

/// Returns the coordination number of the grains that bear load. Grains with fewer than `least`
/// contacts are removed repeatedly, until each remaining grain has enough contacts.
double coordination_of_backbone(const Spheres &state, int least)
{
  std::vector<TouchingPairOf<3>> contacts = find_contacts(state);
  while (true) {
    std::vector<int> count(state.num_grains(), 0);
    for (const auto &contact : contacts) {
      ++count[contact.first];
      ++count[contact.second];
    }
    const auto idle = [&](const TouchingPairOf<3> &contact) {
      return count[contact.first] < least || count[contact.second] < least;
    };
    const auto end = std::remove_if(contacts.begin(), contacts.end(), idle);
    if (end == contacts.end()) {
      const auto bearing = std::count_if(count.begin(), count.end(), [](int n) { return n > 0; });
      return 2.0 * static_cast<double>(contacts.size()) / static_cast<double>(bearing);
    }
    contacts.erase(end, contacts.end());
  }
}

struct Sample {
  double solid_fraction, coordination;
};

/// Returns the mean results of `seeds` packings with consecutive seeds.
Sample mean_of_packings(PackingRecipe recipe, int seeds, int least_contacts)
{
  const auto engine = cpu_engine();
  Sample mean{0.0, 0.0};
  for (int k = 0; k < seeds; ++k, ++recipe.seed) {
    const Spheres packing = generate_packing(recipe, *engine);
    mean.solid_fraction += 1.0 / (1.0 + packing.void_ratio()) / seeds;
    mean.coordination += coordination_of_backbone(packing, least_contacts) / seeds;
  }
  return mean;
}

}    // namespace

TEST(LooseCloudOfSpheres, GrainsDoNotTouchAndFillTheAskedFraction)
{
  PackingRecipe recipe = sphere_recipe(3000, 100e3);
  for (const double fraction : {0.25, 0.33}) {
    if (fraction != 0.25) recipe.initial_solid_fraction = fraction;

    const Spheres cloud = loose_cloud<3>(recipe);

    EXPECT_EQ(cloud.num_grains(), 3000);
    EXPECT_TRUE(find_contacts(cloud).empty());
    EXPECT_NEAR(cloud.solid_volume() / cloud.cell_volume(), fraction, 1e-12);
  }
  recipe.initial_solid_fraction = 0.4;
  EXPECT_EQ(message_of([&] { loose_cloud<3>(recipe); }),
            "initial solid fraction [-] is 0.4; it must lie between 0.01 and 0.33");
}

TEST(SpherePacking, IsAtThePressureAndAtRest)
{
  const auto engine = cpu_engine();
  PackingRecipe recipe = sphere_recipe(200, 100e3);
  recipe.preparation_friction = 0.1;

  const Spheres packing = generate_packing(recipe, *engine);
  const ResultOf<3> result = evaluate(*engine, packing);

  for (int a = 0; a < 3; ++a) EXPECT_NEAR(-result.stress(a, a), 100e3, 1.01e-3 * 100e3);
  EXPECT_LE(result.unbalanced_ratio, 1.1e-3);
  EXPECT_EQ(result.kinetic_energy, 0.0);
  EXPECT_EQ(packing.material.friction, 0.5);
  EXPECT_EQ(packing.counters.steps, 0);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) EXPECT_EQ(packing.cell(a, b) == 0.0, a != b);
  EXPECT_EQ(engine->size(), 0);
  // The host finds the same contacts and forces; `mixed` has forces in fp32.
  const Tensor3 stress = spring_stress(packing);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(stress(a, b), result.stress(a, b), 1e-4 * 100e3);
  EXPECT_EQ(find_contacts(packing).size(), static_cast<std::size_t>(result.num_contacts));
}

TEST(SpherePacking, IsTheSameForAnyNumberOfThreadsAndInAnyBatch)
{
  std::vector<PackingRecipe> recipes(2, sphere_recipe(70, 50e3));
  recipes[1].seed = 2;
  recipes[1].radius_min = 0.004;
  const auto one = cpu_engine(1), two = cpu_engine(2);

  const Spheres first = generate_packing(recipes[0], *one);
  const Spheres second = generate_packing(recipes[1], *one);
  const auto batch = generate_packings(recipes, *two);

  EXPECT_EQ(serialize(batch[0].state), serialize(first));
  EXPECT_EQ(serialize(batch[1].state), serialize(second));
}

// Isostatic means that the number of contacts equals the number of translational degrees of
// freedom: 6 contacts per grain that bears load. The pressure adds a few contacts. The density is
// that of random close packing.
TEST(SpherePacking, WithoutFrictionIsDenseAndNearlyIsostatic)
{
  const Sample sample = mean_of_packings(sphere_recipe(250, 20e3), 2, 4);

  EXPECT_GT(sample.coordination, 5.95);
  EXPECT_LT(sample.coordination, 6.25);
  EXPECT_GT(sample.solid_fraction, 0.625);
  EXPECT_LT(sample.solid_fraction, 0.65);
}

// Agnolin and Roux (2007) found a solid fraction of 0.639 and 6 contacts without friction, and
// 0.593 and 4.5 contacts with a friction of 0.3.
TEST(SpherePacking, IsLooserWithFriction)
{
  PackingRecipe recipe = sphere_recipe(300, 20e3);
  recipe.material.friction = recipe.preparation_friction = 0.3;

  const Sample sample = mean_of_packings(recipe, 2, 2);

  EXPECT_GT(sample.coordination, 4.2);
  EXPECT_LT(sample.coordination, 4.9);
  EXPECT_GT(sample.solid_fraction, 0.575);
  EXPECT_LT(sample.solid_fraction, 0.615);
}

TEST(SpherePacking, MeetsAVoidRatio)
{
  const auto engine = cpu_engine();
  PackingRecipe recipe = sphere_recipe(200, 100e3);
  const double frictionless = generate_packing(recipe, *engine).void_ratio();
  for (const double wanted : {frictionless + 0.05, frictionless - 0.004}) {
    recipe.void_ratio = wanted;

    const Spheres packing = generate_packing(recipe, *engine);

    EXPECT_NEAR(packing.void_ratio(), wanted, recipe.void_ratio_tolerance + 1e-4);
    EXPECT_NEAR(evaluate(*engine, packing).mean_stress(), 100e3, 100.0);
  }
}

TEST(SpherePacking, BearsAnAnisotropicStress)
{
  const auto engine = cpu_engine();
  PackingRecipe recipe = sphere_recipe(200, 100e3);
  recipe.k0 = 0.5;

  const ResultOf<3> result = evaluate(*engine, generate_packing(recipe, *engine));

  for (int a = 0; a < 3; ++a) {
    const double goal = a == 2 ? 100e3 : 50e3;
    EXPECT_NEAR(-result.stress(a, a), goal, 1.01e-3 * goal);
  }
  EXPECT_LE(result.unbalanced_ratio, 1.1e-3);
}

// The stress ratio is beyond the Rankine states of these grains.
TEST(SpherePacking, AnisotropyBeyondTheStrengthIsReported)
{
  const auto engine = cpu_engine();
  PackingRecipe recipe = sphere_recipe(70, 100e3);
  recipe.k0 = 0.02;
  recipe.max_steps = 20000;

  const std::string message = message_of([&] { generate_packing(recipe, *engine); });

  EXPECT_TRUE(message.find("packing did not come to rest at 100000 [stress] within 20000 steps") ==
                  0 ||
              message.find("packing failed after") == 0)
      << message;
}

TEST(SpherePacking, GrainsThatWouldOverlapTooMuchAreAnErrorBeforeAnythingRuns)
{
  const auto engine = cpu_engine();

  const std::string message =
      message_of([&] { generate_packing(sphere_recipe(100, 1e7), *engine); });

  EXPECT_EQ(
      message.find(
          "overlap of the grains would be about 0.075 of their diameter (pressure * "
          "diameter / kn); it must be at most 0.05. With kn 1000000 [force/length] and diameter "
          "0.0075 [length], the pressure must be at most 6666666"),
      0u)
      << message;
}

// The packing comes from another program. The engine must find the same contacts and stress as YADE
// 2023.02a.
TEST(SpherePacking, PackingOfAnotherProgramHasItsStress)
{
  Material material = spheres_material();
  material.friction = 0.0;
  const Spheres packing = read_spheres(std::string(RVE_TEST_DATA) + "/spheres_S1.data", material);
  const Tensor3 stress_of_yade{{99999.98927964999, -933.7829796056193, 2199.819340765793,
                                -933.7829796056196, 100000.00476333787, -3702.956746431368,
                                2199.819340765792, -3702.9567464313645, 100000.00349474604}};
  ASSERT_EQ(packing.num_grains(), 1000);
  EXPECT_NEAR(packing.void_ratio(), 0.5396740837660419, 1e-12);

  const Tensor3 of_springs = spring_stress(packing);
  SphereRig rig(packing);
  const ResultOf<3> result = rig.advance(DriveOf<3>());

  EXPECT_EQ(result.num_contacts, 3006);
  EXPECT_EQ(result.coordination_number, 6.012);
  EXPECT_NEAR(result.largest_overlap, 0.0031376299647803475, 1e-11);
  EXPECT_NEAR(result.mean_overlap, 0.0005827118738537462, 1e-11);
  EXPECT_LT(result.unbalanced_ratio, 1e-9);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      EXPECT_NEAR(-of_springs(a, b), stress_of_yade(a, b), 1e-9 * 1e5);
      EXPECT_NEAR(-result.stress(a, b), stress_of_yade(a, b), 1e-8 * 1e5);
    }
}
