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

/// Returns all kinds of covariance with the same ellipse: correlation lengths and the angle of the
/// first one.
inline std::vector<field::Covariance> all_covariances(const field::Vec &length, double angle = 0.0)
{
  const field::Anisotropy ellipse(length, angle);
  return {{field::Exponential{}, ellipse},
          {field::Gaussian{}, ellipse},
          {field::Matern(1.5), ellipse},
          {field::Matern(0.8), ellipse}};
}

/// Returns the message of the InputError in which a call ends, "" without an error.
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

/// Returns the sum of a function of the lag in nodes over all pairs of points of two equal
/// rectangles of nx by ny nodes. Each lag (i, j) occurs (nx - |i|) (ny - |j|) times.
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
