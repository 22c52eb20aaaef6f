// SPDX-License-Identifier: GPL-2.0-only
// Choice of a CUDA device, and messages if none can be used. It does not use the CUDA runtime, so
// that any machine can test it.

#pragma once

#include <string>
#include <vector>

namespace rve {

/// Oldest compute capability of the kernels: 8.0, whose warps add integers by one instruction.
constexpr int kOldestCapability = 80;

struct GpuProperties {
  std::string name;
  int capability = 0;    ///< 10 major + minor
};

/// Code of a program for an architecture.
struct CudaArchitecture {
  int number = 0;    ///< 10 major + minor
  bool binary = false;
  bool ptx = false;       ///< PTX that the driver compiles at first use
  bool only = false;      ///< for this architecture alone (suffix `a`)
  bool family = false;    ///< for the GPUs of its generation alone (suffix `f`)
};

/// Parses a list of CMake, separated by colons: "80-virtual:90". Entries other than numbers are
/// ignored.
std::vector<CudaArchitecture> cuda_architectures(const std::string &list);

enum class GpuCode { None, Ptx, Binary };

/// Returns what a GPU of this compute capability runs: a binary if there is one, else PTX, else
/// None.
GpuCode code_for(int capability, const std::vector<CudaArchitecture> &architectures);

/// Returns the reason why the GPU cannot run the program, with a remedy; empty if it can.
std::string gpu_obstacle(const GpuProperties &gpu,
                         const std::vector<CudaArchitecture> &architectures);

/// Returns the error for a GPU that cannot load the kernels although there is code of the kind
/// `code` for it. `words` is CUDA's message. With PTX the driver may be too old.
std::string loading_obstacle(const GpuProperties &gpu, GpuCode code, const std::string &words);

/// Result of CUDA's search for devices.
enum class DriverError { NoDriver, OldDriver, NoDevice, Other };

/// Returns a message for a result, with a remedy. Versions are those of CUDA, 1000 major + 10
/// minor; `visible` is the environment variable CUDA_VISIBLE_DEVICES, or null.
std::string driver_obstacle(DriverError driver_error, int driver_version, int runtime_version,
                            const char *visible, const std::string &words);

struct CudaChoice {
  int number = -1;         ///< number of the device in CUDA
  std::string obstacle;    ///< reason why there is none
};

/// Returns a device for a rank. `obstacles` has a text for each GPU, empty if it is usable; the
/// ranks of a machine take usable ones in turn.
CudaChoice choose_gpu(const std::vector<std::string> &obstacles, int local_rank);

}    // namespace rve
