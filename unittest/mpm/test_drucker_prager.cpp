// SPDX-License-Identifier: GPL-2.0-only
// Drucker-Prager and von Mises in space and in plane strain: the return of trial stresses to the
// cone, and strain paths against closed forms.

#include "mpm/drucker_prager.h"

#include "element.h"
#include "mpm/linear_elastic.h"
#include "mpm/mohr_coulomb.h"
#include "support/messages.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

using mpm::DruckerPrager;
using mpm_test::any_rotation;
using mpm_test::diagonal;
using rve::Tensor2;
using rve::Tensor3;
using Element = mpm_test::Element<DruckerPrager<3>>;
using Triaxial = mpm_test::Triaxial<DruckerPrager<3>>;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double YOUNG = 1e7, POISSON = 0.3, SHEAR = YOUNG / (2.0 * (1.0 + POISSON));

double sine(double degrees)
{
  return std::sin(degrees * PI / 180.0);
}

/// Returns the slope α of the cone for an angle [degrees].
double slope(double degrees)
{
  return 2.0 * sine(degrees) / (std::sqrt(3.0) * (3.0 - sine(degrees)));
}

double root_of_second_invariant(const Tensor3 &stress)
{
  const Tensor3 deviator = stress - (trace(stress) / 3.0) * Tensor3::identity();
  double squares = 0.0;
  for (const double s : deviator.component) squares += s * s;
  return std::sqrt(0.5 * squares);
}

}    // namespace

TEST(DruckerPrager, DrainedTriaxialCompressionHasTheStrengthOfMohrCoulomb)
{
  const double pressure = 20e3, cohesion = 5e3;
  for (const double friction : {0.0, 23.7, 40.0})
    for (const double dilation : {0.0, 10.0}) {
      if (dilation > friction) continue;
      Triaxial test({YOUNG, POISSON, cohesion, friction, dilation}, pressure);
      const double k = (1.0 + sine(friction)) / (1.0 - sine(friction)), step = 1e-4;

      for (int s = 0; s < 300; ++s) test.step(step);

      const double strength = k * pressure + 2.0 * cohesion * std::sqrt(k);
      EXPECT_NEAR(test.element.stress(2, 2), -strength, 1e-9 * strength);
      // The plastic potential g has the gradient ∂g/∂σ = s/(2 sqrt(J2)) + β 1, with the deviator s,
      // its invariant J2 and the slope β of the dilation angle. Here s/(2 sqrt(J2)) = (1, 1, -2)/(2
      // sqrt(3)).
      const double unit = 1.0 / (2.0 * std::sqrt(3.0)), b = slope(dilation);
      EXPECT_NEAR(test.widening / step, (unit + b) / (2.0 * unit - b), 1e-3);
    }
}

TEST(DruckerPrager, DrainedTriaxialExtensionIsStrongerThanMohrCoulomb)
{
  // With the axial pressure σ and the lateral pressure p, sqrt(J2) = (p - σ)/sqrt(3) and I1 = -2 p
  // - σ. This stress is on the other meridian of the cone, which has the same slope.
  const double pressure = 100e3, friction = 30.0, a = slope(friction), step = 1e-4;
  Triaxial test({YOUNG, POISSON, 0.0, friction, 0.0}, pressure);

  for (int s = 0; s < 400; ++s) test.step(-step);

  const double unit = 1.0 / std::sqrt(3.0);
  const double axial = pressure * (unit - 2.0 * a) / (unit + a);
  EXPECT_NEAR(test.element.stress(2, 2), -axial, 1e-9 * pressure);
  EXPECT_LT(axial, pressure * (1.0 - sine(friction)) / (1.0 + sine(friction)));
}

TEST(DruckerPrager, TrialStressReturnsToTheConeOrTheApex)
{
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1e-2, 1e-2);
  const double cohesion = 3e3, friction = 27.0;
  Element element({YOUNG, POISSON, cohesion, friction, 10.0}, Tensor3::zero());
  int apex = 0, cone = 0;
  for (int n = 0; n < 2000; ++n) {
    Tensor3 increment = Tensor3::identity();
    for (double &component : increment.component) component += uniform(random);
    mpm::LinearElastic<3> elastic(YOUNG, POISSON);
    element.stress = (-20e3 * (n % 4)) * Tensor3::identity();
    Tensor3 trial = element.stress;
    const int point = 0;
    elastic.update(1, &point, &increment, 1.0, &trial, {});

    element.deform(increment);

    const double root = root_of_second_invariant(element.stress);
    const double size = std::abs(trace(trial)) + cohesion;
    ASSERT_LT(element.yield(), 1e-12 * size);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < a; ++b) ASSERT_EQ(element.stress(a, b), element.stress(b, a));
    if (root < 1e-9 * size) {
      ++apex;
      ASSERT_NEAR(trace(element.stress) / 3.0, cohesion / std::tan(friction * PI / 180.0),
                  1e-9 * size);
    } else {
      ++cone;
      const double share = root / root_of_second_invariant(trial);
      const double mean = trace(trial) / 3.0, after = trace(element.stress) / 3.0;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          ASSERT_NEAR(element.stress(a, b) - (a == b ? after : 0.0),
                      share * (trial(a, b) - (a == b ? mean : 0.0)), 1e-12 * size);
    }
  }
  EXPECT_GT(apex, 100);
  EXPECT_GT(cone, 100);
}

TEST(DruckerPrager, AssociatedFlowReturnsToTheNearestAdmissibleStressInTheEnergyNorm)
{
  // The cone is convex. The stress σ is the admissible stress nearest to the trial stress σ_t if
  // and only if (σ_t - σ):C⁻¹(τ - σ) <= 0 for all admissible τ.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const double cohesion = 0.4e5, friction = 25.0, size = 3e5;
  const DruckerPrager<3> law(YOUNG, POISSON, cohesion, friction, friction);
  const auto any_stress = [&] {
    Tensor3 s;
    for (double &component : s.component) component = size * uniform(random);
    return 0.5 * (s + transpose(s));
  };
  for (int n = 0; n < 300; ++n) {
    Element element(law, any_stress());
    const Tensor3 trial = element.stress;
    element.deform(Tensor3::identity());    // an increment of zero returns the stress
    const Tensor3 relaxed = trial - element.stress;
    const Tensor3 plastic = (1.0 / (2.0 * SHEAR)) *
        (relaxed - (POISSON / (1.0 + POISSON) * trace(relaxed)) * Tensor3::identity());
    for (int k = 0; k < 50; ++k) {
      const Tensor3 tau = any_stress();
      if (law.yield(tau, nullptr) > 0.0) continue;
      double product = 0.0;
      for (int c = 0; c < 9; ++c)
        product += plastic.component[c] * (tau - element.stress).component[c];
      ASSERT_LT(product, 1e-12 * size * size / YOUNG);
    }
  }
}

TEST(DruckerPrager, WithoutFrictionIsVonMisesWithTheTriaxialStrength)
{
  // The triaxial strength is σ1 - σ3 = 2 c, which means sqrt(J2) = 2 c/sqrt(3) at yield. In simple
  // shear, sqrt(J2) is the shear stress.
  const double cohesion = 10e3, strength = 2.0 * cohesion / std::sqrt(3.0);
  Element element({YOUNG, POISSON, cohesion, 0.0, 0.0}, Tensor3::zero());
  Tensor3 increment = Tensor3::identity();
  increment(0, 2) = 1e-4;
  for (int step = 0; step < 100; ++step) element.deform(increment);

  EXPECT_NEAR(root_of_second_invariant(element.stress), strength, 1e-9 * strength);
  EXPECT_NEAR(element.stress(0, 2), strength, 1e-4 * strength) << "it turns with the spin";
  EXPECT_NEAR(trace(element.stress), 0.0, 1e-2 * strength);
  EXPECT_NEAR(element.plastic_strain(), (0.01 - strength / SHEAR) / std::sqrt(3.0), 1e-4);
}

TEST(DruckerPrager, PlaneStrainIsTheLawOfSpace)
{
  DruckerPrager<2> law(YOUNG, POISSON, 2e3, 30.0, 5.0);
  Tensor2 stress = {{-20e3, 1e3, 1e3, -25e3}};
  double memory[2];
  law.begin_memory(stress, memory);
  Tensor3 initial = diagonal(stress(0, 0), stress(1, 1), memory[0]);
  initial(0, 1) = initial(1, 0) = stress(0, 1);
  Element element({YOUNG, POISSON, 2e3, 30.0, 5.0}, initial);

  for (int k = 0; k < 1000; ++k) {
    const double e = 2e-4 * std::sin(0.011 * k), g = 5e-4 * std::cos(0.017 * k);
    const Tensor2 increment = {{1.0 + e, g, -0.5 * g + 1e-4, 1.0 - e + 1e-5 * std::sin(0.3 * k)}};
    const int point = 0;
    law.update(1, &point, &increment, 1.0, &stress, {memory, 2});
    element.deform(rve::in_plane_strain<3>(increment));

    // round-off of a thousand steps of stresses of order 1e5
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) ASSERT_NEAR(element.stress(a, b), stress(a, b), 1e-6);
    ASSERT_NEAR(element.stress(2, 2), memory[DruckerPrager<2>::OutOfPlaneStress], 1e-6);
    ASSERT_NEAR(element.plastic_strain(), memory[DruckerPrager<2>::PlasticStrain], 1e-12);
    ASSERT_NEAR(law.yield(stress, memory), element.yield(), 1e-6);
  }
  EXPECT_GT(element.plastic_strain(), 0.05) << "it did yield";
}

TEST(DruckerPrager, PlaneStrainMatchFailsAsMohrCoulomb)
{
  // With associated flow, the cone fails in plane strain as Mohr-Coulomb with φ' and c' if its
  // slope is α = tan φ'/sqrt(9 + 12 tan² φ') and its strength k = 3 c'/sqrt(9 + 12 tan² φ')
  // (Drucker & Prager 1952; theory_mpm.rst).
  const double friction = 30.0, cohesion = 5e3, pressure = 20e3;
  const double tangent = std::tan(friction * PI / 180.0),
               root = std::sqrt(9.0 + 12.0 * tangent * tangent);
  const double a = tangent / root, k = 3.0 * cohesion / root;
  const double sine_of_cone = 3.0 * std::sqrt(3.0) * a / (2.0 + std::sqrt(3.0) * a);
  const double cosine_of_cone = std::sqrt(1.0 - sine_of_cone * sine_of_cone);
  const double cohesion_of_cone =
      k * std::sqrt(3.0) * (3.0 - sine_of_cone) / (6.0 * cosine_of_cone);
  const double degrees = std::asin(sine_of_cone) * 180.0 / PI;
  DruckerPrager<2> law(YOUNG, POISSON, cohesion_of_cone, degrees, degrees);
  Tensor2 stress = {{-pressure, 0.0, 0.0, -pressure}};
  double memory[2];
  law.begin_memory(stress, memory);

  for (int step = 0; step < 400; ++step) {
    const Tensor2 stress_before = stress;
    const double memory_before[] = {memory[0], memory[1]};
    double low = 0.0, high = 1e-2;
    for (int iteration = 0; iteration < 60; ++iteration) {    // bisection on σ_xx = -p
      const double widening = 0.5 * (low + high);
      stress = stress_before;
      std::copy_n(memory_before, 2, memory);
      const Tensor2 increment = {{1.0 + widening, 0.0, 0.0, 1.0 - 1e-4}};
      const int point = 0;
      law.update(1, &point, &increment, 1.0, &stress, {memory, 2});
      (stress(0, 0) < -pressure ? low : high) = widening;
    }
  }

  const double ratio = (1.0 + sine(friction)) / (1.0 - sine(friction));
  EXPECT_NEAR(stress(1, 1), -(ratio * pressure + 2.0 * cohesion * std::sqrt(ratio)),
              1e-3 * ratio * pressure)
      << "strains of 4 %: D_zz is 0, the plastic one goes there with the elastic one's rest";
}

TEST(DruckerPrager, RotatedHistoryGivesTheRotatedStress)
{
  std::mt19937 random(5);
  const Tensor3 Q = any_rotation(random), initial = diagonal(-20e3, -30e3, -25e3);
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

TEST(DruckerPrager, RefusesImpossibleParameters)
{
  const auto message = [](double young, double poisson, double c, double phi, double psi) {
    return rve_test::message_of([&] { DruckerPrager<3>(young, poisson, c, phi, psi); });
  };
  EXPECT_NE(message(0.0, 0.3, 1.0, 30.0, 0.0).find("Young's modulus"), std::string::npos);
  EXPECT_NE(message(1.0, 0.5, 1.0, 30.0, 0.0).find("Poisson's ratio"), std::string::npos);
  EXPECT_NE(message(1.0, 0.3, -1.0, 30.0, 0.0).find("cohesion"), std::string::npos);
  EXPECT_NE(message(1.0, 0.3, 1.0, 90.0, 0.0).find("friction angle"), std::string::npos);
  EXPECT_NE(message(1.0, 0.3, 1.0, 30.0, 31.0).find("dilation angle"), std::string::npos);
  EXPECT_NE(message(1.0, 0.3, 0.0, 0.0, 0.0).find("no strength"), std::string::npos);
}
