// SPDX-License-Identifier: GPL-2.0-only
// Kernels that are compiled at run time, when a call first needs them. Only builds with CUDA
// contain this code.

#pragma once

#include "cuda/nvrtc.h"
#include "rve/engine/kernel_cache.h"
#include "rve/engine/kernel_variants.h"
#include "rve/engine/options.h"

#include <atomic>
#include <functional>
#include <string>

namespace rve {

/// Name of a kernel of rve/engine/cuda_kernels.cuh, such as "advance_many", with its kernel
/// variant.
struct KernelName {
  const char *kernel;
  KernelVariant variant;
  Format format;
  Arithmetic arithmetic;
};

/// Returns the C++ name, such as rve::advance_many<rve::KernelVariant::Plain, rve::FastNumbers>.
std::string to_string(const KernelName &name);

/// Optimization of a kernel by the compiler. Kernels with reduced optimization give the same bits.
/// On an H200 those of spheres with a servo are compiled in 5 to 9 s instead of 17 to 27 s. They
/// run at about half the speed.
enum class Optimization { Full, Reduced };

/// Returns a kernel for GPUs of this compute capability. If the cache does not contain it, the
/// function compiles and stores it. `log` receives a line for each compiled kernel with its compile
/// time, and for a cache that cannot be used. Throws std::runtime_error if compilation fails, or if
/// another thread sets `cancelled`.
DeviceCode compiled_kernel(const KernelName &name, int capability, const Nvrtc &nvrtc,
                           KernelCache &cache, const std::function<void(const std::string &)> &log,
                           Optimization optimization = Optimization::Full,
                           const std::atomic<bool> *cancelled = nullptr);

/// Returns the reason why kernels cannot be compiled at run time, with a remedy; empty if they can.
std::string runtime_kernels_obstacle();

/// Returns true if the kernel is loaded, or if it is in the cache with all optimizations. In the
/// latter case this function loads it.
bool is_at_hand(const KernelName &name, int capability);

/// Kernel that was compiled at run time.
struct RuntimeKernel {
  /// Handle that launches accept instead of a function.
  const void *function = nullptr;
  /// True if runtime_kernel() will always return this function. Otherwise it returns a faster one
  /// when its compilation in the background has ended.
  bool is_final = false;
};

/// Returns a kernel for the current device, which must have this compute capability. If the kernel
/// is not in the cache, it is compiled. A kernel with a servo or bookkeeping takes long; it is
/// compiled with reduced optimization first, so that the run can begin. The optimized kernel is
/// compiled at the same time in a thread of its own, which is cancelled at the end of the process.
/// Lines go to `log` or, if that is empty, to stderr.
RuntimeKernel runtime_kernel(const KernelName &name, int capability,
                             const std::function<void(const std::string &)> &log);

}    // namespace rve
