// SPDX-License-Identifier: GPL-2.0-only
// Marginal distributions of a field: monotonic functions of a normal number z (mean 0, variance 1).
// Constructors throw InputError if a parameter is out of range.

#pragma once

#include "rve/core/error.h"
#include "rve/core/pi.h"

#include <cmath>
#include <string>
#include <variant>

namespace field {

/// Bound of |z|. Larger values have a probability below 1e-349. All marginals are finite if |z| is
/// at most this bound.
constexpr double FARTHEST_Z = 40.0;

/// Normal distribution: mean + deviation z.
class Normal {
 public:
  Normal(double mean, double deviation) : mean_(mean), deviation_(deviation)
  {
    rve::require(std::isfinite(mean), "mean must be finite, got ", mean);
    rve::require(deviation > 0.0 && std::isfinite(deviation),
                 "standard deviation must be positive, got ", deviation);
    rve::require(std::isfinite(std::fabs(mean) + FARTHEST_Z * deviation),
                 "mean and 40 standard deviations must add up to less than 1.8e308, got ", mean,
                 " and ", deviation);
  }
  double operator()(double z) const { return mean_ + deviation_ * z; }

 private:
  double mean_, deviation_;
};

/// Lognormal distribution with this mean and standard deviation: exp(lambda + zeta z), where
/// zeta^2 = ln(1 + (deviation/mean)^2) and lambda = ln(mean) - zeta^2/2 (Fenton & Griffiths, Risk
/// Assessment in Geotechnical Engineering (2008)).
class Lognormal {
 public:
  Lognormal(double mean, double deviation)
  {
    rve::require(mean > 0.0 && std::isfinite(mean),
                 "mean of a lognormal field must be positive, got ", mean);
    rve::require(deviation > 0.0 && std::isfinite(deviation),
                 "standard deviation must be positive, got ", deviation);
    // Values at z near zeta dominate the mean. At this limit of deviation/mean, zeta is 8.3, and
    // the largest |z| of NormalNumbers is 8.57. With a larger variation, samples of a field would
    // not contain the values near zeta, and their mean would be too small.
    constexpr double LARGEST_VARIATION = 1e15;
    const double variation = deviation / mean;
    rve::require(
        variation <= LARGEST_VARIATION,
        "standard deviation of a lognormal field must be at most 1e15 times its mean, got ",
        deviation, " for the mean ", mean);
    zeta_ = std::sqrt(std::log1p(variation * variation));
    lambda_ = std::log(mean) - 0.5 * zeta_ * zeta_;
    rve::require(std::isnormal((*this)(-FARTHEST_Z)) && std::isfinite((*this)(FARTHEST_Z)),
                 "values of a lognormal field with the mean ", mean, " and the standard deviation ",
                 deviation,
                 " would leave the range of numbers, 2.3e-308 to 1.8e308: choose another unit");
  }
  double operator()(double z) const { return std::exp(lambda_ + zeta_ * z); }

 private:
  double lambda_, zeta_;
};

/// Closed interval of values.
class Interval {
 public:
  Interval(double lo, double hi) : lo_(lo), hi_(hi)
  {
    rve::require(std::isfinite(lo) && std::isfinite(hi) && lo < hi,
                 "lower bound must be below the upper one, got ", lo, " and ", hi);
  }
  /// Throws InputError if the width overflows.
  void require_width() const
  {
    rve::require(std::isfinite(hi_ - lo_),
                 "bounds of a field must be less than 1.8e308 apart, got ", to_string());
  }
  /// Value at the fraction f of the interval. Rounding does not move it out of the interval.
  double at(double f) const { return std::fmin(lo_ + (hi_ - lo_) * f, hi_); }
  bool contains(double value) const { return value >= lo_ && value <= hi_; }
  std::string to_string() const { return "[" + rve::number(lo_) + ", " + rve::number(hi_) + "]"; }

 private:
  double lo_, hi_;
};

/// Uniform distribution: lo + (hi - lo) Phi(z) with the normal distribution function Phi.
class Uniform {
 public:
  Uniform(double lo, double hi) : interval_(lo, hi) { interval_.require_width(); }
  double operator()(double z) const { return interval_.at(0.5 * std::erfc(-z * M_SQRT1_2)); }

 private:
  Interval interval_;
};

/// Bounded, bell-shaped distribution: lo + (hi - lo)/2 (1 + tanh((location + scale z)/(2 pi))). It
/// is symmetric for the location 0 and nearly uniform for the scale 5 (Fenton & Griffiths (2008)).
class Bounded {
 public:
  Bounded(double lo, double hi, double location, double scale) :
      interval_(lo, hi), location_(location), scale_(scale)
  {
    interval_.require_width();
    rve::require(std::isfinite(location), "location of a bounded field must be finite, got ",
                 location);
    rve::require(scale > 0.0 && std::isfinite(scale),
                 "scale of a bounded field must be positive, got ", scale);
  }
  double operator()(double z) const
  {
    return interval_.at(0.5 * (1.0 + std::tanh((location_ + scale_ * z) / (2.0 * rve::kPi))));
  }

 private:
  Interval interval_;
  double location_, scale_;
};

using Marginal = std::variant<Normal, Lognormal, Uniform, Bounded>;

}    // namespace field
