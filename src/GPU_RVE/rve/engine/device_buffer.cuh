// Owners of device memory. Plain cudaMalloc, no managed memory.

#ifndef RVE_ENGINE_DEVICE_BUFFER_CUH
#define RVE_ENGINE_DEVICE_BUFFER_CUH

#include <cuda_runtime.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace rve {

/// Throws std::runtime_error with CUDA's own words. CUDA shall not remember the error: the next launch would be blamed for it.
inline void check_cuda(cudaError_t error, const char *what)
{
  if (error == cudaSuccess) return;
  cudaGetLastError();
  throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

/// Array of T on the device, and page-locked memory on the host to copy through: copies from ordinary memory take several times
/// as long. Grows, never shrinks, and does not keep its contents when it grows.
template <class T> class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(const DeviceBuffer &) = delete;
  DeviceBuffer &operator=(const DeviceBuffer &) = delete;
  ~DeviceBuffer()
  {
    cudaFree(memory);
    cudaFreeHost(staging);
  }

  T *reserve(std::size_t count)
  {
    if (count > capacity) {
      cudaFree(memory);
      memory = nullptr;
      capacity = 0;
      check_cuda(cudaMalloc(&memory, count * sizeof(T)), "device memory for a buffer");
      capacity = count;
    }
    return memory;
  }

  T *reserve_zeros(std::size_t count)
  {
    reserve(count);
    check_cuda(cudaMemsetAsync(memory, 0, count * sizeof(T)), "zeros");
    return memory;
  }

  T *upload(const std::vector<T> &values)
  {
    stage(values.size());
    std::memcpy(staging, values.data(), values.size() * sizeof(T));
    return send(values.size());
  }

  /// Element k is value(k).
  template <class Value> T *upload(std::size_t count, Value value)
  {
    stage(count);
    for (std::size_t k = 0; k < count; ++k) staging[k] = value(static_cast<int>(k));
    return send(count);
  }

  /// Waits for the kernels that were launched.
  void download(std::vector<T> &values, std::size_t count)
  {
    stage(count);
    check_cuda(cudaMemcpy(staging, memory, count * sizeof(T), cudaMemcpyDeviceToHost), "download");
    values.assign(staging, staging + count);
  }

 private:
  void stage(std::size_t count)
  {
    if (count <= staged) return;
    cudaFreeHost(staging);
    staging = nullptr;
    staged = 0;
    check_cuda(cudaMallocHost(&staging, count * sizeof(T)), "page-locked memory for a buffer");
    staged = count;
  }

  T *send(std::size_t count)
  {
    reserve(count);
    check_cuda(cudaMemcpyAsync(memory, staging, count * sizeof(T), cudaMemcpyHostToDevice),
               "upload");
    return memory;
  }

  T *memory = nullptr;
  T *staging = nullptr;
  std::size_t capacity = 0, staged = 0;
};

/// Pieces of device memory for RVE images, cut from large slabs: thousands of RVEs come and go without a cudaMalloc each.
class DeviceArena {
 public:
  DeviceArena() = default;
  DeviceArena(const DeviceArena &) = delete;
  DeviceArena &operator=(const DeviceArena &) = delete;
  ~DeviceArena()
  {
    for (char *slab : slabs) cudaFree(slab);
  }

  char *allocate(std::size_t size)
  {
    size = rounded(size);
    auto &pieces = free_pieces[size];
    if (!pieces.empty()) {
      char *piece = pieces.back();
      pieces.pop_back();
      return piece;
    }
    if (size > slab_left) {
      const std::size_t slab_size = size > SLAB ? size : SLAB;
      char *slab = nullptr;
      check_cuda(cudaMalloc(&slab, slab_size), "device memory for RVEs");
      slabs.push_back(slab);
      next = slab;
      slab_left = slab_size;
    }
    char *piece = next;
    next += size;
    slab_left -= size;
    return piece;
  }

  void release(char *piece, std::size_t size) { free_pieces[rounded(size)].push_back(piece); }

 private:
  static constexpr std::size_t SLAB = std::size_t(64) << 20;
  static std::size_t rounded(std::size_t size) { return (size + 255) / 256 * 256; }

  std::vector<char *> slabs;
  std::map<std::size_t, std::vector<char *>> free_pieces;
  char *next = nullptr;
  std::size_t slab_left = 0;
};

}    // namespace rve

#endif
