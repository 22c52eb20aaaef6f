// SPDX-License-Identifier: GPL-2.0-only
// A kernel consists of phases. The items of a phase are allowed to run in any order and at the same
// time. The tests run the items in several threads and expect the same bits as from a loop. In a
// build with GPU_RVE_SANITIZE=thread, the sanitizer also reports races between items.

#include "support/block_in_threads.h"
#include "support/rve_run.h"

#include <algorithm>

using namespace rve;
using namespace rve_test;

namespace {

/// Blocks whose phases run in threads. The first keeps grains in arrays, the second keeps them in
/// registers and builds lists on chip.
using ArraysInThreads = InThreads<BlockSerial>;
using RegistersInThreads = InThreads<BlockOfTwo>;

template <class Config, class Threads>
void expect_the_bits_of_loops(RveRun<Config::D> loops, KernelVariant memory,
                              const std::vector<DriveRecord<Config::D>> &drives,
                              std::int64_t least_rebuilds, bool with_ledger = false,
                              const SteeringRecord<Config::D> &steering = {}, double skin = 0.0)
{
  using Numbers = typename Config::Numbers;
  RveRun<Config::D> threads = loops;
  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, Config>(loops, drives[k], with_details, skin, with_ledger, steering);
    advance<Threads, Config>(threads, drives[k], with_details, skin, with_ledger, steering);

    EXPECT_EQ(loops.answer.status & status::Fatal, 0u) << describe_status(loops.answer.status);
    expect_same_bits<Numbers>(threads, loops, memory);
  }
  EXPECT_GE(state_of<Numbers>(loops, memory).counters.rebuilds, least_rebuilds);
}

template <class Numbers> class Phases : public testing::Test {
};
TYPED_TEST_SUITE(Phases, Formats);

}    // namespace

TYPED_TEST(Phases, OfDisksRunInThreads)
{
  using Config = VariantConfig<KernelVariant::Plain, TypeParam>;
  const auto begin = disks<TypeParam>(0.5);
  expect_the_bits_of_loops<Config, ArraysInThreads>(begin, KernelVariant::General,
                                                    calls<2>(DISK_DT), 3);
  expect_the_bits_of_loops<Config, RegistersInThreads>(begin, KernelVariant::General,
                                                       calls<2>(DISK_DT), 3);
}

TYPED_TEST(Phases, OfDisksWithAServoRunInThreads)
{
  using Config = VariantConfig<KernelVariant::Steered, TypeParam>;
  const std::vector<DriveRecord<2>> drives = {shear<2>(0.0, 10, DISK_DT),
                                              shear<2>(0.0, 300, DISK_DT)};
  expect_the_bits_of_loops<Config, RegistersInThreads>(
      disks<TypeParam>(0.5), KernelVariant::General, drives, 3, false, servo_of_disks());
}

TYPED_TEST(Phases, OfDisksWithEnergyBookkeepingRunInThreads)
{
  using Config = VariantConfig<KernelVariant::General, TypeParam>;
  const std::vector<DriveRecord<2>> drives = {shear<2>(0.0, 10, DISK_DT),
                                              shear<2>(0.0, 200, DISK_DT)};
  expect_the_bits_of_loops<Config, RegistersInThreads>(
      disks<TypeParam>(0.5), KernelVariant::General, drives, 1, true, servo_of_disks());
}

// In the second run the skin is so wide that grains have more pairs than they can own. In `double`,
// histories of pairs stay in memory, and each thread of a GPU keeps a copy of the pair that it read
// last. In BlockOfTwo, the threads of this test would share this copy. The test of `double`
// therefore keeps grains in arrays.
TYPED_TEST(Phases, OfSpheresRunInThreads)
{
  using Config = VariantConfig<KernelVariant::Spheres, TypeParam>;
  using Threads = std::conditional_t<kHasLongHistory<Config>, ArraysInThreads, RegistersInThreads>;
  const Spheres grains = disordered_spheres(spheres_material(), 6, 2);
  const double wide = 2.0 * *std::min_element(grains.radius.begin(), grains.radius.end());
  const auto begin = run_of<TypeParam>(grains, KernelVariant::Spheres);
  expect_the_bits_of_loops<Config, Threads>(begin, KernelVariant::Spheres, calls<3>(SPHERE_DT), 10,
                                            true);
  expect_the_bits_of_loops<Config, Threads>(begin, KernelVariant::Spheres, calls<3>(SPHERE_DT), 1,
                                            false, {}, wide);
}
