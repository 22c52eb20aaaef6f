// SPDX-License-Identifier: GPL-2.0-only
// The choice of a GPU, and the messages if no GPU can run the code. The tested functions need no
// GPU, so these tests run on any machine.

#include "cuda/cuda_choice.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

using namespace rve;

namespace {

const GpuProperties T4{"Tesla T4", 75}, A100{"NVIDIA A100-SXM4-80GB", 80},
    RTX3090{"NVIDIA GeForce RTX 3090", 86}, RTX4090{"NVIDIA GeForce RTX 4090", 89},
    H200{"NVIDIA H200", 90}, B200{"NVIDIA B200", 100}, RTX5090{"NVIDIA GeForce RTX 5090", 120};

GpuCode code_of(const std::string &list, const GpuProperties &gpu)
{
  return code_for(gpu.capability, cuda_architectures(list));
}

}    // namespace

TEST(CudaChoice, BinariesRunOnLaterGpusOfTheirGenerationAndTextOnAllLaterGpus)
{
  // code for one kind of GPU only
  EXPECT_EQ(code_of("90", A100), GpuCode::None);
  EXPECT_EQ(code_of("90", RTX4090), GpuCode::None);
  EXPECT_EQ(code_of("90", H200), GpuCode::Binary);
  EXPECT_EQ(code_of("90", RTX5090), GpuCode::Ptx);
  EXPECT_EQ(code_of("90-real", RTX5090), GpuCode::None);
  EXPECT_EQ(code_of("86-real", A100), GpuCode::None);
  EXPECT_EQ(code_of("86-real", RTX4090), GpuCode::Binary);
  EXPECT_EQ(code_of("86-virtual", RTX4090), GpuCode::Ptx);
}

TEST(CudaChoice, DefaultBuildRunsOnAllSupportedGpus)
{
  for (const GpuProperties &gpu : {A100, RTX3090, RTX4090, B200, RTX5090}) {
    EXPECT_EQ(code_of("80-virtual:90", gpu), GpuCode::Ptx) << gpu.name;
    EXPECT_EQ(gpu_obstacle(gpu, cuda_architectures("80-virtual:90")), "") << gpu.name;
  }
  EXPECT_EQ(code_of("80-virtual:90", H200), GpuCode::Binary);
  EXPECT_EQ(code_of("80-virtual:90", T4), GpuCode::None);
}

TEST(CudaChoice, SuffixesBindCodeToAGpuOrAGeneration)
{
  EXPECT_EQ(code_of("90a", H200), GpuCode::Binary);
  EXPECT_EQ(code_of("90a", B200), GpuCode::None);
  EXPECT_EQ(code_of("100f-virtual", {"NVIDIA B300", 103}), GpuCode::Ptx);
  EXPECT_EQ(code_of("100f-virtual", RTX5090), GpuCode::None);
}

TEST(CudaChoice, GpuWithoutCodeIsNamedWithTheBuildAndTheRemedy)
{
  EXPECT_EQ(gpu_obstacle(RTX4090, cuda_architectures("80-real:86-virtual:90")), "");
  EXPECT_EQ(
      gpu_obstacle(A100, cuda_architectures("86-virtual:90-real:100")),
      "this program has no code for the NVIDIA A100-SXM4-80GB (compute capability 8.0), only for "
      "8.6 (PTX), 9.0 (binary), 10.0 (binary, PTX); build it with cmake -D "
      "CMAKE_CUDA_ARCHITECTURES=80");
  EXPECT_EQ(gpu_obstacle(B200, cuda_architectures("90a")),
            "this program has no code for the NVIDIA B200 (compute capability 10.0), only for "
            "9.0 (binary, PTX, for this one only); build it with cmake -D "
            "CMAKE_CUDA_ARCHITECTURES=100");
}

TEST(CudaChoice, UnsupportedGpuIsNamed)
{
  EXPECT_EQ(
      gpu_obstacle(T4, cuda_architectures("80-virtual:90")),
      "the Tesla T4 (compute capability 7.5) is too old: GPU_RVE needs compute capability 8.0 "
      "(A100, GeForce RTX 30) or newer");
}

TEST(CudaChoice, GpuThatCannotLoadTheCodeReportsWhy)
{
  EXPECT_EQ(
      loading_obstacle(RTX4090, GpuCode::Ptx, "unsupported toolchain"),
      "the NVIDIA GeForce RTX 4090 (compute capability 8.9) cannot be used (unsupported "
      "toolchain); this program has only PTX for it, which the driver must compile: if it is too "
      "old for that, update it, or build it with cmake -D CMAKE_CUDA_ARCHITECTURES=89");
  EXPECT_EQ(loading_obstacle(H200, GpuCode::Binary, "out of memory"),
            "the NVIDIA H200 (compute capability 9.0) cannot be used (out of memory)");
}

TEST(CudaChoice, DriversAndHiddenDevicesHaveTheirOwnMessages)
{
  EXPECT_EQ(driver_obstacle(DriverError::NoDriver, 0, 13000, nullptr, "x"),
            "no NVIDIA driver was found (a container must be started with the GPUs of its host)");
  EXPECT_EQ(driver_obstacle(DriverError::OldDriver, 11040, 13000, nullptr, "x"),
            "the NVIDIA driver is too old: it supports CUDA 11.4, but this program needs CUDA "
            "13.0; update "
            "the driver, or build with CUDA 11.4 or older");
  EXPECT_EQ(driver_obstacle(DriverError::NoDevice, 13000, 13000, nullptr, "x"),
            "there is no CUDA device");
  EXPECT_EQ(driver_obstacle(DriverError::NoDevice, 13000, 13000, "", "x"),
            "no CUDA device is visible with CUDA_VISIBLE_DEVICES=''; unset it to use all devices");
  EXPECT_EQ(
      driver_obstacle(DriverError::Other, 13000, 13000, nullptr, "system not yet initialized"),
      "no CUDA device can be used (system not yet initialized)");
}

TEST(CudaChoice, RanksTakeUsableGpusInTurn)
{
  const std::vector<std::string> obstacles = {"", "too old", ""};
  const int expected[] = {0, 2, 0, 2};
  for (int rank = 0; rank < 4; ++rank) {
    const CudaChoice choice = choose_gpu(obstacles, rank);
    EXPECT_EQ(choice.number, expected[rank]);
    EXPECT_EQ(choice.obstacle, "");
  }
}

TEST(CudaChoice, WithoutAUsableGpuEachObstacleIsReportedOnce)
{
  const CudaChoice choice = choose_gpu({"too old", "no code", "too old"}, 1);
  EXPECT_EQ(choice.number, -1);
  EXPECT_EQ(choice.obstacle, "too old; no code");
  EXPECT_EQ(choose_gpu({}, 0).obstacle, "there is no CUDA device");
}
