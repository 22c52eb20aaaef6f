// SPDX-License-Identifier: GPL-2.0-only
// Kernels that are put in place on a device while the one before them is at work, and wait there themselves.

#pragma once

#include <cuda_runtime.h>

#include <cstddef>

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

/// Waits until all that the kernel before does can be seen: to be called first by a kernel that is launched so, on every way through it.
__device__ inline void follow()
{
#if __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
  cudaGridDependencySynchronize();
#endif
}

/// A few numbers from page-locked memory of the host to that of the device, or back, between kernels. The engine for copies would wait for the kernel
/// before, and the next kernel for it, for several times as long. A thread for each.
template <class T> __global__ void copy_few(const T *from, T *to, std::size_t count)
{
  follow();
  const std::size_t k = blockIdx.x * static_cast<std::size_t>(blockDim.x) + threadIdx.x;
  if (k < count) to[k] = from[k];
}

}    // namespace rve
