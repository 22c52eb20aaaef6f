// SPDX-License-Identifier: GPL-2.0-only
// Tests the host kernel for x86-64-v3, which computes several grains at once, in packs. It must
// give the same bits as the host kernel for any CPU, which computes one grain after the other.

#include "rve/core/status.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/host_kernels.h"
#include "rve/engine/packing.h"
#include "support/packings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

#if defined(RVE_WITH_X86_64_V3)

namespace {

constexpr double DT = 5e-5;

struct KernelRun {
  DeviceState image;
  AnswerRecord<2> answer;
  DetailRecord<2> detail;
};

struct Config {
  RveState state;
  double shear;    ///< shear strain in the call [-]
  int substeps;
  double skin;                   ///< [length]; 0: the default
  double overlap_limit = 0.5;    ///< limit of overlap / smaller radius [-]
  /// If true, a servo holds 100 kPa at a shear rate of 5, and `shear` is ignored.
  bool servo = false;
};

/// Returns the kernel variant that uses packs for this case.
KernelVariant packed_variant(const Config &scene)
{
  return scene.servo ? KernelVariant::Steered : KernelVariant::Plain;
}

SteeringRecord<2> steering_of(const Config &scene)
{
  SteeringRecord<2> steering = SteeringRecord<2>();
  steering.controlled[0] = steering.controlled[3] = 1;
  steering.stress_goal[0] = steering.stress_goal[3] = -1e5;
  steering.velocity_gradient[1] = 5.0;
  steering.servo_gain = default_servo_gain(scene.state);
  steering.servo_max_rate = 20.0;
  return steering;
}

KernelRun run_kernel(const HostKernel<2> &kernel, KernelVariant kind, const DeviceState &image,
                     const Config &scene)
{
  const int pair_capacity = 40 * image.num_grains;
  const HostWorkspaceSizes sizes = kernel.workspace_sizes(image.num_grains, pair_capacity, kind);
  // The memory initially has other bytes in each run. A kernel that reads unwritten memory then
  // gives different results.
  static char garbage = 0;
  std::vector<char> shared(sizes.shared, ++garbage), workspace(sizes.workspace, ++garbage);
  DriveRecord<2> drive = DriveRecord<2>();
  drive.dt = DT;
  drive.substeps = scene.substeps;
  drive.segments = 1;
  drive.deformation[0] = drive.deformation[3] = 1.0;
  drive.deformation[1] = scene.servo ? 0.0 : scene.shear;
  const SteeringRecord<2> steering = steering_of(scene);
  KernelRun run;
  std::memset(static_cast<void *>(&run.answer), 0, sizeof(run.answer));
  std::memset(static_cast<void *>(&run.detail), 0, sizeof(run.detail));
  run.image = image;
  kernel.advance(run.image.bytes.data(), drive, scene.servo ? &steering : nullptr,
                 BatchConstants{scene.skin, scene.overlap_limit, 0.5, 0, 1},
                 {shared.data(), workspace.data(), pair_capacity}, kind, run.answer, &run.detail);
  return run;
}

/// Runs the kernel without packs: the host kernel for any CPU. A build without this kernel uses the
/// kernel variant with energy bookkeeping instead, which has no packs either.
KernelRun run_one_by_one(Format format, const DeviceState &image, const Config &scene)
{
#if defined(RVE_WITHOUT_BASELINE)
  return run_kernel(host_kernel<InstructionSet::v3, 2>(format), KernelVariant::General, image,
                    scene);
#else
  return run_kernel(host_kernel<InstructionSet::baseline, 2>(format), packed_variant(scene), image,
                    scene);
#endif
}

bool same_bits(const KernelRun &x, const KernelRun &y)
{
  return x.image.bytes == y.image.bytes &&
      std::memcmp(&x.answer, &y.answer, sizeof(x.answer)) == 0 &&
      std::memcmp(&x.detail, &y.detail, sizeof(x.detail)) == 0;
}

class PackedGrains : public ::testing::TestWithParam<Format> {
 protected:
  void SetUp() override
  {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") ||
        !__builtin_cpu_supports("bmi2"))
      GTEST_SKIP() << "this CPU has no x86-64-v3";
  }

  /// Makes `calls` calls with every kernel and expects the same bits. In each call all kernels
  /// start from the same device state. Returns the last run without packs.
  KernelRun expect_same_bits(const Config &scene, int calls = 1)
  {
    const Format format = GetParam();
    DeviceState image = build_device_state(GetParam(), scene.state, 40 * scene.state.num_grains(),
                                           KernelVariant::General);
    KernelRun one_by_one;
    for (int call = 0; call < calls; ++call) {
      one_by_one = run_one_by_one(format, image, scene);
      const KernelRun packed = run_kernel(host_kernel<InstructionSet::v3, 2>(format),
                                          packed_variant(scene), image, scene);
      // The general variant never uses packs.
      const KernelRun general = run_kernel(host_kernel<InstructionSet::v3, 2>(format),
                                           KernelVariant::General, image, scene);

      EXPECT_EQ(one_by_one.answer.status & status::Fatal, 0u)
          << describe_status(one_by_one.answer.status);
      EXPECT_TRUE(same_bits(one_by_one, packed)) << "call " << call;
      EXPECT_TRUE(same_bits(one_by_one, general)) << "call " << call;
      EXPECT_EQ(one_by_one.image.bytes != image.bytes, scene.substeps > 0);
      image = one_by_one.image;
    }
    return one_by_one;
  }
};

INSTANTIATE_TEST_SUITE_P(Formats, PackedGrains,
                         ::testing::Values(Format::Fast, Format::Mixed, Format::Double),
                         [](const ::testing::TestParamInfo<Format> &info) {
                           return to_string(info.param);
                         });

/// Returns grains with random velocities on a disturbed square lattice. Most of them overlap with
/// neighbours. The force scale is so coarse that no force saturates, since run_kernel() does not
/// repeat calls as the engine does.
RveState crowd(int num_grains, std::uint64_t seed)
{
  Random random(seed);
  RveState state;
  state.material = packing_of_400().material;
  const double radius = 4e-3, spacing = 1.7 * radius;
  const int columns = static_cast<int>(std::ceil(std::sqrt(double(num_grains))));
  const double width = std::max(columns * spacing, 6.5 * radius);
  state.cell = Tensor2{{width, 0.0, 0.0, width}};
  std::vector<double> positions;
  for (int i = 0; i < num_grains; ++i) {
    state.radius.push_back(radius * random.uniform(0.8, 0.95));
    state.spin.push_back(0.0);
    state.velocity.insert(state.velocity.end(), 2, 0.0);
    for (int place : {i % columns, i / columns})
      positions.push_back(spacing * (place + random.uniform(-0.05, 0.05)));
  }
  state.set_positions(positions);
  shake(state, 0.1, seed + 1);
  state.largest_contact_force = 1e5;
  return state;
}

RveState sheared_packing()
{
  RveState state = packing_of_400();
  shake(state, 0.2, 5);
  state.largest_contact_force = 1e4;
  return state;
}

}    // namespace

TEST_P(PackedGrains, DensePackingWithFreeSlotsStickingAndSlidingContacts)
{
  const KernelRun last = expect_same_bits({sheared_packing(), 0.05, 300, 0.0}, 3);

  EXPECT_GE(last.detail.progress.rebuilds, 3);
  EXPECT_GT(last.detail.num_sliding, 20);
  EXPECT_GT(last.detail.num_contacts - last.detail.num_sliding, 100);
  EXPECT_LT(last.detail.num_pairs, 3 * 400);    // some slots are free
}

TEST_P(PackedGrains, ExtraPairsBeyondTheSlots)
{
  // With a skin of more than two mean radii, there are more pairs than slots of grains.
  const KernelRun last = expect_same_bits({sheared_packing(), 0.05, 100, 9e-3}, 2);

  EXPECT_GT(last.detail.progress.num_extra, 400);    // more extra pairs than grains
}

TEST_P(PackedGrains, ServoUsesTheStressOfEveryStep)
{
  // With the default skin, lists are rebuilt. With a skin of 9e-3, there are more extra pairs than
  // grains.
  for (const double skin : {0.0, 9e-3}) {
    SCOPED_TRACE(skin);
    const KernelRun last = expect_same_bits({sheared_packing(), 0.0, 300, skin, 0.5, true}, 2);

    EXPECT_NE(last.detail.progress.servo_velocity_gradient[0], 0.0);
    EXPECT_EQ(last.detail.progress.servo_velocity_gradient[1], 5.0);
    EXPECT_GT(last.detail.num_sliding, 10);
    if (skin == 0.0)
      EXPECT_GE(last.detail.progress.rebuilds, 2);
    else
      EXPECT_GT(last.detail.progress.num_extra, 400);
  }
}

TEST_P(PackedGrains, AnyNumberOfGrains)
{
  int contacts = 0, extra = 0;
  for (int n : {1, 2, 3, 7, 8, 9, 15, 16, 17, 30, 31, 33, 50}) {
    SCOPED_TRACE(std::to_string(n) + " grains");
    const KernelRun narrow = expect_same_bits({crowd(n, n), 0.02, 45, 0.0}, 2);
    const KernelRun wide = expect_same_bits({crowd(n, n), 0.02, 45, 4e-3}, 2);
    contacts += narrow.detail.num_contacts;
    extra += wide.detail.progress.num_extra;
  }

  EXPECT_GT(contacts, 100);
  EXPECT_GT(extra, 20);
}

TEST_P(PackedGrains, EvaluationWithoutSteps)
{
  Config scene{sheared_packing(), 0.02, 150, 0.0};
  scene.state =
      read_device_state(GetParam(), expect_same_bits(scene).image, KernelVariant::General);
  scene.shear = 0.0;
  scene.substeps = 0;

  const KernelRun evaluated = expect_same_bits(scene);

  EXPECT_GT(evaluated.detail.num_contacts, 400);
}

TEST_P(PackedGrains, ForcesFarAboveTheExpectedOnes)
{
  // The force scale is a thousand times too small, so that forces saturate.
  Config scene{sheared_packing(), 0.01, 40, 0.0};
  scene.state.largest_contact_force = 1.0;
  const Format format = GetParam();
  const DeviceState image =
      build_device_state(GetParam(), scene.state, 4000, KernelVariant::General);

  const KernelRun one_by_one = run_one_by_one(format, image, scene);
  const KernelRun packed =
      run_kernel(host_kernel<InstructionSet::v3, 2>(format), KernelVariant::Plain, image, scene);

  EXPECT_NE(one_by_one.answer.status & status::ForceSaturated, 0u);
  EXPECT_EQ(one_by_one.answer.status, packed.answer.status);
  EXPECT_TRUE(packed.image.bytes == image.bytes);
}

TEST_P(PackedGrains, SaturationLimitIsTheSame)
{
  // The force scale falls from run to run: some runs saturate and others do not.
  int saturated = 0, fine = 0;
  const Format format = GetParam();
  for (double expected = 2000.0; expected > 2.0; expected *= 0.5) {
    Config scene{sheared_packing(), 0.01, 10, 0.0};
    scene.state.largest_contact_force = expected;
    const DeviceState image =
        build_device_state(GetParam(), scene.state, 4000, KernelVariant::General);

    const KernelRun one_by_one = run_one_by_one(format, image, scene);
    const KernelRun packed =
        run_kernel(host_kernel<InstructionSet::v3, 2>(format), KernelVariant::Plain, image, scene);

    EXPECT_TRUE(same_bits(one_by_one, packed)) << expected;
    ++(one_by_one.answer.status & status::ForceSaturated ? saturated : fine);
  }

  EXPECT_GE(saturated, 1);
  EXPECT_GE(fine, 3);
}

TEST_P(PackedGrains, ContactsBeyondTheLimitOfOverlapsAreCountedAlike)
{
  const Format format = GetParam();
  int crushed = 0, sound = 0;
  for (const double limit : {0.05, 0.1, 0.2, 0.3, 0.4}) {
    SCOPED_TRACE(limit);
    const Config scene{crowd(33, 4), 0.0, 1, 0.0, limit};
    const DeviceState image = build_device_state(format, scene.state, 4000, KernelVariant::General);

    const KernelRun one_by_one = run_one_by_one(format, image, scene);
    const KernelRun packed =
        run_kernel(host_kernel<InstructionSet::v3, 2>(format), KernelVariant::Plain, image, scene);

    EXPECT_TRUE(same_bits(one_by_one, packed));
    ++((packed.answer.status & status::OverlapTooLarge) ? crushed : sound);
  }
  EXPECT_GT(crushed, 0);
  EXPECT_GT(sound, 0);
}

#endif
