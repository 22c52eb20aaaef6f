// SPDX-License-Identifier: GPL-2.0-only
// Owners of device memory. Plain cudaMalloc, no managed memory.

#pragma once

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

/// Page-locked array of T on the host, which the device can reach. Grows, never shrinks, and does not keep its contents when it
/// grows. `flags` as of cudaHostAlloc.
template <class T> class HostBuffer {
 public:
  explicit HostBuffer(unsigned flags_in = cudaHostAllocDefault) : flags(flags_in) {}
  HostBuffer(const HostBuffer &) = delete;
  HostBuffer &operator=(const HostBuffer &) = delete;
  ~HostBuffer() { cudaFreeHost(memory); }

  T *room(std::size_t count)
  {
    if (count > capacity) {
      cudaFreeHost(memory);
      memory = nullptr;
      capacity = 0;
      check_cuda(cudaHostAlloc(&memory, count * sizeof(T), flags),
                 "page-locked memory for a buffer");
      capacity = count;
    }
    return memory;
  }

 private:
  const unsigned flags;
  T *memory = nullptr;
  std::size_t capacity = 0;
};

/// Array of T on the device, and page-locked memory on the host to copy through: copies from ordinary memory take several times
/// as long. Grows, never shrinks, and does not keep its contents when it grows.
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

  T *reserve_zeros(std::size_t count)
  {
    reserve(count);
    if (count > 0) check_cuda(cudaMemsetAsync(memory, 0, count * sizeof(T)), "zeros");
    return memory;
  }

  /// Zeros in what has never been written.
  T *reserve_clean(std::size_t count) { return count > capacity ? reserve_zeros(count) : memory; }

  /// Host memory to write what send() shall upload.
  T *room(std::size_t count) { return staging.room(count); }

  T *send(std::size_t count)
  {
    reserve(count);
    check_cuda(cudaMemcpyAsync(memory, room(count), count * sizeof(T), cudaMemcpyHostToDevice),
               "upload");
    return memory;
  }

  T *upload(const std::vector<T> &values)
  {
    std::memcpy(room(values.size()), values.data(), values.size() * sizeof(T));
    return send(values.size());
  }

  /// Waits for the kernels that were launched. The result holds until room() is asked for again.
  const T *receive(std::size_t count)
  {
    T *host = room(count);
    if (count > 0)
      check_cuda(cudaMemcpy(host, memory, count * sizeof(T), cudaMemcpyDeviceToHost), "download");
    return host;
  }

  /// As receive(), for `count` elements from `first` on, of at most as many as room() was asked for. Waits for its own stream alone: the kernels
  /// that write them have been waited for.
  const T *receive_beside(cudaStream_t stream, std::size_t first, std::size_t count)
  {
    T *host = room(first + count) + first;
    if (count == 0) return host;
    check_cuda(
        cudaMemcpyAsync(host, memory + first, count * sizeof(T), cudaMemcpyDeviceToHost, stream),
        "download beside kernels");
    check_cuda(cudaStreamSynchronize(stream), "download beside kernels");
    return host;
  }

 private:
  T *memory = nullptr;
  std::size_t capacity = 0;
  HostBuffer<T> staging;
};

/// A stream that does not wait for the default one, nor that for it.
class SideStream {
 public:
  SideStream() = default;
  SideStream(const SideStream &) = delete;
  SideStream &operator=(const SideStream &) = delete;
  ~SideStream()
  {
    if (stream) cudaStreamDestroy(stream);
  }
  operator cudaStream_t()
  {
    if (!stream)
      check_cuda(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "a stream for copies");
    return stream;
  }

 private:
  cudaStream_t stream = nullptr;
};

/// A place in the default stream, to be waited for while the device goes on behind it.
class Milestone {
 public:
  Milestone() = default;
  Milestone(const Milestone &) = delete;
  Milestone &operator=(const Milestone &) = delete;
  ~Milestone()
  {
    if (event) cudaEventDestroy(event);
  }

  /// Here: behind all that the device has been told.
  void set()
  {
    if (!event)
      check_cuda(cudaEventCreateWithFlags(&event, cudaEventDisableTiming), "an event to wait for");
    check_cuda(cudaEventRecord(event, nullptr), "record of an event");
  }
  /// Errors are those of `what` the device does before it.
  void wait(const char *what) const { check_cuda(cudaEventSynchronize(event), what); }

 private:
  cudaEvent_t event = nullptr;
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
