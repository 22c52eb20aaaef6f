// SPDX-License-Identifier: GPL-2.0-only
// Solver of the material point method. In each time step it maps the points to the grid, solves the
// balance of momentum on the grid, and maps the motion of the grid back to the points.
//
// This interface does not depend on LAMMPS, MPI, CUDA or grains. Points belong to the caller. Sums
// on nodes of the grid are integers and include the points of all ranks. Results therefore have the
// same bits for any number of ranks and threads and any order of the points. A rank holds the part
// of the grid around its points (shared_nodes.h). Calls may communicate through the functions in
// Communication. All ranks must therefore make the same calls, including the calls for nodes,
// reactions and totals.

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
  /// Throws rve::InputError for wrong options, for Device::Cuda without a device, and for
  /// Device::Auto without a device if GPU_RVE_REQUIRE_CUDA is true (cuda/cuda_required.h).
  /// `notice`, if given, receives the reason if Device::Auto falls back to the CPU in a build with
  /// CUDA. Collective.
  explicit MpmSolver(const SolverOptions<D> &options, Communication communication = {},
                     std::string *notice = nullptr);

  /// Sets the constitutive models to which PointView::model refers. They are not owned and must
  /// outlive the calls of the solver.
  /// Throws rve::InputError if the solver is axisymmetric and a model does not support it.
  void set_models(std::vector<Constitutive<D> *> models);

  /// Prescribes the velocity [length/time] of a rigid body from the next call on.
  void set_body_velocity(int body, const Vec<D> &velocity);
  /// Sets the friction coefficient [-], above 0, of a body with frictional contact from the next
  /// step on.
  void set_body_friction(int body, double friction);
  /// Sets the velocity [length/time] that a body had in the previous step, for a continued run. NaN
  /// means that there was no previous step.
  void set_body_velocity_before(int body, const Vec<D> &velocity)
  {
    body_velocity_before_.at(body) = velocity;
  }
  const Vec<D> &body_velocity_before(int body) const { return body_velocity_before_.at(body); }

  /// Bodies that can turn. RigidBodies::set_rates() prescribes their rates.
  RigidBodies<D> &rigid_bodies() { return rigid_; }

  /// Advances all points by `dt` [time]: positions, velocities, F, volumes, stresses, L.
  ///
  ///   1. mass and momentum to the grid; Usavg: half of the strain and stress increments
  ///   2. forces f_I = - Σ V (σ - p 1)·∇N + Σ f N + traction, with the pore pressure p
  ///   3. p_end = p + f_I dt, conditions on p and p_end, damping
  ///   4. x += dt Σ N v,  v = flip (v + Σ N Δv) + (1 - flip) Σ N v
  ///      water that flows: flux q_I of Darcy's law
  ///   5. momentum to the grid again, conditions, L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F,
  ///      stresses; water that flows: V_w -= dt V Σ q·∇N
  ///
  /// N is the shape function of a node. A point has position x, velocity v, volume V (initially
  /// V₀), stress σ, body force f, deformation gradient F and velocity gradient L. A node has force
  /// f_I, momentum p and velocity v. In Σ N v and in L, v is the velocity of the node, and Δv is
  /// its change in the step. In axisymmetry all sums are those of rings, and hoop strains and
  /// stresses are included (doc/src/theory_mpm.rst).
  ///
  /// All sums use the weights at the positions at the start of the step. Rigid points move with
  /// their body and do not contribute to sums.
  ///
  /// Throws rve::InputError if dt <= 0 or a load or index is wrong, and PointError if a point is
  /// outside of the grid before or after the step, inverted, or has a quantity that is not finite.
  void step(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads, double dt);

  /// Finds nodal forces, the unbalanced force and reactions of the current state as step() does,
  /// without advancing points.
  void evaluate(const PointView<D> &points, const std::vector<TractionLoad<D>> &loads, double dt);

  /// Returns the Courant number dt max_p (c_p + |v_p|) / h with the cell size h, the velocity v_p
  /// of point p and its wave speed c_p = sqrt(M/ρ). M is the P-wave modulus of the constitutive
  /// model plus that of the pore water [stress], and ρ = m/V is the density. The maximum includes
  /// the wave speeds of dashpots. Steps with a Courant number above 1 are unstable, and nonlinear
  /// materials need 0.5 or less.
  double cfl_number(const PointView<D> &points, double dt) const;

  /// Returns the number of the stability limit of water that flows, 2 D c dt/h² with the largest
  /// diffusivity c = (k/ρ_w g) K_w/n of a point and the dimension D; 0 without flow. The step is
  /// stable if this number plus the square of the Courant number is at most 1.
  double flow_number(const PointView<D> &points, double dt) const;

  /// Returns the part of the pore water in the P-wave modulus of a point, K_w/n at zero pressure,
  /// or 0 without water [stress].
  double modulus_of_water(const PointView<D> &points, int p) const;

  /// Force of the material on a rigid body in the last step or evaluation [force].
  Vec<D> body_reaction(int body) const;
  /// Torque of the material about the origin of a body that can turn, one component in 2D [force
  /// length].
  Vec<rve::Space<D>::spins> body_torque(int body) const;
  /// Force of the material on a side of the grid [force].
  Vec<D> side_reaction(Face side) const { return runner_->side_reaction(side); }
  /// Sum of the forces of local damping on nodes in the last step or evaluation [force]. Together
  /// with reactions and other forces it balances the change of momentum of the points.
  Vec<D> damping_force() const { return runner_->damping_force(); }
  /// Largest magnitude of a component of the nodal forces, internal plus external [force].
  /// Components with a prescribed velocity do not count.
  double max_unbalanced_force() const { return runner_->max_unbalanced_force(); }

  /// Returns sums over all deformable points.
  Totals<D> totals(const PointView<D> &points) const;

  const Grid<D> &grid() const { return grid_; }
  /// Internal plus external force on a node in the last step or evaluation [force].
  Vec<D> node_force(const NodeIndex<D> &place) const { return runner_->node_force(place); }
  double node_mass(const NodeIndex<D> &place) const { return runner_->node_mass(place); }
  /// Number of nodes of the grid that this rank held in the last step or evaluation.
  int held_nodes() const { return runner_->held_nodes(); }

  /// Updates all arrays of the points that a device has changed, such as deformation gradients and
  /// volumes, and waits for stresses.
  void fetch(const PointView<D> &points) const
  {
    synchronise();
    runner_->fetch(points);
  }
  /// Waits for stresses that a device may still compute after step() has returned. Callers that
  /// read stresses of points between steps must call it or fetch() first. Not collective.
  void synchronise() const;
  /// Announces that the caller has changed the arrays of the points or will do so before the next
  /// call. The arrays must be up to date (fetch()). Positions, velocities, body forces, models and
  /// rigid bodies may change without announcement.
  void points_changed() { runner_->points_changed(); }

  /// Total wall time of copies from and to a device [seconds].
  double transfer_time() const { return runner_->transfer_time(); }
  /// Total wall time of the k-th constitutive model [seconds].
  double model_time(int k) const { return stresses_.time(k); }

  /// Returns a description of the threads or device, for the log.
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
  double last_dt_ = 0.0;    ///< time step of the last step or evaluation [time]
  std::vector<PointLoad<D>> loads_;
};

}    // namespace mpm
