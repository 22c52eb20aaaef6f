// SPDX-License-Identifier: GPL-2.0-only
// CUDA kernels that run a pass over its items. Their threads collect the findings of the pass,
// which are maxima and errors of points, in device memory.

#pragma once

#include "cuda/early_launch.cuh"
#include "mpm/cuda_rank_exchange.cuh"
#include "mpm/exchange_passes.h"

#include <cstddef>
#include <cstdint>

namespace mpm {

constexpr int BLOCK = 128;    // threads; small, since a few thousand points do not fill a device
constexpr int EXCHANGE_BLOCK = 512;
static_assert(EXCHANGE_BLOCK >= ExchangeBuffers::MOST_MAXIMA, "each maximum needs a thread");

/// Sums on nodes to which all threads add.
struct SharedSums {
  std::int64_t *first;
};

RVE_HD inline void add_to(SharedSums sums, std::size_t k, std::int64_t part)
{
#if defined(__CUDA_ARCH__)
  // signed and unsigned sums have the same bits in two's complement
  atomicAdd(reinterpret_cast<unsigned long long *>(sums.first + k),
            static_cast<unsigned long long>(part));
#else
  sums.first[k] += part;
#endif
}

/// Sets *to to max(*to, value) atomically. `value` is finite, *to may be -infinity, and zeros are
/// positive. The atomic functions compare bit patterns as integers. Bit patterns of non-negative
/// doubles have the order of the values. Bit patterns of negative doubles have the reverse order.
RVE_HD inline void raise_together(double *to, double value)
{
#if defined(__CUDA_ARCH__)
  if (value >= 0.0)
    atomicMax(reinterpret_cast<long long *>(to), __double_as_longlong(value));
  else if (value < 0.0)
    atomicMin(reinterpret_cast<unsigned long long *>(to),
              static_cast<unsigned long long>(__double_as_longlong(value)));
#else
  if (value > *to) *to = value;
#endif
}

/// Findings of passes in the memory of the device.
struct Findings {
  double *maxima;
  std::uint64_t *first_error;    ///< one key per stage
  const std::int32_t *halt;      ///< flag of CudaMachine::halt_if(), or null
};

/// Findings of one thread. Maxima over all points are kept in registers until flush().
class DeviceTally {
 public:
  RVE_HD DeviceTally(const Findings &findings, int stage) :
      maxima_(findings.maxima), first_error_(findings.first_error + stage)
  {
    for (int k = 0; k < NUM_MAXIMA; ++k) best_[k] = 0.0;
  }

  RVE_HD void raise(int k, double value)
  {
    if (k >= NUM_MAXIMA) {
      raise_together(maxima_ + k, value);
    } else if (value > best_[k]) {
      best_[k] = value;
      has_best_ = true;
    }
  }

  RVE_HD void error(int p, ErrorCode code)
  {
#if defined(__CUDA_ARCH__)
    atomicMin(reinterpret_cast<unsigned long long *>(first_error_),
              static_cast<unsigned long long>(PointErrorKey::key(p, code)));
#else
    (void) p, (void) code;
#endif
  }

  RVE_HD void add(std::int64_t *sum, std::int64_t part)
  {
    add_to(SharedSums{sum}, 0, part);
  }

  /// Raises the maxima in device memory to the maxima of a warp. All threads of the warp must call
  /// it. The maximum of non-negative doubles is found from the high and then the low halves of
  /// their bit patterns.
  __device__ void flush()
  {
    constexpr unsigned all = 0xffffffffu;
    if (!__any_sync(all, has_best_)) return;
    for (int k = 0; k < NUM_MAXIMA; ++k) {
      if (!__any_sync(all, best_[k] > 0.0)) continue;
      const unsigned mine = __double2hiint(best_[k]), high = __reduce_max_sync(all, mine);
      const unsigned low = __reduce_max_sync(
          all, mine == high ? static_cast<unsigned>(__double2loint(best_[k])) : 0u);
      if (threadIdx.x % 32 == 0)
        raise_together(maxima_ + k,
                       __hiloint2double(static_cast<int>(high), static_cast<int>(low)));
    }
  }

 private:
  double *maxima_;
  std::uint64_t *first_error_;
  double best_[NUM_MAXIMA];
  bool has_best_ = false;
};

/// True if the pass P must not run. Either the halt flag is set, or P has a stage above 0 and a
/// point has an error of stage 0. A point with such an error has no weights.
template <class P> __device__ bool is_halted(const Findings &findings)
{
  if (findings.halt && *findings.halt > 0) return true;
  return P::STAGE > 0 && findings.first_error[0] != PointErrorKey::NO_ERROR;
}

/// Options of the solver that a kernel supports; each has those of the preceding ones, too. Fewer
/// options need fewer registers.
enum class KernelOptions {
  Default,    ///< neither boxes of points (StepView::has_boxes()) nor rings
  Boxes,      ///< boxes of points
  All         ///< boxes and rings of axisymmetric points
};

/// Tells the compiler which options a kernel does not have. If HasWater is false, no point has pore
/// water.
template <KernelOptions options, bool HasWater, class P> __device__ void leave_out_options(P &pass)
{
  if constexpr (P::USES_WATER && !HasWater) pass.step.points.water = {};
  if constexpr (options != KernelOptions::All) pass.step.axisymmetric = false;
  if constexpr (options == KernelOptions::Default) {
    if (pass.step.shape != ShapeFunction::Linear) pass.step.shape = ShapeFunction::Gimp;
    pass.step.mean_dilation = false;
  }
}

template <KernelOptions options, bool HasWater, class P>
__global__ void __launch_bounds__(BLOCK) over_items(P pass, int count, Findings findings)
{
  rve::follow();
  if (is_halted<P>(findings)) return;
  leave_out_options<options, HasWater>(pass);
  DeviceTally tally(findings, P::STAGE);
  pass.begin();
  const int i = blockIdx.x * BLOCK + threadIdx.x;
  if (i < count) pass(i, tally);
  tally.flush();
}

template <KernelOptions options, bool HasWater, class P>
__global__ void __launch_bounds__(BLOCK)
    scatter_items(P pass, int count, Findings findings, SumsByKind<SharedSums> sums)
{
  rve::follow();
  if (is_halted<P>(findings)) return;
  leave_out_options<options, HasWater>(pass);
  const int i = blockIdx.x * BLOCK + threadIdx.x;
  if (i >= count) return;
  pass.begin();
  pass(i, sums);
}

/// Exchanges the sums of shared nodes with all neighbours, in one block.
template <int D>
__global__ void __launch_bounds__(EXCHANGE_BLOCK)
    exchange_node_sums(ExchangeBuffers buffers, ExchangePartners partners, MoveSums<D> given,
                       MoveSums<D> taken, Findings findings)
{
  rve::follow();
  if (findings.halt && *findings.halt > 0) return;
  DeviceTally tally(findings, 0);
  const auto move = [&](MoveSums<D> sums, int k, std::int64_t *place) {
    sums.nodes += k;
    sums.buffer = place;
    sums(0, tally);
  };
  exchange_sums(
      buffers, partners, given.width(), [&](int k, std::int64_t *place) { move(given, k, place); },
      [&](int k, std::int64_t *place) { move(taken, k, place); });
}

static __global__ void __launch_bounds__(BLOCK) set_to_zero(std::int64_t *sums, std::size_t count)
{
  rve::follow();
  const std::size_t k = blockIdx.x * static_cast<std::size_t>(BLOCK) + threadIdx.x;
  if (k < count) sums[k] = 0;
}

}    // namespace mpm
