// SPDX-License-Identifier: GPL-2.0-only
// Choice of a CUDA device, and messages if none can be used. This file does not use the CUDA
// runtime, so its functions can be tested on machines without a GPU.

#pragma once

#include <string>
#include <vector>

namespace rve {

/// Lowest compute capability that the kernels support: 8.0, the first one with an integer sum over
/// a warp in one instruction (__reduce_add_sync).
constexpr int kOldestCapability = 80;

struct GpuProperties {
  std::string name;
  int capability = 0;    ///< 10 major + minor
};

/// Device code that the program contains for one architecture.
struct CudaArchitecture {
  int number = 0;    ///< 10 major + minor
  bool binary = false;
  bool ptx = false;       ///< PTX that the driver compiles at first use
  bool only = false;      ///< runs on this architecture only (suffix `a`)
  bool family = false;    ///< PTX for GPUs of the same major version only (suffix `f`)
};

/// Parses a colon-separated list of entries as in CMAKE_CUDA_ARCHITECTURES: "80-virtual:90".
/// Entries that do not begin with a number are ignored.
std::vector<CudaArchitecture> cuda_architectures(const std::string &list);

enum class GpuCode { None, Ptx, Binary };

/// Returns the kind of code that a GPU of this compute capability can load: Binary if there is a
/// binary for it, else Ptx if there is PTX for it, else None.
GpuCode code_for(int capability, const std::vector<CudaArchitecture> &architectures);

/// Returns the reason why the GPU cannot run the program, with a remedy; empty if it can.
std::string gpu_obstacle(const GpuProperties &gpu,
                         const std::vector<CudaArchitecture> &architectures);

/// Returns the error message for a GPU that cannot load the kernels, although the program contains
/// code of kind `code` for it. `words` is CUDA's error message. For PTX the message adds that the
/// driver may be too old.
std::string loading_obstacle(const GpuProperties &gpu, GpuCode code, const std::string &words);

/// Result of CUDA's search for devices.
enum class DriverError { NoDriver, OldDriver, NoDevice, Other };

/// Returns the error message for a search that found no device, with a remedy if there is one.
/// `driver_version` and `runtime_version` are versions of CUDA: 1000 major + 10 minor. `visible` is
/// the value of the environment variable CUDA_VISIBLE_DEVICES, or null if it is not set. `words` is
/// CUDA's error message.
std::string driver_obstacle(DriverError driver_error, int driver_version, int runtime_version,
                            const char *visible, const std::string &words);

struct CudaChoice {
  int number = -1;         ///< number of the device in CUDA; -1 if no device can be used
  std::string obstacle;    ///< reason why no device can be used, or empty
};

/// Returns the device of a rank. `obstacles` has one text per GPU; it is empty if the GPU is
/// usable. The usable GPU with index `local_rank` modulo the number of usable GPUs is chosen, where
/// `local_rank` is the rank within the machine.
CudaChoice choose_gpu(const std::vector<std::string> &obstacles, int local_rank);

}    // namespace rve
