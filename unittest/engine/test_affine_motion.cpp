// SPDX-License-Identifier: GPL-2.0-only
// Tests that cell and grains move affinely, except for rounding errors, if no forces act.

#include "support/rve_rig.h"

#include "rve/physics/cell.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

struct Motion {
  const char *name;
  Tensor2 velocity_gradient;
};

const Motion MOTIONS[] = {{"stretch", {{0.3, 0.0, 0.0, -0.2}}},
                          {"shear", {{0.0, 0.25, 0.0, 0.0}}},
                          {"rotation", {{0.0, -1.3, 1.3, 0.0}}},
                          {"general", {{0.1, 0.35, -0.2, -0.05}}}};

void expect_near(const Tensor2 &a, const Tensor2 &b, double tolerance, const std::string &what)
{
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(a.component[k], b.component[k], tolerance) << what << ", component " << k;
}

}    // namespace

TEST(AffineMotion, FreeGrainsKeepFractionalCoordinatesAndTheFinalCellIsExact)
{
  const RveState before = paper_gas();
  for (const Format format : ALL_FORMATS)
    for (const Motion &motion : MOTIONS) {
      RveRig rig(before, cpu_options(format));
      const RveState loaded = rig.state();    // `fast` keeps the leading 32 bits
      const Drive drive = Drive::constant_velocity_gradient(motion.velocity_gradient, 1e-3, 500);

      const Result &result = rig.advance(drive);

      const RveState after = rig.state();
      EXPECT_EQ(result.status, status::NoContacts) << motion.name;
      EXPECT_EQ(result.counters.lattice_reductions, 0) << motion.name;
      EXPECT_EQ(after.fractional, loaded.fractional) << motion.name;
      EXPECT_EQ(after.velocity, loaded.velocity)
          << motion.name;    // zero: the mean field exerts no impulse
      EXPECT_EQ(after.spin, loaded.spin) << motion.name;
      EXPECT_EQ(components(after.cell), components(drive.deformation * before.cell)) << motion.name;
      EXPECT_EQ(components(result.deformation), components(drive.deformation)) << motion.name;
    }
}

TEST(AffineMotion, ManyCallsAddUpToTheExponential)
{
  const RveState before = paper_gas();
  for (const Motion &motion : MOTIONS) {
    RveRig rig(before);

    rig.strain(motion.velocity_gradient, 1e-3, 10, 50);

    // The deformation is the product of 50 increments. Each multiplication is rounded to 2^-53.
    const Tensor2 expected =
        Drive::constant_velocity_gradient(motion.velocity_gradient, 1e-3, 500).deformation;
    expect_near(rig.result().deformation, expected, 50 * 4e-16, motion.name);
    expect_near(rig.state().cell, expected * before.cell, 50 * 4e-16, motion.name);
  }
}

TEST(AffineMotion, MaterialPointsFollowTheDeformationThroughLatticeReductions)
{
  RveState before = paper_gas();
  for (double &r : before.radius)
    r *= 1e-3;    // grains so small that no two of them touch even at gamma = 3
  RveRig rig(before);

  rig.strain(gradient(0, 1, 1.0), 1e-3, 100, 30);

  const RveState after = rig.state();
  EXPECT_GE(rig.result().counters.lattice_reductions, 2);
  EXPECT_NEAR(rig.result().deformation(0, 1), 3.0, 1e-13);
  // x = F x0 up to a lattice vector of the new cell
  const std::vector<double> x0 = before.positions(), x = after.positions();
  const Tensor2 to_fraction = inverse(after.cell);
  for (int i = 0; i < before.num_grains(); ++i) {
    const Vec<double, 2> moved =
        rig.result().deformation * Vec<double, 2>{{x0[2 * i], x0[2 * i + 1]}};
    const Vec<double, 2> s =
        to_fraction * Vec<double, 2>{{x[2 * i] - moved[0], x[2 * i + 1] - moved[1]}};
    for (int a = 0; a < 2; ++a) EXPECT_NEAR(s[a], std::round(s[a]), 1e-12) << "grain " << i;
  }
}

TEST(AffineMotion, JumpOfTheVelocityGradientGivesNoImpulse)
{
  RveState before = paper_gas();
  RveRig rig(before);

  rig.strain(gradient(0, 1, 0.5), 1e-3, 10);
  rig.strain(gradient(1, 1, -20.0), 1e-3, 1);
  rig.strain(gradient(0, 1, -0.5), 1e-3, 10);

  EXPECT_EQ(rig.state().velocity, before.velocity);
  EXPECT_EQ(rig.state().fractional, before.fractional);
}

TEST(AffineMotion, PeculiarVelocityIsContinuousAcrossTheBoundary)
{
  // The disks cross a sheared cell many times. Their fractional coordinates are s = s0 + H^-1 c t,
  // wrapped, with the velocity c.
  RveState state = state_of(paper_material(), Tensor2{{0.1, 0.03, 0.0, 0.08}}, {0.004, 0.004},
                            {0.02, 0.02, 0.02, 0.05});
  state.velocity = {1.7, -0.9, 1.7, -0.9};
  RveRig rig(state);

  rig.strain(Tensor2::zero(), 1e-3, 1000);

  const Vec<double, 2> s = inverse(state.cell) * Vec<double, 2>{{1.7, -0.9}};
  for (int a = 0; a < 2; ++a) {
    const double start = static_cast<double>(state.fractional[a]) * 0x1p-64;
    const double error = static_cast<double>(rig.state().fractional[a]) * 0x1p-64 - (start + s[a]);
    // The engine adds 1000 displacements of 0.02 of the cell with relative errors of a few 2^-53;
    // the sum of doubles in this test has an error of 20 * 2^-53.
    EXPECT_NEAR(error, std::round(error), 1000 * 0.02 * 4e-16) << "up to whole cells";
  }
}

// ---- relative velocity across the periodic boundary ----

class PairAcrossTheBoundary : public ::testing::Test {
 protected:
  /// Returns overlapping disks in the middle of the cell, shifted by fractional coordinates.
  static RveState pair_at(std::uint64_t shift_x, std::uint64_t shift_y)
  {
    RveState state = state_of(paper_material(), Tensor2{{0.08, 0.01, -0.005, 0.07}}, {0.005, 0.004},
                              {0.04, 0.03, 0.04 + 0.0089 * 0.6, 0.03 + 0.0089 * 0.8});
    for (std::uint64_t &s : state.fractional)
      s = (s >> 32) << 32;    // the same number in every format
    for (std::size_t i = 0; i < 2; ++i) {
      state.fractional[2 * i] += shift_x;
      state.fractional[2 * i + 1] += shift_y;
    }
    return state;
  }
};

TEST_F(PairAcrossTheBoundary, MovesAsThePairInsideDoes)
{
  const RveState inside = pair_at(0, 0);
  const std::uint64_t to_edge[2] = {0 - inside.fractional[0] - (std::uint64_t(5) << 56),
                                    0 - inside.fractional[1] - (std::uint64_t(3) << 56)};
  const std::uint64_t shifts[][2] = {{to_edge[0], 0}, {0, to_edge[1]}, {to_edge[0], to_edge[1]}};
  const Tensor2 l{{0.2, 0.5, -0.3, 0.1}};
  for (const Format format : ALL_FORMATS) {
    RveRig reference(inside, cpu_options(format));
    reference.strain(l, 1e-5, 10, 5);
    for (const auto &shift : shifts) {
      const RveState across = pair_at(shift[0] & ~0xffffffffull, shift[1] & ~0xffffffffull);
      ASSERT_TRUE(across.fractional[2] < across.fractional[0] ||
                  across.fractional[3] < across.fractional[1]);
      RveRig rig(across, cpu_options(format));

      rig.strain(l, 1e-5, 10, 5);

      EXPECT_EQ(reference.result().num_contacts, 1);
      EXPECT_TRUE(same_answer(rig.result(), reference.result()));
      EXPECT_EQ(rig.state().velocity, reference.state().velocity);
      EXPECT_EQ(rig.state().spin, reference.state().spin);
      EXPECT_EQ(histories(rig.state()), histories(reference.state()));
      for (int k = 0; k < 4; ++k)
        EXPECT_EQ(rig.state().fractional[k] - across.fractional[k],
                  reference.state().fractional[k] - inside.fractional[k]);
    }
  }
}

TEST_F(PairAcrossTheBoundary, SlipsByTheVelocityGradientTimesTheBranch)
{
  // After one step from rest the tangential force is k_t dt t.(L b), with the tangent t and the
  // branch vector b to the nearest image.
  const RveState inside = pair_at(0, 0);
  const RveState state =
      pair_at((0 - inside.fractional[0] - (std::uint64_t(5) << 56)) & ~0xffffffffull, 0);
  const Tensor2 l{{0.2, 0.5, -0.3, 0.1}};
  const double dt = 1e-5;
  RveRig rig(state);

  rig.strain(l, dt, 1);

  const Tensor2 cell = rig.state().cell;
  Vec<double, 2> s;
  for (int a = 0; a < 2; ++a)
    s[a] = static_cast<double>(
               static_cast<std::int64_t>(state.fractional[2 + a] - state.fractional[a])) *
        0x1p-64;
  const Vec<double, 2> b = cell * s;
  const double size = std::sqrt(dot(b, b));
  const double expected = 1e6 * dt * cross(b, l * b) / size;
  const auto history = histories(rig.state());
  ASSERT_EQ(history.size(), 1u);
  // The cell moves on a straight path, on which L = Hdot H^-1 differs from the constant L by L^2
  // dt/2. This is about 3e-6 of L.
  EXPECT_NEAR(std::get<2>(history[0]), expected, 1e-5 * std::fabs(expected));
  EXPECT_GT(std::fabs(expected), 1e-4);
}
