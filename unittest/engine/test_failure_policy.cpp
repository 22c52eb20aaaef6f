// SPDX-License-Identifier: GPL-2.0-only
// Tests failures of an RVE in a call. The RVE must return a status and keep its state from before
// the call. The other RVEs of the batch must continue.

#include "support/messages.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <limits>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;

bool contains(const std::string &text, const std::string &part)
{
  return text.find(part) != std::string::npos;
}

}    // namespace

TEST(Failure, OverlapBeyondTheLimitIsReportedAndTheStateKept)
{
  Options options = cpu_options();
  options.overlap_limit = 0.15;
  RveRig rig(paper_packing(), options);
  rig.strain(gradient(1, 1, -0.5), DT, 100);
  const std::vector<char> before = serialize(rig.state());
  const Tensor2 cell = rig.result().cell;

  const Result &result = rig.strain(gradient(1, 1, -1.0), DT, 4000);    // 20 % in one call

  EXPECT_EQ(result.status & status::Fatal, status::OverlapTooLarge)
      << describe_status(result.status);
  EXPECT_EQ(serialize(rig.state()), before);
  EXPECT_EQ(components(result.cell), components(cell));
  EXPECT_EQ(result.counters.steps, 100);

  rig.strain(gradient(1, 1, 0.5), DT, 100);    // the RVE can still move in another direction
  EXPECT_EQ(rig.result().status, status::Ok);
}

TEST(Failure, CellThatBecomesTooNarrowIsReported)
{
  // Two small disks are in a cell that is flattened. They never touch, but their images come within
  // the cutoff.
  RveState state = state_of(paper_material(), 0.04 * Tensor2::identity(), {0.004, 0.004},
                            {0.01, 0.02, 0.03, 0.02});
  RveRig rig(state);

  const Result &result =
      rig.strain(gradient(1, 1, -1.0), 1e-5, 100000);    // to a height of 15 mm; the cutoff is 8 mm

  EXPECT_EQ(result.status & status::Fatal, status::CellTooNarrow) << describe_status(result.status);
  EXPECT_EQ(rig.state().fractional, state.fractional);
}

TEST(Failure, NotANumberIsRefusedBeforeAnythingRuns)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 0.05), DT, 10);
  const std::vector<char> before = serialize(rig.state());
  Drive with_nan_deformation, with_nan_goal, with_nan_gradient, negative_steps, without_dt,
      inside_out, sheared_along_y;
  with_nan_deformation.dt = without_dt.substeps = 1;
  with_nan_deformation.substeps = 10;
  with_nan_deformation.dt = DT;
  with_nan_deformation.deformation(0, 1) = nan;
  with_nan_goal = with_nan_gradient = sheared_along_y =
      Drive::constant_velocity_gradient(Tensor2::zero(), DT, 1);
  for (Drive *drive : {&with_nan_goal, &with_nan_gradient}) {
    drive->controlled[0][0] = true;
    drive->servo_gain = 0.02;
  }
  with_nan_goal.stress_goal(0, 0) = nan;
  with_nan_gradient.velocity_gradient(1, 1) = nan;
  sheared_along_y.controlled[1][0] = true;
  negative_steps.substeps = -1;
  inside_out = Drive::constant_velocity_gradient(Tensor2::zero(), DT, 1);
  inside_out.deformation(0, 0) = -1.0;

  const auto message = [&](const Drive &drive) { return message_of([&] { rig.advance(drive); }); };

  EXPECT_TRUE(contains(message(with_nan_deformation), "not a finite number"))
      << message(with_nan_deformation);
  EXPECT_TRUE(contains(message(Drive::constant_velocity_gradient(gradient(0, 1, nan), DT, 10)),
                       "not a finite number"));
  EXPECT_TRUE(contains(message(with_nan_goal), "stress goal")) << message(with_nan_goal);
  EXPECT_TRUE(contains(message(with_nan_gradient), "velocity gradient"))
      << message(with_nan_gradient);
  EXPECT_TRUE(contains(message(negative_steps), "got -1")) << message(negative_steps);
  EXPECT_TRUE(contains(message(without_dt), "got 0 [time]")) << message(without_dt);
  EXPECT_TRUE(contains(message(inside_out), "must be positive, got -1")) << message(inside_out);
  EXPECT_TRUE(contains(message(sheared_along_y), "yx")) << message(sheared_along_y);
  EXPECT_EQ(serialize(rig.state()), before);
}

TEST(Failure, WrongOptionsAndNumbersAreRefused)
{
  Options negative_skin = cpu_options(), no_limit = cpu_options();
  negative_skin.skin = -1e-3;
  no_limit.overlap_limit = 1.5;
  Options relaxed_double = cpu_options(Format::Double), relaxed_on_cpu = cpu_options(Format::Fast);
  relaxed_double.device = Device::Auto;
  relaxed_double.arithmetic = relaxed_on_cpu.arithmetic = Arithmetic::Relaxed;
  RveRig rig(paper_gas());
  std::vector<Result> results;

  EXPECT_TRUE(contains(message_of([&] { make_engine(negative_skin); }), "-0.001 [length]"));
  EXPECT_TRUE(contains(message_of([&] { make_engine(no_limit); }), "(0, 1), got 1.5"));
  EXPECT_EQ(message_of([&] { make_engine(relaxed_double); }),
            "relaxed arithmetic requires number format fast or mixed, got double");
  EXPECT_EQ(message_of([&] { make_engine(relaxed_on_cpu); }),
            "relaxed arithmetic requires a CUDA device; use strict arithmetic on a CPU");
  EXPECT_TRUE(contains(message_of([&] { rig.owner().state(5); }), "no RVE with number 5"));
  EXPECT_TRUE(contains(message_of([&] { rig.owner().advance({0}, {}, results); }),
                       "that of the RVEs, 1, got 0"));
}

TEST(Failure, GrainsOfTooDifferentSizesAreRefused)
{
  // If the ratio of radii underflowed, the engine would reserve memory for infinitely many
  // neighbours.
  for (const double small : {4e-5, 1e-12, 1e-30, 1e-300, 4.9e-324}) {
    const RveState state = state_of(paper_material(), 0.04 * Tensor2::identity(), {0.004, small},
                                    {0.01, 0.02, 0.03, 0.02});

    const std::string message = message_of([&] { RveRig rig(state); });

    // The smallest radii are outside the range of sizes of all formats.
    EXPECT_TRUE(contains(message, "largest to smallest radius must be at most 60") ||
                contains(message, "it must be between 1e-30 and 1e30"))
        << small << ": " << message;
  }
}

TEST(Failure, SizesOfSpheresMayDifferLessThanThoseOfDisks)
{
  const auto message_with = [](double ratio) {
    return message_of([&] {
      SphereRig rig(spheres(spheres_material(), 0.04 * Tensor3::identity(), {0.004, 0.004 / ratio},
                            {0.01, 0.01, 0.01, 0.03, 0.03, 0.03}));
    });
  };
  EXPECT_EQ(message_with(6.6), "no error");
  EXPECT_TRUE(contains(message_with(6.7),
                       "ratio of largest to smallest radius must be at most 6.6, got 6.7"))
      << message_with(6.7);
}

TEST(Failure, HalfATurnInOneCallIsRefused)
{
  const Tensor2 spin{{0.0, -1.0, 1.0, 0.0}};    // 1 rad per second

  EXPECT_NO_THROW(Drive::constant_velocity_gradient(spin, 1e-3, 2900));
  EXPECT_THROW(Drive::constant_velocity_gradient(spin, 1e-3, 3100), InputError);
}

TEST(Failure, TimeStepBeyondTheBoundIsReported)
{
  const RveState packing = paper_packing();
  const double bound = stable_time_step(packing);
  for (const Format format : ALL_FORMATS) {
    RveRig stable(packing, cpu_options(format)), unstable(packing, cpu_options(format));

    stable.strain(gradient(1, 1, -0.05), 0.9 * bound, 1000);
    unstable.strain(gradient(1, 1, -0.05), 3.0 * bound, 1000);

    EXPECT_EQ(stable.result().status, status::Ok) << to_string(format);
    EXPECT_LT(stable.result().unbalanced_ratio, 0.05) << to_string(format);
    EXPECT_NE(unstable.result().status &
                  (status::Unstable | status::ForceSaturated | status::OverlapTooLarge),
              0u)
        << to_string(format) << ": " << describe_status(unstable.result().status) << ", unbalanced "
        << unstable.result().unbalanced_ratio;
    EXPECT_EQ(unstable.state().velocity, packing.velocity) << to_string(format);
  }
}

TEST(Failure, GrainThatCrossesAQuarterOfTheCellInAStepIsReported)
{
  // One of two disks moves along x, and the disks never touch. The engine must detect a motion by
  // whole cells in a step, although wrapped coordinates do not show it.
  const double dt = 1e-4, width = 0.2;
  RveState state = state_of(paper_material(), width * Tensor2::identity(), {0.005, 0.004},
                            {0.05, 0.05, 0.15, 0.15});
  for (const Format format : ALL_FORMATS)
    for (const double share : {0.24, 0.26, 0.5, 0.75, 1.0, 2.0, 4.0, 1e6}) {
      SCOPED_TRACE(to_string(format) + ", cells per step " + number(share));
      state.velocity[0] = share * width / dt;
      RveRig rig(state, cpu_options(format));
      const std::vector<char> before = serialize(rig.state());

      const Result &result = rig.strain(Tensor2::zero(), dt, 3);

      EXPECT_EQ(result.status, share < 0.25 ? status::NoContacts : status::Unstable)
          << describe_status(result.status);
      EXPECT_EQ(serialize(rig.state()) == before, share > 0.25);
    }
}

TEST(Failure, CoincidingCentresAreReported)
{
  // The contact has no normal, and its overlap exceeds the limit of every format. If a force acted
  // nevertheless, the disks would separate within 300 steps.
  for (const Format format : ALL_FORMATS)
    for (const int substeps : {0, 1, 300}) {
      SCOPED_TRACE(to_string(format) + ", " + std::to_string(substeps) + " steps");
      RveRig rig(state_of(paper_material(), 0.2 * Tensor2::identity(), {0.005, 0.004},
                          {0.05, 0.05, 0.05, 0.05}),
                 cpu_options(format));
      const std::vector<char> before = serialize(rig.state());

      const Result &result = rig.strain(Tensor2::zero(), 1e-6, substeps);

      EXPECT_NE(result.status & (status::OverlapTooLarge | status::NonFinite), 0u)
          << describe_status(result.status);
      EXPECT_TRUE(serialize(rig.state()) == before);
    }
}

TEST(Failure, BatchContinuesWhenAnRveFails)
{
  Options options = cpu_options(Format::Mixed, 2);
  options.overlap_limit = 0.15;
  const auto engine = make_engine(options);
  const int good = engine->add(paper_packing()), bad = engine->add(paper_packing()),
            gas = engine->add(paper_gas());
  const std::vector<char> bad_before = serialize(engine->state(bad));
  const Drive gentle = Drive::constant_velocity_gradient(gradient(0, 1, 0.05), DT, 100);
  std::vector<Result> results;

  engine->advance(
      {good, bad, gas},
      {gentle, Drive::constant_velocity_gradient(gradient(0, 0, -1.0), DT, 4000), gentle}, results);

  EXPECT_EQ(results[0].status, status::Ok);
  EXPECT_NE(results[1].status & status::OverlapTooLarge, 0u);
  EXPECT_EQ(results[2].status, status::NoContacts);
  EXPECT_EQ(results[1].counters.steps, 0);
  EXPECT_EQ(serialize(engine->state(bad)), bad_before);
  RveRig alone(paper_packing(), options);
  alone.advance(gentle);
  EXPECT_TRUE(same_motion(engine->state(good), alone.state()));
  EXPECT_TRUE(same_answer(results[0], alone.result()));
}

TEST(Gas, HasNoStressAndANotice)
{
  RveRig rig(paper_gas());

  const Result &result = rig.strain(gradient(0, 1, 0.05), DT, 100);

  EXPECT_EQ(result.status, status::NoContacts);
  EXPECT_EQ(result.status & status::Fatal, 0u);
  EXPECT_EQ(components(result.stress), std::vector<double>(4, 0.0));
  EXPECT_EQ(result.coordination_number, 0.0);
  EXPECT_EQ(result.num_rattlers, 400);
  EXPECT_EQ(result.counters.steps, 100);
}

TEST(Gas, RecompressesToASolid)
{
  for (const Format format : ALL_FORMATS) {
    RveRig rig(paper_packing(), cpu_options(format));
    // An extension of 5 % opens the contacts.
    rig.strain(gradient(0, 0, 0.5) + gradient(1, 1, 0.5), DT, 1000, 2);
    const double loose = rig.result().mean_stress();
    const double void_ratio = rig.result().void_ratio;

    rig.strain(gradient(0, 0, -0.5) + gradient(1, 1, -0.5), DT, 1000, 2);
    rig.strain(Tensor2::zero(), DT, 2000);

    // The cell has the same size as at the start, at 100 kPa. The grains have other neighbours, so
    // that the pressure is only roughly 100 kPa.
    EXPECT_LT(loose, 100.0) << to_string(format);
    EXPECT_GT(void_ratio, 0.25);
    EXPECT_EQ(rig.result().status, status::Ok) << to_string(format);
    EXPECT_GT(rig.result().mean_stress(), 2e4) << to_string(format);
    EXPECT_LT(rig.result().mean_stress(), 2e5) << to_string(format);
  }
}

TEST(Gas, FirstContactsMayBeFarBeyondTheGuessedForceScale)
{
  // For a packing without contacts, the engine chooses the force scale for overlaps of 1e-3 of a
  // radius. This collision reaches 0.1 radii, so that the engine repeats the call with a coarser
  // scale.
  for (const Format format : ALL_FORMATS) {
    RveState state = two_disks(-1e-4);
    state.velocity = {9.0, 12.0, -9.0, -12.0};
    state.material.local_damping = 0.0;
    RveRig rig(state, cpu_options(format));

    rig.strain(Tensor2::zero(), 1e-6, 10);
    rig.strain(Tensor2::zero(), 1e-6, 30);

    EXPECT_EQ(rig.result().status, status::Ok)
        << to_string(format) << describe_status(rig.result().status);
    EXPECT_GT(rig.result().largest_contact_force, 64.0 * 1e6 * 1e-3 * 0.0045);
    const double expected = 1e6 * rig.result().largest_overlap * 0.009;
    EXPECT_NEAR(rig.result().largest_contact_force / expected, 1.0, 1e-5);
    if (format != Format::Double) {
      EXPECT_GE(rig.result().counters.repeats, 1) << to_string(format);
    }
  }
}

TEST(Evaluation, WithoutSubstepsChangesNothing)
{
  for (const bool dashpots : {false, true})
    for (const Format format : ALL_FORMATS) {
      RveState packing = paper_packing();
      if (dashpots)
        packing.material.normal_viscosity = packing.material.tangential_viscosity = 50.0;
      RveRig rig(packing, cpu_options(format));
      rig.strain(Tensor2{{0.02, 0.6, 0.0, -0.15}}, DT, 50, 10);
      const std::vector<char> before = serialize(rig.state());
      const Result moved = rig.result();

      const Result evaluated = rig.evaluate();

      EXPECT_EQ(serialize(rig.state()), before)
          << to_string(format) << (dashpots ? " with dashpots" : "");
      EXPECT_EQ(evaluated.counters.steps, moved.counters.steps);
      if (dashpots) continue;
      // The force scale can change after the last call. A contact force then changes by 2^-25 of
      // the largest force (2^-52 in `double`).
      for (int k = 0; k < 4; ++k)
        EXPECT_NEAR(evaluated.stress.component[k], moved.stress.component[k],
                    1e-6 * moved.mean_stress())
            << to_string(format);
      EXPECT_EQ(evaluated.num_contacts, moved.num_contacts);
      EXPECT_EQ(evaluated.sliding_fraction, moved.sliding_fraction);
    }
}

TEST(Evaluation, OfAFreshPackingGivesItsPressure)
{
  RveRig rig(paper_packing());

  const Result &result = rig.evaluate();

  EXPECT_EQ(result.num_contacts, 875);
  // The packing was prepared to a relative unbalanced force of 7e-9.
  EXPECT_NEAR(result.mean_stress(), 1e5, 0.01);
  EXPECT_EQ(result.counters.steps, 0);
  EXPECT_NEAR(result.void_ratio, 0.16104146789664689, 1e-12);
}
