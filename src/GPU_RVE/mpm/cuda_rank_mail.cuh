// SPDX-License-Identifier: GPL-2.0-only
// What ranks with a GPU each tell each other without their hosts, in kernels between the passes of a step: through page-locked memory of
// the computer that they share, which all of its GPUs reach. A rank leaves its numbers there, says so, waits until all others have said so,
// and takes theirs. Its host goes on meanwhile.

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

/// For kernels. Rounds of mail are numbered, alike on all ranks. What is left in one of them is taken before anyone leaves anything in the next but
/// one: each round waits for all ranks. So there are two places for everything.
struct MailPlaces {
  static constexpr int MOST_RANKS = 16, MOST_MAXIMA = 256;

  char *memory;
  std::uint64_t *rounds;    ///< so far, of this rank; in the memory of its device
  int ranks, rank;          ///< all, and this one

  /// Integers from one rank to another one, at most: all letters have 16 MiB.
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

  /// Above zero when a rank has left, and nobody shall wait any more. Of host memory, too.
  static __host__ __device__ std::uint64_t *leave_flag(char *memory)
  {
    return reinterpret_cast<std::uint64_t *>(memory);
  }

  /// The last round in which that rank has left all that is wanted of it.
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

  /// All threads of the only block begin the next round.
  __device__ std::uint64_t begin_round() const { return *rounds + 1; }
  /// All of them: what they have left can be taken, and what others have left in this round is there.
  __device__ void synchronise(std::uint64_t round) const
  {
    using Flag = cuda::atomic_ref<std::uint64_t, cuda::thread_scope_system>;
    __threadfence_system();
    __syncthreads();
    if (threadIdx.x == 0) {
      *rounds = round;    // all have read it
      Flag(finished_round(rank)).store(round, cuda::memory_order_release);
    }
    if (threadIdx.x < ranks) {
      const Flag other(finished_round(threadIdx.x)), is_left(*leave_flag(memory));
      while (other.load(cuda::memory_order_acquire) < round &&
             is_left.load(cuda::memory_order_relaxed) == 0)
        __nanosleep(100);
    }
    __syncthreads();
  }

 private:
  static constexpr std::size_t FLAG = 128;    ///< bytes: a flag has a line of a cache for itself
  static __host__ __device__ std::size_t flags(int ranks) { return FLAG * (1 + ranks); }
};

/// Maxima over all ranks, in place. Passes that are halted have no rounds: those that are made in their place have them.
template <class Number>
__global__ void meet_for_maxima(MailPlaces mail, const std::int32_t *halt, Number *maxima,
                                int count)
{
  rve::follow();
  if (halt && *halt > 0) return;
  const std::uint64_t round = mail.begin_round();
  const int k = threadIdx.x;
  if (k < count) mail.maxima(mail.rank, round)[k] = maxima[k];
  mail.synchronise(round);
  if (k >= count) return;
  Number most = maxima[k];
  for (int other = 0; other < mail.ranks; ++other) {
    const Number theirs = mail.maxima(other, round)[k];
    if (theirs > most) most = theirs;
  }
  maxima[k] = most;
}

/// Another rank, and where the sums for it and from it end in the lists of those that are given and taken.
struct MailPartner {
  int rank, given_end, taken_end;
};
struct MailPartners {
  int count;
  MailPartner partner[MailPlaces::MOST_RANKS];
};

/// give(k, place) leaves the sums of the k-th node that is given, of `width` integers each, and take(k, place) adds those of the k-th one that is
/// taken.
template <class Give, class Take>
__device__ void meet_for_sums(const MailPlaces &mail, const MailPartners &partners,
                              std::size_t width, const Give &give, const Take &take)
{
  const std::uint64_t round = mail.begin_round();
  const auto each_node = [&](int MailPartner::*end, const auto &buffer_of, const auto &act) {
    for (int n = 0, first = 0; n < partners.count; ++n) {
      const MailPartner &other = partners.partner[n];
      std::int64_t *buffer = buffer_of(other.rank);
      for (int k = first + threadIdx.x; k < other.*end; k += blockDim.x)
        act(k, buffer + (k - first) * width);
      first = other.*end;
    }
  };
  each_node(
      &MailPartner::given_end, [&](int to) { return mail.exchange_buffer(mail.rank, to, round); },
      give);
  mail.synchronise(round);
  each_node(
      &MailPartner::taken_end,
      [&](int from) { return mail.exchange_buffer(from, mail.rank, round); }, take);
}

/// The mail of this rank, if there can be any: all ranks on one computer, each with a GPU of its own.
class RankMail {
 public:
  RankMail() = default;
  RankMail(const RankMail &) = delete;
  RankMail &operator=(const RankMail &) = delete;
  ~RankMail()
  {
    if (places_.memory) cudaHostUnregister(memory_.get());
  }

  /// All ranks call it together, or each_rank_has_its_device() those without a device.
  void open(const Communication &communication, const cudaUUID_t &device)
  {
    DeviceName name;
    static_assert(sizeof(name) == sizeof(device));
    std::memcpy(&name, &device, sizeof(name));
    if (!each_rank_has_its_device(communication, name)) return;
    const int ranks = communication.ranks;
    if (ranks == 1 || ranks > MailPlaces::MOST_RANKS) return;
    const std::size_t size = MailPlaces::size(ranks);
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
  /// Ends all waiting, also that of other ranks: for good.
  void leave()
  {
    if (is_open()) *flag_of_leaving() = 1;
  }
  bool is_left() const { return is_open() && *flag_of_leaving() > 0; }
  const MailPlaces &places() const { return places_; }

 private:
  volatile std::uint64_t *flag_of_leaving() const
  {
    return MailPlaces::leave_flag(static_cast<char *>(memory_.get()));
  }

  std::shared_ptr<void> memory_;
  MailPlaces places_ = {};
  rve::DeviceBuffer<std::uint64_t> rounds_;
};

}    // namespace mpm
