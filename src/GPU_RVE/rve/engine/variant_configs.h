// SPDX-License-Identifier: GPL-2.0-only
// The table of kernel variants as types.

#pragma once

#include "rve/algorithm/kernel_config.h"
#include "rve/engine/kernel_variants.h"
#include "rve/physics/laws/dmt_adhesion.h"
#include "rve/physics/laws/hertz_mindlin.h"
#include "rve/physics/laws/linear_friction.h"

namespace rve {
inline namespace RVE_ISA {

  template <KernelVariant> struct VariantTraits;

#define RVE_VARIANT_TRAITS(name, law, kept, prepared)                               \
  template <> struct VariantTraits<KernelVariant::name> {                           \
    template <class Numbers> using Config = ConfigOf<law<Numbers>, Bookkept::kept>; \
    static constexpr KernelVariant prepared_like = KernelVariant::prepared;         \
  };
  RVE_KERNEL_VARIANTS(RVE_VARIANT_TRAITS)
#undef RVE_VARIANT_TRAITS

  /// Kernel configuration of a variant in a number format.
  template <KernelVariant variant, class Numbers>
  using VariantConfig = typename VariantTraits<variant>::template Config<Numbers>;

  /// Kernel variant as an argument of a generic function.
  template <KernelVariant variant> struct VariantConstant {
    static constexpr KernelVariant value = variant;
    static constexpr KernelVariant prepared_like = VariantTraits<variant>::prepared_like;
  };

  /// Calls work with the VariantConstant of a kernel variant for RVEs of D dimensions, and returns
  /// the result.
  template <int D, class Work> auto with_variant(KernelVariant variant, const Work &work)
  {
#define RVE_WITH_VARIANT(name, law, kept, prepared) \
  case KernelVariant::name:                         \
    return work(VariantConstant<KernelVariant::name>());
    if constexpr (D == 2) {
      switch (variant) {
        RVE_DISK_VARIANTS(RVE_WITH_VARIANT)
        default:
          return work(VariantConstant<KernelVariant::General>());
      }
    } else {
      switch (variant) {
        RVE_SPHERE_VARIANTS(RVE_WITH_VARIANT)
        default:
          return work(VariantConstant<KernelVariant::Spheres>());
      }
    }
#undef RVE_WITH_VARIANT
  }

}    // namespace RVE_ISA
}    // namespace rve
