// SPDX-License-Identifier: GPL-2.0-only
// Mohr-Coulomb and Tresca in space: principal axes, and strain paths of a point against closed
// forms.

#include "element.h"
#include "mpm/linear_elastic.h"
#include "mpm/mohr_coulomb.h"
#include "rve/core/eigenvalues.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

using mpm::MohrCoulomb;
using rve::Tensor2;
using rve::Tensor3;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double YOUNG = 1e7;
constexpr double POISSON = 0.3;

double sine(double degrees)
{
  return std::sin(degrees * PI / 180.0);
}

using mpm_test::any_rotation;
using mpm_test::diagonal;
using Element = mpm_test::Element<MohrCoulomb<3>>;
using Triaxial = mpm_test::Triaxial<MohrCoulomb<3>>;

/// Returns (1 + sin)/(1 - sin) of an angle [degrees].
double ratio(double degrees)
{
  return (1.0 + sine(degrees)) / (1.0 - sine(degrees));
}

}    // namespace

TEST(PrincipalAxes, ComposeTheTensorAndAreOrthogonalForEqualValues)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int k = 0; k < 3000; ++k) {
    double values[3] = {uniform(random), uniform(random), uniform(random)};
    if (k % 5 == 1) values[1] = values[0];
    if (k % 5 == 2) values[0] = values[1] = values[2];
    if (k % 5 == 3) values[1] = values[0] * (1.0 + 1e-14);
    if (k % 5 == 4) values[2] *= 1e-12;
    const Tensor3 turn = k % 7 == 0 ? Tensor3::identity() : any_rotation(random);
    Tensor3 t = turn * diagonal(values[0], values[1], values[2]) * transpose(turn);
    t = 0.5 * (t + transpose(t));
    std::sort(values, values + 3, std::greater<>());

    const rve::PrincipalAxes<3> axes(t);

    Tensor3 composed = Tensor3::zero();
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(axes.value[i], values[i], 1e-14) << "of a tensor of order 1";
      composed = composed + axes.value[i] * dyad(axes.axis[i], axes.axis[i]);
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(dot(axes.axis[i], axes.axis[j]), i == j ? 1.0 : 0.0, 1e-14);
    }
    EXPECT_GE(axes.value[0], axes.value[1]);
    EXPECT_GE(axes.value[1], axes.value[2]);
    for (int c = 0; c < 9; ++c) EXPECT_NEAR(composed.component[c], t.component[c], 2e-15);
  }
}

TEST(MohrCoulombInSpace, DrainedTriaxialCompressionFailsAtTheRatioOfPrincipalStressesAndDilates)
{
  const double pressure = 20e3, cohesion = 5e3;
  for (const double friction : {0.0, 23.7, 40.0})
    for (const double dilation : {0.0, 10.0}) {
      if (dilation > friction) continue;
      Triaxial test({YOUNG, POISSON, cohesion, friction, dilation}, pressure);
      const double k = ratio(friction), m = ratio(dilation), step = 1e-4;
      const double strength = k * pressure + 2.0 * cohesion * std::sqrt(k);
      // The first step is elastic, with E along the axis and ν across it, up to errors of O(step).
      test.step(step);
      EXPECT_NEAR(test.element.stress(2, 2), -pressure - YOUNG * step, 1e-3 * YOUNG * step);
      EXPECT_NEAR(test.widening, POISSON * step, 1e-3 * step);
      EXPECT_EQ(test.element.plastic_strain(), 0.0);

      for (int s = 0; s < 300; ++s) test.step(step);

      EXPECT_NEAR(test.element.stress(2, 2), -strength, 1e-9 * strength);
      EXPECT_NEAR(test.element.yield(), 0.0, 1e-9 * strength);
      // Two yield planes flow equally. The ratio of the sum of both lateral strains to the axial
      // shortening is then m, except for the strain of a step, 1e-4.
      EXPECT_NEAR(2.0 * test.widening / step, m, 1e-3 * m);
      // Plastic flow (m/2, m/2, -1) per shortening has a deviator e with sqrt(2/3 e:e) = (m + 2)/3.
      const double elastic = (strength - pressure) / YOUNG;
      EXPECT_NEAR(test.element.plastic_strain(), (m + 2.0) / 3.0 * (301 * step - elastic),
                  1e-3 * 301 * step);
    }
}

TEST(MohrCoulombInSpace, DrainedTriaxialExtensionFailsWithTheAxisAsLeastPressure)
{
  const double pressure = 100e3, cohesion = 5e3, friction = 30.0, dilation = 10.0;
  Triaxial test({YOUNG, POISSON, cohesion, friction, dilation}, pressure);
  const double k = ratio(friction), m = ratio(dilation), step = 1e-4;

  for (int s = 0; s < 300; ++s) test.step(-step);

  const double axial = -(pressure - 2.0 * cohesion * std::sqrt(k)) / k;
  EXPECT_NEAR(test.element.stress(2, 2), axial, 1e-9 * pressure);
  EXPECT_NEAR(2.0 * test.widening / step, -1.0 / m, 1e-3) << "shortening of both = stretch / m";
}

TEST(MohrCoulombInSpace, ConstantMeanStressFailsAtTheStrengthOfItsLodeAngle)
{
  // The path has constant p = -tr σ/3 and a deviatoric strain of Lode angle θ. The dilation is
  // zero, so that flow keeps p. The stress must end on the pyramid (σ1 - σ3)/2 = c cos φ - (σ1 +
  // σ3)/2 sin φ for any middle stress.
  const double pressure = 50e3, cohesion = 4e3, friction = 27.0;
  const double s = sine(friction), c = std::cos(friction * PI / 180.0);
  for (const double angle : {-0.5, -0.3, 0.0, 0.1, 0.4, 0.52}) {
    Element element({YOUNG, POISSON, cohesion, friction, 0.0}, (-pressure) * Tensor3::identity());
    const double step = 1e-5;
    double e[3];
    for (int i = 0; i < 3; ++i) e[i] = step * std::sin(angle + 2.0 * PI / 3.0 * (1 - i));
    for (int n = 0; n < 2000; ++n) element.deform(diagonal(1.0 + e[0], 1.0 + e[1], 1.0 + e[2]));

    const rve::PrincipalAxes<3> axes(element.stress);
    EXPECT_NEAR(trace(element.stress) / 3.0, -pressure, 1e-3 * pressure)
        << "no dilation; the trace of Hughes and Winget's strain is of the order of the step "
           "squared";
    EXPECT_NEAR(0.5 * (axes.value[0] - axes.value[2]),
                cohesion * c - 0.5 * (axes.value[0] + axes.value[2]) * s, 1e-9 * pressure);
    EXPECT_GT(element.plastic_strain(), 0.01);
  }
}

TEST(MohrCoulombInSpace, TrescaInPureShearOfAnyPlaneFlowsAtItsCohesion)
{
  const double cohesion = 10e3, shear_modulus = YOUNG / 2.6;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      if (a == b) continue;
      Element element({YOUNG, POISSON, cohesion, 0.0, 0.0}, Tensor3::zero());
      Tensor3 increment = Tensor3::identity();
      increment(a, b) = 1e-4;
      for (int step = 0; step < 100; ++step) element.deform(increment);
      const rve::PrincipalAxes<3> axes(element.stress);
      EXPECT_NEAR(0.5 * (axes.value[0] - axes.value[2]), cohesion, 1e-9 * cohesion);
      // γ = 0.01 is elastic up to c/G; the stress rotates by at most γ/2.
      EXPECT_NEAR(element.stress(a, b), cohesion, 1e-4 * cohesion);
      EXPECT_NEAR(element.plastic_strain(), (0.01 - cohesion / shear_modulus) / std::sqrt(3.0),
                  0.01 * 0.01);
    }
}

TEST(MohrCoulombInSpace, TensionInAllDirectionsEndsAtTheApex)
{
  const double cohesion = 10e3, friction = 30.0;
  Element element({YOUNG, POISSON, cohesion, friction, 0.0}, Tensor3::zero());
  for (int step = 0; step < 50; ++step) element.deform(diagonal(1.001, 1.0012, 1.0008));

  const double apex = cohesion / std::tan(friction * PI / 180.0);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(element.stress(a, b), a == b ? apex : 0.0, 1e-9 * apex);
}

TEST(MohrCoulombInSpace, PlaneStrainIsTheLawOfThePlane)
{
  // The path is irregular through shear, compression, rotation and tension; σ_zz is a state
  // variable of the plane law.
  const MohrCoulomb<2> plane(YOUNG, POISSON, 2e3, 30.0, 5.0);
  const MohrCoulomb<3> space(YOUNG, POISSON, 2e3, 30.0, 5.0);
  MohrCoulomb<2> law = plane;
  Tensor2 stress = {{-20e3, 1e3, 1e3, -25e3}};
  double memory[2];
  law.begin_memory(stress, memory);
  Tensor3 initial = diagonal(stress(0, 0), stress(1, 1), memory[0]);
  initial(0, 1) = initial(1, 0) = stress(0, 1);
  Element element(space, initial);

  for (int k = 0; k < 1000; ++k) {
    const double e = 2e-4 * std::sin(0.011 * k), g = 5e-4 * std::cos(0.017 * k);
    const Tensor2 increment = {{1.0 + e, g, -0.5 * g + 1e-4, 1.0 - e + 1e-5 * std::sin(0.3 * k)}};
    const int point = 0;
    law.update(1, &point, &increment, 1.0, &stress, {memory, 2});
    element.deform(rve::in_plane_strain<3>(increment));

    // round-off of a thousand steps of stresses of order 1e5
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) ASSERT_NEAR(element.stress(a, b), stress(a, b), 1e-6);
    ASSERT_NEAR(element.stress(2, 2), memory[MohrCoulomb<2>::OutOfPlaneStress], 1e-6);
    ASSERT_NEAR(element.plastic_strain(), memory[MohrCoulomb<2>::PlasticStrain], 1e-12);
  }
  EXPECT_GT(element.plastic_strain(), 0.05) << "it did yield";
}

TEST(MohrCoulombInSpace, RotatedHistoryGivesTheRotatedStress)
{
  std::mt19937 random(5);
  for (int turn = 0; turn < 5; ++turn) {
    const Tensor3 Q = any_rotation(random);
    const Tensor3 initial = diagonal(-20e3, -30e3, -25e3);
    Element straight({YOUNG, POISSON, 1e3, 30.0, 5.0}, initial);
    Element turned({YOUNG, POISSON, 1e3, 30.0, 5.0}, Q * initial * transpose(Q));
    std::uniform_real_distribution<double> uniform(-1e-3, 1e-3);
    for (int step = 0; step < 200; ++step) {
      Tensor3 increment = Tensor3::identity();
      for (double &component : increment.component) component += uniform(random);
      straight.deform(increment);
      turned.deform(Q * increment * transpose(Q));
    }
    const Tensor3 expected = Q * straight.stress * transpose(Q);
    for (int k = 0; k < 9; ++k)
      EXPECT_NEAR(turned.stress.component[k], expected.component[k], 1e-5)
          << "200 steps, each with the round-off of a strain times E";
    EXPECT_GT(straight.plastic_strain(), 0.005);
  }
}

TEST(MohrCoulombInSpace, IsLinearElasticInsideTheYieldSurfaceToTheBit)
{
  Element element({YOUNG, POISSON, 50e3, 30.0, 0.0}, diagonal(-20e3, -21e3, -22e3));
  mpm::LinearElastic<3> elastic(YOUNG, POISSON);
  Tensor3 stress = element.stress;
  for (int step = 0; step < 100; ++step) {
    Tensor3 increment = Tensor3::identity();
    for (int k = 0; k < 9; ++k) increment.component[k] += 2e-5 * std::sin(0.3 * step + k);
    element.deform(increment);
    const int point = 0;
    elastic.update(1, &point, &increment, 1.0, &stress, {});
    for (int k = 0; k < 9; ++k) ASSERT_EQ(element.stress.component[k], stress.component[k]);
  }
  EXPECT_EQ(element.plastic_strain(), 0.0);
}

TEST(MohrCoulombInSpace, StressesStaySymmetricToTheBit)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1e-2, 1e-2);
  Element element({YOUNG, POISSON, 1e3, 35.0, 10.0}, -10e3 * Tensor3::identity());
  for (int step = 0; step < 1000; ++step) {
    Tensor3 increment = Tensor3::identity();
    for (double &component : increment.component) component += uniform(random);
    element.deform(increment);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < a; ++b) ASSERT_EQ(element.stress(a, b), element.stress(b, a));
    ASSERT_LT(element.yield(), 1e-9 * (1e3 + std::abs(trace(element.stress))));
  }
}
