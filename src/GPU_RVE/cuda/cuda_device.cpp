// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/cuda_device.h"

#include "cuda/cuda_choice.h"
#include "cuda/device_buffer.cuh"

#include <cstdlib>

namespace rve {

namespace {

  const std::vector<CudaArchitecture> &compiled_architectures()
  {
    static const auto architectures = cuda_architectures(GPU_RVE_CUDA_ARCHITECTURES);
    return architectures;
  }

  GpuProperties gpu_of(int number)
  {
    cudaDeviceProp properties;
    check_cuda(cudaGetDeviceProperties(&properties, number), "device properties");
    return {properties.name, 10 * properties.major + properties.minor};
  }

  /// Returns the reason why the device cannot load `kernel`; empty if it can.
  std::string find_loading_obstacle(int number, const void *kernel)
  {
    cudaFuncAttributes attributes;
    cudaError_t error = cudaSetDevice(number);
    if (error == cudaSuccess) error = cudaFuncGetAttributes(&attributes, kernel);
    if (error == cudaSuccess) return "";
    cudaGetLastError();    // clears the error
    const GpuProperties gpu = gpu_of(number);
    return loading_obstacle(gpu, code_for(gpu.capability, compiled_architectures()),
                            cudaGetErrorString(error));
  }

}    // namespace

CudaDevice find_cuda_device(int local_rank, const void *kernel)
{
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess || count == 0) {
    cudaGetLastError();
    int driver = 0, runtime = 0;
    cudaDriverGetVersion(&driver);    // 0 without a driver
    cudaRuntimeGetVersion(&runtime);
    auto driver_error = DriverError::Other;
    if (error == cudaErrorInsufficientDriver)
      driver_error = driver == 0 ? DriverError::NoDriver : DriverError::OldDriver;
    if (error == cudaSuccess || error == cudaErrorNoDevice) driver_error = DriverError::NoDevice;
    return {-1,
            driver_obstacle(driver_error, driver, runtime, std::getenv("CUDA_VISIBLE_DEVICES"),
                            cudaGetErrorString(error))};
  }
  std::vector<std::string> obstacles;
  for (int number = 0; number < count; ++number)
    obstacles.push_back(gpu_obstacle(gpu_of(number), compiled_architectures()));
  const CudaChoice choice = choose_gpu(obstacles, local_rank);
  CudaDevice device{choice.number, choice.obstacle};
  if (device.obstacle.empty()) device.obstacle = find_loading_obstacle(device.number, kernel);
  if (device.obstacle.empty())
    device.compiles =
        code_for(gpu_of(device.number).capability, compiled_architectures()) == GpuCode::Ptx;
  return device;
}

}    // namespace rve
