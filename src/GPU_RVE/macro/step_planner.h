// SPDX-License-Identifier: GPL-2.0-only
// What an RVE does in a macro step, decided from its cached state: DEM steps and how many, a rigid
// turn before them, or nothing.

#pragma once

#include "macro/macro_step_options.h"
#include "macro/rve_point.h"
#include "rve/engine/sleep.h"

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

/// Functions of the options and of the points, which both outlive it. Different threads may call them
/// for different slots.
template <int D> class StepPlanner {
  using Matrix = rve::Tensor<double, D>;

 public:
  StepPlanner(const MacroStepOptions &options, const PointTable<D, PointOf<D>> &points) :
      options_(options), points_(points)
  {
  }

  /// Action of an RVE that is not frozen, under a drive.
  Action action(int slot, const rve::DriveOf<D> &drive) const;
  /// The same under an increment. An RVE is skipped if the strain since its last DEM steps is below the
  /// quiescent strain and it was found at rest at their end.
  Action action(int slot, const Matrix &increment, double dt, int substeps) const;

  /// DEM steps of a drive: its own number, or one that follows from its strain.
  int substeps(int slot, const rve::DriveOf<D> &drive) const;
  /// Adaptive DEM steps of an increment with this rve::strain_size().
  int substeps(int slot, double strain, double dt) const;

  /// True if the rotation of an increment would let contacts slip in so few DEM steps. The overlap is
  /// that of the mean stress, which is known after every advance.
  bool slips(int slot, const Matrix &increment, double dt, int substeps) const;
  /// True if the RVE must be turned rigidly before this increment, which includes what was deferred.
  bool needs_turn(int slot, const Matrix &increment, double dt, int substeps) const;

 private:
  const MacroStepOptions &options_;
  const PointTable<D, PointOf<D>> &points_;
};

}    // namespace macro
