// SPDX-License-Identifier: GPL-2.0-only
// What elastic, perfectly plastic laws of cohesion and friction share: their parameters, and what they remember.

#pragma once

#include "mpm/constitutive.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"

#include <cmath>

namespace mpm {

inline double sine_of(double degrees)
{
  return std::sin(degrees * rve::kPi / 180.0);
}

/// rve::InputError unless young_modulus > 0, cohesion >= 0 [stress]; 0 <= poisson_ratio < 0.5; 0 <= dilation <= friction < 90
/// [degrees]; cohesion and friction not both 0.
inline void require_strength(double young_modulus, double poisson_ratio, double cohesion,
                             double friction_degrees, double dilation_degrees)
{
  using rve::number;
  using rve::require;
  require(young_modulus > 0.0,
          "Young's modulus must be positive, got " + number(young_modulus) + " [stress]");
  require(poisson_ratio >= 0.0 && poisson_ratio < 0.5,
          "Poisson's ratio must be in [0, 0.5), got " + number(poisson_ratio));
  require(cohesion >= 0.0, "cohesion must be at least 0, got " + number(cohesion) + " [stress]");
  require(friction_degrees >= 0.0 && friction_degrees < 90.0,
          "friction angle must be in [0, 90), got " + number(friction_degrees) + " [degrees]");
  require(dilation_degrees >= 0.0 && dilation_degrees <= friction_degrees,
          "dilation angle must be in [0, friction angle], got " + number(dilation_degrees) +
              " with friction angle " + number(friction_degrees) + " [degrees]");
  require(cohesion > 0.0 || friction_degrees > 0.0,
          "cohesion and friction angle must not both be 0: the material would have no strength");
}

/// Divides the cohesion c and tan(phi) of the arguments E, nu, c, phi, psi by a factor above 0. The dilation angle psi stays, unless it
/// would be above the new phi: then it is phi.
inline void reduce_cohesion_and_friction(double *arguments, double factor)
{
  enum { COHESION = 2, FRICTION, DILATION };
  constexpr double DEGREE = rve::kPi / 180.0;
  double &friction = arguments[FRICTION];
  arguments[COHESION] /= factor;
  friction = std::atan(std::tan(friction * DEGREE) / factor) / DEGREE;
  arguments[DILATION] = std::fmin(arguments[DILATION], friction);
}

/// The stress out of a plane, tension positive, and the accumulated plastic strain, sqrt(2/3 dε^p:dε^p) of the deviator.
inline StateVariables plastic_state_variables(int dimension)
{
  StateVariables variables;
  if (dimension == 2) variables.push_back({"out_of_plane_stress", "stress"});
  variables.push_back({"plastic_strain", ""});
  return variables;
}

}    // namespace mpm
