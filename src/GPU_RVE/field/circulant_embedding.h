// SPDX-License-Identifier: GPL-2.0-only
// Stationary Gaussian fields by circulant embedding. The regular grid of the field is a part of a
// periodic grid, the torus. Along an axis with n grid points, the torus has at least 2 (n - 1)
// points. The Fourier transform F diagonalizes the covariance matrix C of the torus:
//   C = F^-1 diag(lambda) F,
// where lambda are the eigenvalues. If no eigenvalue is negative, the field on the torus is
//   X = F^-1 diag(sqrt(lambda)) F w,
// where w are independent normal random numbers, one for each point of the torus. X has the
// covariance C except for rounding.
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
  std::int64_t num_rounded = 0;     ///< number in [-tolerance, 0): zero within rounding errors
  double smallest = 0.0, largest = 0.0;
  double tolerance = 0.0;    ///< bound of rounding errors of the transform
  /// If negative eigenvalues are set to zero, no covariance between two points changes by more than
  /// this [-].
  double covariance_error = 0.0;
};

class CirculantEmbedding {
 public:
  /// Default limit of the number of points of a torus. A torus of this size needs 2.4 GB of memory.
  static constexpr std::int64_t DEFAULT_LIMIT = 200000000;

  /// Enlarges the torus until no eigenvalue is negative beyond round-off. Throws InputError if that
  /// needs more points than `limit`.
  CirculantEmbedding(const Grid &grid, const Covariance &covariance,
                     std::int64_t limit = DEFAULT_LIMIT);

  /// Tori that were tried. The last one is used.
  const std::vector<TorusReport> &trials() const { return trials_; }
  const Size &torus() const { return trials_.back().points; }
  /// Number of points along each axis that the last torus has in addition to those of the first
  /// torus.
  Size padding() const;

  /// Returns a field on the nodes in the order of Grid::index, with mean 0 and variance 1.
  std::vector<double> sample(std::uint64_t seed);

  /// Maps noise on the torus linearly to the field on the torus. In both arrays x is the fastest
  /// index. Throws InputError if `noise` has another size.
  std::vector<double> field_on_torus(const std::vector<double> &noise);

 private:
  TorusReport decompose(const Covariance &covariance);
  void color_noise();

  Grid grid_;
  RealFft fft_;
  /// sqrt(lambda) / (number of points) for each wave number that fft_ stores.
  std::vector<double> root_;
  std::vector<TorusReport> trials_;
};

}    // namespace field
