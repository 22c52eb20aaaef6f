// Linear elasticity in plane strain with finite rotations.

#include "mpm/linear_elastic.h"
#include "rve/core/error.h"

#include <cmath>
#include <gtest/gtest.h>

using LinearElastic = mpm::LinearElastic<2>;
using rve::Tensor2;

namespace {

Tensor2 after(LinearElastic &law, const Tensor2 &increment, Tensor2 stress)
{
  const int point = 0;
  law.update(1, &point, &increment, 1.0, &stress, {});
  return stress;
}

}    // namespace

TEST(LinearElastic, UniaxialStrainGivesThePWaveModulus)
{
  LinearElastic law(1000.0, 0.3);
  const double strain = 1e-6;

  const Tensor2 stress = after(law, {{1.0 + strain, 0.0, 0.0, 1.0}}, Tensor2::zero());

  const double modulus = 1000.0 * 0.7 / (1.3 * 0.4);    // E (1-ν) / ((1+ν)(1-2ν))
  EXPECT_NEAR(law.p_wave_modulus(0), modulus, 1e-12 * modulus);
  EXPECT_NEAR(stress(0, 0), modulus * strain, 1e-6 * modulus * strain) << "O(strain) beyond linear";
  EXPECT_NEAR(stress(1, 1), 0.3 / 0.7 * modulus * strain, 1e-6 * modulus * strain);
}

TEST(LinearElastic, SimpleShearGivesTheShearModulus)
{
  LinearElastic law(1000.0, 0.25);
  const double angle = 1e-6;

  const Tensor2 stress = after(law, {{1.0, angle, 0.0, 1.0}}, Tensor2::zero());

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
