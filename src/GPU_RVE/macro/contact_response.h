// SPDX-License-Identifier: GPL-2.0-only
// Contact strain and rotational frequency of the mean grain of an RVE, from its material and mean
// grain size. The plan of every macro step needs both for thousands of points. Values that do not
// change are therefore computed only once.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/increment_plan.h"

namespace macro {

/// Response of the contacts of the mean grain of an RVE.
template <int D> class ContactResponse {
 public:
  ContactResponse() = default;
  ContactResponse(const rve::Material &material, double grain_size);

  /// Returns the ratio of overlap to diameter at a pressure [stress] by rve::contact_strain() [-].
  /// `material` must be the material that the constructor got.
  double contact_strain(double pressure, const rve::Material &material) const;

  /// Angular frequency w [1/time] at which grains oscillate if all spin in the same way in a cell
  /// that does not turn: w^2 = Z k_t r^2 / I. A grain has Z contacts with the tangential stiffness
  /// k_t at this contact strain, the radius r and the moment of inertia I.
  double frequency(double contact_strain, const rve::Material &material) const;

  /// Density in the inertial number, rve::inertial_density() [mass/length^3].
  double density() const { return density_; }
  /// Mean grain size, rve::grain_size() [length].
  double grain_size() const { return grain_size_; }
  /// True if the contact moduli do not depend on the overlap. linear() then determines the
  /// response.
  bool is_linear() const { return has_constant_moduli_; }
  const rve::LinearContacts &linear() const { return linear_; }

 private:
  double grain_size_ = 0.0, density_ = 0.0;
  bool has_constant_moduli_ = false;
  rve::LinearContacts linear_;    ///< valid if the moduli are constant

  double frequency_at(double contact_strain, const rve::Material &material) const;
};

}    // namespace macro
