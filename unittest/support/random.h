// SPDX-License-Identifier: GPL-2.0-only
// Random numbers that are the same on every machine. The distributions of the standard library
// differ between machines.

#pragma once

#include <cstdint>
#include <random>

namespace rve_test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine(seed) {}

  std::uint64_t bits() { return engine(); }

  /// Returns a number in [low, high).
  double uniform(double low, double high)
  {
    return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
  }

  /// Returns an integer in [low, high], both included.
  int integer(int low, int high)
  {
    return low + static_cast<int>(engine() % static_cast<std::uint64_t>(high - low + 1));
  }

 private:
  std::mt19937_64 engine;
};

}    // namespace rve_test
