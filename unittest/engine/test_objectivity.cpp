// SPDX-License-Identifier: GPL-2.0-only
// Objectivity: a rigid rotation of the whole RVE rotates its stress and changes nothing else.

#include "support/rve_rig.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RATE = 10.0;              // [rad/s]
constexpr int STEPS_PER_QUARTER = 1963;    // dt = 8e-5 s

/// Returns the paper's packing after 1 % of shear and a time at rest. It has q/p = 0.36 and
/// tangential forces at all contacts.
RveState sheared_packing()
{
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 0.05), 5e-5, 2000, 2);
  rig.strain(Tensor2::zero(), 5e-5, 4000);
  EXPECT_LT(rig.result().unbalanced_ratio, 1e-6);
  return rig.state();
}

/// Returns the state with grains that spin at the rate of the cell. Without these spins, the
/// contacts would have to accelerate the grains, since the mean field does not drive spins
/// (equation 23 of the paper).
RveState turning(RveState state)
{
  for (double &spin : state.spin) spin = RATE;
  return state;
}

void turn_by_quarters(RveRig &rig, int quarters)
{
  const double dt = 0.5 * M_PI / RATE / STEPS_PER_QUARTER;
  rig.strain(spin_gradient(RATE), dt, STEPS_PER_QUARTER / 13, 13 * quarters);    // 0.12 rad a call
}

Tensor2 rotated(const Tensor2 &stress, int quarters)
{
  const double c = quarters % 2 ? 0.0
      : quarters % 4            ? -1.0
                                : 1.0,
               s = quarters % 2 ? (quarters % 4 == 1 ? 1.0 : -1.0) : 0.0;
  const Tensor2 r{{c, -s, s, c}};
  return r * stress * transpose(r);
}

}    // namespace

class RigidRotation : public ::testing::TestWithParam<int> {};

TEST_P(RigidRotation, RotatesTheStressAndKeepsItsInvariants)
{
  static_assert(STEPS_PER_QUARTER % 13 == 0, "calls make whole quarters");
  const int quarters = GetParam();
  const RveState state = turning(sheared_packing());
  RveRig rig(state, cpu_options(Format::Mixed));
  const Result before = rig.evaluate();

  turn_by_quarters(rig, quarters);

  // Contacts rotate all grains except rattlers. The rotation is approximated by chords of 0.01 rad,
  // which shrink the cell by up to 1.3e-5. With a stiffness of 12 MPa, this strain changes the
  // stress by 300 Pa. Friction then changes the stress by 1e-4 of p. The error does not grow with
  // the number of turns.
  const Result &after = rig.result();
  EXPECT_NEAR(after.mean_stress() / before.mean_stress(), 1.0, 2e-4);
  EXPECT_NEAR(after.deviatoric_stress() / before.deviatoric_stress(), 1.0, 5e-4);
  EXPECT_EQ(after.coordination_number, before.coordination_number);
  const Tensor2 expected = rotated(before.stress, quarters);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(after.stress.component[k], expected.component[k], 3e-4 * before.mean_stress())
        << "component " << k;
  EXPECT_NEAR(determinant(after.cell) / determinant(before.cell), 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Turns, RigidRotation, ::testing::Values(1, 4, 40), [](const auto &info) {
  return std::to_string(90 * info.param) + "degrees";
});

// The work of the stress equals the dissipation of the grains. The bookkeeping computes half of the
// work of a step with the stress and the cell before the step, and half with the stress and the
// cell after the step. If both halves used the cell after the step, a rotation by the angle w T
// would add a work of -p V w^2 dt T, which is 1.3e-3 of p V here.
TEST(SteadyRotation, DoesOnlyTheWorkOfTheDissipation)
{
  Options options = cpu_options(Format::Double);
  options.track_energy = true;
  RveRig rig(turning(sheared_packing()), options);
  const Result before = rig.evaluate();
  const double scale =
      before.mean_stress() * determinant(before.cell) * paper_packing().material.thickness;

  turn_by_quarters(rig, 1);

  const Result &after = rig.result();
  const double work = after.energy.work - before.energy.work;
  const auto known = [](const Result &result) {
    return result.kinetic_energy + result.elastic_energy + result.energy.friction +
        result.energy.local_damping + result.energy.viscous;
  };
  EXPECT_LT(std::fabs(work), 2e-4 * scale);
  EXPECT_NEAR(work, known(after) - known(before), 1e-7 * scale);
}

TEST(SteadyRotation, NineMoreTurnsDoNotChangeTheStress)
{
  RveRig rig(turning(sheared_packing()), cpu_options(Format::Mixed));
  turn_by_quarters(rig, 4);
  const double after_one = rig.result().mean_stress();

  turn_by_quarters(rig, 36);

  EXPECT_NEAR(rig.result().mean_stress() / after_one, 1.0, 2e-5);
}

// Control: the lever arms of LAMMPS' pair granular are the full radii. With these arms, the contact
// of a pair that rotates at the rate W slips at the velocity W delta, with the overlap delta.
TEST(SteadyRotation, ArmsOfLammpsRaiseThePressure)
{
  const RveState state = turning(paper_packing());
  Options options = cpu_options(Format::Mixed);
  options.arms = Arms::Lammps;
  RveRig lammps(state, options), ours(state, cpu_options(Format::Mixed));
  const double before = ours.evaluate().mean_stress();

  turn_by_quarters(lammps, 4);
  turn_by_quarters(ours, 4);

  EXPECT_GT(lammps.result().mean_stress(), 1.03 * before);
  EXPECT_LT(lammps.result().coordination_number, ours.result().coordination_number - 0.1);
  EXPECT_NEAR(ours.result().mean_stress() / before, 1.0, 2e-4);
}

TEST(Observer, ResponseRotatesWithTheFrame)
{
  // The second RVE is the first one in a frame that is rotated by 90 degrees. Cell and drive are
  // rotated, and fractional coordinates are the same.
  RveState state = paper_packing();
  RveState turned = state;
  turned.cell = Tensor2{{-0.0, -1.0, 1.0, 0.0}} * state.cell;
  const Tensor2 l = gradient(0, 1, 0.3) + gradient(1, 1, -0.1);
  const Tensor2 r{{0.0, -1.0, 1.0, 0.0}};
  RveRig rig(state), turned_rig(turned);

  rig.strain(l, 5e-5, 50, 20);
  turned_rig.strain(r * l * transpose(r), 5e-5, 50, 20);

  // The rotated drive has different rounding errors. After 1000 steps of a stable packing they are
  // 1e-10.
  const Tensor2 expected = r * rig.result().stress * transpose(r);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(turned_rig.result().stress.component[k], expected.component[k],
                1e-8 * rig.result().mean_stress());
  EXPECT_EQ(turned_rig.result().num_contacts, rig.result().num_contacts);
}
