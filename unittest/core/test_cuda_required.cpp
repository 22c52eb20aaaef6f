// What the environment may say of a CUDA device.

#include "rve/core/cuda_required.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <cstdlib>

using namespace rve;

namespace {

/// The variable for the time of a test.
class Environment {
 public:
  explicit Environment(const char *word)
  {
    const char *before = std::getenv(NAME);
    had = before != nullptr;
    if (had) old = before;
    if (word)
      setenv(NAME, word, 1);
    else
      unsetenv(NAME);
  }
  ~Environment()
  {
    if (had)
      setenv(NAME, old.c_str(), 1);
    else
      unsetenv(NAME);
  }

 private:
  static constexpr const char *NAME = "GPU_RVE_REQUIRE_CUDA";
  bool had;
  std::string old;
};

}    // namespace

TEST(CudaRequired, YesIsSaidInFourWays)
{
  for (const char *word : {"1", "true", "yes", "on", "YES", "True"}) {
    const Environment environment(word);
    EXPECT_TRUE(cuda_required()) << word;
    EXPECT_EQ(cuda_requirement(), std::string("GPU_RVE_REQUIRE_CUDA=") + word);
  }
}

TEST(CudaRequired, NoIsSaidInFourWaysOrNotAtAll)
{
  for (const char *word :
       {"0", "false", "no", "off", "No", "", static_cast<const char *>(nullptr)}) {
    const Environment environment(word);
    EXPECT_FALSE(cuda_required()) << (word ? word : "not set");
  }
}

TEST(CudaRequired, AnythingElseIsAnErrorThatNamesIt)
{
  for (const char *word : {"2", "y", "ja", " 1", "cuda"}) {
    const Environment environment(word);
    EXPECT_EQ(rve_test::message_of([] {
                cuda_required();
              }),
              "GPU_RVE_REQUIRE_CUDA in the environment is '" + std::string(word) +
                  "'; it must be 1, true, yes or on, or 0, false, no, off or empty");
  }
}
