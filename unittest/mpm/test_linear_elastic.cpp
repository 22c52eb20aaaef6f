// SPDX-License-Identifier: GPL-2.0-only
// Linear elasticity with finite rotations, in plane strain and in space.

#include "mpm/linear_elastic.h"
#include "rve/core/error.h"

#include <cmath>
#include <gtest/gtest.h>

using LinearElastic = mpm::LinearElastic<2>;
using rve::Tensor2;
using rve::Tensor3;

namespace {

template <int D>
rve::Tensor<double, D> after(mpm::LinearElastic<D> &law, const rve::Tensor<double, D> &increment,
                             rve::Tensor<double, D> stress)
{
  const int point = 0;
  law.update(1, &point, &increment, 1.0, &stress, {});
  return stress;
}

/// Returns exp of a small tensor by its series.
Tensor3 exponential(const Tensor3 &x)
{
  Tensor3 sum = Tensor3::identity(), term = sum;
  for (int k = 1; k < 40; ++k) {
    term = (1.0 / k) * (term * x);
    sum = sum + term;
  }
  return sum;
}

}    // namespace

TEST(LinearElastic, UniaxialStrainGivesThePWaveModulus)
{
  LinearElastic law(1000.0, 0.3);
  const double strain = 1e-6;

  const Tensor2 stress = after(law, Tensor2{{1.0 + strain, 0.0, 0.0, 1.0}}, Tensor2::zero());

  const double modulus = 1000.0 * 0.7 / (1.3 * 0.4);    // E (1-ν) / ((1+ν)(1-2ν))
  EXPECT_NEAR(law.p_wave_modulus(0), modulus, 1e-12 * modulus);
  EXPECT_NEAR(stress(0, 0), modulus * strain, 1e-6 * modulus * strain) << "O(strain) beyond linear";
  EXPECT_NEAR(stress(1, 1), 0.3 / 0.7 * modulus * strain, 1e-6 * modulus * strain);
}

TEST(LinearElastic, SimpleShearGivesTheShearModulus)
{
  LinearElastic law(1000.0, 0.25);
  const double angle = 1e-6;

  const Tensor2 stress = after(law, Tensor2{{1.0, angle, 0.0, 1.0}}, Tensor2::zero());

  EXPECT_NEAR(stress(0, 1), 400.0 * angle, 1e-5 * 400.0 * angle);
  EXPECT_EQ(stress(0, 1), stress(1, 0));
}

TEST(LinearElastic, RigidRotationOfAnySizeTurnsTheStressExactly)
{
  LinearElastic law(1000.0, 0.3);
  const Tensor2 stress = {{-3.0, 0.5, 0.5, -1.0}};
  for (const double angle : {1e-3, 0.3, 1.5}) {
    const Tensor2 rotation = {
        {std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)}};

    const Tensor2 turned = after(law, rotation, stress);

    const Tensor2 expected = rotation * stress * transpose(rotation);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(turned.component[k], expected.component[k], 1e-12) << "1000 * round-off of D";
  }
}

TEST(LinearElastic, RefusesImpossibleModuli)
{
  EXPECT_THROW(LinearElastic(0.0, 0.3), rve::InputError);
  EXPECT_THROW(LinearElastic(1.0, 0.5), rve::InputError);
}

TEST(LinearElasticInSpace, HasTheModuliOfStrainShearAndCompression)
{
  const double young = 1000.0, poisson = 0.3, strain = 1e-6;
  const double shear_modulus = young / (2.0 * (1.0 + poisson));
  const double p_wave = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
  mpm::LinearElastic<3> law(young, poisson);

  EXPECT_NEAR(law.p_wave_modulus(0), p_wave, 1e-12 * p_wave);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      Tensor3 increment = Tensor3::identity();
      increment(a, b) += strain;
      const Tensor3 stress = after(law, increment, Tensor3::zero());
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double expected = a == b                 ? i != j ? 0.0
                                  : i == a                        ? p_wave
                                                                  : p_wave - 2.0 * shear_modulus
              : (i == a && j == b) || (i == b && j == a) ? shear_modulus
                                                         : 0.0;
          EXPECT_NEAR(stress(i, j), expected * strain, 2e-6 * p_wave * strain)
              << "O(strain) beyond linear";
        }
    }
  // Equal strains ε in all directions give the mean stress 3 K ε with the bulk modulus K =
  // E/(3(1-2ν)).
  const Tensor3 compressed = after(law, (1.0 - strain) * Tensor3::identity(), Tensor3::zero());
  EXPECT_NEAR(trace(compressed) / 3.0, -young / (1.0 - 2.0 * poisson) * strain,
              2e-6 * young * strain);
}

TEST(LinearElasticInSpace, RigidRotationOfAnySizeAboutAnyAxisTurnsTheStressExactly)
{
  mpm::LinearElastic<3> law(1000.0, 0.3);
  const Tensor3 stress = {{-3.0, 0.5, -0.2, 0.5, -1.0, 0.7, -0.2, 0.7, -2.0}};
  const double axes[][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {0.6, -0.48, 0.64}};
  for (const auto &axis : axes)
    for (const double angle : {1e-3, 0.3, 1.5, 3.0}) {
      const Tensor3 rotation = exponential(
          angle *
          Tensor3{{0.0, -axis[2], axis[1], axis[2], 0.0, -axis[0], -axis[1], axis[0], 0.0}});

      const Tensor3 turned = after(law, rotation, stress);

      const Tensor3 expected = rotation * stress * transpose(rotation);
      // The tolerance is 1000 times the round-off of D, which grows like 1/cos(angle/2)².
      for (int k = 0; k < 9; ++k)
        EXPECT_NEAR(turned.component[k], expected.component[k], angle < 2.0 ? 1e-11 : 1e-9);
    }
}

TEST(LinearElasticInSpace, PlaneStrainIsThatOfTheLawInThePlane)
{
  mpm::LinearElastic<2> plane(1000.0, 0.3);
  mpm::LinearElastic<3> space(1000.0, 0.3);
  const Tensor2 increment = {{1.01, 0.02, -0.05, 0.98}};
  const Tensor2 stress = {{-3.0, 0.5, 0.5, -1.0}};
  Tensor3 in_space = Tensor3::zero();
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) in_space(a, b) = stress(a, b);

  const Tensor2 flat = after(plane, increment, stress);
  const Tensor3 full = after(space, rve::in_plane_strain<3>(increment), in_space);

  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) EXPECT_NEAR(full(a, b), flat(a, b), 1e-12);
  // σ_zz = λ tr D with tr D = tr Δσ/(2 (λ + μ)), where Δσ is the increment of the plane stress.
  const double lame = 1000.0 * 0.3 / (1.3 * 0.4), shear_modulus = 1000.0 / 2.6;
  EXPECT_NEAR(full(2, 2), lame * (trace(flat) - trace(stress)) / (2.0 * (lame + shear_modulus)),
              1e-12);
  EXPECT_EQ(full(0, 2), 0.0);
  EXPECT_EQ(full(1, 2), 0.0);
}
