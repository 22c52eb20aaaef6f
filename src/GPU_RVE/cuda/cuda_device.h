// SPDX-License-Identifier: GPL-2.0-only
// Search for the CUDA device of a rank. Only builds with CUDA contain this code.

#pragma once

#include <string>

namespace rve {

struct CudaDevice {
  int number = -1;         ///< number of the device in CUDA
  std::string obstacle;    ///< reason why no device can be used, with a remedy; or empty
  /// True if the driver compiles the code from PTX when a kernel is first used.
  bool compiles = false;
};

/// Returns the device of a rank of this machine. The ranks are distributed in turn over the GPUs
/// for which the program has code. `kernel` is any kernel of the program; if the device cannot load
/// it, `obstacle` contains the reason. Throws std::runtime_error if a device does not respond.
CudaDevice find_cuda_device(int local_rank, const void *kernel);

}    // namespace rve
