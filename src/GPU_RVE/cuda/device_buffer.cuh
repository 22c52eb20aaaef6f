// SPDX-License-Identifier: GPL-2.0-only
// Classes that own device memory (cudaMalloc, no managed memory), page-locked host memory, streams
// and events.

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

/// Throws std::runtime_error with CUDA's message if `error` is not a success. It also clears CUDA's
/// last error; otherwise the next launch would report it.
inline void check_cuda(cudaError_t error, const char *what)
{
  if (error == cudaSuccess) return;
  cudaGetLastError();
  throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

/// Deleter and owners of a CUDA resource. CudaOwner frees an array of T. CudaHandle destroys a
/// handle, which is a pointer to an opaque type.
template <auto free> struct CudaDeleter {
  template <class T> void operator()(T *owned) const { free(owned); }
};
template <class T, auto free> using CudaOwner = std::unique_ptr<T, CudaDeleter<free>>;
template <class Handle, auto destroy>
using CudaHandle = CudaOwner<std::remove_pointer_t<Handle>, destroy>;

/// Page-locked array of T on the host that the device can access. It grows, never shrinks, and
/// loses its contents when it grows. `flags` are those of cudaHostAlloc.
template <class T> class HostBuffer {
 public:
  explicit HostBuffer(unsigned flags_in = cudaHostAllocDefault) : flags(flags_in) {}

  T *host_array(std::size_t count)
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

/// Array of T on the device. It grows, never shrinks, and loses its contents when it grows. Copies
/// use page-locked host memory, since copies from ordinary host memory take several times as long.
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

  /// Returns memory for `count` elements. Elements that have not been written since this function
  /// last enlarged the array are zero.
  T *reserve_clean(std::size_t count)
  {
    return count > capacity ? reserve_zeros(count) : memory.get();
  }

  /// Returns host memory for the values that send() uploads.
  T *host_array(std::size_t count) { return staging.host_array(count); }

  T *send(std::size_t count)
  {
    T *to = reserve(count);
    check_cuda(cudaMemcpyAsync(to, host_array(count), count * sizeof(T), cudaMemcpyHostToDevice),
               "upload");
    return to;
  }

  T *upload(const std::vector<T> &values)
  {
    std::memcpy(host_array(values.size()), values.data(), values.size() * sizeof(T));
    return send(values.size());
  }

  /// Waits for the launched kernels and returns a host copy of the values. The copy is valid until
  /// another function of this class uses the host memory.
  const T *receive(std::size_t count)
  {
    T *host = host_array(count);
    if (count > 0)
      check_cuda(cudaMemcpy(host, memory.get(), count * sizeof(T), cudaMemcpyDeviceToHost),
                 "download");
    return host;
  }

  /// Returns a host copy of `count` elements from index `first` on. `first` + `count` must not
  /// exceed the count of the last host_array(). The function synchronises with `stream` only, so
  /// the kernels that write the elements must have ended.
  const T *receive_beside(cudaStream_t stream, std::size_t first, std::size_t count)
  {
    T *host = host_array(first + count) + first;
    if (count == 0) return host;
    check_cuda(cudaMemcpyAsync(host, memory.get() + first, count * sizeof(T),
                               cudaMemcpyDeviceToHost, stream),
               "download during kernels");
    check_cuda(cudaStreamSynchronize(stream), "download during kernels");
    return host;
  }

 private:
  CudaOwner<T, cudaFree> memory;
  std::size_t capacity = 0;
  HostBuffer<T> staging;
};

/// Stream that does not synchronise with the default stream.
class SideStream {
 public:
  operator cudaStream_t()
  {
    if (!stream) {
      cudaStream_t created = nullptr;
      check_cuda(cudaStreamCreateWithFlags(&created, cudaStreamNonBlocking),
                 "creation of a stream for copies");
      stream.reset(created);
    }
    return stream.get();
  }

 private:
  CudaHandle<cudaStream_t, cudaStreamDestroy> stream;
};

/// Event in the default stream, on which the host can wait while the device continues.
class Milestone {
 public:
  /// Records the event after all work that has been launched in the default stream.
  void set()
  {
    if (!event) {
      cudaEvent_t created = nullptr;
      check_cuda(cudaEventCreateWithFlags(&created, cudaEventDisableTiming),
                 "creation of an event");
      event.reset(created);
    }
    check_cuda(cudaEventRecord(event.get(), nullptr), "record of an event");
  }
  /// Waits for the event. In an error message `what` names the device work before the event.
  void wait(const char *what) const { check_cuda(cudaEventSynchronize(event.get()), what); }

 private:
  CudaHandle<cudaEvent_t, cudaEventDestroy> event;
};

/// Allocator of device memory for RVEs. It cuts pieces from large slabs, since thousands of RVEs
/// are added and removed.
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
