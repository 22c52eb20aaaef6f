// SPDX-License-Identifier: GPL-2.0-only
// Saturated ground of two layers at rest under its weight.

#pragma once

#include "scene.h"

namespace mpm_test {

/// Ground from y = 0 to `height` in two layers of equal thickness, with still water up to its
/// surface.
struct StillLayers {
  static constexpr double GRAVITY = 9.81, WATER = 1000.0, GRAINS = 2650.0;
  double height;

  double porosity(double y) const { return y < 0.5 * height ? 0.3 : 0.4; }
  double density(double y) const
  {
    const double n = porosity(y);
    return n * WATER + (1.0 - n) * GRAINS;
  }
  double pressure(double y) const { return WATER * GRAVITY * (height - y); }
  /// Returns the effective vertical stress, tension positive.
  double effective_stress(double y) const
  {
    const double middle = 0.5 * height, upper = GRAVITY * density(height);
    const double above = y < middle ? middle * upper + (middle - y) * GRAVITY * density(0.0)
                                    : (height - y) * upper;
    return pressure(y) - above;
  }

  /// Gives points their masses, weights, water and stresses. The lateral effective stress is `k0`
  /// times the vertical one.
  void fill(Scene &scene, const mpm::PoreWater &water, double k0) const
  {
    const auto pressure_at = [&](int p) { return pressure(scene.position[3 * p + 1]); };
    scene.fill_pores(water, 0.3, pressure_at);
    for (int p = 0; p < scene.size(); ++p) {
      const double y = scene.position[3 * p + 1];
      scene.mass[p] = density(y) * scene.volume[p];
      scene.body_force[3 * p + 1] = -GRAVITY * scene.mass[p];
      scene.grain_volume[p] = (1.0 - porosity(y)) * scene.volume[p];
      scene.water_volume[p] =
          mpm::water_volume_at(water, scene.volume[p] - scene.grain_volume[p], pressure_at(p));
      const double vertical = effective_stress(y);
      scene.stress[p] = {{k0 * vertical, 0.0, 0.0, vertical}};
    }
  }
};

}    // namespace mpm_test
