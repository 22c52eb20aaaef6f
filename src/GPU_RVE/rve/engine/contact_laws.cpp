// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/contact_laws.h"

#include <limits>

namespace rve {

namespace {

  /// What a pressure presses on, between two grains: their diameter times the thickness of disks, its square [length^2].
  template <int D> double loaded_area(const Material &material, double diameter)
  {
    return (D == 2 ? material.thickness : diameter) * diameter;
  }

}    // namespace

double reach_of(const Material &material)
{
  return with_law(material, [&](const auto &law) { return law.reach(material); });
}

template <int D> double contact_strain(double pressure, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return pressure * (D == 2 ? material.thickness : 2.0 * radius) /
          law.stiffness({0.0, radius, radius}).normal;
    // Newton's method from where even the softest law bears more: forces grow faster than overlaps, so that no step goes too far
    const double diameter = 2.0 * radius, force = pressure * loaded_area<D>(material, diameter);
    if (!(force > law.spring_force({0.0, radius, radius}))) return 0.0;
    double overlap = diameter;
    while (law.spring_force({overlap, radius, radius}) < force) overlap *= 2.0;
    for (double before = std::numeric_limits<double>::infinity(); overlap < before;) {
      before = overlap;
      const ContactPlace place{overlap, radius, radius};
      overlap -= (law.spring_force(place) - force) / law.stiffness(place).normal;
    }
    return overlap / diameter;
  });
}

template <int D> double contact_pressure(double strain, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return strain * law.stiffness({0.0, radius, radius}).normal /
          (D == 2 ? material.thickness : 2.0 * radius);
    const double diameter = 2.0 * radius;
    return law.spring_force({strain * diameter, radius, radius}) /
        loaded_area<D>(material, diameter);
  });
}

template <int D>
ContactModuli moduli_at_strain(double strain, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    return law.stiffness({2.0 * radius * strain, radius, radius});
  });
}

template double contact_strain<2>(double, const Material &, double);
template double contact_strain<3>(double, const Material &, double);
template double contact_pressure<2>(double, const Material &, double);
template double contact_pressure<3>(double, const Material &, double);
template ContactModuli moduli_at_strain<2>(double, const Material &, double);
template ContactModuli moduli_at_strain<3>(double, const Material &, double);

}    // namespace rve
