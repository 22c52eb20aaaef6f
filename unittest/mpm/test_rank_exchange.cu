// SPDX-License-Identifier: GPL-2.0-only
// Exchange buffers between the GPUs of ranks. In this test each rank is a stream of the same GPU.
// The kernels of all ranks run at the same time and synchronise.

#include "cuda/device_buffer.cuh"
#include "mpm/cuda_rank_exchange.cuh"
#include "support/block_runner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace {

using mpm::ExchangeBuffers;
using mpm::ExchangePartners;
using rve::HostBuffer;
using rve::SideStream;

constexpr int RANKS = 3, THREADS = 512;

/// Memory that all ranks share, and a stream for each.
class RankMailTest : public rve_test::BlockTest {
 protected:
  void SetUp() override
  {
    rve_test::BlockTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    memory = common.host_array(ExchangeBuffers::size(RANKS));
    std::memset(memory, 0, ExchangeBuffers::size(RANKS));
    rounds = rounds_of_ranks.reserve_zeros(RANKS);
    rve_test::check_cuda(cudaStreamSynchronize(nullptr));
  }
  ExchangeBuffers places(int rank) const { return {memory, rounds + rank, RANKS, rank}; }
  void wait()
  {
    for (SideStream &stream : streams) rve_test::check_cuda(cudaStreamSynchronize(stream));
  }

  HostBuffer<char> common;
  char *memory = nullptr;
  rve::DeviceBuffer<std::uint64_t> rounds_of_ranks;
  std::uint64_t *rounds = nullptr;
  SideStream streams[RANKS];
};

// The kernels of all rounds are launched first. The ranks then exchange their maxima without
// synchronisation by the host.
TEST_F(RankMailTest, MaximaAreThoseOfAllRanksInEveryRound)
{
  const int count = 20, rounds = 100;
  const auto value = [](int rank, int round, int k) {
    return static_cast<double>((rank * 31 + round * 17 + k * 7) % 101) - 50.0;
  };
  HostBuffer<double> numbers[RANKS];
  for (int rank = 0; rank < RANKS; ++rank) {
    double *mine = numbers[rank].host_array(rounds * count);
    for (int round = 0; round < rounds; ++round)
      for (int k = 0; k < count; ++k) mine[round * count + k] = value(rank, round, k);
  }
  for (int round = 0; round < rounds; ++round)
    for (int rank = 0; rank < RANKS; ++rank)
      mpm::exchange_maxima<<<1, THREADS, 0, streams[rank]>>>(
          places(rank), nullptr, numbers[rank].host_array(1) + round * count, count);
  wait();
  for (int round = 0; round < rounds; ++round)
    for (int k = 0; k < count; ++k) {
      const double most = std::max({value(0, round, k), value(1, round, k), value(2, round, k)});
      for (int rank = 0; rank < RANKS; ++rank)
        ASSERT_EQ(numbers[rank].host_array(1)[round * count + k], most)
            << "rank " << rank << ", round " << round << ", number " << k;
    }
}

/// Rank r sends r + 1 nodes with two numbers per node to every other rank, and sums the numbers
/// that it receives.
__global__ void give_and_take(ExchangeBuffers buffers, int round, ExchangePartners partners,
                              unsigned long long *sum)
{
  mpm::exchange_sums(
      buffers, partners, 2,
      [&](int k, std::int64_t *place) {
        place[0] = 1000 * buffers.rank + k;
        place[1] = round;
      },
      [&](int, std::int64_t *place) {
        atomicAdd(sum, static_cast<unsigned long long>(place[0] + 1000000 * place[1]));
      });
}

TEST_F(RankMailTest, SumsAreThoseOfTheSentNumbers)
{
  const int rounds = 100;
  HostBuffer<unsigned long long> sums;
  unsigned long long *sum = sums.host_array(RANKS);
  std::fill_n(sum, RANKS, 0ull);
  for (int round = 1; round <= rounds; ++round)
    for (int rank = 0; rank < RANKS; ++rank) {
      ExchangePartners partners = {};
      int given = 0, taken = 0;
      for (int other = 0; other < RANKS; ++other)
        if (other != rank)
          partners.partner[partners.count++] = {other, given += rank + 1, taken += other + 1};
      give_and_take<<<1, THREADS, 0, streams[rank]>>>(places(rank), round, partners, sum + rank);
    }
  wait();
  const auto first_for = [](int from, int to) {    // index in the list of sent nodes
    return (from + 1) * (to < from ? to : to - 1);
  };
  for (int rank = 0; rank < RANKS; ++rank) {
    unsigned long long expected = 0;
    for (int other = 0; other < RANKS; ++other)
      for (int k = 0; other != rank && k < other + 1; ++k)
        for (int round = 1; round <= rounds; ++round)
          expected += 1000 * other + first_for(other, rank) + k + 1000000ull * round;
    EXPECT_EQ(sum[rank], expected) << "rank " << rank;
  }
}

// If a rank needs the host, its kernels are cancelled and write nothing. They are launched again
// later, and until then the kernels of the other ranks wait.
TEST_F(RankMailTest, CancelledRankSynchronisesLater)
{
  HostBuffer<double> numbers;
  double *number = numbers.host_array(RANKS);
  HostBuffer<std::int32_t> flags;
  std::int32_t *halt = flags.host_array(1);
  *halt = 1;
  for (int rank = 0; rank < RANKS; ++rank) {
    number[rank] = 10.0 + rank;
    mpm::exchange_maxima<<<1, THREADS, 0, streams[rank]>>>(places(rank), rank == 2 ? halt : nullptr,
                                                           number + rank, 1);
  }
  rve_test::check_cuda(cudaStreamSynchronize(streams[2]));
  EXPECT_EQ(number[2], 12.0);
  EXPECT_EQ(cudaStreamQuery(streams[0]), cudaErrorNotReady);
  mpm::exchange_maxima<<<1, THREADS, 0, streams[2]>>>(places(2), nullptr, number + 2, 1);
  wait();
  for (int rank = 0; rank < RANKS; ++rank) EXPECT_EQ(number[rank], 12.0);
}

TEST_F(RankMailTest, RanksThatHaveEndedDoNotBlockOthers)
{
  HostBuffer<double> numbers;
  double *number = numbers.host_array(1);
  *number = 1.0;
  mpm::exchange_maxima<<<1, THREADS, 0, streams[0]>>>(places(0), nullptr, number, 1);
  EXPECT_EQ(cudaStreamQuery(streams[0]), cudaErrorNotReady);
  *static_cast<volatile std::uint64_t *>(ExchangeBuffers::left(memory)) = 1;
  rve_test::check_cuda(cudaStreamSynchronize(streams[0]));
}

}    // namespace
