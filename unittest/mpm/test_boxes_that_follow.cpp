// SPDX-License-Identifier: GPL-2.0-only
// Boxes that follow the deformation of their points (cpgimp), and mean dilation over cells.

#include "scene.h"

#include "mpm/mohr_coulomb.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

using mpm::MpmSolver;
using mpm::ShapeFunction;
using mpm::Vec;
using mpm_test::SceneOf;

namespace {

constexpr double CELL = 0.1;
constexpr double DENSITY = 2000.0;
constexpr double YOUNG = 10e6;
constexpr double TIME_STEP = 5e-4;

template <int D> Vec<D> uniform(double value)
{
  Vec<D> v;
  for (int a = 0; a < D; ++a) v[a] = value;
  return v;
}

/// Expects Σ N = 1, Σ N x = x and Σ x ⊗ ∇N = 1 over all parts of a box, with the shape functions N
/// and the positions x of nodes. Boxes are stretched, sheared and rotated, and some are near the
/// sides.
template <int D> void expect_linear_fields_are_reproduced()
{
  const mpm::Grid<D> grid(uniform<D>(0.0), uniform<D>(1.0), CELL);
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> number(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    mpm::Tensor<D> F = mpm::Tensor<D>::identity();
    double position[3] = {};
    for (int k = 0; k < D * D; ++k) F.component[k] += 3.0 * (number(generator) - 0.5);
    for (int a = 0; a < D; ++a) position[a] = trial == 0 ? 0.0 : number(generator);
    const mpm::PointBox<D> box = mpm::deformed_box(grid, position, uniform<D>(0.5 * CELL), F);
    int count = 1;
    for (int a = 0; a < D; ++a) count *= box.parts(a);
    double sum = 0.0;
    Vec<D> mean = Vec<D>::zero();
    mpm::Tensor<D> gradient = mpm::Tensor<D>::zero();
    for (int k = 0; k < count; ++k) {
      int part[D];
      for (int a = 0, rest = k; a < D; ++a) {
        part[a] = rest % box.parts(a);
        rest /= box.parts(a);
      }
      const mpm::Support<D> support = mpm::support_of(grid, box, part);
      mpm::each_node<D>([&](const mpm::NodeIndex<D> &place) {
        const int node = support.node(place);
        ASSERT_GE(node, 0);
        ASSERT_LT(node, grid.node_count());
        const mpm::NodeIndex<D> at = grid.place(node);
        Vec<D> x;
        for (int a = 0; a < D; ++a) x[a] = at[a] * CELL;
        sum += support.value(place) / count;
        mean = mean + (support.value(place) / count) * x;
        gradient = gradient + (1.0 / count) * dyad(x, support.gradient(place));
      });
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    for (int a = 0; a < D; ++a) {
      EXPECT_NEAR(mean[a], position[a], 1e-12);
      for (int b = 0; b < D; ++b) EXPECT_NEAR(gradient(a, b), a == b ? 1.0 : 0.0, 1e-10);
    }
  }
}

}    // namespace

TEST(BoxesThatFollow, PartitionUnityAndReproduceLinearFields)
{
  expect_linear_fields_are_reproduced<2>();
  expect_linear_fields_are_reproduced<3>();
}

TEST(BoxesThatFollow, HaveTheSecondMomentsOfTheDeformedBox)
{
  const mpm::Grid<2> grid({{0.0, 0.0}}, {{10.0, 10.0}}, 1.0);
  const double place[] = {5.0, 5.0, 0.0};
  const Vec<2> half = {{0.5, 0.5}};
  const double c = std::cos(0.7), s = std::sin(0.7);
  const mpm::PointBox<2> turned = mpm::deformed_box(grid, place, half, {{c, -s, s, c}});
  EXPECT_NEAR(turned.half[0], 0.5, 1e-15) << "a rotation of a square changes nothing";
  const mpm::PointBox<2> stretched = mpm::deformed_box(grid, place, half, {{0.0, -1.0, 3.0, 0.0}});
  EXPECT_EQ(stretched.half[0], 0.5) << "a stretch that has turned by a right angle turns";
  EXPECT_EQ(stretched.half[1], 1.5);
  EXPECT_EQ(stretched.parts(1), 3);
}

namespace {

/// Result of drawn_bar(), which stretches a bar with one point per cell to `stretch` times its
/// length. Points have the velocity ε̇ x in every step. The members are the smallest and the
/// largest ratio of the stretch λ of a point to the exact stretch e^(ε̇ t). drawn_bar() also
/// expects the stress E ln λ at each point.
struct Bar {
  double least = 1e9, largest = 0.0;
};

template <int D> Bar drawn_bar(ShapeFunction shape, double stretch)
{
  Vec<D> hi = uniform<D>(CELL);
  hi[0] = 3.2;
  mpm::SolverOptions<D> options = mpm_test::grid_options_of<D>(uniform<D>(0.0), hi, CELL);
  options.shape = shape;
  for (int side = 0; side < mpm::FACES<D>; ++side)
    options.sides[side] = side == 1 ? mpm::SideKind::Free : mpm::SideKind::Roller;
  SceneOf<D> scene;
  hi[0] = 0.8;
  scene.add_block(uniform<D>(0.0), hi, CELL, DENSITY);
  mpm::LinearElastic<D> law(1.0, 0.0);    // so soft that stresses do not move points
  MpmSolver<D> solver(options);
  solver.set_models({&law});
  const int steps = 400;
  const double rate = std::log(stretch) / (steps * TIME_STEP);
  for (int step = 0; step < steps; ++step) {
    for (int p = 0; p < scene.size(); ++p)
      for (int a = 0; a < D; ++a)
        scene.velocity[3 * p + a] = a == 0 ? rate * scene.position[3 * p] : 0.0;
    solver.step(scene.view(), {}, TIME_STEP);
  }
  Bar bar;
  // The points in the last two cells are omitted: their slopes of the velocity are wrong, because
  // there are no points beyond them.
  for (int p = 0; p < scene.size() - 2; ++p) {
    const double made = scene.deformation_gradient[p](0, 0) / stretch;
    bar.least = std::min(bar.least, made);
    bar.largest = std::max(bar.largest, made);
    EXPECT_NEAR(scene.stress[p](0, 0), std::log(scene.deformation_gradient[p](0, 0)), 1e-3);
  }
  return bar;
}

}    // namespace

TEST(BoxesThatFollow, BarStretchedToThreeTimesItsLengthDoesNotFracture)
{
  const Bar whole = drawn_bar<2>(ShapeFunction::Cpgimp, 3.0);
  const Bar in_space = drawn_bar<3>(ShapeFunction::Cpgimp, 3.0);
  const Bar torn = drawn_bar<2>(ShapeFunction::Gimp, 3.0);
  EXPECT_GT(whole.least, 0.98);
  EXPECT_LT(whole.largest, 1.02);
  EXPECT_NEAR(in_space.least, whole.least, 1e-9);
  EXPECT_NEAR(in_space.largest, whole.largest, 1e-9);
  EXPECT_LT(torn.least, 0.8) << "boxes of fixed size leave gaps: numerical fracture";
}

namespace {

/// Returns a block of points at irregular positions with an affine velocity.
template <int D> SceneOf<D> affine_block(const mpm::Tensor<D> &gradient)
{
  SceneOf<D> scene;
  scene.add_block(uniform<D>(0.4), uniform<D>(0.8), 0.5 * CELL, DENSITY);
  for (int p = 0; p < scene.size(); ++p) {
    Vec<D> x;
    for (int a = 0; a < D; ++a) x[a] = scene.position[3 * p + a] - 0.6;
    const Vec<D> v = gradient * x;
    for (int a = 0; a < D; ++a) scene.velocity[3 * p + a] = v[a];
  }
  return scene;
}

template <int D> void expect_uniform_gradient_is_left(const mpm::Tensor<D> &gradient)
{
  for (const bool mean : {false, true}) {
    SceneOf<D> scene = affine_block<D>(gradient);
    mpm::SolverOptions<D> options =
        mpm_test::grid_options_of<D>(uniform<D>(0.0), uniform<D>(1.2), CELL);
    options.mean_dilation = mean;
    mpm::LinearElastic<D> law(YOUNG, 0.3);
    MpmSolver<D> solver(options);
    solver.set_models({&law});
    solver.step(scene.view(), {}, 1e-6);
    int inside = 0;
    for (int p = 0; p < scene.size(); ++p) {
      double away = 0.0;
      for (int a = 0; a < D; ++a) away = std::max(away, std::abs(scene.position[3 * p + a] - 0.6));
      if (away > 0.1) continue;
      ++inside;
      for (int k = 0; k < D * D; ++k)
        EXPECT_NEAR(scene.velocity_gradient[p].component[k], gradient.component[k], 1e-6);
    }
    EXPECT_GE(inside, 1 << 2 * D);
  }
}

template <int D> void expect_one_dilation_in_a_cell()
{
  for (const bool mean : {false, true}) {
    SceneOf<D> scene;
    scene.add_block(uniform<D>(0.4), uniform<D>(0.8), 0.5 * CELL, DENSITY);
    for (int p = 0; p < 3 * scene.size(); ++p) scene.velocity[p] = 0.1 * std::sin(2.3 * p);
    mpm::SolverOptions<D> options =
        mpm_test::grid_options_of<D>(uniform<D>(0.0), uniform<D>(1.2), CELL);
    options.mean_dilation = mean;
    mpm::LinearElastic<D> law(YOUNG, 0.3);
    MpmSolver<D> solver(options);
    solver.set_models({&law});
    const std::vector<double> start = scene.position;
    solver.step(scene.view(), {}, 1e-6);
    double spread = 0.0;
    for (int p = 0; p < scene.size(); ++p)
      for (int q = 0; q < p; ++q) {
        bool same_cell = true;
        for (int a = 0; a < D; ++a)
          same_cell = same_cell &&
              std::floor(start[3 * p + a] / CELL) == std::floor(start[3 * q + a] / CELL);
        if (same_cell)
          spread = std::max(
              spread,
              std::abs(trace(scene.velocity_gradient[p]) - trace(scene.velocity_gradient[q])));
      }
    if (mean) {
      EXPECT_LT(spread, 1e-9);
    } else {
      EXPECT_GT(spread, 0.1);
    }
  }
}

/// Expects that the power of the nodal forces on a quadratic velocity field is -Σ V σ : L, with the
/// volume V and the stress σ of a point. L is the velocity gradient that the law gets, with the
/// mean dilation of the cell.
template <int D> void expect_forces_do_the_work_of_stresses()
{
  SceneOf<D> scene;
  scene.add_block(uniform<D>(0.4), uniform<D>(0.8), 0.5 * CELL, DENSITY);
  for (int p = 0; p < scene.size(); ++p)
    for (int a = 0; a < D; ++a) {
      scene.stress[p](a, a) = 1e5 * std::cos(1.9 * p + 1.3 * a);
      for (int b = 0; b < a; ++b)
        scene.stress[p](a, b) = scene.stress[p](b, a) = 1e5 * std::sin(0.9 * p + a + 0.7 * b);
    }
  mpm::SolverOptions<D> options =
      mpm_test::grid_options_of<D>(uniform<D>(0.0), uniform<D>(1.2), CELL);
  options.mean_dilation = true;
  mpm::LinearElastic<D> law(YOUNG, 0.3);
  MpmSolver<D> solver(options);
  solver.set_models({&law});
  const std::vector<mpm::Tensor<D>> stress = scene.stress;
  solver.evaluate(scene.view(), {}, 1e-9);

  double of_forces = 0.0;
  const mpm::Grid<D> &grid = solver.grid();
  mpm::NodeBox<D> nodes;
  for (int a = 0; a < D; ++a) {
    nodes.first[a] = -1;
    nodes.end[a] = grid.cells(a) + 2;
  }
  const auto field = [&](const mpm::NodeIndex<D> &place) {
    Vec<D> velocity;
    for (int a = 0; a < D; ++a) {
      const double x = place[a] * CELL - 0.6, y = place[(a + 1) % D] * CELL - 0.6;
      velocity[a] = (0.3 + 0.1 * a) * x * x - 0.2 * x * y + (0.1 + 0.4 * a) * y;
    }
    return velocity;
  };
  nodes.for_each([&](const mpm::NodeIndex<D> &place) {
    of_forces += dot(solver.node_force(place), field(place));
  });

  // The reference sum. Each cell contains whole boxes, two along each axis.
  double of_stresses = 0.0;
  std::vector<double> volume(grid.node_count(), 0.0), sum(grid.node_count(), 0.0);
  std::vector<mpm::Tensor<D>> gradient(scene.size());
  const auto cell_of = [&](int p) {
    mpm::NodeIndex<D> place;
    for (int a = 0; a < D; ++a)
      place[a] = static_cast<int>(std::floor(scene.position[3 * p + a] / CELL));
    return grid.node(place);
  };
  for (int p = 0; p < scene.size(); ++p) {
    const mpm::Support<D> support =
        mpm::support_of(grid, ShapeFunction::Gimp, &scene.position[3 * p], scene.half_size[p]);
    gradient[p] = mpm::Tensor<D>::zero();
    mpm::each_node<D>([&](const mpm::NodeIndex<D> &at) {
      gradient[p] = gradient[p] + dyad(field(grid.place(support.node(at))), support.gradient(at));
    });
    volume[cell_of(p)] += scene.volume[p];
    sum[cell_of(p)] += scene.volume[p] * trace(gradient[p]);
  }
  for (int p = 0; p < scene.size(); ++p) {
    const double change = (sum[cell_of(p)] / volume[cell_of(p)] - trace(gradient[p])) / D;
    for (int a = 0; a < D; ++a) gradient[p](a, a) += change;
    for (int k = 0; k < D * D; ++k)
      of_stresses += scene.volume[p] * stress[p].component[k] * gradient[p].component[k];
  }
  EXPECT_GT(std::abs(of_stresses), 1.0);
  EXPECT_NEAR(of_forces, -of_stresses, 1e-10 * std::abs(of_stresses));
}

}    // namespace

TEST(MeanDilation, LeavesAUniformGradientAsItIs)
{
  expect_uniform_gradient_is_left<2>({{0.2, -0.1, 0.3, 0.4}});
  expect_uniform_gradient_is_left<3>({{0.2, -0.1, 0.3, 0.4, -0.3, 0.1, -0.2, 0.25, 0.15}});
}

TEST(MeanDilation, IsTheSameForAllPointsOfACellAndKeepsTheVolumeOfTheCell)
{
  expect_one_dilation_in_a_cell<2>();
  expect_one_dilation_in_a_cell<3>();
}

TEST(MeanDilation, ForcesDoTheWorkOfTheStresses)
{
  expect_forces_do_the_work_of_stresses<2>();
  expect_forces_do_the_work_of_stresses<3>();
}

namespace {

/// Expects bitwise equal results on several threads and ranks. The ground yields, boxes follow the
/// deformation, and the dilation is the mean over cells.
template <int D> void expect_same_bits_on_ranks(ShapeFunction shape, mpm::Scheme scheme)
{
  SceneOf<D> scene;
  scene.add_block(uniform<D>(0.0), uniform<D>(0.6), 0.5 * CELL, DENSITY);
  for (int p = 0; p < scene.size(); ++p)
    for (int a = 0; a < D; ++a) {
      scene.velocity[3 * p + a] = 0.3 * std::sin(1.7 * p + a);
      // The box is stretched over several cells.
      scene.deformation_gradient[p](a, a) = a == 0 ? 2.7 : 0.8;
    }
  mpm::SolverOptions<D> options =
      mpm_test::grid_options_of<D>(uniform<D>(0.0), uniform<D>(1.0), CELL);
  for (int side = 0; side < mpm::FACES<D> - 1; ++side) options.sides[side] = mpm::SideKind::Roller;
  options.shape = shape;
  options.scheme = scheme;
  options.mean_dilation = true;
  const auto run = [&](SceneOf<D> &points, int threads, const mpm::Communication &communication) {
    mpm::SolverOptions<D> own = options;
    own.threads = threads;
    mpm::MohrCoulomb<D> law(YOUNG, 0.3, 1e3, 0.0, 0.0);
    points.begin_memory(law);
    MpmSolver<D> solver(own, communication);
    solver.set_models({&law});
    for (int step = 0; step < 12; ++step) solver.step(points.view(), {}, 1e-4);
  };
  SceneOf<D> alone = scene, threaded = scene;
  run(alone, 1, {});
  run(threaded, 3, {});
  EXPECT_EQ(alone.velocity, threaded.velocity);
  const int ranks = 3;
  mpm_test::RankTeam team(ranks);
  std::vector<SceneOf<D>> parts(ranks);
  team.run([&](int rank, const mpm::Communication &communication) {
    std::vector<int> mine;
    for (int p = 0; p < scene.size(); ++p)
      if (std::min(ranks - 1, static_cast<int>(scene.position[3 * p] / 0.6 * ranks)) == rank)
        mine.push_back(p);
    parts[rank] = scene.selected(mine);
    run(parts[rank], 1, communication);
  });
  for (const SceneOf<D> &part : parts)
    for (int k = 0; k < part.size(); ++k) {
      const auto p = static_cast<std::size_t>(part.id[k] - 1);
      for (int a = 0; a < D; ++a) {
        EXPECT_EQ(part.position[3 * k + a], alone.position[3 * p + a]);
        EXPECT_EQ(part.velocity[3 * k + a], alone.velocity[3 * p + a]);
      }
      for (int c = 0; c < D * D; ++c)
        EXPECT_EQ(part.stress[k].component[c], alone.stress[p].component[c]);
    }
}

}    // namespace

TEST(BoxesThatFollow, HaveTheSameBitsOnRanksAndThreadsWithMeanDilation)
{
  expect_same_bits_on_ranks<2>(ShapeFunction::Cpgimp, mpm::Scheme::Musl);
  expect_same_bits_on_ranks<2>(ShapeFunction::Gimp, mpm::Scheme::Usavg);
  expect_same_bits_on_ranks<2>(ShapeFunction::Linear, mpm::Scheme::Musl);
  expect_same_bits_on_ranks<3>(ShapeFunction::Cpgimp, mpm::Scheme::Usavg);
}
