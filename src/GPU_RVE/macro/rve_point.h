// SPDX-License-Identifier: GPL-2.0-only
// The RVE of one point: its last results, its deferred increment and its options.

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
  bool stale = false;                     ///< only stress and status of `result` are current
  std::int32_t contacts = 0;              ///< number of contacts after the last DEM steps
  double peak_force = 0.0;                ///< largest contact force of the last DEM steps [force]
  rve::StiffeningLimit limit;             ///< the time-step bound is checked again beyond it
  double grain_size = 0.0;                ///< rve::grain_size() [length]
  Matrix pending = Matrix::identity();    ///< deformation since the last DEM step
  rve::Material material;
  /// Result of the last advance that succeeded, with the status of the last advance.
  rve::ResultOf<D> result;

  double servo_gain = 0.0;    ///< default gain of the stress servo [1/(stress time^2)]
  /// Difference between the stress and its goal at the last call of advice_on_servo() [stress]. It
  /// is 0 if the servo did not strain at its largest rate then.
  double out_of_reach = 0.0;
  /// Terms of the energy balance at the start of the run; empty if the RVE was not on this rank
  /// then.
  std::optional<rve::EnergyTerms> energy_at_start;
  /// Drive of the last DEM steps. Its number of substeps is 0 if there were none so far. Its
  /// pointer to servo modes is null, since the load path owns the modes; `num_modes` is kept.
  rve::DriveOf<D> drive;
  double servo_error = 0.0;    ///< largest stress error of the servo after these steps [stress]
  PathState<D> path;

  std::int32_t copies = 1;      ///< number of copies of the initial grains, side by side
  std::int32_t renewals = 0;    ///< number of times that a fresh RVE replaced this one

  rve::ResultOf<D> rested;    ///< result of the last DEM step, while the RVE is quiescent

  /// Diagnostic evaluation at the end of the last DEM steps. It is made if the strain of these
  /// steps was so small that the RVE can be skipped in the next macro step.
  struct Evaluation {
    bool is_at_rest;
    double mean_overlap;    ///< mean over contacts of overlap / sum of radii [-]
    /// Records do not contain the stiffness. After the RVE was read from a record, the stiffness is
    /// empty until it is needed and computed from the configuration.
    std::optional<rve::AffineStiffnessOf<D>> stiffness;

    static Evaluation of(const rve::ElasticResultOf<D> &evaluated)
    {
      return {evaluated.result.unbalanced_ratio <= rve::QUIET_UNBALANCED_RATIO,
              evaluated.result.mean_overlap, evaluated.stiffness};
    }
    /// False if the stiffness is needed and empty.
    bool is_whole() const { return !is_at_rest || stiffness; }
  };
  std::optional<Evaluation> evaluation;

  int shadow = -1;                          ///< number in the engine of shadows; -1: no shadow
  Matrix shadow_stress = Matrix::zero();    ///< [stress]

  bool is_quiescent() const { return state == State::Quiescent; }
  bool frozen() const { return state == State::Frozen; }
  /// Result of the last DEM steps.
  const rve::ResultOf<D> &last_steps() const { return is_quiescent() ? rested : result; }
  /// Mean over contacts of overlap / sum of radii after the last DEM steps [-].
  double mean_overlap() const
  {
    return evaluation ? evaluation->mean_overlap : last_steps().mean_overlap;
  }
  /// Norm of the rate of deformation |D| during the last DEM steps, in DEM time [1/time].
  double strain_rate() const;
  /// Sets the result of a new RVE, and derives the grain size, number of contacts and peak force
  /// from it.
  void begin_with(const rve::ResultOf<D> &first);
  /// Stores the response to a drive. Precondition: the RVE has not failed.
  void store(const rve::ResponseOf<D> &response, const rve::DriveOf<D> &last);
  /// Makes the RVE quiescent with this pending deformation. Stress, fabric, cell, deformation and
  /// void ratio follow the pending deformation. The other results stay as after the last DEM step.
  void defer(const rve::QuiescentStateOf<D> &quiescence);
  /// Sets the results that follow from `rested` and the pending deformation, except the stress.
  void follow_pending();
  /// Data from which the stress follows while the RVE is quiescent. Precondition: the RVE is
  /// quiescent or has been evaluated.
  rve::QuiescentStateOf<D> quiescence() const;
  rve::Rest rest() const;
  CachedPoint<D> cached_copy() const;
  /// Rate of deformation D in the present axes; zero before the first DEM steps [1/time].
  Matrix rate_of_deformation() const;
  /// Completes the result of the last DEM steps from an evaluation of the same configuration.
  /// Stress and status do not change, because the stress can be a mean over samples.
  void take_details(const rve::ResultOf<D> &details);
  /// Ratio of |stress - shadow_stress| to the larger norm of both stresses [-].
  double shadow_deviation() const;
};

}    // namespace macro
