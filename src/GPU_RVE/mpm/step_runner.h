// SPDX-License-Identifier: GPL-2.0-only
// Interface of the solver to the machine that runs its steps.

#pragma once

#include "mpm/step_view.h"
#include "mpm/stress_update.h"

#include <cstdint>
#include <string>
#include <vector>

namespace mpm {

template <int D> struct StepInput {
  const PointView<D> &points;
  const std::vector<PointLoad<D>> &loads;
  int num_loads, num_models;
  const std::vector<Vec<D>> &body_velocity;    ///< [length/time]
  /// Velocities in the previous step; NaN if there was none [length/time].
  const std::vector<Vec<D>> &body_velocity_before;
  std::vector<RigidBodyStep<D>> &rigid;    ///< bodies that can turn; the step updates them
  double dt;                               ///< [time]
};

/// Throws a PointError for the point and the error code in `key` (PointErrorKey).
template <int D>
[[noreturn]] void throw_point_error(const Grid<D> &grid, const PointView<D> &points, int num_bodies,
                                    int num_models, std::uint64_t key);

/// Throws rve::InputError if `terms` terms of magnitude up to `bound` are too large for exact sums.
/// `what` names the quantity of a point in the message.
void check_bound(double bound, std::int64_t terms, const char *what);

template <int D> class StepRunner {
 public:
  virtual ~StepRunner() = default;
  /// Chooses how the ranks exchange sums. Collective, after all ranks have a runner.
  virtual void join_ranks() = 0;

  /// Sets the friction coefficient of a body with frictional contact [-].
  virtual void set_body_friction(int body, double friction) = 0;

  virtual void step(const StepInput<D> &input, StressUpdate<D> &update) = 0;
  virtual void evaluate(const StepInput<D> &input, StressUpdate<D> &update) = 0;
  /// Announces that stresses have changed on the host after the step that began their update.
  virtual void stresses_changed() = 0;

  /// Updates all arrays of the points that only the machine has changed.
  virtual void fetch(const PointView<D> &points) = 0;
  /// Announces that the caller has changed the arrays of the points, so that the machine reads them
  /// again.
  virtual void points_changed() = 0;

  virtual Vec<D> body_reaction(int body) = 0;
  virtual Vec<D> side_reaction(Face side) = 0;
  virtual Vec<D> damping_force() = 0;
  virtual double max_unbalanced_force() = 0;
  virtual Vec<D> node_force(const NodeIndex<D> &place) = 0;
  virtual double node_mass(const NodeIndex<D> &place) = 0;

  /// Number of nodes of the grid that this rank holds.
  virtual int held_nodes() const = 0;

  /// Total wall time of copies from and to a device [seconds].
  virtual double transfer_time() const = 0;
  /// Returns text for the log, e.g. "16 CPU threads".
  virtual std::string description() const = 0;
};

}    // namespace mpm
