// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/runtime_kernels.h"

#include "cuda/loaded_kernel.h"
#include "rve/core/error.h"
#include "rve/core/wall_time.h"
#include "rve/engine/kernel_text.h"

#include <cstdio>
#include <map>
#include <memory>
#include <sstream>
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
  std::vector<std::string> options_for(Arithmetic arithmetic, const std::string &target)
  {
    std::vector<std::string> options{
        "--gpu-architecture=" + target, "--std=c++17", "--device-as-default-execution-space",
        arithmetic == Arithmetic::Relaxed ? "-fmad=true" : "-fmad=false"};
    std::istringstream words(GPU_RVE_CUDA_ARITHMETIC);
    for (std::string word; words >> word;) options.push_back(word);
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

  /// Name and compute capability of a kernel.
  using LoadedKey = std::pair<std::string, int>;

  LoadedKey key_of(const KernelName &name, int capability)
  {
    // A relaxed kernel has the same name as the strict one.
    return {to_string(name) + (name.arithmetic == Arithmetic::Relaxed ? ", relaxed" : ""),
            capability};
  }

  /// Returns the loaded kernels of this process.
  std::map<LoadedKey, const void *> &loaded_kernels()
  {
    static std::map<LoadedKey, const void *> loaded;
    return loaded;
  }

}    // namespace

std::string to_string(const KernelName &name)
{
  return std::string("rve::") + name.kernel +
      "<rve::KernelVariant::" + VARIANT_NAMES[static_cast<int>(name.variant)] +
      ", rve::" + numbers_name(name.format) + ">";
}

DeviceCode compiled_kernel(const KernelName &name, int capability, const Nvrtc &nvrtc,
                           KernelCache &cache, const std::function<void(const std::string &)> &log)
{
  const std::string kernel = to_string(name), target = nvrtc.target_for(capability),
                    source = source_for(name.arithmetic);
  const std::vector<std::string> options = options_for(name.arithmetic, target);
  std::string key = "NVRTC " + nvrtc.identity() + "\ntext " + kernel_text_digest() + "\n" + source;
  for (const std::string &option : options) key += option + "\n";
  key += kernel + "\n";

  DeviceCode compiled;
  if (cache.load(key, compiled)) return compiled;
  // One rank compiles while the other ranks wait for their turn; they then find the kernel in the
  // cache.
  const KernelCache::Turn turn(cache, key);
  if (cache.load(key, compiled)) return compiled;
  if (!cache.obstacle().empty())
    log("the cache of compiled kernels cannot be read: " + cache.obstacle());
  const auto begin = WallClock::now();
  compiled = nvrtc.compile(source, kernel_headers(), options, kernel);
  cache.store(key, compiled);
  log("compiled " + kernel + " for " + target + " in " + rounded(seconds_since(begin)) + " s" +
      (cache.obstacle().empty() ? ""
                                : ", but could not store it in the cache: " + cache.obstacle()));
  return compiled;
}

std::string runtime_kernels_obstacle()
{
  const std::string obstacle = loading_of_kernels_obstacle();
  return obstacle.empty() ? Nvrtc::of_this_machine().obstacle() : obstacle;
}

bool is_loaded(const KernelName &name, int capability)
{
  return loaded_kernels().count(key_of(name, capability)) > 0;
}

const void *runtime_kernel(const KernelName &name, int capability,
                           const std::function<void(const std::string &)> &log)
{
  auto &loaded = loaded_kernels();
  const LoadedKey key = key_of(name, capability);
  const auto found = loaded.find(key);
  if (found != loaded.end()) return found->second;
  const std::string obstacle = runtime_kernels_obstacle();
  require(obstacle.empty(), obstacle);
  static KernelCache cache(KernelCache::chosen_folder());
  const auto say = [&log](const std::string &line) {
    if (log)
      log(line);
    else
      std::fprintf(stderr, "%s\n", line.c_str());
  };
  const void *kernel =
      load_kernel(compiled_kernel(name, capability, Nvrtc::of_this_machine(), cache, say));
  return loaded[key] = kernel;
}

}    // namespace rve
