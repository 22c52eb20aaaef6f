// SPDX-License-Identifier: GPL-2.0-only
// Programmatic dependent launch: the blocks of a kernel are placed on the device while the previous
// kernel still runs. The kernel itself then waits for the end of the previous one.

#pragma once

#include <cuda_runtime.h>

#include <cstddef>

namespace rve {

/// Returns true if a kernel waits for the previous one by cudaGridDependencySynchronize() on a GPU
/// of major compute capability `major`. This requires a GPU of compute capability 9.0 or newer, and
/// code from PTX for such GPUs: code for older GPUs does not wait.
inline bool waits_itself(int major, const cudaFuncAttributes &kernel)
{
  return major >= 9 && kernel.ptxVersion >= 90;
}

/// Returns the launch attribute that places blocks before the previous kernel has ended. `early`
/// may be true only for kernels that wait themselves (waits_itself).
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
