// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the number of contacts and the Love stress of frictionless disks. It sums over all pairs
// and all near images, in double precision and Cartesian coordinates. It uses no list, no minimum
// image and no integer sums.

#pragma once

#include "rve/engine/state.h"

#include <cmath>

namespace rve_test {

struct LoveSum {
  int num_contacts = 0;
  rve::Tensor2 stress = rve::Tensor2::zero();    ///< tension positive
};

inline LoveSum love_sum(const rve::RveState &state)
{
  LoveSum sum;
  const std::vector<double> x = state.positions();
  const double volume = state.cell_volume() * state.material.thickness;
  for (int i = 0; i < state.num_grains(); ++i)
    for (int j = i + 1; j < state.num_grains(); ++j)
      for (int p = -2; p <= 2; ++p)
        for (int q = -2; q <= 2; ++q) {
          double b[2];
          for (int a = 0; a < 2; ++a)
            b[a] = x[2 * j + a] - x[2 * i + a] + state.cell(a, 0) * p + state.cell(a, 1) * q;
          const double distance = std::hypot(b[0], b[1]);
          const double overlap = state.radius[i] + state.radius[j] - distance;
          if (overlap <= 0.0) continue;
          ++sum.num_contacts;
          for (int a = 0; a < 2; ++a)
            for (int c = 0; c < 2; ++c)
              sum.stress(a, c) -=
                  state.material.normal_stiffness * overlap * b[a] / distance * b[c] / volume;
        }
  return sum;
}

}    // namespace rve_test
