// SPDX-License-Identifier: GPL-2.0-only
// Means of numbers, root mean squares of errors, and the order at which errors decrease on finer
// grids.

#pragma once

#include <cmath>

namespace mpm_test {

/// Root mean square of added numbers.
class Rms {
 public:
  void add(double value)
  {
    sum_ += value * value;
    ++count_;
  }
  double value() const { return std::sqrt(sum_ / count_); }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

/// Mean of added numbers.
class Mean {
 public:
  void add(double value)
  {
    sum_ += value;
    ++count_;
  }
  double value() const { return sum_ / count_; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

/// Returns the observed order of errors on two grids whose cells differ by the factor `refinement`.
inline double order(double coarse, double fine, double refinement = 2.0)
{
  return std::log(coarse / fine) / std::log(refinement);
}

}    // namespace mpm_test
