// SPDX-License-Identifier: GPL-2.0-only
// Kernels whose blocks are placed on a device while the previous kernel runs, and then wait
// themselves.

#pragma once

#include <cuda_runtime.h>

#include <cstddef>

namespace rve {

/// Returns true if a call of cudaGridDependencySynchronize() in the kernel waits, on a GPU of this
/// compute capability. In code from older PTX it does not, even on a capable GPU.
inline bool waits_itself(int major, const cudaFuncAttributes &kernel)
{
  return major >= 9 && kernel.ptxVersion >= 90;
}

/// Returns the launch attribute that places blocks before the previous kernel has ended. It is
/// allowed only for kernels that wait themselves.
inline cudaLaunchAttribute in_place_early(bool early)
{
  cudaLaunchAttribute attribute;
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = early;
  return attribute;
}

/// Waits until all writes of the previous kernel are visible. A kernel that is launched early must
/// call it first, on every path.
__device__ inline void follow()
{
#if __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
  cudaGridDependencySynchronize();
#endif
}

/// Copies a few numbers between page-locked host memory and device memory, in the stream of the
/// kernels and with a thread for each. The copy engine would wait for the previous kernel, and the
/// next kernel for it, for several times as long.
template <class T> __global__ void copy_few(const T *from, T *to, std::size_t count)
{
  follow();
  const std::size_t k = blockIdx.x * static_cast<std::size_t>(blockDim.x) + threadIdx.x;
  if (k < count) to[k] = from[k];
}

}    // namespace rve
