// SPDX-License-Identifier: GPL-2.0-only
// Tests the quick check of a drive, which most drives pass. A drive must pass it if and only if the
// complete checks find nothing.

#include "rve/core/error.h"
#include "rve/engine/drive_record.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <type_traits>

using namespace rve;
using namespace rve_test;

namespace {

template <class Dimension> class DriveOfDimension : public testing::Test {
 public:
  static constexpr int D = Dimension::value;

  static DriveOf<D> by(const Tensor<double, D> &deformation)
  {
    DriveOf<D> drive;
    drive.dt = 1e-5;
    drive.substeps = 3;
    drive.deformation = deformation;
    return drive;
  }

  /// Returns true if the complete checks find no error and no need for a steering record (servo, or
  /// several segments).
  static bool is_plain(const DriveOf<D> &drive)
  {
    try {
      check(drive);
    } catch (const InputError &) {
      return false;
    }
    return !needs_steering(drive);
  }
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(DriveOfDimension, Dimensions);

}    // namespace

// The deformations include rotations that are too large for one segment, and deformations that
// invert the volume.
TYPED_TEST(DriveOfDimension, IsSimpleWithoutErrorsAndSteering)
{
  constexpr int D = TestFixture::D;
  Random random(7);
  int simple = 0, others = 0;
  for (const double size : {1e-6, 1e-3, 0.003, 0.006, 0.01, 0.02, 0.1, 1.0, 3.0})
    for (int n = 0; n < 400; ++n) {
      auto deformation = Tensor<double, D>::identity();
      for (double &component : deformation.component) component += random.uniform(-size, size);
      const auto drive = TestFixture::by(deformation);

      ASSERT_EQ(is_simple(drive), TestFixture::is_plain(drive)) << size;

      ++(is_simple(drive) ? simple : others);
    }
  EXPECT_GT(simple, 1000);
  EXPECT_GT(others, 1000);
}

TYPED_TEST(DriveOfDimension, IsNotSimpleWithOtherFeatures)
{
  constexpr int D = TestFixture::D;
  const double infinite = std::numeric_limits<double>::infinity();
  const auto plain = TestFixture::by(Tensor<double, D>::identity());
  ASSERT_TRUE(is_simple(plain));
  for (int k = 0; k < Space<D>::components; ++k)
    for (const double wrong : {infinite, -infinite, std::nan("")}) {
      auto drive = plain;
      drive.deformation.component[k] = wrong;
      EXPECT_FALSE(is_simple(drive)) << k << ' ' << wrong;
    }
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      auto drive = plain;
      drive.controlled[a][b] = true;
      EXPECT_FALSE(is_simple(drive)) << a << b;
    }
  auto by_modes = plain, backwards = plain, frozen = plain, endless = plain, asks = plain;
  by_modes.num_modes = 1;
  backwards.substeps = -1;
  frozen.dt = 0.0;
  endless.dt = infinite;
  for (const auto &drive : {by_modes, backwards, frozen, endless}) EXPECT_FALSE(is_simple(drive));
  asks.dt = 0.0;
  asks.substeps = 0;    // forces of the present configuration
  EXPECT_TRUE(is_simple(asks));
}
