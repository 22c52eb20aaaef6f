// SPDX-License-Identifier: GPL-2.0-only
// What the solver sees of the machine that runs its steps.

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
  /// In the step before; not a number: there was none.
  const std::vector<Vec<D>> &body_velocity_before;
  std::vector<RigidBodyStep<D>> &rigid;    ///< bodies that can turn, before the step and after it
  double dt;                               ///< [time]
};

/// Throws a PointError for the point and the trouble of a PointErrorKey key.
template <int D>
[[noreturn]] void throw_point_error(const Grid<D> &grid, const PointView<D> &points, int num_bodies,
                                    int num_models, std::uint64_t key);

/// Throws unless so many terms up to the bound can be summed: `what` of a point is then too large.
void check_bound(double bound, std::int64_t terms, const char *what);

template <int D> class StepRunner {
 public:
  virtual ~StepRunner() = default;
  /// Finds out how the ranks exchange sums. Collective, after all ranks have a runner.
  virtual void join_ranks() = 0;

  /// Coefficient of a body with frictional contact [-].
  virtual void set_body_friction(int body, double friction) = 0;

  virtual void step(const StepInput<D> &input, StressUpdate<D> &update) = 0;
  virtual void evaluate(const StepInput<D> &input, StressUpdate<D> &update) = 0;
  /// The stresses of the host have changed: those that a step had not waited for.
  virtual void stresses_changed() = 0;

  /// Brings all arrays of the points up to date that only the machine has changed.
  virtual void fetch(const PointView<D> &points) = 0;
  /// The arrays of the points have been changed by others: the machine takes them anew.
  virtual void points_changed() = 0;

  virtual Vec<D> body_reaction(int body) = 0;
  virtual Vec<D> side_reaction(Face side) = 0;
  virtual Vec<D> damping_force() = 0;
  virtual double max_unbalanced_force() = 0;
  virtual Vec<D> node_force(const Place<D> &place) = 0;
  virtual double node_mass(const Place<D> &place) = 0;

  /// Of the grid, on this rank.
  virtual int held_nodes() const = 0;

  /// Wall time so far in copies from and to a device [seconds].
  virtual double transfer_time() const = 0;
  /// A line for the log, e.g. "16 CPU threads".
  virtual std::string description() const = 0;
};

}    // namespace mpm
