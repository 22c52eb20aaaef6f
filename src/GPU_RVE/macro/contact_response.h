// SPDX-License-Identifier: GPL-2.0-only
// How contacts of an RVE give way to pressure, and how its grains follow a rotation: what plans of macro steps ask of a material and a grain. Asked
// for thousands of points in every step, so that what does not change is computed once.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/increment_plan.h"

namespace macro {

/// Of the mean grain of an RVE.
template <int D> class ContactResponse {
 public:
  ContactResponse() = default;
  ContactResponse(const rve::Material &material, double grain_size);

  /// rve::contact_strain(). The material is that of the constructor.
  double contact_strain(double pressure, const rve::Material &material) const;

  /// With which grains that all spin alike in a cell that does not turn go to and fro at this overlap, w = sqrt(2 Z k_t/m), k_t at the overlap over
  /// diameter [1/time].
  double frequency(double contact_strain, const rve::Material &material) const;

  /// That enters inertial numbers, of rve::inertial_density() [mass/length^3]
  double density() const { return density_; }
  /// rve::grain_size() [length]
  double grain_size() const { return grain_size_; }
  /// Whether linear() is all there is to say.
  bool is_linear() const { return has_constant_moduli_; }
  const rve::LinearContacts &linear() const { return linear_; }

 private:
  double grain_size_ = 0.0, density_ = 0.0;
  bool has_constant_moduli_ = false;
  rve::LinearContacts linear_;    ///< with constant moduli

  double frequency_at(double contact_strain, const rve::Material &material) const;
};

}    // namespace macro
