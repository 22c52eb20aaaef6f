// SPDX-License-Identifier: GPL-2.0-only
// The kernel variant for grains without friction omits tangential forces, torques and contact
// histories. It gives the same results as the general variant with a friction coefficient of zero.
// The same source is compiled for a CPU and, with RVE_TEST_CUDA, for a GPU.

#include "support/on_device.h"

#include "rve/engine/finite_strain.h"
#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
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

/// Returns ten calls that shear to 10 %, with more than a hundred rebuilds.
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

/// Runs the packing without friction. If `company` is true, the engine also has an RVE with
/// friction and therefore uses the general kernel variant.
Course run(Format format, bool company)
{
  const RveState state = without_friction();
  const auto engine = make_engine(device_options(format));
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

bool untouched_by_friction(const RveState &state)
{
  return std::all_of(state.spin.begin(), state.spin.end(),
                     [](double spin) { return spin == 0.0; }) &&
      std::all_of(state.pairs.begin(), state.pairs.end(),
                  [](const Pair &pair) { return pair.tangential_force == 0.0; });
}

}    // namespace

class Frictionless : public OnDevice {};

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

TEST_P(Frictionless, NoForceRotatesAGrain)
{
  EXPECT_TRUE(untouched_by_friction(run(GetParam(), false).end));
}

// Initial spins do not change.
TEST_P(Frictionless, InitialSpinsStayConstant)
{
  RveState state = without_friction();
  for (int i = 0; i < state.num_grains(); ++i) state.spin[i] = 0.5 * (i % 7) - 1.0;
  RveRig rig(state, device_options(GetParam()));

  rig.advance(shear(state)[0]);

  EXPECT_EQ(rig.state().spin, state.spin);
}

// The initial state has tangential forces. Without friction, the limit of tangential forces is
// zero, so that these forces vanish in the first step.
TEST_P(Frictionless, TangentialForcesOfTheStateVanishInTheFirstStep)
{
  RveState state = paper_packing();
  RveRig rig(state, device_options(GetParam()));
  const double dt = 0.5 * stable_time_step(state);
  rig.advance(Drive::constant_velocity_gradient(Tensor2{{0.0, 0.05, 0.0, 0.0}}, dt, 1000));
  RveState sheared = rig.state();
  sheared.material.friction = 0.0;
  RveRig without(sheared, device_options(GetParam()));

  without.advance(Drive::constant_velocity_gradient(Tensor2::zero(), dt, 1));

  const RveState after = without.state();
  EXPECT_TRUE(std::any_of(sheared.pairs.begin(), sheared.pairs.end(),
                          [](const Pair &pair) { return pair.tangential_force != 0.0; }));
  EXPECT_TRUE(std::all_of(after.pairs.begin(), after.pairs.end(),
                          [](const Pair &pair) { return pair.tangential_force == 0.0; }));
}

#if defined(RVE_TEST_CUDA)

// Compares the kernels for few RVEs, for many RVEs, for large RVEs, and with grains in memory.
TEST_P(Frictionless, EveryKernelGivesTheBitsOfTheCpu)
{
  const RveState state = without_friction();
  const Drive drive = shear(state)[0];
  RveRig cpu(state, cpu_options(GetParam()));
  cpu.advance(drive);
  struct {
    const char *kernel;
    int block, count;
  } const cases[] = {{"few", 0, 2}, {"many", 0, 300}, {"large", 1024, 2}, {"in memory", 96, 2}};

  for (const auto &one : cases) {
    SCOPED_TRACE(one.kernel);
    Options options = device_options(GetParam());
    options.block_size = one.block;
    const auto engine = make_engine(options);
    std::vector<int> rves;
    for (int k = 0; k < one.count; ++k) rves.push_back(engine->add(state));
    std::vector<Result> results;

    engine->advance(rves, std::vector<Drive>(rves.size(), drive), results);

    for (const Result &result : results) EXPECT_TRUE(same_answer(result, cpu.result()));
    EXPECT_EQ(serialize(engine->state(rves.back())), serialize(cpu.state()));
  }
}

// An approximate root gives a distance a relative error of 2^-22. Overlaps are a thousandth of a
// distance, so that their relative error is a thousand times as large.
TEST_P(Frictionless, RelaxedStressIsWithinTheErrorOfARoot)
{
  if (GetParam() == Format::Double) GTEST_SKIP() << "double has no relaxed arithmetic";
  const RveState state = without_friction();
  Options options = device_options(GetParam());
  options.arithmetic = Arithmetic::Relaxed;
  RveRig relaxed(state, options), strict(state, device_options(GetParam()));
  Drive drive = shear(state)[0];
  drive.substeps = 1;
  drive.deformation = Tensor2::identity();

  const Tensor2 stress = relaxed.advance(drive).stress;

  const Tensor2 expected = strict.advance(drive).stress;
  EXPECT_LT(norm(stress - expected), 1e-3 * norm(expected));
  relaxed.advance(shear(state)[0]);
  EXPECT_TRUE(untouched_by_friction(relaxed.state()));
}

#endif

#if defined(RVE_TEST_CUDA)
const auto FORMATS = testing::Values(Format::Fast, Format::Mixed, Format::Double);
#else    // only a CPU has the format `single`
const auto FORMATS = testing::Values(Format::Fast, Format::Mixed, Format::Double, Format::Single);
#endif
INSTANTIATE_TEST_SUITE_P(Formats, Frictionless, FORMATS,
                         [](const auto &info) { return to_string(info.param); });
