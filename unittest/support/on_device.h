// SPDX-License-Identifier: GPL-2.0-only
// Options and fixtures for a test source that is compiled twice: for the CPU and, with
// RVE_TEST_CUDA, for the GPU.

#pragma once

#include "cuda/cuda_required.h"
#include "rve/core/error.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

namespace rve_test {

#if defined(RVE_TEST_CUDA)
constexpr rve::Device DEVICE = rve::Device::Cuda;
#else
constexpr rve::Device DEVICE = rve::Device::Cpu;
#endif

inline rve::Options device_options(rve::Format format)
{
  rve::Options options = cpu_options(format);
  options.device = DEVICE;
  return options;
}

/// Skips tests for a GPU on machines without one.
template <class Test> class OnDeviceOf : public Test {
 protected:
  void SetUp() override
  {
    if (DEVICE == rve::Device::Cpu) return;
    try {
      rve::make_engine(device_options(rve::Format::Fast));
    } catch (const rve::InputError &error) {
      if (rve::cuda_required()) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
  }
};
using OnDevice = OnDeviceOf<testing::TestWithParam<rve::Format>>;

}    // namespace rve_test
