// SPDX-License-Identifier: GPL-2.0-only
// Kernels of the kernel variants for a CUDA engine, and the memory that they need. A kernel was
// either compiled with the program, or it is compiled at run time when it is first needed.

#pragma once

#include "rve/engine/cuda_kernels.h"
#include "rve/engine/kernel_variants.h"
#include "rve/engine/options.h"
#include "rve/engine/runtime_kernels.h"

#include <array>
#include <functional>
#include <optional>
#include <string>

namespace rve {

/// Returns the kernels of a variant that were compiled with the program (cuda_variant.cu.in); null
/// pointers if the variant is compiled at run time.
template <KernelVariant variant, Format format, Arithmetic arithmetic>
VariantKernels cuda_kernels();

#define RVE_DECLARE_KERNELS(name, law, has_bookkeeping, prepared)                         \
  template <>                                                                             \
  VariantKernels cuda_kernels<KernelVariant::name, Format::Fast, Arithmetic::Strict>();   \
  template <>                                                                             \
  VariantKernels cuda_kernels<KernelVariant::name, Format::Fast, Arithmetic::Relaxed>();  \
  template <>                                                                             \
  VariantKernels cuda_kernels<KernelVariant::name, Format::Mixed, Arithmetic::Strict>();  \
  template <>                                                                             \
  VariantKernels cuda_kernels<KernelVariant::name, Format::Mixed, Arithmetic::Relaxed>(); \
  template <>                                                                             \
  VariantKernels cuda_kernels<KernelVariant::name, Format::Double, Arithmetic::Strict>();
RVE_KERNEL_VARIANTS(RVE_DECLARE_KERNELS)
#undef RVE_DECLARE_KERNELS

class CudaVariants {
 public:
  /// `capability` is the compute capability of the device, 10 major + minor.
  CudaVariants(const Options &options, int capability);

  /// Returns the reason why RVEs with the memory layout of `memory` cannot be advanced; empty if
  /// they can. `to_compiling` is the reason why kernels cannot be compiled at run time, or empty.
  /// RVEs cannot be advanced if their kernels must be compiled and `to_compiling` is not empty.
  std::string obstacle(KernelVariant memory, const std::string &to_compiling) const;

  /// Returns the variant itself if its kernels exist or can be compiled at run time. Otherwise
  /// returns the more general variant that prepares its calls and gives the same bits. Throws
  /// InputError if the program does not contain the kernels of the general variant either.
  KernelVariant usable(KernelVariant variant) const;

  /// Returns the block shape of a kernel of a usable variant; empty if the variant has no kernel of
  /// this residency.
  std::optional<BlockShape> shape(KernelVariant variant, Residency residency) const;

  /// advance() and prepare() return a kernel of a usable variant for cudaLaunchKernelExC: the
  /// address of a function with the parameters (LaunchRecord, BatchConstants), or a handle of the
  /// function.
  /// RuntimeKernel::is_final is true if advance() will always return this kernel.
  RuntimeKernel advance(KernelVariant variant, Residency residency) const;
  const void *prepare(KernelVariant variant) const;
  /// Returns true if advance() can return the kernel without compiling it.
  bool is_at_hand(KernelVariant variant, Residency residency) const;

  KernelSizes sizes(KernelVariant variant, Residency residency, int num_grains, int pair_capacity,
                    int steps_ahead) const;

 private:
  using Shape = BlockShape (*)(Residency);
  using Sizes = KernelSizes (*)(Residency, int num_grains, int pair_capacity, int steps_ahead);
  struct Entry {
    VariantKernels kernels;
    Shape shape;
    Sizes sizes;
    KernelVariant prepared_like;
    bool ahead;    ///< compiled with this program
  };
  const Format format;
  const Arithmetic arithmetic;
  const int capability;
  const std::function<void(const std::string &)> log;
  std::array<Entry, kNumVariants> entries;

  template <class Numbers, Format, Arithmetic> void fill();
  const Entry &of(KernelVariant variant) const { return entries[static_cast<int>(variant)]; }
  RuntimeKernel compiled(const char *kernel, KernelVariant variant) const;
};

}    // namespace rve
