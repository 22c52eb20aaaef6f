// SPDX-License-Identifier: GPL-2.0-only
#include "macro/contact_response.h"

#include "rve/engine/contact_laws.h"
#include "rve/engine/substeps.h"

#include <cmath>

namespace macro {

template <int D>
ContactResponse<D>::ContactResponse(const rve::Material &material, double grain_size) :
    grain_size_(grain_size), density_(rve::inertial_density(material)),
    has_constant_moduli_(rve::has_constant_moduli<D>(material))
{
  if (!has_constant_moduli_) return;
  linear_.depth = D == 2 ? material.thickness : grain_size;
  linear_.stiffness = rve::moduli_at_strain<D>(0.0, material, 0.5 * grain_size).normal;
  linear_.frequency = frequency_at(0.0, material);
}

template <int D>
double ContactResponse<D>::contact_strain(double pressure, const rve::Material &material) const
{
  return has_constant_moduli_ ? linear_.strain(pressure)
                              : rve::contact_strain<D>(pressure, material, 0.5 * grain_size_);
}

template <int D>
double ContactResponse<D>::frequency_at(double contact_strain, const rve::Material &material) const
{
  // If a grain turns by an angle a, each of its Z contacts exerts the force k_t r a with the lever
  // arm r. An isostatic packing with friction has Z = D + 1. In 3D only the part of the rotation
  // normal to the branch vector moves the surface at the contact. The mean square of this part is
  // two thirds of the squared angle.
  constexpr double CONTACTS = D == 2 ? 3.0 : 4.0 * 2.0 / 3.0;
  using Shape = rve::GrainShape<D>;
  const double radius = 0.5 * grain_size_;
  const double mass =
      rve::times_power<D>(material.density * material.mass_depth * Shape::volume, radius);
  const double stiffness = rve::moduli_at_strain<D>(contact_strain, material, radius).tangential;
  return std::sqrt(1.0 / Shape::inertia * CONTACTS * stiffness / mass);
}

template <int D>
double ContactResponse<D>::frequency(double contact_strain, const rve::Material &material) const
{
  return has_constant_moduli_ ? linear_.frequency : frequency_at(contact_strain, material);
}

template class ContactResponse<2>;
template class ContactResponse<3>;

}    // namespace macro
