// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/cuda_variants.h"

#include "cuda/cuda_required.h"
#include "rve/algorithm/call_state.h"
#include "rve/core/error.h"
#include "rve/engine/runtime_kernels.h"
#include "rve/engine/variant_choice.h"
#include "rve/engine/variant_configs.h"

#include <cstdlib>

namespace rve {

namespace {

  /// Names of the kernels, in the order of Residency.
  constexpr const char *ADVANCE[kNumResidencies] = {"advance_many", "advance_few", "advance_large",
                                                    "advance_largest", "advance_in_memory"};

  /// Returns true if kernels that were compiled with the program must not be used. Tests set this
  /// variable.
  bool all_at_run_time()
  {
    const char *word = std::getenv("GPU_RVE_KERNELS_AT_RUN_TIME");
    return word && says_yes("GPU_RVE_KERNELS_AT_RUN_TIME", word);
  }

  /// Returns the sizes of kernels of the configuration Lean. Config is the configuration that
  /// prepares their calls and defines the memory layout of the RVEs.
  template <class Lean, class Config>
  KernelSizes kernel_sizes(Residency residency, int num_grains, int pair_capacity, int steps_ahead)
  {
    KernelSizes sizes = {};
    const int capacity = block_shape<Lean>(residency).capacity();
    if (capacity == 0) {
      sizes.shared = shared_size<PlacedConfig<Lean, Residency::Memory>>(num_grains, false);
    } else if (Config::D == 2) {
      sizes.shared = shared_size<Config>(capacity, true);
    } else {
      const DividedSize divided = divided_size<Config>(capacity, num_grains);
      sizes.shared = divided.on_chip;
      sizes.beside = divided.beside;
    }
    sizes.workspace = workspace_size<Config>(num_grains, pair_capacity);
    sizes.prepared = (PreparedCall<Config>::size_with(steps_ahead) + 15) / 16 * 16;
    return sizes;
  }

}    // namespace

template <class Numbers, Format format_, Arithmetic arithmetic_> void CudaVariants::fill()
{
  const bool none_ahead = all_at_run_time();
#define RVE_FILL(name, ...)                                                                      \
  {                                                                                              \
    Entry &entry = entries[static_cast<int>(KernelVariant::name)];                               \
    entry.prepared_like = VariantTraits<KernelVariant::name>::prepared_like;                     \
    entry.shape = block_shape<VariantConfig<KernelVariant::name, Numbers>>;                      \
    entry.sizes =                                                                                \
        kernel_sizes<VariantConfig<KernelVariant::name, Numbers>,                                \
                     VariantConfig<VariantTraits<KernelVariant::name>::prepared_like, Numbers>>; \
    entry.kernels = cuda_kernels<KernelVariant::name, format_, arithmetic_>();                   \
    entry.ahead =                                                                                \
        !none_ahead && entry.kernels.kernel[static_cast<int>(Residency::Memory)] != nullptr;     \
  }
  RVE_KERNEL_VARIANTS(RVE_FILL)
#undef RVE_FILL
}

CudaVariants::CudaVariants(const Options &options, int capability_in) :
    format(options.format), arithmetic(options.arithmetic), capability(capability_in),
    log(options.log)
{
  const bool relaxed = arithmetic == Arithmetic::Relaxed;
  if (format == Format::Fast && relaxed)
    fill<FastNumbers, Format::Fast, Arithmetic::Relaxed>();
  else if (format == Format::Fast)
    fill<FastNumbers, Format::Fast, Arithmetic::Strict>();
  else if (format == Format::Mixed && relaxed)
    fill<MixedNumbers, Format::Mixed, Arithmetic::Relaxed>();
  else if (format == Format::Mixed)
    fill<MixedNumbers, Format::Mixed, Arithmetic::Strict>();
  else
    fill<DoubleNumbers, Format::Double, Arithmetic::Strict>();
}

std::string CudaVariants::obstacle(KernelVariant memory, const std::string &to_compiling) const
{
  if (of(memory).ahead || to_compiling.empty()) return "";
  return "kernels for RVEs with " + to_string(features_of(memory).contacts) +
      (arithmetic == Arithmetic::Relaxed ? " in relaxed arithmetic" : "") +
      " must be compiled at run time, which is not possible: " + to_compiling;
}

KernelVariant CudaVariants::usable(KernelVariant variant) const
{
  const Entry &entry = of(variant);
  if (entry.ahead && of(entry.prepared_like).ahead) return variant;
  const std::string to_compiling = runtime_kernels_obstacle();
  if (to_compiling.empty()) return variant;
  const std::string why_not = obstacle(entry.prepared_like, to_compiling);
  require(why_not.empty(), why_not);
  return entry.prepared_like;
}

std::optional<BlockShape> CudaVariants::shape(KernelVariant variant, Residency residency) const
{
  const Entry &entry = of(variant);
  const BlockShape shape = entry.shape(residency);
  const bool has = residency == Residency::Memory || shape.items > 0;
  return has ? std::optional<BlockShape>(shape) : std::nullopt;
}

RuntimeKernel CudaVariants::advance(KernelVariant variant, Residency residency) const
{
  const int index = static_cast<int>(residency);
  return of(variant).ahead ? RuntimeKernel{of(variant).kernels.kernel[index], true}
                           : compiled(ADVANCE[index], variant);
}

bool CudaVariants::is_at_hand(KernelVariant variant, Residency residency) const
{
  const char *kernel = ADVANCE[static_cast<int>(residency)];
  return of(variant).ahead || rve::is_at_hand({kernel, variant, format, arithmetic}, capability);
}

const void *CudaVariants::prepare(KernelVariant variant) const
{
  const KernelVariant like = of(variant).prepared_like;
  return of(like).ahead ? of(like).kernels.prepare : compiled("prepare_calls", like).function;
}

KernelSizes CudaVariants::sizes(KernelVariant variant, Residency residency, int num_grains,
                                int pair_capacity, int steps_ahead) const
{
  return of(variant).sizes(residency, num_grains, pair_capacity, steps_ahead);
}

RuntimeKernel CudaVariants::compiled(const char *kernel, KernelVariant variant) const
{
  return runtime_kernel({kernel, variant, format, arithmetic}, capability, log);
}

}    // namespace rve
