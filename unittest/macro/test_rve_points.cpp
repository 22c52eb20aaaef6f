// SPDX-License-Identifier: GPL-2.0-only
// Macro steps of RVEs: results with and without details, records, planned steps, and increments.

#include "macro/rve_points.h"

#include "rve/core/error.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "support/forwarding_engine.h"
#include "support/increments.h"
#include "support/lattice.h"
#include "support/packings.h"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>

using macro::MacroStepOptions;
using macro::RvePoints;
using rve::Tensor2;

namespace {

constexpr double DT = 5e-5;
constexpr int RVES = 3;

rve::Options cpu_options()
{
  rve::Options options;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  return options;
}

RvePoints three_points(std::vector<int> &slots, const MacroStepOptions &macro = MacroStepOptions())
{
  RvePoints points(rve::make_engine(cpu_options()), nullptr, macro);
  const rve::RveState packing = rve_test::packing_of_400();
  slots = points.add(std::vector<const rve::RveState *>(RVES, &packing));
  return points;
}

/// Returns drives that shear and compress each RVE at its own rate.
std::vector<rve::Drive> drives(int substeps)
{
  std::vector<rve::Drive> drives(RVES);
  for (int k = 0; k < RVES; ++k)
    drives[k] =
        rve::Drive::constant_velocity_gradient({{-0.1 * (k + 1), 0.3, 0.0, 0.0}}, DT, substeps);
  return drives;
}

template <class T> bool same_bits(const T &a, const T &b)
{
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}    // namespace

// fix mpm counts both engine_time() and bounding_time() as time of the RVEs. They are separate
// because a check in the middle of a step can compile a kernel.
TEST(RvePoints, BoundsOfTimeStepsAreTimedSeparately)
{
  std::vector<int> slots;
  const RvePoints points = three_points(slots);
  EXPECT_EQ(points.bounding_time(), 0.0);
  const double in_engine = points.engine_time();
  points.bound_time_steps(slots, DT);
  EXPECT_GT(points.bounding_time(), 0.0);
  EXPECT_EQ(points.engine_time(), in_engine);
}

// Kinetic energy and dashpot forces depend on velocities. The velocities have received their last
// kick, whether details are computed at once or later.
TEST(RvePoints, DetailsAreTheSameAtOnceAndLater)
{
  rve::RveState packing = rve_test::packing_of_400();
  packing.material.normal_viscosity = packing.material.tangential_viscosity = 50.0;
  const auto points_of = [&](std::vector<int> &slots, const MacroStepOptions &macro) {
    RvePoints points(rve::make_engine(cpu_options()), nullptr, macro);
    slots = points.add(std::vector<const rve::RveState *>(RVES, &packing));
    return points;
  };
  MacroStepOptions averaged;
  averaged.stress_from = macro::StressFrom::Average;
  averaged.stress_samples = 3;
  for (const MacroStepOptions &macro : {MacroStepOptions(), averaged}) {
    std::vector<int> slots, other_slots;
    RvePoints at_once = points_of(slots, macro), later = points_of(other_slots, macro);
    for (int step = 0; step < 5; ++step) {
      at_once.advance(slots, drives(20), true);
      later.advance(other_slots, drives(20), false);
    }
    for (int k = 0; k < RVES; ++k) {
      const rve::Result &one = at_once.point(slots[k]).result,
                        &other = later.point(other_slots[k]).result;
      EXPECT_GT(one.kinetic_energy, 0.0);
      EXPECT_EQ(one.kinetic_energy, other.kinetic_energy);
      EXPECT_EQ(one.unbalanced_ratio, other.unbalanced_ratio);
      EXPECT_EQ(one.sliding_fraction, other.sliding_fraction);
      EXPECT_EQ(one.elastic_energy, other.elastic_energy);
      EXPECT_EQ(one.largest_contact_force, other.largest_contact_force);
      EXPECT_TRUE(same_bits(one.stress, other.stress));
    }
  }
}

TEST(RvePoints, StressHasTheSameBitsWithDetailsAndWithout)
{
  std::vector<int> slots, other_slots;
  RvePoints with = three_points(slots), without = three_points(other_slots);

  for (int step = 0; step < 5; ++step) {
    with.advance(slots, drives(20), true);
    without.advance(other_slots, drives(20), false);
    for (int k = 0; k < RVES; ++k)
      EXPECT_TRUE(same_bits(with.stress(slots[k]), without.stress(other_slots[k])));
  }
}

TEST(RvePoints, LaterDetailsBelongToTheSameConfiguration)
{
  std::vector<int> slots, other_slots;
  RvePoints with = three_points(slots), without = three_points(other_slots);
  with.advance(slots, drives(40), true);
  without.advance(other_slots, drives(40), false);

  for (int k = 0; k < RVES; ++k) {
    const rve::Result &a = with.point(slots[k]).result;
    const rve::Result &b = without.point(other_slots[k]).result;
    EXPECT_TRUE(same_bits(a.stress, b.stress));
    EXPECT_TRUE(same_bits(a.cell, b.cell));
    EXPECT_TRUE(same_bits(a.deformation, b.deformation));
    EXPECT_EQ(a.void_ratio, b.void_ratio);
    EXPECT_EQ(a.coordination_number, b.coordination_number);
    EXPECT_EQ(a.num_contacts, b.num_contacts);
    EXPECT_EQ(a.num_pairs, b.num_pairs);
    EXPECT_EQ(a.num_rattlers, b.num_rattlers);
    EXPECT_TRUE(same_bits(a.counters, b.counters));
    // Forces agree up to the rounding of their sums. Contacts at the Coulomb limit stay at the
    // limit.
    EXPECT_EQ(a.sliding_fraction, b.sliding_fraction);
    EXPECT_NEAR(a.elastic_energy, b.elastic_energy, 1e-6 * a.elastic_energy);
    EXPECT_NEAR(a.largest_contact_force, b.largest_contact_force, 1e-6 * a.largest_contact_force);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(a.fabric.component[c], b.fabric.component[c], 1e-9);
  }
}

TEST(RvePoints, EvaluationChangesNothing)
{
  std::vector<int> slots, other_slots;
  RvePoints evaluated = three_points(slots), left_alone = three_points(other_slots);

  for (int step = 0; step < 3; ++step) {
    evaluated.advance(slots, drives(20), false);
    left_alone.advance(other_slots, drives(20), false);
    evaluated.complete();
  }

  for (int k = 0; k < RVES; ++k) {
    EXPECT_TRUE(same_bits(evaluated.stress(slots[k]), left_alone.stress(other_slots[k])));
    EXPECT_EQ(rve::serialize(evaluated.state(slots[k])),
              rve::serialize(left_alone.state(other_slots[k])));
  }
}

TEST(RvePoints, RecordsWithLongListsOfPairsAreWithinTheirBound)
{
  // Lists of pairs take most of the record, so the bound of its size must include them.
  rve::Options options = cpu_options();
  options.skin = 0.01;
  RvePoints points(rve::make_engine(options), nullptr, MacroStepOptions());
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots = points.add({&packing});
  points.advance(slots, {drives(20)[0]});

  const rve::Result &result = points.point(slots[0]).result;
  ASSERT_GT(result.num_pairs, 4 * result.num_grains);
  EXPECT_LE(points.record_size(slots[0]), points.record_bound(slots[0]));
}

TEST(RvePoints, ARecordHoldsACompleteResult)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots);
  points.advance(slots, drives(20), false);

  const std::vector<double> record = points.record(slots[1]);

  EXPECT_LE(static_cast<int>(record.size()), points.record_bound(slots[1]));
  const int again = points.add_record(record.data(), record.size());
  EXPECT_FALSE(points.point(again).stale);
  EXPECT_TRUE(same_bits(points.point(again).result.fabric, points.point(slots[1]).result.fabric));
}

TEST(PointRecord, FlippedBitInItsHeadIsRefusedWithoutAChange)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots);
  points.advance(slots, drives(20), false);
  const std::vector<double> record = points.record(slots[0]);
  const std::size_t bytes = record.size() * sizeof(double);
  const int before = points.size();

  std::vector<double> damaged = record;
  auto *byte = reinterpret_cast<unsigned char *>(damaged.data());
  // The head of the record has one or two thousand bytes with a few results and tensors. The state
  // follows, which has its own checksum.
  for (std::size_t k = 0; k + 8 < bytes; k += k < 2048 ? 1 : 397) {
    byte[k] ^= static_cast<unsigned char>(1 << (k % 8));
    EXPECT_THROW(points.add_record(damaged.data(), damaged.size()), rve::InputError) << k;
    byte[k] ^= static_cast<unsigned char>(1 << (k % 8));
  }

  EXPECT_EQ(points.size(), before);
  EXPECT_NO_THROW(points.add_record(damaged.data(), damaged.size()));
}

TEST(PointRecord, IsRefusedWithAnyOtherLength)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots);
  const std::vector<double> record = points.record(slots[0]);

  // Each record is in memory of exactly its size, so that a sanitizer detects reads beyond it.
  for (std::size_t size : {std::size_t(1), std::size_t(7), record.size() / 2, record.size() - 1}) {
    const std::vector<double> shorter(record.begin(), record.begin() + static_cast<long>(size));
    EXPECT_THROW(points.add_record(shorter.data(), size), rve::InputError) << size;
  }
  std::vector<double> longer = record;
  longer.push_back(0.0);
  EXPECT_THROW(points.add_record(longer.data(), longer.size()), rve::InputError);
}

TEST(PointRecord, StoresTheServoGainOfItsPacking)
{
  // `fast` rounds radii, so a gain computed again from the rounded radii would differ.
  rve::Options options = cpu_options();
  options.format = rve::Format::Fast;
  RvePoints points(rve::make_engine(options), nullptr, MacroStepOptions());
  const rve::RveState packing = rve_test::packing_of_400();
  const int slot = points.add({&packing})[0];
  ASSERT_NE(rve::default_servo_gain(points.state(slot)), points.servo_gain(slot));
  const std::vector<double> record = points.record(slot);

  const int again = points.add_record(record.data(), record.size());

  EXPECT_EQ(points.servo_gain(again), points.servo_gain(slot));
}

// ---- planned macro steps ------------------------------------------------------------------------

namespace {

/// Numbers of RVEs in the calls that return each kind of result, and number of rotated RVEs.
struct Tally {
  int responses = 0, results = 0, elastic_results = 0, increments = 0, turned = 0;
};

/// An engine that counts its calls.
class CountingEngine final : public rve_test::ForwardingEngine {
 public:
  CountingEngine(const rve::Options &options, Tally &tally_in) :
      CountingEngine(rve::make_engine(options), tally_in)
  {
  }
  CountingEngine(std::unique_ptr<rve::Engine> engine_in, Tally &tally_in) :
      ForwardingEngine(std::move(engine_in)), tally(tally_in)
  {
  }
  std::unique_ptr<rve::Engine> empty_with(const rve::ContactModel &contacts) const override
  {
    return std::make_unique<CountingEngine>(engine->empty_with(contacts), tally);
  }
  void turn(const std::vector<int> &rves, const std::vector<Tensor2> &rotations) override
  {
    tally.turned += static_cast<int>(rves.size());
    engine->turn(rves, rotations);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::Result> &results) override
  {
    tally.results += static_cast<int>(rves.size());
    engine->advance(rves, drives, results);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::ElasticResult> &results) override
  {
    tally.elastic_results += static_cast<int>(rves.size());
    engine->advance(rves, drives, results);
  }
  void advance(const std::vector<int> &rves, const std::vector<rve::Drive> &drives,
               std::vector<rve::Response> &responses) override
  {
    tally.responses += static_cast<int>(rves.size());
    engine->advance(rves, drives, responses);
  }
  rve::Request *begin(const std::vector<int> &rves, rve::IncrementCallOf<2> &call) override
  {
    rve::Request *const request = engine->begin(rves, call);
    if (request) tally.increments += static_cast<int>(rves.size());
    return request;
  }

 private:
  Tally &tally;
};

MacroStepOptions adaptive()
{
  MacroStepOptions macro;
  macro.adaptive = rve::AdaptiveSubsteps{1e-5, 1e-3, 1000};
  return macro;
}

MacroStepOptions quiescent_steps()
{
  MacroStepOptions macro = adaptive();
  // ten macro steps of the strains below, enough for a diagnostic evaluation
  macro.quiescent_strain = 8e-5;
  return macro;
}

/// Returns a drive of one macro step with some strain and rotation.
rve::Drive small_drive(double strain, double angle = 0.0)
{
  rve::Drive drive;
  drive.dt = DT;
  drive.substeps = 20;
  drive.deformation = rve::plane_rotation(angle) * Tensor2{{1.0, strain, strain, 1.0 - strain}};
  return drive;
}

/// Returns drives for three RVEs. The first one always strains. The second is quiescent at times
/// and rotates. The third is quiescent at times and does not rotate.
std::vector<rve::Drive> drives_with_quiescence()
{
  return {small_drive(5e-5), small_drive(4e-6, 3e-4), small_drive(-3e-6)};
}

/// Expects equal results, except for results that are rounded in units that depend on the forces in
/// a call.
void expect_same_point(const RvePoints::Point &a, const RvePoints::Point &b)
{
  EXPECT_TRUE(same_bits(a.result.stress, b.result.stress));
  EXPECT_TRUE(same_bits(a.result.cell, b.result.cell));
  EXPECT_TRUE(same_bits(a.result.deformation, b.result.deformation));
  EXPECT_TRUE(same_bits(a.result.counters, b.result.counters));
  EXPECT_EQ(a.result.status, b.result.status);
  EXPECT_EQ(a.result.num_contacts, b.result.num_contacts);
  EXPECT_EQ(a.result.void_ratio, b.result.void_ratio);
  EXPECT_EQ(a.result.mean_overlap, b.result.mean_overlap);
  EXPECT_EQ(a.is_quiescent(), b.is_quiescent());
  EXPECT_EQ(a.frozen(), b.frozen());
}

}    // namespace

TEST(AdaptiveMacroSteps, ShortAndLongAnswersHaveTheSameBits)
{
  Tally tally;
  RvePoints brief(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr, adaptive());
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots = brief.add(std::vector<const rve::RveState *>(RVES, &packing));
  std::vector<int> other_slots;
  RvePoints full = three_points(other_slots, adaptive());
  const Tally at_first = tally;

  for (int step = 0; step < 10; ++step) {
    brief.advance(slots, drives(20), false);
    full.advance(other_slots, drives(20), true);
    for (int k = 0; k < RVES; ++k)
      EXPECT_TRUE(same_bits(brief.stress(slots[k]), full.stress(other_slots[k])));
  }

  EXPECT_EQ(tally.responses, 10 * RVES);
  EXPECT_EQ(tally.results, at_first.results);
  EXPECT_EQ(tally.elastic_results, 0);
  for (int k = 0; k < RVES; ++k) {
    EXPECT_EQ(rve::serialize(brief.state(slots[k])), rve::serialize(full.state(other_slots[k])));
    expect_same_point(brief.point(slots[k]), full.point(other_slots[k]));
    EXPECT_EQ(brief.point(slots[k]).drive.substeps, full.point(other_slots[k]).drive.substeps);
  }
  // slower RVEs make fewer steps
  EXPECT_LT(full.point(other_slots[0]).drive.substeps, full.point(other_slots[2]).drive.substeps);
}

namespace {

/// Rotates an RVE by `angle` in `steps` macro steps. Returns its stress, rotated back and divided
/// by its mean stress.
Tensor2 stress_after_turn(double angle, int steps, MacroStepOptions macro, bool with_details)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots, macro);
  rve::Drive drive;
  drive.dt = DT;
  drive.substeps = 20;
  drive.deformation = rve::plane_rotation(angle / steps);
  for (int step = 0; step < steps; ++step)
    points.advance({slots[0]}, {drive}, with_details && step % 7 == 0);
  const Tensor2 back = rve::plane_rotation(-angle);
  return (1.0 / points.point(slots[0]).result.mean_stress()) *
      (back * points.stress(slots[0]) * rve::transpose(back));
}

}    // namespace

TEST(AdaptiveMacroSteps, RotateTheStressWithARotationOfAnySpeed)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots, adaptive());
  const double p = points.point(slots[0]).result.mean_stress();
  const Tensor2 still = (1.0 / p) * points.stress(slots[0]);

  // Each macro step has one DEM step, which rotates by 1e-5 to 1e-2 rad. Grains must follow.
  for (const auto &[angle, steps] :
       {std::pair<double, int>{1.0, 100}, {1.0, 1000}, {1.0, 10000}, {0.1, 10000}, {-1.0, 300}}) {
    const Tensor2 turned = stress_after_turn(angle, steps, adaptive(), false);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(turned.component[k], still.component[k], 1e-3) << angle / steps;
    // Requests for details during the run do not change any bit of the stress.
    EXPECT_TRUE(same_bits(turned, stress_after_turn(angle, steps, adaptive(), true)));
  }
  MacroStepOptions samples = adaptive();
  samples.stress_from = macro::StressFrom::Average;
  samples.stress_samples = 3;
  const Tensor2 mean = stress_after_turn(1.0, 100, samples, false);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(mean.component[k], still.component[k], 1e-3);
}

TEST(AdaptiveMacroSteps, KeepTheMeanStressUnderRotation)
{
  std::vector<int> slots;
  RvePoints points = three_points(slots, adaptive());
  const double p = points.point(slots[0]).result.mean_stress();
  rve::Drive drive;
  drive.dt = DT;
  drive.substeps = 20;
  drive.deformation = rve::plane_rotation(1e-2);

  for (int step = 0; step < 100; ++step) points.advance({slots[0]}, {drive});

  EXPECT_NEAR(points.point(slots[0]).result.mean_stress() / p, 1.0, 1e-3);
  EXPECT_LT(points.point(slots[0]).result.unbalanced_ratio, 1e-2);
}

TEST(AdaptiveMacroSteps, RotateShadowsToo)
{
  MacroStepOptions macro = adaptive();
  RvePoints points(rve::make_engine(cpu_options()), rve::make_engine(cpu_options()), macro);
  const rve::RveState packing = rve_test::packing_of_400();
  const int slot = points.add({&packing})[0];
  points.add_shadow(slot);
  rve::Drive drive;
  drive.dt = DT;
  drive.substeps = 20;
  drive.deformation = rve::plane_rotation(1e-2);

  for (int step = 0; step < 100; ++step) points.advance({slot}, {drive});

  EXPECT_LT(points.point(slot).shadow_deviation(), 1e-3);
}

TEST(AdaptiveMacroSteps, EnoughStepsForTheRotationGiveTheBitsOfThoseSteps)
{
  // Simple shear consists of strain and rotation; only its strain determines the number of DEM
  // steps.
  std::vector<int> slots, other_slots;
  RvePoints points = three_points(slots, adaptive()),
            plain = three_points(other_slots, MacroStepOptions());
  rve::Drive shear;
  shear.dt = DT;
  shear.substeps = 20;
  shear.deformation = {{1.0, 4e-4, 0.0, 1.0}};

  for (int step = 0; step < 10; ++step) {
    points.advance({slots[0]}, {shear});
    shear.substeps = points.point(slots[0]).drive.substeps;
    plain.advance({other_slots[0]}, {shear});
  }

  EXPECT_EQ(shear.substeps, 29);    // sqrt(1/2) 4e-4 / 1e-5, rounded up
  EXPECT_EQ(rve::serialize(points.state(slots[0])), rve::serialize(plain.state(other_slots[0])));
}

TEST(AdaptiveMacroSteps, ShearGivesTheSameStressWithFewSteps)
{
  // The coarse RVE makes one DEM step per macro step. The shear of 2e-4 and the rotation of 1e-4 in
  // this step are too large for contacts that do not rotate with the grains.
  MacroStepOptions coarse, fine;
  coarse.adaptive = rve::AdaptiveSubsteps{1.5e-4, 1.0, 100000};
  fine.adaptive = rve::AdaptiveSubsteps{1e-6, 1.0, 100000};
  std::vector<int> slots, other_slots;
  RvePoints few = three_points(slots, coarse), many = three_points(other_slots, fine);
  rve::Drive shear;
  shear.dt = DT;
  shear.substeps = 20;
  shear.deformation = {{1.0, 2e-4, 0.0, 1.0}};

  for (int step = 0; step < 25; ++step) {
    few.advance({slots[0]}, {shear});
    many.advance({other_slots[0]}, {shear});
  }

  EXPECT_EQ(few.point(slots[0]).result.counters.steps, 25);
  const double p = many.point(other_slots[0]).result.mean_stress();
  EXPECT_NEAR(few.point(slots[0]).result.mean_stress() / p, 1.0, 0.03);
}

TEST(QuiescentMacroSteps, EvaluateOnlyCandidatesWithAndWithoutDetails)
{
  Tally tally, other_tally;
  RvePoints brief(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr,
                  quiescent_steps());
  RvePoints full(std::make_unique<CountingEngine>(cpu_options(), other_tally), nullptr,
                 quiescent_steps());
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<const rve::RveState *> states(RVES, &packing);
  const std::vector<int> slots = brief.add(states), other_slots = full.add(states);
  const Tally at_first = tally;
  int naps = 0, awake = 0;
  std::vector<bool> slept(RVES, false);

  for (int step = 0; step < 160; ++step) {
    brief.advance(slots, drives_with_quiescence(), false);
    full.advance(other_slots, drives_with_quiescence(), true);
    for (int k = 0; k < RVES; ++k) {
      EXPECT_TRUE(same_bits(brief.stress(slots[k]), full.stress(other_slots[k])));
      // the state of a quiescent RVE is valid without details
      const bool is_quiescent = full.point(other_slots[k]).is_quiescent();
      naps += is_quiescent && !slept[k] ? 1 : 0;
      awake += is_quiescent ? 0 : 1;
      slept[k] = is_quiescent;
    }
  }

  EXPECT_GT(naps, 8);
  EXPECT_GT(tally.turned, 2);
  EXPECT_EQ(tally.turned, other_tally.turned);
  // A diagnostic evaluation makes no extra call: the step of the evaluation returns the longer kind
  // of result.
  EXPECT_EQ(tally.responses + tally.elastic_results, awake);
  EXPECT_EQ(tally.results, at_first.results);
  EXPECT_GE(tally.elastic_results, naps);
  EXPECT_LT(tally.elastic_results, 2 * naps);
  EXPECT_EQ(tally.elastic_results, other_tally.elastic_results);
  for (int k = 0; k < RVES; ++k) {
    EXPECT_EQ(rve::serialize(brief.state(slots[k])), rve::serialize(full.state(other_slots[k])));
    expect_same_point(brief.point(slots[k]), full.point(other_slots[k]));
  }
}

// Two quiescent macro steps would save less time than a diagnostic evaluation costs.
TEST(QuiescentMacroSteps, EvaluationRunsOnlyIfItSavesTime)
{
  MacroStepOptions macro = quiescent_steps();
  macro.quiescent_strain = 1.8e-5;    // the strain of a macro step is 8e-6
  Tally tally;
  RvePoints points(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr, macro);
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots = points.add({&packing});
  const int at_first = tally.elastic_results;
  for (int step = 0; step < 10; ++step) points.advance(slots, {small_drive(4e-6)}, false);
  EXPECT_FALSE(points.point(slots[0]).is_quiescent());
  EXPECT_EQ(tally.elastic_results, at_first);
}

// Records are taken from an RVE while it is quiescent, after an evaluation, and before it advances
// again.
TEST(QuiescentMacroSteps, RecordOfAQuiescentRveContinuesWithTheSameBits)
{
  bool has_slept = false, has_rested = false;
  for (int before = 1; before < 26; ++before) {
    std::vector<int> slots;
    RvePoints points = three_points(slots, quiescent_steps());
    RvePoints others(rve::make_engine(cpu_options()), nullptr, quiescent_steps());
    for (int step = 0; step < before; ++step)
      points.advance(slots, drives_with_quiescence(), false);
    has_slept = has_slept || points.point(slots[1]).rest() == rve::Rest::Quiescent;
    has_rested = has_rested || points.point(slots[1]).rest() == rve::Rest::Rests;

    std::vector<int> other_slots;
    for (const int slot : slots) {
      const std::vector<double> record = points.record(slot);
      other_slots.push_back(others.add_record(record.data(), record.size()));
      EXPECT_EQ(others.point(other_slots.back()).rest(), points.point(slot).rest());
    }

    for (int step = 0; step < 20; ++step) {
      points.advance(slots, drives_with_quiescence(), false);
      others.advance(other_slots, drives_with_quiescence(), false);
      for (int k = 0; k < RVES; ++k)
        EXPECT_TRUE(same_bits(points.stress(slots[k]), others.stress(other_slots[k]))) << step;
    }
    for (int k = 0; k < RVES; ++k)
      expect_same_point(points.point(slots[k]), others.point(other_slots[k]));
  }
  EXPECT_TRUE(has_slept);
  EXPECT_TRUE(has_rested);
}

TEST(MacroStepsByPlan, DoNotDependOnThreadsAndNameFailuresInOrder)
{
  // There are so many small RVEs that a team of threads runs them. Some are quiescent and others
  // strain. Those in `crushed` exceed the overlap limit in step 2.
  const int count = 600;
  const std::vector<int> crushed = {7, 411, 599};
  const rve::RveState lattice =
      rve_test::hexagonal_lattice(rve_test::paper_material(), 0.005, 1e-5);
  const auto play = [&](int threads, std::vector<Tensor2> &stresses) {
    RvePoints points(rve::make_engine(cpu_options()), nullptr, quiescent_steps(), threads);
    const std::vector<int> slots = points.add(std::vector<const rve::RveState *>(count, &lattice));
    std::vector<std::vector<int>> failed;
    for (int step = 0; step < 6; ++step) {
      std::vector<rve::Drive> drives;
      for (int k = 0; k < count; ++k)
        drives.push_back(small_drive(1e-6 * (k % 30), 1e-4 * (k % 7)));
      if (step == 2)
        for (const int k : crushed) drives[k].deformation = 0.4 * Tensor2::identity();
      failed.push_back(points.advance(slots, drives, false));
      for (const int slot : slots) stresses.push_back(points.stress(slot));
    }
    std::vector<int> expected;
    for (const int k : crushed) expected.push_back(slots[k]);
    for (int step = 0; step < 6; ++step)
      EXPECT_EQ(failed[step], step == 2 ? expected : std::vector<int>()) << step;
    int is_quiescent = 0;
    for (const int slot : slots) is_quiescent += points.point(slot).is_quiescent() ? 1 : 0;
    EXPECT_GT(is_quiescent, count / 20);
    EXPECT_LT(is_quiescent, count - count / 10);
  };
  std::vector<Tensor2> one, three;

  play(1, one);
  play(3, three);

  EXPECT_EQ(std::memcmp(one.data(), three.data(), one.size() * sizeof(Tensor2)), 0);
}

TEST(MacroStepsByPlan, FrozenRveDoesNotChangeTheOthers)
{
  Tally tally;
  RvePoints with(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr,
                 MacroStepOptions());
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots = with.add(std::vector<const rve::RveState *>(RVES, &packing));
  std::vector<int> other_slots;
  RvePoints alone = three_points(other_slots);
  auto crush = drives(20);
  crush[1].deformation = 0.4 * Tensor2::identity();
  EXPECT_EQ(with.advance(slots, crush, false), std::vector<int>{slots[1]});
  alone.advance(other_slots, drives(20), false);
  const Tally before = tally;

  for (int step = 0; step < 3; ++step) {
    EXPECT_TRUE(with.advance(slots, drives(20), false).empty());
    alone.advance(other_slots, drives(20), false);
  }

  EXPECT_EQ(tally.responses - before.responses, 3 * (RVES - 1));
  EXPECT_EQ(tally.results, before.results);
  for (const int k : {0, 2})
    EXPECT_EQ(rve::serialize(with.state(slots[k])), rve::serialize(alone.state(other_slots[k])));
  EXPECT_TRUE(with.frozen(slots[1]));
}

// ---- increments ---------------------------------------------------------------------------------

namespace {

using Increments = rve_test::IncrementsOf<2>;

/// Returns drives of three RVEs. One strains. The second rotates by more than contacts allow in a
/// step or two. The third does both.
std::vector<rve::Drive> drives_that_turn()
{
  return {small_drive(2e-5), small_drive(1e-6, 2e-3), small_drive(-8e-6, -1e-3)};
}

}    // namespace

TEST(MacroIncrements, HaveTheBitsOfTheDrives)
{
  const rve::RveState packing = rve_test::packing_of_400();
  for (const MacroStepOptions &macro : {MacroStepOptions(), adaptive()})
    for (const bool with_details : {false, true}) {
      Tally tally;
      RvePoints by_increments(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr,
                              macro);
      const std::vector<int> slots =
          by_increments.add(std::vector<const rve::RveState *>(RVES, &packing));
      std::vector<int> other_slots;
      RvePoints by_drives = three_points(other_slots, macro);
      const std::vector<rve::Drive> drives = drives_that_turn();

      for (int step = 0; step < 10; ++step) {
        Increments increments(drives);
        std::vector<int> failed;
        ASSERT_TRUE(advance(by_increments, slots, increments, with_details, failed));
        EXPECT_TRUE(failed.empty());
        by_drives.advance(other_slots, drives, with_details);
        for (int k = 0; k < RVES; ++k)
          EXPECT_TRUE(same_bits(increments.stresses[k], by_drives.stress(other_slots[k])));
      }

      EXPECT_EQ(tally.increments, 10 * RVES);
      EXPECT_EQ(tally.responses, 0);
      EXPECT_GE(tally.turned, macro.adaptive ? 10 : 0);
      for (int k = 0; k < RVES; ++k) {
        EXPECT_EQ(rve::serialize(by_increments.state(slots[k])),
                  rve::serialize(by_drives.state(other_slots[k])));
        expect_same_point(by_increments.point(slots[k]), by_drives.point(other_slots[k]));
        EXPECT_TRUE(
            same_bits(by_increments.point(slots[k]).drive, by_drives.point(other_slots[k]).drive));
      }
    }
}

TEST(MacroIncrements, AllowQuiescentRvesAsDrivesDo)
{
  const rve::RveState packing = rve_test::packing_of_400();
  MacroStepOptions matched = quiescent_steps();
  matched.adaptive.reset();
  for (const MacroStepOptions &macro : {quiescent_steps(), matched}) {
    Tally tally;
    RvePoints by_increments(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr, macro);
    const std::vector<int> slots =
        by_increments.add(std::vector<const rve::RveState *>(RVES, &packing));
    std::vector<int> other_slots;
    RvePoints by_drives = three_points(other_slots, macro);
    const std::vector<rve::Drive> drives = drives_with_quiescence();

    int slept = 0;
    for (int step = 0; step < 40; ++step) {
      Increments increments(drives);
      std::vector<int> failed;
      ASSERT_TRUE(advance(by_increments, slots, increments, step % 7 == 0, failed));
      by_drives.advance(other_slots, drives, step % 5 == 0);
      for (int k = 0; k < RVES; ++k) {
        EXPECT_TRUE(same_bits(increments.stresses[k], by_drives.stress(other_slots[k])));
        const RvePoints::Point &one = by_increments.point(slots[k]),
                               &other = by_drives.point(other_slots[k]);
        EXPECT_EQ(one.state, other.state);
        EXPECT_TRUE(same_bits(one.pending, other.pending));
        expect_same_point(one, other);
        slept += one.is_quiescent() ? 1 : 0;
      }
    }
    EXPECT_GT(slept, 40);
    EXPECT_LT(tally.increments, 40 * RVES - slept + 1);
    EXPECT_EQ(tally.responses, 0);
    for (int k = 0; k < RVES; ++k)
      EXPECT_EQ(rve::serialize(by_increments.state(slots[k])),
                rve::serialize(by_drives.state(other_slots[k])));
  }
}

// Some cases cannot be expressed as increments and need a call with drives. An advance that is
// refused for this reason changes nothing.
TEST(MacroIncrements, AreRefusedIfTheyNeedDrives)
{
  MacroStepOptions averaged;
  averaged.stress_from = macro::StressFrom::Average;
  averaged.stress_samples = 2;
  std::vector<rve::Drive> folded = drives_that_turn(), turned = drives_that_turn();
  folded[1].deformation = Tensor2{{1.0, 0.0, 0.0, -1.0}};
  turned[2].deformation = rve::plane_rotation(0.3);    // in several segments
  const std::pair<MacroStepOptions, std::vector<rve::Drive>> cases[] = {
      {averaged, drives_that_turn()}, {MacroStepOptions(), folded}, {MacroStepOptions(), turned}};
  for (const auto &[macro, drives] : cases) {
    std::vector<int> slots, failed;
    RvePoints points = three_points(slots, macro);
    const std::vector<double> before = points.record(slots[0]);
    Increments increments(drives);
    EXPECT_FALSE(advance(points, slots, increments, false, failed));
    const std::vector<double> after = points.record(slots[0]);
    ASSERT_EQ(after.size(), before.size());
    EXPECT_EQ(std::memcmp(after.data(), before.data(), after.size() * sizeof(double)), 0);
  }
}

TEST(MacroIncrements, FailedRvesAreNamedAndStayFrozen)
{
  Tally tally;
  RvePoints by_increments(std::make_unique<CountingEngine>(cpu_options(), tally), nullptr,
                          MacroStepOptions());
  const rve::RveState packing = rve_test::packing_of_400();
  const std::vector<int> slots =
      by_increments.add(std::vector<const rve::RveState *>(RVES, &packing));
  std::vector<int> other_slots;
  RvePoints by_drives = three_points(other_slots);
  std::vector<rve::Drive> crush = drives_that_turn();
  crush[1].deformation = 0.4 * Tensor2::identity();
  const Tensor2 stress_before = by_increments.stress(slots[1]);

  Increments first(crush);
  std::vector<int> failed;
  ASSERT_TRUE(advance(by_increments, slots, first, false, failed));
  EXPECT_EQ(failed, std::vector<int>{1});
  by_drives.advance(other_slots, crush, false);
  EXPECT_TRUE(by_increments.frozen(slots[1]));
  EXPECT_EQ(by_increments.point(slots[1]).result.status,
            by_drives.point(other_slots[1]).result.status);

  const std::vector<rve::Drive> drives = drives_that_turn();
  for (int step = 0; step < 3; ++step) {
    Increments increments(drives);
    failed.clear();
    ASSERT_TRUE(advance(by_increments, slots, increments, false, failed));
    EXPECT_TRUE(failed.empty());
    by_drives.advance(other_slots, drives, false);
    for (int k = 0; k < RVES; ++k)
      EXPECT_TRUE(same_bits(increments.stresses[k], by_drives.stress(other_slots[k])));
    EXPECT_TRUE(same_bits(increments.stresses[1], stress_before));
  }
  EXPECT_EQ(tally.increments, RVES + 3 * (RVES - 1));
  for (const int k : {0, 2})
    EXPECT_EQ(rve::serialize(by_increments.state(slots[k])),
              rve::serialize(by_drives.state(other_slots[k])));
}
