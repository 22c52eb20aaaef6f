// SPDX-License-Identifier: GPL-2.0-only
// Oracle: dense matrices with simple algorithms. Tests use them for the covariance matrix of all
// nodes of a grid and for its Cholesky factor.

#pragma once

#include "field/covariance.h"
#include "field/grid.h"

#include <cmath>
#include <stdexcept>
#include <vector>

namespace rve_test {

using Matrix = std::vector<std::vector<double>>;    ///< by rows

inline std::vector<field::Vec> node_positions(const field::Grid &grid)
{
  std::vector<field::Vec> positions;
  for (int j = 0; j < grid.nodes[1]; ++j)
    for (int i = 0; i < grid.nodes[0]; ++i)
      positions.push_back(
          {grid.origin[0] + i * grid.spacing[0], grid.origin[1] + j * grid.spacing[1]});
  return positions;
}

inline Matrix covariance_matrix(const field::Grid &grid, const field::Covariance &covariance)
{
  const std::vector<field::Vec> x = node_positions(grid);
  Matrix c(x.size(), std::vector<double>(x.size()));
  for (std::size_t a = 0; a < x.size(); ++a)
    for (std::size_t b = 0; b < x.size(); ++b)
      c[a][b] = covariance({x[b][0] - x[a][0], x[b][1] - x[a][1]});
  return c;
}

/// Returns the lower triangular L with L L^T = a; throws if a is not positive definite.
inline Matrix cholesky_factor(const Matrix &a)
{
  Matrix l(a.size(), std::vector<double>(a.size(), 0.0));
  for (std::size_t j = 0; j < a.size(); ++j)
    for (std::size_t i = j; i < a.size(); ++i) {
      double rest = a[i][j];
      for (std::size_t k = 0; k < j; ++k) rest -= l[i][k] * l[j][k];
      if (i == j && !(rest > 0.0)) throw std::domain_error("matrix is not positive definite");
      l[i][j] = i == j ? std::sqrt(rest) : rest / l[j][j];
    }
  return l;
}

/// Returns L^-1 b by forward substitution in each column.
inline Matrix solve_lower(const Matrix &l, Matrix b)
{
  for (std::size_t column = 0; column < b[0].size(); ++column)
    for (std::size_t i = 0; i < b.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) b[i][column] -= l[i][k] * b[k][column];
      b[i][column] /= l[i][i];
    }
  return b;
}

/// Returns a a^T.
inline Matrix times_own_transpose(const Matrix &a)
{
  Matrix product(a.size(), std::vector<double>(a.size(), 0.0));
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < a.size(); ++j)
      for (std::size_t k = 0; k < a[i].size(); ++k) product[i][j] += a[i][k] * a[j][k];
  return product;
}

inline Matrix identity(std::size_t size)
{
  Matrix one(size, std::vector<double>(size, 0.0));
  for (std::size_t i = 0; i < size; ++i) one[i][i] = 1.0;
  return one;
}

inline double largest_difference(const Matrix &a, const Matrix &b)
{
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < a[i].size(); ++j)
      largest = std::fmax(largest, std::fabs(a[i][j] - b[i][j]));
  return largest;
}

}    // namespace rve_test
