// SPDX-License-Identifier: GPL-2.0-only
// Tests the kinematics of a contact of two spheres, its tangential history, and the contact laws of
// spheres.

#include "rve/core/numbers.h"
#include "rve/physics/laws/dmt_adhesion.h"
#include "rve/physics/laws/hertz_mindlin.h"
#include "rve/physics/laws/linear_friction.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

using namespace rve;
using rve_test::Random;

namespace {

using Vector = Vec<double, 3>;

constexpr double PI = 3.14159265358979323846;

template <class Real> Vec<Real, 3> random_vector(Random &random, double size)
{
  Vec<Real, 3> v;
  for (int a = 0; a < 3; ++a) v[a] = static_cast<Real>(random.uniform(-size, size));
  return v;
}

double length(const Vector &v)
{
  return std::sqrt(dot(v, v));
}

Vector unit(const Vector &v)
{
  return (1.0 / length(v)) * v;
}

/// Returns the rotated vector by Rodrigues' formula.
Vector rotated(const Vector &v, const Vector &axis, double angle)
{
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) +
      ((1.0 - std::cos(angle)) * dot(axis, v)) * axis;
}

/// Returns the component of v perpendicular to the unit vector n.
Vector across(const Vector &n, const Vector &v)
{
  return v - dot(v, n) * n;
}

template <class T> bool opposite_bits(const T &x, const T &y)
{
  for (int a = 0; a < 3; ++a)
    if (!(x[a] == -y[a])) return false;
  return true;
}

template <class T> bool same_bits(const T &x, const T &y)
{
  return std::memcmp(&x, &y, sizeof(T)) == 0;
}

template <class Real>
Vec<Real, 3> turned_by(const Vec<Real, 3> &force, const Vec<Real, 3> &normal,
                       const ContactTurn<Real> &turn, bool moves)
{
  return turned_with_contact(force, normal, middle_normal(normal, turn), turn.twist, moves).sum();
}

/// Returns the force after step k = 1, 2, ..., in which the contact rotates by `angle` about
/// `axis`. `normal` is the normal before the first step. Velocities are taken at the middle of the
/// step.
Vector turned(const Vector &force, const Vector &normal, const Vector &axis, double angle, int k)
{
  const Vector now = rotated(normal, axis, angle * k),
               middle = rotated(normal, axis, angle * (k - 0.5));
  const ContactTurn<double> turn{across(now, angle * cross(axis, middle)), angle * dot(axis, now)};
  return turned_by(force, now, turn, true);
}

/// Rotates a contact rigidly by `angle` about `axis` in `steps` steps. Returns the relative error
/// of the tangential force at the end.
double error_of_turn(const Vector &axis, const Vector &normal, const Vector &force, double angle,
                     int steps)
{
  const double dt = 1.0 / steps;
  Vector h = force;
  for (int k = 1; k <= steps; ++k) h = turned(h, normal, axis, angle * dt, k);
  return length(h - rotated(force, axis, angle)) / length(force);
}

struct Pair {
  SphereMotion<double> i, j;
  ContactGeometry<double, 3> contact;
};

Pair random_pair(Random &random)
{
  Pair pair;
  pair.i = {random_vector<double>(random, 1.0), random_vector<double>(random, 1.0),
            random.uniform(0.5, 1.0)};
  pair.j = {random_vector<double>(random, 1.0), random_vector<double>(random, 1.0),
            random.uniform(0.5, 1.0)};
  const double sum = pair.i.radius + pair.j.radius;
  pair.contact = contact_geometry<double>(
      (random.uniform(0.97, 0.999) * sum) * unit(random_vector<double>(random, 1.0)), sum);
  return pair;
}

Pair seen_from_partner(const Pair &pair)
{
  return {pair.j, pair.i,
          contact_geometry<double>(-1.0 * pair.contact.branch, pair.i.radius + pair.j.radius)};
}

}    // namespace

TEST(TurnedForce, FollowsARigidRotationAboutAnyAxis)
{
  Random random(1);
  for (int sample = 0; sample < 20; ++sample) {
    const Vector axis = unit(random_vector<double>(random, 1.0)),
                 normal = unit(random_vector<double>(random, 1.0));
    const Vector force = across(normal, random_vector<double>(random, 1.0));

    const double coarse = error_of_turn(axis, normal, force, 2.0 * PI, 2000),
                 fine = error_of_turn(axis, normal, force, 2.0 * PI, 4000);

    // The rotation is a whole turn in steps of 3.1e-3 rad. The error is the square of this angle,
    // about 1e-5.
    EXPECT_LT(coarse, 2e-5);
    EXPECT_LT(fine, 0.3 * coarse + 1e-12);
  }
}

TEST(TurnedForce, RotatesAboutTheNormalToo)
{
  // The contact does not move, and both grains spin about its normal. The force must rotate with
  // them. A projection onto the tangent plane alone would leave it unchanged.
  const Vector normal{{0.0, 0.0, 1.0}}, force{{1.0, 0.0, 0.0}};

  EXPECT_LT(error_of_turn(normal, normal, force, 0.5 * PI, 1000), 2e-6);
}

TEST(TurnedForce, KeepsItsLength)
{
  Random random(2);
  for (int sample = 0; sample < 20; ++sample) {
    const Vector axis = unit(random_vector<double>(random, 1.0)),
                 normal = unit(random_vector<double>(random, 1.0));
    Vector h = across(normal, random_vector<double>(random, 1.0));
    const double before = length(h);
    const int steps = 10000;
    for (int k = 1; k <= steps; ++k) h = turned(h, normal, axis, 1e-3, k);

    // Tilt and twist together have an error of third order in the angle of a step, 1e-3.
    EXPECT_NEAR(length(h) / before, 1.0, steps * 1e-9);
  }
}

TEST(TurnedForce, IsUnchangedToTheBitForAZeroTimeStep)
{
  Random random(3);
  for (int sample = 0; sample < 50; ++sample) {
    const auto h = random_vector<float>(random, 1.0);
    const auto normal = unit(random_vector<double>(random, 1.0)).as<float>();

    const ContactTurn<float> none{Vec<float, 3>::zero(), 0.0f};
    EXPECT_TRUE(same_bits(h, turned_by(h, normal, none, false)));
  }
}

TEST(TurnedForce, OfZeroIsZero)
{
  const Vec<float, 3> zero = Vec<float, 3>::zero(), normal{{0.6f, 0.0f, 0.8f}};
  const ContactTurn<float> turn{{{0.08f, 0.1f, -0.06f}}, 0.2f};
  const auto turned = turned_by(zero, normal, turn, true);

  for (int a = 0; a < 3; ++a) EXPECT_EQ(turned[a], 0.0f);
}

TEST(TurnedForce, HasTheSameBitsForBothGrains)
{
  Random random(4);
  for (int sample = 0; sample < 200; ++sample) {
    const auto h = random_vector<float>(random, 1.0), tilt = random_vector<float>(random, 0.1);
    const auto normal = unit(random_vector<double>(random, 1.0)).as<float>();
    const float twist = static_cast<float>(random.uniform(-0.1, 0.1));

    EXPECT_TRUE(opposite_bits(turned_by(h, normal, {tilt, twist}, true),
                              turned_by(-1.0f * h, -1.0f * normal, {-1.0f * tilt, -twist}, true)));
  }
}

TEST(SphereContact, HasNoSlipInARigidRotation)
{
  Random random(5);
  for (int sample = 0; sample < 100; ++sample) {
    Pair pair = random_pair(random);
    const Vector w = random_vector<double>(random, 1.0);
    // Grains and mean field rotate with the same spin. The peculiar velocities are zero.
    const Tensor<double, 3> turning{{0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0}};
    pair.i.velocity = pair.j.velocity = Vector::zero();
    pair.i.spin = pair.j.spin = w;

    const auto moving =
        SphereContact<double>::of<false>(pair.contact, pair.i, pair.j, turning, 0.5, 0.0);

    EXPECT_LT(length(moving.tangential_velocity), 1e-15);
    EXPECT_NEAR(moving.normal_velocity, 0.0, 1e-15);
    const double dt = 1e-3;
    const auto turn =
        SphereContact<double>::of<false>(pair.contact, pair.i, pair.j, turning, 0.5, dt).turn;
    EXPECT_LT(length(turn.tilt - dt * cross(w, pair.contact.normal)), 1e-15 * dt);
    EXPECT_NEAR(turn.twist, dt * dot(w, pair.contact.normal), 1e-15 * dt);

    // The lever arms of LAMMPS are the whole radii. With these arms the surfaces have a relative
    // velocity.
    const auto lammps =
        SphereContact<double>::of<true>(pair.contact, pair.i, pair.j, turning, 0.0, 0.0);
    const double sideways = length(cross(w, pair.contact.normal));
    EXPECT_NEAR(length(lammps.tangential_velocity), pair.contact.overlap * sideways, 1e-14);
  }
}

TEST(SphereContact, VelocityIsThatOfTheTwoSurfaces)
{
  Random random(6);
  for (int sample = 0; sample < 100; ++sample) {
    const Pair pair = random_pair(random);
    const Tensor<double, 3> still = Tensor<double, 3>::zero();
    const auto moving =
        SphereContact<double>::of<false>(pair.contact, pair.i, pair.j, still, 0.5, 0.0);

    // The velocity of a surface is c + w x a, with the velocity c and spin w of the grain and the
    // vector a from its centre to the contact point.
    const Vector &n = pair.contact.normal;
    const Vector surface_i = pair.i.velocity + cross(pair.i.spin, moving.arm_i * n),
                 surface_j = pair.j.velocity + cross(pair.j.spin, -moving.arm_j * n);
    const Vector relative = surface_j - surface_i;
    EXPECT_NEAR(moving.normal_velocity, dot(relative, n), 1e-14);
    EXPECT_LT(length(moving.tangential_velocity - across(n, relative)), 1e-14);
  }
}

TEST(SphereContact, HasTheSameBitsForBothGrains)
{
  Random random(7);
  for (int sample = 0; sample < 100; ++sample) {
    const Pair pair = random_pair(random), other = seen_from_partner(pair);
    Tensor<double, 3> gradient;
    for (double &x : gradient.component) x = random.uniform(-1.0, 1.0);

    const double dt = 0.01;
    const auto one =
                   SphereContact<double>::of<true>(pair.contact, pair.i, pair.j, gradient, 0.3, dt),
               two = SphereContact<double>::of<true>(other.contact, other.i, other.j, gradient, 0.3,
                                                     dt);

    EXPECT_EQ(one.normal_velocity, two.normal_velocity);
    EXPECT_TRUE(opposite_bits(one.tangential_velocity, two.tangential_velocity));
    EXPECT_TRUE(opposite_bits(one.turn.tilt, two.turn.tilt));
    EXPECT_EQ(one.turn.twist, -two.turn.twist);
    EXPECT_EQ(one.arm_i, two.arm_j);
  }
}

namespace {

constexpr double STIFFNESS = 1e6, FRICTION = 0.5, NORMAL_FORCE = 20.0, DT = 1e-4;
constexpr double LIMIT = FRICTION * NORMAL_FORCE;

template <class Numbers> class VectorSpringOf : public ::testing::Test {
 public:
  using Real = typename Numbers::Real;
  using Spring = typename Numbers::Spring;
  VectorSpring<Real, Spring, false> spring{Real(STIFFNESS), Real(FRICTION), Real(0)};
  VectorSpring<Real, Spring, true> damped{Real(STIFFNESS), Real(FRICTION), Real(50.0)};
};
using Formats = ::testing::Types<FastNumbers, MixedNumbers, DoubleNumbers>;
TYPED_TEST_SUITE(VectorSpringOf, Formats);

/// Returns the velocity along x that changes the spring force by `share` of the limit in one step.
template <class Real> Vec<Real, 3> along_x(double share)
{
  return {{static_cast<Real>(share * LIMIT / (STIFFNESS * DT)), Real(0), Real(0)}};
}

}    // namespace

TYPED_TEST(VectorSpringOf, IsTheSpringOfDisksAlongALine)
{
  using Real = typename TypeParam::Real;
  using Spring = typename TypeParam::Spring;
  const LinearTangential<Real, Spring, false> plane{Real(STIFFNESS), Real(FRICTION), Real(0)};
  Vec<Spring, 3> h = Vec<Spring, 3>::zero();
  Spring g = 0;
  for (const double share : {0.3, 0.5, -0.7, -0.4, 0.1, 0.2}) {
    const auto velocity = along_x<Real>(share);
    const auto vector = this->spring.advance(h, velocity, Real(NORMAL_FORCE), Real(DT));
    const auto number = plane.advance(g, velocity[0], Real(NORMAL_FORCE), Real(DT));

    // In mixed precision the changes of the vector are rounded to single precision.
    EXPECT_NEAR(vector.force[0], number.force, 4 * std::numeric_limits<Real>::epsilon() * LIMIT);
    EXPECT_EQ(vector.force[1], Real(0));
    h = vector.spring;
    g = number.spring;
  }
}

TYPED_TEST(VectorSpringOf, SlidesAlongItsDirectionAtTheLimit)
{
  using Real = typename TypeParam::Real;
  using Spring = typename TypeParam::Spring;
  const Vec<Spring, 3> held{{Spring(0), Spring(0.6 * LIMIT), Spring(0)}};
  const auto slid = this->spring.advance(held, along_x<Real>(3.0), Real(NORMAL_FORCE), Real(DT));

  EXPECT_TRUE(slid.sliding);
  const double epsilon = std::numeric_limits<Real>::epsilon();
  EXPECT_NEAR(length(slid.force.template as<double>()), LIMIT, 8 * epsilon * LIMIT);
  EXPECT_NEAR(slid.force[1] / slid.force[0], 0.2, 4 * epsilon);
  for (int a = 0; a < 3; ++a)    // the slip is parallel to the force
    EXPECT_NEAR(slid.slipped[a] * slid.force[0], slid.slipped[0] * slid.force[a],
                16 * epsilon * LIMIT * LIMIT);
}

TYPED_TEST(VectorSpringOf, SecondEvaluationAtTheLimitHasTheSameBits)
{
  using Real = typename TypeParam::Real;
  Random random(8);
  for (int sample = 0; sample < 1000; ++sample) {
    const auto velocity = random_vector<Real>(random, 5.0 * LIMIT / (STIFFNESS * DT));
    const Real force = static_cast<Real>(random.uniform(0.1, 10.0));
    const auto once =
        this->spring.advance(Vec<typename TypeParam::Spring, 3>::zero(), velocity, force, Real(DT));
    const auto again = this->spring.advance(once.spring, velocity, force, Real(0));

    EXPECT_TRUE(same_bits(once.spring, again.spring));
    EXPECT_TRUE(same_bits(once.force, again.force));
    EXPECT_EQ(once.sliding, again.sliding);
  }
}

TYPED_TEST(VectorSpringOf, DissipatesTheWorkThatItDoesNotStore)
{
  using Real = typename TypeParam::Real;
  using Spring = typename TypeParam::Spring;
  Random random(9);
  Vec<Spring, 3> h = Vec<Spring, 3>::zero();
  double work = 0.0, dissipation = 0.0;
  const int steps = 20000;
  Vec<Real, 3> velocity = Vec<Real, 3>::zero();
  for (int k = 0; k < steps; ++k) {
    // The steps are small, and the direction changes every 500 steps.
    if (k % 500 == 0) velocity = random_vector<Real>(random, 0.01 * LIMIT / (STIFFNESS * DT));
    const auto result = this->spring.advance(h, velocity, Real(NORMAL_FORCE), Real(DT));
    const Vector mean = 0.5 * (h.template as<double>() + result.spring.template as<double>());
    work += DT * dot(mean, velocity.template as<double>());
    dissipation +=
        dot(result.spring.template as<double>(), result.slipped.template as<double>()) / STIFFNESS;
    h = result.spring;
  }

  // The dissipation uses the force at the end of a step instead of the mean force. The error of the
  // dissipation is up to 1 %, since a step changes the force by up to 1 % of the limit.
  EXPECT_GT(dissipation, 10.0 * energy_of_spring(h, this->spring.stiffness));
  EXPECT_NEAR(work, dissipation + energy_of_spring(h, this->spring.stiffness), 0.01 * work);
}

TYPED_TEST(VectorSpringOf, DashpotActsBesideTheSpringUnderTheSameLimit)
{
  using Real = typename TypeParam::Real;
  using Spring = typename TypeParam::Spring;
  const Vec<Spring, 3> zero = Vec<Spring, 3>::zero();
  const auto velocity = along_x<Real>(0.01);
  const auto sticking = this->damped.advance(zero, velocity, Real(NORMAL_FORCE), Real(DT));
  const auto sliding = this->damped.advance(zero, along_x<Real>(3.0), Real(NORMAL_FORCE), Real(DT));

  const double epsilon = std::numeric_limits<Real>::epsilon();
  EXPECT_NEAR(sticking.force[0], STIFFNESS * DT * velocity[0] + 50.0 * velocity[0], 4 * epsilon);
  EXPECT_NEAR(sticking.spring[0], STIFFNESS * DT * velocity[0], 4 * epsilon);
  EXPECT_NEAR(sliding.force[0], LIMIT, 4 * epsilon * LIMIT);
  // The stored spring force is the limit minus the force of the dashpot.
  EXPECT_NEAR(sliding.spring[0], LIMIT - 50.0 * along_x<Real>(3.0)[0], 64 * epsilon * LIMIT);
}

// ---- laws of spheres ----

namespace {

constexpr double RADIUS = 0.005;    // [m]

Material sphere_material()
{
  Material material;
  material.normal_stiffness = 1e6;
  material.tangential_stiffness = 0.8e6;
  material.friction = 0.5;
  material.hertz_stiffness = 1e9;
  material.mindlin_stiffness = 0.8e9;
  material.mindlin_displacement = 1.0;
  material.surface_energy = 20.0;
  material.rolling_stiffness = 4e5;
  material.rolling_friction = 0.1;
  material.twisting_stiffness = 2.0;
  material.twisting_friction = 2e-4;
  material.density = 2650.0;
  return material;
}

template <class Law> Law law_of(const Material &material)
{
  typename Law::Constants constants;
  constants.set(material, LawUnits::same(), 0.5);
  Law law;
  law.take(constants);
  return law;
}

using Springs = SphereSprings<DoubleNumbers>;
using RollingSpheres = SphereRollingSprings<DoubleNumbers>;
using Hertz = SphereHertzMindlin<DoubleNumbers>;

const Tensor<double, 3> STILL = Tensor<double, 3>::zero();

/// Two equal spheres at rest along x.
struct Equal {
  SphereMotion<double> i{Vector::zero(), Vector::zero(), RADIUS}, j = i;
  Vector branch;

  explicit Equal(double overlap) : branch{{2.0 * RADIUS - overlap, 0.0, 0.0}} {}
  ContactGeometry<double, 3> contact() const
  {
    return contact_geometry<double>(branch, 2.0 * RADIUS);
  }
};

template <class Law> class SphereLaw : public ::testing::Test {
};
using SphereLaws =
    ::testing::Types<SphereSprings<DoubleNumbers>, SphereRollingSprings<DoubleNumbers>,
                     SphereHertzMindlin<DoubleNumbers>, SphereRollingHertz<DoubleNumbers>,
                     SphereDmtAdhesion<DoubleNumbers>, SphereRollingDmt<DoubleNumbers>>;
TYPED_TEST_SUITE(SphereLaw, SphereLaws);

}    // namespace

TYPED_TEST(SphereLaw, HistoriesRotateWithARigidRotationAboutAnyAxis)
{
  // The first rotation is about the normal, the others are about random axes.
  const auto law = law_of<TypeParam>(sphere_material());
  Random random(10);
  for (int sample = 0; sample < 12; ++sample) {
    Equal pair(1e-4);
    const Vector normal = unit(random_vector<double>(random, 1.0));
    const Vector axis = sample == 0 ? normal : unit(random_vector<double>(random, 1.0));
    pair.branch = (2.0 * RADIUS - 1e-4) * normal;
    // These velocities load all springs, but less than up to their limits.
    pair.j.velocity = across(normal, random_vector<double>(random, 1.0));
    pair.j.spin = random_vector<double>(random, 50.0);
    auto before = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-6);

    const int steps = 4000;
    const double dt = 1e-5, rate = 2.0 / (steps * dt);    // an angle of 2
    const Vector w = rate * axis;
    const Tensor<double, 3> turning{{0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0}};
    pair.i.spin = pair.j.spin = w;
    pair.i.velocity = pair.j.velocity = Vector::zero();
    auto after = before;
    for (int k = 1; k <= steps; ++k) {
      // As in the engine, the relative velocity belongs to the middle of the step.
      pair.branch = (2.0 * RADIUS - 1e-4) * rotated(normal, axis, 2.0 * k / steps);
      const Vector middle = (2.0 * RADIUS - 1e-4) * rotated(normal, axis, 2.0 * (k - 0.5) / steps);
      pair.j.velocity = cross(w, middle) - turning * pair.branch;
      after = evaluate(law, pair.contact(), pair.i, pair.j, turning, after.history(), dt);
    }

    // The error of the rotation is of second order in the angle of a step. In addition, each step
    // has a slip of third order in this angle, which loads the stiff spring.
    const double error = 1e-6, angle = 2.0 / steps;
    const double slip = 0.8e6 * 2.0 * RADIUS * steps * angle * angle * angle / 8.0;
    EXPECT_LT(length(after.spring - rotated(before.spring, axis, 2.0)),
              error * length(before.spring) + 1.1 * slip);
    EXPECT_GT(length(before.spring), 100.0 * slip);
    if constexpr (TypeParam::has_rolling) {
      const auto &was = before.turned.history, &is = after.turned.history;
      EXPECT_GT(length(was.rolling), 0.0);
      EXPECT_LT(length(is.rolling - rotated(was.rolling, axis, 2.0)), error * length(was.rolling));
      EXPECT_EQ(is.twisting, was.twisting);
    }
  }
}

TYPED_TEST(SphereLaw, RotatingAnRveRotatesTheHistoriesOfPairs)
{
  const auto law = law_of<TypeParam>(sphere_material());
  Random random(11);
  const Vector axis = unit(random_vector<double>(random, 1.0));
  Tensor<double, 3> rotation;
  for (int b = 0; b < 3; ++b) {
    Vector e = Vector::zero();
    e[b] = 1.0;
    const Vector column = rotated(e, axis, 0.7);
    for (int a = 0; a < 3; ++a) rotation(a, b) = column[a];
  }
  Pair pair = random_pair(random);
  for (SphereMotion<double> *grain : {&pair.i, &pair.j}) grain->spin = 30.0 * grain->spin;
  const auto here = evaluate(law, pair.contact, pair.i, pair.j, STILL, {}, 1e-6);
  Pair turned = pair;
  for (SphereMotion<double> *grain : {&turned.i, &turned.j}) {
    grain->velocity = rotation * grain->velocity;
    grain->spin = rotation * grain->spin;
  }
  turned.contact =
      contact_geometry<double>(rotation * pair.contact.branch, pair.i.radius + pair.j.radius);
  const auto there = evaluate(law, turned.contact, turned.i, turned.j, STILL, {}, 1e-6);

  const Vector expected = rotation * here.force;
  EXPECT_LT(length(there.force - expected), 1e-12 * length(expected));
  const Vector torque = rotation * here.torque_i;
  EXPECT_LT(length(there.torque_i - torque), 1e-12 * length(torque));
  const auto history = TypeParam::turned(here.history(), rotation), other = there.history();
  constexpr std::size_t COUNT = sizeof(history) / sizeof(double);
  double a[COUNT], b[COUNT], largest = 0.0;
  std::memcpy(a, &history, sizeof(history));
  std::memcpy(b, &other, sizeof(other));
  for (const double x : a) largest = std::fmax(largest, std::fabs(x));
  for (std::size_t k = 0; k < COUNT; ++k) EXPECT_NEAR(a[k], b[k], 1e-12 * largest);
}

TEST(SphereRolling, ResistsRollingAboutAxesAcrossTheNormalOnly)
{
  const auto law = law_of<RollingSpheres>(sphere_material());
  Equal pair(1e-5);
  const double dt = 1e-6, reduced_radius = 0.5 * RADIUS;
  pair.j.spin = {{0.0, 3.0, 4.0}};
  const auto rolled = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
  // The moment is R^2 k_r times the relative rotation. Its sign is such that it drives the first
  // sphere.
  const double moment = reduced_radius * reduced_radius * 4e5 * dt;
  EXPECT_NEAR(rolled.moment[0], 0.0, 1e-12 * moment);
  EXPECT_NEAR(rolled.moment[1], 3.0 * moment, 1e-12 * moment);
  EXPECT_NEAR(rolled.moment[2], 4.0 * moment, 1e-12 * moment);
  EXPECT_EQ(rolled.history.twisting, 0.0);

  pair.j.spin = {{5.0, 0.0, 0.0}};
  const auto twisted = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
  EXPECT_NEAR(twisted.moment[0], 2.0 * 5.0 * dt, 1e-12 * 2.0 * dt);
  EXPECT_EQ(length(twisted.history.rolling), 0.0);
}

TEST(SphereRolling, MomentsEndAtTheirLimits)
{
  const auto law = law_of<RollingSpheres>(sphere_material());
  Equal pair(1e-5);
  const double force = 1e6 * 1e-5;
  pair.j.spin = {{1e5, 3e5, 4e5}};
  const auto turned = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-3).turned;

  const double rolling = 0.5 * RADIUS * 0.1 * force;
  EXPECT_NEAR(turned.moment[0], 2e-4 * force, 1e-12 * force);
  EXPECT_NEAR(turned.moment[1], 0.6 * rolling, 1e-12 * rolling);
  EXPECT_NEAR(turned.moment[2], 0.8 * rolling, 1e-12 * rolling);
}

TEST(SphereRolling, ReducesASpinAtItsLimit)
{
  // Two spheres without friction are pressed against each other and spin in opposite directions.
  // They roll about an axis perpendicular to the normal, or twist about the normal. Both spins
  // decrease by M t / I, with the limiting moment M and the inertia I.
  Material material = sphere_material();
  material.friction = 0.0;
  const auto law = law_of<RollingSpheres>(material);
  const double force = 1e6 * 1e-5, inertia = 0.4 * 2650.0 * 4.0 / 3.0 * PI * std::pow(RADIUS, 5);
  for (const bool twists : {false, true}) {
    Equal pair(1e-5);
    const Vector axis{{twists ? 1.0 : 0.0, twists ? 0.0 : 0.6, twists ? 0.0 : 0.8}};
    const double limit = twists ? 2e-4 * force : 0.5 * RADIUS * 0.1 * force;
    const double begin = 300.0, dt = 1e-8, duration = 0.5 * begin * inertia / limit;
    pair.i.spin = begin * axis;
    pair.j.spin = -begin * axis;
    typename RollingSpheres::History history{};
    const int steps = static_cast<int>(duration / dt);
    for (int k = 0; k < steps; ++k) {
      const auto answer = evaluate(law, pair.contact(), pair.i, pair.j, STILL, history, dt);
      history = answer.history();
      pair.i.spin = pair.i.spin + (dt / inertia) * answer.torque_i;
      pair.j.spin = pair.j.spin + (dt / inertia) * answer.torque_j;
    }
    // The moment grows to its limit in a short time. The loss of spin is delayed by half of this
    // time.
    EXPECT_LT(length(pair.i.spin - (0.5 * begin) * axis), 0.01 * begin);
    EXPECT_LT(length(pair.i.spin + pair.j.spin), 1e-12 * begin);
  }
}

TEST(SphereRolling, DashpotsActBesideTheSpringsUpToTheLimits)
{
  Material material = sphere_material();
  material.rolling_viscosity = 5.0;
  material.twisting_viscosity = 1e-5;
  const auto law = law_of<RollingSpheres>(material);
  Equal pair(1e-5);
  const double force = 1e6 * 1e-5, dt = 1e-6, reduced_radius = 0.5 * RADIUS;
  pair.j.spin = {{50.0, 3.0, 4.0}};
  const auto below = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
  const double rolling = reduced_radius * reduced_radius * (4e5 * dt + 5.0);
  EXPECT_NEAR(below.moment[0], 50.0 * (2.0 * dt + 1e-5), 1e-12 * force);
  EXPECT_NEAR(below.moment[1], 3.0 * rolling, 1e-12 * rolling);
  EXPECT_NEAR(below.moment[2], 4.0 * rolling, 1e-12 * rolling);
  // The history does not contain the moment of the dashpot.
  EXPECT_NEAR(below.history.twisting, 50.0 * 2.0 * dt, 1e-15);
  EXPECT_NEAR(length(below.history.rolling), reduced_radius * 5.0 * 4e5 * dt, 1e-12);

  pair.j.spin = {{1e3, 300.0, 400.0}};
  const auto beyond = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
  const double limit = reduced_radius * 0.1 * force;
  EXPECT_NEAR(beyond.moment[0], 2e-4 * force, 1e-12 * force);
  EXPECT_NEAR(beyond.moment[1], 0.6 * limit, 1e-12 * limit);
  EXPECT_NEAR(beyond.moment[2], 0.8 * limit, 1e-12 * limit);
  // The stored spring moment is the limit minus the moment of the dashpot.
  EXPECT_NEAR(beyond.history.twisting, 2e-4 * force - 1e-5 * 1e3, 1e-12 * force);
}

TEST(SphereTwisting, MarshallLimitIsTheFrictionOfTheContactArea)
{
  Material material = sphere_material();
  material.twisting_stiffness = material.twisting_friction = 0.0;
  material.twisting_marshall = 1.0;
  material.tangential_viscosity = 40.0;
  const double reduced_radius = 0.5 * RADIUS, mu = 0.5, dt = 1e-6, spin = 20.0;
  const auto expect = [&](const auto &law, double overlap, double kt, double gamma_t,
                          double force) {
    Equal pair(overlap);
    pair.j.spin = {{spin, 0.0, 0.0}};
    const double area = reduced_radius * pair.contact().overlap;    // a^2
    const auto below = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
    const double moment = 0.5 * area * (kt * dt + gamma_t) * spin;
    EXPECT_NEAR(below.moment[0], moment, 1e-9 * moment);
    EXPECT_EQ(below.moment[1], 0.0);

    pair.j.spin = {{-1e9, 0.0, 0.0}};
    const auto beyond = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, dt).turned;
    const double limit = 2.0 / 3.0 * mu * std::sqrt(area) * force;
    EXPECT_NEAR(beyond.moment[0], -limit, 1e-9 * limit);
  };
  for (const double overlap : {1e-6, 1e-4}) {
    expect(law_of<RollingSpheres>(material), overlap, 0.8e6, 40.0, 1e6 * overlap);
    const double a = std::sqrt(reduced_radius * overlap);
    expect(law_of<SphereRollingHertz<DoubleNumbers>>(material), overlap, 0.8e9 * a, 0.0,
           1e9 * a * overlap);
    expect(law_of<SphereRollingDmt<DoubleNumbers>>(material), overlap, 0.8e9 * a, 0.0,
           1e9 * a * overlap + 4.0 * PI * 20.0 * reduced_radius);
  }
}

TEST(SphereTwisting, MarshallTwistingKeepsTheAngleUnderCompression)
{
  Material material = sphere_material();
  material.twisting_stiffness = material.twisting_friction = 0.0;
  material.twisting_marshall = 1.0;
  const double angle = 1e-4;
  const auto moment_of = [&](const auto &law, double first, double last) {
    Equal pair(first);
    pair.j.spin = {{angle / 1e-6, 0.0, 0.0}};
    const auto loaded = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-6);
    Equal pressed(last);
    return evaluate(law, pressed.contact(), pressed.i, pressed.j, STILL, loaded.history(), 1e-6)
        .turned.moment[0];
  };
  const auto springs = law_of<RollingSpheres>(material);
  // The twisting stiffness is k_t R d/2 for linear springs and k_t a^3/2 for Hertz' contact, with
  // the reduced radius R, the overlap d and the contact radius a.
  const double linear = 0.5 * 0.8e6 * 0.5 * RADIUS * 4e-5 * angle;
  EXPECT_NEAR(moment_of(springs, 2e-5, 4e-5), linear, 1e-9 * linear);
  EXPECT_NEAR(moment_of(springs, 8e-5, 4e-5), linear, 1e-9 * linear);
  const auto hertz = law_of<SphereRollingHertz<DoubleNumbers>>(material);
  const double of_hertz = 0.5 * 0.8e9 * std::pow(0.5 * RADIUS * 4e-5, 1.5) * angle;
  EXPECT_NEAR(moment_of(hertz, 2e-5, 4e-5), of_hertz, 1e-9 * of_hertz);
  EXPECT_NEAR(moment_of(hertz, 8e-5, 4e-5), of_hertz, 1e-9 * of_hertz);
}

TEST(SphereRolling, IsSymmetricInBothGrains)
{
  // The relative spin and the normal both change sign.
  const RollingSpheres::History history{{{1.0, 2.0, 3.0}}, {{{4.0, 5.0, 6.0}}, 7.0}};
  const auto other = RollingSpheres::seen_from_partner(history);

  EXPECT_TRUE(opposite_bits(history.contact, other.contact));
  EXPECT_TRUE(same_bits(history.turning, other.turning));
}

TEST(SphereHertz, PressesWithThePowerThreeHalvesOfTheOverlap)
{
  const auto law = law_of<Hertz>(sphere_material());
  for (const double overlap : {1e-7, 1e-5, 1e-4}) {
    Equal pair(overlap);
    const double d = pair.contact().overlap;
    const auto pressed = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-6);
    const double force = 1e9 * std::sqrt(0.5 * RADIUS) * std::pow(d, 1.5);
    EXPECT_NEAR(pressed.normal_force, force, 1e-13 * force);
    EXPECT_NEAR(pressed.force[0], -force, 1e-13 * force);
    EXPECT_NEAR(law.elastic_energy(pair.contact(), pressed), 0.4 * force * d,
                1e-13 * 0.4 * force * d);
  }
}

TEST(SphereHertz, TangentialForceFollowsTheVariant)
{
  // The contact is loaded tangentially. Then the normal load either doubles or halves the contact
  // radius.
  const double deep = 1e-4, loaded[] = {0.3, 0.4};
  const double growth = 2.0, shrinkage = 0.5;    // ratios of contact radii
  const struct {
    double variant, grown, shrunk;
  } cases[] = {{0.0, 1.0, 1.0},    // mindlin/force
               {1.0, growth, shrinkage},
               {2.0, 1.0, shrinkage},                    // mindlin_rescale/force
               {3.0, growth, shrinkage * shrinkage}};    // mindlin_rescale
  for (const auto &one : cases) {
    Material material = sphere_material();
    material.mindlin_displacement = one.variant;
    material.friction = 1e3;
    const auto law = law_of<Hertz>(material);
    Equal pair(deep);
    pair.j.velocity = {{0.0, loaded[0], loaded[1]}};
    const auto held = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-6);
    pair.j.velocity = Vector::zero();
    const auto kept = [&](double overlap) {
      Equal there(overlap);
      const auto force =
          evaluate(law, there.contact(), there.i, there.j, STILL, held.history(), 1e-6).tangential;
      EXPECT_NEAR(force[1] * loaded[1], force[2] * loaded[0], 1e-12 * length(force));
      return length(force) / length(held.tangential);
    };
    EXPECT_NEAR(kept(deep * growth * growth), one.grown, 1e-10) << one.variant;
    EXPECT_NEAR(kept(deep * shrinkage * shrinkage), one.shrunk, 1e-10) << one.variant;
  }
}

TEST(SphereDmt, PullOffForceIsFourPiTimesSurfaceEnergyAndReducedRadius)
{
  const Material material = sphere_material();
  const auto law = law_of<SphereDmtAdhesion<DoubleNumbers>>(material);
  const double pull_off = 4.0 * PI * 20.0 * 0.5 * RADIUS;
  double strongest = 0.0;
  for (double overlap = 1e-4; overlap > 1e-13; overlap *= 0.5) {
    Equal pair(overlap);
    const auto force = evaluate(law, pair.contact(), pair.i, pair.j, STILL, {}, 1e-6);
    strongest = std::fmin(strongest, force.normal_force);
    // The friction limit is proportional to the sum of spring force and attraction.
    const double spring = 1e9 * std::sqrt(0.5 * RADIUS) * std::pow(pair.contact().overlap, 1.5);
    EXPECT_NEAR(force.limiting_force, spring + pull_off, 1e-12 * (spring + pull_off));
  }
  EXPECT_NEAR(strongest, -pull_off, 1e-8 * pull_off);
  // At this overlap, spring force and attraction balance.
  const double rest = std::pow(pull_off / (1e9 * std::sqrt(0.5 * RADIUS)), 2.0 / 3.0);
  EXPECT_NEAR(law.spring_force({rest, RADIUS, RADIUS}), 0.0, 1e-12 * pull_off);
}
