// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the impact of two disks with a linear normal spring and a linear tangential spring with
// Coulomb limit. The overlaps are small, so that the line of centres does not rotate. The normal
// motion with the overlap delta and the tangential motion with the slip velocity v are then two
// oscillators:
//   m* delta'' = -k_n delta,
//   m_t v' = -f,  f' = k_t v while sticking,  f = +-mu k_n delta while sliding.
// Here m* and m_t are the effective masses (see DiskPair), f is the tangential force, k_n and k_t
// are the stiffnesses, and mu is the friction coefficient. While the contact only sticks or only
// slides, v has a closed form. A bisection finds the times at which sticking or sliding ends, to
// machine precision. Di Maio & Di Renzo, Chem Eng Sci 59, 3461 (2004) give the same solution for
// spheres.

#pragma once

#include <cmath>

namespace rve_test {

/// Two disks of the same density and depth, and the effective masses of their contact.
struct DiskPair {
  double radius[2];       ///< [length]
  double area_density;    ///< density times depth [mass/length^2]

  double mass(int i) const { return area_density * M_PI * radius[i] * radius[i]; }
  double inertia(int i) const { return 0.5 * mass(i) * radius[i] * radius[i]; }
  /// Returns the effective mass m* of the normal motion, 1/m* = 1/m_1 + 1/m_2 [mass].
  double mass_eff() const { return 1.0 / (1.0 / mass(0) + 1.0 / mass(1)); }
  /// Returns the effective mass m_t of the tangential motion [mass]. 1/m_t is the sum of 1/m_i +
  /// r_i^2/I_i over both disks, so that m_t = m*/3 for all radii.
  double tangential_mass() const
  {
    double compliance = 0.0;
    for (int i = 0; i < 2; ++i) compliance += 1.0 / mass(i) + radius[i] * radius[i] / inertia(i);
    return 1.0 / compliance;
  }
};

class LinearImpact {
 public:
  LinearImpact(const DiskPair &disks, double normal_stiffness, double tangential_stiffness,
               double friction) :
      normal_frequency(std::sqrt(normal_stiffness / disks.mass_eff())),
      tangential_frequency(std::sqrt(tangential_stiffness / disks.tangential_mass())),
      mass(disks.tangential_mass()), stiffness(tangential_stiffness),
      limit_per_velocity(friction * std::sqrt(normal_stiffness * disks.mass_eff()))
  {
  }

  double duration() const { return M_PI / normal_frequency; }

  /// Returns the slip velocity of the contact at separation. The arguments are the normal velocity
  /// of approach (positive) and the slip velocity at first touch.
  double rebound(double normal, double tangential) const
  {
    const double limit = limit_per_velocity * normal;
    Phase phase{0.0, tangential, 0.0, 0};
    if (std::fabs(stiffness * tangential) > limit * normal_frequency)
      phase.sliding = sign(tangential);
    // The search for changes between sticking and sliding divides the impact into `steps`
    // intervals.
    const int steps = 20000;
    const double step = duration() / steps;
    for (int k = 1; k <= steps; ++k) {
      const double time = k * step;
      if (excess(phase, limit, time) <= 0.0) continue;
      double before = time - step, after = time;
      if (before < phase.time) before = phase.time;
      for (int bisection = 0; bisection < 60; ++bisection) {
        const double middle = 0.5 * (before + after);
        (excess(phase, limit, middle) > 0.0 ? after : before) = middle;
      }
      const double force = this->force(phase, limit, after);
      phase = {after, velocity(phase, limit, after), force, phase.sliding == 0 ? sign(force) : 0};
    }
    return velocity(phase, limit, duration());
  }

 private:
  /// A phase of sticking or sliding: its start time, and the slip velocity and tangential force at
  /// the start. `sliding` is 0 for sticking and the sign of the force for sliding.
  struct Phase {
    double time, velocity, force;
    int sliding;
  };

  static int sign(double x) { return x < 0.0 ? -1 : 1; }

  double velocity(const Phase &p, double limit, double t) const
  {
    if (p.sliding != 0)
      return p.velocity -
          p.sliding * limit / (mass * normal_frequency) *
          (std::cos(normal_frequency * p.time) - std::cos(normal_frequency * t));
    const double angle = tangential_frequency * (t - p.time);
    return p.velocity * std::cos(angle) - p.force / (mass * tangential_frequency) * std::sin(angle);
  }

  double force(const Phase &p, double limit, double t) const
  {
    if (p.sliding != 0) return p.sliding * limit * std::sin(normal_frequency * t);
    const double angle = tangential_frequency * (t - p.time);
    return p.force * std::cos(angle) + p.velocity * mass * tangential_frequency * std::sin(angle);
  }

  /// Returns a positive number if the phase has ended at time t. Sticking ends when the force
  /// exceeds the limit. Sliding ends when the spring force would fall below the limit.
  double excess(const Phase &p, double limit, double t) const
  {
    if (p.sliding == 0)
      return std::fabs(force(p, limit, t)) - limit * std::sin(normal_frequency * t);
    return limit * normal_frequency * std::cos(normal_frequency * t) -
        p.sliding * stiffness * velocity(p, limit, t);
  }

  double normal_frequency, tangential_frequency;
  double mass, stiffness;
  /// Coulomb limit at the peak of the normal force, divided by the normal velocity of approach.
  double limit_per_velocity;
};

}    // namespace rve_test
