// SPDX-License-Identifier: GPL-2.0-only
// Tests the number format `single`, which has fp32 positions as in the paper. The format is
// accurate for the soft grains of the paper and inaccurate for stiff grains.

#include "support/environment.h"
#include "support/messages.h"
#include "support/rve_rig.h"

#include "rve/engine/packing.h"
#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double PRESSURE = 1e5;

/// Returns the paper's packing with contacts that are stiffer by `factor`, at rest under the same
/// pressure. The original overlaps are 6e-3 of the sum of radii. They decrease by about `factor`.
RveState stiffened(double factor)
{
  RveState state = paper_packing();
  const double overlap = RveRig(state).evaluate().mean_overlap;
  state.material.normal_stiffness *= factor;
  state.material.tangential_stiffness *= factor;
  state.cell = (1.0 + overlap * (1.0 - 1.0 / factor)) * state.cell;
  Drive drive;
  drive.dt = 0.5 * stable_time_step(state);
  drive.substeps = 40000;
  drive.controlled[0][0] = drive.controlled[1][1] = true;
  drive.stress_goal = -PRESSURE * Tensor2::identity();
  drive.servo_gain = default_servo_gain(state);
  RveRig rig(state);
  rig.advance(drive);
  drive.controlled[0][0] = drive.controlled[1][1] = false;
  drive.substeps = 20000;
  rig.advance(drive);
  return rig.state();
}

/// Returns the pressure after 20,000 steps in a fixed cell, divided by the pressure of the state.
double held_pressure(const RveState &state, Format format)
{
  Drive hold;
  hold.dt = 0.5 * stable_time_step(state);
  hold.substeps = 20000;
  const double before = RveRig(state).evaluate().mean_stress();
  return RveRig(state, cpu_options(format)).advance(hold).mean_stress() / before;
}

}    // namespace

TEST(SingleFormat, KeepsThePressureOfSoftGrains)
{
  // The last digit of a position is 2^-24 of the cell or 1e-6 diameters. An overlap is 6e-3
  // diameters, so that its relative error is about 1e-4.
  EXPECT_NEAR(held_pressure(paper_packing(), Format::Single), 1.0, 1e-4);
}

TEST(SingleFormat, LosesThePressureOfStiffGrainsThatOtherFormatsKeep)
{
  const RveState stiff = stiffened(300.0);
  ASSERT_LT(RveRig(stiff).evaluate().mean_overlap, 5e-5);

  EXPECT_LT(held_pressure(stiff, Format::Single), 0.95);
  EXPECT_NEAR(held_pressure(stiff, Format::Fast), 1.0, 2e-3);
  EXPECT_NEAR(held_pressure(stiff, Format::Mixed), 1.0, 3e-5);
  EXPECT_NEAR(held_pressure(stiff, Format::Double), 1.0, 3e-5);
}

TEST(SingleFormat, FollowsDoubleThroughAPercentOfShear)
{
  double pressure[2];
  const Format formats[] = {Format::Double, Format::Single};
  for (int k = 0; k < 2; ++k)
    pressure[k] = RveRig(paper_packing(), cpu_options(formats[k]))
                      .strain(gradient(0, 1, 0.05), 5e-5, 4000)
                      .mean_stress();
  EXPECT_NEAR(pressure[1], pressure[0], 1e-4 * pressure[0]);
}

TEST(SingleFormat, KeepsTheStressWhenTheLatticeIsReduced)
{
  // The same lattice has the cell vectors a and b' = b + a and the fractional coordinates s' = (s_0
  // - s_1, s_1).
  RveState leaning = paper_packing();
  for (int a = 0; a < 2; ++a) leaning.cell(a, 1) += leaning.cell(a, 0);
  for (int i = 0; i < leaning.num_grains(); ++i)
    leaning.fractional[2 * i] -= leaning.fractional[2 * i + 1];

  RveRig straight(paper_packing(), cpu_options(Format::Single)),
      reduced(leaning, cpu_options(Format::Single));
  const double expected = straight.strain(gradient(0, 1, 0.05), 5e-5, 10).mean_stress();
  const double found = reduced.strain(gradient(0, 1, 0.05), 5e-5, 10).mean_stress();

  EXPECT_GT(reduced.evaluate().counters.lattice_reductions, 0);
  EXPECT_NEAR(found, expected, 1e-4 * expected);
}

TEST(SingleFormat, GrainThatCrossesTheCellIsWrapped)
{
  // Two disks pass each other.
  const double r = 0.00375, width = 8.0 * r, dt = 1e-4;
  RveState state = state_of(paper_packing().material, width * Tensor2::identity(), {r, r},
                            {2.0 * r, 2.0 * r, 4.0 * r, 6.0 * r});
  state.velocity = {0.01 * width / dt, 0.0, 0.0, 0.0};    // a hundredth of the cell in a step
  RveRig rig(state, cpu_options(Format::Single));

  rig.strain(Tensor2::zero(), dt, 90);

  const RveState after = rig.state();
  // The fractional coordinate is 0.25 + 0.9, wrapped. Each step rounds it by at most 2^-25.
  EXPECT_NEAR(std::ldexp(static_cast<double>(after.fractional[0]), -64), 0.15, 90 * 0x1p-25);
  EXPECT_EQ(std::ldexp(static_cast<double>(after.fractional[2]), -64), 0.5);
}

TEST(SingleFormat, ContinuesFromItsStateBitForBit)
{
  RveRig whole(paper_packing(), cpu_options(Format::Single));
  whole.strain(gradient(0, 1, 0.05), 5e-5, 200, 2);

  RveRig first(paper_packing(), cpu_options(Format::Single));
  first.strain(gradient(0, 1, 0.05), 5e-5, 200);
  RveRig second(first.state(), cpu_options(Format::Single));
  second.strain(gradient(0, 1, 0.05), 5e-5, 200);

  EXPECT_TRUE(same_motion(whole.state(), second.state()));
}

TEST(SingleFormat, ExistsOnCpusOnly)
{
  Options options;
  options.format = Format::Single;
  options.device = Device::Cuda;
  EXPECT_EQ(message_of([&] { make_engine(options); }),
            "number format single is available on CPUs only; use fast, mixed or double");
  options.device = Device::Auto;
  {
    const Environment nothing("GPU_RVE_REQUIRE_CUDA", nullptr);
    EXPECT_NE(make_engine(options)->description().find("CPU"), std::string::npos);
  }
  // If GPU_RVE_REQUIRE_CUDA requires a GPU, the format is an error unless the CPU is chosen
  // explicitly.
  const Environment demand("GPU_RVE_REQUIRE_CUDA", "1");
  EXPECT_EQ(message_of([&] { make_engine(options); }),
            "GPU_RVE_REQUIRE_CUDA=1 forbids the CPU, but number format single is available on CPUs "
            "only; use fast, mixed or double, or device cpu");
  options.device = Device::Cpu;
  EXPECT_NE(make_engine(options)->description().find("CPU"), std::string::npos);
}

TEST(SingleFormat, ExistsForDisksOnly)
{
  Options options = cpu_options(Format::Single);
  options.contacts.dimension = 3;
  EXPECT_EQ(message_of([&] { make_engine<3>(options); }),
            "number format single supports disks only; use fast, mixed or double for spheres");
}
