// SPDX-License-Identifier: GPL-2.0-only
// Whether the environment demands a CUDA device: where there is none, a run or a test then fails instead of doing without.

#pragma once

#include "rve/core/error.h"

#include <cstdlib>
#include <string>

namespace rve {

/// What a word says: 1, true, yes or on; or 0, false, no, off or nothing at all; in letters of any case. Throws InputError at others.
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

/// Of GPU_RVE_REQUIRE_CUDA; no where it is not set.
inline bool cuda_required()
{
  const char *word = std::getenv("GPU_RVE_REQUIRE_CUDA");
  return word && says_yes("GPU_RVE_REQUIRE_CUDA", word);
}

/// What an error says of it.
inline std::string cuda_requirement()
{
  const char *word = std::getenv("GPU_RVE_REQUIRE_CUDA");
  return std::string("GPU_RVE_REQUIRE_CUDA=") + (word ? word : "");
}

}    // namespace rve
