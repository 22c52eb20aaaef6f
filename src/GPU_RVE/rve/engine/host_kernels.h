// The border to the block program on a CPU thread, which is compiled once per instruction set. Plain data only.

#ifndef RVE_ENGINE_HOST_KERNELS_H
#define RVE_ENGINE_HOST_KERNELS_H

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

namespace host_baseline {
  template <int D> HostKernel<D> kernel(Format format);
}
#if defined(RVE_WITH_X86_64_V3)
namespace host_v3 {
  template <int D> HostKernel<D> kernel(Format format);
}
#endif

}    // namespace rve

#endif
