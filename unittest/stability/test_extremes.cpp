// SPDX-License-Identifier: GPL-2.0-only
// Tests the engine at the limits of its input. In each scene of extremes.h, the property must hold
// or a message must report that it does not.
//
// Environment variables:
//   GPU_RVE_EXTREMES_LENGTH   length of long scenes in percent of the full length (ten million
//                             steps, a thousand turns and so on), from 0.1 to 100, default 1
//   GPU_RVE_EXTREMES_DEVICE   cpu (default), cuda or auto

#include "stability/extremes.h"

#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

using namespace rve;
using namespace rve_test;

namespace {

double length()
{
  const char *percent = std::getenv("GPU_RVE_EXTREMES_LENGTH");
  return percent ? std::min(std::max(std::atof(percent), 0.1), 100.0) / 100.0 : 0.01;
}

Device device()
{
  const std::string word =
      std::getenv("GPU_RVE_EXTREMES_DEVICE") ? std::getenv("GPU_RVE_EXTREMES_DEVICE") : "cpu";
  return word == "cuda" ? Device::Cuda : word == "auto" ? Device::Auto : Device::Cpu;
}

template <int D> std::string label(const Finding<D> &finding)
{
  return finding.scene->item + ", " + finding.scene->quantity + " " +
      std::to_string(finding.scene->value) + ", " + to_string(finding.format) + ": " +
      finding.scene->property + "; deviation " + std::to_string(finding.deviation) + " " +
      finding.words;
}

template <int D> void expect_nothing_silently_wrong(Format format)
{
  const std::vector<Config<D>> scenes = extreme_scenes<D>(length());

  const std::vector<Finding<D>> findings = run_extremes(scenes, format, device());

  for (const Finding<D> &finding : findings) {
    EXPECT_NE(finding.verdict, Verdict::Silent) << label(finding);
    // A warning is allowed only where a number format or the time integration reaches its limit.
    if (finding.verdict == Verdict::Warned) {
      const std::string &item = finding.scene->item;
      EXPECT_TRUE(item == "time step" ||
                  (format == Format::Fast && (item == "overlap" || item == "strain rate")))
          << label(finding);
    }
  }
}

}    // namespace

class Extremes : public ::testing::TestWithParam<Format> {};

TEST_P(Extremes, OfDisksAreNeverSilentlyWrong)
{
  expect_nothing_silently_wrong<2>(GetParam());
}

TEST_P(Extremes, OfSpheresAreNeverSilentlyWrong)
{
  expect_nothing_silently_wrong<3>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Formats, Extremes, ::testing::ValuesIn(ALL_FORMATS),
                         [](const auto &info) { return rve::to_string(info.param); });
