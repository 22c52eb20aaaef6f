// The border to the block program on a CPU thread, which is compiled once per instruction set. Plain data only.

#ifndef RVE_ENGINE_HOST_KERNELS_H
#define RVE_ENGINE_HOST_KERNELS_H

#include "rve/algorithm/image.h"

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

/// One instruction set's build of the block program for one format.
struct HostKernel {
  void (*advance)(char *image, const DriveRecord &drive, const SteeringRecord *steering,
                  const BatchConstants &batch, const HostWorkspace &memory, SceneKind scene,
                  AnswerRecord &answer, DetailRecord *detail);
  HostWorkspaceSizes (*workspace_sizes)(int num_grains, int pair_capacity, SceneKind scene);
};

enum class KernelFormat { Fast, Mixed, Double, Single };

namespace host_baseline {
  HostKernel kernel(KernelFormat format);
}
#if defined(RVE_WITH_X86_64_V3)
namespace host_v3 {
  HostKernel kernel(KernelFormat format);
}
#endif

}    // namespace rve

#endif
