// SPDX-License-Identifier: GPL-2.0-only
// The triangular lattice of equal disks, whose stress and stiffness have closed forms.

#pragma once

#include "engine/test_states.h"

#include <cmath>
#include <vector>

namespace rve_test {

/// Returns 6 by 6 disks with one lattice direction along x; every contact has the overlap [length].
inline rve::RveState hexagonal_lattice(const rve::Material &material, double radius, double overlap)
{
  const int columns = 6, rows = 6;
  const double spacing = 2.0 * radius - overlap, height = std::sqrt(0.75) * spacing;
  std::vector<double> xy;
  for (int i = 0; i < columns * rows; ++i) {
    xy.push_back((i % columns + (i / columns % 2 ? 0.75 : 0.25)) * spacing);
    xy.push_back((i / columns + 0.5) * height);
  }
  return state_of(material, rve::Tensor2{{columns * spacing, 0.0, 0.0, rows * height}},
                  std::vector<double>(columns * rows, radius), xy);
}

/// Returns the pressure of hexagonal_lattice(), p = sqrt(3) k_n overlap / (l h) [stress]. A grain
/// has three contacts and the area sqrt(3)/2 l^2; l is the distance of neighbours and h the
/// thickness.
inline double lattice_pressure(const rve::Material &material, double radius, double overlap)
{
  return std::sqrt(3.0) * material.normal_stiffness * overlap /
      ((2.0 * radius - overlap) * material.thickness);
}

/// Returns the shear modulus of hexagonal_lattice() without overlap, G = sqrt(3)/4 (k_n + k_t) / h
/// [stress], with the thickness h.
inline double lattice_shear_modulus(const rve::Material &material)
{
  return 0.25 * std::sqrt(3.0) * (material.normal_stiffness + material.tangential_stiffness) /
      material.thickness;
}

}    // namespace rve_test
