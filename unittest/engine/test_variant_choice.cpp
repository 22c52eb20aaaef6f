// SPDX-License-Identifier: GPL-2.0-only
// Tests the choice of the kernel variant from the contacts of the RVEs and the needs of a call.

#include "rve/core/error.h"
#include "rve/engine/engine.h"
#include "rve/engine/variant_choice.h"
#include "support/messages.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <array>
#include <iterator>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr const char *NAMES[] = {
#define RVE_NAME(name, law, has_bookkeeping, prepared) #name,
    RVE_KERNEL_VARIANTS(RVE_NAME)
#undef RVE_NAME
};

std::string name_of(KernelVariant variant)
{
  static_assert(std::size(NAMES) == kNumVariants);
  return NAMES[static_cast<int>(variant)];
}

constexpr ContactModel LINEAR = {ContactLaw::Linear, false}, ROLLING = {ContactLaw::Linear, true},
                       HERTZ = {ContactLaw::Hertz, false},
                       HERTZ_SPHERES = {ContactLaw::Hertz, false, 3};

}    // namespace

TEST(VariantChoice, IsTheSmallestProgramForTheNeedsOfACall)
{
  struct {
    ContactModel contacts;
    CallNeeds needs;    // friction, dashpots, rescaling, servo, energy
    KernelVariant expected;
  } const cases[] = {
      {LINEAR, {false, false, false, false, false}, KernelVariant::Frictionless},
      {LINEAR, {true, false, false, false, false}, KernelVariant::Plain},
      {LINEAR, {false, false, false, true, false}, KernelVariant::Steered},
      {LINEAR, {true, false, false, true, false}, KernelVariant::Steered},
      {LINEAR, {false, true, false, false, false}, KernelVariant::General},
      {LINEAR, {false, false, false, false, true}, KernelVariant::General},
      {LINEAR, {true, true, false, true, false}, KernelVariant::General},
      {LINEAR, {true, false, false, true, true}, KernelVariant::General},
      {LINEAR, {true, true, false, true, true}, KernelVariant::General},
      {HERTZ, {true, false, false, false, false}, KernelVariant::PlainHertz},
      {HERTZ, {true, true, false, false, false}, KernelVariant::Hertz},
      {HERTZ, {true, false, false, true, false}, KernelVariant::Hertz},
      {HERTZ, {true, false, false, false, true}, KernelVariant::Hertz},
      {HERTZ_SPHERES, {true, false, false, false, false}, KernelVariant::SphereMindlinForce},
      {HERTZ_SPHERES, {true, false, true, false, false}, KernelVariant::PlainSphereHertz},
      {HERTZ_SPHERES, {true, false, false, true, false}, KernelVariant::SteeredSphereHertz},
      {HERTZ_SPHERES, {true, true, false, false, false}, KernelVariant::SphereHertz},
      {ROLLING, {false, false, false, false, false}, KernelVariant::Rolling},
      {ROLLING, {true, false, false, true, false}, KernelVariant::Rolling},
      {ROLLING, {true, true, false, true, true}, KernelVariant::Rolling}};
  for (const auto &one : cases) {
    SCOPED_TRACE(to_string(one.contacts) + (one.needs.friction ? ", friction" : "") +
                 (one.needs.dashpots ? ", dashpots" : "") +
                 (one.needs.rescaling ? ", rescaling" : "") + (one.needs.servo ? ", servo" : "") +
                 (one.needs.has_bookkeeping ? ", books" : ""));

    const KernelVariant variant = choose_variant(memory_variant(one.contacts), one.needs);

    EXPECT_EQ(name_of(variant), name_of(one.expected));
  }
}

/// Tests conditions that every kernel variant of the table must satisfy.
TEST(VariantChoice, CoversAllNeedsOfAllContactLaws)
{
  for (int k = 0; k < kNumVariants; ++k) {
    const KernelVariant variant = static_cast<KernelVariant>(k);
    SCOPED_TRACE(name_of(variant));
    const VariantFeatures features = features_of(variant);
    const KernelVariant memory = memory_variant(features.contacts);
    const CallNeeds most = features_of(memory).has;
    EXPECT_TRUE(features_of(memory).contacts.serves(features.contacts));
    EXPECT_EQ(features_of(memory).memory, memory);
    EXPECT_TRUE(most.has_bookkeeping);
    for (const bool friction : {false, true})
      for (const bool dashpots : {false, true})
        for (const bool rescaling : {false, true})
          for (const bool servo : {false, true})
            for (const bool has_bookkeeping : {false, true}) {
              if ((friction && !most.friction) || (dashpots && !most.dashpots) ||
                  (rescaling && !most.rescaling))
                continue;
              const KernelVariant chosen =
                  choose_variant(memory, {friction, dashpots, rescaling, servo, has_bookkeeping});
              const CallNeeds has = features_of(chosen).has;
              EXPECT_EQ(features_of(chosen).memory, memory);
              EXPECT_TRUE(has.friction || !friction);
              EXPECT_TRUE(has.dashpots || !dashpots);
              EXPECT_TRUE(has.rescaling || !rescaling);
              EXPECT_TRUE(has.servo || !servo);
              EXPECT_TRUE(has.has_bookkeeping || !has_bookkeeping);
            }
  }
}

TEST(VariantChoice, EveryContactLawHasProgramsWithAndWithoutRolling)
{
  for (std::size_t k = 0; k < std::size(CONTACT_LAW_WORDS); ++k) {
    const ContactLaw law = contact_law_of(CONTACT_LAW_WORDS[k]);
    EXPECT_EQ(static_cast<std::size_t>(law), k);
    for (const int dimension : {2, 3}) {
      for (const bool rolling : {false, true}) {
        const ContactModel contacts{law, rolling, dimension};
        EXPECT_EQ(features_of(memory_variant(contacts)).contacts, contacts);
      }
      EXPECT_EQ(features_of(richest_variant(law, dimension)).contacts,
                (ContactModel{law, true, dimension}));
    }
  }
  EXPECT_EQ(message_of([] { contact_law_of("hoke"); }),
            "there is no contact law 'hoke'; did you mean hooke?");
}

TEST(ContactModel, CoversTheNeedsOfAllPackings)
{
  const RveState plain = two_disks(1e-5);
  RveState rolling = plain, rolled = plain, without_spring = plain;
  rolling.material.rolling_stiffness = 1e5;
  rolling.material.rolling_friction = 0.1;
  without_spring.material.rolling_friction = 0.1;
  rolled.pairs.push_back({0, 1, 0.0, 2.0});

  EXPECT_EQ(contacts_of(plain), LINEAR);
  EXPECT_EQ(contacts_of(without_spring), LINEAR);
  EXPECT_EQ(contacts_of(rolling), ROLLING);
  EXPECT_EQ(contacts_of(rolled), ROLLING);
  EXPECT_EQ(contacts_of(std::vector<RveState>{plain, without_spring}), LINEAR);
  EXPECT_EQ(contacts_of(std::vector<RveState>{plain, rolling}), ROLLING);
  EXPECT_TRUE(ROLLING.serves(LINEAR));
  EXPECT_FALSE(LINEAR.serves(ROLLING));
  EXPECT_EQ(to_string(ROLLING), "contact law hooke with rolling resistance");
}
