// SPDX-License-Identifier: GPL-2.0-only
// Kernels that are compiled at run time, when a call first needs them. Only builds with CUDA
// contain this code.

#pragma once

#include "cuda/nvrtc.h"
#include "rve/engine/kernel_cache.h"
#include "rve/engine/kernel_variants.h"
#include "rve/engine/options.h"

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

/// Returns a kernel for GPUs of this compute capability. If the cache does not contain it, the
/// function compiles and stores it. `log` receives a line for each compiled kernel with its compile
/// time, and for a cache that cannot be used. Throws std::runtime_error if compilation fails.
DeviceCode compiled_kernel(const KernelName &name, int capability, const Nvrtc &nvrtc,
                           KernelCache &cache, const std::function<void(const std::string &)> &log);

/// Returns the reason why kernels cannot be compiled at run time, with a remedy; empty if they can.
std::string runtime_kernels_obstacle();

/// Returns true if the kernel is loaded, so that runtime_kernel() neither compiles nor loads it.
bool is_loaded(const KernelName &name, int capability);

/// Returns a handle of the kernel that launches accept instead of a function. The current device
/// must have this compute capability. A kernel is compiled and loaded at most once in a process.
/// Lines go to `log` or, if that is empty, to stderr.
const void *runtime_kernel(const KernelName &name, int capability,
                           const std::function<void(const std::string &)> &log);

}    // namespace rve
