// SPDX-License-Identifier: GPL-2.0-only
// A list of kernel launches gives the same results as single launches. The cases are a new list, a
// repeated list and a list with other arguments.

#include "cuda/launch_list.cuh"
#include "support/block_runner.h"

#include <gtest/gtest.h>

namespace {

/// Two operations with different numbers do not commute, so that the result depends on the order of
/// the launches.
__global__ void scale_and_add(long long *number, long long factor, long long term)
{
  rve::follow();
  *number = factor * *number + term;
}

class LaunchListTest : public rve_test::BlockTest {
 protected:
  void SetUp() override
  {
    rve_test::BlockTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    number = reserve.reserve_zeros(1);
    cudaDeviceProp device;
    rve_test::check_cuda(cudaGetDeviceProperties(&device, 0));
    cudaFuncAttributes attributes;
    rve_test::check_cuda(cudaFuncGetAttributes(&attributes, scale_and_add));
    list.set_early(rve::waits_itself(device.major, attributes));
  }
  void add(long long factor, long long term)
  {
    list.add(scale_and_add, 1, 1, number, factor, term);
    expected = factor * expected + term;
  }
  void expect_all_done()
  {
    list.hand_over("a list of launches");
    EXPECT_EQ(reserve.receive(1)[0], expected);
  }

  rve::LaunchList list;
  rve::DeviceBuffer<long long> reserve;
  long long *number = nullptr;
  long long expected = 0;
};

TEST_F(LaunchListTest, RepeatedListIsAGraphWithTheSameResults)
{
  for (int round = 0; round < 5; ++round) {
    for (int k = 0; k < 6; ++k) add(2 + k % 2, k);
    expect_all_done();
    EXPECT_EQ(list.graphs(), round);    // every round but the first ran as a graph
  }
}

TEST_F(LaunchListTest, AlternatingListsKeepTheirGraphs)
{
  for (int round = 0; round < 4; ++round)
    for (int which = 0; which < 3; ++which) {
      for (int k = 0; k < 5; ++k) add(3, which * 7 + k);
      expect_all_done();
    }
  EXPECT_EQ(list.graphs(), 9);
}

TEST_F(LaunchListTest, OtherArgumentsMakeAnotherList)
{
  for (int round = 0; round < 6; ++round) {
    for (int k = 0; k < 5; ++k) add(3, k < 4 ? k : round);
    expect_all_done();
  }
  EXPECT_EQ(list.graphs(), 0);
}

TEST_F(LaunchListTest, ShortListsHaveNoGraphAndDiscardedListsDoNotRun)
{
  for (int round = 0; round < 3; ++round) {
    add(3, 1);
    expect_all_done();
  }
  EXPECT_EQ(list.graphs(), 0);
  const long long before = expected;
  for (int k = 0; k < 5; ++k) add(3, 1);
  list.forget();
  expected = before;
  expect_all_done();
}

}    // namespace
