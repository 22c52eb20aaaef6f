// SPDX-License-Identifier: GPL-2.0-only
// Axisymmetric points and laws for tests: x is the radius, y the coordinate along the axis.

#pragma once

#include "mpm/axisymmetric_law.h"
#include "mpm/linear_elastic.h"
#include "rve/core/pi.h"
#include "scene.h"

#include <memory>

namespace mpm_test {

constexpr double TURN = 2.0 * rve::kPi;

/// Makes all points of a plane scene rings: volumes and masses become those of a full turn.
inline void make_rings(Scene &scene)
{
  for (int p = 0; p < scene.size(); ++p) {
    const double turn = TURN * scene.position[3 * p];
    scene.mass[p] *= turn;
    scene.initial_volume[p] *= turn;
    scene.volume[p] *= turn;
  }
}

inline mpm::AxisymmetricLaw elastic_rings(double young, double poisson)
{
  return mpm::AxisymmetricLaw(std::make_shared<mpm::LinearElastic<3>>(young, poisson));
}

inline mpm::SolverOptions<2> ring_options(Vec2 lo, Vec2 hi, double cell_size)
{
  mpm::SolverOptions<2> options = grid_options(lo, hi, cell_size);
  options.axisymmetric = true;
  if (!(lo[0] > 0.0)) options.sides[0] = mpm::SideKind::Roller;
  return options;
}

}    // namespace mpm_test
