// SPDX-License-Identifier: GPL-2.0-only
// Device states of the RVEs of an engine, in the memory of the current CUDA device.

#pragma once

#include "cuda/device_buffer.cuh"
#include "rve/algorithm/device_state.h"
#include "rve/engine/cuda_kernels.h"
#include "rve/engine/device_state_io.h"

#include <vector>

namespace rve {

/// RVEs have numbers. put() requires a free number, the other functions a number in use.
class CudaDeviceStates {
 public:
  void put(int rve, const DeviceState &device_state)
  {
    if (rve >= static_cast<int>(placed.size())) placed.resize(rve + 1);
    Placed &mine = placed[rve];
    mine.size = device_state.bytes.size();
    mine.handle = {arena.allocate(mine.size), device_state.num_grains, device_state.extra_capacity};
    have_moved = true;
    replace(rve, device_state);
  }

  /// Replaces a device state by one of the same size.
  void replace(int rve, const DeviceState &device_state)
  {
    check_cuda(cudaMemcpy(placed[rve].handle.device_state, device_state.bytes.data(),
                          device_state.bytes.size(), cudaMemcpyHostToDevice),
               "upload of an RVE");
  }

  DeviceState get(int rve) const
  {
    const Placed &mine = placed[rve];
    DeviceState device_state{mine.handle.num_grains, mine.handle.extra_capacity,
                             std::vector<char>(mine.size)};
    check_cuda(cudaMemcpy(device_state.bytes.data(), mine.handle.device_state, mine.size,
                          cudaMemcpyDeviceToHost),
               "download of an RVE");
    return device_state;
  }

  void drop(int rve)
  {
    arena.release(placed[rve].handle.device_state, placed[rve].size);
    placed[rve] = Placed();
    have_moved = true;
  }

  template <int D> void put_header(int rve, const StateHeader<D> &header)
  {
    check_cuda(cudaMemcpy(placed[rve].handle.device_state, &header, sizeof(header),
                          cudaMemcpyHostToDevice),
               "upload of a header");
  }

  template <int D> StateHeader<D> get_header(int rve) const
  {
    StateHeader<D> header;
    check_cuda(cudaMemcpy(&header, placed[rve].handle.device_state, sizeof(header),
                          cudaMemcpyDeviceToHost),
               "download of a header");
    return header;
  }

  const RveHandle &handle(int rve) const { return placed[rve].handle; }

  /// True if handles that the engine has on the device must be uploaded again. The engine resets
  /// it.
  bool have_moved = true;

 private:
  struct Placed {
    RveHandle handle = {};
    std::size_t size = 0;
  };

  DeviceArena arena;
  std::vector<Placed> placed;
};

}    // namespace rve
