// SPDX-License-Identifier: GPL-2.0-only
// The main function of a test program. It runs all tests or, with --file=test_x, the tests of the
// source file test_x.cpp.

#pragma once

#include "support/tests_of_file.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <set>
#include <string>

namespace rve_test {

/// Returns the name of a source file without folder and suffix.
inline std::string stem_of(const std::string &path)
{
  const std::size_t slash = path.rfind('/');
  const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
  return path.substr(begin, path.rfind('.') - begin);
}

/// Adds a pattern to a list in GoogleTest's form.
inline void add_pattern(std::string &patterns, const std::string &pattern)
{
  if (!patterns.empty()) patterns += ':';
  patterns += pattern;
}

/// Narrows the filter of GoogleTest to the tests of one source file and returns whether the file
/// has tests. If all tests of a suite are in one file, the filter names the suite and not each
/// test.
inline bool choose_file(const std::string &stem)
{
  struct Suite {
    std::set<std::string> here, elsewhere;
  };
  std::map<std::string, Suite> suites;
  for_all_tests([&](const ::testing::TestSuite &suite, const ::testing::TestInfo &test) {
    Suite &tests = suites[suite.name()];
    (stem_of(test.file()) == stem ? tests.here : tests.elsewhere).insert(test.name());
  });
  std::string chosen, others;
  for (const auto &[name, tests] : suites) {
    if (tests.elsewhere.empty())
      add_pattern(chosen, name + ".*");
    else if (tests.here.empty())
      add_pattern(others, name + ".*");
    else {
      for (const std::string &test : tests.here) add_pattern(chosen, name + "." + test);
      for (const std::string &test : tests.elsewhere) add_pattern(others, name + "." + test);
    }
  }
  if (chosen.empty()) return false;
  const std::string filter = ::testing::GTEST_FLAG(filter);
  const std::size_t minus = filter.find('-');
  const std::string wanted = filter.substr(0, minus);
  std::string unwanted = minus == std::string::npos ? "" : filter.substr(minus + 1);
  if (wanted.empty() || wanted == "*")
    ::testing::GTEST_FLAG(filter) = chosen + (unwanted.empty() ? "" : "-" + unwanted);
  else {    // a test runs only if it is in the file and in the given filter
    if (!others.empty()) add_pattern(unwanted, others);
    ::testing::GTEST_FLAG(filter) = wanted + (unwanted.empty() ? "" : "-" + unwanted);
  }
  return true;
}

inline int run_tests(int argc, char **argv)
{
  ::testing::InitGoogleTest(&argc, argv);
  for (int k = 1; k < argc; ++k) {
    const std::string option = "--file=", word = argv[k];
    const bool is_known = word.compare(0, option.size(), option) == 0;
    if (!is_known || !choose_file(word.substr(option.size()))) {
      std::fprintf(stderr, "%s: %s\n", word.c_str(),
                   is_known ? "there are no tests of this file" : "unknown option");
      return 2;
    }
  }
  return RUN_ALL_TESTS();
}

}    // namespace rve_test
