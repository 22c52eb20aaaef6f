// SPDX-License-Identifier: GPL-2.0-only
// Values of the environment variable that requires a CUDA device.

#include "cuda/cuda_required.h"
#include "support/environment.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <string>

using namespace rve;

namespace {

constexpr const char *NAME = "GPU_RVE_REQUIRE_CUDA";

}    // namespace

TEST(CudaRequired, YesHasFourForms)
{
  for (const char *word : {"1", "true", "yes", "on", "YES", "True"}) {
    const rve_test::Environment environment(NAME, word);
    EXPECT_TRUE(cuda_required()) << word;
    EXPECT_EQ(cuda_requirement(), std::string("GPU_RVE_REQUIRE_CUDA=") + word);
  }
}

TEST(CudaRequired, NoHasFourFormsAndIsTheDefault)
{
  for (const char *word :
       {"0", "false", "no", "off", "No", "", static_cast<const char *>(nullptr)}) {
    const rve_test::Environment environment(NAME, word);
    EXPECT_FALSE(cuda_required()) << (word ? word : "not set");
  }
}

TEST(CudaRequired, OtherValuesAreErrors)
{
  for (const char *word : {"2", "y", "ja", " 1", "cuda"}) {
    const rve_test::Environment environment(NAME, word);
    EXPECT_EQ(rve_test::message_of([] { cuda_required(); }),
              "GPU_RVE_REQUIRE_CUDA in the environment is '" + std::string(word) +
                  "'; it must be 1, true, yes or on, or 0, false, no, off or empty");
  }
}
