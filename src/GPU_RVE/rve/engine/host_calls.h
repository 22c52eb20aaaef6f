// SPDX-License-Identifier: GPL-2.0-only
// Calls of RVEs on CPU threads: one RVE per thread at a time. HostEngine makes all calls in this
// way, CudaEngine the diagnostic evaluations for which no kernel has been compiled yet.

#pragma once

#include "rve/engine/host_kernels.h"

#include <functional>
#include <vector>

namespace rve {

/// Returns true if the CPU and this build support the instruction set x86-64-v3.
bool has_x86_64_v3();

/// Returns the functions for the best instruction set of this CPU. Throws InputError if this build
/// has no code for this CPU.
template <int D> HostKernel<D> best_host_kernel(Format format);

/// Returns `threads`, or the number of threads of OpenMP if it is 0.
int chosen_threads(int threads);

/// Calls `work(m, thread)` for each m from 0 to `count` - 1. A thread takes the next m when it is
/// free. An exception of `work` is thrown again after the last call.
void for_each_on_threads(int count, int threads,
                         const std::function<void(int m, int thread)> &work);

template <int D> class HostCalls {
 public:
  /// `threads` is the number of threads; 0 stands for that of OpenMP.
  HostCalls(Format format, int threads) :
      kernel_(best_host_kernel<D>(format)), num_threads_(chosen_threads(threads)),
      memory_(num_threads_)
  {
  }

  int num_threads() const { return num_threads_; }
  HostWorkspaceSizes workspace_sizes(int num_grains, int pair_capacity, KernelVariant variant) const
  {
    return kernel_.workspace_sizes(num_grains, pair_capacity, variant);
  }

  /// Runs a call of BatchEngine (Call and Answers are its types). Threads call
  /// `with_state(k, advance)`, which must call `advance(bytes)` with the address of the device
  /// state of the RVE at index k of the call. The answers are valid until the next call.
  template <class Answers, class Call, class WithState>
  Answers run(const Call &call, const WithState &with_state)
  {
    const int count = call.num_rves;
    answers_.assign(count, AnswerRecord<D>());
    if (call.with_details)
      details_.assign(call.detail_of ? call.num_details : count, DetailRecord<D>());
    const auto detail_of = [&](int k) -> DetailRecord<D> * {
      if (!call.with_details) return nullptr;
      if (!call.detail_of) return &details_[k];
      const int mine = (*call.detail_of)[k];
      return mine < 0 ? nullptr : &details_[mine];
    };
    const HostWorkspaceSizes sizes =
        workspace_sizes(call.largest, call.pair_capacity, call.variant);
    for_each_on_threads(count, num_threads_, [&](int m, int thread) {
      const int k = call.order ? (*call.order)[m] : m;
      const HostWorkspace workspace = memory_[thread].prepare(sizes, call.pair_capacity);
      with_state(k, [&](char *device_state) {
        kernel_.advance(device_state, call.drives[k],
                        call.steering.empty() ? nullptr : &call.steering[k], call.constants,
                        workspace, call.variant, answers_[k], detail_of(k));
      });
    });
    return {answers_.data(), call.with_details ? details_.data() : nullptr};
  }

 private:
  /// Memory of one thread, reused for all its RVEs.
  struct ThreadMemory {
    std::vector<char> shared, workspace;

    HostWorkspace prepare(const HostWorkspaceSizes &sizes, int pair_capacity)
    {
      if (shared.size() < sizes.shared) shared.resize(sizes.shared);
      if (workspace.size() < sizes.workspace) workspace.resize(sizes.workspace);
      return {shared.data(), workspace.data(), pair_capacity};
    }
  };

  const HostKernel<D> kernel_;
  const int num_threads_;
  std::vector<ThreadMemory> memory_;
  std::vector<AnswerRecord<D>> answers_;
  std::vector<DetailRecord<D>> details_;
};

}    // namespace rve
