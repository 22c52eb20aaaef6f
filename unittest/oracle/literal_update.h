// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the time step of the paper, Zhao, Zhao and Liang (2021),
// https://doi.org/10.1002/nme.6549, as printed: equations (3), (4), (11)-(13), (19)-(24), (38) and
// (39), in double precision. It uses Cartesian positions without wrapping, total velocities and
// explicit Euler steps for the cell H. Rounding of fractional differences selects the image of a
// neighbour. Equation (14) adds magnitudes of the tangential force; here the force has a sign.

#pragma once

#include "rve/engine/state.h"

#include <cmath>
#include <vector>

namespace rve_test {

class LiteralUpdate {
 public:
  /// Starts from the positions x of the state, with the velocities v = L x + c. L is the velocity
  /// gradient and c the peculiar velocity of the state.
  LiteralUpdate(const rve::RveState &state, const rve::Tensor2 &velocity_gradient) :
      material(state.material), radius(state.radius), cell(state.cell), l(velocity_gradient),
      x(state.positions()), v(state.velocity), w(state.spin)
  {
    for (int i = 0; i < size(); ++i)
      for (int a = 0; a < 2; ++a) v[2 * i + a] += l(a, 0) * x[2 * i] + l(a, 1) * x[2 * i + 1];
    for (int i = 0; i < size(); ++i)    // pairs that can touch within a small strain
      for (int j = i + 1; j < size(); ++j) {
        const Branch b = branch(i, j);
        if (std::hypot(b.x, b.y) < 1.5 * (radius[i] + radius[j])) pairs.push_back({i, j, 0.0});
      }
  }

  /// Makes one step. Positions move with v, and the cell moves with L. Then it computes the forces
  /// and the velocities for the next step, which has the velocity gradient `next_gradient`.
  void step(double dt, const rve::Tensor2 &next_gradient)
  {
    for (int k = 0; k < 2 * size(); ++k) x[k] += dt * v[k];
    cell = cell + dt * (l * cell);
    find_forces(dt);
    for (int i = 0; i < size(); ++i) {
      const double mass = material.density * material.mass_depth * M_PI * radius[i] * radius[i];
      const double xi[2] = {x[2 * i], x[2 * i + 1]}, vi[2] = {v[2 * i], v[2 * i + 1]};
      for (int a = 0; a < 2; ++a) {
        const double fluctuation = vi[a] - (l(a, 0) * xi[0] + l(a, 1) * xi[1]);    // (38)
        const double damped = damp(force[2 * i + a] / mass, fluctuation, dt);      // (4)
        v[2 * i + a] += (next_gradient(a, 0) - l(a, 0)) * xi[0] +
            (next_gradient(a, 1) - l(a, 1)) * xi[1] +
            (damped + l(a, 0) * vi[0] + l(a, 1) * vi[1]) * dt;    // (39a)
      }
      w[i] += damp(torque[i] / (0.5 * mass * radius[i] * radius[i]), w[i], dt) * dt;    // (39b)
    }
    l = next_gradient;
  }

  const rve::Tensor2 &cell_matrix() const { return cell; }
  int size() const { return static_cast<int>(radius.size()); }

  rve::Tensor2 stress() const { return love; }    ///< stress of the last forces, tension positive

  /// Returns the root mean square distance between the grains of this object and those of the state
  /// [length]. Differences of fractional coordinates are converted to lengths with the cell of this
  /// object.
  double distance_to(const rve::RveState &state) const
  {
    const rve::Tensor2 to_fraction = rve::inverse(cell);
    double sum = 0.0;
    for (int i = 0; i < size(); ++i) {
      const rve::Vec<double, 2> s = to_fraction * rve::Vec<double, 2>{{x[2 * i], x[2 * i + 1]}};
      rve::Vec<double, 2> difference;
      for (int a = 0; a < 2; ++a) {
        const double d = s[a] - static_cast<double>(state.fractional[2 * i + a]) * 0x1p-64;
        difference[a] = d - std::round(d);
      }
      const rve::Vec<double, 2> length = cell * difference;
      sum += rve::dot(length, length);
    }
    return std::sqrt(sum / size());
  }

 private:
  struct Branch {
    double x, y;
    double period[2];
  };
  struct Pair {
    int i, j;
    double tangential_force;
  };

  Branch branch(int i, int j) const
  {
    const double d[2] = {x[2 * j] - x[2 * i], x[2 * j + 1] - x[2 * i + 1]};
    const rve::Tensor2 to_fraction = rve::inverse(cell);
    Branch b;
    for (int a = 0; a < 2; ++a)
      b.period[a] = -std::round(to_fraction(a, 0) * d[0] + to_fraction(a, 1) * d[1]);
    b.x = d[0] + cell(0, 0) * b.period[0] + cell(0, 1) * b.period[1];
    b.y = d[1] + cell(1, 0) * b.period[0] + cell(1, 1) * b.period[1];
    return b;
  }

  double damp(double acceleration, double velocity, double dt) const
  {
    const double power = acceleration * (velocity + 0.5 * dt * acceleration);
    const double sign = power > 0.0 ? 1.0 : power < 0.0 ? -1.0 : 0.0;
    return acceleration * (1.0 - material.local_damping * sign);
  }

  void find_forces(double dt)
  {
    force.assign(2 * size(), 0.0);
    torque.assign(size(), 0.0);
    love = rve::Tensor2::zero();
    const double volume = rve::determinant(cell) * material.thickness;
    for (Pair &pair : pairs) {
      const int i = pair.i, j = pair.j;
      const Branch b = branch(i, j);
      const double distance = std::hypot(b.x, b.y), overlap = radius[i] + radius[j] - distance;
      if (overlap <= 0.0) {
        pair.tangential_force = 0.0;
        continue;
      }
      const double n[2] = {b.x / distance, b.y / distance};
      double relative[2];
      for (int a = 0; a < 2;
           ++a) {    // (11); the image with period P has the additional velocity L (H P), (20a)
        const double shift_x = cell(0, 0) * b.period[0] + cell(0, 1) * b.period[1];
        const double shift_y = cell(1, 0) * b.period[0] + cell(1, 1) * b.period[1];
        relative[a] = v[2 * j + a] + l(a, 0) * shift_x + l(a, 1) * shift_y - v[2 * i + a];
      }
      const double arm_i = radius[i] - 0.5 * overlap, arm_j = radius[j] - 0.5 * overlap;
      const double slip = -n[1] * relative[0] + n[0] * relative[1] - (w[i] * arm_i + w[j] * arm_j);
      const double fn = material.normal_stiffness * overlap, limit = material.friction * fn;
      double ft = pair.tangential_force + material.tangential_stiffness * slip * dt;
      ft = ft > limit ? limit : ft < -limit ? -limit : ft;
      pair.tangential_force = ft;
      const double f[2] = {-fn * n[0] - ft * n[1], -fn * n[1] + ft * n[0]};    // force on i
      const double branch_component[2] = {b.x, b.y};
      for (int a = 0; a < 2; ++a) {
        force[2 * i + a] += f[a];
        force[2 * j + a] -= f[a];
        for (int c = 0; c < 2; ++c) love(a, c) += f[a] * branch_component[c] / volume;
      }
      torque[i] += arm_i * ft;
      torque[j] += arm_j * ft;
    }
  }

  rve::Material material;
  std::vector<double> radius;
  rve::Tensor2 cell, l;
  std::vector<double> x, v, w;
  std::vector<double> force, torque;
  rve::Tensor2 love = rve::Tensor2::zero();
  std::vector<Pair> pairs;
};

}    // namespace rve_test
