// SPDX-License-Identifier: GPL-2.0-only
// Large friction: no contact slides, as if grains were cogs. The integer sums must be scaled for
// the actual forces and not for the friction limit. The same source is compiled for a CPU and, with
// RVE_TEST_CUDA, for a GPU.

#include "support/on_device.h"

#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double COEFFICIENTS[] = {100.0, 1e3, 1e5, 1e8, 1e10};

/// Returns a packing at rest under 20 kPa with this friction. With `rolling`, the rolling friction
/// has the same value.
RveState rough_packing(double friction, bool rolling)
{
  RveState state = paper_packing("A20_h0075.rve");
  state.material.friction = friction;
  if (rolling) {
    state.material.rolling_stiffness = state.material.tangential_stiffness;
    state.material.rolling_friction = friction;
  }
  return state;
}

/// Returns the relative rounding error of a pressure in the format. The error comes from the last
/// digits of an overlap and of a force, as with usual friction coefficients.
double pressure_error(Format format)
{
  return format == Format::Double ? 1e-12 : format == Format::Mixed ? 1e-6 : 1e-5;
}

/// Returns the relative error of a pressure after shear(), in which rounding errors grow. Forces
/// are fp32 except in `double`.
double sheared_error(Format format)
{
  return format == Format::Double ? 1e-11 : 1e-4;
}

/// Shears the packing by 0.2 % and compresses both axes by half of this. The first calls have the
/// length of a macro step, the last two are longer.
const Result &shear(RveRig &rig, double dt)
{
  rig.strain(Tensor2{{-0.05, 0.1, 0.0, -0.05}}, dt, 10, 20);
  return rig.strain(Tensor2{{-0.05, 0.1, 0.0, -0.05}}, dt, 100, 2);
}

class LargeFriction : public OnDevice {
 protected:
  RveRig rig(const RveState &state) const { return RveRig(state, device_options(GetParam())); }
};

}    // namespace

TEST_P(LargeFriction, FirstPressureIsCorrect)
{
  for (const bool rolling : {false, true})
    for (const double friction : COEFFICIENTS) {
      SCOPED_TRACE(std::to_string(friction) + (rolling ? " rolling" : ""));
      const RveState state = rough_packing(friction, rolling);
      const double expected = RveRig(paper_packing("A20_h0075.rve")).evaluate().mean_stress();

      const Result result = rig(state).evaluate();

      ASSERT_EQ(result.status, status::Ok);
      EXPECT_NEAR(result.mean_stress(), expected, pressure_error(GetParam()) * expected);
    }
}

TEST_P(LargeFriction, PressureAfterShearIsThatOfDouble)
{
  for (const bool rolling : {false, true})
    for (const double friction : COEFFICIENTS) {
      SCOPED_TRACE(std::to_string(friction) + (rolling ? " rolling" : ""));
      const RveState state = rough_packing(friction, rolling);
      const double dt = 0.5 * stable_time_step(state);
      RveRig exact(state), rough = rig(state);
      const double expected = shear(exact, dt).mean_stress();

      const Result &result = shear(rough, dt);

      ASSERT_EQ(result.status, status::Ok) << describe_status(result.status);
      EXPECT_NEAR(result.mean_stress(), expected, sheared_error(GetParam()) * expected);
    }
  const RveState common = paper_packing("A20_h0075.rve");
  const double dt = 0.5 * stable_time_step(common);
  RveRig exact(common), here = rig(common);
  const double expected = shear(exact, dt).mean_stress();
  EXPECT_NEAR(shear(here, dt).mean_stress(), expected, sheared_error(GetParam()) * expected);
}

// Beyond some coefficient no contact slides, and results do not depend on the coefficient.
TEST_P(LargeFriction, WithoutSlidingTheCoefficientHasNoEffect)
{
  const double dt = 0.5 * stable_time_step(rough_packing(1e6, true));
  RveRig some = rig(rough_packing(1e6, true)), more = rig(rough_packing(1e10, true));

  shear(some, dt);

  EXPECT_EQ(some.result().sliding_fraction, 0.0);
  EXPECT_TRUE(same_answer(shear(more, dt), some.result()));
}

// The first force scale is estimated from normal forces. Tangential forces of the state can be much
// larger.
TEST_P(LargeFriction, LargeTangentialForcesOfAStateFitTheScale)
{
  RveState state = two_disks(1e-6);
  state.material.friction = 1e8;
  state.material.local_damping = 0.0;
  const double normal = state.material.normal_stiffness * 1e-6, tangential = 1e7 * normal;
  state.pairs = {{0, 1, tangential}};
  state.list_cell = state.cell;
  state.list_fractional = state.fractional;
  RveRig disks = rig(state);
  const double dt = 1e-12;

  const Result result = disks.strain(Tensor2::zero(), dt, 1);

  ASSERT_EQ(result.status, status::Ok) << describe_status(result.status);
  EXPECT_GT(result.counters.repeats, 0);
  EXPECT_NEAR(result.largest_contact_force, tangential, 1e-6 * tangential);
  const RveState after = disks.state();
  for (int i = 0; i < 2; ++i) {
    const double r = state.radius[i];
    const double mass = state.material.density * state.material.mass_depth * M_PI * r * r;
    // The torque of the tangential force accelerates the spin. Its lever arm is the radius minus
    // half the overlap.
    EXPECT_NEAR(after.spin[i], 2.0 * tangential / (mass * r) * dt, 1e-3 * std::fabs(after.spin[i]));
  }
}

// The overlap limit does not apply to tangential springs, even if they are stretched by more than
// the largest allowed overlap.
TEST_P(LargeFriction, TangentialForcesDoNotExceedTheOverlapLimit)
{
  RveState state = two_disks(1e-6);
  state.material.friction = 1e8;
  state.material.local_damping = 0.0;
  // a spring stretched by ten radii
  state.pairs = {{0, 1, 10.0 * state.material.tangential_stiffness * state.radius[0]}};
  state.list_cell = state.cell;
  state.list_fractional = state.fractional;

  const Result result = rig(state).strain(Tensor2::zero(), 1e-12, 3);

  EXPECT_EQ(result.status, status::Ok) << describe_status(result.status);
}

TEST_P(LargeFriction, CanBeRaisedOnAnExistingRve)
{
  RveRig living = rig(paper_packing("A20_h0075.rve"));
  Material rough = living.state().material;
  rough.friction = 1e8;
  const double dt = 0.5 * stable_time_step(living.state());
  shear(living, dt);
  RveState state = living.state();
  state.material = rough;
  RveRig fresh = rig(state);

  living.owner().set_material(living.rve_number(), rough);

  EXPECT_EQ(shear(living, dt).status, status::Ok);
  shear(fresh, dt);
  EXPECT_TRUE(same_answer(living.result(), fresh.result()));
  EXPECT_EQ(serialize(living.state()), serialize(fresh.state()));
}

TEST_P(LargeFriction, AContinuedRveHasTheSameBits)
{
  const RveState state = rough_packing(1e8, false);
  const double dt = 0.5 * stable_time_step(state);
  RveRig whole = rig(state), first = rig(state);
  shear(whole, dt);
  shear(first, dt);

  RveRig second = rig(first.state());

  EXPECT_TRUE(same_answer(shear(whole, dt), shear(second, dt)));
  EXPECT_EQ(serialize(whole.state()), serialize(second.state()));
}

TEST_P(LargeFriction, KeepsMomentum)
{
  RveState state = rough_packing(1e8, true);
  state.material.local_damping = 0.0;
  RveRig rough = rig(state);
  const double dt = 0.5 * stable_time_step(state);

  shear(rough, dt);

  const RveState after = rough.state();
  double momentum[2] = {0.0, 0.0}, size = 0.0;
  for (int i = 0; i < after.num_grains(); ++i) {
    const double mass = after.radius[i] * after.radius[i];
    for (int a = 0; a < 2; ++a) {
      momentum[a] += mass * after.velocity[2 * i + a];
      size += mass * std::fabs(after.velocity[2 * i + a]);
    }
  }
  // Contact forces cancel exactly, but each kick rounds a velocity.
  const double rounding = GetParam() == Format::Double ? 1e-12 : 1e-4;
  for (const double component : momentum) EXPECT_LT(std::fabs(component), rounding * size);
}

TEST_P(LargeFriction, WorkGoesIntoSpringsAndMotion)
{
  RveState state = rough_packing(1e8, false);
  state.material.local_damping = 0.0;
  Options options = device_options(GetParam());
  options.track_energy = true;
  RveRig rough(state, options);
  const Result before = rough.evaluate();

  const Result &after = shear(rough, 0.1 * stable_time_step(state));

  const double stored =
      after.elastic_energy - before.elastic_energy + after.kinetic_energy - before.kinetic_energy;
  // A contact that opens loses the energy of its tangential spring. The bookkeeping counts this as
  // friction.
  EXPECT_NEAR(after.energy.work, stored + after.energy.friction, 2e-2 * after.energy.work);
}

#if defined(RVE_TEST_CUDA)

TEST_P(LargeFriction, TheGpuHasTheBitsOfTheCpu)
{
  for (const bool rolling : {false, true}) {
    const RveState state = rough_packing(1e8, rolling);
    const double dt = 0.5 * stable_time_step(state);
    RveRig gpu = rig(state), cpu(state, cpu_options(GetParam()));
    shear(gpu, dt);
    shear(cpu, dt);
    EXPECT_TRUE(same_answer(gpu.result(), cpu.result()));
    EXPECT_EQ(serialize(gpu.state()), serialize(cpu.state()));
  }
}

#endif

INSTANTIATE_TEST_SUITE_P(Formats, LargeFriction,
                         testing::Values(Format::Fast, Format::Mixed, Format::Double),
                         [](const auto &info) { return to_string(info.param); });
