// SPDX-License-Identifier: GPL-2.0-only
// The text of the kernels, in the program: what they are compiled from at run time. Made by CMake (cmake/EmbedKernelText.cmake).

#pragma once

#include "cuda/nvrtc.h"

#include <vector>

namespace rve {

/// rve/engine/cuda_kernels.cuh and all that it includes.
const std::vector<DeviceHeader> &kernel_headers();

/// SHA-256 of all of it.
const char *kernel_text_digest();

}    // namespace rve
