// SPDX-License-Identifier: GPL-2.0-only
// Objectivity of RVEs of spheres: a rotation of the RVE rotates its response and changes nothing
// else.

#include "rve/engine/contact_network.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "rve/engine/stability.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

using Vector = Vec<double, 3>;

constexpr int STEPS_PER_TURN = 20000;    // 3.1e-4 rad each

Tensor3 spin_tensor(const Vector &w)
{
  return Tensor3{{0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0}};
}

double length(const Vector &v)
{
  return std::sqrt(dot(v, v));
}

double largest(const Tensor3 &t)
{
  double most = 0.0;
  for (const double x : t.component) most = std::fmax(most, std::fabs(x));
  return most;
}

/// Returns the tensor in a frame that is rotated by `turn`.
Tensor3 seen_from(const Tensor3 &turn, const Tensor3 &t)
{
  return transpose(turn) * t * turn;
}

Spheres with_spin(Spheres state, const Vector &w)
{
  for (int i = 0; i < state.num_grains(); ++i)
    for (int a = 0; a < 3; ++a) state.spin[3 * i + a] = w[a];
  return state;
}

/// Returns 100 spheres at rest at 100 kPa.
const Spheres &packing()
{
  static const Spheres made = [] {
    PackingRecipe recipe;
    recipe.material = spheres_material();
    recipe.num_grains = 100;
    recipe.radius_min = 0.004;
    recipe.radius_max = 0.006;
    recipe.pressure = 1e5;
    recipe.preparation_friction = 0.3;
    return generate_packing(recipe, *make_engine<3>(sphere_options(Format::Mixed)));
  }();
  return made;
}

double step_of(const Spheres &state)
{
  return 0.5 * stable_time_step(state);
}

/// Returns the packing after a shear of 2e-3 and a time at rest. It has q/p = 0.23 and tangential
/// forces at all contacts.
const Spheres &sheared_packing()
{
  static const Spheres made = [] {
    Spheres state = packing();
    state.material.local_damping = 0.5;
    SphereRig rig(state);
    const double dt = step_of(state);
    const double rate = 2e-3 / (4000 * dt);
    rig.strain(rate * Tensor3{{0.0, 1.0, 0.4, 0.0, 0.0, -0.7, 0.0, 0.0, 0.0}}, dt, 4000);
    const ResultOf<3> result = rig.strain(Tensor3::zero(), dt, 20000);
    EXPECT_LT(result.unbalanced_ratio, 1e-9);
    EXPECT_GT(result.deviatoric_stress(), 0.2 * result.mean_stress());
    state = rig.state();
    for (std::vector<double> *speeds : {&state.velocity, &state.spin})
      std::fill(speeds->begin(), speeds->end(), 0.0);
    return state;
  }();
  return made;
}

struct Axis {
  const char *name;
  Vector direction;
};

class TurnOfSpheres : public ::testing::TestWithParam<Axis> {};

}    // namespace

TEST_P(TurnOfSpheres, AtConstantStressChangesOnlyTheAxes)
{
  // The servo holds the initial stress, with all six components, in the frame that rotates with the
  // RVE.
  const Vector axis = GetParam().direction;
  const double dt = step_of(packing()), rate = 2.0 * kPi / (STEPS_PER_TURN * dt);
  Spheres state = with_spin(sheared_packing(), rate * axis);
  state.servo_velocity_gradient = spin_tensor(rate * axis);
  SphereRig rig(state);
  const ResultOf<3> before = rig.advance(DriveOf<3>());
  const Tensor3 goal = 0.5 * (before.stress + transpose(before.stress));
  const double p = before.mean_stress();
  DriveOf<3> drive;
  drive.dt = dt;
  drive.substeps = 1;
  drive.velocity_gradient = state.servo_velocity_gradient;
  drive.servo_gain = default_servo_gain(state);
  drive.servo_max_rate = 2.0 * rate;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) drive.controlled[a][b] = true;

  ResultOf<3> after;
  double stress_error = 0.0, strain = 0.0;
  for (int step = 1; step <= STEPS_PER_TURN; ++step) {
    const Tensor3 turn = spatial_rotation((2.0 * kPi * step / STEPS_PER_TURN) * axis);
    drive.stress_goal = turn * goal * transpose(turn);
    after = rig.advance(drive);
    stress_error = std::fmax(stress_error, largest(after.stress - drive.stress_goal) / p);
    const Tensor3 stretch =
        transpose(turn) * after.deformation * inverse(sheared_packing().deformation);
    strain = std::fmax(strain, largest(stretch - Tensor3::identity()));
  }

  // The error of a step is of third order in its angle. It adds up to 1e-7 in a turn.
  EXPECT_LT(stress_error, 1e-7);
  EXPECT_LT(strain, 1e-6);
  EXPECT_NEAR(after.void_ratio, before.void_ratio, 1e-6);
  // The tolerance allows a difference of three contacts.
  EXPECT_NEAR(after.coordination_number, before.coordination_number, 0.06);
}

INSTANTIATE_TEST_SUITE_P(About, TurnOfSpheres,
                         ::testing::Values(Axis{"x", {{1.0, 0.0, 0.0}}},
                                           Axis{"y", {{0.0, 1.0, 0.0}}},
                                           Axis{"z", {{0.0, 0.0, 1.0}}},
                                           Axis{"ATiltedAxis", {{0.48, 0.6, 0.64}}}),
                         [](const auto &info) { return info.param.name; });

namespace {

const Vector TILTED{{0.48, 0.6, 0.64}};

Vector tangential_force_of(const Spheres &state, int first, int second)
{
  for (const PairOf<3> &pair : state.pairs) {
    if (pair.first == first && pair.second == second) return pair.tangential_force;
    if (pair.first == second && pair.second == first) return -1.0 * pair.tangential_force;
  }
  return Vector::zero();
}

/// Projects a history onto the plane perpendicular to the new normal, as LAMMPS does. The length of
/// the history is kept. The projection does not rotate the history about the normal.
void project(Vector &h, const Vector &n)
{
  const double before = dot(h, h);
  h = h - dot(h, n) * n;
  h = std::sqrt(before / dot(h, h)) * h;
}

/// Stress of the tangential forces: the stress now, and the stress after a full turn of the RVE in
/// which each step projects the forces.
struct TangentialStress {
  Tensor3 now = Tensor3::zero(), projected = Tensor3::zero();

  TangentialStress(const Spheres &state, const Vector &axis)
  {
    const auto contacts = find_contacts(state);
    const auto forces = spring_forces(state, contacts);
    const double volume = determinant(state.cell);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const Vector force = forces[k].tangential;
      if (!(dot(force, force) > 0.0)) continue;
      Vector h = force;
      for (int step = 1; step <= STEPS_PER_TURN; ++step)
        project(h,
                spatial_rotation((2.0 * kPi * step / STEPS_PER_TURN) * axis) * contacts[k].normal);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          now(a, b) += force[a] * contacts[k].branch[b] / volume;
          projected(a, b) += h[a] * contacts[k].branch[b] / volume;
        }
    }
  }
};

}    // namespace

TEST(TurnOfAShearedPacking, RotationKeepsTheStressThatProjectionLoses)
{
  const Spheres &still = sheared_packing();
  const double dt = step_of(packing()), rate = 2.0 * kPi / (STEPS_PER_TURN * dt);
  SphereRig rig(with_spin(still, rate * TILTED));
  const ResultOf<3> before = rig.advance(DriveOf<3>());
  const double p = before.mean_stress();
  DriveOf<3> drive;
  drive.dt = dt;
  drive.substeps = 1;
  drive.deformation = spatial_rotation((2.0 * kPi / STEPS_PER_TURN) * TILTED);

  double error = 0.0;
  for (int step = 1; step <= STEPS_PER_TURN; ++step) {
    const ResultOf<3> result = rig.advance(drive);
    const Tensor3 turn = spatial_rotation((2.0 * kPi * step / STEPS_PER_TURN) * TILTED);
    error = std::fmax(error, largest(seen_from(turn, result.stress) - before.stress) / p);
  }

  const TangentialStress tangential(still, TILTED);
  // The error is of second order in the angle of a step.
  EXPECT_LT(error, 5e-6);
  // Control: in a full turn, projected tangential forces rotate in their planes by about 2 pi times
  // the cosine of the angle between axis and normal.
  EXPECT_GT(largest(tangential.now), 0.01 * p);
  EXPECT_GT(largest(tangential.projected - tangential.now), 0.5 * largest(tangential.now));
}

TEST(ShearOfSpheres, IsTheSameWithASuperposedSpin)
{
  // The deformation is F(t) = R(t) (1 + gamma(t) e_x e_y), with a rotation R about a tilted axis.
  // Local damping is off, since it depends on the axes. The differences between the runs with and
  // without R are about as large as those between two runs whose initial positions differ by 1e-12
  // of a diameter.
  Spheres state = packing();
  state.material.local_damping = 0.0;
  const double dt = step_of(state), rate = 2.0 * kPi / (STEPS_PER_TURN * dt);
  const auto deformation = [](double share, bool turns) {
    Tensor3 f = Tensor3::identity();
    f(0, 1) = 2e-3 * share;
    return turns ? spatial_rotation((2.0 * kPi * share) * TILTED) * f : f;
  };
  Spheres disturbed = state;
  for (std::uint64_t &s : disturbed.fractional)
    s += s & (1ull << 26);    // a displacement by 3.6e-12 of the cell, or none
  SphereRig turning(with_spin(state, rate * TILTED)), still(state), other(disturbed);
  DriveOf<3> drive;
  drive.dt = dt;
  drive.substeps = 1;

  double error = 0.0, scatter = 0.0, error_of_a_twentieth = 0.0, most_sliding = 0.0;
  for (int step = 1; step <= STEPS_PER_TURN; ++step) {
    const double share = static_cast<double>(step) / STEPS_PER_TURN,
                 before = (step - 1.0) / STEPS_PER_TURN;
    drive.deformation = deformation(share, true) * inverse(deformation(before, true));
    const Tensor3 turned = turning.advance(drive).stress;
    drive.deformation = deformation(share, false) * inverse(deformation(before, false));
    const ResultOf<3> expected = still.advance(drive);
    const double p = expected.mean_stress();
    const Tensor3 turn = spatial_rotation((2.0 * kPi * share) * TILTED);
    error = std::fmax(error, largest(seen_from(turn, turned) - expected.stress) / p);
    scatter = std::fmax(scatter, largest(other.advance(drive).stress - expected.stress) / p);
    if (step == STEPS_PER_TURN / 20) error_of_a_twentieth = error;
    most_sliding = std::fmax(most_sliding, expected.sliding_fraction);
  }

  EXPECT_GT(most_sliding, 0.05);
  EXPECT_LT(error_of_a_twentieth, 1e-5);    // before contacts open
  EXPECT_GT(scatter, 1e-5);
  EXPECT_LT(error, 2.0 * scatter);
}

TEST(SpinAboutTheNormal, RotatesTheHistoryOfAPair)
{
  // The spheres are so heavy that forces do not move them. They spin about the normal: both with
  // the same spin, only the first one, or both with opposite spins.
  Material material = spheres_material();
  material.density = 1e20;
  material.local_damping = 0.0;
  const double r = 0.005, dt = 1e-6, rate = 0.5 * kPi / (5000 * dt);
  const Vector middle{{0.05, 0.05, 0.05}}, to = (r - 1e-6) * TILTED;
  const Vector force = 0.3 * (1.0 / 0.6) * cross(TILTED, Vector{{0.0, 0.0, 1.0}});
  std::vector<double> places;
  for (const Vector &place : {middle - to, middle + to})
    places.insert(places.end(), place.component, place.component + 3);
  for (const double other : {1.0, 0.0, -1.0}) {
    Spheres state = spheres(material, 0.1 * Tensor3::identity(), {r, r}, places);
    PairOf<3> pair{};
    pair.first = 0;
    pair.second = 1;
    pair.tangential_force = force;
    state.pairs = {pair};
    for (int a = 0; a < 3; ++a) {
      state.spin[a] = rate * TILTED[a];
      state.spin[3 + a] = other * rate * TILTED[a];
    }
    SphereRig rig(state);
    rig.strain(Tensor3::zero(), dt, 5000);

    const Vector expected = spatial_rotation((0.25 * kPi * (1.0 + other)) * TILTED) * force,
                 found = tangential_force_of(rig.state(), 0, 1);
    Vector projected = force;
    project(projected, TILTED);
    // The error of each step is of third order in its angle, 3.1e-4.
    EXPECT_LT(length(found - expected), 1e-7 * length(force)) << "second grain at " << other;
    // Control: LAMMPS does not rotate the force about the normal.
    EXPECT_NEAR(length(projected - expected),
                2.0 * std::sin(0.125 * kPi * (1.0 + other)) * length(force), 1e-9);
  }
}

// Local damping scales each component of an acceleration separately, so that it depends on the
// axes.
TEST(LocalDampingOfSpheres, IsTheOnlyTermThatDependsOnTheAxes)
{
  const Tensor3 turn = spatial_rotation(0.7 * TILTED);
  const Tensor3 shear{{0.0, 0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, -0.2}};
  for (const double damping : {0.0, 0.3}) {
    Spheres state = packing();
    state.material.local_damping = damping;
    Spheres turned = state;
    turned.cell = turn * state.cell;
    turned.list_cell = turn * state.list_cell;
    for (PairOf<3> &pair : turned.pairs) pair.tangential_force = turn * pair.tangential_force;
    const double dt = step_of(packing());

    const ResultOf<3> expected = SphereRig(state).strain(shear, dt, 1000);
    const ResultOf<3> found = SphereRig(turned).strain(turn * shear * transpose(turn), dt, 1000);

    const double error =
        largest(seen_from(turn, found.stress) - expected.stress) / expected.mean_stress();
    if (damping == 0.0) {
      EXPECT_LT(error, 1e-11);
    } else {
      EXPECT_GT(error, 1e-6);
      EXPECT_LT(error, 1e-3);
    }
  }
}
