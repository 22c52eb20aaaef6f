// SPDX-License-Identifier: GPL-2.0-only
// Files that tests write and read.

#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

namespace rve_test {

/// Returns a path for `name` that no other test uses.
inline std::string temporary_path(const std::string &name)
{
  const testing::TestInfo *test = testing::UnitTest::GetInstance()->current_test_info();
  return testing::TempDir() + "rve_" + test->test_suite_name() + "_" + test->name() + "_" + name;
}

/// Returns the bytes of a file; empty if it cannot be read.
inline std::string text_of(const std::string &path)
{
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

}    // namespace rve_test
