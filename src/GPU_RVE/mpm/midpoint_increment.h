// SPDX-License-Identifier: GPL-2.0-only
// Strain and rotation of a deformation increment and the elastic stress that follows from them, for
// hypoelastic laws.

#pragma once

#include "rve/core/tensor.h"

namespace mpm {

/// Strain D and rotation R of an increment. They follow from the displacement gradient with respect
/// to the configuration in the middle of the increment (Hughes & Winget 1980, Int. J. Numer. Meth.
/// Engng 15, 1862). A rigid rotation of any size gives no strain.
template <int D> struct MidpointIncrement {
  rve::Tensor<double, D> strain;      ///< D
  rve::Tensor<double, D> rotation;    ///< R
};

/// Rotation R = (I - W/2)⁻¹ (I + W/2) of a displacement gradient with the spin W. In 2D its angle
/// is 2 atan(w/2) with w = W_yx.
RVE_INLINE rve::Tensor2 midpoint_rotation(const rve::Tensor2 &gradient)
{
  const double half_spin = 0.25 * (gradient(1, 0) - gradient(0, 1));
  const double factor = 1.0 / (1.0 + half_spin * half_spin);
  const double cosine = (1.0 - half_spin * half_spin) * factor;
  const double sine = 2.0 * half_spin * factor;
  return {{cosine, -sine, sine, cosine}};
}

/// Rotation R in 3D. With H = W/2 and the vector h such that H x = h × x,
/// R = I + 2 (H + H²)/(1 + h²), since H³ = -h² H.
RVE_INLINE rve::Tensor3 midpoint_rotation(const rve::Tensor3 &gradient)
{
  using rve::Tensor3;
  const Tensor3 half_spin = 0.25 * (gradient - transpose(gradient));
  const double x = half_spin(2, 1), y = half_spin(0, 2), z = half_spin(1, 0);
  const double factor = 2.0 / (1.0 + (x * x + y * y + z * z));
  return Tensor3::identity() + factor * (half_spin + half_spin * half_spin);
}

/// Strain and rotation of ΔF.
template <int D>
RVE_INLINE MidpointIncrement<D>
midpoint_increment(const rve::Tensor<double, D> &deformation_increment)
{
  using Tensor = rve::Tensor<double, D>;
  const Tensor identity = Tensor::identity();
  const Tensor gradient =
      (deformation_increment - identity) * inverse(0.5 * (deformation_increment + identity));
  return {0.5 * (gradient + transpose(gradient)), midpoint_rotation(gradient)};
}

/// Returns R σ Rᵀ + λ tr(D) I + 2 μ D, which is exactly symmetric [stress].
template <int D>
RVE_INLINE rve::Tensor<double, D> elastic_stress(const rve::Tensor<double, D> &stress,
                                                 const MidpointIncrement<D> &increment,
                                                 double lame_first, double shear_modulus)
{
  using Tensor = rve::Tensor<double, D>;
  Tensor updated = increment.rotation * stress * transpose(increment.rotation) +
      (lame_first * trace(increment.strain)) * Tensor::identity() +
      (2.0 * shear_modulus) * increment.strain;
  for (int a = 0; a < D; ++a)
    for (int b = a + 1; b < D; ++b) {
      const double shear = 0.5 * (updated(a, b) + updated(b, a));
      updated(a, b) = shear;
      updated(b, a) = shear;
    }
  return updated;
}

}    // namespace mpm
