// SPDX-License-Identifier: GPL-2.0-only
// The RVE of one point as macro steps see it: its last results, what it has to do yet, and its options.

#pragma once

#include "macro/load_path.h"
#include "macro/point_table.h"
#include "rve/engine/advice.h"
#include "rve/engine/affine_stiffness.h"

#include <cstdint>
#include <optional>

namespace macro {

template <int D> struct PointOf {
  using Matrix = rve::Tensor<double, D>;
  using State = PointState;

  PointState state = PointState::Empty;
  bool stale = false;            ///< `result` is of an earlier advance, but for stress and status
  std::int32_t contacts = 0;     ///< after its last DEM steps
  double peak_force = 0.0;       ///< largest contact force of its last DEM steps [force]
  rve::StiffeningLimit limit;    ///< beyond which its time-step bound is checked again
  double grain_size = 0.0;       ///< rve::grain_size [length]
  Matrix pending = Matrix::identity();    ///< deformation since its last DEM step
  rve::Material material;
  /// Of the last advance that succeeded; its status is that of the last advance.
  rve::ResultOf<D> result;

  double servo_gain = 0.0;      ///< default of its stress servo [1/(stress time^2)]
  double out_of_reach = 0.0;    ///< stress that its servo lacked when last asked [stress]
  /// Terms of its energy balance when a run began, if it began here.
  std::optional<rve::EnergyTerms> energy_at_start;
  /// Of its last DEM steps, without modes; none so far if it has no substeps.
  rve::DriveOf<D> drive;
  double servo_error = 0.0;    ///< after them [stress]
  PathState<D> path;

  std::int32_t copies = 1;      ///< of the grains that it began with, side by side
  std::int32_t renewals = 0;    ///< how often a fresh RVE took its place

  rve::ResultOf<D> rested;    ///< while asleep: of its last DEM step

  /// At the end of its last DEM steps, if their strain was so small that the RVE may sleep when the next one is, too. The same whatever the
  /// advance was asked for.
  struct Evaluation {
    bool is_at_rest;
    double mean_overlap;    ///< [-]
    /// Not known of one that came with a record, until it is wanted: it is that of the configuration.
    std::optional<rve::AffineStiffnessOf<D>> stiffness;

    static Evaluation of(const rve::ElasticResultOf<D> &evaluated)
    {
      return {evaluated.result.unbalanced_ratio <= rve::QUIET_UNBALANCED_RATIO,
              evaluated.result.mean_overlap, evaluated.stiffness};
    }
    bool is_whole() const { return !is_at_rest || stiffness; }
  };
  std::optional<Evaluation> evaluation;

  int shadow = -1;                          ///< number of its shadow in the engine of shadows
  Matrix shadow_stress = Matrix::zero();    ///< [stress]

  bool asleep() const { return state == State::Asleep; }
  bool frozen() const { return state == State::Frozen; }
  const rve::ResultOf<D> &last_steps() const { return asleep() ? rested : result; }
  /// Over contacts, overlap / sum of radii, after its last DEM steps [-].
  double mean_overlap() const
  {
    return evaluation ? evaluation->mean_overlap : last_steps().mean_overlap;
  }
  /// |D| in the RVE's own time, of its last DEM steps [1/time]
  double strain_rate() const;
  /// Its last DEM steps were these, and `result` has their stress.
  void note(const rve::DriveOf<D> &last);
  /// Sets the result of an RVE before its first DEM steps, and what follows from it.
  void begin_with(const rve::ResultOf<D> &first);
  /// A sound answer to this drive.
  void store(const rve::ResponseOf<D> &response, const rve::DriveOf<D> &last);
  /// It sleeps, or sleeps on: cell, deformation and void ratio follow. The rest is that of the last DEM step.
  void defer(const rve::SleepOf<D> &sleep);
  /// What follows the pending deformation, from `rested`; but its stress.
  void follow_pending();
  /// Of one that sleeps, or has been looked at.
  rve::SleepOf<D> quiescence() const;
  rve::Rest rest() const;
  CachedPoint<D> cached_copy() const;
  /// D itself, in the axes of the present; zero before its first steps [1/time]
  Matrix rate_of_deformation() const;
  /// What its configuration says, which is that of its last steps. Their stress may be a mean, and their status stays.
  void take_details(const rve::ResultOf<D> &details);
  /// |stress - stress of the shadow| over the larger of both [-]
  double shadow_deviation() const;
};

}    // namespace macro
