// SPDX-License-Identifier: GPL-2.0-only
// The environment variable GPU_RVE_REQUIRE_CUDA. If it is true, a run or a test fails on a machine
// without a usable CUDA device.

#pragma once

#include "rve/core/error.h"

#include <cstdlib>
#include <string>

namespace rve {

/// Returns true for 1, true, yes or on, and false for 0, false, no, off or an empty word, in upper
/// or lower case. Throws InputError for other words.
inline bool says_yes(const std::string &name, const std::string &word)
{
  std::string small;
  for (const char c : word) small += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const char *yes : {"1", "true", "yes", "on"})
    if (small == yes) return true;
  for (const char *no : {"", "0", "false", "no", "off"})
    if (small == no) return false;
  throw InputError(name + " in the environment is '" + word +
                   "'; it must be 1, true, yes or on, or 0, false, no, off or empty");
}

/// Returns the value of GPU_RVE_REQUIRE_CUDA; false if it is not set.
inline bool cuda_required()
{
  const char *word = std::getenv("GPU_RVE_REQUIRE_CUDA");
  return word && says_yes("GPU_RVE_REQUIRE_CUDA", word);
}

/// Returns the text "GPU_RVE_REQUIRE_CUDA=value" for an error message.
inline std::string cuda_requirement()
{
  const char *word = std::getenv("GPU_RVE_REQUIRE_CUDA");
  return std::string("GPU_RVE_REQUIRE_CUDA=") + (word ? word : "");
}

}    // namespace rve
