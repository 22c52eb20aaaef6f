// SPDX-License-Identifier: GPL-2.0-only
// How calls of a CUDA engine are launched: kernels, threads and memory on chip, by the size of a call.

#pragma once

#include "rve/engine/cuda_programs.h"
#include "rve/engine/options.h"

#include <cuda_runtime.h>

#include <cstddef>
#include <map>
#include <tuple>

namespace rve {

inline int rounded_up(int number, int unit)
{
  return (number + unit - 1) / unit * unit;
}

/// To the alignment of memory of the device.
inline std::size_t aligned(std::size_t size)
{
  return (size + 255) / 256 * 256;
}

/// What decides how a call is launched.
struct CallShape {
  int count = 0;        ///< RVEs
  int largest = 0;      ///< grains in the largest one
  int longest = 0;      ///< most substeps
  double mean = 0.0;    ///< substeps
  int pair_capacity = 0;
  Program program = Program::Plain;
  bool with_details = false;
};

/// How it is launched.
struct LaunchPlan {
  const void *kernel = nullptr, *prepare = nullptr;
  KernelSizes sizes;
  int steps_ahead = 0;
  int block = 0, blocks = 0;        ///< threads, and blocks that the device holds at a time
  bool waits = false;               ///< the kernel waits itself for the calls to be prepared
  std::size_t dynamic = 0;          ///< bytes on chip
  std::size_t overflow_size = 0;    ///< bytes of a workspace for what does not fit there
  int share_on_chip = 0;            ///< of the memory on chip, for both kernels [percent]
};

/// The plans of an engine, each made when a call needs it first.
class LaunchPlans {
 public:
  explicit LaunchPlans(const Options &options);

  const cudaDeviceProp &device() const { return device_; }
  const CudaPrograms &programs() const { return programs_; }

  /// Kernels of the plan have their attributes then. Calls of a few kinds alternate: looks at some RVEs between the steps of all.
  const LaunchPlan &plan_for(const CallShape &call);

 private:
  struct Kind {
    bool fills_device;    ///< a multiprocessor has more than one RVE
    bool with_details;
    int largest, pair_capacity, steps_ahead;
    Program program;

    auto all() const
    {
      return std::tie(fills_device, with_details, largest, pair_capacity, steps_ahead, program);
    }
    bool operator<(const Kind &other) const { return all() < other.all(); }
  };

  LaunchPlan plan_of(const CallShape &call, const Kind &kind);
  bool has_lean_kernels(Program program) const;
  bool fills_device(const CallShape &call) const
  {
    return call.count > device_.multiProcessorCount;
  }
  Residency residency_of(const CallShape &call, Program program) const;
  int block_size(const BlockShape &shape, int num_grains) const;

  const int block_size_;    ///< that the user chose, or 0
  const cudaDeviceProp device_;
  const CudaPrograms programs_;
  std::map<Kind, LaunchPlan> plans_;
  const LaunchPlan *plan_in_use_ = nullptr;    ///< whose attributes its kernels have
};

}    // namespace rve
