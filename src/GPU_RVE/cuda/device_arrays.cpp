// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/device_arrays.h"

#if defined(GPU_RVE_WITH_CUDA)
#include "cuda/device_buffer.cuh"
#include "rve/core/error.h"
#else
#include <algorithm>
#endif

namespace rve {

#if defined(GPU_RVE_WITH_CUDA)

bool is_on_device(const double *array, const char *name, int device)
{
  // Without this call CUDA would create a context on the current device, which can be another
  // device.
  check_cuda(cudaSetDevice(device), "choice of the device");
  cudaPointerAttributes attributes;
  check_cuda(cudaPointerGetAttributes(&attributes, array), "memory of an array");
  if (attributes.type != cudaMemoryTypeDevice) return false;
  require(attributes.device == device, name, " is in the memory of CUDA device ", attributes.device,
          "; it must be in the memory of device ", device, ", which has the RVEs, or of the host");
  return true;
}

void copy_numbers(const double *from, double *to, std::size_t count, int device)
{
  check_cuda(cudaSetDevice(device), "choice of the device");
  check_cuda(cudaMemcpy(to, from, count * sizeof(double), cudaMemcpyDefault), "copy of an array");
  // cudaMemcpy can return before a copy to the device is complete.
  check_cuda(cudaStreamSynchronize(nullptr), "copy of an array");
}

#else

bool is_on_device(const double *, const char *, int)
{
  return false;
}

void copy_numbers(const double *from, double *to, std::size_t count, int)
{
  std::copy_n(from, count, to);
}

#endif

}    // namespace rve
