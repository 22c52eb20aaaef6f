// SPDX-License-Identifier: GPL-2.0-only
// Scalar measures of stress and strain for output: equations (25b) and (27) of Zhao, Zhao & Liang
// 2021, with n = 2 in 2D and n = 3 in 3D.

#pragma once

#include "rve/core/tensor.h"

#include <cmath>

namespace mpm {

/// Returns sqrt(s:s/2) with the deviator s of the symmetric part [stress]. It is half the
/// difference of the principal stresses.
inline double deviatoric_stress(const rve::Tensor2 &stress)
{
  return std::hypot(0.5 * (stress(0, 0) - stress(1, 1)), 0.5 * (stress(0, 1) + stress(1, 0)));
}

/// Sum of the squared components of the deviator of the symmetric part.
inline double deviatoric_square(const rve::Tensor3 &t)
{
  const rve::Tensor3 deviator =
      0.5 * (t + transpose(t)) - (trace(t) / 3.0) * rve::Tensor3::identity();
  double sum = 0.0;
  for (const double component : deviator.component) sum += component * component;
  return sum;
}

/// Returns sqrt(3/2 s:s) [stress]. It is the difference of the principal stresses in a triaxial
/// test.
inline double deviatoric_stress(const rve::Tensor3 &stress)
{
  return std::sqrt(1.5 * deviatoric_square(stress));
}

/// Returns sqrt(2 e:e) with the deviator e of the engineering strain (F + Fᵀ)/2 - I.
inline double deviatoric_strain(const rve::Tensor2 &F)
{
  return std::hypot(F(0, 0) - F(1, 1), F(0, 1) + F(1, 0));
}

/// Returns sqrt(2/3 e:e). It is deviatoric_stress/(3 μ) in an isotropic elastic material.
inline double deviatoric_strain(const rve::Tensor3 &F)
{
  return std::sqrt(2.0 / 3.0 * deviatoric_square(F));
}

}    // namespace mpm
