// SPDX-License-Identifier: GPL-2.0-only
// The C interface with arrays in the memory of a GPU. Results must be bitwise equal to those with
// host arrays. An array in other memory must be refused.

#include "librve.h"

#include "cuda/cuda_required.h"

#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace {

const std::string DISKS = std::string(RVE_PACKINGS_DIR) + "/A_h0075.rve";
const std::string SPHERES = std::string(RVE_PACKINGS_DIR) + "/S500.rve";
constexpr double DT_DISKS = 2e-5, DT_SPHERES = 2e-6;
constexpr std::size_t COUNT = 3;

using Batch = std::unique_ptr<rve_batch, void (*)(rve_batch *)>;
using Numbers = std::vector<double>;

/// Numbers in the memory of the current device.
class OnDevice {
 public:
  explicit OnDevice(const Numbers &values) : count(values.size())
  {
    EXPECT_EQ(cudaMalloc(&memory, count * sizeof(double)), cudaSuccess);
    EXPECT_EQ(cudaMemcpy(memory, values.data(), count * sizeof(double), cudaMemcpyHostToDevice),
              cudaSuccess);
  }
  OnDevice(const OnDevice &) = delete;
  OnDevice &operator=(const OnDevice &) = delete;
  ~OnDevice() { cudaFree(memory); }

  double *pointer() { return memory; }
  Numbers values() const
  {
    Numbers copy(count);
    EXPECT_EQ(cudaMemcpy(copy.data(), memory, count * sizeof(double), cudaMemcpyDeviceToHost),
              cudaSuccess);
    return copy;
  }

 private:
  double *memory = nullptr;
  std::size_t count;
};

Batch batch_of(const std::string &file)
{
  rve_packing *packing = nullptr;
  EXPECT_EQ(rve_packing_read(file.c_str(), &packing), RVE_SUCCESS) << rve_error();
  rve_batch *batch = nullptr;
  const std::vector<const rve_packing *> packings(COUNT, packing);
  EXPECT_EQ(rve_batch_create(packings.data(), COUNT, "format mixed device cuda", &batch),
            RVE_SUCCESS)
      << rve_error();
  rve_packing_free(packing);
  return {batch, rve_batch_free};
}

/// Returns the identity plus 1e-4 times a nonsymmetric matrix for each of `count` RVEs.
Numbers increments(int dimension, std::size_t count)
{
  Numbers f;
  for (std::size_t k = 0; k < count; ++k)
    for (int a = 0; a < dimension; ++a)
      for (int b = 0; b < dimension; ++b)
        f.push_back((a == b) + 1e-4 * std::sin(1.0 + k + 2.0 * a + 5.0 * b));
  return f;
}

class DeviceArrays : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override
  {
    int count = 0;
    if (cudaGetDeviceCount(&count) == cudaSuccess && count > 0) return;
    ASSERT_FALSE(rve::cuda_required()) << rve::cuda_requirement() << ", and there is no device";
    GTEST_SKIP() << "there is no CUDA device";
  }
};

}    // namespace

TEST_P(DeviceArrays, HaveTheBitsOfArraysOfTheHost)
{
  const Batch here = batch_of(GetParam()), there = batch_of(GetParam());
  ASSERT_GE(rve_batch_device_number(there.get()), 0);
  const int d = rve_batch_dimension(here.get());
  const auto move = [&](const std::vector<std::size_t> &which, auto call, auto call_device) {
    const std::size_t n = which.empty() ? COUNT : which.size();
    const std::size_t *const chosen = which.empty() ? nullptr : which.data();
    const Numbers f = increments(d, n), dt(n, d == 2 ? DT_DISKS : DT_SPHERES);
    const std::vector<std::int32_t> substeps(n, 40);
    Numbers stresses(f.size());
    OnDevice given(f), received(Numbers(f.size(), 0.0));
    ASSERT_EQ(
        call(here.get(), chosen, n, f.data(), dt.data(), substeps.data(), stresses.data(), nullptr),
        RVE_SUCCESS)
        << rve_error();
    ASSERT_EQ(call_device(there.get(), chosen, n, given.pointer(), dt.data(), substeps.data(),
                          received.pointer(), nullptr),
              RVE_SUCCESS)
        << rve_error();
    EXPECT_EQ(received.values(), stresses);
    EXPECT_EQ(given.values(), f);
  };
  move({}, rve_trial, rve_trial_device);
  ASSERT_EQ(rve_commit(here.get()), RVE_SUCCESS);
  ASSERT_EQ(rve_commit(there.get()), RVE_SUCCESS);
  move({2, 0}, rve_advance, rve_advance_device);

  Numbers p(COUNT), stiffness(COUNT * d * d * d * (d + 1) / 2);
  OnDevice device_p(p), device_stiffness(stiffness);
  ASSERT_EQ(rve_quantity(here.get(), "p", nullptr, COUNT, p.data()), RVE_SUCCESS);
  ASSERT_EQ(rve_quantity_device(there.get(), "p", nullptr, COUNT, device_p.pointer()), RVE_SUCCESS)
      << rve_error();
  EXPECT_EQ(device_p.values(), p);
  ASSERT_EQ(rve_affine_stiffness(here.get(), nullptr, COUNT, stiffness.data()), RVE_SUCCESS);
  ASSERT_EQ(rve_affine_stiffness_device(there.get(), nullptr, COUNT, device_stiffness.pointer()),
            RVE_SUCCESS)
      << rve_error();
  EXPECT_EQ(device_stiffness.values(), stiffness);
}

TEST_P(DeviceArrays, MayBeMixedWithArraysOfTheHost)
{
  const Batch batch = batch_of(GetParam());
  const int d = rve_batch_dimension(batch.get());
  const Numbers f = increments(d, COUNT), dt(COUNT, d == 2 ? DT_DISKS : DT_SPHERES);
  const std::vector<std::int32_t> substeps(COUNT, 40);
  Numbers plain(f.size()), mixed(f.size());
  OnDevice given(f), received(Numbers(f.size(), 0.0));
  const auto trial = [&](auto call, const double *from, double *to) {
    ASSERT_EQ(call(batch.get(), nullptr, COUNT, from, dt.data(), substeps.data(), to, nullptr),
              RVE_SUCCESS)
        << rve_error();
  };
  trial(rve_trial, f.data(), plain.data());
  trial(rve_trial_device, given.pointer(), mixed.data());
  EXPECT_EQ(mixed, plain);
  trial(rve_trial_device, f.data(), received.pointer());
  EXPECT_EQ(received.values(), plain);
  // One array serves as input and output.
  trial(rve_trial_device, given.pointer(), given.pointer());
  EXPECT_EQ(given.values(), plain);
}

TEST_P(DeviceArrays, OfAnotherDeviceAreRefusedAndChangeNothing)
{
  int devices = 0;
  ASSERT_EQ(cudaGetDeviceCount(&devices), cudaSuccess);
  if (devices < 2) GTEST_SKIP() << "there is one CUDA device";
  const Batch batch = batch_of(GetParam());
  const int d = rve_batch_dimension(batch.get()), own = rve_batch_device_number(batch.get()),
            other = own == 0 ? 1 : 0;
  const Numbers f = increments(d, COUNT), dt(COUNT, d == 2 ? DT_DISKS : DT_SPHERES);
  const std::vector<std::int32_t> substeps(COUNT, 40);
  double before[COUNT], after[COUNT];
  ASSERT_EQ(rve_quantity(batch.get(), "substeps", nullptr, COUNT, before), RVE_SUCCESS);
  ASSERT_EQ(cudaSetDevice(other), cudaSuccess);
  OnDevice elsewhere(f);
  EXPECT_EQ(rve_advance_device(batch.get(), nullptr, COUNT, f.data(), dt.data(), substeps.data(),
                               elsewhere.pointer(), nullptr),
            RVE_BAD_INPUT);
  EXPECT_EQ(std::string(rve_error()),
            "stresses is in the memory of CUDA device " + std::to_string(other) +
                "; it must be in the memory of device " + std::to_string(own) +
                ", which has the RVEs, or of the host");
  ASSERT_EQ(rve_quantity(batch.get(), "substeps", nullptr, COUNT, after), RVE_SUCCESS);
  EXPECT_EQ(Numbers(after, after + COUNT), Numbers(before, before + COUNT));
}

INSTANTIATE_TEST_SUITE_P(Grains, DeviceArrays, testing::Values(DISKS, SPHERES),
                         [](const testing::TestParamInfo<std::string> &grains) {
                           return std::string(grains.index == 0 ? "Disks" : "Spheres");
                         });
