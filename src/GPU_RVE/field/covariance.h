// SPDX-License-Identifier: GPL-2.0-only
// Covariance functions of a stationary Gaussian field of variance 1. Their argument r is the
// distance between two points, divided by the correlation length [-]. Matern's function has a
// parameter, the smoothness nu. It equals the exponential function for nu = 1/2 and tends to the
// Gaussian function for infinite nu.
//   Matern, Spatial Variation (1986)
//   Rasmussen & Williams, Gaussian Processes for Machine Learning (2006), section 4.2.1

#pragma once

#include "field/grid.h"

#include <string>
#include <variant>

namespace field {

/// exp(-r)
struct Exponential {
  double operator()(double r) const { return std::exp(-r); }
};

/// exp(-r^2 / 2)
struct Gaussian {
  double operator()(double r) const { return std::exp(-0.5 * r * r); }
};

/// 2^(1-nu) / Gamma(nu) s^nu K_nu(s), where s = sqrt(2 nu) r, nu is the smoothness, and K_nu is the
/// modified Bessel function of the second kind.
class Matern {
 public:
  /// The field has mean-square derivatives of all orders below the smoothness nu. Throws InputError
  /// unless nu is in (0, 25].
  explicit Matern(double smoothness);
  double operator()(double r) const;
  double smoothness() const { return smoothness_; }

 private:
  double smoothness_;
  double scale_;     ///< sqrt(2 nu)
  double factor_;    ///< 2^(1-nu) / Gamma(nu)
};

/// Ellipse whose half axes are the correlation lengths. It is a contour of the covariance function.
class Anisotropy {
 public:
  /// `length` has the correlation lengths along the two axes of the ellipse [length]. The first
  /// axis is turned from x by `angle` [degrees], counter-clockwise. Throws InputError if a length
  /// is not positive or the angle is out of range.
  explicit Anisotropy(const Vec &length, double angle = 0.0);

  /// Distance of a lag in correlation lengths [-].
  double distance(const Vec &lag) const
  {
    const double along = (cos_ * lag[0] + sin_ * lag[1]) / length_[0];
    const double across = (cos_ * lag[1] - sin_ * lag[0]) / length_[1];
    return std::sqrt(along * along + across * across);
  }

  double length(int axis) const { return length_[axis]; }
  /// Unit vector of an axis of the ellipse.
  Vec direction(int axis) const { return axis == 0 ? Vec{cos_, sin_} : Vec{-sin_, cos_}; }
  /// Half width of the ellipse along x or y [length].
  double half_width(int axis) const;
  /// True if a reflection of the lag in x or y does not change the distance, bit for bit.
  bool is_aligned() const { return sin_ == 0.0 || cos_ == 0.0; }

 private:
  Vec length_;
  double cos_, sin_;
};

struct Covariance {
  std::variant<Exponential, Gaussian, Matern> function;
  Anisotropy anisotropy;

  double operator()(const Vec &lag) const
  {
    const double r = anisotropy.distance(lag);
    return std::visit([r](const auto &f) { return f(r); }, function);
  }
  /// Name such as "exponential", "gaussian" or "matern 1.5".
  std::string name() const;

  /// Throws InputError if the grid is too coarse or too small for the correlation lengths.
  void check(const Grid &grid) const;
};

}    // namespace field
