// SPDX-License-Identifier: GPL-2.0-only
// Stationary Gaussian fields by circulant embedding. The covariance matrix of the nodes of a
// regular grid is a part of that of a torus at least twice as large, which the Fourier transform
// diagonalizes: C = F^-1 diag(lambda) F. If no eigenvalue lambda is negative, X = F^-1
// diag(sqrt(lambda)) F w with normal random numbers w on the torus has the covariance C to
// rounding.
//   Dietrich & Newsam, SIAM J. Sci. Comput. 18, 1088 (1997)
//   Wood & Chan, J. Comput. Graph. Stat. 3, 409 (1994)

#pragma once

#include "field/covariance.h"
#include "field/fft.h"
#include "field/grid.h"

#include <cstdint>
#include <vector>

namespace field {

/// Eigenvalues of one torus.
struct TorusReport {
  Size points{};
  std::int64_t num_negative = 0;    ///< number of eigenvalues below -tolerance
  std::int64_t num_rounded = 0;     ///< number from -tolerance to 0: they are zero but for rounding
  double smallest = 0.0, largest = 0.0;
  double tolerance = 0.0;    ///< bound of rounding errors of the transform
  /// Bound of the change of any covariance by setting `num_rounded` eigenvalues to zero.
  double covariance_error = 0.0;
};

class CirculantEmbedding {
 public:
  /// Default of the largest number of points of a torus, which takes 2.4 GB during the generation.
  static constexpr std::int64_t DEFAULT_LIMIT = 200000000;

  /// Enlarges the torus until no eigenvalue is negative beyond round-off. Throws InputError if that
  /// needs more points than `limit`.
  CirculantEmbedding(const Grid &grid, const Covariance &covariance,
                     std::int64_t limit = DEFAULT_LIMIT);

  /// Tori that were tried. The last one is used.
  const std::vector<TorusReport> &trials() const { return trials_; }
  const Size &torus() const { return trials_.back().points; }
  /// Difference of the number of points between the last and the first torus.
  Size padding() const;

  /// Returns a field on the nodes in the order of Grid::index, with mean 0 and variance 1.
  std::vector<double> sample(std::uint64_t seed);

  /// Linear map from noise on the torus to the field on the torus, both with x as the fastest
  /// index. Throws InputError if `noise` has another size.
  std::vector<double> field_on_torus(const std::vector<double> &noise);

 private:
  TorusReport decompose(const Covariance &covariance);
  void color_noise();

  Grid grid_;
  RealFft fft_;
  /// sqrt(lambda) / (number of points) of the wave numbers that fft_ keeps.
  std::vector<double> root_;
  std::vector<TorusReport> trials_;
};

}    // namespace field
