// SPDX-License-Identifier: GPL-2.0-only
// Values between the nodes: shape functions, the nearest node, and the variance at any position.

#include "field/interpolation.h"
#include "scenes.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

using field::Grid;
using field::Interpolation;
using field::InterpolationKind;
using field::Vec;

namespace {

const Grid grid = rve_test::grid_of(6, 5, 0.5, 0.25);

std::vector<Vec> positions()
{
  rve_test::Random random(1);
  std::vector<Vec> all;
  for (int k = 0; k < 200; ++k)
    all.push_back({random.uniform(grid.origin[0], grid.origin[0] + grid.extent(0)),
                   random.uniform(grid.origin[1], grid.origin[1] + grid.extent(1))});
  for (const double s : {0.0, 0.5, 1.0})
    for (const double t : {0.0, 0.5, 1.0})
      all.push_back({grid.origin[0] + s * grid.extent(0), grid.origin[1] + t * grid.extent(1)});
  return all;
}

std::vector<double> on_nodes(double (*f)(double, double))
{
  std::vector<double> values;
  for (int j = 0; j < grid.nodes[1]; ++j)
    for (int i = 0; i < grid.nodes[0]; ++i)
      values.push_back(f(grid.origin[0] + 0.5 * i, grid.origin[1] + 0.25 * j));
  return values;
}

double bilinear(double x, double y)
{
  return 1.0 + 2.0 * x - 3.0 * y + 0.5 * x * y;
}

}    // namespace

TEST(Interpolation, ShapeFunctionsReproduceABilinearFunction)
{
  const std::vector<double> nodes = on_nodes(bilinear);
  for (const Vec &x : positions()) {
    const field::Stencil stencil = linear_stencil(grid, x);

    double value = 0.0;
    for (int a = 0; a < 4; ++a) value += stencil.weight[a] * nodes.at(stencil.node[a]);

    EXPECT_NEAR(value, bilinear(x[0], x[1]), 1e-13);
    EXPECT_NEAR(std::accumulate(stencil.weight.begin(), stencil.weight.end(), 0.0), 1.0, 1e-15);
    EXPECT_GE(*std::min_element(stencil.weight.begin(), stencil.weight.end()), 0.0);
  }
}

TEST(Interpolation, BothKindsReproduceNodalValues)
{
  const std::vector<double> nodes = on_nodes(bilinear);
  const field::Covariance covariance = rve_test::all_covariances({1.0, 1.0})[0];
  for (const auto kind : {InterpolationKind::Linear, InterpolationKind::Nearest}) {
    const Interpolation interpolation(kind, grid, covariance);
    for (int j = 0; j < grid.nodes[1]; ++j)
      for (int i = 0; i < grid.nodes[0]; ++i)
        // multiples of 1/4 are exact
        EXPECT_EQ(interpolation.value(nodes, {grid.origin[0] + 0.5 * i, grid.origin[1] + 0.25 * j}),
                  nodes[grid.index({i, j})]);
  }
}

TEST(Interpolation, NearestNodeIsTheNearest)
{
  for (const Vec &x : positions()) {
    const std::int64_t node = nearest_node(grid, x);
    const double i = static_cast<double>(node % grid.nodes[0]),
                 j = static_cast<double>(node / grid.nodes[0]);

    EXPECT_LE(std::fabs(x[0] - (grid.origin[0] + 0.5 * i)), 0.25 + 1e-12);
    EXPECT_LE(std::fabs(x[1] - (grid.origin[1] + 0.25 * j)), 0.125 + 1e-12);
  }
}

TEST(Interpolation, VarianceIsOneAtEveryPosition)
{
  for (const double angle : {0.0, 35.0})
    for (const field::Covariance &covariance : rve_test::all_covariances({1.5, 0.6}, angle)) {
      const Interpolation interpolation(InterpolationKind::Linear, grid, covariance);
      const std::int64_t count = field::total(grid.nodes);
      for (const Vec &x : positions()) {
        // The value is w^T f, with the nodal values f and a vector w. Its variance is therefore w^T
        // C w, with the covariance matrix C of the nodes.
        std::vector<double> unit(count, 0.0), weight(count);
        for (std::int64_t k = 0; k < count; ++k) {
          unit[k] = 1.0;
          weight[k] = interpolation.value(unit, x);
          unit[k] = 0.0;
        }
        double variance = 0.0, plain = 0.0, sum = 0.0;
        for (const double w : weight) sum += w;
        for (std::int64_t a = 0; a < count; ++a)
          for (std::int64_t b = 0; b < count; ++b) {
            const Vec lag{0.5 * static_cast<double>(b % grid.nodes[0] - a % grid.nodes[0]),
                          0.25 * static_cast<double>(b / grid.nodes[0] - a / grid.nodes[0])};
            variance += weight[a] * weight[b] * covariance(lag);
            plain += weight[a] * weight[b] * covariance(lag) / (sum * sum);
          }
        EXPECT_NEAR(variance, 1.0, 1e-14) << covariance.name();
        EXPECT_LE(plain, 1.0 + 1e-14) << "shape functions alone would smooth";
      }
    }
}

TEST(Grid, CoversItsDomainAndFindsPointsInside)
{
  const Grid covering = Grid::covering({0.0, -1.0}, {1.0, 1.05}, {0.1, 0.1});

  EXPECT_EQ(covering.nodes, (field::Size{11, 22}));
  EXPECT_TRUE(covering.contains({0.0, -1.0}));
  EXPECT_TRUE(covering.contains({1.0, 1.05}));
  EXPECT_FALSE(covering.contains({-0.001, 0.0}));
  EXPECT_FALSE(covering.contains({0.5, 1.101}));
  EXPECT_FALSE(covering.contains({NAN, 0.0}));
}
