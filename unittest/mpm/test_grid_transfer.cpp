// SPDX-License-Identifier: GPL-2.0-only
// Transfer from points to nodes in two and three dimensions: exact conservation by integer sums,
// and exact interpolation.

#include "mpm/grid_transfer.h"

#include <gtest/gtest.h>
#include <numeric>
#include <random>

using mpm::ShapeFunction;
using rve::FixedScale;

namespace {

constexpr int POINTS = 500;

/// Transfers in D dimensions for both shape functions.
template <class Dimension> class Transfer : public testing::Test {
 protected:
  static constexpr int D = Dimension::value;
  using Vec = mpm::Vec<D>;
  using NodeIndex = mpm::NodeIndex<D>;
  using Support = mpm::Support<D>;

  static mpm::Grid<D> make_grid()
  {
    Vec hi;
    for (int a = 0; a < D; ++a) hi[a] = 4.0 - a;
    return {Vec::zero(), hi, 0.5};
  }
  const mpm::Grid<D> grid = make_grid();

  /// Returns weights of random points and of points on nodes, edges and corners of the grid;
  /// `places` gets the positions.
  std::vector<Support> supports(ShapeFunction shape, std::vector<Vec> *places = nullptr) const
  {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Support> result;
    const auto add = [&](const Vec &place, const Vec &half) {
      result.push_back(support_of(grid, shape, place.component, half));
      if (places) places->push_back(place);
    };
    Vec flat, cube;
    for (int a = 0; a < D; ++a) {
      flat[a] = a == 1 ? 0.125 : 0.25;
      cube[a] = 0.25;
    }
    for (int p = 0; p < POINTS; ++p) {
      Vec place;
      for (int a = 0; a < D; ++a) place[a] = grid.hi(a) * unit(random);
      if (p % 5 == 0)
        for (int a = 0; a < D; ++a) place[a] = 0.5 * std::round(place[a] / 0.5);
      add(place, flat);
    }
    for (int corner = 0; corner < 1 << D; ++corner) {
      Vec place;
      for (int a = 0; a < D; ++a) place[a] = (corner >> a & 1) != 0 ? grid.hi(a) : 0.0;
      add(place, cube);
    }
    return result;
  }

  static constexpr ShapeFunction SHAPES[] = {ShapeFunction::Linear, ShapeFunction::Gimp};
};

using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Transfer, Dimensions);

}    // namespace

TYPED_TEST(Transfer, WeightsAreAPartitionOfUnityWithLinearCompleteness)
{
  constexpr int D = TestFixture::D;
  for (const ShapeFunction shape : this->SHAPES) {
    std::vector<mpm::Vec<D>> places;
    const auto all = this->supports(shape, &places);
    for (std::size_t p = 0; p < all.size(); ++p) {
      double unity = 0.0;
      mpm::Vec<D> place = mpm::Vec<D>::zero(), none = place;
      mpm::Tensor<D> identity = mpm::Tensor<D>::zero();
      int nodes = 0;
      mpm::each_node<D>([&](const mpm::NodeIndex<D> &at) {
        const mpm::NodeIndex<D> node = this->grid.place(all[p].node(at));
        mpm::Vec<D> x;
        for (int a = 0; a < D; ++a) x[a] = 0.5 * node[a];
        unity += all[p].value(at);
        place = place + all[p].value(at) * x;
        none = none + all[p].gradient(at);
        identity = identity + dyad(x, all[p].gradient(at));
        ++nodes;
      });
      EXPECT_EQ(nodes, D == 2 ? 9 : 27);
      EXPECT_NEAR(unity, 1.0, 1e-14) << "a few operations on numbers of order 1";
      for (int a = 0; a < D; ++a) {
        // Linear weights are evaluated at least 2^-24 cells away from nodes.
        EXPECT_NEAR(place[a], places[p][a], shape == ShapeFunction::Gimp ? 1e-14 : 0x1p-25);
        EXPECT_NEAR(none[a], 0.0, 1e-13) << "of slopes up to 2";
        for (int b = 0; b < D; ++b)
          EXPECT_NEAR(identity(a, b), a == b ? 1.0 : 0.0, 1e-13)
              << "x up to 4 times slopes up to 2";
      }
    }
  }
}

TYPED_TEST(Transfer, NodesHoldTheRoundedMassOfThePointsToTheLastBit)
{
  constexpr int D = TestFixture::D;
  for (const ShapeFunction shape : this->SHAPES) {
    const auto all = this->supports(shape);
    const FixedScale scale(3.0, static_cast<std::int64_t>(all.size()));
    std::vector<std::int64_t> sums(this->grid.node_count(), 0);
    std::int64_t total = 0;

    for (std::size_t p = 0; p < all.size(); ++p) {
      const double mass =
          1.0 + 2.0 * std::sin(static_cast<double>(p)) * std::sin(static_cast<double>(p));
      mpm::scatter<1>(
          all[p], scale, mass,
          [&](const mpm::NodeIndex<D> &place) { return mass * all[p].value(place); }, sums.data(),
          0);
      total += scale.integer(mass);
    }

    EXPECT_EQ(std::accumulate(sums.begin(), sums.end(), std::int64_t(0)), total);
  }
}

TYPED_TEST(Transfer, InternalForcesOfAPointSumToZeroToTheLastBit)
{
  constexpr int D = TestFixture::D;
  for (const ShapeFunction shape : this->SHAPES) {
    const auto all = this->supports(shape);
    const FixedScale scale(10.0, static_cast<std::int64_t>(all.size()));
    for (const auto &support : all)
      for (int a = 0; a < D; ++a) {
        std::vector<std::int64_t> sums(this->grid.node_count(), 0);

        mpm::scatter<1>(
            support, scale, 0.0,
            [&](const mpm::NodeIndex<D> &place) { return 3.7 * support.gradient(place)[a]; },
            sums.data(), 0);

        EXPECT_EQ(std::accumulate(sums.begin(), sums.end(), std::int64_t(0)), 0);
      }
  }
}

TYPED_TEST(Transfer, LinearVelocityFieldIsInterpolatedWithItsGradient)
{
  constexpr int D = TestFixture::D;
  mpm::Tensor<D> gradient;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) gradient(a, b) = 1.5 * a - b + 0.5 * a * b - 2.0;
  std::vector<mpm::Vec<D>> field(this->grid.node_count());
  for (int n = 0; n < this->grid.node_count(); ++n) {
    mpm::Vec<D> x;
    for (int a = 0; a < D; ++a) x[a] = 0.5 * this->grid.place(n)[a];
    field[n] = gradient * x;
    for (int a = 0; a < D; ++a) field[n][a] += 1.0 - 2.0 * a;
  }

  for (const ShapeFunction shape : this->SHAPES)
    for (const auto &support : this->supports(shape)) {
      const mpm::Tensor<D> found = interpolate_gradient(support, field);
      for (int k = 0; k < D * D; ++k)
        EXPECT_NEAR(found.component[k], gradient.component[k], 1e-12)
            << "a few operations on numbers of order 10";
    }
}

TYPED_TEST(Transfer, StorageIndicesOfNodesCountThemOnceLayerByLayer)
{
  constexpr int D = TestFixture::D;
  int next = 0;
  mpm::NodeBox<D> all;
  for (int a = 0; a < D; ++a) {
    all.first[a] = -1;
    all.end[a] = this->grid.cells(a) + 2;
  }
  all.for_each([&](const mpm::NodeIndex<D> &place) {
    ASSERT_EQ(this->grid.node(place), next);
    for (int a = 0; a < D; ++a) ASSERT_EQ(this->grid.place(next)[a], place[a]);
    ASSERT_EQ(next / this->grid.layer_size(), place[D - 1] + 1);
    ++next;
  });
  EXPECT_EQ(next, this->grid.node_count());
}
