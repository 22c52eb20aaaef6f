// The engine on a CUDA device: one thread block per RVE. Exists only in builds with CUDA.

#ifndef RVE_ENGINE_CUDA_ENGINE_H
#define RVE_ENGINE_CUDA_ENGINE_H

#include "rve/engine/engine.h"

namespace rve {

struct CudaDevice {
  int number = -1;         ///< as CUDA counts
  std::string obstacle;    ///< why there is none, with a remedy; empty when there is one
};

/// The device of a rank of this machine: ranks take in turn the cards that the program has code for. Throws std::runtime_error when
/// a device does not answer.
CudaDevice find_cuda_device(int local_rank);

/// Nothing, and an `obstacle` in words, where there is no device. Throws std::runtime_error when the device fails.
std::unique_ptr<Engine> make_cuda_engine(const Options &options, std::string &obstacle);

}    // namespace rve

#endif
