// SPDX-License-Identifier: GPL-2.0-only
// Source text of the kernels, embedded in the program for compilation at run time. Made by CMake
// (cmake/EmbedKernelText.cmake).

#pragma once

#include "cuda/nvrtc.h"

#include <vector>

namespace rve {

/// Returns rve/engine/cuda_kernels.cuh and all headers that it includes.
const std::vector<DeviceHeader> &kernel_headers();

/// Returns the SHA-256 of all headers.
const char *kernel_text_digest();

}    // namespace rve
