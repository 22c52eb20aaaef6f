// SPDX-License-Identifier: GPL-2.0-only
// Tests the messages and the choice of the device if the driver is too old or has no device. The
// driver is a stub (stub_driver.c), so that any machine can run the test. The environment variable
// RVE_TEST_OBSTACLE contains the expected message.

#include "rve/engine/engine.h"
#include "support/environment.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

using namespace rve;
using namespace rve_test;

namespace {

std::string expected()
{
  const char *words = std::getenv("RVE_TEST_OBSTACLE");
  return words ? words : "RVE_TEST_OBSTACLE is not set";
}

Options options_for(Device device)
{
  Options options;
  options.device = device;
  options.threads = 1;
  return options;
}

}    // namespace

TEST(CudaDrivers, AutoSelectsTheCpuAndReportsWhy)
{
  const Environment nothing("GPU_RVE_REQUIRE_CUDA", nullptr);
  std::string notice;

  const auto engine = make_engine(options_for(Device::Auto), &notice);

  EXPECT_NE(engine->description().find("CPU"), std::string::npos) << engine->description();
  EXPECT_EQ(notice.find(expected()), 0u) << notice;
}

TEST(CudaDrivers, ExplicitAndRequiredDevicesAreErrors)
{
  {
    const Environment nothing("GPU_RVE_REQUIRE_CUDA", nullptr);
    const std::string chosen = message_of([] { make_engine(options_for(Device::Cuda)); });
    EXPECT_EQ(chosen.find("a CUDA device was requested, but " + expected()), 0u) << chosen;
  }
  const Environment demand("GPU_RVE_REQUIRE_CUDA", "1");
  const std::string demanded = message_of([] { make_engine(options_for(Device::Auto)); });
  EXPECT_EQ(demanded.find("GPU_RVE_REQUIRE_CUDA=1 forbids the CPU as a fallback: " + expected()),
            0u)
      << demanded;
}
