// SPDX-License-Identifier: GPL-2.0-only
// The rigid bodies that can turn, between steps: place, turn, rates, and the inertia of those that forces drive.
//
// A body is made of its points once, when it is first seen: its form fits the boxes of the points or has vertices of its own, their masses
// give its inertia, and their velocities those with which a free body begins. From then on the points follow the body. Forces on the points act on it.

#pragma once

#include "mpm/convex_hull.h"
#include "mpm/points.h"
#include "mpm/solver_options.h"

#include <array>
#include <vector>

namespace mpm {

template <int D> class RigidBodies {
 public:
  static constexpr int S = FREEDOMS<D>;

  /// rve::InputError on wrong options.
  explicit RigidBodies(const SolverOptions<D> &options);

  /// Prescribes rates of a body from the next step on: velocity of its origin and spin. What forces drive is left alone.
  void set_rates(int body, const double *rates);

  /// For a step from this state; valid until the next call. All ranks call it together.
  std::vector<RigidBodyStep<D>> &steps(const PointView<D> &points, double dt,
                                       const Communication &communication);
  /// Moves the bodies by what the step has found.
  void advance(double dt);

  bool can_turn(int body) const { return index_.at(body) >= 0; }

  /// Number of points of this rank, of the material and of other bodies, whose centers are inside of a
  /// body that can turn and has not moved yet. Known after a step or an evaluation.
  int num_enclosed(int body, const PointView<D> &points) const;

  // of a body that can turn, by its number among all bodies
  /// Velocity of its origin and spin in the last step [length/time], [1/time].
  const double *rates(int body) const { return state(body).rates; }
  /// Force [force] and torque about its origin [force length] of the material in the last step or evaluation, times its time.
  const double *felt(int body) const { return steps_.at(index_.at(body)).felt; }
  /// The sum of spins times time: in the plane, and about an axis that keeps its direction, the angle [radian].
  const double *turned(int body) const { return state(body).turned; }
  const Vec<D> &origin(int body) const { return state(body).origin; }
  double mass(int body) const { return state(body).inertia[0]; }

  /// Everything that a body has between steps, for files.
  static constexpr int RECORD = 2 + 4 * D + D * D + S + rve::Space<D>::spins + S * S;
  std::vector<double> record(int body) const;
  void set_record(int body, const double *record);

 private:
  struct State {
    bool is_made = false, has_moved = false;
    Vec<D> origin = Vec<D>::zero();    ///< about which it turns [length]
    /// Of the form, from the origin along the body's axes [length].
    Vec<D> centre = Vec<D>::zero();
    Vec<D> half = Vec<D>::zero();           ///< [length]
    Vec<D> mass_centre = Vec<D>::zero();    ///< from the origin along the body's axes [length]
    Tensor<D> orientation = Tensor<D>::identity();
    double rates[S] = {};
    double turned[rve::Space<D>::spins] = {};
    double inertia[S * S] = {};    ///< along the body's axes, about the origin
  };

  const State &state(int body) const { return states_.at(index_.at(body)); }
  template <class Body, class Visit> static void each_number(Body &body, const Visit &visit);
  void fit_form(int k, const PointView<D> &points, const Communication &communication);
  void place_origin(int k, const PointView<D> &points, const Communication &communication);
  void find_inertia(int k, const PointView<D> &points, const Communication &communication);
  void widen_at_sides(RigidShape<D> &shape) const;
  void set_half_spaces(int k, RigidShape<D> &shape) const;
  ConvexHull<D> hull_of(int body) const;
  void add_forces(const PointView<D> &points, double dt, const Communication &communication);

  SolverOptions<D> options_;
  std::vector<int> index_;              ///< of each body among those that can turn, or -1
  std::vector<int> bodies_;             ///< those that can turn
  std::vector<ConvexHull<D>> hulls_;    ///< of those of the form Convex, along the body's axes
  std::vector<State> states_;
  std::vector<std::array<double, S>> prescribed_;
  std::vector<RigidBodyStep<D>> steps_;
};

}    // namespace mpm
