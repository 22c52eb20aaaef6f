// SPDX-License-Identifier: GPL-2.0-only
// Tests that results do not depend on the Verlet list, the origin of coordinates, the number of
// threads, the other RVEs of a batch, or a restart.

#include "support/rve_rig.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;
const Tensor2 SHEAR_AND_COMPRESSION = {{0.02, 0.6, 0.0, -0.15}};

/// Strains the packing by a few per cent. Lists are rebuilt, contacts slide, and new contacts form.
const Result &work_out(RveRig &rig, int calls = 20)
{
  return rig.strain(SHEAR_AND_COMPRESSION, DT, 50, calls);
}

RveState without_list(RveState state)
{
  state.list_cell = Tensor2::zero();
  state.list_fractional.clear();
  return state;
}

/// Returns the state with the list in reverse order and every third pair with exchanged grains. The
/// contact histories stay the same.
RveState with_shuffled_list(RveState state)
{
  std::reverse(state.pairs.begin(), state.pairs.end());
  for (std::size_t k = 0; k < state.pairs.size(); k += 3)
    std::swap(state.pairs[k].first, state.pairs[k].second);
  return state;
}

}    // namespace

class EveryFormat : public ::testing::TestWithParam<Format> {};
INSTANTIATE_TEST_SUITE_P(Formats, EveryFormat, ::testing::ValuesIn(ALL_FORMATS),
                         [](const auto &info) { return to_string(info.param); });

TEST_P(EveryFormat, SkinDoesNotChangeABit)
{
  const RveState packing = paper_packing();
  std::vector<RveState> states;
  std::vector<Result> results;
  for (const double share : {0.05, 0.1, 0.5, 1.5}) {
    Options options = cpu_options(GetParam());
    options.skin = share * 0.00375;
    RveRig rig(packing, options);
    results.push_back(work_out(rig, 40));
    states.push_back(rig.state());
  }

  EXPECT_GT(results[0].counters.rebuilds, 20);
  EXPECT_GT(results[0].counters.rebuilds, 3 * results[2].counters.rebuilds);
  EXPECT_GT(results[0].sliding_fraction, 0.05);
  EXPECT_EQ(results[2].counters.repeats, 0);
  EXPECT_GE(results[3].counters.repeats,
            1);    // more than four pairs per grain: the list grew and the call was repeated
  for (int k = 1; k < 4; ++k) {
    EXPECT_TRUE(same_motion(states[0], states[k]));
    EXPECT_TRUE(same_answer(results[0], results[k]));
  }
}

TEST_P(EveryFormat, ForcedRebuildDoesNotChangeABit)
{
  RveRig reference(paper_packing(), cpu_options(GetParam()));
  work_out(reference);

  RveState state = paper_packing();
  for (int call = 0; call < 20;
       ++call) {    // every call begins without a valid list and with the pairs in another order
    RveRig rig(without_list(with_shuffled_list(state)), cpu_options(GetParam()));
    work_out(rig, 1);
    state = rig.state();
  }

  EXPECT_TRUE(same_motion(state, reference.state()));
  EXPECT_GT(histories(state).size(), 500u);
}

TEST_P(EveryFormat, ShiftOfAllCoordinatesDoesNotChangeABit)
{
  const RveState packing = paper_packing();
  RveState shifted = packing;
  const std::uint64_t shift[2] = {0x5a3c1b2700000000u,
                                  0xc1e9f70300000000u};    // representable in every format
  for (int i = 0; i < packing.num_grains(); ++i)
    for (int a = 0; a < 2; ++a) shifted.fractional[2 * i + a] += shift[a];
  RveRig rig(packing, cpu_options(GetParam())), shifted_rig(shifted, cpu_options(GetParam()));

  work_out(rig);
  work_out(shifted_rig);

  // The shift of the fractional coordinates stays constant only without lattice reductions.
  ASSERT_EQ(rig.result().counters.lattice_reductions, 0);
  RveState back = shifted_rig.state();
  for (int i = 0; i < packing.num_grains(); ++i)
    for (int a = 0; a < 2; ++a) back.fractional[2 * i + a] -= shift[a];
  EXPECT_TRUE(same_motion(back, rig.state()));
  EXPECT_TRUE(same_answer(shifted_rig.result(), rig.result()));
}

TEST_P(EveryFormat, OrderOfTheGrainsDoesNotChangeTheForces)
{
  const RveState packing = paper_packing();
  const int n = packing.num_grains();
  RveRig rig(packing, cpu_options(GetParam())),
      other(numbered_backwards(packing), cpu_options(GetParam()));

  work_out(rig);
  work_out(other);

  const RveState a = rig.state(), b = other.state();
  for (int i = 0; i < n; ++i) {
    ASSERT_EQ(a.spin[i], b.spin[n - 1 - i]) << "grain " << i;
    for (int c = 0; c < 2; ++c) {
      ASSERT_EQ(a.fractional[2 * i + c], b.fractional[2 * (n - 1 - i) + c]) << "grain " << i;
      ASSERT_EQ(a.velocity[2 * i + c], b.velocity[2 * (n - 1 - i) + c]) << "grain " << i;
    }
  }
  EXPECT_EQ(components(rig.result().stress), components(other.result().stress));
}

TEST_P(EveryFormat, RestartContinuesBitForBit)
{
  RveRig uninterrupted(paper_packing(), cpu_options(GetParam()));
  work_out(uninterrupted, 10);
  const RveState stop = uninterrupted.state();
  const auto rebuilds = uninterrupted.result().counters.rebuilds;
  ASSERT_GT(histories(stop).size(), 500u);
  // the list is neither new nor due for a rebuild
  ASSERT_NE(stop.list_fractional, stop.fractional);

  RveRig continued(restarted(stop), cpu_options(GetParam()));
  work_out(uninterrupted, 10);
  work_out(continued, 10);

  EXPECT_GT(uninterrupted.result().counters.rebuilds, rebuilds);
  EXPECT_TRUE(same_answer(continued.result(), uninterrupted.result()));
  // The whole states agree, including the Verlet list and all counters.
  EXPECT_EQ(serialize(continued.state()), serialize(uninterrupted.state()));
}

TEST_P(EveryFormat, RestartWithoutTheTangentialHistoryDiffers)
{
  RveRig uninterrupted(paper_packing(), cpu_options(GetParam()));
  work_out(uninterrupted, 10);
  RveState forgetful = restarted(uninterrupted.state());
  for (Pair &pair : forgetful.pairs) pair.tangential_force = 0.0;
  RveState careless = restarted(uninterrupted.state());
  careless.largest_contact_force *= 64.0;    // the force scale is part of the state

  RveRig continued(forgetful, cpu_options(GetParam())), rescaled(careless, cpu_options(GetParam()));
  work_out(uninterrupted, 1);
  work_out(continued, 1);
  work_out(rescaled, 1);

  EXPECT_FALSE(same_motion(continued.state(), uninterrupted.state()));
  EXPECT_FALSE(same_answer(continued.result(), uninterrupted.result()));
  EXPECT_FALSE(same_motion(rescaled.state(), uninterrupted.state()));
}

TEST_P(EveryFormat, RestartOfAServoContinuesBitForBit)
{
  Drive biaxial;
  biaxial.dt = DT;
  biaxial.substeps = 100;
  biaxial.velocity_gradient = gradient(1, 1, -0.5);
  biaxial.controlled[0][0] = true;
  biaxial.stress_goal(0, 0) = -1e5;
  biaxial.servo_gain = 1.0 / 47.952;
  RveRig uninterrupted(paper_packing(), cpu_options(GetParam()));
  for (int k = 0; k < 5; ++k) uninterrupted.advance(biaxial);
  RveRig continued(restarted(uninterrupted.state()), cpu_options(GetParam()));

  for (int k = 0; k < 5; ++k) {
    uninterrupted.advance(biaxial);
    continued.advance(biaxial);
  }

  EXPECT_NE(uninterrupted.result().servo_velocity_gradient(0, 0), 0.0);
  EXPECT_EQ(serialize(continued.state()), serialize(uninterrupted.state()));
}

// ---- threads and batches ----

namespace {

struct Job {
  RveState state;
  Drive drive;
};

/// Returns RVEs of different sizes, packings, drives and numbers of substeps.
std::vector<Job> mixed_batch()
{
  Drive biaxial;
  biaxial.dt = DT;
  biaxial.substeps = 150;
  biaxial.velocity_gradient = gradient(1, 1, -0.5);
  biaxial.controlled[0][0] = true;
  biaxial.stress_goal(0, 0) = -1e5;
  biaxial.servo_gain = 1.0 / 47.952;
  std::vector<Job> jobs;
  jobs.push_back(
      {paper_packing(), Drive::constant_velocity_gradient(gradient(0, 1, 1.0), DT, 200)});
  jobs.push_back({paper_packing("A20_h0075.rve"),
                  Drive::constant_velocity_gradient(gradient(1, 1, -0.5), DT, 50)});
  jobs.push_back(
      {two_disks(1e-5), Drive::constant_velocity_gradient(gradient(0, 1, 1.0), 1e-5, 1000)});
  jobs.push_back({paper_packing(), biaxial});
  jobs.push_back({paper_gas(), Drive::constant_velocity_gradient(gradient(0, 0, -1.0), DT, 20)});
  jobs.push_back(
      {paper_packing("A_h1.rve"), Drive::constant_velocity_gradient(spin_gradient(3.0), DT, 100)});
  jobs.push_back({paper_packing(), Drive()});
  jobs.push_back(
      {two_disks(0.0), Drive::constant_velocity_gradient(gradient(1, 1, -1.0), 1e-5, 300)});
  return jobs;
}

/// Advances the batch twice in the given order and returns states and results by job.
std::vector<std::pair<std::vector<char>, Result>>
run_batch(const std::vector<Job> &jobs, const std::vector<int> &order, Format format, int threads)
{
  const auto engine = make_engine(cpu_options(format, threads));
  std::vector<int> numbers(jobs.size()), rves;
  for (const int k : order) numbers[k] = engine->add(jobs[k].state);
  std::vector<Drive> drives;
  for (const int k : order) {
    rves.push_back(numbers[k]);
    drives.push_back(jobs[k].drive);
  }
  std::vector<Result> results;
  engine->advance(rves, drives, results);
  engine->advance(rves, drives, results);
  std::vector<std::pair<std::vector<char>, Result>> all(jobs.size());
  for (std::size_t m = 0; m < order.size(); ++m)
    all[order[m]] = {serialize(engine->state(rves[m])), results[m]};
  return all;
}

}    // namespace

TEST_P(EveryFormat, ThreadsAndOrderInTheBatchDoNotChangeABit)
{
  const std::vector<Job> jobs = mixed_batch();
  const auto reference = run_batch(jobs, {0, 1, 2, 3, 4, 5, 6, 7}, GetParam(), 1);
  for (const auto &[image, result] : reference) EXPECT_EQ(result.status & status::Fatal, 0u);

  for (const int threads : {1, 2, 7})
    for (const std::vector<int> &order : {std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7},
                                          {7, 6, 5, 4, 3, 2, 1, 0},
                                          {3, 0, 6, 4, 7, 1, 5, 2}}) {
      const auto other = run_batch(jobs, order, GetParam(), threads);
      for (std::size_t k = 0; k < jobs.size(); ++k) {
        EXPECT_EQ(other[k].first, reference[k].first)
            << "RVE " << k << ", " << threads << " threads";
        EXPECT_TRUE(same_answer(other[k].second, reference[k].second))
            << "RVE " << k << ", " << threads << " threads";
      }
    }
}

TEST(Batch, OtherRvesDoNotChangeABit)
{
  const std::vector<Job> jobs = mixed_batch();
  const auto together = run_batch(jobs, {0, 1, 2, 3, 4, 5, 6, 7}, Format::Mixed, 2);

  for (std::size_t k = 0; k < jobs.size(); ++k) {
    RveRig alone(jobs[k].state, cpu_options(Format::Mixed));
    alone.advance(jobs[k].drive);
    alone.advance(jobs[k].drive);
    EXPECT_TRUE(
        same_motion(alone.state(), deserialize(together[k].first.data(), together[k].first.size())))
        << "RVE " << k;
  }
}

TEST(Batch, NumbersOfRemovedRvesAreReusedAndTheOthersStay)
{
  const auto engine = make_engine(cpu_options(Format::Mixed));
  const int first = engine->add(paper_packing()), second = engine->add(paper_gas());
  const std::vector<char> image = serialize(engine->state(second));

  engine->remove(first);
  const int third = engine->add(two_disks(1e-5));

  EXPECT_EQ(engine->size(), 2);
  EXPECT_EQ(third, first);
  EXPECT_EQ(engine->state(third).num_grains(), 2);
  EXPECT_EQ(serialize(engine->state(second)), image);
}
