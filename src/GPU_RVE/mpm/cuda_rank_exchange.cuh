// SPDX-License-Identifier: GPL-2.0-only
// Exchange of numbers between the GPUs of the ranks on one computer. Kernels that run between the
// passes of a step make the exchange. Hosts neither take part in it nor wait for it. The exchange
// buffers are in shared page-locked memory that all GPUs can access. A rank writes its numbers,
// sets a flag, waits for the flags of all other ranks and reads their numbers.

#pragma once

#include "cuda/device_buffer.cuh"
#include "cuda/early_launch.cuh"
#include "mpm/rank_devices.h"

#include <cuda/atomic>
#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>

namespace mpm {

/// Layout of the shared memory, for kernels. Exchanges are numbered as rounds. All ranks take part
/// in every round. Each round waits for all ranks, so all ranks have read the values of round r
/// before any rank writes values of round r + 2. Two buffers for each purpose therefore suffice.
struct ExchangeBuffers {
  static constexpr int MOST_RANKS = 16, MOST_MAXIMA = 256;

  char *memory;
  std::uint64_t *rounds;    ///< rounds of this rank so far, in the memory of its device
  int ranks, rank;          ///< number of ranks, and this rank

  /// Largest number of integers that one rank can send to another rank in a round. All exchange
  /// buffers together have 16 MiB.
  static __host__ __device__ std::size_t buffer_length(int ranks)
  {
    return (std::size_t(1) << 20) / (ranks * ranks);
  }
  static std::size_t size(int ranks)
  {
    return flags(ranks) +
        2 * ranks *
        (MOST_MAXIMA * sizeof(double) + ranks * buffer_length(ranks) * sizeof(std::int64_t));
  }

  /// Flag that is above zero if a rank has left. It then ends all waiting. `memory` is a device or
  /// a host address of the shared memory.
  static __host__ __device__ std::uint64_t *left(char *memory)
  {
    return reinterpret_cast<std::uint64_t *>(memory);
  }

  /// Last round for which a rank has written all its numbers.
  __device__ std::uint64_t &finished_round(int of) const
  {
    return *reinterpret_cast<std::uint64_t *>(memory + FLAG * (1 + of));
  }
  __device__ volatile double *maxima(int from, std::uint64_t round) const
  {
    return reinterpret_cast<double *>(memory + flags(ranks)) +
        (2 * from + round % 2) * static_cast<std::size_t>(MOST_MAXIMA);
  }
  __device__ std::int64_t *exchange_buffer(int from, int to, std::uint64_t round) const
  {
    auto *first = reinterpret_cast<std::int64_t *>(memory + flags(ranks) +
                                                   2 * ranks * MOST_MAXIMA * sizeof(double));
    return first +
        ((2 * from + round % 2) * static_cast<std::size_t>(ranks) + to) * buffer_length(ranks);
  }

  /// Returns the number of the next round. All threads of the only block call it.
  __device__ std::uint64_t begin_round() const { return *rounds + 1; }
  /// Publishes the numbers that this block has written, and waits until all ranks have published
  /// their numbers of this round or a rank has left. All threads call it.
  __device__ void synchronise(std::uint64_t round) const
  {
    using Flag = cuda::atomic_ref<std::uint64_t, cuda::thread_scope_system>;
    __threadfence_system();
    __syncthreads();
    if (threadIdx.x == 0) {
      *rounds = round;    // all threads have read the former value
      Flag(finished_round(rank)).store(round, cuda::memory_order_release);
    }
    if (threadIdx.x < ranks) {
      const Flag other(finished_round(threadIdx.x)), is_left(*left(memory));
      while (other.load(cuda::memory_order_acquire) < round &&
             is_left.load(cuda::memory_order_relaxed) == 0)
        __nanosleep(100);
    }
    __syncthreads();
  }

 private:
  static constexpr std::size_t FLAG = 128;    ///< bytes; each flag has its own cache line
  static __host__ __device__ std::size_t flags(int ranks) { return FLAG * (1 + ranks); }
};

/// Computes maxima over all ranks in place. A halted kernel takes part in no round. The kernel that
/// later repeats its work takes part instead.
template <class Number>
__global__ void exchange_maxima(ExchangeBuffers buffers, const std::int32_t *halt, Number *maxima,
                                int count)
{
  rve::follow();
  if (halt && *halt > 0) return;
  const std::uint64_t round = buffers.begin_round();
  const int k = threadIdx.x;
  if (k < count) buffers.maxima(buffers.rank, round)[k] = maxima[k];
  buffers.synchronise(round);
  if (k >= count) return;
  Number most = maxima[k];
  for (int other = 0; other < buffers.ranks; ++other) {
    const Number theirs = buffers.maxima(other, round)[k];
    if (theirs > most) most = theirs;
  }
  maxima[k] = most;
}

/// Another rank, and the ends (exclusive) of its nodes in the lists of given and taken nodes.
struct ExchangePartner {
  int rank, given_end, taken_end;
};
struct ExchangePartners {
  int count;
  ExchangePartner partner[ExchangeBuffers::MOST_RANKS];
};

/// Exchanges sums of nodes, with `width` integers per node. give(k, place) writes the sums of the
/// k-th given node to `place`, and take(k, place) adds the sums of the k-th taken node from
/// `place`.
template <class Give, class Take>
__device__ void exchange_sums(const ExchangeBuffers &buffers, const ExchangePartners &partners,
                              std::size_t width, const Give &give, const Take &take)
{
  const std::uint64_t round = buffers.begin_round();
  const auto each_node = [&](int ExchangePartner::*end, const auto &buffer_of, const auto &act) {
    for (int n = 0, first = 0; n < partners.count; ++n) {
      const ExchangePartner &other = partners.partner[n];
      std::int64_t *buffer = buffer_of(other.rank);
      for (int k = first + threadIdx.x; k < other.*end; k += blockDim.x)
        act(k, buffer + (k - first) * width);
      first = other.*end;
    }
  };
  each_node(
      &ExchangePartner::given_end,
      [&](int to) { return buffers.exchange_buffer(buffers.rank, to, round); }, give);
  buffers.synchronise(round);
  each_node(
      &ExchangePartner::taken_end,
      [&](int from) { return buffers.exchange_buffer(from, buffers.rank, round); }, take);
}

/// Shared memory of this rank for exchanges. It is open if 2 to MOST_RANKS ranks are on one
/// computer and each has its own GPU.
class RankExchange {
 public:
  RankExchange() = default;
  RankExchange(const RankExchange &) = delete;
  RankExchange &operator=(const RankExchange &) = delete;
  ~RankExchange()
  {
    if (places_.memory) cudaHostUnregister(memory_.get());
  }

  /// Opens the shared memory if that is possible. Collective; ranks without a device call
  /// each_rank_has_its_device() instead.
  void open(const Communication &communication, const cudaUUID_t &device)
  {
    DeviceName name;
    static_assert(sizeof(name) == sizeof(device));
    std::memcpy(&name, &device, sizeof(name));
    if (!each_rank_has_its_device(communication, name)) return;
    const int ranks = communication.ranks;
    if (ranks == 1 || ranks > ExchangeBuffers::MOST_RANKS) return;
    const std::size_t size = ExchangeBuffers::size(ranks);
    memory_ = communication.shared_memory(size);
    if (!memory_) return;
    const bool is_registered =
        cudaHostRegister(memory_.get(), size, cudaHostRegisterDefault) == cudaSuccess;
    void *there = nullptr;
    double failed =
        !is_registered || cudaHostGetDevicePointer(&there, memory_.get(), 0) != cudaSuccess ? 1.0
                                                                                            : 0.0;
    cudaGetLastError();
    communication.max_over_ranks(&failed, 1);
    if (failed == 0.0)
      places_ = {static_cast<char *>(there), rounds_.reserve_zeros(1), ranks, communication.rank};
    else if (is_registered)
      cudaHostUnregister(memory_.get());
  }

  bool is_open() const { return places_.memory != nullptr; }
  /// Permanently ends the waiting in the kernels of all ranks.
  void leave()
  {
    if (is_open()) *flag_of_leaving() = 1;
  }
  bool is_left() const { return is_open() && *flag_of_leaving() > 0; }
  const ExchangeBuffers &places() const { return places_; }

 private:
  volatile std::uint64_t *flag_of_leaving() const
  {
    return ExchangeBuffers::left(static_cast<char *>(memory_.get()));
  }

  std::shared_ptr<void> memory_;
  ExchangeBuffers places_ = {};
  rve::DeviceBuffer<std::uint64_t> rounds_;
};

}    // namespace mpm
