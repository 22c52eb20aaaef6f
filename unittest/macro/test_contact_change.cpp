// SPDX-License-Identifier: GPL-2.0-only
// Moves RVEs to an engine with another contact model. Either all RVEs move and keep their bits,
// numbers and shadows, or no RVE moves.

#include "macro/rve_points.h"

#include "rve/core/error.h"
#include "support/forwarding_engine.h"
#include "support/messages.h"
#include "support/packings.h"

#include <cstdlib>
#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

using macro::MacroStepOptions;
using macro::RvePoints;
using rve::Tensor2;

namespace {

constexpr double DT = 5e-5;
constexpr int RVES = 4;
/// Index of the RVE that is removed before the other RVEs move to the new engine.
constexpr int LEAVES = 1;
const std::vector<int> STAY = {0, 2, 3};

rve::Options cpu_options(bool rolling, rve::Format format = rve::Format::Mixed)
{
  rve::Options options;
  options.device = rve::Device::Cpu;
  options.format = format;
  options.threads = 1;
  options.contacts.rolling = rolling;
  return options;
}

rve::Material rough(rve::Material material)
{
  material.rolling_stiffness = 5e5;
  material.rolling_friction = 0.3;
  return material;
}

/// Returns four RVEs, one of which is removed; the last one has a shadow.
RvePoints points_with(std::unique_ptr<rve::Engine> engine, std::unique_ptr<rve::Engine> shadows)
{
  MacroStepOptions macro;
  macro.quiescent_strain = 1e-6;
  RvePoints points(std::move(engine), std::move(shadows), macro);
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots = points.add(std::vector<const rve::RveState *>(RVES, &packing));
  EXPECT_EQ(slots, (std::vector<int>{0, 1, 2, 3}));
  points.remove(LEAVES);
  points.add_shadow(3);
  return points;
}

RvePoints points_with(bool rolling)
{
  return points_with(rve::make_engine(cpu_options(rolling)),
                     rve::make_engine(cpu_options(rolling, rve::Format::Double)));
}

/// Advances the RVEs: the first one becomes quiescent, the others are sheared at different rates.
void advance(RvePoints &points, int steps)
{
  for (int step = 0; step < steps; ++step) {
    std::vector<rve::Drive> drives;
    for (const int slot : STAY)
      drives.push_back(rve::Drive::constant_velocity_gradient(
          {{-0.2 * slot, 0.6 * slot + 1e-7, 0.0, 0.0}}, DT, 20));
    EXPECT_TRUE(points.advance(STAY, drives, step % 2 == 1).empty());
  }
}

/// Returns the bytes, since some values are not numbers.
std::string bytes_of(const std::vector<double> &record)
{
  return {reinterpret_cast<const char *>(record.data()), record.size() * sizeof(double)};
}

std::vector<std::string> records(const RvePoints &points)
{
  std::vector<std::string> all;
  for (const int slot : STAY) all.push_back(bytes_of(points.record(slot)));
  return all;
}

/// An engine that accepts at most `room` RVEs. Engines that it makes accept at most `room_of_next`
/// RVEs.
class NarrowEngine final : public rve_test::ForwardingEngine {
 public:
  NarrowEngine(std::unique_ptr<rve::Engine> engine_in, int room_in, int room_of_next_in) :
      ForwardingEngine(std::move(engine_in)), room(room_in), room_of_next(room_of_next_in)
  {
  }
  std::unique_ptr<rve::Engine> empty_with(const rve::ContactModel &contacts) const override
  {
    return std::make_unique<NarrowEngine>(engine->empty_with(contacts), room_of_next, 1000);
  }
  int add(const rve::RveState &state) override
  {
    if (room-- == 0) throw std::runtime_error("there is no room");
    return engine->add(state);
  }

 private:
  int room, room_of_next;
};

}    // namespace

TEST(ContactChange, GivesTheBitsOfANewEngineWithTheseContacts)
{
  RvePoints moves = points_with(false), stays = points_with(true);
  advance(moves, 5);
  advance(stays, 5);
  ASSERT_TRUE(moves.point(0).is_quiescent());
  ASSERT_TRUE(records(moves) == records(stays));

  for (RvePoints *points : {&moves, &stays})
    points->set_materials({2, 3}, {rough(points->material(2)), rough(points->material(3))});

  EXPECT_TRUE(moves.contacts().rolling);
  EXPECT_EQ(moves.size(), 3);
  EXPECT_TRUE(records(moves) == records(stays));
  advance(moves, 5);
  advance(stays, 5);
  EXPECT_TRUE(records(moves) == records(stays));
  EXPECT_GE(moves.point(3).shadow, 0);
  EXPECT_TRUE(moves.state(2).has_rolling_forces());
  EXPECT_FALSE(moves.state(0).has_rolling_forces());
  // The number of the removed RVE can be used again.
  const rve::RveState packing = rve_test::packing_of_400();
  EXPECT_EQ(moves.add({&packing}), (std::vector<int>{LEAVES}));
}

// The rolling spring is the same for every law with rolling resistance. A change to another law
// with rolling resistance therefore keeps the rolling force, and a change to a law without it drops
// the force.
TEST(ContactChange, ToAnotherLawKeepsRollingForcesWhereTheLawHasThem)
{
  for (const bool rolls : {true, false}) {
    RvePoints points = points_with(true);
    for (const int slot : STAY) points.set_materials({slot}, {rough(points.material(slot))});
    advance(points, 5);
    const rve::RveState before = points.state(2);
    ASSERT_TRUE(before.has_rolling_forces());
    std::vector<rve::Material> hertz;
    for (const int slot : STAY) {
      rve::Material material = points.material(slot);
      material.law = rve::ContactLaw::Hertz;
      material.normal_stiffness = material.tangential_stiffness = 0.0;
      material.hertz_stiffness = 2e9;
      material.mindlin_stiffness = 1.7e9;
      if (!rolls) material.rolling_stiffness = material.rolling_friction = 0.0;
      hertz.push_back(material);
    }

    points.set_materials({STAY.begin(), STAY.end()}, hertz);

    EXPECT_EQ(points.contacts(), (rve::ContactModel{rve::ContactLaw::Hertz, rolls}));
    const rve::RveState after = points.state(2);
    ASSERT_EQ(after.pairs.size(), before.pairs.size());
    for (std::size_t k = 0; k < before.pairs.size(); ++k) {
      EXPECT_NEAR(after.pairs[k].rolling_force, rolls ? before.pairs[k].rolling_force : 0.0, 0.0);
      EXPECT_EQ(after.pairs[k].tangential_force, before.pairs[k].tangential_force);
    }
    advance(points, 5);
    EXPECT_EQ(points.state(2).has_rolling_forces(), rolls);
  }
}

TEST(ContactChange, AppliesToRvesThatAreAddedLater)
{
  RvePoints moves = points_with(false), stays = points_with(true);
  advance(moves, 5);
  advance(stays, 5);
  stays.set_materials({3}, {rough(stays.material(3))});
  advance(stays, 2);
  const std::vector<double> record = stays.record(3);
  const std::vector<std::string> before = records(moves);

  const int slot = moves.add_record(record.data(), record.size());

  EXPECT_EQ(slot, LEAVES);
  EXPECT_TRUE(bytes_of(moves.record(slot)) == bytes_of(record));
  EXPECT_TRUE(records(moves) == before);
  EXPECT_TRUE(moves.contacts().rolling);
}

TEST(ContactChange, RefusalForLackOfMemoryChangesNothing)
{
  RvePoints points = points_with(false), other = points_with(false);
  advance(points, 5);
  advance(other, 5);
  const std::vector<std::string> before = records(points);

  setenv("GPU_RVE_MEMORY_LIMIT", "1000", 1);
  const std::string message =
      rve_test::message_of([&] { points.set_materials({2}, {rough(points.material(2))}); });
  unsetenv("GPU_RVE_MEMORY_LIMIT");

  EXPECT_NE(message.find("RVEs with contact law hooke with rolling resistance need "),
            std::string::npos)
      << message;
  EXPECT_NE(message.find("MB more of the memory of the host"), std::string::npos) << message;
  EXPECT_FALSE(points.contacts().rolling);
  EXPECT_TRUE(records(points) == before);
  advance(points, 3);
  advance(other, 3);
  EXPECT_TRUE(records(points) == records(other));
}

TEST(ContactChange, FailureHalfwayRestoresTheEngine)
{
  RvePoints other = points_with(false);
  for (int room = 0; room < RVES; ++room) {
    SCOPED_TRACE(room);
    RvePoints points = points_with(
        std::make_unique<NarrowEngine>(rve::make_engine(cpu_options(false)), 1000, room),
        rve::make_engine(cpu_options(false, rve::Format::Double)));
    const std::vector<std::string> before = records(points);

    EXPECT_THROW(points.set_materials({2}, {rough(points.material(2))}), std::runtime_error);

    EXPECT_FALSE(points.contacts().rolling);
    EXPECT_EQ(points.size(), 3);
    EXPECT_EQ(points.material(2).rolling_friction, 0.0);
    EXPECT_TRUE(records(points) == before);
    advance(points, 2);
    if (room == 0) advance(other, 2);
    EXPECT_TRUE(records(points) == records(other));
  }
}

TEST(ContactChange, WithAMaterialOutOfRangeChangesNothing)
{
  RvePoints points = points_with(false);
  advance(points, 3);
  const std::vector<std::string> before = records(points);
  rve::Material wrong = rough(points.material(3));
  wrong.normal_stiffness = -1.0;

  const std::string message = rve_test::message_of([&] {
    points.set_materials({2, 3}, {rough(points.material(2)), wrong});
  });

  EXPECT_NE(message.find("normal stiffness is -1"), std::string::npos) << message;
  EXPECT_FALSE(points.contacts().rolling);
  EXPECT_TRUE(records(points) == before);
}
