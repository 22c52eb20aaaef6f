// SPDX-License-Identifier: GPL-2.0-only
// Mohr-Coulomb and Tresca in plane strain: the return of trial stresses, and element tests.

#include "mpm/mohr_coulomb.h"
#include "support/messages.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

using MohrCoulomb = mpm::MohrCoulomb<2>;
using mpm::MohrCoulombReturn;
using rve::Tensor2;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double YOUNG = 1e7;
constexpr double POISSON = 0.3;

double sine(double degrees)
{
  return std::sin(degrees * PI / 180.0);
}

/// One point and its state variables.
struct Element {
  MohrCoulomb law;
  Tensor2 stress;
  double memory[2];

  Element(const MohrCoulomb &_law, const Tensor2 &initial) : law(_law), stress(initial)
  {
    law.begin_memory(stress, memory);
  }
  double out_of_plane_stress() const { return memory[MohrCoulomb::OutOfPlaneStress]; }
  double plastic_strain() const { return memory[MohrCoulomb::PlasticStrain]; }
  void deform(const Tensor2 &increment)
  {
    const int point = 0;
    law.update(1, &point, &increment, 1.0, &stress, {memory, 2});
  }
};

/// Returns the return mapping for c [stress] and angles [degrees] with E = 1, constructed as in the
/// law.
MohrCoulombReturn return_for(double cohesion, double friction, double dilation)
{
  MohrCoulombReturn mapping;
  mapping.shear_modulus = 1.0 / (2.0 * (1.0 + POISSON));
  mapping.lame_first = 2.0 * mapping.shear_modulus * POISSON / (1.0 - 2.0 * POISSON);
  mapping.friction_ratio = (1.0 + sine(friction)) / (1.0 - sine(friction));
  mapping.dilatancy_ratio = (1.0 + sine(dilation)) / (1.0 - sine(dilation));
  mapping.uniaxial_strength = 2.0 * cohesion * std::sqrt(mapping.friction_ratio);
  return mapping;
}

/// Computes C⁻¹ σ of isotropic elasticity with E = 1 in principal axes.
void strain_of(const double *stress, double *strain)
{
  const double sum = stress[0] + stress[1] + stress[2];
  for (int i = 0; i < 3; ++i) strain[i] = (1.0 + POISSON) * stress[i] - POISSON * sum;
}

MohrCoulombReturn::Principal sorted(double a, double b, double c)
{
  MohrCoulombReturn::Principal p = {{a, b, c}};
  std::sort(p.value, p.value + 3, std::greater<>());
  return p;
}

}    // namespace

TEST(MohrCoulombReturn, AssociatedFlowReturnsToTheNearestAdmissibleStressInTheEnergyNorm)
{
  // σ is the projection of the trial stress σ_t on the convex set of admissible stresses if and
  // only if (σ_t - σ)·C⁻¹(τ - σ) <= 0 for all admissible τ. This tests plane, edges and apex
  // together.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  int plane = 0, edge = 0, apex = 0;
  for (const double friction : {0.0, 23.7, 45.0}) {
    const MohrCoulombReturn mapping = return_for(0.4, friction, friction);
    for (int k = 0; k < 2000; ++k) {
      const auto trial = sorted(uniform(random), uniform(random), uniform(random));
      const auto stress = mapping(trial);

      ASSERT_LT(mapping.yield(stress), 1e-13);
      ASSERT_GE(stress.value[0], stress.value[1]);
      ASSERT_GE(stress.value[1], stress.value[2]);
      if (mapping.yield(trial) > 0.0) {
        const bool left = stress.value[0] == stress.value[1];
        const bool right = stress.value[1] == stress.value[2];
        ++(left && right ? apex : left || right ? edge : plane);
      }
      double relaxed[3], plastic[3];
      for (int i = 0; i < 3; ++i) relaxed[i] = trial.value[i] - stress.value[i];
      strain_of(relaxed, plastic);
      for (int n = 0; n < 50; ++n) {
        const double tau[3] = {uniform(random), uniform(random), uniform(random)};
        if (mapping.yield(sorted(tau[0], tau[1], tau[2])) > 0.0) continue;
        double product = 0.0;
        for (int i = 0; i < 3; ++i) product += plastic[i] * (tau[i] - stress.value[i]);
        ASSERT_LT(product, 1e-12) << "friction angle " << friction;
      }
    }
  }
  EXPECT_GT(plane, 500);
  EXPECT_GT(edge, 500);
  EXPECT_GT(apex, 100);
}

TEST(MohrCoulombReturn, PlasticStrainFollowsThePotential)
{
  // In principal axes, flow on one plane is Δε^p = Δλ (m, 0, -1) with Δλ > 0 and the dilatancy
  // ratio m. On an edge, Δε^p is a combination of the increments of two planes.
  const MohrCoulombReturn mapping = return_for(0.4, 30.0, 10.0);
  const double m = mapping.dilatancy_ratio;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-3.0, 0.0);
  int planes = 0, edges = 0;
  for (int k = 0; k < 2000; ++k) {
    const auto trial = sorted(uniform(random), uniform(random), uniform(random));
    const auto stress = mapping(trial);
    if (mapping.yield(trial) <= 0.0 || stress.value[0] == stress.value[2]) continue;
    double relaxed[3], plastic[3];
    for (int i = 0; i < 3; ++i) relaxed[i] = trial.value[i] - stress.value[i];
    strain_of(relaxed, plastic);
    if (stress.value[0] > stress.value[1] && stress.value[1] > stress.value[2]) {
      ++planes;
      EXPECT_GT(plastic[0], 0.0);
      EXPECT_NEAR(plastic[1], 0.0, 1e-14);
      EXPECT_NEAR(plastic[0], -m * plastic[2], 1e-14);
    } else {
      ++edges;
      // The tensile parts are m times the compressive one, and each part has the right sign.
      const bool compression = stress.value[0] == stress.value[1];
      const double tensile = plastic[0] + (compression ? plastic[1] : 0.0);
      const double compressive = -plastic[2] - (compression ? 0.0 : plastic[1]);
      EXPECT_NEAR(tensile, m * compressive, 1e-14);
      EXPECT_GT((compression ? 1.0 : -1.0) * plastic[1], -1e-14);
    }
  }
  EXPECT_GT(planes, 100);
  EXPECT_GT(edges, 30);
}

TEST(MohrCoulomb, PlaneStrainCompressionYieldsAtTheRatioOfPrincipalStresses)
{
  // The element widens to keep the lateral stress at -p: σ_yy = -(k p + s).
  const double pressure = 20e3, cohesion = 5e3, friction = 23.7;
  const double k = (1.0 + sine(friction)) / (1.0 - sine(friction));
  for (const double dilation : {0.0, 10.0, 23.7}) {
    Element element({YOUNG, POISSON, cohesion, friction, dilation},
                    {{-pressure, 0.0, 0.0, -pressure}});
    double widening = 0.0;    // strain of the last step
    for (int step = 0; step < 400; ++step) {
      const double axial = 1e-4;
      Element before = element;
      for (int iteration = 0; iteration < 60; ++iteration) {    // secant on σ_xx = -p
        element = before;
        element.deform({{1.0 + widening, 0.0, 0.0, 1.0 - axial}});
        const double wrong = element.stress(0, 0) + pressure;
        if (std::abs(wrong) < 1e-8 * pressure) break;
        widening -= wrong / element.law.p_wave_modulus(0);
      }
    }
    const double strength = 2.0 * cohesion * std::sqrt(k);
    EXPECT_NEAR(element.stress(1, 1), -(k * pressure + strength), 1e-6 * k * pressure);
    // At failure the plane of zz does not flow: widening / shortening = m.
    const double m = (1.0 + sine(dilation)) / (1.0 - sine(dilation));
    EXPECT_NEAR(widening / 1e-4, m, 1e-3 * m) << "strains per step of 1e-4";
    EXPECT_GT(element.out_of_plane_stress(), element.stress(1, 1));
    EXPECT_LT(element.out_of_plane_stress(), element.stress(0, 0));
  }
}

TEST(MohrCoulomb, TrescaShearsAtItsCohesion)
{
  const double cohesion = 10e3;
  Element element({YOUNG, POISSON, cohesion, 0.0, 0.0}, {{-5e3, 0.0, 0.0, -5e3}});
  for (int step = 0; step < 100; ++step) element.deform({{1.0, 1e-3, 0.0, 1.0}});

  EXPECT_NEAR(std::hypot(element.stress(0, 1), 0.5 * (element.stress(0, 0) - element.stress(1, 1))),
              cohesion, 1e-9 * cohesion);
  EXPECT_NEAR(0.5 * (element.stress(0, 0) + element.stress(1, 1)), -5e3, 1e-3 * cohesion)
      << "no dilation; D of Hughes-Winget has a trace of the order of the step squared";
  // Strain is elastic up to γ = c/G. Then dε^p = dγ/2 (e_x e_y + e_y e_x), so that the plastic
  // strain grows by sqrt(2/3 dε^p:dε^p) = dγ/sqrt(3).
  const double shear_modulus = YOUNG / 2.6;
  EXPECT_NEAR(element.plastic_strain(), (0.1 - cohesion / shear_modulus) / std::sqrt(3.0),
              0.01 * 0.1 / std::sqrt(3.0));
}

TEST(MohrCoulomb, UniaxialTensionEndsAtTheUniaxialStrengthAndIsotropicTensionAtTheApex)
{
  const double cohesion = 10e3, friction = 30.0;
  Element isotropic({YOUNG, POISSON, cohesion, friction, 0.0}, Tensor2::zero());
  for (int step = 0; step < 50; ++step) isotropic.deform({{1.001, 0.0, 0.0, 1.001}});
  const double apex = cohesion / std::tan(friction * PI / 180.0);
  EXPECT_NEAR(isotropic.stress(0, 0), apex, 1e-9 * apex);
  EXPECT_NEAR(isotropic.stress(1, 1), apex, 1e-9 * apex);
  EXPECT_NEAR(isotropic.out_of_plane_stress(), apex, 1e-9 * apex);

  // In uniaxial tension σ_min = σ_yy = 0. The yield condition k σ_xx - σ_min = 2 c sqrt(k) then
  // gives σ_xx = 2 c/sqrt(k).
  const MohrCoulombReturn mapping = return_for(cohesion, friction, 0.0);
  const auto at_yield = mapping(sorted(2.0 * cohesion / std::sqrt(3.0), 0.0, 0.0));
  EXPECT_NEAR(at_yield.value[0], 2.0 * cohesion / std::sqrt(3.0), 1e-9 * cohesion);
  const auto above = mapping(sorted(1.01 * 2.0 * cohesion / std::sqrt(3.0), 0.0, 0.0));
  EXPECT_LT(above.value[0], 1.01 * 2.0 * cohesion / std::sqrt(3.0));
  EXPECT_NEAR(mapping.yield(above), 0.0, 1e-9 * cohesion);

  // Without cohesion a point under tension has no stress.
  Element dry({YOUNG, POISSON, 0.0, friction, 0.0}, {{-1e3, 0.0, 0.0, -1e3}});
  dry.deform({{1.01, 0.0, 0.0, 1.01}});
  EXPECT_EQ(dry.stress(0, 0), 0.0);
  EXPECT_EQ(dry.out_of_plane_stress(), 0.0);
}

TEST(MohrCoulomb, ElasticCycleCreatesNoEnergyAndPlasticCyclesDissipate)
{
  // The path is a closed square in (ε_xx, ε_xy). Over a small elastic cycle, the work must vanish
  // except for round-off, relative to the largest work along the cycle.
  const auto cycle = [](Element &element, double size, double &largest) {
    double work = 0.0;
    largest = 0.0;
    const int steps = 200;
    for (int side = 0; side < 4; ++side)
      for (int step = 0; step < steps; ++step) {
        const double sign = side < 2 ? 1.0 : -1.0;
        const double d = sign * size / steps;
        const Tensor2 strain = side % 2 == 0 ? Tensor2{{d, 0.0, 0.0, 0.0}}
                                             : Tensor2{{0.0, d, d, 0.0}};
        const Tensor2 before = element.stress;
        element.deform(Tensor2::identity() + strain);
        double power = 0.0;
        for (int i = 0; i < 4; ++i)
          power += 0.5 * (before.component[i] + element.stress.component[i]) * strain.component[i];
        work += power;
        largest = std::max(largest, std::abs(work));
      }
    return work;
  };
  const MohrCoulomb law(YOUNG, POISSON, 10e3, 30.0, 0.0);
  Element elastic(law, {{-20e3, 0.0, 0.0, -20e3}});
  Element plastic = elastic;
  double largest;

  const double elastic_work = cycle(elastic, 1e-4, largest);
  EXPECT_EQ(elastic.plastic_strain(), 0.0);
  EXPECT_LT(std::abs(elastic_work), 1e-3 * largest) << "rate form: of the order of the strain";
  EXPECT_NEAR(elastic.stress(0, 0), -20e3, 1e-3 * 20e3);

  for (int k = 0; k < 5; ++k) {
    const double work = cycle(plastic, 1e-2, largest);
    EXPECT_GT(work, 0.5 * largest);
  }
}

TEST(MohrCoulomb, RotatedHistoryGivesTheRotatedStress)
{
  const double angle = 0.7;
  const Tensor2 turn = {{std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)}};
  const Tensor2 initial = {{-20e3, 3e3, 3e3, -30e3}};
  const MohrCoulomb law(YOUNG, POISSON, 1e3, 30.0, 5.0);
  Element upright(law, initial);
  Element turned(law, turn * initial * transpose(turn));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2e-3, 2e-3);
  for (int step = 0; step < 200; ++step) {
    const Tensor2 increment = Tensor2::identity() +
        Tensor2{{uniform(random), uniform(random), uniform(random), uniform(random)}};
    upright.deform(increment);
    turned.deform(turn * increment * transpose(turn));
  }

  EXPECT_GT(upright.plastic_strain(), 0.01);
  const Tensor2 expected = turn * upright.stress * transpose(turn);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(turned.stress.component[k], expected.component[k], 1e-9 * 30e3) << "round-off";
  EXPECT_NEAR(turned.out_of_plane_stress(), upright.out_of_plane_stress(), 1e-9 * 30e3);
  EXPECT_NEAR(turned.plastic_strain(), upright.plastic_strain(), 1e-12);

  // A rigid rotation of a stress on the yield surface causes no plastic flow.
  Element spinning = upright;
  const double before = spinning.plastic_strain();
  for (int step = 0; step < 100; ++step)
    spinning.deform(
        {{std::cos(0.1), -std::sin(0.1), std::sin(0.1), std::cos(0.1)}});    // 10 rad in total
  EXPECT_NEAR(spinning.plastic_strain(), before, 1e-13);
  EXPECT_NEAR(spinning.law.yield(spinning.stress, spinning.memory),
              upright.law.yield(upright.stress, upright.memory), 1e-9 * 30e3);
}

TEST(MohrCoulomb, IsLinearElasticInsideTheYieldSurface)
{
  Element element({YOUNG, POISSON, 1e9, 30.0, 0.0}, Tensor2::zero());
  const double strain = 1e-5;
  element.deform({{1.0 + strain, 0.0, 0.0, 1.0}});
  const double modulus = YOUNG * 0.7 / (1.3 * 0.4);    // E (1-ν) / ((1+ν)(1-2ν))
  EXPECT_NEAR(element.law.p_wave_modulus(0), modulus, 1e-12 * modulus);
  EXPECT_NEAR(element.stress(0, 0), modulus * strain, 1e-4 * modulus * strain) << "O(strain)";
  EXPECT_NEAR(element.out_of_plane_stress(), 0.3 / 0.7 * modulus * strain, 1e-4 * modulus * strain);
}

TEST(MohrCoulomb, RefusesImpossibleParameters)
{
  const auto message = [](double young, double poisson, double c, double phi, double psi) {
    return rve_test::message_of([&] { MohrCoulomb(young, poisson, c, phi, psi); });
  };
  EXPECT_EQ(message(0.0, 0.3, 1.0, 30.0, 0.0), "Young's modulus must be positive, got 0 [stress]");
  EXPECT_EQ(message(1.0, -0.1, 1.0, 30.0, 0.0), "Poisson's ratio must be in [0, 0.5), got -0.1");
  EXPECT_EQ(message(1.0, 0.3, -1.0, 30.0, 0.0), "cohesion must be at least 0, got -1 [stress]");
  EXPECT_EQ(message(1.0, 0.3, 1.0, 90.0, 0.0),
            "friction angle must be in [0, 90), got 90 [degrees]");
  EXPECT_EQ(
      message(1.0, 0.3, 1.0, 20.0, 21.0),
      "dilation angle must be in [0, friction angle], got 21 with friction angle 20 [degrees]");
  EXPECT_EQ(message(1.0, 0.3, 0.0, 0.0, 0.0),
            "cohesion and friction angle must not both be 0: the material would have no strength");
}
