// SPDX-License-Identifier: GPL-2.0-only
// The material point method: one time step, from points to the grid and back.
//
// Knows nothing of LAMMPS, MPI, CUDA or grains. Points belong to the caller; sums on the nodes of the grid are integers, and over all
// ranks where several need them, so that results have the same bits for any number of ranks and threads and any order of the points.
// A rank holds the part of the grid around its points (shared_nodes.h).
// Every rank must make the same calls, questions for nodes, reactions and totals included: a call may communicate through the
// functions in Communication.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/points.h"
#include "mpm/rigid_bodies.h"
#include "mpm/solver_options.h"
#include "mpm/step_runner.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace mpm {

/// Sums over the deformable points of all ranks.
template <int D> struct Totals {
  std::int64_t points;
  double mass;              ///< [mass]
  Vec<D> momentum;          ///< [mass length/time]
  double kinetic_energy;    ///< [energy]
};

template <int D> class MpmSolver {
 public:
  /// rve::InputError on wrong options; on Device::Cuda without a device, and on any missing device when the environment has
  /// GPU_RVE_REQUIRE_CUDA (cuda/cuda_required.h). `notice`, if given, receives the reason when Device::Auto falls back to the CPU.
  explicit MpmSolver(const SolverOptions<D> &options, Communication communication = {},
                     std::string *notice = nullptr);

  /// The constitutive models that PointView::model refers to. Not owned; they must outlive the solver's calls.
  void set_models(std::vector<Constitutive<D> *> models) { stresses_.set_laws(std::move(models)); }

  /// Prescribes the velocity [length/time] of a rigid body from the next call on.
  void set_body_velocity(int body, const Vec<D> &velocity);
  /// Coefficient of a body with frictional contact from the next step on, above zero [-].
  void set_body_friction(int body, double friction);
  /// The velocity [length/time] that a body had in the last step, of a run that is continued; not a number if there was none.
  void set_body_velocity_before(int body, const Vec<D> &velocity)
  {
    body_velocity_before_.at(body) = velocity;
  }
  const Vec<D> &body_velocity_before(int body) const { return body_velocity_before_.at(body); }

  /// Those that can turn. Their rates are prescribed there.
  RigidBodies<D> &rigid_bodies() { return rigid_; }

  /// Advances all points by `dt` [time]: positions, velocities, F, volumes, stresses, L.
  ///
  /// The cycle: (1) mass, momentum to the grid; [Usavg: half of the strain]; (2) forces
  /// f_I = - Σ V σ·∇N + Σ f N + traction; (3) conditions, p += f dt, conditions, damping; (4) x += dt Σ N v,
  /// v = flip (v + Σ N Δv) + (1 - flip) Σ N v; (5) momentum to the grid again, conditions,
  /// L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F, stresses.
  /// One set of weights, that of the position at the start, serves the whole step.
  /// Rigid points move with their body and have no part in the sums.
  ///
  /// rve::InputError if dt <= 0 or a load or index is wrong; PointError if a point is outside of the grid before
  /// or after the step, inverted, or has a quantity that is not finite.
  void step(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads, double dt);

  /// Nodal forces, unbalanced force and reactions of the current state as step() would find them; nothing is advanced.
  void evaluate(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads, double dt);

  /// dt max_p (c_p + |v_p|) / h with c = sqrt(M/ρ), M from the constitutive model and ρ = m/V. Above 1 the step is unstable;
  /// nonlinear materials want 0.5. The speeds of dashpots of the sides count as well.
  double cfl_number(const PointView<D> &points, double dt) const;

  /// Force of the material on a rigid body in the last step or evaluation [force].
  Vec<D> body_reaction(int body) const;
  /// Its torque about the origin of a body that can turn; in the plane the first component [force length].
  Vec<rve::Space<D>::spins> body_torque(int body) const;
  /// Force of the material on a side of the grid [force].
  Vec<D> side_reaction(Face side) const { return runner_->side_reaction(side); }
  /// Sum of what local damping did to the nodes in the last step or evaluation [force]: what reactions and other forces lack of the
  /// change of the points' momentum.
  Vec<D> damping_force() const { return runner_->damping_force(); }
  /// Largest |component| of internal plus external nodal force where the velocity is not prescribed [force].
  double max_unbalanced_force() const { return runner_->max_unbalanced_force(); }

  Totals<D> totals(const PointView<D> &points) const;

  const Grid<D> &grid() const { return grid_; }
  /// Internal plus external force on a node in the last step or evaluation [force].
  Vec<D> node_force(const Place<D> &place) const { return runner_->node_force(place); }
  double node_mass(const Place<D> &place) const { return runner_->node_mass(place); }
  /// Nodes of the grid that this rank has memory for and passes over: those around its points in the last step or evaluation.
  int held_nodes() const { return runner_->held_nodes(); }

  /// With a device, a step leaves deformation gradients, volumes and velocity gradients there: this brings those arrays up to date.
  void fetch(const PointView<D> &points) const
  {
    settle();
    runner_->fetch(points);
  }
  /// A step does not wait for stresses that a device computes. The next one does, and whoever reads those of the points calls this before:
  /// with fetch() they are up to date, too. Of this rank alone.
  void settle() const;
  /// The arrays, which must be up to date, have been or will be changed before the next call. Positions, velocities and body
  /// forces may change without being announced; so may models and rigid bodies.
  void points_changed() { runner_->points_changed(); }

  /// Wall time so far in copies from and to a device [seconds].
  double transfer_time() const { return runner_->transfer_time(); }
  /// Wall time that the k-th constitutive model has taken so far [seconds].
  double model_time(int k) const { return stresses_.time(k); }

  /// What advances the points: a line for the log.
  std::string description() const { return runner_->description(); }

 private:
  StepInput<D> input(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads,
                     double dt);
  void check_points(const PointView<D> &points) const;

  SolverOptions<D> options_;
  Communication communication_;
  Grid<D> grid_;
  std::unique_ptr<StepRunner<D>> runner_;
  mutable StressUpdate<D> stresses_;
  std::vector<Vec<D>> body_velocity_, body_velocity_before_;
  RigidBodies<D> rigid_;
  double last_dt_ = 0.0;    ///< of the last step or evaluation
  std::vector<PointLoad<D>> loads_;
};

}    // namespace mpm
