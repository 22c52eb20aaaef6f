// SPDX-License-Identifier: GPL-2.0-only
// Sets an environment variable during a test.

#pragma once

#include <cstdlib>
#include <string>

namespace rve_test {

class Environment {
 public:
  /// Sets the variable; a null word unsets it.
  Environment(const char *name_in, const char *word) : name(name_in)
  {
    const char *before = std::getenv(name);
    had = before != nullptr;
    if (had) old = before;
    if (word)
      setenv(name, word, 1);
    else
      unsetenv(name);
  }
  Environment(const Environment &) = delete;
  Environment &operator=(const Environment &) = delete;
  ~Environment()
  {
    if (had)
      setenv(name, old.c_str(), 1);
    else
      unsetenv(name);
  }

 private:
  const char *name;
  bool had;
  std::string old;
};

}    // namespace rve_test
