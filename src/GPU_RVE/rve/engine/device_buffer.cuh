// Owners of device memory. Plain cudaMalloc, no managed memory.

#ifndef RVE_ENGINE_DEVICE_BUFFER_CUH
#define RVE_ENGINE_DEVICE_BUFFER_CUH

#include <cuda_runtime.h>

#include <cstddef>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace rve {

/// Throws std::runtime_error with CUDA's own words.
inline void check_cuda(cudaError_t error, const char *what)
{
  if (error != cudaSuccess)
    throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

/// Array of T on the device; grows, never shrinks, and does not keep its contents when it grows.
template <class T> class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(const DeviceBuffer &) = delete;
  DeviceBuffer &operator=(const DeviceBuffer &) = delete;
  ~DeviceBuffer() { cudaFree(memory); }

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

  T *upload(const std::vector<T> &values)
  {
    reserve(values.size());
    check_cuda(cudaMemcpy(memory, values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice),
               "upload");
    return memory;
  }

  void download(std::vector<T> &values) const
  {
    check_cuda(cudaMemcpy(values.data(), memory, values.size() * sizeof(T), cudaMemcpyDeviceToHost),
               "download");
  }

  T *data() const { return memory; }

 private:
  T *memory = nullptr;
  std::size_t capacity = 0;
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
