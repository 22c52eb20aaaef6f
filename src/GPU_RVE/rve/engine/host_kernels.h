// SPDX-License-Identifier: GPL-2.0-only
// The border to the block program on a CPU thread, which is compiled for each instruction set, dimension and number format. Plain data
// only.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/engine/options.h"
#include "rve/engine/programs.h"

#include <cstddef>

namespace rve {

/// Memory that a block of one CPU thread works in.
struct HostWorkspace {
  char *shared;
  char *workspace;
  int pair_capacity;
};

struct HostWorkspaceSizes {
  std::size_t shared, workspace;
};

/// One instruction set's build of the block program for one number format.
template <int D> struct HostKernel {
  void (*advance)(char *image, const DriveRecord<D> &drive, const SteeringRecord<D> *steering,
                  const BatchConstants &batch, const HostWorkspace &memory, Program program,
                  AnswerRecord<D> &answer, DetailRecord<D> *detail);
  HostWorkspaceSizes (*workspace_sizes)(int num_grains, int pair_capacity, Program program);
};

/// As RVE_ISA names them.
enum class InstructionSet { baseline, v3 };

/// Compiled in a translation unit of its own (host_kernels.cpp).
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
