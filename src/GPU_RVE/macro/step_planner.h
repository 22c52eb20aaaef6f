// SPDX-License-Identifier: GPL-2.0-only
// Plans the macro step of an RVE from its cached copy: the number of DEM steps, and whether the RVE
// is skipped, or turned rigidly before the steps.

#pragma once

#include "macro/macro_step_options.h"
#include "macro/rve_point.h"
#include "rve/engine/quiescence.h"

namespace macro {

enum class Action : char {
  None,                 ///< the RVE is frozen
  Skip,                 ///< the increment is deferred
  Advance,              ///< DEM steps
  AdvanceAndEvaluate    ///< DEM steps, and then a check whether the RVE is at rest
};

inline bool advances(Action action)
{
  return action == Action::Advance || action == Action::AdvanceAndEvaluate;
}

/// Plans macro steps from options and points, which must outlive the planner. Several threads may
/// call the functions for different slots.
template <int D> class StepPlanner {
  using Matrix = rve::Tensor<double, D>;

 public:
  StepPlanner(const MacroStepOptions &options, const PointTable<D, PointOf<D>> &points) :
      options_(options), points_(points)
  {
  }

  /// Action of an RVE that is not frozen, for a drive.
  Action action(int slot, const rve::DriveOf<D> &drive) const;
  /// Action of an RVE that is not frozen, for an increment. The RVE is skipped if two conditions
  /// hold: the strain since its last DEM steps is below the quiescent strain, and an evaluation
  /// after these steps found the RVE at rest.
  Action action(int slot, const Matrix &increment, double dt, int substeps) const;

  /// Number of DEM steps of a drive: `drive.substeps`, or the adaptive number for its strain.
  int substeps(int slot, const rve::DriveOf<D> &drive) const;
  /// Adaptive number of DEM steps of an increment with this rve::strain_size().
  int substeps(int slot, double strain, double dt) const;

  /// True if the rotation of the increment in this number of DEM steps makes contacts slip. The
  /// overlap of contacts is estimated from the mean stress, which is known after every advance.
  bool slips(int slot, const Matrix &increment, double dt, int substeps) const;
  /// True if the RVE must be turned rigidly before this increment. `increment` includes the
  /// deferred increment.
  bool needs_turn(int slot, const Matrix &increment, double dt, int substeps) const;

 private:
  const MacroStepOptions &options_;
  const PointTable<D, PointOf<D>> &points_;
};

}    // namespace macro
