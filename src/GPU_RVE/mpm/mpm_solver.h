// The material point method in the plane: one time step, from points to the grid and back.
//
// Knows nothing of LAMMPS, MPI, CUDA or grains. Points belong to the caller; the grid is replicated on every rank and its
// sums are integers, so that results have the same bits for any number of ranks and threads and any order of the points.
// Every rank must make the same calls: a call may communicate through the two functions in Communication.

#ifndef MPM_MPM_SOLVER_H
#define MPM_MPM_SOLVER_H

#include "mpm/boundary.h"
#include "mpm/constitutive.h"
#include "mpm/exact_sum.h"
#include "mpm/grid.h"
#include "mpm/grid_transfer.h"
#include "mpm/points.h"
#include "mpm/shape_functions.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace mpm {

/// Musl: stresses are updated at the end of the step from momenta that are extrapolated anew (Sulsky, Zhou & Schreyer 1995,
/// Comput. Phys. Commun. 87, 236). Usavg: half of the increment before the forces, half of it at the end (Nairn 2003, CMES 4,
/// 649; Bardenhagen 2002, J. Comput. Phys. 180, 383): conserves energy better, calls the constitutive model twice.
enum class Scheme { Musl, Usavg };

struct SolverOptions {
  Vec2 lo = Vec2::zero();    ///< domain [length]
  Vec2 hi = Vec2::zero();
  double cell_size = 0.0;    ///< h [length]
  double thickness = 1.0;    ///< out of the plane, as in the points' volumes [length]
  ShapeFunction shape = ShapeFunction::Gimp;
  Scheme scheme = Scheme::Musl;
  double flip = 1.0;    ///< 1: points receive velocity increments (FLIP), 0: grid velocities (PIC)
  double damping = 0.0;               ///< Cundall's local damping of nodes, in [0, 1)
  std::array<SideKind, 4> sides{};    ///< order of Face: x low, x high, y low, y high; default free
  std::vector<RigidBodyOptions> rigid_bodies;
  int threads = 1;    ///< OpenMP threads; no influence on results
};

/// In place over all ranks; the defaults are right for one rank.
struct Communication {
  std::function<void(std::int64_t *data, std::size_t count)> sum_over_ranks = [](std::int64_t *,
                                                                                 std::size_t) {
  };
  std::function<void(double *data, std::size_t count)> max_over_ranks = [](double *, std::size_t) {
  };
};

/// Sums over the deformable points of all ranks.
struct Totals {
  std::int64_t points;
  double mass;              ///< [mass]
  Vec2 momentum;            ///< [mass length/time]
  double kinetic_energy;    ///< [energy]
};

class MpmSolver {
 public:
  /// rve::InputError on wrong options.
  explicit MpmSolver(const SolverOptions &options, Communication communication = {});

  /// The constitutive models that PointView::model refers to. Not owned; they must outlive the solver's calls.
  void set_models(std::vector<Constitutive *> models) { models_ = std::move(models); }

  /// Prescribes the velocity [length/time] of a rigid body from the next call on.
  void set_body_velocity(int body, const Vec2 &velocity);

  /// Advances all points by `dt` [time]: positions, velocities, F, volumes, stresses, L.
  ///
  /// The cycle: (1) mass, momentum to the grid; [Usavg: half of the strain]; (2) forces
  /// f_I = - Σ V σ·∇N + Σ f N + traction; (3) p += f dt, conditions, damping; (4) x += dt Σ N v,
  /// v = flip (v + Σ N Δv) + (1 - flip) Σ N v; (5) momentum to the grid again, conditions,
  /// L = Σ v ⊗ ∇N, F ← (I + L dt) F, V = V₀ det F, stresses.
  /// One set of weights, that of the position at the start, serves the whole step.
  /// Rigid points move with their body and have no part in the sums.
  ///
  /// rve::InputError if dt <= 0 or a load or index is wrong; PointError if a point is outside of the grid before
  /// or after the step, inverted, or has a quantity that is not finite.
  void step(const PointView &points, const std::vector<TractionLoad> &loads, double dt);

  /// Nodal forces, unbalanced force and reactions of the current state as step() would find them; nothing is advanced.
  void evaluate(const PointView &points, const std::vector<TractionLoad> &loads, double dt);

  /// dt max_p (c_p + |v_p|) / h with c = sqrt(M/ρ), M from the constitutive model and ρ = m/V. Above 1 the step is unstable;
  /// nonlinear materials want 0.5.
  double cfl_number(const PointView &points, double dt) const;

  /// Force of the material on a rigid body in the last step or evaluation [force].
  const Vec2 &body_reaction(int body) const { return body_reaction_.at(body); }
  /// Force of the material on a side of the grid [force].
  const Vec2 &side_reaction(Face side) const { return side_reaction_[static_cast<int>(side)]; }
  /// Largest |component| of internal plus external nodal force where the velocity is not prescribed [force].
  double max_unbalanced_force() const { return max_unbalanced_force_; }

  Totals totals(const PointView &points) const;

  const Grid &grid() const { return grid_; }
  /// Internal plus external force on node (i, j) in the last step or evaluation [force].
  const Vec2 &node_force(int i, int j) const { return force_[grid_.node(i, j)]; }
  double node_mass(int i, int j) const { return mass_[grid_.node(i, j)]; }

 private:
  void prepare(const PointView &points, const std::vector<TractionLoad> &loads, double dt);
  void check_point(const PointView &points, int p) const;
  void gather_mass_and_momentum(const PointView &points);
  void gather_forces(const PointView &points, const std::vector<TractionLoad> &loads);
  void scatter_traction(const PointView &points, const TractionLoad &load, const FixedScale &scale);
  void advance_grid(double dt);
  void advance_points(const PointView &points, double dt);
  void gather_momentum_again(const PointView &points);
  void constrained_velocity(Boundary::Contact contact);
  void advance_stress(const PointView &points, double dt);
  double load_extent(const PointView &points, const TractionLoad &load, int p) const;
  [[noreturn]] void fail(const PointView &points, int p, const std::string &what) const;

  SolverOptions options_;
  Communication communication_;
  Grid grid_;
  Boundary boundary_;
  std::vector<Constitutive *> models_;
  std::vector<Vec2> body_velocity_;
  std::vector<RigidBodyState> bodies_;

  std::int64_t point_total_ = 0;    ///< deformable points of all ranks
  std::vector<Support> support_;    ///< per local point
  std::vector<rve::Tensor2> increment_;
  std::vector<int> point_list_;

  NodeSums<3> inertia_sums_;      ///< mass, momentum
  NodeSums<2> vector_sums_;       ///< forces; momentum of the second extrapolation
  std::vector<double> mass_;      ///< per node [mass]
  std::vector<Vec2> momentum_;    ///< at the start of the step [mass length/time]
  std::vector<Vec2> momentum_end_;
  std::vector<Vec2> force_;       ///< [force]
  std::vector<Vec2> velocity_;    ///< nodal velocity that the points see next [length/time]
  std::vector<Vec2> velocity_change_;

  std::vector<Vec2> body_reaction_;
  std::array<Vec2, 4> side_reaction_;
  double max_unbalanced_force_ = 0.0;
};

}    // namespace mpm

#endif
