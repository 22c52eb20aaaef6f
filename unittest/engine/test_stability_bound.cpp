// SPDX-License-Identifier: GPL-2.0-only
// Tests the bounds of time steps that an engine computes for its RVEs. A computed bound must never
// exceed the exact bound of the state, which is stable_time_step(). A computed bound below the
// requested step (`enough`) must be within a few per cent of the exact bound. The same source is
// compiled for a CPU and, with RVE_TEST_CUDA, for a GPU.

#include "support/on_device.h"
#include "support/packings.h"

#include "rve/engine/finite_strain.h"
#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

/// Largest allowed ratio of the exact bound to the computed bound [-]. fix rve relies on computed
/// bounds with an error of at most 5 % and warns of time steps above 0.95 of the stability bound.
constexpr double LOOSEST = 1.05;

class StabilityBound : public OnDevice {
 protected:
  double bound(const RveState &state, double enough) const
  {
    const auto engine = make_engine(with_contacts_of({state}, device_options(GetParam())));
    std::vector<double> bounds;
    engine->bound_time_steps({engine->add(state)}, enough, bounds);
    return bounds.at(0);
  }
  /// Returns the most accurate bound. The engine computes it if the requested step is long.
  double sharp_bound(const RveState &state) const
  {
    return bound(state, 10.0 * stable_time_step(state));
  }
  void expect_sharp(const RveState &state) const
  {
    const double exact = stable_time_step(state), found = sharp_bound(state);
    EXPECT_LE(found, exact);
    EXPECT_GE(found, exact / LOOSEST);
  }
};

/// Returns the state after a strain at which other contacts bear the load.
RveState strained(const RveState &state, const Tensor2 &gradient, double strain)
{
  RveRig rig(state);
  const double dt = 0.5 * stable_time_step(state);
  rig.strain(gradient, dt, static_cast<int>(strain / (norm(gradient) * dt)));
  return rig.state();
}

}    // namespace

// Two grains with the masses m_i and m_j and one contact with the stiffness k_n have the squared
// frequency k_n (1/m_i + 1/m_j) along the normal. Along the tangent, the squared frequency is
// k_t (1/m_i + 1/m_j) and additional terms from the rotation of the grains.
TEST_P(StabilityBound, IsThatOfOneContact)
{
  for (const double stiffness : {0.0, 1e5, 1e6}) {
    RveState state = two_disks(1e-4);
    state.material.tangential_stiffness = stiffness;
    expect_sharp(state);
  }
}

TEST_P(StabilityBound, IsCloseInDenseAndLoosePackings)
{
  for (const char *file : {"A_h0075.rve", "A20_h0075.rve", "A_h1.rve"}) {
    SCOPED_TRACE(file);
    const RveState packing = paper_packing(file);
    expect_sharp(packing);
    expect_sharp(strained(packing, gradient(0, 1, 0.5), 0.05));
    expect_sharp(strained(packing, 0.3 * Tensor2::identity(), 0.005));
    expect_sharp(strained(packing, -0.3 * Tensor2::identity(), 0.005));
  }
}

TEST_P(StabilityBound, IsCloseForAllContactLaws)
{
  struct {
    const char *what;
    double tangential, friction, rolling, normal_viscosity, tangential_viscosity;
  } const cases[] = {{"no friction", 1e6, 0.0, 0.0, 0.0, 0.0},
                     {"soft tangent", 2e5, 0.5, 0.0, 0.0, 0.0},
                     {"stiff tangent", 5e6, 0.5, 0.0, 0.0, 0.0},
                     {"rolling", 1e6, 0.5, 1e6, 0.0, 0.0},
                     {"stiff against rolling", 1e6, 0.5, 1e8, 0.0, 0.0},
                     {"weak dashpots", 1e6, 0.5, 0.0, 10.0, 10.0},
                     {"strong dashpots", 1e6, 0.5, 0.0, 1000.0, 100.0},
                     {"dashpots and rolling", 1e6, 0.5, 1e6, 100.0, 100.0}};
  for (const auto &one : cases) {
    SCOPED_TRACE(one.what);
    RveState state = paper_packing();
    state.material.tangential_stiffness = one.tangential;
    state.material.friction = one.friction;
    state.material.rolling_stiffness = one.rolling;
    state.material.rolling_friction = one.rolling > 0.0 ? 0.3 : 0.0;
    state.material.normal_viscosity = one.normal_viscosity;
    state.material.tangential_viscosity = one.tangential_viscosity;
    expect_sharp(state);
  }
}

TEST_P(StabilityBound, IsCloseForGrainsOfAllSizes)
{
  // In a lattice of disks, about 30 % of the disks shrink, by a factor of up to 20. The radii of
  // the other disks grow by 10 %.
  RveState state = triangular_packing(paper_material(), 12, 12, 0.004, 3);
  Random random(5);
  for (const double smallest : {0.5, 0.1, 0.05}) {
    SCOPED_TRACE(smallest);
    RveState mixture = state;
    for (double &r : mixture.radius)
      r *= random.uniform(0.0, 1.0) < 0.3 ? smallest * random.uniform(1.0, 2.0) : 1.1;
    expect_sharp(mixture);
  }
}

TEST_P(StabilityBound, WithoutContactsIsThatOfTheFirstContact)
{
  const RveState gas = paper_gas();
  const double exact = stable_time_step(gas), found = sharp_bound(gas);
  EXPECT_LE(found, exact);
  EXPECT_GE(found, exact / LOOSEST);
}

// A computed bound far above the requested step is allowed to be inaccurate. But the computed bound
// must be below the requested step if and only if the exact bound is below the requested step. The
// requested steps differ by at least 5 % from the exact bound, since the computed bound has an
// error of up to 5 %.
TEST_P(StabilityBound, DecidesIfAStepIsStable)
{
  const RveState state = paper_packing();
  const double exact = stable_time_step(state);
  for (const double share : {0.1, 0.5, 0.8, 0.9, 0.95}) {
    const double found = bound(state, share * exact);
    EXPECT_GE(found, share * exact) << share;
    EXPECT_LE(found, exact) << share;
  }
  for (const double share : {1.05, 1.5}) EXPECT_LT(bound(state, share * exact), share * exact);
}

// The computation of bounds changes no state. The bound of an RVE is the same in a batch and alone.
TEST_P(StabilityBound, ChangesNothingAndDependsOnNothingElse)
{
  const auto engine = make_engine(device_options(GetParam()));
  std::vector<RveState> states;
  for (const char *file : {"A_h0075.rve", "A20_h0075.rve", "A_h1.rve"})
    states.push_back(strained(paper_packing(file), gradient(0, 1, 0.5), 0.01));
  states.push_back(paper_gas());
  std::vector<int> rves;
  for (const RveState &state : states) rves.push_back(engine->add(state));
  std::vector<Result> results;
  const Drive drive = Drive::constant_velocity_gradient(gradient(0, 1, 0.1), 2e-5, 50);
  engine->advance(rves, std::vector<Drive>(rves.size(), drive), results);
  std::vector<std::vector<char>> before;
  for (const int rve : rves) before.push_back(serialize(engine->state(rve)));
  const double enough = 1e-4;
  std::vector<double> together;

  engine->bound_time_steps(rves, enough, together);

  for (std::size_t k = 0; k < rves.size(); ++k) {
    EXPECT_EQ(serialize(engine->state(rves[k])), before[k]);
    EXPECT_EQ(bound(engine->state(rves[k]), enough), together[k]);
  }
}

#if defined(RVE_TEST_CUDA)

TEST_P(StabilityBound, OfTheGpuHasTheBitsOfTheCpu)
{
  RveState rolling = paper_packing();
  rolling.material.rolling_stiffness = 1e6;
  rolling.material.rolling_friction = 0.3;
  rolling.material.normal_viscosity = 10.0;
  for (const RveState &state : {paper_packing(), rolling, paper_gas()}) {
    const double enough = 2.0 * stable_time_step(state);
    const auto cpu = make_engine(with_contacts_of({state}, cpu_options(GetParam())));
    std::vector<double> expected;
    cpu->bound_time_steps({cpu->add(state)}, enough, expected);
    EXPECT_EQ(bound(state, enough), expected[0]);
    for (const int block : {96, 1024}) {
      Options options = with_contacts_of({state}, device_options(GetParam()));
      options.block_size = block;
      const auto engine = make_engine(options);
      std::vector<double> found;
      engine->bound_time_steps({engine->add(state)}, enough, found);
      EXPECT_EQ(found, expected);
    }
  }
}

#endif

INSTANTIATE_TEST_SUITE_P(Formats, StabilityBound,
                         testing::Values(Format::Fast, Format::Mixed, Format::Double),
                         [](const auto &info) { return to_string(info.param); });
