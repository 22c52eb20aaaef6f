// SPDX-License-Identifier: GPL-2.0-only
// Compiles kernels of the GPU engine at run time, one after the other, and prints times and sizes.
// It needs libnvrtc and no GPU.
//
//   bench_kernels [--capability 90] [--program Rolling] [--format mixed] [--kernel advance_many]
//                 [--relaxed] [--keep FOLDER] [--cache FOLDER]
//
// The default is all variants of rve/engine/kernel_variants.h, all formats and all kernels. --keep
// writes code and text (PTX) to files, which bench/compare_kernels.py compares with the code and
// text from nvcc. --cache stores the kernels in a kernel cache (GPU_RVE_KERNEL_CACHE). A run with
// this cache, for example on an expensive GPU machine, does not compile them again.

#include "rve/core/wall_time.h"
#include "rve/engine/runtime_kernels.h"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <map>
#include <string>

using namespace rve;

namespace {

constexpr const char *KERNELS[] = {"advance_many",    "advance_few",       "advance_large",
                                   "advance_largest", "advance_in_memory", "prepare_calls"};
constexpr Format FORMATS[] = {Format::Fast, Format::Mixed, Format::Double};
constexpr const char *FORMAT_NAMES[] = {"fast", "mixed", "double"};

double cpu_seconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

bool is_chosen(const std::map<std::string, std::string> &options, const char *option,
               const char *value)
{
  const auto found = options.find(option);
  return found == options.end() || found->second == value;
}

void compile(const KernelName &name, int capability, KernelCache &cache,
             const std::map<std::string, std::string> &options)
{
  const auto start = WallClock::now();
  const double cpu = cpu_seconds();
  const DeviceCode compiled = compiled_kernel(name, capability, Nvrtc::of_this_machine(), cache,
                                              [](const std::string &) {});
  std::printf("%-62s %6.2f s wall  %6.2f s cpu  %7zu bytes\n", to_string(name).c_str(),
              seconds_since(start), cpu_seconds() - cpu, compiled.code.size());
  std::fflush(stdout);
  const auto folder = options.find("keep");
  if (folder == options.end()) return;
  const std::string path = folder->second + "/" + compiled.kernel;
  std::ofstream(path + ".cubin", std::ios::binary) << compiled.code;
  std::ofstream(path + ".ptx") << compiled.text.c_str();
}

int run(int count, char **words)
{
  std::map<std::string, std::string> options;
  bool relaxed = false;
  for (int k = 1; k < count; ++k) {
    const std::string word = words[k];
    if (word == "--relaxed") {
      relaxed = true;
    } else if (word.compare(0, 2, "--") == 0 && k + 1 < count) {
      options[word.substr(2)] = words[++k];
    } else {
      std::fprintf(stderr, "unknown word %s\n", word.c_str());
      return 1;
    }
  }
  const std::string obstacle = Nvrtc::of_this_machine().obstacle();
  if (!obstacle.empty()) {
    std::fprintf(stderr, "%s\n", obstacle.c_str());
    return 1;
  }
  if (options.count("cache") && options.count("keep")) {
    std::fprintf(stderr, "--keep wants the text of kernels, which --cache does not have\n");
    return 1;
  }
  KernelCache cache(options["cache"]);
  if (!cache.obstacle().empty()) std::fprintf(stderr, "%s\n", cache.obstacle().c_str());
  const int capability = options.count("capability") ? std::atoi(options["capability"].c_str())
                                                     : 90;
  std::printf("NVRTC %s, for %s\n", Nvrtc::of_this_machine().identity().c_str(),
              Nvrtc::of_this_machine().target_for(capability).c_str());
  const auto compile_variant = [&](const char *variant_name, KernelVariant variant) {
    if (!is_chosen(options, "program", variant_name)) return;
    for (int f = 0; f < 3; ++f)
      for (const char *kernel : KERNELS) {
        if (!is_chosen(options, "format", FORMAT_NAMES[f]) || !is_chosen(options, "kernel", kernel))
          continue;
        if (relaxed && FORMATS[f] == Format::Double) continue;
        compile({kernel, variant, FORMATS[f], relaxed ? Arithmetic::Relaxed : Arithmetic::Strict},
                capability, cache, options);
      }
  };
#define RVE_COMPILE_PROGRAM(name, ...) compile_variant(#name, KernelVariant::name);
  RVE_KERNEL_VARIANTS(RVE_COMPILE_PROGRAM)
#undef RVE_COMPILE_PROGRAM
  return 0;
}

}    // namespace

int main(int count, char **words)
{
  try {
    return run(count, words);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
