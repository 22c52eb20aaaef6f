// SPDX-License-Identifier: GPL-2.0-only
// Packings that several tests start from.

#pragma once

#include "rve/engine/packing_io.h"
#include "support/random.h"

#include <cmath>
#include <string>
#include <vector>

namespace rve_test {

/// Returns 400 disks of 2.5 to 5 mm at 100 kPa (examples/packings), void ratio 0.16.
inline rve::RveState packing_of_400()
{
  return rve::read_packing(std::string(RVE_PACKINGS_DIR) + "/A_h0075.rve");
}

/// Returns nx by ny copies next to each other, without list and contact history.
inline rve::RveState tiled(const rve::RveState &tile, int nx, int ny)
{
  rve::RveState state = tile;
  state.radius.clear();
  state.velocity.clear();
  state.spin.clear();
  state.pairs.clear();
  state.list_cell = rve::Tensor2::zero();
  state.list_fractional.clear();
  const std::vector<double> xy = tile.positions();
  std::vector<double> positions;
  for (int ky = 0; ky < ny; ++ky)
    for (int kx = 0; kx < nx; ++kx)
      for (int i = 0; i < tile.num_grains(); ++i) {
        state.radius.push_back(tile.radius[i]);
        state.spin.push_back(tile.spin[i]);
        for (int a = 0; a < 2; ++a) {
          positions.push_back(xy[2 * i + a] + kx * tile.cell(a, 0) + ky * tile.cell(a, 1));
          state.velocity.push_back(tile.velocity[2 * i + a]);
        }
      }
  for (int a = 0; a < 2; ++a) {
    state.cell(a, 0) *= nx;
    state.cell(a, 1) *= ny;
  }
  state.set_positions(positions);
  return state;
}

/// Returns nx by ny disks (ny even) on a triangular lattice with a mean overlap of 1 %; radii vary
/// by about 8 %.
inline rve::RveState triangular_packing(const rve::Material &material, int nx, int ny,
                                        double radius, std::uint64_t seed)
{
  Random random(seed);
  rve::RveState state;
  state.material = material;
  const double spacing = 1.98 * radius;
  state.cell = rve::Tensor2{{nx * spacing, 0.0, 0.0, ny * spacing * std::sqrt(0.75)}};
  std::vector<double> positions;
  for (int k = 0; k < nx * ny; ++k) {
    state.radius.push_back(radius * random.uniform(0.96, 1.04));
    state.spin.push_back(0.0);
    state.velocity.insert(state.velocity.end(), 2, 0.0);
    const int row = k / nx;
    positions.push_back((k % nx + 0.5 * (row % 2)) * spacing);
    positions.push_back(row * spacing * std::sqrt(0.75));
  }
  state.set_positions(positions);
  return state;
}

/// Adds random velocities and spins, so that nothing is symmetric and grains move at once.
inline void shake(rve::RveState &state, double speed, std::uint64_t seed)
{
  Random random(seed);
  for (double &c : state.velocity) c = random.uniform(-speed, speed);
  for (int i = 0; i < state.num_grains(); ++i)
    state.spin[i] = random.uniform(-speed, speed) / state.radius[i];
}

inline double mean_radius(const rve::RveState &state)
{
  double sum = 0.0;
  for (double r : state.radius) sum += r;
  return sum / state.num_grains();
}

}    // namespace rve_test
