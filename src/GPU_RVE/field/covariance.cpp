// SPDX-License-Identifier: GPL-2.0-only
#include "field/covariance.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"

namespace field {

using rve::number;
using rve::require;

Matern::Matern(double smoothness) : smoothness_(smoothness)
{
  // For nu above 25 the function differs from the Gaussian function by less than one per cent, and
  // its factors overflow.
  require(smoothness > 0.0 && smoothness <= 25.0,
          "smoothness nu of the Matern covariance must be in (0, 25], got ", smoothness);
  scale_ = std::sqrt(2.0 * smoothness);
  factor_ = std::pow(2.0, 1.0 - smoothness) / std::tgamma(smoothness);
}

double Matern::operator()(double r) const
{
  const double s = scale_ * r;
  // half-integer smoothness has closed forms, which are much faster than a Bessel function
  if (smoothness_ == 0.5) return std::exp(-s);
  if (smoothness_ == 1.5) return (1.0 + s) * std::exp(-s);
  if (smoothness_ == 2.5) return (1.0 + s + s * s / 3.0) * std::exp(-s);
  // The Bessel function underflows for s above 700 and overflows near s = 0. Near s = 0 the
  // covariance is 1 - O(s^2, s^(2 nu)), which rounds to 1 unless nu is very small.
  if (s > 700.0) return 0.0;
  if (s == 0.0) return 1.0;
  const double bessel = std::cyl_bessel_k(smoothness_, s);
  if (!std::isfinite(bessel)) return 1.0;
  return factor_ * std::pow(s, smoothness_) * bessel;
}

Anisotropy::Anisotropy(const Vec &length, double angle) : length_(length)
{
  for (int a = 0; a < AXES; ++a)
    require(length[a] > 0.0 && std::isfinite(length[a]), a == 0 ? "horizontal" : "vertical",
            " correlation length must be positive, got ", length[a]);
  require(std::fabs(angle) <= 360.0, "angle must be from -360 to 360 [degrees], got ", angle);
  // an ellipse is unchanged by half a turn, a circle by any rotation
  const double turned = length[0] == length[1] ? 0.0 : std::remainder(angle, 180.0);
  const double radians = turned * (rve::kPi / 180.0);
  cos_ = std::fabs(turned) == 90.0 ? 0.0 : std::cos(radians);
  sin_ = std::sin(radians);
}

double Anisotropy::half_width(int axis) const
{
  return std::hypot(length_[0] * direction(0)[axis], length_[1] * direction(1)[axis]);
}

std::string Covariance::name() const
{
  struct Name {
    std::string operator()(const Exponential &) const { return "exponential"; }
    std::string operator()(const Gaussian &) const { return "gaussian"; }
    std::string operator()(const Matern &f) const { return "matern " + number(f.smoothness()); }
  };
  return std::visit(Name{}, function);
}

void Covariance::check(const Grid &grid) const
{
  for (int axis = 0; axis < AXES; ++axis) {
    const std::string which = axis == 0 ? "horizontal" : "vertical";
    const Vec direction = anisotropy.direction(axis);
    const double length = anisotropy.length(axis);
    double spacing = 0.0, width = 0.0;
    for (int a = 0; a < AXES; ++a) {
      spacing = std::hypot(spacing, direction[a] * grid.spacing[a]);    // squares may overflow
      width += std::fabs(direction[a]) * grid.extent(a);
    }
    // equal lengths are allowed: the tolerances cover their rounding errors
    require(length >= spacing * (1.0 - 1e-9), which, " correlation length ", length,
            " is below the grid spacing, ", spacing, " in its direction");
    require(length <= width * (1.0 + 1e-9), which, " correlation length ", length,
            " is above the extent of the domain, ", width,
            " in its direction: use a larger domain");
  }
}

}    // namespace field
