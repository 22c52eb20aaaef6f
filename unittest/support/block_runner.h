// SPDX-License-Identifier: GPL-2.0-only
// Runs a block program on the backend for which the test was built (rve_add_block_test). A block
// program is a functor
//   template <class Block> RVE_HD void operator()(Block &block, char *fast_memory) const
// Its pointers come from BlockArray. On a GPU, `fast_memory` is shared memory of kFastMemory bytes,
// which is not initialised.

#pragma once

#include "cuda/cuda_required.h"
#include "rve/block/block_serial.h"

#if defined(RVE_TEST_CUDA)
#include "rve/block/block_cuda.cuh"
#endif

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace rve_test {

constexpr std::size_t kFastMemory = 16384;

/// Runs the program in one CPU thread, as the reference for the backend. A Cuda test uses it too.
template <class KernelVariant> void run_serial(const KernelVariant &variant)
{
  std::vector<double> fast(kFastMemory / sizeof(double));
  rve::BlockSerial block;
  variant(block, reinterpret_cast<char *>(fast.data()));
}

#if defined(RVE_TEST_CUDA)

inline void check_cuda(cudaError_t error)
{
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

/// Returns the numbers of threads per block that each test uses.
inline std::vector<int> block_sizes()
{
  return {1, 32, 64, 100, 128, 256, 1024};
}

inline std::string backend_obstacle()
{
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess) return cudaGetErrorString(error);
  return count > 0 ? "" : "there is no CUDA device";
}

/// A vector that a block program can read and write.
template <class T> class BlockArray {
 public:
  explicit BlockArray(std::vector<T> values) : size(values.size())
  {
    check_cuda(cudaMalloc(&memory, (size + 1) * sizeof(T)));
    check_cuda(cudaMemcpy(memory, values.data(), size * sizeof(T), cudaMemcpyHostToDevice));
  }
  BlockArray(const BlockArray &) = delete;
  BlockArray &operator=(const BlockArray &) = delete;
  ~BlockArray() { cudaFree(memory); }

  T *data() { return memory; }
  std::vector<T> values() const
  {
    std::vector<T> result(size);
    check_cuda(cudaMemcpy(result.data(), memory, size * sizeof(T), cudaMemcpyDeviceToHost));
    return result;
  }

 private:
  std::size_t size;
  T *memory = nullptr;
};

template <bool OneItemPerThread, class KernelVariant>
__global__ void __launch_bounds__(1024) variant_kernel(KernelVariant variant)
{
  __shared__ __align__(16) char fast_memory[kFastMemory];
  using Block = rve::BlockCuda<OneItemPerThread>;
  Block block;
  variant(block, fast_memory);
}

/// Runs the program on one block. With `in_registers`, each thread keeps at most one item, in its
/// registers.
template <class KernelVariant>
void run_block(int threads, const KernelVariant &variant, bool in_registers = false)
{
  if (in_registers)
    variant_kernel<true><<<1, threads>>>(variant);
  else
    variant_kernel<false><<<1, threads>>>(variant);
  check_cuda(cudaGetLastError());
  check_cuda(cudaDeviceSynchronize());
}

#else

inline std::vector<int> block_sizes()
{
  return {1};
}

inline std::string backend_obstacle()
{
  return "";
}

template <class T> class BlockArray {
 public:
  explicit BlockArray(std::vector<T> values) : content(std::move(values)) {}
  BlockArray(const BlockArray &) = delete;
  BlockArray &operator=(const BlockArray &) = delete;

  T *data() { return content.data(); }
  std::vector<T> values() const { return content; }

 private:
  std::vector<T> content;
};

template <class KernelVariant> void run_block(int, const KernelVariant &variant, bool = false)
{
  run_serial(variant);
}

#endif

/// Skips its tests without a device, or fails them if GPU_RVE_REQUIRE_CUDA requires one.
class BlockTest : public ::testing::Test {
 protected:
  void SetUp() override
  {
    const std::string obstacle = backend_obstacle();
    if (obstacle.empty()) return;
    if (rve::cuda_required()) FAIL() << rve::cuda_requirement() << ", but " << obstacle;
    GTEST_SKIP() << obstacle;
  }
};

}    // namespace rve_test
