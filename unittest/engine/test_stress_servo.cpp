// SPDX-License-Identifier: GPL-2.0-only
// The stress servo, and large shear under it through many lattice reductions.

#include "rve/engine/packing.h"
#include "rve/engine/stability.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

Drive servo(int substeps)
{
  Drive drive;
  drive.dt = 5e-5;
  drive.substeps = substeps;
  drive.servo_gain = 1.0 / 47.952;
  return drive;
}

/// Returns M in cell = F H0 M, with the deformation F and the initial cell H0. Lattice reductions
/// make M a unimodular matrix of integers.
Tensor2 lattice_change(const RveState &now, const RveState &start)
{
  return inverse(start.cell) * inverse(now.deformation) * now.cell;
}

void expect_unimodular(const Tensor2 &m)
{
  for (const double x : m.component) EXPECT_NEAR(x, std::round(x), 1e-9);
  EXPECT_NEAR(determinant(m), 1.0, 1e-9);
}

}    // namespace

TEST(StressServo, ReachesAllGoalsAtOnce)
{
  Drive drive = servo(1000);
  drive.controlled[0][0] = drive.controlled[1][1] = drive.controlled[0][1] = true;
  drive.stress_goal = Tensor2{{-120e3, 5e3, 5e3, -140e3}};
  RveRig rig(paper_packing());

  for (int k = 0; k < 20; ++k) rig.advance(drive);

  const Result &result = rig.result();
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(result.stress.component[k], drive.stress_goal.component[k], 1e-3 * 120e3);
  EXPECT_LT(result.deformation(0, 0), 1.0);
  EXPECT_EQ(result.deformation(1, 0), 0.0);    // the servo shears along x
}

TEST(StressServo, LeavesTheOtherComponentsToTheVelocityGradient)
{
  Drive drive = servo(100);
  drive.controlled[0][0] = true;
  drive.stress_goal(0, 0) = -1e5;
  drive.velocity_gradient =
      gradient(1, 1, -0.05) + gradient(0, 0, 77.0);    // the controlled component is ignored
  RveRig rig(paper_packing());

  for (int k = 0; k < 40; ++k) {
    rig.advance(drive);
    EXPECT_NEAR(rig.result().stress(0, 0), -1e5, 0.01 * 1e5) << "after " << 100 * k << " steps";
  }

  const Result &result = rig.result();
  EXPECT_EQ(result.deformation(0, 1), 0.0);
  EXPECT_EQ(result.deformation(1, 0), 0.0);
  EXPECT_NEAR(result.deformation(1, 1), std::exp(-0.05 * 4000 * 5e-5),
              1e-12);    // error of a step: (L dt)^3 / 6 = 3e-18
  EXPECT_GT(result.deformation(0, 0), 1.0);
  EXPECT_EQ(result.servo_velocity_gradient(1, 1), -0.05);
}

TEST(StressServo, RateStaysWithinItsBound)
{
  Drive drive = servo(10);
  drive.controlled[1][1] = true;
  drive.stress_goal(1, 1) = -1e7;
  drive.servo_max_rate = 0.03;
  RveRig rig(paper_packing());

  for (int k = 0; k < 20; ++k) rig.advance(drive);

  EXPECT_EQ(rig.result().servo_velocity_gradient(1, 1), -0.03);
  EXPECT_GT(rig.result().deformation(1, 1), std::exp(-0.03 * 200 * 5e-5) * (1.0 - 1e-12));
}

TEST(StressServo, SettingOfOneCallIsKeptForTheNext)
{
  Drive drive = servo(200), half = servo(100);
  for (Drive *d : {&drive, &half}) {
    d->controlled[0][0] = true;
    d->stress_goal(0, 0) = -1.1e5;
    d->velocity_gradient = gradient(1, 1, -0.05);
  }
  RveRig whole(paper_packing()), parts(paper_packing());

  whole.advance(drive);
  parts.advance(half);
  parts.advance(half);

  // The engine chooses the force scale at the beginning of each call. Both motions therefore differ
  // by the rounding of forces, 2^-52 of the largest force.
  EXPECT_NEAR(parts.result().servo_velocity_gradient(0, 0),
              whole.result().servo_velocity_gradient(0, 0), 1e-9);
  EXPECT_NEAR(parts.result().stress(0, 0), whole.result().stress(0, 0), 1e-8 * 1e5);
}

// The rate changes in every step. The work of a step is therefore accurate only if it uses the mean
// of the stresses before and after the step.
TEST(StressServo, WorkGoesIntoSpringsFrictionAndDampingAtLongStepsToo)
{
  Options options = cpu_options();
  options.track_energy = true;
  for (const double share : {0.9, 0.3}) {
    SCOPED_TRACE(share);
    RveState state = paper_packing();
    RveRig rig(state, options);
    const Result before = rig.evaluate();
    Drive drive = servo(0);
    drive.dt = share * stable_time_step(state);
    drive.substeps = static_cast<int>(0.2 / drive.dt);
    drive.controlled[0][0] = drive.controlled[1][1] = true;
    drive.stress_goal = -1.5e5 * Tensor2::identity();
    drive.servo_gain = default_servo_gain(state);

    const Result &after = rig.advance(drive);

    const double stored =
        after.elastic_energy - before.elastic_energy + after.kinetic_energy - before.kinetic_energy;
    const double residual =
        after.energy.work - (stored + after.energy.friction + after.energy.local_damping);
    EXPECT_NEAR(after.mean_stress(), 1.5e5, 0.1e5);
    EXPECT_LT(std::fabs(residual), 1e-5 * after.energy.work);
  }
}

TEST(LargeShear, UnderConstantNormalStressReachesASteadyStateThroughReductions)
{
  const RveState packing = paper_packing();
  Drive drive = servo(1000);
  drive.velocity_gradient = gradient(0, 1, 1.0);
  drive.controlled[1][1] = true;
  drive.stress_goal(1, 1) = -1e5;
  drive.servo_max_rate = 1.0;
  RveRig rig(packing, cpu_options(Format::Mixed));

  double ratio = 0.0, pressure = 0.0;
  int samples = 0;
  for (int call = 0; call < 60; ++call) {    // gamma = 3
    const Result &result = rig.advance(drive);
    ASSERT_EQ(result.status, status::Ok) << describe_status(result.status);
    expect_unimodular(lattice_change(rig.state(), packing));
    if (result.deformation(0, 1) < 0.5) continue;
    ratio += result.deviatoric_stress() / result.mean_stress();
    pressure += result.mean_stress();
    ++samples;
  }

  const Result &result = rig.result();
  ratio /= samples;
  pressure /= samples;
  EXPECT_GE(result.counters.lattice_reductions, 2);
  // The critical state of frictional disks has q/p = sin(phi), with phi from 15 to 25 degrees. It
  // is looser than the initial state.
  EXPECT_NEAR(pressure, 1e5, 0.2e5);
  EXPECT_GT(ratio, 0.25);
  EXPECT_LT(ratio, 0.42);
  EXPECT_GT(result.void_ratio, determinant(packing.cell) / packing.solid_volume() - 1.0 + 0.02);
}

TEST(LargeShear, StressIsContinuousAcrossAReduction)
{
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 2.0), 5e-5, 200, 28);    // gamma = 0.56; the reduction is at 0.584
  ASSERT_EQ(rig.result().counters.lattice_reductions, 0);
  double elsewhere = 0.0, across = 0.0;    // largest change of a stress component in one step
  Result last = rig.result();
  for (int step = 0; step < 400; ++step) {
    const Result &now = rig.strain(gradient(0, 1, 2.0), 5e-5, 1);
    const bool reduced = now.counters.lattice_reductions > last.counters.lattice_reductions;
    double &largest = reduced ? across : elsewhere;
    for (int k = 0; k < 4; ++k)
      largest = std::max(largest, std::fabs(now.stress.component[k] - last.stress.component[k]));
    last = now;
  }

  EXPECT_EQ(last.counters.lattice_reductions, 1);
  EXPECT_GT(across, 0.0);
  EXPECT_LT(across, 1.5 * elsewhere);    // each step is a strain of 1e-4
}

TEST(LargeShear, CallsWithAndWithoutAReductionInTheMiddleAgree)
{
  // The same sheared state runs twice: with a lattice reduction before the call, and with one
  // during the call.
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 2.0), 5e-5, 200, 28);
  const RveState state = rig.state();
  RveState reduced = state;
  for (int r = 0; r < 2; ++r) {
    reduced.cell(r, 1) -= reduced.cell(r, 0);
    reduced.list_cell(r, 1) -= reduced.list_cell(r, 0);
  }
  for (int i = 0; i < state.num_grains(); ++i) {
    reduced.fractional[2 * i] += reduced.fractional[2 * i + 1];
    reduced.list_fractional[2 * i] += reduced.list_fractional[2 * i + 1];
  }
  RveRig other(reduced);

  rig.strain(gradient(0, 1, 2.0), 5e-5, 300);
  other.strain(gradient(0, 1, 2.0), 5e-5, 300);

  EXPECT_EQ(rig.result().counters.lattice_reductions, 1);
  EXPECT_EQ(other.result().counters.lattice_reductions, 0);
  // Branch vectors differ by rounding errors of 1e-16 of the cell. A flowing packing amplifies them
  // a thousandfold or more in 300 steps.
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(rig.result().stress.component[k], other.result().stress.component[k],
                1e-6 * other.result().mean_stress());
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(rig.result().cell.component[k], other.result().cell.component[k], 1e-14);
}
