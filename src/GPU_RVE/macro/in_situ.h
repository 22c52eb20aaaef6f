// SPDX-License-Identifier: GPL-2.0-only
// Stresses in situ. This file finds the vertical and lateral stresses of ground at rest under
// weight and loads, and brings RVEs to these stresses. Without this preparation the ground would
// not be in equilibrium at the start of a run.

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
/// all levels have the same thickness. The vertical stress in the middle of a level is the weight
/// per area of the levels above and of half this level. On an MPM grid this stress is in
/// equilibrium, because the nodal forces follow the trapezoidal rule.
class HeightProfile {
 public:
  /// `lowest` is the lower edge of the lowest level [length]. `values` start at the lowest level. A
  /// value is positive, or 0 if its level has no points. Such a level gets the value of the level
  /// below. Throws InputError unless there are levels, their thickness is positive and the lowest
  /// one has a value.
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

/// Returns the means of a positive quantity over the points of each level. The lowest point is in
/// the middle of the lowest level. All ranks get the same means, for any number of ranks: the sums
/// are integers and do not depend on the order of the terms. Throws InputError if there are more
/// levels than MOST_LEVELS.
constexpr double MOST_LEVELS = 1e7;
HeightProfile level_means(const std::vector<double> &height, const std::vector<double> &value,
                          double thickness, const mpm::Communication &ranks);

/// Stresses of ground at rest under its weight and a surcharge. The vertical stress is
///   sigma_v = -(surcharge + gravity * integral of the density up to the surface)
/// and the normal stress along the other axes is k0 sigma_v. With pore water this is the total
/// stress. The RVEs get the effective stress: the vertical one is sigma_v plus the pore pressure,
/// and k0 is a ratio of effective stresses. The stress follows from the density,
/// but RVEs under more stress are denser, so both are found in several rounds. In each round the
/// caller brings the RVEs to goals() and calls settles(). The last round is the one in which
/// settles() returns true. Points without RVEs need one round.
class GroundAtRest {
 public:
  struct Points {
    std::vector<double> height, surface;    ///< [length]
    std::vector<double> surcharge;          ///< [stress]
    std::vector<double> pore_pressure{};    ///< [stress]; empty without water
    std::vector<double> k0;    ///< ratio of lateral to vertical stress [-]; unused with finds_k0
    /// True if k0 is not given. The first round then holds the lateral strains of the RVEs and
    /// finds k0 for each level: the mean ratio of lateral to vertical stress of the RVEs in the
    /// level. All ranks must set the same value.
    bool finds_k0 = false;
  };

  /// `density` has the densities of the points [mass/length^3]. `thickness` is the thickness of a
  /// level [length]. `vertical` is the index of the vertical axis: 1 in the plane and 2 in space.
  /// Every rank must make the same calls.
  GroundAtRest(double gravity, double thickness, int vertical, Points points,
               const std::vector<double> &density, mpm::Communication ranks);

  /// Effective vertical stress of a point, compression positive [stress].
  double vertical_pressure(std::size_t point) const;
  /// Effective stress to which the caller brings the RVE of a point in this round.
  StressGoal goal(std::size_t point) const;
  std::vector<StressGoal> goals() const;
  /// Ends a round. `density` has the densities of the RVEs after the round. Returns true if the
  /// mean density of each level is within 1e-4 (relative) of the density from which the goals were
  /// computed. Otherwise the next round uses the new densities. `ratio` has the ratios of lateral
  /// to vertical stress of the RVEs. It is read only in the round that finds k0, and this round
  /// returns false. Throws InputError if ten rounds do not converge.
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

  /// Adds the steps of the next round and takes over its error.
  void take(const InSituReport &next)
  {
    most_steps += next.most_steps;
    largest_error = next.largest_error;
  }
};

/// Error: the goal or the tolerance of an RVE is not admissible, or the RVE does not reach its
/// stress. In the latter case the message has the stress that the RVE reached.
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
/// `tolerance` [stress] and the grains are at rest. The errors must still be at most `tolerance`
/// after one more call of the engine with a fixed cell. Then strains, times and velocities are set
/// to zero (RvePointsOf::reset()).
///
/// Each RVE has its own number of DEM steps, so its final bits depend neither on other RVEs nor on
/// their order. A time step is at most `dt` [time] and 0.8 of the stability bound. During these
/// steps the local damping of the grains is at least that of the preparation of packings. Throws
/// InSituError.
template <int D>
InSituReport bring_to_stress(RvePointsOf<D> &points, const std::vector<int> &slots,
                             const std::vector<StressGoal> &goals, double tolerance, double dt);

}    // namespace macro
