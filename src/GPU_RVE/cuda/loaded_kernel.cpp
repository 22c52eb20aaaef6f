// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/loaded_kernel.h"

#include "cuda/device_buffer.cuh"

namespace rve {

#if CUDART_VERSION >= 12080

std::string loading_of_kernels_obstacle()
{
  return "";
}

const void *load_kernel(const DeviceCode &compiled)
{
  cudaLibrary_t library = nullptr;
  check_cuda(
      cudaLibraryLoadData(&library, compiled.code.c_str(), nullptr, nullptr, 0, nullptr, nullptr,
                          0),
      "loading of a kernel that was compiled at run time (its compiler may be newer than the "
      "driver)");
  cudaKernel_t kernel = nullptr;
  check_cuda(cudaLibraryGetKernel(&kernel, library, compiled.kernel.c_str()),
             "kernel that was compiled at run time");
  return reinterpret_cast<const void *>(kernel);
}

#else

std::string loading_of_kernels_obstacle()
{
  return "this program was built with CUDA " + std::to_string(CUDART_VERSION / 1000) + "." +
      std::to_string(CUDART_VERSION % 1000 / 10) +
      ", which cannot load kernels that are compiled at run time: build it with CUDA 12.8 or newer";
}

const void *load_kernel(const DeviceCode &)
{
  throw std::runtime_error(loading_of_kernels_obstacle());
}

#endif

}    // namespace rve
