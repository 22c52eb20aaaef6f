// SPDX-License-Identifier: GPL-2.0-only
// Tests the modes of a stress servo. A mode is a velocity gradient that controls one weighted sum
// of stress components. The tests check the modes that follow from given conditions, and the
// convergence of the servo in an elastic material. Modes that are single components must give the
// same bits as a servo for components.

#include "rve/algorithm/stress_servo.h"
#include "rve/core/error.h"
#include "rve/engine/servo_modes.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

using Sum = ComponentSum<3>;
using Sums = std::vector<Sum>;

constexpr Sum XX{1, 0, 0, 0, 0, 0}, YY{0, 1, 0, 0, 0, 0}, ZZ{0, 0, 1, 0, 0, 0},
    XY{0, 0, 0, 1, 0, 0}, XZ{0, 0, 0, 0, 1, 0}, YZ{0, 0, 0, 0, 0, 1}, VOLUME{1, 1, 1, 0, 0, 0},
    MEAN{1. / 3, 1. / 3, 1. / 3, 0, 0, 0}, Q{0.5, 0.5, -1, 0, 0, 0}, SIDES{1, -1, 0, 0, 0, 0};

Sum b_of(double b)
{
  return {b - 1.0, 1.0, -b, 0, 0, 0};
}

struct Control {
  const char *name;
  Sums rates, stresses;
};

/// Conditions of laboratory tests. Shear components that have no stress condition keep a rate of
/// zero.
const Control CONTROLS[] = {{"isotropic", {XY, XZ, YZ}, {XX, YY, ZZ}},
                            {"all stresses", {}, {XX, YY, ZZ, XY, XZ, YZ}},
                            {"isotropic strain", {XY, XZ, YZ, SIDES, {1, 0, -1, 0, 0, 0}}, {MEAN}},
                            {"drained", {ZZ, XY, XZ, YZ}, {XX, YY}},
                            {"undrained", {ZZ, VOLUME, XY, XZ, YZ}, {SIDES}},
                            {"undrained, by stress", {VOLUME, XY, XZ, YZ}, {Q, SIDES}},
                            {"constant p", {ZZ, XY, XZ, YZ}, {MEAN, SIDES}},
                            {"constant q, at a volume rate", {VOLUME, XY, XZ, YZ}, {Q, SIDES}},
                            {"constant q, at an axial rate", {ZZ, XY, XZ, YZ}, {Q, SIDES}},
                            {"constant b = 0.3", {ZZ, XY, XZ, YZ}, {XX, b_of(0.3)}},
                            {"constant b = 1", {ZZ, XY, XZ, YZ}, {XX, b_of(1.0)}},
                            {"constant p and b", {ZZ, XY, XZ, YZ}, {MEAN, b_of(0.5)}},
                            {"simple shear", {XY, XZ, YZ}, {XX, YY, ZZ}},
                            {"undrained simple shear, by stress", {XX, YY, ZZ, XZ, YZ}, {XY}}};

double dot(const Sum &a, const Sum &b)
{
  double sum = 0.0;
  for (int c = 0; c < 6; ++c) sum += a[c] * b[c];
  return sum;
}

double contract(const Tensor3 &a, const Tensor3 &b)
{
  double sum = 0.0;
  for (int c = 0; c < 9; ++c) sum += a.component[c] * b.component[c];
  return sum;
}

Sum upper(const Tensor3 &l)
{
  return {l(0, 0), l(1, 1), l(2, 2), l(0, 1), l(0, 2), l(1, 2)};
}

/// Returns the stress of an isotropic elastic material under the strain `l`, divided by the
/// constrained modulus.
Tensor3 elastic_stress(const Tensor3 &l, double poisson)
{
  const double lame = poisson / (1.0 - poisson),
               twice_shear = (1.0 - 2.0 * poisson) / (1.0 - poisson);
  return lame * (l(0, 0) + l(1, 1) + l(2, 2)) * Tensor3::identity() +
      0.5 * twice_shear * (l + transpose(l));
}

SteeredModes<3> kernel_modes(const ServoModesOf<3> &control, const Tensor3 &goal)
{
  SteeredModes<3> modes{};
  modes.count = static_cast<std::int32_t>(control.modes.size());
  for (int k = 0; k < modes.count; ++k) {
    const ServoModeOf<3> &from = control.modes[k];
    SteeredMode<3> &to = modes.mode[k];
    std::copy(std::begin(from.rate.component), std::end(from.rate.component), to.rate);
    std::copy(std::begin(from.dual.component), std::end(from.dual.component), to.dual);
    std::copy(std::begin(from.stress.component), std::end(from.stress.component), to.stress);
    to.goal = contract(from.stress, goal);
    to.gain = from.weight;
    to.max_rate = 1e30;
  }
  return modes;
}

double largest_error(const SteeredModes<3> &modes, const Tensor3 &stress)
{
  double most = 0.0;
  for (int k = 0; k < modes.count; ++k) {
    double now = 0.0;
    for (int c = 0; c < 9; ++c) now += modes.mode[k].stress[c] * stress.component[c];
    most = std::max(most, std::fabs(modes.mode[k].goal - now));
  }
  return most;
}

/// Raises all goals from zero at once and lets the servo act. Returns the largest final error of
/// the stresses divided by the largest initial error. The servo acts for the time radians/w, with
/// the angular frequency w of the fastest wave for which the servo is designed.
double error_left(const Control &control, double poisson, double radians)
{
  const ServoModesOf<3> servo(control.rates, control.stresses);
  Tensor3 goal = Tensor3::zero();
  for (const Tensor3 &unit : servo.unit_stresses) goal = goal + unit;
  const SteeredModes<3> modes = kernel_modes(servo, goal);
  Tensor3 rate = Tensor3::zero(), stress = Tensor3::zero();
  const double dt = 0.01;
  const double before = largest_error(modes, stress);
  for (int step = 0; step < radians / dt; ++step) {
    stress = stress + dt * elastic_stress(rate, poisson);
    rate = gradient_of_modes(modes, Tensor3::zero(), [&](const SteeredMode<3> &mode) {
      double now = 0.0;
      for (int c = 0; c < 9; ++c) now += mode.stress[c] * stress.component[c];
      return steer_rate(amplitude_in(mode, rate), now, mode.goal, mode.gain, dt, mode.max_rate);
    });
  }
  return largest_error(modes, stress) / before;
}

std::string message_of(const Sums &rates, const Sums &stresses)
{
  try {
    ServoModesOf<3>(rates, stresses);
  } catch (const InputError &e) {
    return e.what();
  }
  return "";
}

}    // namespace

TEST(ServoModes, KeepPrescribedRatesAndAreDual)
{
  for (const Control &control : CONTROLS) {
    SCOPED_TRACE(control.name);
    const ServoModesOf<3> servo(control.rates, control.stresses);
    ASSERT_EQ(servo.modes.size(), control.stresses.size());
    for (std::size_t k = 0; k < servo.modes.size(); ++k) {
      for (const Sum &rate : control.rates)
        EXPECT_NEAR(dot(rate, upper(servo.modes[k].rate)), 0.0, 1e-15);
      for (const Tensor3 &rate : servo.unit_rates)
        EXPECT_NEAR(contract(servo.modes[k].dual, rate), 0.0, 1e-15);
      for (std::size_t m = 0; m < servo.modes.size(); ++m) {
        EXPECT_NEAR(contract(servo.modes[k].dual, servo.modes[m].rate), k == m, 1e-15);
        EXPECT_NEAR(contract(servo.modes[k].stress, servo.unit_stresses[m]), k == m, 1e-15);
      }
    }
    for (std::size_t j = 0; j < control.rates.size(); ++j)
      for (std::size_t i = 0; i < control.rates.size(); ++i)
        EXPECT_NEAR(dot(control.rates[i], upper(servo.unit_rates[j])), i == j, 1e-15);
  }
}

// The servo needs no parameter of the material. Its oscillations decay at a quarter of its gain,
// about 0.08 per radian. The controls with constant b or constant q at an axial rate take longer,
// since their stresses are not work conjugate to the free rates.
TEST(ServoModes, ConvergeInAnyIsotropicElasticMaterial)
{
  for (const Control &control : CONTROLS)
    for (const double poisson : {-0.5, 0.0, 0.3, 0.45}) {
      SCOPED_TRACE(std::string(control.name) + ", Poisson's ratio " + std::to_string(poisson));
      EXPECT_LT(error_left(control, poisson, 400.0), 1e-3);
    }
}

TEST(ServoModes, AreRefusedWithTheReason)
{
  // The volume determines p, so that no rate can control it.
  EXPECT_NE(message_of({VOLUME, ZZ, XY, XZ, YZ}, {ZZ}).find("a stress goal cannot be reached"),
            std::string::npos);
  EXPECT_NE(message_of({VOLUME, XX, YY, ZZ, XY}, {XZ}).find("rates depend"), std::string::npos);
  EXPECT_NE(message_of({XY, XZ, YZ}, {MEAN, Q, VOLUME}).find("stresses depend"), std::string::npos);
  EXPECT_NE(message_of({XY}, {MEAN}).find("there must be 6"), std::string::npos);
  EXPECT_NE(message_of({VOLUME, SIDES, XY, XZ, YZ}, {MEAN}).find("a stress goal cannot be reached"),
            std::string::npos);
}

TEST(ServoModes, OfSingleComponentsAreTheServoOfComponents)
{
  const ServoModesOf<2> control({{0.0, 1.0, 0.0}}, {{1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}});
  DriveOf<2> single;
  single.dt = 5e-5;
  single.substeps = 100;
  single.servo_gain = 1.0 / 47.952;
  single.controlled[0][0] = single.controlled[0][1] = true;
  single.stress_goal = Tensor2{{-1.1e5, 4e3, 4e3, 0.0}};
  single.velocity_gradient = gradient(1, 1, -0.05);
  DriveOf<2> modes = single;
  modes.controlled[0][0] = modes.controlled[0][1] = false;
  modes.modes = control.modes.data();
  modes.num_modes = 2;
  RveRig one(paper_packing()), other(paper_packing());

  for (int k = 0; k < 5; ++k) {
    one.advance(single);
    other.advance(modes);
  }

  EXPECT_TRUE(same_motion(one.state(), other.state()));
  EXPECT_EQ(components(one.result().servo_velocity_gradient),
            components(other.result().servo_velocity_gradient));
  EXPECT_NE(one.result().servo_velocity_gradient(0, 1), 0.0);
}

TEST(ServoModes, ContinueFromCallToCallUnlessRestarted)
{
  const ServoModesOf<2> control({{0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {{1.0, 0.0, 0.0}});
  DriveOf<2> drive;
  drive.dt = 5e-5;
  drive.substeps = 50;
  drive.servo_gain = 1.0 / 47.952;
  drive.servo_max_rate = 100.0;
  drive.stress_goal(0, 0) = -1.3e5;
  drive.velocity_gradient = gradient(1, 1, -0.05);
  drive.modes = control.modes.data();
  drive.num_modes = 1;
  RveRig whole(paper_packing()), parts(paper_packing()), anew(paper_packing());
  DriveOf<2> half = drive;
  half.substeps = 25;
  DriveOf<2> begin = half;
  begin.modes_begin = 1;

  whole.advance(drive);
  parts.advance(half);
  parts.advance(half);
  anew.advance(half);
  const double before = anew.result().servo_velocity_gradient(0, 0);
  anew.advance(begin);

  const double rate = whole.result().servo_velocity_gradient(0, 0);
  EXPECT_NEAR(parts.result().servo_velocity_gradient(0, 0), rate, 1e-9);
  // `modes_begin` discards the rate that the servo accumulated in the first call.
  EXPECT_NEAR(anew.result().servo_velocity_gradient(0, 0), rate - before, 0.2 * std::fabs(rate));
  EXPECT_GT(std::fabs(before), 0.3 * std::fabs(rate));
}
