// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/variant_choice.h"

#include "rve/core/error.h"
#include "rve/engine/variant_configs.h"

#include <algorithm>
#include <array>
#include <string>
#include <type_traits>

namespace rve {

namespace {

  template <class Config> constexpr VariantFeatures features_of_config(KernelVariant memory)
  {
    using Law = typename Config::Law;
    return {{Law::contact_law, Law::has_rolling, Config::D},
            {Law::has_friction, Law::is_damped, Law::has_rescaling, Config::steers,
             Config::has_bookkeeping},
            memory};
  }

  constexpr std::array<VariantFeatures, kNumVariants> TABLE = {{
#define RVE_FEATURES(name, law, has_bookkeeping, prepared) \
  features_of_config<VariantConfig<KernelVariant::name, MixedNumbers>>(KernelVariant::prepared),
      RVE_KERNEL_VARIANTS(RVE_FEATURES)
#undef RVE_FEATURES
  }};

  constexpr bool has_all(const CallNeeds &has, const CallNeeds &needs)
  {
    return (has.friction || !needs.friction) && (has.dashpots || !needs.dashpots) &&
        (has.rescaling || !needs.rescaling) && (has.servo || !needs.servo) &&
        (has.has_bookkeeping || !needs.has_bookkeeping);
  }

#define RVE_CHECK(name, law, has_bookkeeping, prepared)                                        \
  static_assert(std::is_same_v<VariantConfig<KernelVariant::name, MixedNumbers>::History,      \
                               VariantConfig<KernelVariant::prepared, MixedNumbers>::History>, \
                "variants that are prepared alike have the same memory layout");
  RVE_KERNEL_VARIANTS(RVE_CHECK)
#undef RVE_CHECK

  constexpr bool preparing_variants_have_all_features()
  {
    for (const VariantFeatures &one : TABLE) {
      const VariantFeatures &other = TABLE[static_cast<int>(one.memory)];
      if (other.memory != one.memory || other.contacts.law != one.contacts.law ||
          other.contacts.rolling != one.contacts.rolling ||
          other.contacts.dimension != one.contacts.dimension || !has_all(other.has, one.has) ||
          !other.has.has_bookkeeping)
        return false;
    }
    return true;
  }
  static_assert(preparing_variants_have_all_features(), "engine/kernel_variants.h says so");

}    // namespace

VariantFeatures features_of(KernelVariant variant)
{
  return TABLE[static_cast<int>(variant)];
}

KernelVariant memory_variant(const ContactModel &contacts)
{
  const auto found = std::find_if(TABLE.begin(), TABLE.end(), [&](const VariantFeatures &one) {
    return features_of(one.memory).contacts.serves(contacts);
  });
  require(found != TABLE.end(), "there are no kernels for RVEs with ", to_string(contacts));
  return found->memory;
}

KernelVariant richest_variant(ContactLaw law, int dimension)
{
  const auto last = std::find_if(TABLE.rbegin(), TABLE.rend(), [&](const VariantFeatures &one) {
    return one.contacts.law == law && one.contacts.dimension == dimension;
  });
  require(last != TABLE.rend(), "there are no kernels for contact law ", word_of(law));
  return last->memory;
}

KernelVariant choose_variant(KernelVariant memory, const CallNeeds &needs)
{
  const auto found = std::find_if(TABLE.begin(), TABLE.end(), [&](const VariantFeatures &one) {
    return one.memory == memory && has_all(one.has, needs);
  });
  require(found != TABLE.end(), [&] {
    const CallNeeds &has = features_of(memory).has;
    return std::string("contact law ") + word_of(features_of(memory).contacts.law) + " supports " +
        (needs.friction && !has.friction ? "no friction" : "neither dashpots nor arms lammps");
  });
  return static_cast<KernelVariant>(found - TABLE.begin());
}

}    // namespace rve
