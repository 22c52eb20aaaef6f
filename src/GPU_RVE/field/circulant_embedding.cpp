// SPDX-License-Identifier: GPL-2.0-only
#include "field/circulant_embedding.h"

#include "field/normal_numbers.h"
#include "rve/core/error.h"

#include <algorithm>
#include <limits>

namespace field {

namespace {

  /// Smallest even number >= least whose prime factors are 2, 3, 5 and 7, for which FFTW is fast.
  /// Returns MAX_POINTS + 1 if `least` exceeds the limit of FFTW.
  std::int64_t good_size(double least)
  {
    if (least > static_cast<double>(MAX_POINTS)) return MAX_POINTS + 1;
    for (auto size = 2 * static_cast<std::int64_t>(std::ceil(0.5 * least));; size += 2) {
      std::int64_t rest = size;
      for (const int factor : {2, 3, 5, 7})
        while (rest % factor == 0) rest /= factor;
      if (rest == 1) return size;
    }
  }

  /// Number of points of the torus along each axis. The torus contains all lags of the grid and in
  /// addition `padding` correlation lengths.
  Size torus_size(const Grid &grid, const Anisotropy &anisotropy, double padding)
  {
    Size points;
    for (int a = 0; a < AXES; ++a) {
      // The lags n-1 and 1-n must not share a point of the torus unless their covariances are
      // equal. They are equal if the axes of the ellipse are along x and y. Otherwise one more
      // point keeps them apart.
      const double lags =
          2.0 * static_cast<double>(grid.nodes[a] - 1) + (anisotropy.is_aligned() ? 0.0 : 1.0);
      points[a] = good_size(lags + padding * anisotropy.half_width(a) / grid.spacing[a]);
    }
    return points;
  }

  /// total() without overflow.
  double points_of(const Size &size)
  {
    double product = 1.0;
    for (const std::int64_t points : size) product *= static_cast<double>(points);
    return product;
  }

  /// Returns the torus. Throws InputError if it has more points than `limit` or FFTW allows.
  Size within(const Size &torus, std::int64_t limit, const std::vector<TorusReport> &trials)
  {
    const auto longest = *std::max_element(torus.begin(), torus.end());
    if (longest <= MAX_POINTS && points_of(torus) <= static_cast<double>(limit)) return torus;
    std::string reason = "the covariance needs a torus of ";
    if (!trials.empty()) {
      const TorusReport &last = trials.back();
      reason = "the embedding on a torus of " + to_string(last.points) + " points has " +
          std::to_string(last.num_negative) + " negative eigenvalues, down to " +
          rve::number(last.smallest) + " (largest " + rve::number(last.largest) +
          "); the next torus has ";
    }
    throw rve::InputError(
        rve::concat(reason, to_string(torus), " points, above the limit of ", limit,
                    ": use a higher limit, a larger spacing or smaller correlation lengths"));
  }

  /// First torus, without padding.
  Size first_torus(const Grid &grid, const Covariance &covariance, std::int64_t limit)
  {
    covariance.check(grid);
    return within(torus_size(grid, covariance.anisotropy, 0.0), limit, {});
  }

}    // namespace

CirculantEmbedding::CirculantEmbedding(const Grid &grid, const Covariance &covariance,
                                       std::int64_t limit) :
    grid_(grid),
    fft_(first_torus(grid, covariance, limit))
{
  // The kink of the covariance half way round the torus makes eigenvalues negative, so padding is
  // measured in correlation lengths. Sufficient padding makes all eigenvalues positive (Graham et
  // al., SIAM J. Numer. Anal. 56, 1871 (2018)).
  Size torus = torus_size(grid, covariance.anisotropy, 0.0);
  for (double padding = 1.0;; padding += std::max(1.0, std::floor(0.25 * padding))) {
    trials_.push_back({});
    trials_.back().points = torus;
    trials_.back() = decompose(covariance);
    if (trials_.back().num_negative == 0) break;
    Size larger = torus_size(grid, covariance.anisotropy, padding);
    while (larger == torus) larger = torus_size(grid, covariance.anisotropy, padding += 1.0);
    torus = within(larger, limit, trials_);
    fft_ = RealFft({2, 2});    // frees the memory of the smaller torus first
    fft_ = RealFft(torus);
  }

  root_.resize(static_cast<std::size_t>(fft_.num_rows() * fft_.half_length()));
  double *root = root_.data();
  const double points = points_of(torus);
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row) {
    const std::complex<double> *eigenvalue = fft_.spectrum(row);
    for (std::int64_t k = 0; k < fft_.half_length(); ++k)
      *root++ = std::sqrt(std::max(eigenvalue[k].real(), 0.0)) / points;
  }
}

Size CirculantEmbedding::padding() const
{
  Size padding;
  for (int a = 0; a < AXES; ++a) padding[a] = trials_.back().points[a] - trials_.front().points[a];
  return padding;
}

/// Computes the eigenvalues of the covariance on the last torus. They stay in fft_.
TorusReport CirculantEmbedding::decompose(const Covariance &covariance)
{
  const Size torus = trials_.back().points;
  const auto lag = [&](int axis, std::int64_t j) {
    return static_cast<double>(2 * j <= torus[axis] ? j : j - torus[axis]) * grid_.spacing[axis];
  };
  const std::int64_t half_x = torus[0] / 2, half_y = torus[1] / 2;
  const bool aligned = covariance.anisotropy.is_aligned();

  // Covariances are computed for lags x from 0 to half way round the torus. The others follow from
  // C(-x, -y) = C(x, y). Half way round, the lags x and -x are the same point. The point gets the
  // mean of the covariances of both lags, which keeps the symmetry C(-x, -y) = C(x, y).
  const auto fill = [&](const auto &function) {
    const auto value = [&](double x, double y) {
      return function(covariance.anisotropy.distance({x, y}));
    };
    for (std::int64_t j = 0; j < (aligned ? half_y + 1 : torus[1]); ++j) {
      double *row = fft_.row(j);
      const double y = lag(1, j);
      for (std::int64_t i = 0; i <= half_x; ++i) {
        const double x = lag(0, i);
        row[i] = value(x, y);
        if (!aligned && (i == half_x || j == half_y)) row[i] = 0.5 * (row[i] + value(-x, y));
      }
    }
  };
  std::visit(fill, covariance.function);
  for (std::int64_t j = aligned ? half_y + 1 : torus[1]; j < torus[1]; ++j)
    std::copy_n(fft_.row(torus[1] - j), half_x + 1, fft_.row(j));
  for (std::int64_t j = 0; j < torus[1]; ++j) {
    double *row = fft_.row(j);
    const double *mirror = fft_.row(j == 0 ? 0 : torus[1] - j);
    for (std::int64_t i = half_x + 1; i < torus[0]; ++i) row[i] = mirror[torus[0] - i];
  }

  TorusReport report;
  report.points = torus;
  double magnitude = 0.0;
  for (std::int64_t j = 0; j < torus[1]; ++j)
    for (std::int64_t i = 0; i < torus[0]; ++i) magnitude += std::fabs(fft_.row(j)[i]);
  // The rounding error of the transform is at most log2(N) epsilon times the sum of these
  // magnitudes (Higham, Accuracy and Stability of Numerical Algorithms (2002), theorem 24.2).
  // Measured errors are some hundred times smaller.
  report.tolerance =
      std::log2(points_of(torus)) * std::numeric_limits<double>::epsilon() * magnitude;

  fft_.forward();
  report.smallest = std::numeric_limits<double>::infinity();
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row) {
    const std::complex<double> *eigenvalue = fft_.spectrum(row);
    for (std::int64_t k = 0; k < fft_.half_length(); ++k) {
      const double lambda = eigenvalue[k].real();
      // the conjugate of a wave number has the same eigenvalue and is not stored, except at the
      // ends of a row
      const int times = k == 0 || 2 * k == torus[0] ? 1 : 2;
      report.smallest = std::min(report.smallest, lambda);
      report.largest = std::max(report.largest, lambda);
      if (lambda >= 0.0) continue;
      (lambda < -report.tolerance ? report.num_negative : report.num_rounded) += times;
      report.covariance_error -= times * lambda / points_of(torus);
    }
  }
  return report;
}

/// Transforms noise on the torus in fft_ to the field on the torus.
void CirculantEmbedding::color_noise()
{
  fft_.forward();
  const double *root = root_.data();
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row) {
    std::complex<double> *amplitude = fft_.spectrum(row);
    for (std::int64_t k = 0; k < fft_.half_length(); ++k) amplitude[k] *= *root++;
  }
  fft_.backward();
}

std::vector<double> CirculantEmbedding::sample(std::uint64_t seed)
{
  NormalNumbers normal(seed);
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row)
    normal.fill(fft_.row(row), fft_.row_length());
  color_noise();
  std::vector<double> field;
  field.reserve(static_cast<std::size_t>(total(grid_.nodes)));
  for (std::int64_t j = 0; j < grid_.nodes[1]; ++j)
    field.insert(field.end(), fft_.row(j), fft_.row(j) + grid_.nodes[0]);
  return field;
}

std::vector<double> CirculantEmbedding::field_on_torus(const std::vector<double> &noise)
{
  rve::require(noise.size() == static_cast<std::size_t>(total(torus())),
               "noise must have one number for each of the ", total(torus()),
               " points of the torus, got ", noise.size());
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row)
    std::copy_n(&noise[row * fft_.row_length()], fft_.row_length(), fft_.row(row));
  color_noise();
  std::vector<double> field;
  field.reserve(noise.size());
  for (std::int64_t row = 0; row < fft_.num_rows(); ++row)
    field.insert(field.end(), fft_.row(row), fft_.row(row) + fft_.row_length());
  return field;
}

}    // namespace field
