// The text of the kernels, in the program: what they are compiled from at run time. Made by CMake (cmake/EmbedKernelText.cmake).

#ifndef RVE_ENGINE_KERNEL_TEXT_H
#define RVE_ENGINE_KERNEL_TEXT_H

#include "cuda/nvrtc.h"

#include <vector>

namespace rve {

/// rve/engine/cuda_kernels.cuh and all that it includes.
const std::vector<DeviceHeader> &kernel_headers();

/// SHA-256 of all of it.
const char *kernel_text_digest();

}    // namespace rve

#endif
