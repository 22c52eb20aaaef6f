#include "rve/engine/contact_laws.h"

#include <limits>

namespace rve {

double contact_strain(double pressure, const Material &material, double radius)
{
  return with_law(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return pressure * material.thickness / law.stiffness({0.0, radius, radius}).normal;
    // Newton's method from where even the softest law bears more: forces grow faster than overlaps, so that no step goes too far
    const double diameter = 2.0 * radius, force = pressure * material.thickness * diameter;
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

double contact_pressure(double strain, const Material &material, double radius)
{
  return with_law(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return strain * law.stiffness({0.0, radius, radius}).normal / material.thickness;
    const double diameter = 2.0 * radius;
    return law.spring_force({strain * diameter, radius, radius}) / (material.thickness * diameter);
  });
}

ContactModuli moduli_at_strain(double strain, const Material &material, double radius)
{
  return with_law(material, [&](const auto &law) {
    return law.stiffness({2.0 * radius * strain, radius, radius});
  });
}

}    // namespace rve
