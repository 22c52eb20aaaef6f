// SPDX-License-Identifier: GPL-2.0-only
// Rolling resistance: its moment, its history, and contact laws with it.

#include "rve/core/fixed_point.h"
#include "rve/physics/laws/dmt_adhesion.h"
#include "rve/physics/laws/hertz_mindlin.h"
#include "rve/physics/laws/linear_friction.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

using namespace rve;
using rve_test::Random;

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double STIFFNESS = 4e5;    // k_r [force/length]
constexpr double FRICTION = 0.25;    // mu_r
constexpr double NORMAL_FORCE = 20.0;
constexpr double LIMIT = FRICTION * NORMAL_FORCE;
constexpr double DT = 1e-4;

/// Advances the rolling spring by one step. `force` is the rolling force before this step.
auto roll(double force, const DiskMotion<double> &i, const DiskMotion<double> &j,
          double normal_force)
{
  const TurningResistance<double, double, 2> resistance{{STIFFNESS, FRICTION, 0.0}, {}};
  return resistance.advance(0, 0, {force}, {}, {}, i, j, normal_force, DT);
}

/// Reduced radius of first() and second(), which are disks with radii of 5 and 3 mm [m].
constexpr double REDUCED_RADIUS = 0.001875;
DiskMotion<double> first(double spin)
{
  return {{{0.3, -0.2}}, spin, 0.005};
}
DiskMotion<double> second(double spin)
{
  return {{{-0.7, 0.1}}, spin, 0.003};
}

/// Returns the relative spin that changes the rolling force by `share` of its limit in one step.
double spin_for(double share)
{
  return share * LIMIT / (STIFFNESS * DT * REDUCED_RADIUS);
}

template <class T> bool same_bits(T x, T y)
{
  return std::memcmp(&x, &y, sizeof(T)) == 0;
}

template <class Law> struct WithoutRolling;
template <class Contact> struct WithoutRolling<WithRolling<Contact>> {
  using type = Contact;
};

template <class Number> void randomize(Random &random, Number &force)
{
  force = Number(random.uniform(-50.0, 50.0));
}
template <class Number> void randomize(Random &random, MindlinHistory<Number> &history)
{
  randomize(random, history.tangential);
  history.contact_radius = Number(random.uniform(1e-5, 1e-3));
}

Material material(double rolling_friction)
{
  Material material;
  material.normal_stiffness = 1e6;
  material.normal_viscosity = 30.0;
  material.tangential_stiffness = 0.8e6;
  material.tangential_viscosity = 15.0;
  material.hertz_stiffness = 1e9;
  material.mindlin_stiffness = 0.8e9;
  material.mindlin_damping = 0.5;
  material.mindlin_displacement = 1.0;
  material.surface_energy = 30.0;
  material.density = 2650.0;
  material.friction = 0.5;
  material.rolling_stiffness = STIFFNESS;
  material.rolling_friction = rolling_friction;
  return material;
}

template <class SomeLaw> class LawWithRolling : public ::testing::Test {
 public:
  using Law = SomeLaw;
  using Contact = typename WithoutRolling<Law>::type;
  using Real = typename Law::Numbers::Real;
  using Wide = typename Law::Numbers::Wide;
  using Spring = typename Law::Numbers::Spring;

  /// Returns the law with parameters in the units of the script.
  static Law law(double rolling_friction)
  {
    typename Law::Constants constants;
    constants.set(material(rolling_friction), LawUnits::same(), 0.5);
    Law law;
    law.take(constants);
    return law;
  }

  /// A touching pair with random motion.
  struct Sample {
    DiskMotion<Real> i, j;
    Vec<Wide, 2> branch;
    Wide sum_of_radii;
    Tensor<Real, 2> gradient;
    typename Law::History history;
    Real dt;

    explicit Sample(Random &random)
    {
      for (DiskMotion<Real> *disk : {&i, &j})
        *disk = {{{Real(random.uniform(-1.0, 1.0)), Real(random.uniform(-1.0, 1.0))}},
                 Real(random.uniform(-99.0, 99.0)),
                 Real(random.uniform(0.002, 0.006))};
      for (Real &x : gradient.component) x = Real(random.uniform(-20.0, 20.0));
      sum_of_radii = static_cast<Wide>(i.radius) + static_cast<Wide>(j.radius);
      const double distance = sum_of_radii * (1.0 - random.uniform(1e-5, 0.1));
      const double angle = random.uniform(0.0, 2.0 * PI);
      branch = {{Wide(distance * std::cos(angle)), Wide(distance * std::sin(angle))}};
      randomize(random, history.contact);
      history.turning.rolling = Spring(random.uniform(-20.0, 20.0));
      dt = Real(random.uniform(0.0, 1e-4));
    }

    ContactGeometry<Real, 2> contact() const
    {
      return contact_geometry<Real>(branch, sum_of_radii);
    }
    ContactGeometry<Real, 2> contact_from_j() const
    {
      return contact_geometry<Real>(Vec<Wide, 2>{{-branch[0], -branch[1]}}, sum_of_radii);
    }
  };
};
using Laws = ::testing::Types<
    RollingSprings<FastNumbers>, RollingSprings<MixedNumbers>, RollingSprings<DoubleNumbers>,
    RollingSprings<SingleNumbers>, RollingHertz<FastNumbers>, RollingHertz<MixedNumbers>,
    RollingHertz<DoubleNumbers>, RollingHertz<SingleNumbers>, RollingDmt<FastNumbers>,
    RollingDmt<MixedNumbers>, RollingDmt<DoubleNumbers>, RollingDmt<SingleNumbers>>;
TYPED_TEST_SUITE(LawWithRolling, Laws);

}    // namespace

TEST(RollingResistance, SpringGrowsByItsStiffnessTimesTheReducedRadiusTimesTheRelativeTurn)
{
  const double turn = spin_for(0.25);

  const auto one = roll(0.0, first(3.0), second(3.0 + turn), NORMAL_FORCE);
  const auto two = roll(one.history.rolling, first(3.0), second(3.0 + turn), NORMAL_FORCE);

  EXPECT_NEAR(one.history.rolling, STIFFNESS * REDUCED_RADIUS * turn * DT, 1e-13 * LIMIT);
  EXPECT_NEAR(two.history.rolling, 0.5 * LIMIT, 1e-13 * LIMIT);
  // The second disk, which rotates faster, drives the first one.
  EXPECT_NEAR(two.moment, REDUCED_RADIUS * 0.5 * LIMIT, 1e-13 * LIMIT * REDUCED_RADIUS);
  EXPECT_EQ(two.slipped, 0.0);
}

TEST(RollingResistance, LimitCapsTheForceInBothDirections)
{
  for (const double direction : {1.0, -1.0}) {
    const auto rolled =
        roll(direction * 0.9 * LIMIT, first(0.0), second(direction * spin_for(0.25)), NORMAL_FORCE);

    EXPECT_EQ(rolled.history.rolling, direction * LIMIT);
    EXPECT_NEAR(rolled.slipped, direction * 0.15 * LIMIT, 1e-13 * LIMIT);
    EXPECT_NEAR(rolled.moment, direction * REDUCED_RADIUS * FRICTION * NORMAL_FORCE,
                1e-15 * REDUCED_RADIUS * LIMIT);
  }
}

TEST(RollingResistance, ReversedRollingUnloadsTheSpringFirst)
{
  double force = LIMIT;    // rolled forward up to the limit

  for (int step = 0; step < 8; ++step)
    force = roll(force, first(0.0), second(-spin_for(0.25)), NORMAL_FORCE).history.rolling;

  EXPECT_NEAR(force, -LIMIT, 1e-12 * LIMIT);
}

TEST(RollingResistance, LimitFollowsTheNormalForce)
{
  const auto rolled = roll(LIMIT, first(0.0), second(0.0), 0.5 * NORMAL_FORCE);

  EXPECT_EQ(rolled.history.rolling, 0.5 * LIMIT);
  EXPECT_EQ(rolled.slipped, 0.5 * LIMIT);
}

TEST(RollingResistance, EqualSpinsDoNotMoveTheSpring)
{
  const double force = 0.3 * LIMIT;
  for (const double spin : {0.0, 12.0, -777.7}) {
    const auto rolled = roll(force, first(spin), second(spin), NORMAL_FORCE);
    EXPECT_EQ(rolled.history.rolling, force);
  }
}

TEST(RollingResistance, HistoryOfTheOtherGrainHasTheOppositeMomentAndTheSameTangentialForce)
{
  const RollingHistory<double, TurningHistory<double, 2>> history{3.0, {-0.5}};

  const auto other = RollingSprings<DoubleNumbers>::seen_from_partner(history);

  EXPECT_EQ(other.contact, 3.0);
  EXPECT_EQ(other.turning.rolling, 0.5);
  EXPECT_EQ(DampedSprings<DoubleNumbers>::seen_from_partner(3.0), 3.0);    // without rolling
}

TYPED_TEST(LawWithRolling, ExchangeOfTheGrainsGivesTheSameBits)
{
  Random random(2);
  const auto law = this->law(0.1);
  int at_limit = 0, below = 0;
  for (int k = 0; k < 20000; ++k) {
    const typename TestFixture::Sample s(random);

    const auto of_i = evaluate(law, s.contact(), s.i, s.j, s.gradient, s.history, s.dt);
    const auto of_j = evaluate(law, s.contact_from_j(), s.j, s.i, s.gradient,
                               law.seen_from_partner(s.history), s.dt);

    ASSERT_EQ(of_i.force[0], -of_j.force[0]);
    ASSERT_EQ(of_i.force[1], -of_j.force[1]);
    ASSERT_TRUE(same_bits(of_i.torque_i, of_j.torque_j));
    ASSERT_TRUE(same_bits(of_i.torque_j, of_j.torque_i));
    const auto back = law.seen_from_partner(of_j.history());
    ASSERT_TRUE(same_bits(of_i.history().contact, back.contact));
    ASSERT_TRUE(same_bits(of_i.history().turning, back.turning));
    ASSERT_EQ(of_i.turned.slipped, -of_j.turned.slipped);
    ++(of_i.turned.slipped != 0 ? at_limit : below);
  }
  EXPECT_GT(at_limit, 1000);
  EXPECT_GT(below, 1000);
}

TYPED_TEST(LawWithRolling, MomentsAreOppositeAndTheForceIsThatWithoutRolling)
{
  Random random(3);
  const auto law = this->law(0.1);
  const typename TestFixture::Contact &contact_law = law;
  for (int k = 0; k < 2000; ++k) {
    const typename TestFixture::Sample s(random);

    const auto with = evaluate(law, s.contact(), s.i, s.j, s.gradient, s.history, s.dt);
    const auto without =
        evaluate(contact_law, s.contact(), s.i, s.j, s.gradient, s.history.contact, s.dt);
    const auto rolled = law.resistance.advance(0, 0, s.history.turning, {}, {}, s.i, s.j,
                                               contact_law.limiting_force(without), s.dt);

    ASSERT_TRUE(same_bits(with.force, without.force));
    ASSERT_TRUE(same_bits(with.spring, without.spring));
    ASSERT_EQ(with.torque_i, without.torque_i + rolled.moment);
    ASSERT_EQ(with.torque_j, without.torque_j - rolled.moment);
  }
}

TYPED_TEST(LawWithRolling, CoefficientOfZeroGivesTheBitsOfTheLawWithoutRolling)
{
  Random random(4);
  const auto law = this->law(0.0);
  const typename TestFixture::Contact &contact_law = law;
  for (int k = 0; k < 2000; ++k) {
    const typename TestFixture::Sample s(random);

    const auto with = evaluate(law, s.contact(), s.i, s.j, s.gradient, s.history, s.dt);
    const auto without =
        evaluate(contact_law, s.contact(), s.i, s.j, s.gradient, s.history.contact, s.dt);

    ASSERT_TRUE(same_bits(with.torque_i, without.torque_i));
    ASSERT_TRUE(same_bits(with.torque_j, without.torque_j));
    ASSERT_EQ(with.turned.history.rolling, 0);
  }
}

// In three dimensions, LAMMPS (granular_model.cpp, gran_sub_mod_rolling.cpp) computes in this
// order:
//   relrot = omega_i - omega_j
//   v = R relrot x n, where n points from j to i
//   xi += v dt
//   fr = -k xi, limited to mu f
//   torque on i = R n x fr, torque on j = -R n x fr
// f is the normal force. For dmt, f is the sum of the magnitudes of the spring force and the
// attraction.
TYPED_TEST(LawWithRolling, AgreesWithLammpsRollingSds)
{
  Random random(5);
  const double k_r = STIFFNESS, mu_r = 0.1;
  const auto law = this->law(mu_r);
  for (int k = 0; k < 2000; ++k) {
    typename TestFixture::Sample s(random);
    const double ri = s.i.radius, rj = s.j.radius, reduced = ri * rj / (ri + rj);
    const auto contact = s.contact();
    const double n[2] = {-static_cast<double>(contact.normal[0]),
                         -static_cast<double>(contact.normal[1])};
    const double relrot = static_cast<double>(s.i.spin) - static_cast<double>(s.j.spin);
    // In the plane, relrot x n = relrot (-n_y, n_x). The history of GPU_RVE is the rolling force
    // along this direction. Its sign is opposite to that of xi.
    const double t[2] = {-n[1], n[0]};
    const double xi_before = -static_cast<double>(s.history.turning.rolling) / k_r;
    double fr[2];
    for (int a = 0; a < 2; ++a)
      fr[a] = -k_r * t[a] * (xi_before + reduced * relrot * static_cast<double>(s.dt));

    const auto result = evaluate(law, contact, s.i, s.j, s.gradient, s.history, s.dt);

    const double pull_off = TypeParam::contact_law == ContactLaw::Dmt
        ? 4.0 * PI * material(mu_r).surface_energy * reduced
        : 0.0;
    // For dmt, the limit does not depend on the dashpots.
    const double springs = law.spring_force({static_cast<double>(contact.overlap), ri, rj});
    const double normal_force = pull_off > 0.0 ? springs + 2.0 * pull_off
                                               : static_cast<double>(result.normal_force);
    const double critical = mu_r * std::fabs(normal_force);
    const double size = std::hypot(fr[0], fr[1]);
    for (double &f : fr) f *= size > critical ? critical / size : 1.0;
    const double torque_on_i = reduced * (n[0] * fr[1] - n[1] * fr[0]);
    const auto moment =
        law.resistance
            .advance(0, 0, s.history.turning, {}, {}, s.i, s.j, law.limiting_force(result), s.dt)
            .moment;
    // The error is relative to the sizes of the terms, since the terms can cancel.
    const double error = 16.0 * std::numeric_limits<typename TestFixture::Real>::epsilon() *
        reduced * (std::fabs(static_cast<double>(s.history.turning.rolling)) + size + critical);
    ASSERT_NEAR(static_cast<double>(moment), torque_on_i, error);
  }
}
