// SPDX-License-Identifier: GPL-2.0-only
// A kernel that was compiled at run time, on the device. Exists only in builds with CUDA.

#pragma once

#include "cuda/nvrtc.h"

namespace rve {

/// Why this program cannot load code that was not compiled with it; empty if it can.
std::string loading_of_kernels_obstacle();

/// What CUDA takes in the place of a kernel's address: cudaLaunchKernelExC, cudaFuncSetAttribute, cudaFuncGetAttributes, occupancy. For
/// the rest of the run. Throws std::runtime_error if the driver refuses it.
const void *load_kernel(const DeviceCode &compiled);

}    // namespace rve
