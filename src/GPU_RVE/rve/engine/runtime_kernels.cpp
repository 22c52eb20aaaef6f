// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/runtime_kernels.h"

#include "cuda/loaded_kernel.h"
#include "rve/core/error.h"
#include "rve/core/wall_time.h"
#include "rve/engine/kernel_text.h"
#include "rve/engine/variant_choice.h"

#include <chrono>
#include <cstdio>
#include <exception>
#include <future>
#include <map>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

namespace rve {

namespace {

#define RVE_NAME_PROGRAM(name, ...) #name,
  constexpr const char *VARIANT_NAMES[] = {RVE_KERNEL_VARIANTS(RVE_NAME_PROGRAM)};
#undef RVE_NAME_PROGRAM

  /// Returns a name such as "FastNumbers".
  std::string numbers_name(Format format)
  {
    std::string name = to_string(format) + "Numbers";
    name[0] += 'A' - 'a';
    return name;
  }

  /// Returns the compiler options for NVRTC, which correspond to those of nvcc
  /// (cmake/CompilerFlags.cmake). Functions without __device__ are compiled as device functions,
  /// since there is no host code.
  std::vector<std::string> options_for(Arithmetic arithmetic, const std::string &target,
                                       Optimization optimization)
  {
    std::vector<std::string> options{
        "--gpu-architecture=" + target, "--std=c++17", "--device-as-default-execution-space",
        arithmetic == Arithmetic::Relaxed ? "-fmad=true" : "-fmad=false"};
    std::istringstream words(GPU_RVE_CUDA_ARITHMETIC);
    for (std::string word; words >> word;) options.push_back(word);
    if (optimization == Optimization::Reduced) options.push_back("--Ofast-compile=min");
    return options;
  }

  /// Returns the source text. Relaxed code has its own namespace, as in cuda_variant.cu.in.
  std::string source_for(Arithmetic arithmetic)
  {
    return std::string(arithmetic == Arithmetic::Relaxed
                           ? "#define RVE_RELAXED\n#define RVE_ISA relaxed\n"
                           : "") +
        "#include \"rve/engine/cuda_kernels.cuh\"\n";
  }

  /// Returns the key of a kernel in the cache.
  std::string cache_key(const KernelName &name, const std::vector<std::string> &options,
                        const Nvrtc &nvrtc)
  {
    std::string key = "NVRTC " + nvrtc.identity() + "\ntext " + kernel_text_digest() + "\n" +
        source_for(name.arithmetic);
    for (const std::string &option : options) key += option + "\n";
    return key + to_string(name) + "\n";
  }

  /// Returns the cache of this machine. Its folder is chosen when a kernel is first needed.
  KernelCache &cache_of_this_machine()
  {
    static KernelCache cache(KernelCache::chosen_folder());
    return cache;
  }

  /// Name and compute capability of a kernel.
  using LoadedKey = std::pair<std::string, int>;

  LoadedKey key_of(const KernelName &name, int capability)
  {
    // A relaxed kernel has the same name as the strict one.
    return {to_string(name) + (name.arithmetic == Arithmetic::Relaxed ? ", relaxed" : ""),
            capability};
  }

  /// Optimized kernel, compiled in the background, and the lines of its compilation for the log.
  struct Optimized {
    DeviceCode code;
    std::vector<std::string> log;
  };

  struct LoadedKernel {
    RuntimeKernel kernel;
    std::future<Optimized> optimized;    ///< valid until the optimized kernel is loaded
  };

  /// Kernels of this process. Its destructor cancels the compilations in the background, and the
  /// destructors of their futures wait for them.
  struct Kernels {
    std::map<LoadedKey, LoadedKernel> loaded;
    std::atomic<bool> cancelled{false};
    ~Kernels() { cancelled = true; }
  };

  Kernels &kernels_of_this_process()
  {
    static Kernels kernels;
    return kernels;
  }

  /// Returns the optimized kernel from the cache; null if the cache does not contain it.
  const void *kernel_from_cache(const KernelName &name, int capability)
  {
    const Nvrtc &nvrtc = Nvrtc::of_this_machine();
    const std::string key = cache_key(
        name, options_for(name.arithmetic, nvrtc.target_for(capability), Optimization::Full),
        nvrtc);
    DeviceCode compiled;
    return cache_of_this_machine().load(key, compiled) ? load_kernel(compiled) : nullptr;
  }

  /// Returns true for kernels with a servo or bookkeeping, which take up to 27 s. The others take
  /// at most 7 s, and the kernels that prepare calls 1 s.
  bool takes_long(const KernelName &name)
  {
    return features_of(name.variant).has.servo && std::string(name.kernel) != "prepare_calls";
  }

  /// Begins to compile the optimized kernel in a thread of its own.
  std::future<Optimized> begin_optimized(const KernelName &name, int capability)
  {
    return std::async(std::launch::async, [name, capability] {
      KernelCache cache(KernelCache::chosen_folder());
      Optimized result;
      result.code = compiled_kernel(
          name, capability, Nvrtc::of_this_machine(), cache,
          [&](const std::string &line) { result.log.push_back(line); }, Optimization::Full,
          &kernels_of_this_process().cancelled);
      return result;
    });
  }

  /// Loads the optimized kernel if its compilation has ended. If it has failed, the reduced kernel
  /// is used further.
  void take_optimized(LoadedKernel &mine, const std::function<void(const std::string &)> &log)
  {
    if (mine.optimized.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    mine.kernel.is_final = true;
    try {
      const Optimized optimized = mine.optimized.get();
      mine.kernel.function = load_kernel(optimized.code);
      for (const std::string &line : optimized.log) log(line + ", in the background");
    } catch (const std::exception &error) {
      log(std::string("a kernel stays without some optimizations: ") + error.what());
    }
  }

}    // namespace

std::string to_string(const KernelName &name)
{
  return std::string("rve::") + name.kernel +
      "<rve::KernelVariant::" + VARIANT_NAMES[static_cast<int>(name.variant)] +
      ", rve::" + numbers_name(name.format) + ">";
}

DeviceCode compiled_kernel(const KernelName &name, int capability, const Nvrtc &nvrtc,
                           KernelCache &cache, const std::function<void(const std::string &)> &log,
                           Optimization optimization, const std::atomic<bool> *cancelled)
{
  const std::string target = nvrtc.target_for(capability);
  const std::vector<std::string> options = options_for(name.arithmetic, target, optimization);
  const std::string key = cache_key(name, options, nvrtc);
  DeviceCode compiled;
  if (cache.load(key, compiled)) return compiled;
  if (!cache.obstacle().empty())
    log("the cache of compiled kernels cannot be read: " + cache.obstacle());
  const auto begin = WallClock::now();
  compiled = nvrtc.compile(source_for(name.arithmetic), kernel_headers(), options, to_string(name),
                           cancelled);
  cache.store(key, compiled);
  log("compiled " + to_string(name) + " for " + target +
      (optimization == Optimization::Reduced ? " without some optimizations" : "") + " in " +
      rounded(seconds_since(begin)) + " s" +
      (cache.obstacle().empty() ? ""
                                : ", but could not store it in the cache: " + cache.obstacle()));
  return compiled;
}

std::string runtime_kernels_obstacle()
{
  const std::string obstacle = loading_of_kernels_obstacle();
  return obstacle.empty() ? Nvrtc::of_this_machine().obstacle() : obstacle;
}

bool is_at_hand(const KernelName &name, int capability)
{
  auto &loaded = kernels_of_this_process().loaded;
  const LoadedKey key = key_of(name, capability);
  if (loaded.count(key) > 0) return true;
  if (!runtime_kernels_obstacle().empty()) return false;
  const void *function = kernel_from_cache(name, capability);
  if (function) loaded[key].kernel = {function, true};
  return function != nullptr;
}

RuntimeKernel runtime_kernel(const KernelName &name, int capability,
                             const std::function<void(const std::string &)> &log)
{
  const auto say = [&log](const std::string &line) {
    if (log)
      log(line);
    else
      std::fprintf(stderr, "%s\n", line.c_str());
  };
  const std::string obstacle = runtime_kernels_obstacle();
  require(obstacle.empty(), obstacle);
  auto &loaded = kernels_of_this_process().loaded;
  const LoadedKey key = key_of(name, capability);
  if (is_at_hand(name, capability)) {
    LoadedKernel &mine = loaded[key];
    if (!mine.kernel.is_final) take_optimized(mine, say);
    return mine.kernel;
  }
  const Nvrtc &nvrtc = Nvrtc::of_this_machine();
  LoadedKernel mine;
  mine.kernel.is_final = !takes_long(name) || !nvrtc.has_fast_compilation();
  if (!mine.kernel.is_final) mine.optimized = begin_optimized(name, capability);
  mine.kernel.function = load_kernel(
      compiled_kernel(name, capability, nvrtc, cache_of_this_machine(), say,
                      mine.kernel.is_final ? Optimization::Full : Optimization::Reduced));
  return (loaded[key] = std::move(mine)).kernel;
}

}    // namespace rve
