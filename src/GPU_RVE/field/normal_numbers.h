// SPDX-License-Identifier: GPL-2.0-only
// Generator of normal random numbers with mean 0 and variance 1. It uses the 64-bit Mersenne
// twister of the C++ standard, started from a seed, and the transform of Box & Muller (1958).
// std::normal_distribution is not used, because its numbers differ between standard libraries. |z|
// is at most sqrt(106 ln 2) = 8.57.

#pragma once

#include "rve/core/pi.h"

#include <cmath>
#include <cstdint>
#include <random>

namespace field {

class NormalNumbers {
 public:
  explicit NormalNumbers(std::uint64_t seed) : engine_(seed) {}

  /// Writes the next `count` numbers. `count` must be even, because numbers are generated in pairs.
  void fill(double *numbers, std::int64_t count)
  {
    for (std::int64_t i = 0; i + 1 < count; i += 2) {
      const double u = static_cast<double>((engine_() >> 11) + 1) * 0x1p-53;    // in (0, 1]
      const double v = static_cast<double>(engine_() >> 11) * 0x1p-53;          // in [0, 1)
      const double radius = std::sqrt(-2.0 * std::log(u));
      numbers[i] = radius * std::cos(2.0 * rve::kPi * v);
      numbers[i + 1] = radius * std::sin(2.0 * rve::kPi * v);
    }
  }

 private:
  std::mt19937_64 engine_;
};

}    // namespace field
