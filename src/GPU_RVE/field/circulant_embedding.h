// SPDX-License-Identifier: GPL-2.0-only
// Stationary Gaussian fields by circulant embedding. The covariance matrix of the nodes of a regular grid is a part of that of a torus at
// least twice as large, which the Fourier transform diagonalizes: C = F^-1 diag(lambda) F. So X = F^-1 diag(sqrt(lambda)) F w, of normal
// random numbers w on the torus, has the covariance C, without any error but rounding, if no eigenvalue lambda is negative.
//   Dietrich & Newsam, SIAM J. Sci. Comput. 18, 1088 (1997); Wood & Chan, J. Comput. Graph. Stat. 3, 409 (1994)

#pragma once

#include "field/covariance.h"
#include "field/fft.h"
#include "field/grid.h"

#include <cstdint>
#include <vector>

namespace field {

/// The eigenvalues of one torus.
struct TorusReport {
  Size points{};
  std::int64_t num_negative = 0;    ///< below -tolerance
  std::int64_t num_rounded = 0;     ///< from -tolerance to 0: zero but for rounding
  double smallest = 0.0, largest = 0.0;
  double tolerance = 0.0;    ///< what is rounding of the transform
  /// Bound of what setting `num_rounded` eigenvalues to zero changes in any covariance.
  double covariance_error = 0.0;
};

class CirculantEmbedding {
 public:
  /// Number of points that a torus has at most unless said otherwise: 2.4 GB during the generation.
  static constexpr std::int64_t DEFAULT_LIMIT = 200000000;

  /// Enlarges the torus until no eigenvalue is negative. Throws InputError if the limit of its points does not suffice for that.
  CirculantEmbedding(const Grid &grid, const Covariance &covariance,
                     std::int64_t limit = DEFAULT_LIMIT);

  /// The tori that were tried; the last one is used.
  const std::vector<TorusReport> &trials() const { return trials_; }
  const Size &torus() const { return trials_.back().points; }
  /// The torus without negative eigenvalues, less the one that was tried first.
  Size padding() const;

  /// The field on the nodes, as Grid::index places them: mean 0, variance 1.
  std::vector<double> sample(std::uint64_t seed);

  /// What makes the field of the noise, a linear map: noise on the torus to the field on the torus, both with x running fastest.
  std::vector<double> field_on_torus(const std::vector<double> &noise);

 private:
  TorusReport decompose(const Covariance &covariance);
  void color_noise();

  Grid grid_;
  RealFft fft_;
  /// sqrt(lambda) / (number of points), for the wave numbers that fft_ keeps.
  std::vector<double> root_;
  std::vector<TorusReport> trials_;
};

}    // namespace field
