// SPDX-License-Identifier: GPL-2.0-only
// Kernels of programs that are compiled while the program runs, when a call needs one first. Exists only in builds with CUDA.

#pragma once

#include "cuda/nvrtc.h"
#include "rve/engine/kernel_cache.h"
#include "rve/engine/options.h"
#include "rve/engine/programs.h"

#include <functional>
#include <string>

namespace rve {

/// A kernel of rve/engine/cuda_kernels.cuh: "advance_many" of a program, for example.
struct KernelName {
  const char *kernel;
  Program program;
  Format format;
  Arithmetic arithmetic;
};

/// In C++: rve::advance_many<rve::Program::Plain, rve::FastNumbers>.
std::string to_string(const KernelName &name);

/// From the cache, or compiled and kept there, for cards of this compute capability. `log` takes lines for the log: of what was
/// compiled and how long it took, of a cache that cannot be used. Throws std::runtime_error where the compiler cannot.
DeviceCode compiled_kernel(const KernelName &name, int capability, const Nvrtc &nvrtc,
                           KernelCache &cache, const std::function<void(const std::string &)> &log);

/// Why kernels cannot be compiled at run time here, with a remedy; empty if they can.
std::string runtime_kernels_obstacle();

/// True if runtime_kernel() has the kernel without compiling or loading it.
bool is_loaded(const KernelName &name, int capability);

/// A handle that launches take in the place of a function, on the present device, which has this compute capability. Compiled and loaded
/// at most once in a process. Lines about it go to `log` or, if that is empty, to the standard error.
const void *runtime_kernel(const KernelName &name, int capability,
                           const std::function<void(const std::string &)> &log);

}    // namespace rve
