// SPDX-License-Identifier: GPL-2.0-only
// Real Fourier transforms by FFTW, in place. One thread, FFTW_ESTIMATE and no wisdom: the plan, and with it every bit, depends on the sizes
// and the processor only.

#pragma once

#include "field/grid.h"

#include <complex>
#include <memory>

namespace field {

class RealFft {
 public:
  explicit RealFft(const Size &points);

  /// Rows run along x; there is one for each place along the other axes.
  std::int64_t num_rows() const { return num_rows_; }
  std::int64_t row_length() const { return row_length_; }
  /// Number of wave numbers that are kept in x: the others are the complex conjugates.
  std::int64_t half_length() const { return row_length_ / 2 + 1; }

  double *row(std::int64_t row);
  std::complex<double> *spectrum(std::int64_t row);

  /// From rows to spectrum: sum of the values times exp(-2 pi i k.j / m).
  void forward();
  /// From spectrum to rows, without the factor 1 / (number of points).
  void backward();

 private:
  struct Plans;
  std::shared_ptr<Plans> plans_;    // shared_ptr: its deleter knows the type that is unknown here
  std::int64_t num_rows_, row_length_;
};

}    // namespace field
