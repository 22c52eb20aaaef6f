// SPDX-License-Identifier: GPL-2.0-only
// Owners of device memory. Plain cudaMalloc, no managed memory.

#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace rve {

/// Throws std::runtime_error with CUDA's own words. CUDA shall not remember the error: the next launch would be blamed for it.
inline void check_cuda(cudaError_t error, const char *what)
{
  if (error == cudaSuccess) return;
  cudaGetLastError();
  throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

/// Owner of what a function of CUDA frees: memory of T, or a handle, a pointer to T.
template <auto free> struct CudaDeleter {
  template <class T> void operator()(T *owned) const { free(owned); }
};
template <class T, auto free> using CudaOwner = std::unique_ptr<T, CudaDeleter<free>>;
template <class Handle, auto destroy>
using CudaHandle = CudaOwner<std::remove_pointer_t<Handle>, destroy>;

/// Page-locked array of T on the host, which the device can reach. Grows, never shrinks, and does not keep its contents when it
/// grows. `flags` as of cudaHostAlloc.
template <class T> class HostBuffer {
 public:
  explicit HostBuffer(unsigned flags_in = cudaHostAllocDefault) : flags(flags_in) {}

  T *room(std::size_t count)
  {
    if (count > capacity) {
      memory.reset();
      capacity = 0;
      T *grown = nullptr;
      check_cuda(cudaHostAlloc(&grown, count * sizeof(T), flags),
                 "page-locked memory for a buffer");
      memory.reset(grown);
      capacity = count;
    }
    return memory.get();
  }

 private:
  const unsigned flags;
  CudaOwner<T, cudaFreeHost> memory;
  std::size_t capacity = 0;
};

/// Array of T on the device, and page-locked memory on the host to copy through: copies from ordinary memory take several times
/// as long. Grows, never shrinks, and does not keep its contents when it grows.
template <class T> class DeviceBuffer {
 public:
  T *reserve(std::size_t count)
  {
    if (count > capacity) {
      memory.reset();
      capacity = 0;
      T *grown = nullptr;
      check_cuda(cudaMalloc(&grown, count * sizeof(T)), "device memory for a buffer");
      memory.reset(grown);
      capacity = count;
    }
    return memory.get();
  }

  T *reserve_zeros(std::size_t count)
  {
    T *zeros = reserve(count);
    if (count > 0) check_cuda(cudaMemsetAsync(zeros, 0, count * sizeof(T)), "zeros");
    return zeros;
  }

  /// Zeros in what has never been written.
  T *reserve_clean(std::size_t count)
  {
    return count > capacity ? reserve_zeros(count) : memory.get();
  }

  /// Host memory to write what send() shall upload.
  T *room(std::size_t count) { return staging.room(count); }

  T *send(std::size_t count)
  {
    T *to = reserve(count);
    check_cuda(cudaMemcpyAsync(to, room(count), count * sizeof(T), cudaMemcpyHostToDevice),
               "upload");
    return to;
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
      check_cuda(cudaMemcpy(host, memory.get(), count * sizeof(T), cudaMemcpyDeviceToHost),
                 "download");
    return host;
  }

  /// As receive(), for `count` elements from `first` on, of at most as many as room() was asked for. Waits for its own stream alone: the kernels
  /// that write them have been waited for.
  const T *receive_beside(cudaStream_t stream, std::size_t first, std::size_t count)
  {
    T *host = room(first + count) + first;
    if (count == 0) return host;
    check_cuda(cudaMemcpyAsync(host, memory.get() + first, count * sizeof(T),
                               cudaMemcpyDeviceToHost, stream),
               "download beside kernels");
    check_cuda(cudaStreamSynchronize(stream), "download beside kernels");
    return host;
  }

 private:
  CudaOwner<T, cudaFree> memory;
  std::size_t capacity = 0;
  HostBuffer<T> staging;
};

/// A stream that does not wait for the default one, nor that for it.
class SideStream {
 public:
  operator cudaStream_t()
  {
    if (!stream) {
      cudaStream_t created = nullptr;
      check_cuda(cudaStreamCreateWithFlags(&created, cudaStreamNonBlocking), "a stream for copies");
      stream.reset(created);
    }
    return stream.get();
  }

 private:
  CudaHandle<cudaStream_t, cudaStreamDestroy> stream;
};

/// A place in the default stream, to be waited for while the device goes on behind it.
class Milestone {
 public:
  /// Here: behind all that the device has been told.
  void set()
  {
    if (!event) {
      cudaEvent_t created = nullptr;
      check_cuda(cudaEventCreateWithFlags(&created, cudaEventDisableTiming),
                 "an event to wait for");
      event.reset(created);
    }
    check_cuda(cudaEventRecord(event.get(), nullptr), "record of an event");
  }
  /// Errors are those of `what` the device does before it.
  void wait(const char *what) const { check_cuda(cudaEventSynchronize(event.get()), what); }

 private:
  CudaHandle<cudaEvent_t, cudaEventDestroy> event;
};

/// Pieces of device memory for RVE images, cut from large slabs: thousands of RVEs come and go without a cudaMalloc each.
class DeviceArena {
 public:
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
      slabs.emplace_back(slab);
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

  std::vector<CudaOwner<char, cudaFree>> slabs;
  std::map<std::size_t, std::vector<char *>> free_pieces;
  char *next = nullptr;
  std::size_t slab_left = 0;
};

}    // namespace rve
