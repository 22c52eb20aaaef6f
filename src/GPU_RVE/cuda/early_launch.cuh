// SPDX-License-Identifier: GPL-2.0-only
// Programmatic dependent launch: the blocks of a kernel are placed on the device while the previous
// kernel still runs. The kernel calls follow() to wait for the end of the previous kernel.

#pragma once

#include <cuda_runtime.h>

#include <cstddef>

namespace rve {

/// Returns true if cudaGridDependencySynchronize() or follow() in `kernel` waits for the previous
/// kernel on a GPU of major compute capability `major`. The GPU must have compute capability 9.0 or
/// newer, and the code of the kernel must come from PTX for such GPUs. Code for older GPUs does not
/// wait.
inline bool waits_itself(int major, const cudaFuncAttributes &kernel)
{
  return major >= 9 && kernel.ptxVersion >= 90;
}

/// Returns the launch attribute that lets the device place the blocks of a kernel before the
/// previous kernel has ended if `early` is true. `early` must be false for a kernel that does not
/// wait itself (waits_itself).
inline cudaLaunchAttribute in_place_early(bool early)
{
  cudaLaunchAttribute attribute;
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = early;
  return attribute;
}

/// Waits until all writes of the previous kernel are visible. A kernel that is launched early must
/// call this function first, on every path. The function also lets the device place the blocks of
/// the next kernel.
__device__ inline void follow()
{
#if __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
  cudaGridDependencySynchronize();
#endif
}

/// Copies a few numbers between page-locked host memory and device memory, one per thread, in the
/// stream of the kernels. A copy by the copy engine would take several times as long, since it
/// waits for the previous kernel and the next kernel waits for the copy.
template <class T> __global__ void copy_few(const T *from, T *to, std::size_t count)
{
  follow();
  const std::size_t k = blockIdx.x * static_cast<std::size_t>(blockDim.x) + threadIdx.x;
  if (k < count) to[k] = from[k];
}

}    // namespace rve
