// SPDX-License-Identifier: GPL-2.0-only
// Stresses in situ: vertical and lateral stresses of ground at rest from weight and loads, and RVEs
// that are brought to these stresses. Without these stresses the ground would not be in equilibrium
// at the start of a run.

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

/// Profile of a quantity over height in level ground. The quantity is constant in each level, and
/// all levels have the same thickness. The vertical stress of a point in the middle of a level is
/// the weight of the levels above and of half its own level. On an MPM grid this stress is in
/// equilibrium, because its nodal forces follow the trapezoidal rule.
class HeightProfile {
 public:
  /// `lowest` is the lower edge of the lowest level [length]. `values` start at the lowest level.
  /// They are positive, or 0 for a level without points, which gets the value of the level below.
  /// Throws InputError unless there are levels, their thickness is positive and the lowest one has
  /// a value.
  HeightProfile(double lowest, double thickness, std::vector<double> values);

  double value(int level) const { return values_[level]; }
  /// Value at a height. The lowest and the highest level extend without limit.
  double at(double height) const { return values_[level_of(height)]; }
  /// Integral from `height` to `upper`, negative if `upper` is below `height`. The integral of a
  /// density is a mass per area.
  double between(double height, double upper) const;
  /// Largest relative change of a value from this profile to another one with the same levels [-].
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
/// get the same means for any number of ranks, because the sums are sums of integers, which do not
/// depend on the order of the terms. Throws InputError if there are more levels than MOST_LEVELS.
constexpr double MOST_LEVELS = 1e7;
HeightProfile level_means(const std::vector<double> &height, const std::vector<double> &value,
                          double thickness, const mpm::Communication &ranks);

/// Stresses of ground at rest under its weight and a surcharge. The vertical stress is
///   sigma_v = -(surcharge + gravity * integral of the density up to the surface)
/// and the normal stress along the other axes is k0 sigma_v. RVEs under more stress are denser, so
/// stress and density are found in several rounds: the caller brings the RVEs to goals() until
/// settles() returns true. Points without RVEs need one round.
class GroundAtRest {
 public:
  struct Points {
    std::vector<double> height, surface;    ///< [length]
    std::vector<double> surcharge;          ///< [stress]
    std::vector<double> k0;    ///< lateral over vertical stress [-]; unused with finds_k0
    /// True if k0 is not given but found: the mean ratio of lateral to vertical stress of the RVEs
    /// in a level, with held lateral strains. It must be the same on all ranks.
    bool finds_k0 = false;
  };

  /// `density` is that of the points [mass/length^3], `thickness` that of a level [length].
  /// `vertical` is 1 in the plane and 2 in space. Every rank must make the same calls.
  GroundAtRest(double gravity, double thickness, int vertical, Points points,
               const std::vector<double> &density, mpm::Communication ranks);

  /// Vertical stress of a point, compression positive [stress].
  double vertical_pressure(std::size_t point) const;
  /// Stress to which the RVE of a point is brought in this round.
  StressGoal goal(std::size_t point) const;
  std::vector<StressGoal> goals() const;
  /// `density` has the densities of the RVEs after this round. Returns true if they are those from
  /// which the goals were computed, within 1e-4. Otherwise the next round uses them. `ratio` has
  /// lateral over vertical stresses; only the round that finds k0 reads it. Throws InputError if
  /// ten rounds do not converge.
  bool settles(const std::vector<double> &density, const std::vector<double> &ratio);

  /// Density from which the goals of this round are computed [mass/length^3].
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

/// Error: an RVE cannot be brought to its stress. The message has the stress that the RVE reached.
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
/// `tolerance` [stress] and the grains are at rest. The errors must be as small after a call with a
/// fixed cell, too. Then strains, times and velocities are set to zero (RvePointsOf::reset()).
///
/// Each RVE has its own number of DEM steps, so its final bits depend neither on other RVEs nor on
/// their order. A time step is at most `dt` [time] and 0.8 of the stability bound. Meanwhile grains
/// have at least the damping of the preparation of packings. Throws InSituError.
template <int D>
InSituReport bring_to_stress(RvePointsOf<D> &points, const std::vector<int> &slots,
                             const std::vector<StressGoal> &goals, double tolerance, double dt);

}    // namespace macro
