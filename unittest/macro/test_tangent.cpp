// SPDX-License-Identifier: GPL-2.0-only
// Properties of a material that follow from its tangent, against closed forms for isotropic,
// plastic and stressed solids.

#include "oracle/tangent_algebra.h"

#include "rve/core/pi.h"
#include "rve/engine/finite_strain.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace macro;
using rve::Tensor;
using rve_test::dyad, rve_test::Random, rve_test::second_order_work, rve_test::turned;

namespace {

constexpr double LAMBDA = 3e7, MU = 2e7;
// Rounding error of a few hundred operations on numbers of order 1.
constexpr double ROUNDING = 1e-13;

template <int D> Tensor<double, D> diagonal(std::initializer_list<double> values)
{
  auto t = Tensor<double, D>::zero();
  int a = 0;
  for (const double x : values) {
    t(a, a) = x;
    ++a;
  }
  return t;
}

template <int D> double contraction(const Tensor<double, D> &x, const Tensor<double, D> &y)
{
  double sum = 0.0;
  for (int k = 0; k < D * D; ++k) sum += x.component[k] * y.component[k];
  return sum;
}

/// Returns the plastic tangent C - (C : P)(F : C)/(h + F : C : P) with the elastic tangent C and
/// the hardening modulus h. Plastic strain is along P and occurs if F : sigma increases.
template <int D>
TangentOf<D> plastic_tangent(const TangentOf<D> &elastic, const Tensor<double, D> &p,
                             const Tensor<double, D> &f, double hardening)
{
  const double factor = -1.0 / (hardening + contraction(f, elastic(p)));
  return elastic + factor * dyad(elastic(p), elastic(f));
}

/// Returns the tangent of a von Mises solid in the plane, strained at constant area along x and y.
TangentOf<2> von_mises(double hardening)
{
  const auto direction = diagonal<2>({std::sqrt(0.5), -std::sqrt(0.5)});
  return plastic_tangent(TangentOf<2>::isotropic(LAMBDA, MU), direction, direction, hardening);
}

template <int D> TangentOf<D> random_tangent(Random &random)
{
  TangentOf<D> tangent = TangentOf<D>::isotropic(0.5, 1.0);
  for (auto &row : tangent.component)
    for (double &c : row) c += random.uniform(-0.7, 0.7);
  return tangent;
}

template <int D> Tensor<double, D> random_stress(Random &random)
{
  Tensor<double, D> stress;
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) stress(a, b) = stress(b, a) = random.uniform(-0.2, 0.2);
  return stress;
}

template <int D> double largest_difference(const TangentOf<D> &x, const TangentOf<D> &y)
{
  double largest = 0.0;
  for (int r = 0; r < TangentOf<D>::size; ++r)
    for (int c = 0; c < TangentOf<D>::size; ++c)
      largest = std::fmax(largest, std::fabs(x.component[r][c] - y.component[r][c]));
  return largest;
}

rve::Vec<double, 2> at_angle(double angle)
{
  return {{std::cos(angle), std::sin(angle)}};
}

rve::Vec<double, 3> at_angles(double from_z, double around)
{
  return {
      {std::sin(from_z) * std::cos(around), std::sin(from_z) * std::sin(around), std::cos(from_z)}};
}

template <int D> NominalTangentOf<D> unstressed(const TangentOf<D> &tangent)
{
  return {tangent, Tensor<double, D>::zero()};
}

template <int D> void expect_isotropic_solid()
{
  const auto tangent = TangentOf<D>::isotropic(LAMBDA, MU);

  const IsotropicPart part = tangent.isotropic_part();
  EXPECT_NEAR(part.lambda, LAMBDA, ROUNDING * LAMBDA);
  EXPECT_NEAR(part.shear, MU, ROUNDING * MU);
  EXPECT_NEAR(part.anisotropy, 0.0, ROUNDING);
  EXPECT_NEAR(part.young(), 2.0 * MU * (1.0 + part.poisson()), ROUNDING * MU);
  EXPECT_NEAR(part.poisson(), 0.3, ROUNDING);
  EXPECT_NEAR(tangent.least_second_order_work(), 2.0 * MU, ROUNDING * MU);
  EXPECT_NEAR(second_order_work(tangent, Tensor<double, D>::identity()), D * LAMBDA + 2.0 * MU,
              ROUNDING * LAMBDA);
  // A pressure does not change the least determinant: in a shear band, the effect of the change of
  // volume and the effect of the rotation of forces cancel.
  const double expected = (LAMBDA + 2.0 * MU) * std::pow(MU, D - 1);
  for (const double pressure : {0.0, 0.1 * MU}) {
    const auto least = NominalTangentOf<D>(tangent, -pressure * Tensor<double, D>::identity())
                           .least_acoustic_determinant();
    EXPECT_NEAR(least.determinant, expected, ROUNDING * expected);
  }
}

template <int D> void expect_turned_tangent(const Tensor<double, D> &rotation)
{
  Random random(4);
  const TangentOf<D> tangent = random_tangent<D>(random);
  const Tensor<double, D> stress = random_stress<D>(random), strain = random_stress<D>(random),
                          back = rve::transpose(rotation);

  const TangentOf<D> result = turned(tangent, rotation);

  const Tensor<double, D> expected = rotation * tangent(strain) * back,
                          answer = result(rotation * strain * back);
  for (int k = 0; k < D * D; ++k) EXPECT_NEAR(answer.component[k], expected.component[k], ROUNDING);
  EXPECT_LT(largest_difference(turned(result, back), tangent), ROUNDING);
  EXPECT_NEAR(result.norm(), tangent.norm(), 10.0 * ROUNDING);
  EXPECT_NEAR(result.least_second_order_work(), tangent.least_second_order_work(), 10.0 * ROUNDING);
  EXPECT_NEAR(result.isotropic_part().anisotropy, tangent.isotropic_part().anisotropy,
              10.0 * ROUNDING);
  const auto before = NominalTangentOf<D>(tangent, stress).least_acoustic_determinant();
  const auto after =
      NominalTangentOf<D>(result, rotation * stress * back).least_acoustic_determinant();
  EXPECT_NEAR(after.determinant, before.determinant, 10.0 * ROUNDING);
  // The error of the direction is the square root of the error of the least determinant.
  EXPECT_NEAR(std::fabs(rve::dot(after.normal, rotation * before.normal)), 1.0, 1e-12);
}

}    // namespace

TEST(Tangent, OfAnIsotropicSolidHasItsModuliAndWaves)
{
  expect_isotropic_solid<2>();
  expect_isotropic_solid<3>();
}

namespace {

template <int D> void expect_numbers_of(const TangentOf<D> &tangent)
{
  const TangentNumbersOf<D> numbers(tangent, rve::Tensor<double, D>::zero());
  for (const double number :
       {numbers.isotropic.young(), numbers.isotropic.poisson(), numbers.isotropic.shear,
        numbers.isotropic.lambda, numbers.isotropic.anisotropy, numbers.least_work,
        numbers.acoustic.determinant, numbers.acoustic.normal[0], tangent.wave_modulus()})
    EXPECT_TRUE(std::isfinite(number)) << D;
}

template <int D> void expect_zeros_without_stiffness()
{
  const TangentOf<D> none{};
  expect_numbers_of(none);
  EXPECT_EQ(none.isotropic_part().young(), 0.0);
  EXPECT_EQ(none.isotropic_part().poisson(), 0.0);
  EXPECT_EQ(none.isotropic_part().anisotropy, 0.0);
  // a solid without Young's modulus
  expect_numbers_of(TangentOf<D>::isotropic(-1.0, 1.0));
  // stiff along one axis only
  TangentOf<D> one{};
  one.component[0][0] = 1.0;
  expect_numbers_of(one);
}

}    // namespace

TEST(Tangent, PropertiesWithoutStiffnessAreZero)
{
  expect_zeros_without_stiffness<2>();
  expect_zeros_without_stiffness<3>();
}

TEST(Tangent, ItsFastestWavesAreThoseOfIsotropicSolidsAndCubicCrystals)
{
  EXPECT_NEAR(TangentOf<2>::isotropic(LAMBDA, MU).wave_modulus(), LAMBDA + 2.0 * MU,
              ROUNDING * LAMBDA);
  EXPECT_NEAR(TangentOf<3>::isotropic(LAMBDA, MU).wave_modulus(), LAMBDA + 2.0 * MU,
              ROUNDING * LAMBDA);
  // C11 = 3 and C12 = 1. For C44 below (C11 - C12)/2 the fastest waves are along an axis, with C11.
  // Above it they are along the diagonal of the cube, with (C11 + 2 C12 + 4 C44)/3.
  auto cubic = TangentOf<3>::isotropic(1.0, 1.0);
  for (int k = 3; k < 6; ++k) cubic.component[k][k] = 0.5;
  EXPECT_NEAR(cubic.wave_modulus(), 3.0, ROUNDING);
  for (int k = 3; k < 6; ++k) cubic.component[k][k] = 2.0;
  EXPECT_NEAR(cubic.wave_modulus(), 13.0 / 3.0, ROUNDING);
}

TEST(Tangent, OfACubicCrystalHasItsIsotropicPartAndLeastEigenvalue)
{
  // C11 = 3, C12 = 1, C44 = 0.5. The eigenvalues are C11 + 2 C12, C11 - C12 and 2 C44. Voigt's
  // means are lambda = (C11 + 4 C12 - 2 C44)/5 and mu = (C11 - C12 + 3 C44)/5.
  auto cubic = TangentOf<3>::isotropic(1.0, 1.0);
  for (int k = 3; k < 6; ++k) cubic.component[k][k] = 0.5;
  const IsotropicPart part = cubic.isotropic_part();
  EXPECT_NEAR(part.lambda, 1.2, ROUNDING);
  EXPECT_NEAR(part.shear, 0.7, ROUNDING);
  EXPECT_NEAR(cubic.least_second_order_work(), 1.0, ROUNDING);
  // waves along an axis: C11 C44^2
  const auto least = unstressed(cubic).least_acoustic_determinant();
  EXPECT_NEAR(least.determinant, 0.75, ROUNDING);
  EXPECT_NEAR(std::max({std::fabs(least.normal[0]), std::fabs(least.normal[1]),
                        std::fabs(least.normal[2])}),
              1.0, 1e-12);
}

TEST(Tangent, StressRotatesWithARigidRotation)
{
  Random random(1);
  const TangentOf<3> tangent = random_tangent<3>(random);
  const Tensor<double, 3> stress = random_stress<3>(random);
  const Tensor<double, 3> spin{{0.0, -0.3, 0.5, 0.3, 0.0, -0.2, -0.5, 0.2, 0.0}};
  const NominalTangentOf<3> nominal(tangent, stress);
  // The nominal stress refers to areas before the rotation, so its rate is W sigma.
  const Tensor<double, 3> expected = spin * stress;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double rate = 0.0;
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) rate += nominal.component[i][j][k][l] * spin(k, l);
      EXPECT_NEAR(rate, expected(i, j), ROUNDING);
    }
}

TEST(Tangent, ShearWavesInAStressedSolidAreThoseOfBiot)
{
  // Shear waves along the axes of the stress have the moduli mu +- (sigma_1 - sigma_2)/2 (Biot
  // 1940, J. Appl. Phys. 11, 522).
  const double s1 = 0.1 * MU, s2 = -0.3 * MU;
  const NominalTangentOf<2> nominal(TangentOf<2>::isotropic(LAMBDA, MU), diagonal<2>({s1, s2}));
  const double along = LAMBDA + 2.0 * MU, half = 0.5 * (s1 - s2);
  EXPECT_NEAR(nominal.acoustic_determinant(at_angle(0.0)), along * (MU + half),
              ROUNDING * along * MU);
  EXPECT_NEAR(nominal.acoustic_determinant(at_angle(0.5 * rve::kPi)), along * (MU - half),
              ROUNDING * along * MU);
}

TEST(Tangent, VonMisesInThePlaneLosesEllipticityAtFortyFiveDegreesWithoutHardening)
{
  // For waves along the angle t, the acoustic tensor Q has
  //   det Q = mu (lambda + 2 mu) (1 - (2 mu sin^2 2t + 2 mu^2 cos^2 2t/(lambda + 2 mu))/(2 mu + h))
  // with the hardening modulus h. The last factor is least at t = 45 degrees: h/(2 mu + h).
  const double elastic = MU * (LAMBDA + 2.0 * MU);
  for (const double hardening : {0.3 * MU, 0.0, -0.1 * MU}) {
    const NominalTangentOf<2> tangent = unstressed(von_mises(hardening));
    for (const double angle : {0.2, 1.1, 2.9}) {
      const double s = std::sin(2.0 * angle), c = std::cos(2.0 * angle);
      const double expected = elastic *
          (1.0 -
           (2.0 * MU * s * s + 2.0 * MU * MU * c * c / (LAMBDA + 2.0 * MU)) /
               (2.0 * MU + hardening));
      EXPECT_NEAR(tangent.acoustic_determinant(at_angle(angle)), expected, ROUNDING * elastic);
    }
    const auto least = tangent.least_acoustic_determinant();
    EXPECT_NEAR(least.determinant, elastic * hardening / (2.0 * MU + hardening),
                ROUNDING * elastic);
    EXPECT_NEAR(std::fabs(std::atan2(least.normal[1], least.normal[0])), 0.25 * rve::kPi, 1e-6);
    // Second-order work vanishes along the flow too, since the flow is associated.
    EXPECT_NEAR(von_mises(hardening).least_second_order_work(),
                2.0 * MU * hardening / (2.0 * MU + hardening), ROUNDING * MU);
  }
}

TEST(Tangent, NonAssociatedFlowLosesSecondOrderWorkBeforeEllipticity)
{
  // If plastic flow P differs from F, the least eigenvalue of the symmetric part of the tangent is
  // negative at a positive hardening modulus at which det Q is still positive (Rudnicki and Rice,
  // below).
  const auto elastic = TangentOf<2>::isotropic(LAMBDA, MU);
  const auto f = diagonal<2>({1.0, -0.4}), p = diagonal<2>({0.75, -0.65});
  const TangentOf<2> tangent = plastic_tangent(elastic, p, f, 0.1 * MU);
  EXPECT_LT(tangent.least_second_order_work(), 0.0);
  EXPECT_GT(unstressed(tangent).least_acoustic_determinant().determinant, 0.0);
}

TEST(Tangent, DruckerPragerLosesEllipticityAtTheHardeningAndAngleOfRudnickiAndRice)
{
  // Rudnicki and Rice 1975, J. Mech. Phys. Solids 23, 371, eqs. (20) and (18). With the deviator N
  // (N:N = 2), friction a and dilatancy b, ellipticity is lost at the hardening modulus h,
  //     h/G = (1 + nu)/(9 (1 - nu)) (b - a)^2 - (1 + nu)/2 (N_II + (a + b)/3)^2.
  // The angle t between the normal of the band and axis III follows from
  //     tan^2 t = (xi - N_III)/(N_I - xi),  xi = (1 + nu)(a + b)/3 - N_II (1 - nu).
  const double nu = 0.5 * LAMBDA / (LAMBDA + MU), friction = 0.6, dilatancy = 0.2;
  const rve::Tensor3 rotation = rve::spatial_rotation({{0.3, -0.7, 0.4}});
  for (const double middle : {0.0, -0.25, 0.3}) {
    // N_I + N_III = -N_II, and N_I^2 + N_II^2 + N_III^2 = 2
    const double half = std::sqrt(1.0 - 0.75 * middle * middle);
    const double most = -0.5 * middle + half, least = -0.5 * middle - half;
    const rve::Tensor3 n = diagonal<3>({most, middle, least});
    const rve::Tensor3 one = rve::Tensor3::identity();
    const double sum = (friction + dilatancy) / 3.0;
    const double hardening = MU *
        ((1.0 + nu) / (9.0 * (1.0 - nu)) * std::pow(dilatancy - friction, 2) -
         0.5 * (1.0 + nu) * std::pow(middle + sum, 2));
    const double xi = (1.0 + nu) * sum - middle * (1.0 - nu);
    const double angle = std::atan(std::sqrt((xi - least) / (most - xi)));

    const auto tangent_of = [&](double h) {
      return unstressed(turned(plastic_tangent(TangentOf<3>::isotropic(LAMBDA, MU),
                                               0.5 * n + (dilatancy / 3.0) * one,
                                               0.5 * n + (friction / 3.0) * one, h),
                               rotation));
    };
    const double elastic = MU * MU * (LAMBDA + 2.0 * MU);
    const auto lost = tangent_of(hardening).least_acoustic_determinant();

    EXPECT_NEAR(lost.determinant, 0.0, 1e-12 * elastic) << middle;
    const rve::Vec<double, 3> normal = rve::transpose(rotation) * lost.normal;
    EXPECT_NEAR(normal[1], 0.0, 1e-6);
    EXPECT_NEAR(std::atan2(std::fabs(normal[0]), std::fabs(normal[2])), angle, 1e-6);
    EXPECT_GT(tangent_of(hardening + 1e-3 * MU).least_acoustic_determinant().determinant,
              1e-5 * elastic);
    EXPECT_LT(tangent_of(hardening - 1e-3 * MU).least_acoustic_determinant().determinant,
              -1e-5 * elastic);
  }
}

TEST(Tangent, SearchAgreesWithAScanOfAllDirections)
{
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const NominalTangentOf<2> plane(random_tangent<2>(random), random_stress<2>(random));
    double scanned = 1e300;
    for (int k = 0; k < 20000; ++k)
      scanned = std::min(scanned, plane.acoustic_determinant(at_angle(rve::kPi * k / 20000)));
    const double found = plane.least_acoustic_determinant().determinant;
    EXPECT_LE(found, scanned + ROUNDING);
    EXPECT_NEAR(found, scanned, 1e-6);    // half a spacing squared, times a curvature of some tens

    const NominalTangentOf<3> space(random_tangent<3>(random), random_stress<3>(random));
    scanned = 1e300;
    for (int k = 0; k < 100; ++k)
      for (int m = 0; m < 200; ++m)
        scanned = std::min(
            scanned,
            space.acoustic_determinant(at_angles(0.5 * rve::kPi * k / 100, rve::kPi * m / 100)));
    const double found_in_space = space.least_acoustic_determinant().determinant;
    EXPECT_LE(found_in_space, scanned + ROUNDING);
    EXPECT_NEAR(found_in_space, scanned, 1e-2);
  }
}

TEST(Tangent, RotatesWithTheMaterialAndItsInvariantsAreConstant)
{
  expect_turned_tangent<2>(rve::Tensor2{{0.8, -0.6, 0.6, 0.8}});
  expect_turned_tangent<3>(rve::spatial_rotation({{0.5, 0.2, -1.1}}));
}
