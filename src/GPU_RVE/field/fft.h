// SPDX-License-Identifier: GPL-2.0-only
// In-place Fourier transforms of real numbers by FFTW. They use one thread, FFTW_ESTIMATE and no
// wisdom, so the plan and the bits of the results depend only on the sizes and the processor.

#pragma once

#include "field/grid.h"

#include <complex>
#include <memory>

namespace field {

class RealFft {
 public:
  explicit RealFft(const Size &points);

  /// Number of rows, which run along x.
  std::int64_t num_rows() const { return num_rows_; }
  std::int64_t row_length() const { return row_length_; }
  /// Number of wave numbers along x that are stored. The coefficients of the others are complex
  /// conjugates of the stored ones.
  std::int64_t half_length() const { return row_length_ / 2 + 1; }

  double *row(std::int64_t row);
  std::complex<double> *spectrum(std::int64_t row);

  /// Transforms rows to the spectrum. The coefficient at wave numbers k is the sum over all points
  /// j of the value at j times exp(-2 pi i sum_a k_a j_a / m_a), where m_a is the number of points
  /// along axis a.
  void forward();
  /// Transforms the spectrum to rows, without the factor 1 / (number of points).
  void backward();

 private:
  struct Plans;
  std::shared_ptr<Plans>
      plans_;    // unlike unique_ptr, it can delete a type that is incomplete here
  std::int64_t num_rows_, row_length_;
};

}    // namespace field
