// SPDX-License-Identifier: GPL-2.0-only
// State between time steps of the rigid bodies that can turn: position, orientation, rates and
// inertia.
//
// A body is made from its points in its first step. Its form fits the boxes of the points or has
// given vertices. The masses of the points give the inertia. The velocities of the points give the
// initial rates of the freedoms that obey forces. Afterwards the points follow the body, and forces
// on them act on the body.

#pragma once

#include "mpm/convex_hull.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <array>
#include <vector>

namespace mpm {

/// All rigid bodies that can turn. Parameters `body` are indices among all rigid bodies.
template <int D> class RigidBodies {
 public:
  static constexpr int S = FREEDOMS<D>;

  /// Throws rve::InputError for wrong options of any rigid body.
  explicit RigidBodies(const SolverOptions<D> &options);

  /// Prescribes the rates of a body from the next step on. `rates` has S numbers: the velocity of
  /// the origin [length/time] and the spin [1/time]. Freedoms that obey forces ignore their
  /// prescribed rates.
  void set_rates(int body, const double *rates);

  /// Returns the data of the bodies for a step from the present state, valid until the next call.
  /// Collective. Throws rve::InputError if the points of a new body are not suitable.
  std::vector<RigidBodyStep<D>> &steps(const PointView<D> &points, double dt,
                                       const Communication &communication);
  /// Moves the bodies by the rates that the step has found over `dt` [time].
  void advance(double dt);

  /// True if the form of the body is not Face.
  bool can_turn(int body) const { return index_.at(body) >= 0; }

  /// Number of points on this rank whose centres are inside this body, which can turn. Its own
  /// points do not count. The number is 0 once the body has moved. Available after a step or an
  /// evaluation.
  int num_enclosed(int body, const PointView<D> &points) const;

  // the following members are for bodies that can turn
  /// Velocity of the origin [length/time] and spin [1/time] of a body in the last step.
  const double *rates(int body) const { return state(body).rates; }
  /// Impulse of the material on a body in the last step or evaluation: force times time step, then
  /// torque about the origin times time step.
  const double *felt(int body) const { return steps_.at(index_.at(body)).felt; }
  /// Sum over the steps of spin times time step [radian]. It is the angle of rotation in 2D. In 3D
  /// it is the rotation vector only if the axis of rotation keeps its direction.
  const double *turned(int body) const { return state(body).turned; }
  const Vec<D> &origin(int body) const { return state(body).origin; }
  double mass(int body) const { return state(body).inertia[0]; }

  /// Number of doubles in the record of a body, its complete state between steps for restart files.
  static constexpr int RECORD = 2 + 4 * D + D * D + S + rve::Space<D>::spins + S * S;
  std::vector<double> record(int body) const;
  void set_record(int body, const double *record);

 private:
  struct State {
    bool is_made = false, has_moved = false;
    Vec<D> origin = Vec<D>::zero();    ///< centre of rotation [length]
    /// Centre of the form from the origin, in the axes of the body [length].
    Vec<D> centre = Vec<D>::zero();
    Vec<D> half = Vec<D>::zero();           ///< [length]
    Vec<D> mass_centre = Vec<D>::zero();    ///< from the origin, in the axes of the body [length]
    Tensor<D> orientation = Tensor<D>::identity();
    double rates[S] = {};
    double turned[rve::Space<D>::spins] = {};
    double inertia[S * S] = {};    ///< about the origin, in the axes of the body
  };

  const State &state(int body) const { return states_.at(index_.at(body)); }
  template <class Body, class Visit> static void each_number(Body &body, const Visit &visit);
  void fit_form(int k, const PointView<D> &points, const Communication &communication);
  void place_origin(int k, const PointView<D> &points, const Communication &communication);
  void find_inertia(int k, const PointView<D> &points, const Communication &communication);
  void widen_at_sides(RigidShape<D> &shape) const;
  void set_half_spaces(int k, RigidShape<D> &shape) const;
  void check_symmetry(int body) const;
  ConvexHull<D> hull_of(int body) const;
  void add_forces(const PointView<D> &points, double dt, const Communication &communication);

  SolverOptions<D> options_;
  std::vector<int> index_;              ///< per body: index among those that can turn, or -1
  std::vector<int> bodies_;             ///< indices of the bodies that can turn
  std::vector<ConvexHull<D>> hulls_;    ///< per turning body: hull in its axes, if Convex
  std::vector<State> states_;
  std::vector<std::array<double, S>> prescribed_;
  std::vector<RigidBodyStep<D>> steps_;
};

}    // namespace mpm
