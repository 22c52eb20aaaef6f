// SPDX-License-Identifier: GPL-2.0-only
// Oracle: the discrete Fourier transform by its definition, sum_j f_j exp(-2 pi i k j / m), along
// one axis after the other.

#pragma once

#include "field/grid.h"

#include <cmath>
#include <complex>
#include <vector>

namespace rve_test {

inline std::vector<std::complex<double>> fourier_transform(const field::Size &size,
                                                           const std::vector<double> &values)
{
  std::vector<std::complex<double>> f(values.begin(), values.end());
  for (int axis = 0; axis < 2; ++axis) {
    const std::int64_t m = size[axis], stride = axis == 0 ? 1 : size[0];
    std::vector<std::complex<double>> wave(m), line(m);
    for (std::int64_t k = 0; k < m; ++k)
      wave[k] = std::polar(1.0, -2.0 * M_PI * static_cast<double>(k) / static_cast<double>(m));
    for (std::int64_t other = 0; other < size[1 - axis]; ++other) {
      std::complex<double> *first = &f[other * (axis == 0 ? size[0] : 1)];
      for (std::int64_t k = 0; k < m; ++k) {
        line[k] = 0.0;
        for (std::int64_t j = 0; j < m; ++j) line[k] += first[j * stride] * wave[k * j % m];
      }
      for (std::int64_t k = 0; k < m; ++k) first[k * stride] = line[k];
    }
  }
  return f;
}

}    // namespace rve_test
