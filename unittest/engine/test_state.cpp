// SPDX-License-Identifier: GPL-2.0-only
#include "rve/core/error.h"
#include "rve/engine/engine.h"
#include "rve/engine/state.h"
#include "support/messages.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();

void expect_contains(const std::string &message, const std::string &fragment)
{
  EXPECT_NE(message.find(fragment), std::string::npos) << "message: " << message;
}

// Computes exp(A) in long double, as a simple reference: the Taylor series of exp(A/2^10) is
// squared ten times.
void exponential_by_squaring(const Tensor2 &a, long double result[4])
{
  long double x[4], term[4] = {1, 0, 0, 1}, sum[4] = {1, 0, 0, 1};
  const auto multiply = [](const long double *p, const long double *q, long double *r) {
    const long double product[4] = {p[0] * q[0] + p[1] * q[2], p[0] * q[1] + p[1] * q[3],
                                    p[2] * q[0] + p[3] * q[2], p[2] * q[1] + p[3] * q[3]};
    std::copy(product, product + 4, r);
  };
  for (int k = 0; k < 4; ++k) x[k] = std::ldexp(static_cast<long double>(a.component[k]), -10);
  for (int order = 1; order < 12; ++order) {
    multiply(term, x, term);
    for (int k = 0; k < 4; ++k) sum[k] += (term[k] /= order);
  }
  for (int square = 0; square < 10; ++square) multiply(sum, sum, sum);
  std::copy(sum, sum + 4, result);
}

}    // namespace

TEST(RveState, MassAndAreasFollowFromRadiiDensityAndDepth)
{
  RveState state = two_disks(0.0);
  state.material.mass_depth = 2.0;

  EXPECT_DOUBLE_EQ(state.solid_volume(), M_PI * (0.005 * 0.005 + 0.004 * 0.004));
  EXPECT_DOUBLE_EQ(state.mass(), 2650.0 * 2.0 * M_PI * 41e-6);
  EXPECT_DOUBLE_EQ(state.cell_volume(), 0.04);
}

TEST(RveState, PositionsReturnFromFractionalCoordinates)
{
  RveState state = crowded_state(50, 1);
  const std::vector<std::uint64_t> fractional = state.fractional;

  state.set_positions(state.positions());

  // A rounding of x is 2^-53 of the cell, or 2^11 units of the fractional coordinate. The two
  // transformations have a few roundings.
  for (std::size_t k = 0; k < fractional.size(); ++k)
    EXPECT_LT(std::llabs(static_cast<std::int64_t>(state.fractional[k] - fractional[k])), 1 << 14);
}

TEST(RveState, PositionsOutsideTheCellAreWrapped)
{
  RveState state = two_disks(0.0);

  state.set_positions({-0.05, 0.25, -1e-20, 0.2});

  EXPECT_EQ(state.fractional[0], std::uint64_t(3) << 62);
  EXPECT_NEAR(state.positions()[1], 0.05, 1e-16);
  EXPECT_EQ(state.fractional[2], 0u);    // the image of the upper edge is the lower edge
  EXPECT_EQ(state.fractional[3], 0u);
}

TEST(RveState, SoundStatePasses)
{
  EXPECT_NO_THROW(two_disks(1e-5).check());
  EXPECT_NO_THROW(crowded_state(20, 3).check());
}

TEST(RveState, WrongNumbersAreNamedWithValueUnitAndRange)
{
  const auto message_after = [](const std::function<void(RveState &)> &spoil) {
    RveState state = two_disks(1e-5);
    state.pairs.push_back({0, 1, 0.0});
    spoil(state);
    return message_of([&] { state.check(); });
  };

  expect_contains(message_after([](RveState &s) { s.material.normal_stiffness = -5.0; }),
                  "normal stiffness is -5 [force/length]; it must be finite and greater than 0");
  expect_contains(message_after([](RveState &s) { s.material.local_damping = 1.0; }),
                  "local damping is 1 [-]; it must lie in [0, 1)");
  expect_contains(message_after([](RveState &s) { s.material.friction = NOT_A_NUMBER; }),
                  "friction coefficient is nan");
  expect_contains(message_after([](RveState &s) { s.radius[1] = 0.0; }),
                  "radius of grain 2 is 0 [length]; it must be finite and greater than 0");
  expect_contains(message_after([](RveState &s) { s.velocity[3] = NOT_A_NUMBER; }),
                  "peculiar velocity of grain 2 is nan [length/time]");
  expect_contains(message_after([](RveState &s) { s.spin.pop_back(); }),
                  "RVE has 1 spins; it must have 2");
  expect_contains(message_after([](RveState &s) { s.cell(1, 1) = -0.2; }), "cell area");
  expect_contains(
      message_after([](RveState &s) { s.cell(1, 1) = 0.02; }),
      "cell width perpendicular to cell vector 0 is 0.02 [length]; it must exceed twice the "
      "largest contact distance, 0.02");
  expect_contains(message_after([](RveState &s) { s.pairs[0].second = 2; }),
                  "grain numbers are 1 to 2");
  expect_contains(message_after([](RveState &s) { s.pairs[0].second = 0; }),
                  "connects grain 1 to itself");
  expect_contains(message_after([](RveState &s) {
                    s.pairs.push_back({1, 0, 2.0});
                  }),
                  "grains 1 and 2 form a pair twice");
  expect_contains(message_after([](RveState &s) { s.list_cell = s.cell; }), "list coordinates");
  expect_contains(message_after([](RveState &s) {
                    s = RveState{};
                    s.material = paper_material();
                  }),
                  "RVE has no grains");
}

// The allowed range is 1e-30 to 1e30. Within it, a size and all quantities that are computed from
// sizes are normal numbers in all formats.
TEST(RveState, SizesThatNoFormatCanComputeWithAreNamed)
{
  struct {
    const char *what;
    double Material::*member;
    const char *words;
  } const sizes[] = {
      {"normal stiffness", &Material::normal_stiffness, "normal stiffness is"},
      {"tangential stiffness", &Material::tangential_stiffness, "tangential stiffness is"},
      {"rolling stiffness", &Material::rolling_stiffness, "rolling stiffness is"},
      {"density", &Material::density, "grain density is"},
      {"normal viscosity", &Material::normal_viscosity, "normal viscosity is"},
      {"thickness", &Material::thickness, "thickness is"},
      {"mass depth", &Material::mass_depth, "mass depth times mass scaling is"},
  };
  const auto message_after = [](const std::function<void(RveState &)> &spoil) {
    RveState state = two_disks(1e-5);
    spoil(state);
    return message_of([&] { state.check(); });
  };
  for (const auto &size : sizes)
    for (const double value : {1e300, 1e-300}) {
      const std::string message =
          message_after([&](RveState &s) { s.material.*size.member = value; });
      expect_contains(message, size.words);
      expect_contains(message, "it must be between 1e-30 and 1e30 in size");
    }
  expect_contains(message_after([](RveState &s) { s.radius[1] = 1e-200; }),
                  "radius of grain 2 is 1e-200 [length]; it must be between 1e-30 and 1e30");
  expect_contains(message_after([](RveState &s) {
                    s.material.density = 1e29;
                    s.material.mass_depth = 1e10;
                  }),
                  "[mass]; it must be between 1e-30 and 1e30");
  expect_contains(message_after([](RveState &s) {
                    s.material.density = 1e-20;
                    s.material.normal_stiffness = 1e20;
                  }),
                  "[1/time^2]; it must be between 1e-30 and 1e30");
  expect_contains(message_after([](RveState &s) {
                    s.spin[0] = 1e200;    // infinite in fp32
                  }),
                  "spin of grain 1 is 1e+200 [1/time]; it must be at most 1e30 in size");
  expect_contains(message_after([](RveState &s) { s.material.friction = 1e12; }),
                  "friction coefficient is 1e+12 [-]; it must be at most 1e10");
}

TEST(RveState, NarrowWidthOfAShearedCellIsDetected)
{
  RveState state = two_disks(0.0);
  // edges 0.03 and 0.124 with a distance of only 0.0073
  state.cell = Tensor2{{0.03, 0.12, 0.0, 0.03}};

  expect_contains(message_of([&] { state.check(); }), "cell width perpendicular to cell vector 1");
}

TEST(RveImage, EveryMemberIsRestoredToTheLastBit)
{
  const RveState state = crowded_state(33, 2);
  const std::vector<char> image = serialize(state);

  const RveState copy = deserialize(image.data(), image.size());

  EXPECT_EQ(serialize(copy), image);
  EXPECT_EQ(copy.radius, state.radius);
  EXPECT_EQ(copy.fractional, state.fractional);
  EXPECT_EQ(copy.list_fractional, state.list_fractional);
  EXPECT_EQ(copy.velocity, state.velocity);
  EXPECT_EQ(copy.spin, state.spin);
  EXPECT_EQ(copy.pairs.size(), state.pairs.size());
  EXPECT_EQ(copy.pairs.back().tangential_force, state.pairs.back().tangential_force);
  EXPECT_EQ(copy.material.mass_depth, state.material.mass_depth);
  EXPECT_EQ(copy.servo_velocity_gradient(0, 1), state.servo_velocity_gradient(0, 1));
  EXPECT_EQ(copy.largest_contact_force, state.largest_contact_force);
  EXPECT_EQ(copy.counters.repeats, 2);
  EXPECT_EQ(copy.energy.viscous, state.energy.viscous);
}

TEST(RveImage, LaterParametersAreStoredInRecordsThatHaveThem)
{
  RveStateOf<3> state = crowded_spheres(4, 9);
  const std::vector<char> without = serialize(state);
  state.material.rolling_viscosity = 0.375;
  state.material.twisting_viscosity = 1.0 / 3.0;
  const std::vector<char> with = serialize(state);

  EXPECT_EQ(with.size(), without.size() + 4 * sizeof(double));
  const RveStateOf<3> back = deserialize<3>(with.data(), with.size());
  EXPECT_EQ(back.material.rolling_viscosity, 0.375);
  EXPECT_EQ(back.material.twisting_viscosity, 1.0 / 3.0);
  EXPECT_EQ(back.material.twisting_marshall, 0.0);
  EXPECT_EQ(serialize(back), with);
  const RveStateOf<3> before = deserialize<3>(without.data(), without.size());
  EXPECT_EQ(before.material.rolling_viscosity, 0.0);
}

TEST(RveImage, DamagedByteIsDetected)
{
  const std::vector<char> image = serialize(crowded_state(5, 4));

  for (std::size_t k = 0; k < image.size(); ++k) {
    std::vector<char> damaged = image;
    damaged[k] = static_cast<char>(damaged[k] ^ 0x10);
    EXPECT_THROW(deserialize(damaged.data(), damaged.size()), InputError) << "byte " << k;
  }
}

TEST(RveImage, TruncatedAndForeignImagesAreDetected)
{
  const std::vector<char> image = serialize(crowded_state(5, 4));
  std::vector<char> foreign = image;
  std::reverse(foreign.begin(), foreign.begin() + 8);

  for (const std::size_t size :
       {std::size_t(0), std::size_t(7), image.size() / 2, image.size() - 1})
    expect_contains(message_of([&] { deserialize(image.data(), size); }), "damaged");
  expect_contains(message_of([&] { deserialize(foreign.data(), foreign.size()); }), "byte order");
}

TEST(Drive, DeformationIsTheExponentialOfTheVelocityGradient)
{
  const Tensor2 gradients[] = {{{0.3, 0.7, -0.2, 0.1}},     {{0.3, -0.7, 0.2, 0.1}},
                               {{-4.0, 1.0, 3.0, 2.0}},     {{0.0, 1.0, -1.0, 0.0}},
                               {{0.2, 0.1, -0.1, 0.0}},    // d = 0 exactly: a defective tensor
                               {{1e-6, 2e-5, 3e-5, -4e-6}}, {{0.0, 0.03, 0.03001, 0.0}}};
  for (const Tensor2 &gradient : gradients) {
    const Drive drive = Drive::constant_velocity_gradient(gradient, 0.125, 8);
    long double expected[4];
    exponential_by_squaring(gradient, expected);

    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(drive.deformation.component[k], static_cast<double>(expected[k]),
                  4e-15 * (1.0 + std::fabs(static_cast<double>(expected[k]))));
  }
}

TEST(Drive, SimpleMotionsAreExact)
{
  const Drive rest = Drive::constant_velocity_gradient(Tensor2::zero(), 0.1, 10);
  const Drive shear = Drive::constant_velocity_gradient(Tensor2{{0.0, 0.25, 0.0, 0.0}}, 0.5, 2);
  const Drive uniaxial = Drive::constant_velocity_gradient(Tensor2{{0.0, 0.0, 0.0, -0.05}}, 1.0, 1);
  const Drive turn = Drive::constant_velocity_gradient(Tensor2{{0.0, -M_PI, M_PI, 0.0}}, 0.5, 1);

  EXPECT_EQ(rest.deformation(0, 0), 1.0);
  EXPECT_EQ(rest.deformation(0, 1), 0.0);
  EXPECT_EQ(shear.deformation(0, 0), 1.0);
  EXPECT_EQ(shear.deformation(0, 1), 0.25);
  EXPECT_EQ(shear.deformation(1, 0), 0.0);
  EXPECT_EQ(uniaxial.deformation(0, 0), 1.0);
  EXPECT_EQ(uniaxial.deformation(1, 1), std::exp(-0.05));
  EXPECT_NEAR(turn.deformation(0, 1), -1.0, 1e-15);
  EXPECT_NEAR(determinant(turn.deformation), 1.0, 1e-15);
}

TEST(Result, DeviatoricStressIsHalfThePrincipalDifferenceForASymmetricStress)
{
  Result result;
  result.stress = Tensor2{{-5.0, 3.0, 3.0, -13.0}};    // principal values -9 +- 5

  EXPECT_DOUBLE_EQ(result.deviatoric_stress(), 5.0);
  EXPECT_DOUBLE_EQ(result.mean_stress(), 9.0);
}

TEST(Words, FormatsAndStatusesHaveNames)
{
  EXPECT_EQ(to_string(Format::Fast), "fast");
  EXPECT_EQ(to_string(Format::Mixed), "mixed");
  EXPECT_EQ(to_string(Format::Double), "double");
  EXPECT_EQ(to_string(Format::Single), "single");
  EXPECT_EQ(describe_status(status::Ok), "ok");
  EXPECT_EQ(describe_status(status::OverlapTooLarge | status::NoContacts),
            "overlap too large, no contacts");
  EXPECT_EQ(describe_status(1u << 31), "unknown status 2147483648");
}
