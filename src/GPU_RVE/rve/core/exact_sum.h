// SPDX-License-Identifier: GPL-2.0-only
// Sums that do not depend on the order of their terms: real numbers are rounded once to integers,
// and integers are added.
//
// A sum of integers is the same for any order of terms, number of threads and number of ranks. The
// unit of the integers is a power of two, which depends only on the largest magnitude and on the
// number of terms.

#pragma once

#include "rve/core/config.h"

#include <cmath>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Fixed-point scale for a sum of at most `terms` numbers of magnitude at most `bound`.
  ///
  /// |sum| < 2⁶² by construction, so that a sum cannot wrap. The caller must check that every term
  /// is finite and within the bound. The unit is at most bound * terms * 2⁻⁶¹. For 10⁴ terms this
  /// is 4.4e-15 times the bound.
  class FixedScale {
   public:
    FixedScale() = default;
    RVE_HD FixedScale(double bound, std::int64_t terms)
    {
      int exponent = 0;
      std::frexp(bound * static_cast<double>(terms), &exponent);    // bound * terms < 2^exponent
      exponent = 62 - exponent;
      // This limit keeps both powers of two normal numbers.
      exponent = exponent < -1000 ? -1000 : exponent > 1000 ? 1000 : exponent;
      per_unit_ = std::ldexp(1.0, exponent);
      unit_ = std::ldexp(1.0, -exponent);
    }

    /// Rounds to the nearest integer, halves away from zero.
    RVE_HD std::int64_t integer(double value) const
    {
      const double scaled = value * per_unit_;
      return static_cast<std::int64_t>(scaled + (scaled < 0.0 ? -0.5 : 0.5));
    }

    RVE_HD double real(std::int64_t value) const { return static_cast<double>(value) * unit_; }

    /// Value of the integer 1, in the unit of the summed quantity.
    RVE_HD double unit() const { return unit_; }

   private:
    double per_unit_ = 1.0;
    double unit_ = 1.0;
  };

}    // namespace RVE_ISA
}    // namespace rve
