// SPDX-License-Identifier: GPL-2.0-only
// Geometry, kinematics and force of one contact of two disks.

#include "rve/core/fixed_point.h"
#include "rve/physics/laws/linear_friction.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

using namespace rve;
using rve_test::Random;

namespace {

constexpr double PI = 3.14159265358979323846;

template <class Numbers> class ContactOfTwoDisks : public ::testing::Test {
};
using Formats = ::testing::Types<FastNumbers, MixedNumbers, DoubleNumbers>;
TYPED_TEST_SUITE(ContactOfTwoDisks, Formats);

template <class Numbers, bool Damped> using Law = LinearFrictionLaw<Numbers, Damped>;

template <class Numbers, bool Damped = true>
Law<Numbers, Damped> law_with(double velocity_arm, double normal_viscosity = 0.0,
                              double tangential_viscosity = 0.0)
{
  using Real = typename Numbers::Real;
  Law<Numbers, Damped> law;
  law.constants.normal_stiffness = Real(1e6);
  law.constants.normal_viscosity = Real(normal_viscosity);
  law.constants.tangential_stiffness = typename Numbers::Spring(0.8e6);
  law.constants.friction = Real(0.5);
  law.constants.tangential_viscosity = Real(tangential_viscosity);
  law.constants.velocity_arm = Real(velocity_arm);
  return law;
}

template <class Numbers>
ContactGeometry<typename Numbers::Real, 2> geometry(const Vec<typename Numbers::Wide, 2> &branch,
                                                    typename Numbers::Wide sum_of_radii)
{
  return contact_geometry<typename Numbers::Real>(branch, sum_of_radii);
}

template <class T> bool same_bits(T x, T y)
{
  return std::memcmp(&x, &y, sizeof(T)) == 0;
}

/// Returns the rounding error of one operation in the type Real of a number format.
template <class Numbers> double epsilon()
{
  return std::numeric_limits<typename Numbers::Real>::epsilon();
}

}    // namespace

TYPED_TEST(ContactOfTwoDisks, OverlapNormalAndDistanceAreThoseOfTheBranch)
{
  using Wide = typename TypeParam::Wide;
  Random random(1);
  for (int sample = 0; sample < 2000; ++sample) {
    const double sum = 0.0072,
                 overlap = sum * std::exp(random.uniform(std::log(1e-3), std::log(0.2)));
    const double angle = random.uniform(0.0, 2.0 * PI), distance = sum - overlap;
    const Vec<Wide, 2> branch{{Wide(distance * std::cos(angle)), Wide(distance * std::sin(angle))}};

    const auto contact = geometry<TypeParam>(branch, Wide(sum));

    ASSERT_NEAR(contact.distance, distance, 4.0 * epsilon<TypeParam>() * distance);
    ASSERT_NEAR(contact.normal[0], std::cos(angle), 4.0 * epsilon<TypeParam>());
    ASSERT_NEAR(contact.normal[1], std::sin(angle), 4.0 * epsilon<TypeParam>());
    // If Wide has more digits than Real, the overlap is (R^2 - d^2)/(R + d), with the sum R of the
    // radii and the distance d. The branch and R^2 - d^2 are rounded in Wide, the quotient in Real.
    const double wide_epsilon = std::numeric_limits<Wide>::epsilon();
    ASSERT_NEAR(contact.overlap, overlap,
                4.0 * wide_epsilon * sum + 8.0 * epsilon<TypeParam>() * overlap);
  }
}

TYPED_TEST(ContactOfTwoDisks, GapIsANegativeOverlap)
{
  using Wide = typename TypeParam::Wide;
  Random random(7);
  const double sum = 0.0072;
  for (int sample = 0; sample < 2000; ++sample) {
    const double gap = sum * random.uniform(1e-5, 0.2), angle = random.uniform(0.0, 2.0 * PI);
    const Vec<Wide, 2> branch{
        {Wide((sum + gap) * std::cos(angle)), Wide((sum + gap) * std::sin(angle))}};

    const auto contact = geometry<TypeParam>(branch, Wide(sum));

    ASSERT_LT(contact.overlap, 0.0);
    ASSERT_NEAR(contact.overlap, -gap,
                4.0 * std::numeric_limits<Wide>::epsilon() * sum +
                    8.0 * epsilon<TypeParam>() * gap);
  }
}

TEST(GapSquared, KeepsTheOverlapOfStiffGrainsWhereTheDifferenceOfLengthsLosesIt)
{
  // In the format mixed, only R^2 - d^2 is computed in fp64. A relative overlap of 1e-7 must
  // survive the other operations, which are fp32.
  const double sum = 0.01, overlap = 1e-9;
  const Vec<double, 2> branch{{0.6 * (sum - overlap), 0.8 * (sum - overlap)}};

  const auto contact = geometry<MixedNumbers>(branch, sum);

  EXPECT_NEAR(contact.overlap, overlap, 1e-6 * overlap);
}

TYPED_TEST(ContactOfTwoDisks, ExchangeOfTheGrainsGivesTheOppositeForceAndTheSameHistoryBits)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  using History = typename TypeParam::Spring;
  Random random(2);
  int sliding = 0, sticking = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    const bool viscous = sample % 2 != 0;
    const auto law =
        law_with<TypeParam>(sample % 3 ? 0.5 : 0.0, viscous ? 30.0 : 0.0, viscous ? 15.0 : 0.0);
    const DiskMotion<Real> i{{{Real(random.uniform(-1.0, 1.0)), Real(random.uniform(-1.0, 1.0))}},
                             Real(random.uniform(-99.0, 99.0)),
                             Real(random.uniform(0.002, 0.006))};
    const DiskMotion<Real> j{{{Real(random.uniform(-1.0, 1.0)), Real(random.uniform(-1.0, 1.0))}},
                             Real(random.uniform(-99.0, 99.0)),
                             Real(random.uniform(0.002, 0.006))};
    Tensor<Real, 2> gradient;
    for (Real &x : gradient.component) x = Real(random.uniform(-20.0, 20.0));
    const Wide sum = static_cast<Wide>(i.radius) + static_cast<Wide>(j.radius);
    const double distance = sum * (1.0 - random.uniform(1e-5, 0.1)),
                 angle = random.uniform(0.0, 2.0 * PI);
    const Vec<Wide, 2> branch{{Wide(distance * std::cos(angle)), Wide(distance * std::sin(angle))}};
    const Vec<Wide, 2> back{{-branch[0], -branch[1]}};
    const History spring = History(random.uniform(-50.0, 50.0));
    const Real dt = Real(random.uniform(0.0, 1e-4));

    const auto of_i = evaluate(law, geometry<TypeParam>(branch, sum), i, j, gradient, spring, dt);
    const auto of_j = evaluate(law, geometry<TypeParam>(back, sum), j, i, gradient, spring, dt);

    ASSERT_EQ(of_i.force[0], -of_j.force[0]);
    ASSERT_EQ(of_i.force[1], -of_j.force[1]);
    ASSERT_TRUE(same_bits(of_i.torque_i, of_j.torque_j));
    ASSERT_TRUE(same_bits(of_i.torque_j, of_j.torque_i));
    ASSERT_TRUE(same_bits(of_i.spring, of_j.spring));
    ASSERT_TRUE(same_bits(of_i.slipped, of_j.slipped));
    ASSERT_TRUE(same_bits(of_i.normal_force, of_j.normal_force));
    ASSERT_EQ(of_i.sliding, of_j.sliding);
    ++(of_i.sliding ? sliding : sticking);
    const auto stress_i = dyad(of_i.force, geometry<TypeParam>(branch, sum).branch);
    const auto stress_j = dyad(of_j.force, geometry<TypeParam>(back, sum).branch);
    for (int k = 0; k < 4; ++k) ASSERT_EQ(stress_i.component[k], stress_j.component[k]);
  }
  EXPECT_GT(sliding, 1000);
  EXPECT_GT(sticking, 1000);
}

TYPED_TEST(ContactOfTwoDisks, PlainLawIsTheGeneralOneWithoutDashpotsAndWithContactArms)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  Random random(6);
  // The plain law must ignore its arguments for lever arms and dashpots.
  const auto plain = law_with<TypeParam, false>(0.0, 30.0, 15.0);
  const auto general = law_with<TypeParam, true>(0.5);
  for (int sample = 0; sample < 2000; ++sample) {
    const DiskMotion<Real> i{
        {{Real(random.uniform(-1.0, 1.0)), 0}}, Real(random.uniform(-9.0, 9.0)), Real(0.005)};
    const DiskMotion<Real> j{{{0, Real(random.uniform(-1.0, 1.0))}}, 0, Real(0.004)};
    const double angle = random.uniform(0.0, 2.0 * PI), d = 0.0089;
    const auto contact = geometry<TypeParam>(
        Vec<Wide, 2>{{Wide(d * std::cos(angle)), Wide(d * std::sin(angle))}}, Wide(0.009));
    const Real dt = Real(2e-4);

    const auto x = evaluate(plain, contact, i, j, Tensor<Real, 2>::zero(), 3, dt);
    const auto y = evaluate(general, contact, i, j, Tensor<Real, 2>::zero(), 3, dt);

    ASSERT_EQ(x.force[0], y.force[0]);
    ASSERT_EQ(x.force[1], y.force[1]);
    ASSERT_EQ(x.torque_i, y.torque_i);
    ASSERT_EQ(x.torque_j, y.torque_j);
    ASSERT_EQ(x.normal_force, y.normal_force);
    ASSERT_EQ(x.tangential_velocity, y.tangential_velocity);
    ASSERT_EQ(x.spring, y.spring);
    ASSERT_EQ(x.sliding, y.sliding);
  }
}

TYPED_TEST(ContactOfTwoDisks, ForcesRotateWithTheFrame)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  const auto law = law_with<TypeParam>(0.5, 30.0, 15.0);
  const double overlap = 4e-5, sum = 0.009;
  const auto force_at = [&](double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const auto turned = [&](double x, double y) {
      return Vec<Real, 2>{{Real(c * x - s * y), Real(s * x + c * y)}};
    };
    const DiskMotion<Real> i{turned(0.1, 0.2), Real(3.0), Real(0.005)},
        j{turned(-0.3, 0.1), Real(-7.0), Real(0.004)};
    const double d = sum - overlap;
    const Vec<Wide, 2> branch{{Wide(c * d), Wide(s * d)}};
    return evaluate(law, geometry<TypeParam>(branch, Wide(sum)), i, j, Tensor<Real, 2>::zero(), 5.0,
                    Real(1e-5));
  };

  const auto straight = force_at(0.0), turned = force_at(1.1);

  // The rounding of the branch in Wide gives the overlap an error of sum * epsilon. All other
  // errors are roundings in Real.
  const double error =
      1e6 * sum * std::numeric_limits<Wide>::epsilon() * 4.0 + 40.0 * epsilon<TypeParam>() * 16.0;
  EXPECT_NEAR(turned.force[0],
              std::cos(1.1) * straight.force[0] - std::sin(1.1) * straight.force[1], error);
  EXPECT_NEAR(turned.force[1],
              std::sin(1.1) * straight.force[0] + std::cos(1.1) * straight.force[1], error);
  EXPECT_NEAR(turned.torque_i, straight.torque_i, 0.005 * error);
  EXPECT_NEAR(straight.normal_force, 40.0 + 30.0 * 0.4,
              error);    // spring force, and dashpot force at an approach of 0.4 m/s
}

TYPED_TEST(ContactOfTwoDisks, RepulsionAndTorqueHaveTheRightSigns)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  const auto law = law_with<TypeParam>(0.5);
  // j is to the right of i and moves up. It drags i up and rotates both counterclockwise: torque =
  // r x f is positive.
  const DiskMotion<Real> i{{{0, 0}}, 0, Real(0.005)}, j{{{0, Real(0.1)}}, 0, Real(0.004)};

  const auto contact = geometry<TypeParam>(Vec<Wide, 2>{{Wide(0.00896), 0}}, Wide(0.009));
  const auto result = evaluate(law, contact, i, j, Tensor<Real, 2>::zero(), 0, Real(1e-4));

  EXPECT_LT(result.force[0], 0.0);
  EXPECT_GT(result.force[1], 0.0);
  // The force on i acts on the right side of i, and the opposite force acts on the left side of j.
  // Both torques therefore have the sign of f_t.
  EXPECT_NEAR(result.torque_i, (0.005 - 0.5 * contact.overlap) * result.force[1],
              1e-6 * result.torque_i);
  EXPECT_NEAR(result.torque_j, (0.004 - 0.5 * contact.overlap) * result.force[1],
              1e-6 * result.torque_j);
}

TYPED_TEST(ContactOfTwoDisks, TorquesAndCoupleOfForcesConserveAngularMomentum)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  Random random(3);
  const auto law = law_with<TypeParam>(0.5);
  for (int sample = 0; sample < 1000; ++sample) {
    const DiskMotion<Real> i{
        {{Real(random.uniform(-1.0, 1.0)), 0}}, Real(random.uniform(-9.0, 9.0)), Real(0.005)};
    const DiskMotion<Real> j{{{0, Real(random.uniform(-1.0, 1.0))}}, 0, Real(0.004)};
    const double angle = random.uniform(0.0, 2.0 * PI), d = 0.0089;
    const auto contact = geometry<TypeParam>(
        Vec<Wide, 2>{{Wide(d * std::cos(angle)), Wide(d * std::sin(angle))}}, Wide(0.009));

    const auto f = evaluate(law, contact, i, j, Tensor<Real, 2>::zero(), 0, Real(1e-5));

    // The forces f on i and -f on j at the distance b form the couple -b x f. The torques of both
    // grains, with lever arms to the contact point, balance this couple.
    const double couple = -static_cast<double>(cross(contact.branch, f.force));
    ASSERT_NEAR(f.torque_i + f.torque_j + couple, 0.0, 100.0 * 0.009 * 8.0 * epsilon<TypeParam>());
  }
}

TYPED_TEST(ContactOfTwoDisks,
           RigidRotationSlipsNotWithContactArmsAndByOverlapTimesSpinWithLammpsArms)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  const double w = 12.0, d = 0.00892, angle = 0.7;
  const Vec<Wide, 2> branch{{Wide(d * std::cos(angle)), Wide(d * std::sin(angle))}};
  const auto contact = geometry<TypeParam>(branch, Wide(0.009));
  // Grain i is at (0.3, -0.2); velocities are those of a rigid rotation about the origin.
  const auto motion = [&](double x, double y, double radius) {
    return DiskMotion<Real>{{{Real(-w * y), Real(w * x)}}, Real(w), Real(radius)};
  };
  const auto i = motion(0.3, -0.2, 0.005);
  const auto j =
      motion(0.3 + static_cast<double>(branch[0]), -0.2 + static_cast<double>(branch[1]), 0.004);
  // The same rotation as a mean field: the velocity gradient is the spin tensor, and the peculiar
  // velocities are zero.
  const DiskMotion<Real> carried_i{{{0, 0}}, Real(w), Real(0.005)},
      carried_j{{{0, 0}}, Real(w), Real(0.004)};
  const Tensor<Real, 2> rotation{{0, Real(-w), Real(w), 0}};
  const double error =
      4.0 * epsilon<TypeParam>() * w * 0.3;    // roundings of the velocities of the grains
  const double small_error = 4.0 * epsilon<TypeParam>() * w * 0.01;

  for (const bool contact_arms : {true, false}) {
    const auto law = law_with<TypeParam>(contact_arms ? 0.5 : 0.0);
    const double expected = contact_arms ? 0.0 : -w * static_cast<double>(contact.overlap);

    const auto direct = evaluate(law, contact, i, j, Tensor<Real, 2>::zero(), 0, Real(1e-4));
    const auto carried = evaluate(law, contact, carried_i, carried_j, rotation, 0, Real(1e-4));

    EXPECT_NEAR(direct.tangential_velocity, expected, error);
    EXPECT_NEAR(carried.tangential_velocity, expected, small_error);
    EXPECT_NEAR(carried.normal_velocity, 0.0, small_error);
  }
}

TYPED_TEST(ContactOfTwoDisks, RollingOnEachOtherDoesNotSlip)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  const auto contact = geometry<TypeParam>(Vec<Wide, 2>{{Wide(0.0089), 0}}, Wide(0.009));
  const double arm_i = 0.005 - 0.5 * contact.overlap, arm_j = 0.004 - 0.5 * contact.overlap;
  const DiskMotion<Real> i{{{0, 0}}, Real(10.0), Real(0.005)},
      j{{{0, 0}}, Real(-10.0 * arm_i / arm_j), Real(0.004)};

  const auto result =
      evaluate(law_with<TypeParam>(0.5), contact, i, j, Tensor<Real, 2>::zero(), 0, Real(1e-4));

  EXPECT_NEAR(result.tangential_velocity, 0.0, 4.0 * epsilon<TypeParam>() * 10.0 * 0.005);
}

TYPED_TEST(ContactOfTwoDisks, RelativeVelocityAcrossThePeriodicBoundaryIsTheGradientTimesTheBranch)
{
  using Real = typename TypeParam::Real;
  using Coordinate = typename TypeParam::Coordinate;
  const Tensor2 cell{{0.1, 0.02, -0.01, 0.12}}, gradient{{3.0, -5.0, 7.0, -2.0}};
  const double si[2] = {0.98, 0.99}, sj[2] = {0.02, 0.015};
  Vec<Coordinate, 2> i, j;
  Vec<double, 2> xi, xj;
  for (int a = 0; a < 2; ++a) {
    i[a] = static_cast<Coordinate>(si[a] / TypeParam::fraction_unit);
    j[a] = static_cast<Coordinate>(sj[a] / TypeParam::fraction_unit);
    xi[a] = si[a];
    xj[a] = sj[a];
  }
  xi = cell * xi;
  xj = cell * xj;
  // Equation (20a) with period shifts: the image of j is shifted by both cell vectors, H (1, 1),
  // and has the additional velocity L H (1, 1).
  const Vec<double, 2> period = cell * Vec<double, 2>{{1.0, 1.0}};
  const Vec<double, 2> expected = (gradient * xj + gradient * period) - gradient * xi;
  const Vec<double, 2> image_branch = (xj + period) - xi;
  const Vec<double, 2> normal = (1.0 / std::sqrt(dot(image_branch, image_branch))) * image_branch;

  const auto branch = fraction_to_length<TypeParam>(cell) * fractional_difference<TypeParam>(j, i);
  const auto contact = geometry<TypeParam>(branch, typename TypeParam::Wide(0.0088));
  const DiskMotion<Real> rest{{{0, 0}}, 0, Real(0.0044)};
  const auto result =
      evaluate(law_with<TypeParam>(0.5), contact, rest, rest, gradient.as<Real>(), 0, Real(1e-4));

  const double error = 10.0 * epsilon<TypeParam>();    // velocities of 1 m/s are subtracted
  EXPECT_NEAR(result.normal_velocity, dot(expected, normal), error);
  EXPECT_NEAR(result.tangential_velocity, cross(normal, expected), error);
}

TYPED_TEST(ContactOfTwoDisks, DashpotsAreThoseOfLammpsHookeWithVelocityDamping)
{
  using Real = typename TypeParam::Real;
  using Wide = typename TypeParam::Wide;
  Random random(4);
  const double kn = 1e6, gamma_n = 30.0, gamma_t = 15.0, mu = 0.5;
  const auto law = law_with<TypeParam>(0.0, gamma_n, gamma_t);
  for (int sample = 0; sample < 2000; ++sample) {
    const double vi[2] = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    const double vj[2] = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    const double wi = random.uniform(-9.0, 9.0), wj = random.uniform(-9.0, 9.0);
    const double angle = random.uniform(0.0, 2.0 * PI), d = 0.0089;
    const DiskMotion<Real> i{{{Real(vi[0]), Real(vi[1])}}, Real(wi), Real(0.005)};
    const DiskMotion<Real> j{{{Real(vj[0]), Real(vj[1])}}, Real(wj), Real(0.004)};
    // In LAMMPS (granular_model.cpp), n points from j to i, vr = vi - vj, and the force on i is
    // Fntot n + fs. The time step of zero leaves the spring unstretched.
    const double n[2] = {-std::cos(angle), -std::sin(angle)};
    const double vr[2] = {vi[0] - vj[0], vi[1] - vj[1]};
    const double vnnr = vr[0] * n[0] + vr[1] * n[1];
    const double normal_total = kn * (0.009 - d) - gamma_n * vnnr;
    const double w = 0.005 * wi + 0.004 * wj;
    const double vtr[2] = {vr[0] - vnnr * n[0] + w * n[1], vr[1] - vnnr * n[1] - w * n[0]};
    double fs[2] = {-gamma_t * vtr[0], -gamma_t * vtr[1]};
    const double size = std::hypot(fs[0], fs[1]), critical = mu * std::fabs(normal_total);
    for (double &f : fs) f *= size > critical ? critical / size : 1.0;

    const auto contact = geometry<TypeParam>(
        Vec<Wide, 2>{{Wide(d * std::cos(angle)), Wide(d * std::sin(angle))}}, Wide(0.009));
    const auto result = evaluate(law, contact, i, j, Tensor<Real, 2>::zero(), 0, Real(0));

    // The spring force of 100 N has the rounding error of the overlap, which fp32 resolves to 1e-9
    // m. All other errors are roundings in Real.
    const double error = kn * 0.009 * 8.0 * std::numeric_limits<Wide>::epsilon() +
        100.0 * 16.0 * epsilon<TypeParam>();
    ASSERT_NEAR(result.force[0], normal_total * n[0] + fs[0], error);
    ASSERT_NEAR(result.force[1], normal_total * n[1] + fs[1], error);
  }
}
