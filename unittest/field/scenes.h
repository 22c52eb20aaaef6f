// SPDX-License-Identifier: GPL-2.0-only
// Grids and covariances that several tests of random fields use.

#pragma once

#include "field/circulant_embedding.h"
#include "field/covariance.h"
#include "field/grid.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rve_test {

inline field::Grid grid_of(std::int64_t nx, std::int64_t ny, double dx = 1.0, double dy = 1.0)
{
  field::Grid grid;
  grid.origin = {-3.0, 7.0};
  grid.spacing = {dx, dy};
  grid.nodes = {nx, ny};
  return grid;
}

/// Returns one covariance of each kind. All have the same correlation lengths; `angle` is the
/// direction of the first length.
inline std::vector<field::Covariance> all_covariances(const field::Vec &length, double angle = 0.0)
{
  const field::Anisotropy ellipse(length, angle);
  return {{field::Exponential{}, ellipse},
          {field::Gaussian{}, ellipse},
          {field::Matern(1.5), ellipse},
          {field::Matern(0.8), ellipse}};
}

/// Returns the message of the InputError that a call throws, or "" if it throws none.
template <class Call> std::string input_error(const Call &call)
{
  try {
    call();
  } catch (const rve::InputError &problem) {
    return problem.what();
  }
  return "";
}

inline void expect_message(const std::string &message, const std::string &part)
{
  EXPECT_NE(message.find(part), std::string::npos)
      << "expected '" << part << "' in '" << message << "'";
}

/// Sums a function of the lag over all ordered pairs of nodes in a rectangle of nx by ny nodes. The
/// lag (i, j), in nodes, occurs (nx - |i|) (ny - |j|) times.
template <class Function>
double sum_over_pairs(std::int64_t nx, std::int64_t ny, const Function &function)
{
  double sum = 0.0;
  for (std::int64_t j = 1 - ny; j < ny; ++j)
    for (std::int64_t i = 1 - nx; i < nx; ++i)
      sum += static_cast<double>((nx - std::abs(i)) * (ny - std::abs(j))) * function(i, j);
  return sum;
}

}    // namespace rve_test
