// SPDX-License-Identifier: GPL-2.0-only
// Access to the contact law of a material without an engine.

#pragma once

#include "rve/core/numbers.h"
#include "rve/engine/variant_choice.h"
#include "rve/engine/variant_configs.h"
#include "rve/physics/material.h"

#include <limits>

namespace rve {

/// Returns the contact law of a kernel variant in `double` and in units of the script.
template <KernelVariant variant> auto law_of_script(const Material &material)
{
  using Law = typename VariantConfig<variant, DoubleNumbers>::Law;
  // In the surface velocity, the lever arm of a spin is r - OF_CONTACT * overlap. Stiffnesses and
  // spring forces do not depend on it.
  constexpr double OF_CONTACT = 0.5;
  typename Law::Constants constants;
  constants.set(material, LawUnits::same(), OF_CONTACT);
  Law law{};
  law.take(constants);
  return law;
}

/// Calls work(law) and returns its result. `law` is the contact law of a material of disks or
/// spheres, with rolling resistance where the law supports it, in `double` and in units of the
/// script.
template <int D = 2, class Work> auto with_law(const Material &material, const Work &work)
{
  return with_variant<D>(richest_variant(material.law, D), [&](auto variant) {
    return work(law_of_script<variant.prepared_like>(material));
  });
}

/// Returns false if the stiffness of a contact depends on its overlap, as in Hertz' law.
template <int D = 2> bool has_constant_moduli(const Material &material)
{
  return with_law<D>(material, [](const auto &law) { return law.has_constant_moduli; });
}

/// Returns the largest gap at which grains act on each other [length].
inline double reach_of(const Material &material)
{
  return with_law(material, [&](const auto &law) { return law.reach(material); });
}

/// Returns the length by which a pressure is multiplied to give a force per length: the thickness
/// of disks, or the diameter of spheres [length].
template <int D> double loaded_depth(const Material &material, double diameter)
{
  return D == 2 ? material.thickness : diameter;
}

/// Returns overlap / diameter of two equal grains that a pressure p presses together [-]. The
/// contact force is p h d for disks of diameter d and thickness h, and p d^2 for spheres. Linear
/// springs of stiffness k_n give p h / k_n for disks and p d / k_n for spheres. In a packing at the
/// pressure p, let the mean of overlap / (sum of radii) be m times the returned value. For
/// frictionless stiff disks m is 0.9. If the returned value is 0.1, m is 0.6. In loose packings m
/// is 1.25.
template <int D = 2> double contact_strain(double pressure, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return pressure * loaded_depth<D>(material, 2.0 * radius) /
          law.stiffness({0.0, radius, radius}).normal;
    // Newton's method starts from an overlap whose force exceeds `force`. Forces grow faster than
    // overlaps, so no step overshoots.
    const double diameter = 2.0 * radius;
    const double force = pressure * (loaded_depth<D>(material, diameter) * diameter);
    if (!(force > law.spring_force({0.0, radius, radius}))) return 0.0;
    double overlap = diameter;
    while (law.spring_force({overlap, radius, radius}) < force) overlap *= 2.0;
    for (double before = std::numeric_limits<double>::infinity(); overlap < before;) {
      before = overlap;
      const ContactSite site{overlap, radius, radius};
      overlap -= (law.spring_force(site) - force) / law.stiffness(site).normal;
    }
    return overlap / diameter;
  });
}

/// Returns the pressure that gives this overlap over diameter [stress].
template <int D = 2> double contact_pressure(double strain, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    if constexpr (law.has_constant_moduli)
      return strain * law.stiffness({0.0, radius, radius}).normal /
          loaded_depth<D>(material, 2.0 * radius);
    const double diameter = 2.0 * radius;
    return law.spring_force({strain * diameter, radius, radius}) /
        (loaded_depth<D>(material, diameter) * diameter);
  });
}

/// Returns the spring stiffnesses of a contact with this overlap over diameter [force/length].
template <int D = 2>
ContactModuli moduli_at_strain(double strain, const Material &material, double radius)
{
  return with_law<D>(material, [&](const auto &law) {
    return law.stiffness({2.0 * radius * strain, radius, radius});
  });
}

}    // namespace rve
