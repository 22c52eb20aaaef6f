// The preparation of packings of spheres on the CPU engine, and a packing of another program.

#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/packing.h"
#include "support/messages.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

using Spheres = RveStateOf<3>;

PackingRecipe sphere_recipe(int num_grains, double pressure)
{
  PackingRecipe recipe;
  recipe.material = paper_material();
  recipe.material.thickness = 1.0;
  recipe.num_grains = num_grains;
  recipe.radius_min = 0.0025;
  recipe.radius_max = 0.005;
  recipe.pressure = pressure;
  return recipe;
}

std::unique_ptr<EngineOf<3>> cpu_engine(int threads = 1)
{
  Options options;
  options.contacts.dimension = 3;
  options.device = Device::Cpu;
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

/// Coordination number without grains that bear nothing, which have fewer than four contacts: taken out until none is left.
double coordination_of_backbone(const Spheres &state)
{
  std::vector<TouchingPairOf<3>> contacts = find_contacts(state);
  while (true) {
    std::vector<int> count(state.num_grains(), 0);
    for (const auto &contact : contacts) {
      ++count[contact.first];
      ++count[contact.second];
    }
    const auto idle = [&](const TouchingPairOf<3> &contact) {
      return count[contact.first] < 4 || count[contact.second] < 4;
    };
    const auto end = std::remove_if(contacts.begin(), contacts.end(), idle);
    if (end == contacts.end()) {
      const auto bearing = std::count_if(count.begin(), count.end(), [](int n) {
        return n > 0;
      });
      return 2.0 * static_cast<double>(contacts.size()) / static_cast<double>(bearing);
    }
    contacts.erase(end, contacts.end());
  }
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
  EXPECT_EQ(message_of([&] {
              loose_cloud<3>(recipe);
            }),
            "initial solid fraction [-] is 0.4; it must lie between 0.01 and 0.33");
}

TEST(SpherePacking, IsAtThePressureAndAtRest)
{
  const auto engine = cpu_engine();
  PackingRecipe recipe = sphere_recipe(300, 100e3);

  const Spheres packing = generate_packing(recipe, *engine);
  const ResultOf<3> result = evaluate(*engine, packing);

  for (int a = 0; a < 3; ++a) EXPECT_NEAR(-result.stress(a, a), 100e3, 1.01e-3 * 100e3);
  EXPECT_LE(result.unbalanced_ratio, 1.1e-3);
  EXPECT_EQ(packing.material.friction, 0.5);
  EXPECT_EQ(engine->size(), 0);
  // the springs of the state, found on the host, bear it
  const Tensor3 stress = spring_stress(packing);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(stress(a, a) / result.stress(a, a), 1.0, 1e-4);
  const double z = coordination_of_backbone(packing);
  printf("e %.4f phi %.4f Z %.3f Zb %.3f steps\n", result.void_ratio, 1 / (1 + result.void_ratio),
         result.coordination_number, z);
}
