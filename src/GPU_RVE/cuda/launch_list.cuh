// SPDX-License-Identifier: GPL-2.0-only
// List of kernels that are launched together. A list that recurs is launched as one CUDA graph. The
// launch of a graph takes the host a few microseconds, as long as the launch of a single kernel.

#pragma once

#include "cuda/device_buffer.cuh"
#include "cuda/early_launch.cuh"

#include <cuda_runtime.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

namespace rve {

/// List of kernels for the default stream, in order. No kernel begins before hand_over(). Each
/// kernel must call follow() first.
class LaunchList {
 public:
  /// If `early` is true, the device can place the blocks of a kernel before the previous kernel has
  /// ended. All kernels of the list must then wait themselves (waits_itself).
  void set_early(bool early) { early_ = early; }

  template <class... Parameters>
  void add(void (*kernel)(Parameters...), unsigned blocks, unsigned threads,
           const std::common_type_t<Parameters> &...arguments)
  {
    now_.launches.push_back({reinterpret_cast<const void *>(kernel), blocks, threads,
                             now_.places.size(), sizeof...(Parameters)});
    (add_argument(arguments), ...);
  }

  /// Launches the kernels. `what` names them in an error.
  void hand_over(const char *what)
  {
    if (now_.launches.empty()) return;
    Kept *const kept = now_.launches.size() < WORTH_A_GRAPH ? nullptr : kept_like_this();
    if (kept && !kept->graph && makes_graphs_) kept->graph = graph_of(kept->list);
    if (kept && kept->graph) {
      ++graphs_;
      check_cuda(cudaGraphLaunch(kept->graph.get(), nullptr), what);
    } else {
      check_cuda(launch_all(now_, nullptr), what);
      if (!kept && now_.launches.size() >= WORTH_A_GRAPH) keep();
    }
    now_.clear();
  }

  /// Removes all kernels from the list without launching them.
  void forget() { now_.clear(); }

  /// Returns how often a graph has been launched so far.
  long graphs() const { return graphs_; }

 private:
  /// Smallest number of launches for which a graph saves host time.
  static constexpr std::size_t WORTH_A_GRAPH = 4;

  struct Launch {
    const void *kernel;
    unsigned blocks, threads;
    std::size_t first, count;    ///< index of the first argument, number of arguments

    bool operator==(const Launch &other) const
    {
      return kernel == other.kernel && blocks == other.blocks && threads == other.threads &&
          first == other.first && count == other.count;
    }
  };
  /// Launches, the offset of each argument in `bytes`, and the bytes of all arguments.
  struct List {
    std::vector<Launch> launches;
    std::vector<std::size_t> places;
    std::vector<unsigned char> bytes;

    void clear()
    {
      launches.clear();
      places.clear();
      bytes.clear();
    }
    bool operator==(const List &other) const
    {
      return launches == other.launches && places == other.places &&
          bytes.size() == other.bytes.size() &&
          std::memcmp(bytes.data(), other.bytes.data(), bytes.size()) == 0;
    }
  };
  using Graph = CudaHandle<cudaGraphExec_t, cudaGraphExecDestroy>;
  /// List that has been launched, and its graph. The second launch creates the graph.
  struct Kept {
    List list;
    Graph graph;
  };

  template <class Argument> void add_argument(const Argument &argument)
  {
    static_assert(std::is_trivially_copyable_v<Argument>, "as a kernel gets it");
    constexpr std::size_t alignment = 16;
    static_assert(alignof(Argument) <= alignment);
    const std::size_t place = (now_.bytes.size() + alignment - 1) / alignment * alignment;
    now_.places.push_back(place);
    now_.bytes.resize(place + sizeof(Argument));
    std::memcpy(&now_.bytes[place], &argument, sizeof(Argument));
  }

  /// Returns the kept list that equals the present one; null if there is none.
  Kept *kept_like_this()
  {
    for (Kept &kept : kept_)
      if (kept.list == now_) return &kept;
    return nullptr;
  }
  /// Stores the present list and discards the oldest stored one.
  void keep()
  {
    Kept &kept = kept_[oldest_];
    oldest_ = (oldest_ + 1) % kept_.size();
    kept.graph.reset();
    kept.list = now_;
  }

  cudaError_t launch_all(List &list, cudaStream_t stream) const
  {
    std::vector<void *> arguments;
    for (const std::size_t place : list.places) arguments.push_back(&list.bytes[place]);
    for (const Launch &launch : list.launches) {
      cudaLaunchAttribute closely = in_place_early(early_);
      cudaLaunchConfig_t launched = {};
      launched.gridDim = launch.blocks;
      launched.blockDim = launch.threads;
      launched.stream = stream;
      launched.attrs = &closely;
      launched.numAttrs = 1;
      const cudaError_t error =
          cudaLaunchKernelExC(&launched, launch.kernel, arguments.data() + launch.first);
      if (error != cudaSuccess) return error;
    }
    return cudaSuccess;
  }

  /// Returns the graph of a list. If the driver cannot make graphs, it returns null and disables
  /// graphs for all later lists.
  Graph graph_of(List &list)
  {
    const auto ask = [this](cudaError_t error) {
      makes_graphs_ = makes_graphs_ && error == cudaSuccess;
    };
    // The default stream cannot be captured, so another stream records the kernels.
    cudaGraph_t recorded = nullptr;
    cudaGraphExec_t graph = nullptr;
    ask(cudaStreamBeginCapture(recorder_, cudaStreamCaptureModeThreadLocal));
    if (makes_graphs_) {
      ask(launch_all(list, recorder_));
      ask(cudaStreamEndCapture(recorder_, &recorded));
    }
    if (makes_graphs_) ask(cudaGraphInstantiateWithFlags(&graph, recorded, 0));
    if (recorded) cudaGraphDestroy(recorded);
    if (!makes_graphs_) cudaGetLastError();
    return Graph(graph);
  }

  List now_;
  std::array<Kept, 4> kept_;
  std::size_t oldest_ = 0;
  bool early_ = false, makes_graphs_ = true;
  long graphs_ = 0;
  SideStream recorder_;
};

}    // namespace rve
