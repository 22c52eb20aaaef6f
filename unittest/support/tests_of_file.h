// SPDX-License-Identifier: GPL-2.0-only
// Functions that find the tests of a source file in the program.

#pragma once

#include <gtest/gtest.h>

#include <string>

namespace rve_test {

/// Calls act(suite, test) for every test of the program.
template <class Act> void for_all_tests(Act act)
{
  const ::testing::UnitTest &all = *::testing::UnitTest::GetInstance();
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const ::testing::TestSuite &suite = *all.GetTestSuite(s);
    for (int t = 0; t < suite.total_test_count(); ++t) act(suite, *suite.GetTestInfo(t));
  }
}

/// Returns true if this process runs at least one test of the source file, named as __FILE__.
inline bool runs_tests_of(const std::string &file)
{
  bool any = false;
  for_all_tests([&](const ::testing::TestSuite &, const ::testing::TestInfo &test) {
    if (test.should_run() && file == test.file()) any = true;
  });
  return any;
}

}    // namespace rve_test
