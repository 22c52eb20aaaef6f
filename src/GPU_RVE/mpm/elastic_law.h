// SPDX-License-Identifier: GPL-2.0-only
// Base class of laws with an isotropic elastic part: Lame's constants and moduli of waves.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/midpoint_increment.h"

namespace mpm {

template <int D> class ElasticLaw : public Constitutive<D> {
 public:
  bool takes_parts() const override { return true; }
  double p_wave_modulus(int /*point_index*/) const override
  {
    return lame_first_ + 2.0 * shear_modulus_;
  }
  double shear_modulus(int /*point_index*/) const override { return shear_modulus_; }

 protected:
  ElasticLaw(double young_modulus, double poisson_ratio) :
      shear_modulus_(young_modulus / (2.0 * (1.0 + poisson_ratio))),
      lame_first_(2.0 * shear_modulus_ * poisson_ratio / (1.0 - 2.0 * poisson_ratio))
  {
  }

  double shear_modulus_;    ///< μ [stress]
  double lame_first_;       ///< λ [stress]
};

}    // namespace mpm
