// SPDX-License-Identifier: GPL-2.0-only
// Sizes of grains: grading curves and distributions, the grains that represent them, and the
// grading of given grains.

#pragma once

#include "rve/engine/packing.h"

#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace rve {

/// Point of a grading curve: `percent` of the mass is in grains with smaller diameters.
struct GradingPoint {
  double diameter;    ///< [length]
  double percent;     ///< percent passing by mass, 0 to 100
};

/// Grading curve. Between two points the percentage is a linear function of the logarithm of the
/// diameter, as in the diagrams of laboratories. If the first percentage is above 0, the fines
/// below the first diameter are cut off, and the curve above it is scaled to 0 to 100 %. Two points
/// of the same percentage are a gap without grains.
using GradingCurve = std::vector<GradingPoint>;

/// Lognormal distribution of radii by number, between two limits. `median` [length] and `sigma`,
/// the standard deviation of the logarithm [-], are those of the distribution without limits.
struct LognormalRadii {
  double median, sigma, smallest, largest;
};

/// Power law of radii by number: the number of grains per radius is proportional to
/// radius^-exponent between two limits [length].
struct PowerLawRadii {
  double exponent, smallest, largest;
};

/// Distribution of grain sizes that a recipe asks for.
using SizeChoice = std::variant<GradingCurve, LognormalRadii, PowerLawRadii>;

/// Distribution of the diameters of disks (dimension 2) or spheres (dimension 3) of one density and
/// thickness. Shares are from 0 to 1. The mass of a grain is proportional to diameter^dimension.
class SizeDistribution {
 public:
  /// Throws InputError if a number is out of range.
  SizeDistribution(const SizeChoice &choice, int dimension);

  double smallest() const { return least; }
  double largest() const { return most; }
  /// Returns the share of the grains, and that of their mass, below a diameter.
  double number_below(double diameter) const { return number(inside(diameter)); }
  double mass_below(double diameter) const { return mass(inside(diameter)); }
  /// Returns the diameter below which this share of the mass is [length].
  double diameter_at_mass(double share) const;
  /// Returns the mean of diameter^dimension over the grains.
  double mean_power() const { return mean; }

  /// Share of the mass that a curve cuts off below its first diameter.
  double cut_share() const { return cut; }

  /// Returns the radii of n grains, ascending [length]. Grain k represents the k-th n-th of the
  /// number of grains, and its mass is their mean mass. So the curve of the grains differs from the
  /// given one at any diameter by less than the mass of one grain, and the total mass is exact.
  /// Nothing is random. Radii are rounded to single precision, so that they do not depend on the
  /// last digits of the mathematical library. Throws InputError if n is not positive.
  std::vector<double> radii(int n) const;

  /// Returns the number of grains that represent the distribution: at least FEWEST_COARSE grains
  /// have the coarsest tenth of the mass, and a dense packing is at least WIDTH_OF_CELL of the
  /// largest diameters wide.
  int grains_needed() const;
  static constexpr int FEWEST_COARSE = 5;
  static constexpr double WIDTH_OF_CELL = 2.5;

 private:
  int dimension;
  double least = 0.0, most = 0.0, mean = 0.0, cut = 0.0;
  std::function<double(double)> number, mass;

  void set(const GradingCurve &curve);
  void set(const LognormalRadii &radii);
  void set(const PowerLawRadii &radii);
  double inside(double diameter) const;
  double quantile(const std::function<double(double)> &share_below, double share) const;
};

/// Diameters of grains by mass [length].
struct Grading {
  double d10, d50, d60;
  double uniformity() const { return d60 / d10; }    ///< coefficient of uniformity [-]
};

/// Returns the smallest diameter of these disks (dimension 2) or spheres (dimension 3) for which
/// the grains up to this diameter have at least `percent` of the mass of all [length]. Throws
/// InputError if `percent` is not from 0 to 100, or if there are no grains.
double diameter_passing(std::vector<double> radii, int dimension, double percent);
Grading grading_of(const std::vector<double> &radii, int dimension);

/// Sizes of the grains of a recipe, for messages.
struct SizeReport {
  int grains, needed;
  int coarse;                  ///< number of grains in the coarsest tenth of the mass, rounded
  double smallest, largest;    ///< diameters of the grains [length]
  double cut_diameter, cut_percent;    ///< fines that the curve cuts off
};

/// Sets the radii of `recipe.num_grains` grains of a recipe for disks or spheres. Throws InputError
/// if the distribution is wrong, or if the ratio of largest to smallest radius is too large for the
/// engine.
template <int D> SizeReport set_sizes(PackingRecipe &recipe, const SizeChoice &choice);

}    // namespace rve
