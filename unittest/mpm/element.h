// SPDX-License-Identifier: GPL-2.0-only
// A material point in space for tests of constitutive laws with one state variable. It is strained
// step by step or in a triaxial test.

#pragma once

#include "mpm/constitutive.h"
#include "rve/core/tensor.h"

#include <cmath>
#include <random>

namespace mpm_test {

inline rve::Tensor3 diagonal(double x, double y, double z)
{
  return {{x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z}};
}

/// One point and its state variables.
template <class Law> struct Element {
  Law law;
  rve::Tensor3 stress;
  double memory[1];

  Element(const Law &_law, const rve::Tensor3 &initial) : law(_law), stress(initial)
  {
    law.begin_memory(stress, memory);
  }
  double plastic_strain() const { return memory[Law::PlasticStrain]; }
  double yield() const { return law.yield(stress, memory); }
  void deform(const rve::Tensor3 &increment)
  {
    const int point = 0;
    law.update(1, &point, &increment, 1.0, &stress, {memory, 1});
  }
};

inline rve::Tensor3 rotation_about(const rve::Vec<double, 3> &axis, double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  rve::Tensor3 turn = c * rve::Tensor3::identity() + (1.0 - c) * dyad(axis, axis);
  const int next[] = {1, 2, 0};
  for (int a = 0; a < 3; ++a) {
    const int b = next[a], k = next[b];
    turn(a, b) -= s * axis[k];
    turn(b, a) += s * axis[k];
  }
  return turn;
}

/// Returns a rotation by a random angle about a random axis.
inline rve::Tensor3 any_rotation(std::mt19937 &random)
{
  std::normal_distribution<double> normal;
  rve::Vec<double, 3> axis = {{normal(random), normal(random), normal(random)}};
  axis = (1.0 / std::sqrt(dot(axis, axis))) * axis;
  return rotation_about(axis, 3.0 * normal(random));
}

/// A triaxial test. step() shortens the z axis and keeps both lateral stresses at -pressure by
/// equal strains along x and y.
template <class Law> struct Triaxial {
  Element<Law> element;
  double widening = 0.0;    ///< strain of x and y in the last step

  Triaxial(const Law &law, double pressure) :
      element(law, (-pressure) * rve::Tensor3::identity()), pressure_(pressure)
  {
  }
  void step(double shortening)
  {
    const Element<Law> before = element;
    double low = -std::abs(shortening) * 100.0, high = -low;
    for (int iteration = 0; iteration < 200; ++iteration) {    // bisection on σ_xx = -p
      widening = 0.5 * (low + high);
      element = before;
      element.deform(diagonal(1.0 + widening, 1.0 + widening, 1.0 - shortening));
      (element.stress(0, 0) < -pressure_ ? low : high) = widening;
    }
  }

 private:
  double pressure_;
};

}    // namespace mpm_test
