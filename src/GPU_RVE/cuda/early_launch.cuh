// Kernels that are put in place on a device while the one before them is at work, and wait there themselves.

#ifndef CUDA_EARLY_LAUNCH_CUH
#define CUDA_EARLY_LAUNCH_CUH

#include <cuda_runtime.h>

namespace rve {

/// Whether a kernel that calls cudaGridDependencySynchronize() does so on a card of this compute capability: compiled from older text it
/// does not, on a card that could.
inline bool waits_itself(int major, const cudaFuncAttributes &kernel)
{
  return major >= 9 && kernel.ptxVersion >= 90;
}

/// For a launch: whether the blocks may be in place before the kernel in front has ended. For kernels that wait themselves alone.
inline cudaLaunchAttribute in_place_early(bool early)
{
  cudaLaunchAttribute attribute;
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = early;
  return attribute;
}

}    // namespace rve

#endif
