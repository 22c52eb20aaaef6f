// SPDX-License-Identifier: GPL-2.0-only
// Tests the MPM solver with the scene of ground_in_space.h. The results have the same bits for any
// number of threads and ranks and for any order of the points. No axis is preferred, and momentum
// is balanced.

#include "ground_in_space.h"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

using mpm::Scheme;
using mpm::ShapeFunction;
using mpm_test::GroundInSpace;
using Scene = mpm_test::SceneOf<3>;
using Method = GroundInSpace::Method;
using Vec3 = mpm::Vec<3>;

namespace {

constexpr int STEPS = 12;

/// Points after some steps, in the order of their IDs, and the forces and masses of the solver.
struct Outcome {
  Scene scene;
  std::vector<double> numbers;
};

Outcome outcome_of(GroundInSpace &ground, int steps = STEPS,
                   const mpm::Communication &communication = {})
{
  mpm::MpmSolver<3> solver = ground.solver(communication);
  for (int step = 0; step < steps; ++step)
    solver.step(ground.scene.view(), ground.loads, GroundInSpace::STEP);
  std::vector<int> order(ground.scene.size());
  for (int p = 0; p < ground.scene.size(); ++p) order[p] = p;
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return ground.scene.id[a] < ground.scene.id[b]; });
  return {ground.scene.selected(order), ground.numbers(solver)};
}

template <class T> bool same(const std::vector<T> &a, const std::vector<T> &b)
{
  return a.size() == b.size() &&
      (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same_bits(const Outcome &a, const Outcome &b)
{
  EXPECT_TRUE(same(a.numbers, b.numbers));
  EXPECT_TRUE(same(a.scene.position, b.scene.position));
  EXPECT_TRUE(same(a.scene.velocity, b.scene.velocity));
  EXPECT_TRUE(same(a.scene.volume, b.scene.volume));
  EXPECT_TRUE(same(a.scene.deformation_gradient, b.scene.deformation_gradient));
  EXPECT_TRUE(same(a.scene.velocity_gradient, b.scene.velocity_gradient));
  EXPECT_TRUE(same(a.scene.stress, b.scene.stress));
  EXPECT_TRUE(same(a.scene.memory, b.scene.memory));
}

class BitsInSpace : public testing::TestWithParam<Method> {
 protected:
  Outcome alone(int steps = STEPS)
  {
    GroundInSpace ground(GetParam());
    return outcome_of(ground, steps);
  }

  /// Expects the reference result on `ranks` ranks. rank_of(p, x) returns the rank of point p with
  /// the position x.
  template <class RankOf>
  void expect_of_ranks(const Outcome &reference, int ranks, const RankOf &rank_of,
                       int steps = STEPS)
  {
    const GroundInSpace all(GetParam());
    std::vector<std::vector<int>> mine(ranks);
    for (int p = 0; p < all.scene.size(); ++p)
      mine.at(rank_of(p, &all.scene.position[3 * p])).push_back(p);
    std::vector<Outcome> part(ranks);
    mpm_test::RankTeam(ranks).run([&](int rank, const mpm::Communication &communication) {
      GroundInSpace ground(GetParam());
      ground.scene = ground.scene.selected(mine[rank]);
      ground.find_loads();
      part[rank] = outcome_of(ground, steps, communication);
    });
    for (int rank = 0; rank < ranks; ++rank)
      expect_same_bits({reference.scene.selected(mine[rank]), reference.numbers}, part[rank]);
  }
};

}    // namespace

TEST_P(BitsInSpace, DoNotDependOnTheOrderOfThePoints)
{
  const Outcome reference = alone();
  GroundInSpace ground(GetParam());
  std::vector<int> order(ground.scene.size());
  for (int p = 0; p < ground.scene.size(); ++p) order[p] = p;
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  ground.scene = ground.scene.selected(order);
  ground.find_loads();

  expect_same_bits(reference, outcome_of(ground));
}

TEST_P(BitsInSpace, DoNotDependOnTheNumberOfThreads)
{
  const Outcome reference = alone();
  for (const int threads : {2, 5}) {
    GroundInSpace ground(GetParam());
    ground.options.threads = threads;
    expect_same_bits(reference, outcome_of(ground));
  }
}

TEST_P(BitsInSpace, DoNotDependOnRanks)
{
  const Outcome reference = alone();
  // First the points of two ranks are scattered over the ground, and a third rank has no points.
  // Then the ground is divided among the ranks along z, along x, and finally along x and y.
  expect_of_ranks(reference, 3, [](int p, const double *) { return p * 7 / 3 % 2; });
  expect_of_ranks(reference, 2, [](int, const double *x) {
    return x[2] < GroundInSpace::SURFACE - GroundInSpace::CELL ? 0 : 1;
  });
  expect_of_ranks(reference, 3, [](int, const double *x) {
    return x[0] < 0.3 ? 0 : x[0] < 0.66 ? 1 : 2;
  });
  expect_of_ranks(reference, 4, [](int, const double *x) {
    return (x[1] < 0.35 ? 0 : 2) + (x[0] < 0.6 ? 0 : 1);
  });
}

/// A face of a rigid body couples the two nodes on both sides of it. The border between two ranks
/// is near such a face, so that one rank has only one of the two coupled nodes.
TEST_P(BitsInSpace, DoNotDependOnBordersNearFacesOfBodies)
{
  constexpr int FEW = 2;
  const Outcome reference = alone(FEW);
  for (double border = 0.15; border < 0.5; border += 0.5 * GroundInSpace::CELL)
    expect_of_ranks(
        reference, 2, [&](int, const double *x) { return x[2] < border ? 0 : 1; }, FEW);
  for (double border = 0.3; border < 0.8; border += 0.5 * GroundInSpace::CELL)
    expect_of_ranks(
        reference, 2, [&](int, const double *x) { return x[0] < border ? 0 : 1; }, FEW);
}

INSTANTIATE_TEST_SUITE_P(
    Methods, BitsInSpace,
    testing::Values(Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, 0.99, true, false},
                    Method{Scheme::Usavg, ShapeFunction::Gimp, 0.0, 1.0, false, true},
                    Method{Scheme::Usavg, ShapeFunction::Linear, 0.1, 0.99, true, true},
                    Method{Scheme::Musl, ShapeFunction::Gimp, 0.0, 0.99, false, true, true}));

TEST(SymmetryOfSpace, ExchangedAndMirroredAxesGiveTheSameMotion)
{
  for (const Method &method :
       {Method{Scheme::Musl, ShapeFunction::Gimp, 0.1, 0.99, true, true},
        Method{Scheme::Usavg, ShapeFunction::Gimp, 0.0, 1.0, false, false},
        Method{Scheme::Usavg, ShapeFunction::Gimp, 0.1, 1.0, true, true, true}}) {
    GroundInSpace reference(method);
    const Outcome expected = outcome_of(reference);

    const int axes[][3] = {{1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {0, 1, 2}};
    const double signs[][3] = {{1, 1, 1}, {-1, 1, -1}, {1, -1, 1}, {-1, -1, -1}};
    for (int k = 0; k < 4; ++k) {
      // Axis a becomes axis to[a] with the sign sign[a]. A negative sign mirrors the scene at the
      // plane through the origin, so that the domain reaches from -hi[a] to -lo[a].
      const int *to = axes[k];
      const double *sign = signs[k];
      const auto turned = [&](const Vec3 &v) {
        Vec3 t;
        for (int a = 0; a < 3; ++a) t[to[a]] = sign[a] * v[a];
        return t;
      };
      const auto turned_rows = [&](const std::vector<double> &rows) {
        std::vector<double> t(rows.size());
        for (std::size_t i = 0; i < rows.size(); i += 3)
          for (int a = 0; a < 3; ++a) t[i + to[a]] = sign[a] * rows[i + a];
        return t;
      };
      const auto turned_tensor = [&](const rve::Tensor3 &s) {
        rve::Tensor3 t;
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) t(to[a], to[b]) = sign[a] * sign[b] * s(a, b);
        return t;
      };
      const auto turned_face = [&](mpm::Face face) {
        const int axis = mpm::axis_of(face);
        const int high = mpm::outward(face) * sign[axis] > 0.0 ? 1 : 0;
        return static_cast<mpm::Face>(2 * to[axis] + high);
      };
      GroundInSpace ground(method);
      const mpm::SolverOptions<3> &straight = reference.options;
      for (int a = 0; a < 3; ++a) {
        ground.options.lo[to[a]] = sign[a] > 0.0 ? straight.lo[a] : -straight.hi[a];
        ground.options.hi[to[a]] = sign[a] > 0.0 ? straight.hi[a] : -straight.lo[a];
      }
      for (int side = 0; side < 6; ++side)
        ground.options.sides[static_cast<int>(turned_face(static_cast<mpm::Face>(side)))] =
            straight.sides[side];
      for (int b = 0; b < GroundInSpace::NUM_BODIES; ++b) {
        ground.options.rigid_bodies[b].face = turned_face(straight.rigid_bodies[b].face);
        ground.body_velocity[b] = turned(ground.body_velocity[b]);
      }
      for (mpm::TractionLoad<3> &load : ground.loads) {
        load.traction = turned(load.traction);
        load.face = turned_face(load.face);
      }
      Scene &scene = ground.scene;
      for (std::vector<double> *rows : {&scene.position, &scene.velocity, &scene.body_force})
        *rows = turned_rows(*rows);
      for (rve::Tensor3 &stress : scene.stress) stress = turned_tensor(stress);

      const Outcome found = outcome_of(ground);

      const std::vector<double> position = turned_rows(expected.scene.position);
      const std::vector<double> velocity = turned_rows(expected.scene.velocity);
      // The tolerances are the round-off of 12 steps. Velocities are of order 0.1 and stresses of
      // order 1e5.
      for (std::size_t i = 0; i < position.size(); ++i) {
        ASSERT_NEAR(found.scene.position[i], position[i], 1e-12) << "exchange " << k;
        ASSERT_NEAR(found.scene.velocity[i], velocity[i], 1e-10) << "exchange " << k;
      }
      for (int p = 0; p < scene.size(); ++p) {
        const rve::Tensor3 stress = turned_tensor(expected.scene.stress[p]);
        for (int c = 0; c < 9; ++c)
          ASSERT_NEAR(found.scene.stress[p].component[c], stress.component[c], 1e-4);
      }
    }
  }
}

TEST(BalanceInSpace, MomentumChangesByGravityTractionsAndReactions)
{
  for (const double flip : {1.0, 0.6})
    for (const int kind : {0, 1, 2}) {    // bodies: 0 rough, 1 smooth, 2 both smooth and round
      GroundInSpace ground(
          {Scheme::Musl, ShapeFunction::Gimp, 0.1, flip, kind == 0, true, kind == 2});
      mpm::MpmSolver<3> solver = ground.solver();
      double felt = 0.0;
      for (int step = 0; step < STEPS; ++step) {
        Vec3 force = Vec3::zero();
        for (int p = 0; p < ground.scene.size(); ++p)
          for (int c = 0; c < 3 && ground.scene.rigid_body[p] < 0; ++c)
            force[c] += ground.scene.body_force[3 * p + c];
        for (const mpm::TractionLoad<3> &load : ground.loads) {
          const int n = mpm::axis_of(load.face), s = (n + 1) % 3, t = (n + 2) % 3;
          for (const int p : load.point_index) {
            const rve::Tensor3 &F = ground.scene.deformation_gradient[p];
            const double area = 0.25 * GroundInSpace::CELL * GroundInSpace::CELL *
                (F(s, s) * F(t, t) - F(s, t) * F(t, s));
            force = force + area * load.traction;
          }
        }
        const Vec3 before = solver.totals(ground.scene.view()).momentum;
        solver.step(ground.scene.view(), ground.loads, GroundInSpace::STEP);
        const Vec3 after = solver.totals(ground.scene.view()).momentum;

        for (int b = 0; b < GroundInSpace::NUM_BODIES; ++b) force = force - solver.body_reaction(b);
        for (int side = 0; side < 6; ++side)
          force = force - solver.side_reaction(static_cast<mpm::Face>(side));
        force = force + solver.damping_force();
        felt = std::max(felt, std::abs(solver.body_reaction(GroundInSpace::FOOTING)[2]));
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR((after[c] - before[c]) / GroundInSpace::STEP, force[c], 1e-6)
              << "round-off of forces of order 1e4 N";
      }
      EXPECT_GT(felt, 100.0) << "the footing feels something";
    }
}
