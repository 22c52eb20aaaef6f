// SPDX-License-Identifier: GPL-2.0-only
// Loading of a kernel that was compiled at run time. Only builds with CUDA contain this code.

#pragma once

#include "cuda/nvrtc.h"

namespace rve {

/// Returns the reason why this program cannot load kernels that are compiled at run time; empty if
/// it can.
std::string loading_of_kernels_obstacle();

/// Returns a handle that CUDA accepts instead of the address of a kernel in cudaLaunchKernelExC,
/// cudaFuncSetAttribute, cudaFuncGetAttributes and the occupancy functions. It is valid for the
/// rest of the run. Throws std::runtime_error if the driver refuses the code.
const void *load_kernel(const DeviceCode &compiled);

}    // namespace rve
