#include "mpm/analytic_laws.h"

#include "rve/core/error.h"

namespace mpm {

using rve::number;
using rve::require;
using rve::Tensor2;

LinearElastic::LinearElastic(double young_modulus, double poisson_ratio)
{
  require(young_modulus > 0.0,
          "Young's modulus must be positive, got " + number(young_modulus) + " [stress]");
  require(poisson_ratio > -1.0 && poisson_ratio < 0.5,
          "Poisson's ratio must be in (-1, 0.5), got " + number(poisson_ratio));
  shear_modulus_ = young_modulus / (2.0 * (1.0 + poisson_ratio));
  lame_first_ = 2.0 * shear_modulus_ * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
}

void LinearElastic::update(int count, const int *point_index, const Tensor2 *deformation_increment,
                           double /*dt*/, Tensor2 *stress)
{
  const Tensor2 identity = Tensor2::identity();
  for (int k = 0; k < count; ++k) {
    const int p = point_index[k];
    const Tensor2 &increment = deformation_increment[p];

    // displacement gradient with respect to the middle configuration
    const Tensor2 gradient = (increment - identity) * inverse(0.5 * (increment + identity));
    const Tensor2 strain = 0.5 * (gradient + transpose(gradient));

    // R = (I - W/2)⁻¹ (I + W/2), a rotation by 2 atan(w/2)
    const double half_spin = 0.25 * (gradient(1, 0) - gradient(0, 1));
    const double factor = 1.0 / (1.0 + half_spin * half_spin);
    const double cosine = (1.0 - half_spin * half_spin) * factor;
    const double sine = 2.0 * half_spin * factor;
    const Tensor2 rotation = {{cosine, -sine, sine, cosine}};

    Tensor2 updated = rotation * stress[p] * transpose(rotation) +
        (lame_first_ * trace(strain)) * identity + (2.0 * shear_modulus_) * strain;
    const double shear = 0.5 * (updated(0, 1) + updated(1, 0));
    updated(0, 1) = shear;
    updated(1, 0) = shear;
    stress[p] = updated;
  }
}

double LinearElastic::p_wave_modulus(int /*point_index*/) const
{
  return lame_first_ + 2.0 * shear_modulus_;
}

}    // namespace mpm
