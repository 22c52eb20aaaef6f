// SPDX-License-Identifier: GPL-2.0-only
// Stresses in the ground before anything happens: what weight and loads demand at a point, and how RVEs are brought to it.
//
// Why: ground at rest must be in equilibrium with its weight before a foundation or a wall comes, or it sets itself in motion.

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

/// A quantity over height in level ground, constant in levels of equal thickness. With points in the middle of the levels, the weight of the levels
/// above a point and half of its own is what balances its vertical stress on a grid: forces of nodes are those of a sum of trapezia.
class HeightProfile {
 public:
  /// `lowest`: lower edge of the lowest level [length]; `values` from below, above 0, and 0 for a level without points: it has that of the next
  /// one below. Throws InputError unless there are levels, their thickness is positive, and the lowest one has a value.
  HeightProfile(double lowest, double thickness, std::vector<double> values);

  double value(int level) const { return values_[level]; }
  /// Above the highest level its value goes on, and below the lowest.
  double at(double height) const { return values_[level_of(height)]; }
  /// Integral from a height up to another one; of a density the mass between them per area. Negative if that is lower.
  double between(double height, double upper) const;
  /// Largest change of a value to that of another profile with the same levels, over the value [-].
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

/// Means of a positive quantity over the points of each level, from the lowest point up; on all ranks the same, and for any number of them:
/// sums of integers have no order. Throws InputError if there are more levels than MOST_LEVELS.
constexpr double MOST_LEVELS = 1e7;
HeightProfile level_means(const std::vector<double> &height, const std::vector<double> &value,
                          double thickness, const mpm::Communication &ranks);

/// Ground at rest under its weight and a surcharge, the vertical stress
///   sigma_v = -(surcharge + gravity * integral of the density up to the surface)
/// and k0 times it along the other axes. RVEs under more stress are denser, so that stress and density are found in rounds: goals(), bring the
/// RVEs there, settles(), until it says so. What has no RVEs needs no rounds.
class GroundAtRest {
 public:
  struct Points {
    std::vector<double> height, surface;    ///< [length]
    std::vector<double> surcharge;          ///< [stress]
    std::vector<double> k0;    ///< lateral over vertical stress [-]; unused if grains find it
    /// It is what grains find when their sides are held, in the mean of a level; the same on all ranks.
    bool finds_k0 = false;
  };

  /// `density` of the points [mass/length^3], in levels of the thickness [length]. `vertical`: 1 in the plane, 2 in space. Every rank must make
  /// the same calls.
  GroundAtRest(double gravity, double thickness, int vertical, Points points,
               const std::vector<double> &density, mpm::Communication ranks);

  /// Of a point [stress], compression positive.
  double vertical_pressure(std::size_t point) const;
  /// What its RVE shall have in this round.
  StressGoal goal(std::size_t point) const;
  std::vector<StressGoal> goals() const;
  /// Whether these densities, which RVEs have now, are those that the goals rest upon, within 1e-4; takes them for the next round otherwise.
  /// `ratio`, lateral over vertical stress, is looked at in the round that finds k0. Throws InputError if ten rounds do not settle it.
  bool settles(const std::vector<double> &density, const std::vector<double> &ratio);

  /// That the goals rest upon [mass/length^3].
  const HeightProfile &density() const { return density_; }
  /// That grains have found, if they were to.
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

/// What it took.
struct InSituReport {
  std::int64_t most_steps = 0;    ///< DEM steps of an RVE
  double largest_error = 0.0;     ///< of a steered component [stress]

  /// Of another round: steps add up.
  void take(const InSituReport &next)
  {
    most_steps += next.most_steps;
    largest_error = next.largest_error;
  }
};

/// An RVE that cannot be brought to its stress. The message says which stress it has instead.
class InSituError : public std::runtime_error {
 public:
  InSituError(std::size_t place, const std::string &message) :
      std::runtime_error(message), place_(place)
  {
  }
  std::size_t place() const { return place_; }    ///< of the RVE among those given

 private:
  std::size_t place_;
};

/// Leads RVEs to their stresses by servo, until the errors of all steered components are at most `tolerance` [stress] and the grains are at
/// rest, and stay so in a cell that is held. Then all that has happened to them is forgotten: strains, clocks, velocities are zero.
///
/// Each RVE has its own number of DEM steps, so that its bits depend on neither the others nor their order. Steps are at most `dt` [time]
/// and 0.8 of the stability bound; grains that hardly damp get the damping of the preparation of packings for this while. Throws
/// InSituError.
template <int D>
InSituReport bring_to_stress(RvePointsOf<D> &points, const std::vector<int> &slots,
                             const std::vector<StressGoal> &goals, double tolerance, double dt);

}    // namespace macro
