// SPDX-License-Identifier: GPL-2.0-only
// Interface to the block program, the code that advances one RVE, on a CPU thread. The program is
// compiled for each instruction set, dimension and number format. The interface consists of plain
// data, so that it does not depend on the instruction set.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/engine/kernel_variants.h"
#include "rve/engine/options.h"

#include <cstddef>

namespace rve {

/// Memory of the block program on one CPU thread.
struct HostWorkspace {
  char *shared;
  char *workspace;
  int pair_capacity;
};

struct HostWorkspaceSizes {
  std::size_t shared, workspace;
};

/// Functions of the block program for one instruction set and number format.
template <int D> struct HostKernel {
  void (*advance)(char *device_state, const DriveRecord<D> &drive,
                  const SteeringRecord<D> *steering, const BatchConstants &batch,
                  const HostWorkspace &memory, KernelVariant variant, AnswerRecord<D> &answer,
                  DetailRecord<D> *detail);
  HostWorkspaceSizes (*workspace_sizes)(int num_grains, int pair_capacity, KernelVariant variant);
};

/// Instruction sets. The names are the values of the macro RVE_ISA.
enum class InstructionSet { baseline, v3 };

/// Returns the functions that host_kernels.cpp defines when it is compiled for these arguments.
template <InstructionSet isa, int D, Format format> HostKernel<D> host_kernel();

template <InstructionSet isa, int D> HostKernel<D> host_kernel(Format format)
{
  switch (format) {
    case Format::Fast:
      return host_kernel<isa, D, Format::Fast>();
    case Format::Mixed:
      return host_kernel<isa, D, Format::Mixed>();
    case Format::Single:
      if constexpr (D == 2) return host_kernel<isa, D, Format::Single>();
      break;    // make_engine refuses it
    case Format::Double:
      break;
  }
  return host_kernel<isa, D, Format::Double>();
}

}    // namespace rve
