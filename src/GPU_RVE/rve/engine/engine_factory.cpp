// SPDX-License-Identifier: GPL-2.0-only
// Choice of the backend.

#include "cuda/cuda_required.h"
#include "rve/core/error.h"
#include "rve/engine/engine.h"
#include "rve/engine/host_engine.h"

#if defined(GPU_RVE_WITH_CUDA)
#include "rve/engine/cuda_engine.h"
#endif

namespace rve {

template <int D>
std::unique_ptr<EngineOf<D>> make_engine(const Options &options, std::string *notice)
{
  if (notice) notice->clear();
  require(options.arithmetic == Arithmetic::Strict || options.format == Format::Fast ||
              options.format == Format::Mixed,
          "relaxed arithmetic requires number format fast or mixed, got ",
          to_string(options.format));
  require(options.arithmetic == Arithmetic::Strict || options.device != Device::Cpu,
          "relaxed arithmetic requires a CUDA device; use strict arithmetic on a CPU");
  require(D == 2 || options.format != Format::Single,
          "number format single supports disks only; use fast, mixed or double for spheres");
  const bool only_on_cpu = options.format == Format::Single;
  require(!only_on_cpu || options.device != Device::Cuda,
          "number format single is available on CPUs only; use fast, mixed or double");
  if (options.device == Device::Cpu) return make_host_engine<D>(options);
  // cuda_required() is called even if a device exists, since an invalid value of the environment
  // variable is an error.
  const bool required = cuda_required();
  require(
      !required || !only_on_cpu, cuda_requirement(),
      " forbids the CPU, but number format single is available on CPUs only; use fast, mixed or "
      "double, or device cpu");
  if (only_on_cpu) return make_host_engine<D>(options);
  std::string obstacle = "GPU_RVE was built without CUDA";
  // A build without CUDA always uses the CPU. A notice is given only if the arithmetic changes.
  const bool is_relaxed = options.arithmetic == Arithmetic::Relaxed;
  bool is_notable = is_relaxed;
#if defined(GPU_RVE_WITH_CUDA)
  is_notable = true;
  if (auto engine = make_cuda_engine<D>(options, obstacle)) return engine;
#endif
  require(options.device != Device::Cuda, "a CUDA device was requested, but ", obstacle);
  require(!required, cuda_requirement(), " forbids the CPU as a fallback: ", obstacle);
  if (notice && is_notable)
    *notice = obstacle + "; RVEs run on the CPU" + (is_relaxed ? ", with strict arithmetic" : "");
  return make_host_engine<D>(options);
}

template std::unique_ptr<EngineOf<2>> make_engine(const Options &options, std::string *notice);
template std::unique_ptr<EngineOf<3>> make_engine(const Options &options, std::string *notice);

}    // namespace rve
