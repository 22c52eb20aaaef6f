// Points to nodes: what the integer sums keep exactly.

#include "mpm/grid_transfer.h"

#include <gtest/gtest.h>
#include <numeric>
#include <random>

using Grid = mpm::Grid<2>;
using mpm::ShapeFunction;
using Support = mpm::Support<2>;
using mpm::Vec2;
using rve::FixedScale;

namespace {

const Grid GRID({{0.0, 0.0}}, {{4.0, 3.0}}, 0.5);
constexpr int POINTS = 500;

/// Weights of random points, and of points on nodes, edges and corners of the grid.
std::vector<Support> supports(ShapeFunction shape)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Support> result;
  for (int p = 0; p < POINTS; ++p) {
    double position[2] = {4.0 * unit(random), 3.0 * unit(random)};
    if (p % 5 == 0)
      for (int a = 0; a < 2; ++a) position[a] = 0.5 * std::round(position[a] / 0.5);
    result.push_back(support_of(GRID, shape, position, {{0.25, 0.125}}));
  }
  const double corners[3][2] = {{0.0, 0.0}, {4.0, 3.0}, {4.0, 0.0}};
  for (const auto &corner : corners)
    result.push_back(support_of(GRID, shape, corner, {{0.25, 0.25}}));
  return result;
}

class Transfer : public testing::TestWithParam<ShapeFunction> {};

}    // namespace

TEST_P(Transfer, NodesHoldTheRoundedMassOfThePointsToTheLastBit)
{
  const std::vector<Support> all = supports(GetParam());
  const FixedScale scale(3.0, static_cast<std::int64_t>(all.size()));
  std::vector<std::int64_t> sums(GRID.node_count(), 0);
  std::int64_t total = 0;

  for (std::size_t p = 0; p < all.size(); ++p) {
    const double mass =
        1.0 + 2.0 * std::sin(static_cast<double>(p)) * std::sin(static_cast<double>(p));
    mpm::scatter<1>(
        all[p], scale, mass,
        [&](const mpm::Place<2> &place) {
          return mass * all[p].value(place);
        },
        sums.data(), 0);
    total += scale.integer(mass);
  }

  EXPECT_EQ(std::accumulate(sums.begin(), sums.end(), std::int64_t(0)), total);
}

TEST_P(Transfer, InternalForcesOfAPointAddUpToNothingToTheLastBit)
{
  const FixedScale scale(10.0, POINTS + 3);
  for (const Support &support : supports(GetParam())) {
    std::vector<std::int64_t> sums(GRID.node_count(), 0);

    mpm::scatter<1>(
        support, scale, 0.0,
        [&](const mpm::Place<2> &place) {
          return 3.7 * support.gradient(place)[0];
        },
        sums.data(), 0);

    EXPECT_EQ(std::accumulate(sums.begin(), sums.end(), std::int64_t(0)), 0);
  }
}

TEST_P(Transfer, LinearVelocityFieldIsInterpolatedWithItsGradient)
{
  std::vector<Vec2> field(GRID.node_count());
  for (int j = -1; j <= GRID.cells(1) + 1; ++j)
    for (int i = -1; i <= GRID.cells(0) + 1; ++i)
      field[GRID.node({{i, j}})] = {{1.0 + 0.5 * i, -2.0 + 0.5 * (2.0 * i - 3.0 * j)}};

  for (const Support &support : supports(GetParam())) {
    const rve::Tensor2 gradient = interpolate_gradient(support, field);
    EXPECT_NEAR(gradient(0, 0), 1.0, 1e-12) << "a few operations on numbers of order 10";
    EXPECT_NEAR(gradient(0, 1), 0.0, 1e-12);
    EXPECT_NEAR(gradient(1, 0), 2.0, 1e-12);
    EXPECT_NEAR(gradient(1, 1), -3.0, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, Transfer,
                         testing::Values(ShapeFunction::Linear, ShapeFunction::Gimp));
