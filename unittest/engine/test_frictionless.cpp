// Grains without friction have a program of their own on a CPU, which leaves tangential forces, torques and contact histories out: what
// it answers is what the other program answers with a coefficient of zero.

#include "support/rve_rig.h"

#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

RveState without_friction()
{
  RveState state = paper_packing();
  state.material.friction = 0.0;
  state.pairs.clear();
  return state;
}

/// Sheared to 10 % in ten calls, with a hundred new lists and more.
std::vector<Drive> shear(const RveState &state)
{
  const double dt = 0.8 * stable_time_step(state);
  return std::vector<Drive>(
      10,
      Drive::constant_velocity_gradient(Tensor2{{0.0, 0.01 / (1000 * dt), 0.0, 0.0}}, dt, 1000));
}

struct Course {
  std::vector<Result> results;
  RveState end;
};

/// Beside grains with friction, which keep the batch from the program without it, if `company`.
Course run(Format format, bool company)
{
  const RveState state = without_friction();
  const auto engine = make_engine(cpu_options(format));
  const int rve = engine->add(state);
  if (company) engine->add(paper_packing());
  Course course;
  for (const Drive &drive : shear(state)) {
    std::vector<Result> results;
    engine->advance({rve}, {drive}, results);
    course.results.push_back(results[0]);
  }
  course.end = engine->state(rve);
  return course;
}

}    // namespace

class Frictionless : public testing::TestWithParam<Format> {};

TEST_P(Frictionless, GrainsMoveAsWithACoefficientOfZero)
{
  const Course alone = run(GetParam(), false), beside = run(GetParam(), true);

  for (std::size_t k = 0; k < alone.results.size(); ++k) {
    const Result &one = alone.results[k], &other = beside.results[k];
    ASSERT_EQ(components(one.stress), components(other.stress)) << "call " << k;
    ASSERT_EQ(one.num_contacts, other.num_contacts);
    ASSERT_EQ(one.sliding_fraction, other.sliding_fraction);
    ASSERT_EQ(one.unbalanced_ratio, other.unbalanced_ratio);
    ASSERT_EQ(one.elastic_energy, other.elastic_energy);
  }
  EXPECT_EQ(serialize(alone.end), serialize(beside.end));
  EXPECT_GT(alone.end.counters.rebuilds, 100);
}

TEST_P(Frictionless, NoForceTurnsAGrain)
{
  const RveState end = run(GetParam(), false).end;

  EXPECT_TRUE(std::all_of(end.spin.begin(), end.spin.end(), [](double spin) {
    return spin == 0.0;
  }));
  EXPECT_TRUE(std::all_of(end.pairs.begin(), end.pairs.end(), [](const Pair &pair) {
    return pair.tangential_force == 0.0;
  }));
}

// A tangential force that a state brings along is at its limit of zero after the first step, also without friction.
TEST_P(Frictionless, TangentialForcesOfTheStateVanishInTheFirstStep)
{
  RveState state = paper_packing();
  RveRig rig(state, cpu_options(GetParam()));
  const double dt = 0.5 * stable_time_step(state);
  rig.advance(Drive::constant_velocity_gradient(Tensor2{{0.0, 0.05, 0.0, 0.0}}, dt, 1000));
  RveState sheared = rig.state();
  sheared.material.friction = 0.0;
  RveRig without(sheared, cpu_options(GetParam()));

  without.advance(Drive::constant_velocity_gradient(Tensor2::zero(), dt, 1));

  const RveState after = without.state();
  EXPECT_TRUE(std::any_of(sheared.pairs.begin(), sheared.pairs.end(), [](const Pair &pair) {
    return pair.tangential_force != 0.0;
  }));
  EXPECT_TRUE(std::all_of(after.pairs.begin(), after.pairs.end(), [](const Pair &pair) {
    return pair.tangential_force == 0.0;
  }));
}

INSTANTIATE_TEST_SUITE_P(Formats, Frictionless,
                         testing::Values(Format::Fast, Format::Mixed, Format::Double,
                                         Format::Single),
                         [](const auto &info) {
                           return to_string(info.param);
                         });
