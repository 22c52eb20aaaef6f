// SPDX-License-Identifier: GPL-2.0-only
// Stresses in situ: vertical and lateral stresses of ground at rest from weight and loads, and RVEs
// that are brought to these stresses. Without them the ground would not be in equilibrium at the
// start of a run.

#pragma once

#include "macro/rve_points.h"
#include "macro/way_to_stress.h"
#include "mpm/solver_options.h"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace macro {

/// Profile over height of a quantity in level ground, constant in levels of equal thickness. With
/// points in the middle of levels, the weight of the levels above a point and half of its own level
/// balance its vertical stress on a grid, where forces of nodes are those of the trapezoidal rule.
class HeightProfile {
 public:
  /// `lowest` is the lower edge of the lowest level [length]. `values` are positive and start at
  /// the lowest level; a level with the value 0 (no points) has that of the level below. Throws
  /// InputError unless there are levels, their thickness is positive and the lowest one has a
  /// value.
  HeightProfile(double lowest, double thickness, std::vector<double> values);

  double value(int level) const { return values_[level]; }
  /// Value at a height. The lowest and the highest level extend without limit.
  double at(double height) const { return values_[level_of(height)]; }
  /// Integral from `height` to `upper`, negative if `upper` is lower. For a density: mass per area.
  double between(double height, double upper) const;
  /// Largest relative change of a value to that of another profile with the same levels [-].
  double change_to(const HeightProfile &other) const;
  double least() const;
  double most() const;

 private:
  double lowest_, thickness_;
  std::vector<double> values_;
  std::vector<double> below_;    ///< integral below each edge

  std::size_t level_of(double height) const;
  double integral_below(double height) const;
};

/// Means of a positive quantity over the points of each level, from the lowest point up. All ranks
/// get the same means for any number of ranks, because sums of integers do not depend on their
/// order. Throws InputError if there are more levels than MOST_LEVELS.
constexpr double MOST_LEVELS = 1e7;
HeightProfile level_means(const std::vector<double> &height, const std::vector<double> &value,
                          double thickness, const mpm::Communication &ranks);

/// Ground at rest under its weight and a surcharge, the vertical stress
///   sigma_v = -(surcharge + gravity * integral of the density up to the surface)
/// and k0 times it along the other axes. RVEs under more stress are denser, so stress and density
/// need several rounds: the caller brings the RVEs to goals() until settles() returns true. Points
/// without RVEs need one round.
class GroundAtRest {
 public:
  struct Points {
    std::vector<double> height, surface;    ///< [length]
    std::vector<double> surcharge;          ///< [stress]
    std::vector<double> k0;    ///< lateral over vertical stress [-]; unused with finds_k0
    /// True if k0 is the mean ratio in a level of RVEs with held lateral strains; the same on all
    /// ranks.
    bool finds_k0 = false;
  };

  /// `density` is that of the points [mass/length^3], `thickness` that of a level [length].
  /// `vertical` is 1 in the plane and 2 in space. Every rank must make the same calls.
  GroundAtRest(double gravity, double thickness, int vertical, Points points,
               const std::vector<double> &density, mpm::Communication ranks);

  /// Vertical stress of a point, compression positive [stress].
  double vertical_pressure(std::size_t point) const;
  /// Stress of the RVE of a point in this round.
  StressGoal goal(std::size_t point) const;
  std::vector<StressGoal> goals() const;
  /// Returns true if the goals were computed with these densities of the RVEs, within 1e-4.
  /// Otherwise the next round uses them. `ratio` is lateral over vertical stress; the round that
  /// finds k0 reads it. Throws InputError if ten rounds do not converge.
  bool settles(const std::vector<double> &density, const std::vector<double> &ratio);

  /// Density from which the goals follow [mass/length^3].
  const HeightProfile &density() const { return density_; }
  /// k0 of the RVEs with held lateral strains; empty without finds_k0 or before the first round.
  const std::optional<HeightProfile> &found_k0() const { return k0_; }
  int rounds() const { return rounds_; }

 private:
  double gravity_, thickness_;
  int vertical_;
  Points points_;
  mpm::Communication ranks_;
  HeightProfile density_;
  std::optional<HeightProfile> k0_;
  int rounds_ = 1;
};

/// Effort and error of bring_to_stress().
struct InSituReport {
  std::int64_t most_steps = 0;    ///< most DEM steps of an RVE
  double largest_error = 0.0;     ///< largest error of a steered component [stress]

  /// Adds the steps of another round and takes its error.
  void take(const InSituReport &next)
  {
    most_steps += next.most_steps;
    largest_error = next.largest_error;
  }
};

/// Error: an RVE cannot be brought to its stress. The message has the stress that it reached.
class InSituError : public std::runtime_error {
 public:
  InSituError(std::size_t index, const std::string &message) :
      std::runtime_error(message), place_(index)
  {
  }
  std::size_t index() const { return place_; }    ///< index of the RVE in the call

 private:
  std::size_t place_;
};

/// Brings RVEs to their stresses by servos, until the errors of all steered components are at most
/// `tolerance` [stress] and the grains are at rest, also in a held cell. Then strains, times and
/// velocities are set to zero (RvePointsOf::reset()).
///
/// Each RVE has its own number of DEM steps, so its bits depend neither on other RVEs nor on their
/// order. A time step is at most `dt` [time] and 0.8 of the stability bound. Meanwhile grains have
/// at least the damping of the preparation of packings. Throws InSituError.
template <int D>
InSituReport bring_to_stress(RvePointsOf<D> &points, const std::vector<int> &slots,
                             const std::vector<StressGoal> &goals, double tolerance, double dt);

}    // namespace macro
