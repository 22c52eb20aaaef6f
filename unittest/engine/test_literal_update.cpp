// SPDX-License-Identifier: GPL-2.0-only
// Compares the time integration of the engine with the equations of the paper
// (oracle/literal_update.h). The engine uses peculiar velocities and fractional coordinates.
// Equations (23), (38) and (39) of the paper use total velocities and Cartesian positions. The two
// motions differ by O(dt).

#include "oracle/literal_update.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

struct Difference {
  double position;    ///< root mean square [length]
  double stress;      ///< largest difference of a component / pressure [-]
  /// root mean square displacement of the grains relative to the mean field [length]
  double motion;
};

/// Runs shear for 5 ms and then compression for 5 ms. Both are straight paths of the cell H. L =
/// Hdot H^-1 varies along the second path, and jumps at the start of each path.
Difference after_ten_milliseconds(const RveState &packing, double dt)
{
  const double duration = 0.005;
  const int steps = static_cast<int>(std::lround(duration / dt));
  const Drive shear = Drive::constant_velocity_gradient(gradient(0, 1, 0.5), dt, steps);
  const Drive compression =
      Drive::constant_velocity_gradient(gradient(1, 1, -0.3) + gradient(1, 0, 0.1), dt, steps);
  const Tensor2 first_rate = (1.0 / duration) * (shear.deformation * packing.cell - packing.cell);
  const Tensor2 sheared = shear.deformation * packing.cell;
  const Tensor2 second_rate = (1.0 / duration) * (compression.deformation * sheared - sheared);
  LiteralUpdate literal(packing, first_rate * inverse(packing.cell));
  const LiteralUpdate start = literal;
  for (int k = 1; k <= 2 * steps; ++k) {
    const Tensor2 next_cell = literal.cell_matrix() + dt * (k <= steps ? first_rate : second_rate);
    literal.step(dt, (k < steps ? first_rate : second_rate) * inverse(next_cell));
  }

  RveRig ours(packing);
  ours.advance(shear);
  ours.advance(compression);

  Difference difference = {literal.distance_to(ours.state()), 0.0, start.distance_to(ours.state())};
  for (int k = 0; k < 4; ++k)
    difference.stress =
        std::max(difference.stress,
                 std::fabs(literal.stress().component[k] - ours.result().stress.component[k]) /
                     ours.result().mean_stress());
  return difference;
}

}    // namespace

TEST(LiteralUpdateOfThePaper, ConvergesToOursAtFirstOrderInTheTimeStep)
{
  RveState packing = paper_packing();
  packing.material.local_damping = 0.0;

  const Difference coarse = after_ten_milliseconds(packing, 4e-5);
  const Difference middle = after_ten_milliseconds(packing, 2e-5);
  const Difference fine = after_ten_milliseconds(packing, 1e-5);

  // The second-order term of the difference is w dt ~ 1e-2 of the first-order term. Single contacts
  // that begin to slide one step earlier add a per cent.
  EXPECT_LT(coarse.position, 1e-4 * coarse.motion);
  EXPECT_NEAR(coarse.position / middle.position, 2.0, 0.05);
  EXPECT_NEAR(middle.position / fine.position, 2.0, 0.05);
  EXPECT_NEAR(coarse.stress / middle.stress, 2.0, 0.1);
  EXPECT_NEAR(middle.stress / fine.stress, 2.0, 0.1);
}

TEST(LiteralUpdateOfThePaper, DampsTheSameVelocity)
{
  // Cundall's damping depends on the sign of a velocity, which can be nearly zero. The difference
  // between both updates therefore decreases in jumps. From steps of 4e-5 s to 5e-6 s it decreases
  // by a factor of at least four, while first order would give eight. If the total velocity were
  // damped, as in equation (4) without (38), the difference would be of the order of the motion.
  const RveState packing = paper_packing();

  const Difference coarse = after_ten_milliseconds(packing, 4e-5);
  const Difference fine = after_ten_milliseconds(packing, 5e-6);

  EXPECT_LT(fine.position, 0.25 * coarse.position);
  EXPECT_LT(fine.position, 1e-4 * fine.motion);
  EXPECT_LT(fine.stress, 2e-6);
}
