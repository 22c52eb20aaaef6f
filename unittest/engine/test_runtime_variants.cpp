// SPDX-License-Identifier: GPL-2.0-only
// Tests that kernels compiled at run time give the same bits as the precompiled kernels of the
// engine, in every format. The tests are skipped without a GPU.

#include "rve/engine/cuda_variants.h"
#include "rve/engine/runtime_kernels.h"
#include "support/environment.h"
#include "support/on_device.h"
#include "support/packings.h"

#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

/// Returns one packing for each kernel variant: plain, with dashpots, without friction, with
/// rolling resistance.
std::vector<RveState> packings()
{
  std::vector<RveState> states(4, packing_of_400());
  const Material material = states[0].material;
  states[1].material.normal_viscosity =
      0.01 * material.normal_stiffness * stable_time_step(states[0]);
  states[2].material.friction = 0.0;
  states[2].pairs.clear();
  states[3].material.rolling_stiffness = 0.2 * material.normal_stiffness;
  states[3].material.rolling_friction = 0.3;
  return states;
}

/// Returns the state of each packing after a shear of 2 %. Each packing is alone in an engine,
/// which selects the kernel variant for it.
std::vector<std::string> sheared(Options options, const char *at_run_time)
{
  const Environment way("GPU_RVE_KERNELS_AT_RUN_TIME", at_run_time);
  std::vector<std::string> images;
  for (const RveState &state : packings()) {
    const auto engine = make_engine(with_contacts_of({state}, options));
    const int rve = engine->add(state);
    const double dt = 0.5 * stable_time_step(state);
    for (int call = 0; call < 4; ++call) {
      std::vector<Result> results;
      engine->advance({rve},
                      {Drive::constant_velocity_gradient(
                          Tensor2{{0.0, 0.005 / (500 * dt), 0.0, 0.0}}, dt, 500)},
                      results);
      EXPECT_EQ(results[0].status & status::Fatal, 0u) << describe_status(results[0].status);
    }
    const auto bytes = serialize(engine->state(rve));
    images.emplace_back(bytes.begin(), bytes.end());
  }
  return images;
}

class RuntimeVariants : public OnDevice {
 protected:
  void SetUp() override
  {
    OnDevice::SetUp();
    if (!IsSkipped() && !runtime_kernels_obstacle().empty())
      GTEST_SKIP() << runtime_kernels_obstacle();
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, RuntimeVariants,
                         testing::Values(Format::Fast, Format::Mixed, Format::Double));

}    // namespace

// This test needs no device.
TEST(CudaVariants, MissingCompilerIsReportedWithTheContacts)
{
  Options options = device_options(Format::Mixed);
  {
    const Environment none_ahead("GPU_RVE_KERNELS_AT_RUN_TIME", "1");
    const CudaVariants variants(options, 90);
    EXPECT_EQ(variants.obstacle(KernelVariant::Rolling, ""), "");
    EXPECT_EQ(variants.obstacle(KernelVariant::Rolling, "there is no compiler"),
              "kernels for RVEs with contact law hooke with rolling resistance must be compiled at "
              "run time, which is not possible: there is no compiler");
  }
  const CudaVariants variants(options, 90);
  const std::string of_linear = variants.obstacle(KernelVariant::General, "there is no compiler");
  if (of_linear.empty()) { EXPECT_EQ(variants.usable(KernelVariant::Plain), KernelVariant::Plain); }
}

TEST_P(RuntimeVariants, GiveTheBitsOfPrecompiledKernels)
{
  const Options options = device_options(GetParam());
  const std::vector<std::string> ahead = sheared(options, nullptr), later = sheared(options, "1");
  for (std::size_t k = 0; k < ahead.size(); ++k)
    EXPECT_TRUE(ahead[k] == later[k]) << "packing " << k;
}

TEST_P(RuntimeVariants, GiveTheBitsInBlocksOfAnySize)
{
  Options options = device_options(GetParam());
  options.block_size = 128;    // grains in memory
  const std::vector<std::string> ahead = sheared(options, nullptr), later = sheared(options, "1");
  for (std::size_t k = 0; k < ahead.size(); ++k)
    EXPECT_TRUE(ahead[k] == later[k]) << "packing " << k;
}
