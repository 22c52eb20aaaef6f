// SPDX-License-Identifier: GPL-2.0-only
// The CUDA device of a rank. Exists only in builds with CUDA.

#pragma once

#include <string>

namespace rve {

struct CudaDevice {
  int number = -1;         ///< as CUDA counts
  std::string obstacle;    ///< why there is none, with a remedy; empty when there is one
  /// Its driver makes the code from text, when a kernel is used for the first time.
  bool compiles = false;
};

/// The device of a rank of this machine: ranks take in turn the cards that the program has code for. `kernel` is one of those that
/// shall run there, the smallest, say: the device must be able to load it. Throws std::runtime_error when a device does not answer.
CudaDevice find_cuda_device(int local_rank, const void *kernel);

}    // namespace rve
