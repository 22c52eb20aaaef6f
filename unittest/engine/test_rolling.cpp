// SPDX-License-Identifier: GPL-2.0-only
// Rolling resistance in the whole engine, with every contact law. Rings of disks are compared with
// closed forms. Other tests shear packings.

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/stability.h"
#include "support/messages.h"
#include "support/packings.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

/// Cases: linear springs in all formats, and the other laws in the formats that differ most.
struct Case {
  ContactLaw law;
  Format format;
};
constexpr Case CASES[] = {
    {ContactLaw::Linear, Format::Double}, {ContactLaw::Linear, Format::Mixed},
    {ContactLaw::Linear, Format::Fast},   {ContactLaw::Linear, Format::Single},
    {ContactLaw::Hertz, Format::Mixed},   {ContactLaw::Hertz, Format::Fast},
    {ContactLaw::Dmt, Format::Double},    {ContactLaw::Dmt, Format::Fast}};

/// Returns the material with another contact law. At the given contact radius [length], normal
/// force and tangential stiffness are those of the linear springs. DMT adds adhesion.
Material by_law(ContactLaw law, Material material, double contact_radius)
{
  if (law == ContactLaw::Linear) return material;
  material.law = law;
  material.hertz_stiffness = material.normal_stiffness / contact_radius;
  material.mindlin_stiffness = material.tangential_stiffness / contact_radius;
  material.mindlin_displacement = 1.0;
  material.normal_stiffness = material.tangential_stiffness = 0.0;
  if (law == ContactLaw::Dmt) material.surface_energy = 200.0;
  return material;
}

// ---- a ring ----
// Four disks a, b, a, b are above each other in a periodic cell and form a closed column. a and b
// have different radii. Each disk is pressed between two disks of the other kind, and the forces
// balance. Without friction only the spins w_a and w_b change. The relative spin W = w_b - w_a is
// the same in all contacts. With two contacts per disk, the rolling force f obeys
//   f' = k_r R W,    I_a w_a' = 2 R f,    I_b w_b' = -2 R f,    |f| <= mu_r f_n.
// k_r is the rolling stiffness, R the reduced radius, I the moments of inertia and mu_r the rolling
// friction. f_n is the spring force. With adhesion the attraction is added to it.

constexpr double RADIUS_A = 0.005, RADIUS_B = 0.003, OVERLAP = 1e-5;
constexpr double REDUCED_RADIUS = RADIUS_A * RADIUS_B / (RADIUS_A + RADIUS_B);

constexpr double SPRING_FORCE = 1e6 * OVERLAP;    // k_n of the paper

Material rolling_material(double rolling_friction, double rolling_stiffness = 1e6,
                          ContactLaw law = ContactLaw::Linear)
{
  Material material = by_law(law, paper_material(), std::sqrt(REDUCED_RADIUS * OVERLAP));
  material.friction = 0.0;
  material.local_damping = 0.0;
  material.rolling_stiffness = rolling_stiffness;
  material.rolling_friction = rolling_friction;
  return material;
}

struct Ring {
  RveState state;

  explicit Ring(const Material &material)
  {
    const double distance = RADIUS_A + RADIUS_B - OVERLAP;
    std::vector<double> xy;
    for (int i = 0; i < 4; ++i) {
      xy.push_back(0.04);
      xy.push_back((i + 0.5) * distance);
    }
    state = state_of(material, Tensor2{{0.08, 0.0, 0.0, 4.0 * distance}},
                     {RADIUS_A, RADIUS_B, RADIUS_A, RADIUS_B}, xy);
  }

  void turn(double spin_a, double spin_b) { state.spin = {spin_a, spin_b, spin_a, spin_b}; }

  /// Sets the rolling force of all contacts. Disks a own some of the pairs, and disks b own the
  /// others.
  void load(double force)
  {
    state.pairs = {
        {0, 1, 0.0, force}, {1, 2, 0.0, -force}, {2, 3, 0.0, force}, {3, 0, 0.0, -force}};
  }

  double mass(double radius) const { return state.material.density * M_PI * radius * radius; }
  double inertia_a() const { return 0.5 * mass(RADIUS_A) * RADIUS_A * RADIUS_A; }
  double inertia_b() const { return 0.5 * mass(RADIUS_B) * RADIUS_B * RADIUS_B; }
  /// Returns the inertia I of the relative spin W: 1/I = 1/I_a + 1/I_b.
  double inertia() const { return 1.0 / (1.0 / inertia_a() + 1.0 / inertia_b()); }
  double limit() const
  {
    const double attraction = 4.0 * kPi * state.material.surface_energy * REDUCED_RADIUS;
    return state.material.rolling_friction * (SPRING_FORCE + attraction);
  }
  double frequency() const
  {
    return REDUCED_RADIUS * std::sqrt(2.0 * state.material.rolling_stiffness / inertia());
  }
  /// Returns the amplitude of W in an oscillation whose rolling force just reaches its limit.
  double swing_at_limit() const
  {
    return frequency() * limit() / (state.material.rolling_stiffness * REDUCED_RADIUS);
  }
};

double relative_spin(const RveState &state)
{
  return state.spin[1] - state.spin[0];
}

/// Returns the relative error of the normal force in a format, for overlaps of 1e-5 m in a cell of
/// 0.08 m.
double force_error(Format format)
{
  switch (format) {
    case Format::Double:
      return 1e-11;
    case Format::Mixed:
      return 2e-6;    // the rest is fp32
    case Format::Fast:
      return 1e-4;
    default:
      return 3e-2;
  }
}

// ---- packings ----

RveState plain_packing(ContactLaw law)
{
  RveState state = paper_packing();
  constexpr double CONTACT_RADIUS = 5e-4;    // mean contact radius [m]
  state.material = by_law(law, state.material, CONTACT_RADIUS);
  return state;
}

RveState rolling_packing(double rolling_friction = 0.3, double rolling_stiffness = 5e5,
                         ContactLaw law = ContactLaw::Linear)
{
  RveState state = plain_packing(law);
  state.material.rolling_stiffness = rolling_stiffness;
  state.material.rolling_friction = rolling_friction;
  return state;
}

constexpr double DT = 5e-5;
const Tensor2 SHEAR_AND_COMPRESSION = {{0.02, 0.6, 0.0, -0.15}};

/// Strains the packing by a few per cent. Lists are rebuilt, contacts slide, and new contacts form.
const Result &work_out(RveRig &rig, int calls = 20)
{
  return rig.strain(SHEAR_AND_COMPRESSION, DT, 50, calls);
}

/// Shears the packing to 8 %. Returns the mean stress ratio q/p from 2 % of strain on.
double stress_ratio(const Material &material)
{
  RveState state = paper_packing();
  state.material = material;
  RveRig rig(state, cpu_options(Format::Mixed));
  const double rate = 0.5, dt = 0.8 * stable_time_step(state);
  double sum = 0.0;
  int count = 0;
  Drive drive;
  drive.dt = dt;
  drive.substeps = 200;
  drive.velocity_gradient = gradient(0, 1, rate);
  drive.controlled[0][0] = drive.controlled[1][1] = true;
  drive.stress_goal = -1e5 * Tensor2::identity();
  drive.servo_gain = 1.0 / 47.952;
  for (double strain = 0.0; strain < 0.08; strain += rate * dt * drive.substeps) {
    const Result &result = rig.advance(drive);
    EXPECT_EQ(result.status, status::Ok);
    if (strain < 0.02) continue;
    sum += result.deviatoric_stress() / result.mean_stress();
    ++count;
  }
  return sum / count;
}

class Rolling : public ::testing::TestWithParam<Case> {
 protected:
  static ContactLaw law() { return GetParam().law; }
  static Format format() { return GetParam().format; }
  static Options options(int threads = 1)
  {
    Options options = cpu_options(format(), threads);
    options.contacts.law = law();
    return options;
  }
  static Ring ring(double rolling_friction)
  {
    return Ring(rolling_material(rolling_friction, 1e6, law()));
  }
  static RveState plain() { return plain_packing(law()); }
  static RveState packing(double rolling_friction = 0.3, double rolling_stiffness = 5e5)
  {
    return rolling_packing(rolling_friction, rolling_stiffness, law());
  }
};
INSTANTIATE_TEST_SUITE_P(LawsAndFormats, Rolling, ::testing::ValuesIn(CASES), [](const auto &info) {
  return word_of(info.param.law) + ("_" + to_string(info.param.format));
});

}    // namespace

// ---- closed forms ----

TEST_P(Rolling, AtTheLimitSpinsDecayLinearly)
{
  Ring ring = Rolling::ring(0.2);
  ring.turn(-300.0, 200.0);
  ring.load(ring.limit());    // the contacts have rolled up to the limit
  RveRig rig(ring.state, options());
  const double dt = 1e-5;
  const int steps = 400;
  const double turned = 2.0 * REDUCED_RADIUS * ring.limit() * steps * dt;    // angular momentum

  rig.strain(Tensor2::zero(), dt, steps);

  const RveState after = rig.state();
  const double error = 2.0 * force_error(format());
  // rounding error of each kick
  const double epsilon = format() == Format::Double ? 0x1p-53 : 0x1p-24;
  for (int i = 0; i < 4; i += 2) {
    EXPECT_NEAR(after.spin[i], -300.0 + turned / ring.inertia_a(),
                error * turned / ring.inertia_a() + steps * epsilon * 300.0);
    EXPECT_NEAR(after.spin[i + 1], 200.0 - turned / ring.inertia_b(),
                error * turned / ring.inertia_b() + steps * epsilon * 200.0);
  }
  EXPECT_GT(relative_spin(after), 0.0);
  EXPECT_LT(relative_spin(after), 0.9 * 500.0);
  for (const Pair &pair : after.pairs)
    EXPECT_NEAR(std::fabs(pair.rolling_force), ring.limit(), 2.0 * error * ring.limit());
}

// The leapfrog scheme gives an oscillator of angular frequency omega the velocity w_k = w_0 cos((k
// + 1/2) theta) / cos(theta/2) in step k, with sin(theta/2) = omega dt/2.
TEST_P(Rolling, BelowTheLimitSpinsOscillateWithTheClosedFormFrequency)
{
  Ring ring = Rolling::ring(1.0);
  const double w = 0.5 * ring.swing_at_limit();
  ring.turn(-0.3 * w, 0.7 * w);
  RveRig rig(ring.state, options());
  const double dt = 0.2 / ring.frequency(), theta = 2.0 * std::asin(0.1);

  for (int k = 1; k <= 300; ++k) {
    rig.strain(Tensor2::zero(), dt, 1);
    const double expected = w * std::cos((k + 0.5) * theta) / std::cos(0.5 * theta);
    // In fp32, roundings of moments and spins change the phase by 300 epsilons.
    ASSERT_NEAR(relative_spin(rig.state()), expected,
                (format() == Format::Double ? 1e-9 : 1e-4) * w)
        << "step " << k;
  }
}

// When sliding ends, the rolling spring is at its limit, f = mu_r f_n. The spring then accelerates
// the disks in the opposite direction, and W oscillates about zero with the amplitude omega mu_r
// f_n / (k_r R).
TEST(RollingRing, ComesToRestAndOscillatesWithTheEnergyOfItsSprings)
{
  Ring ring(rolling_material(0.2));
  const double amplitude = ring.swing_at_limit();
  ring.turn(-2.0 * amplitude, 3.0 * amplitude);
  RveRig rig(ring.state);
  const double dt = 0.02 / ring.frequency();
  const double deceleration = 2.0 * REDUCED_RADIUS * ring.limit() / ring.inertia();
  const int until_rest = static_cast<int>(5.0 * amplitude / (deceleration * dt));

  rig.strain(Tensor2::zero(), dt, until_rest + 200);
  double largest = 0.0;
  for (int k = 0; k < 1000; ++k) {    // three periods
    rig.strain(Tensor2::zero(), dt, 1);
    largest = std::max(largest, std::fabs(relative_spin(rig.state())));
  }

  // The error results from the step within which sliding ends.
  EXPECT_NEAR(largest, amplitude, 0.02 * amplitude);
}

TEST(RollingRing, AngularMomentumOfTheSpinsIsConserved)
{
  Ring ring(rolling_material(0.2));
  ring.turn(-300.0, 350.0);
  RveRig rig(ring.state);
  const auto momentum = [&](const RveState &state) {
    return ring.inertia_a() * (state.spin[0] + state.spin[2]) +
        ring.inertia_b() * (state.spin[1] + state.spin[3]);
  };
  const double size = 2.0 * 300.0 * ring.inertia_a(), before = momentum(ring.state);

  for (int call = 0; call < 20; ++call) {
    rig.strain(Tensor2::zero(), 1e-6, 100);
    // Both disks of a contact get the same integer as moment, with opposite signs. Only the kicks
    // are rounded. The rounding error is the same in all steps with the same moment, so that the
    // errors add up.
    ASSERT_NEAR(momentum(rig.state()), before, 2000 * 0x1p-53 * size);
  }
  EXPECT_LT(std::fabs(rig.state().spin[1]), 310.0);
}

TEST(RollingRing, ForcesOnDisksAreThoseWithoutRolling)
{
  Ring ring(rolling_material(0.2)), smooth(rolling_material(0.0));
  ring.turn(-300.0, 200.0);
  smooth.turn(-300.0, 200.0);
  shake(ring.state, 0.01, 5);
  smooth.state.velocity = ring.state.velocity;
  RveRig rig(ring.state), other(smooth.state);

  rig.strain(Tensor2::zero(), 1e-6, 500);
  other.strain(Tensor2::zero(), 1e-6, 500);

  EXPECT_EQ(rig.state().velocity, other.state().velocity);
  EXPECT_EQ(components(rig.result().stress), components(other.result().stress));
  EXPECT_NE(rig.state().spin, other.state().spin);
}

// ---- energy ----

TEST(RollingRing, SpringsAndSpinsKeepTheirEnergyBelowTheLimit)
{
  Ring ring(rolling_material(1.0));
  const double spin = 0.1 * ring.swing_at_limit();
  ring.turn(-3.0 * spin, 4.0 * spin);
  RveRig rig(ring.state);
  const double dt = 0.01 / ring.frequency();
  const Result before = rig.evaluate();
  double stored = 0.0;

  for (int k = 0; k < 1000; ++k) {
    const Result &now = rig.strain(Tensor2::zero(), dt, 1);
    stored = std::max(stored, now.elastic_energy - before.elastic_energy);
    // The spins belong to a time half a step before the springs. The sum of energies therefore
    // oscillates by omega dt/2 of the energy that spins and springs exchange.
    ASSERT_NEAR(now.kinetic_energy + now.elastic_energy,
                before.kinetic_energy + before.elastic_energy, 0.006 * before.kinetic_energy);
  }

  // The springs store the energy of the relative spin, I W^2/2 for each of two pairs of disks. The
  // rest of the energy belongs to the angular momentum.
  const double of_relative_spin = ring.inertia() * std::pow(7.0 * spin, 2);
  EXPECT_NEAR(stored, of_relative_spin, 1e-3 * of_relative_spin);
}

TEST(RollingRing, DissipationAtTheLimitIsCounted)
{
  for (const ContactLaw law : {ContactLaw::Linear, ContactLaw::Hertz, ContactLaw::Dmt}) {
    SCOPED_TRACE(word_of(law));
    Ring ring(rolling_material(0.2, 1e6, law));
    ring.turn(-300.0, 200.0);
    Options options = cpu_options();
    options.track_energy = true;
    RveRig rig(ring.state, options);
    const Result before = rig.evaluate();

    const Result &after = rig.strain(Tensor2::zero(), 1e-6, 4000);

    const double lost = before.kinetic_energy + before.elastic_energy -
        (after.kinetic_energy + after.elastic_energy);
    EXPECT_GT(lost, 0.1 * before.kinetic_energy);
    // The energy of the spins belongs to a time half a step before the energy of the springs. This
    // causes the error.
    EXPECT_NEAR(after.energy.friction, lost, 1e-3 * lost);
    EXPECT_EQ(after.energy.viscous, 0.0);
  }
}

TEST(RollingPacking, WorkOfShearGoesIntoSpringsFrictionDampingAndMotion)
{
  Options options = cpu_options();
  options.track_energy = true;
  for (const ContactLaw law : {ContactLaw::Linear, ContactLaw::Hertz, ContactLaw::Dmt}) {
    SCOPED_TRACE(word_of(law));
    RveRig rig(rolling_packing(0.3, 5e5, law), options), plain(plain_packing(law), options);
    const Result before = rig.evaluate();

    const Result &after = rig.strain(gradient(0, 1, 0.05), DT, 4000, 2);    // to 2 %
    plain.strain(gradient(0, 1, 0.05), DT, 4000, 2);

    const double residual = after.energy.work -
        (after.energy.friction + after.energy.local_damping + after.elastic_energy -
         before.elastic_energy + after.kinetic_energy - before.kinetic_energy);
    EXPECT_LT(std::fabs(residual), 1e-3 * after.energy.work);
    EXPECT_GT(after.energy.friction, 0.1 * after.energy.work);
    EXPECT_GT(after.energy.work, 1.02 * plain.result().energy.work);
  }
}

// ---- sums ----

// A moment of 2500 times R f_n exceeds the range for forces, so the unit of the sums must change.
TEST_P(Rolling, LargeCoefficientsKeepTheSumsInTheirRange)
{
  const double friction = 1e4;
  Ring ring = Rolling::ring(friction);
  ring.load(ring.limit());
  RveRig rig(ring.state, options());
  const double dt = 1e-9;

  const Result &result = rig.strain(Tensor2::zero(), dt, 1);

  ASSERT_EQ(result.status, status::Ok) << describe_status(result.status);
  const double expected = 2.0 * REDUCED_RADIUS * ring.limit() * dt;
  const double error = 2.0 * force_error(format());
  EXPECT_NEAR(rig.state().spin[0] * ring.inertia_a(), expected, error * expected);
  EXPECT_NEAR(rig.state().spin[1] * ring.inertia_b(), -expected, error * expected);
}

// ---- stability ----

TEST(RollingRing, StableTimeStepIsThatOfTheRollingSprings)
{
  for (const ContactLaw law : {ContactLaw::Linear, ContactLaw::Hertz, ContactLaw::Dmt}) {
    SCOPED_TRACE(word_of(law));
    // The rolling stiffness is so large that the mode with the highest frequency is a rolling mode.
    Ring ring(rolling_material(1e9, 2e7, law));
    const double bound = stable_time_step(ring.state);
    EXPECT_NEAR(largest_frequency(ring.state), ring.frequency(), 1e-10 * ring.frequency());
    EXPECT_LE(gershgorin_time_step(ring.state), bound);

    const auto largest_spin = [&](double dt) {
      Ring turning = ring;
      turning.turn(-1e-3, 2e-3);
      RveRig rig(turning.state);
      rig.strain(Tensor2::zero(), dt, 1000);
      return std::fabs(relative_spin(rig.state()));
    };

    // Two contacts act on each disk. The bound must be the bound of the whole ring and not the
    // bound of one contact.
    EXPECT_NEAR(bound, 2.0 / ring.frequency(), 1e-6 * bound);
    EXPECT_LT(largest_spin(0.95 * bound), 0.02);
    EXPECT_GT(largest_spin(1.05 * bound), 1e3);
  }
}

// ---- packings ----

TEST(RollingPacking, ResistanceRaisesTheStrength)
{
  Material material = rolling_packing(0.0).material;
  const double without = stress_ratio(material);
  material.rolling_friction = 0.1;
  const double little = stress_ratio(material);
  material.rolling_friction = 0.5;
  const double much = stress_ratio(material);

  EXPECT_GT(little, 1.05 * without);
  EXPECT_GT(much, 1.1 * little);
}

TEST(RollingPacking, TendsToThePackingWithoutResistance)
{
  // The strain is small, since small differences between packings grow at larger strains.
  const auto stress = [](double rolling_friction) {
    RveRig rig(rolling_packing(rolling_friction));
    return rig.strain(gradient(0, 1, 0.05), DT, 400).stress;
  };
  const Tensor2 without = stress(0.0);
  const auto difference = [&](double rolling_friction) {
    const Tensor2 with = stress(rolling_friction);
    double most = 0.0;
    for (int k = 0; k < 4; ++k)
      most = std::max(most, std::fabs(with.component[k] - without.component[k]));
    return most;
  };

  const double of_little = difference(1e-3), of_less = difference(1e-5);

  EXPECT_GT(of_little, 0.0);
  EXPECT_GT(of_less, 0.0);
  EXPECT_LT(of_less, 0.03 * of_little);
}

TEST(RollingPacking, RigidRotationRotatesTheStressAndKeepsTheRollingForces)
{
  const double rate = 10.0, dt = 0.5 * M_PI / rate / 1963.0;
  RveRig sheared(rolling_packing());
  sheared.strain(gradient(0, 1, 0.05), DT, 2000, 2);
  sheared.strain(Tensor2::zero(), DT, 8000);
  EXPECT_LT(sheared.result().unbalanced_ratio, 1e-5);
  RveState state = sheared.state();
  for (double &spin : state.spin) spin = rate;
  RveRig rig(state);
  const Result before = rig.evaluate();

  rig.strain(spin_gradient(rate), dt, 151, 13 * 4);    // one turn

  // The tolerance is the same as for the packing without rolling resistance (test_objectivity.cpp).
  const Result &after = rig.result();
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(after.stress.component[k], before.stress.component[k], 3e-4 * before.mean_stress());
  const auto old_forces = rolling_histories(state), new_forces = rolling_histories(rig.state());
  ASSERT_GT(old_forces.size(), 500u);
  ASSERT_EQ(new_forces.size(), old_forces.size());
  double difference = 0.0, size = 0.0;
  for (std::size_t k = 0; k < old_forces.size(); ++k) {
    const double old_force = std::get<2>(old_forces[k]);
    difference += std::fabs(std::get<2>(new_forces[k]) - old_force);
    size += std::fabs(old_force);
  }
  EXPECT_LT(difference, 3e-3 * size);
}

// An RVE that rotates between two calls keeps the histories of its pairs.
TEST_P(Rolling, RotatedRveKeepsItsForces)
{
  RveRig rig(Rolling::packing(), options());
  work_out(rig);
  const RveState before = rig.state();

  rig.owner().turn({rig.rve_number()}, {Tensor2{{0.0, -1.0, 1.0, 0.0}}});

  const RveState after = rig.state();
  EXPECT_EQ(rolling_histories(after), rolling_histories(before));
  EXPECT_EQ(histories(after), histories(before));
  EXPECT_EQ(after.spin, before.spin);
  EXPECT_EQ(after.fractional, before.fractional);
  for (int i = 0; i < before.num_grains(); ++i)
    EXPECT_EQ(after.velocity[2 * i + 1], before.velocity[2 * i]);
}

// ---- independence of results ----

TEST_P(Rolling, CoefficientOfZeroGivesTheBitsOfThePlainProgram)
{
  RveState state = Rolling::plain();
  RveRig plain(state, options());
  auto engine = make_engine(options());
  std::vector<int> rves = {engine->add(state)};
  std::vector<Result> results;
  const Drive drive = Drive::constant_velocity_gradient(SHEAR_AND_COMPRESSION, DT, 200);

  for (int call = 0; call < 10; ++call) {
    plain.advance(drive);
    // After some calls the batch moves to an engine with another kernel variant.
    if (call == 3) {
      auto other = engine->empty_with(contacts_of(Rolling::packing()));
      rves = {other->add(engine->state(rves[0])), other->add(Rolling::packing())};
      engine = std::move(other);
    }
    engine->advance(rves, std::vector<Drive>(rves.size(), drive), results);
    EXPECT_TRUE(same_answer(results[0], plain.result())) << "call " << call;
  }

  EXPECT_EQ(serialize(engine->state(rves[0])), serialize(plain.state()));
  EXPECT_GT(rolling_histories(engine->state(rves[1])).size(), 400u);
  EXPECT_GT(plain.result().counters.rebuilds, 10);
}

TEST_P(Rolling, SkinDoesNotChangeABit)
{
  std::vector<RveState> states;
  std::vector<Result> results;
  for (const double share : {0.05, 0.1, 1.5}) {
    Options options = Rolling::options();
    options.skin = share * 0.00375;
    RveRig rig(Rolling::packing(), options);
    results.push_back(work_out(rig, 40));
    states.push_back(rig.state());
  }

  EXPECT_GT(results[0].counters.rebuilds, 20);
  EXPECT_GE(results[2].counters.repeats, 1);    // lists grew
  EXPECT_GT(rolling_histories(states[0]).size(), 500u);
  for (int k = 1; k < 3; ++k) {
    EXPECT_TRUE(same_motion(states[0], states[k]));
    EXPECT_TRUE(same_answer(results[0], results[k]));
  }
}

// Before every call the list is marked as outdated and its order is reversed. In every other pair,
// the other grain becomes the owner.
TEST_P(Rolling, ChangeOfOwnersDoesNotChangeABit)
{
  RveRig reference(Rolling::packing(), options());
  work_out(reference);
  RveState state = Rolling::packing(), forgetful = state;
  const auto with_other_owners = [](RveState old, bool turn_forces) {
    old.list_cell = Tensor2::zero();
    old.list_fractional.clear();
    std::reverse(old.pairs.begin(), old.pairs.end());
    for (std::size_t k = 0; k < old.pairs.size(); k += 2) {
      std::swap(old.pairs[k].first, old.pairs[k].second);
      if (turn_forces) old.pairs[k].rolling_force = -old.pairs[k].rolling_force;
    }
    return old;
  };

  for (int call = 0; call < 20; ++call) {
    RveRig rig(with_other_owners(state, true), options());
    work_out(rig, 1);
    state = rig.state();
    RveRig wrong(with_other_owners(forgetful, false), options());
    work_out(wrong, 1);
    forgetful = wrong.state();
  }

  EXPECT_TRUE(same_motion(state, reference.state()));
  EXPECT_FALSE(same_motion(forgetful, reference.state()));    // control
  EXPECT_GT(rolling_histories(state).size(), 500u);
}

TEST_P(Rolling, OrderOfTheGrainsDoesNotChangeTheForces)
{
  const RveState packing = Rolling::packing();
  const int n = packing.num_grains();
  RveRig rig(packing, options()), other(numbered_backwards(packing), options());

  work_out(rig);
  work_out(other);

  const RveState a = rig.state(), b = other.state();
  for (int i = 0; i < n; ++i) {
    ASSERT_EQ(a.spin[i], b.spin[n - 1 - i]) << "grain " << i;
    for (int c = 0; c < 2; ++c)
      ASSERT_EQ(a.velocity[2 * i + c], b.velocity[2 * (n - 1 - i) + c]) << "grain " << i;
  }
  EXPECT_EQ(components(rig.result().stress), components(other.result().stress));
}

TEST_P(Rolling, RestartContinuesBitForBit)
{
  RveRig uninterrupted(Rolling::packing(), options());
  work_out(uninterrupted, 10);
  const RveState stop = uninterrupted.state();
  RveState forgetful = restarted(stop);
  for (Pair &pair : forgetful.pairs) pair.rolling_force = 0.0;

  RveRig continued(restarted(stop), options());
  RveRig careless(forgetful, options());
  work_out(uninterrupted, 10);
  work_out(continued, 10);
  work_out(careless, 10);

  EXPECT_TRUE(same_answer(continued.result(), uninterrupted.result()));
  EXPECT_EQ(serialize(continued.state()), serialize(uninterrupted.state()));
  EXPECT_FALSE(same_motion(careless.state(), uninterrupted.state()));    // control
}

TEST_P(Rolling, ThreadsAndOtherRvesDoNotChangeABit)
{
  const std::vector<RveState> states = {Rolling::packing(), Rolling::plain(), Rolling::packing(0.1),
                                        ring(0.2).state};
  const Drive drive = Drive::constant_velocity_gradient(SHEAR_AND_COMPRESSION, DT, 200);
  std::vector<std::vector<char>> alone;
  for (const RveState &state : states) {
    RveRig rig(state, options());
    rig.advance(drive);
    rig.advance(drive);
    alone.push_back(serialize(rig.state()));
  }

  for (const int threads : {1, 3}) {
    const auto engine = make_engine(with_contacts_of(states, options(threads)));
    std::vector<int> rves;
    for (const RveState &state : states) rves.push_back(engine->add(state));
    std::vector<Result> results;
    for (int call = 0; call < 2; ++call)
      engine->advance(rves, std::vector<Drive>(rves.size(), drive), results);
    for (std::size_t k = 0; k < states.size(); ++k)
      EXPECT_EQ(serialize(engine->state(rves[k])), alone[k]) << "RVE " << k;
  }
}

TEST_P(Rolling, EvaluationChangesNothing)
{
  RveRig rig(Rolling::packing(), options());
  work_out(rig);
  const std::vector<char> before = serialize(rig.state());

  const Result first = rig.evaluate();
  const Result second = rig.evaluate();

  EXPECT_EQ(serialize(rig.state()), before);
  EXPECT_TRUE(same_answer(first, second));
}

// ---- conditions of rolling resistance ----

TEST_P(Rolling, WithoutASpringThereIsNoResistance)
{
  RveState state = Rolling::packing(0.5, 0.0);
  RveRig rig(state, options()), plain(Rolling::plain(), options());

  work_out(rig);
  work_out(plain);

  EXPECT_TRUE(same_motion(rig.state(), plain.state()));
  EXPECT_EQ(rig.state().material.rolling_friction, 0.5);
}

TEST_P(Rolling, InitialForcesVanishInTheFirstStepWithoutResistance)
{
  RveRig rolled(Rolling::packing(), options());
  work_out(rolled);
  RveState state = rolled.state();
  state.material.rolling_friction = 0.0;

  RveRig rig(state, options());

  EXPECT_EQ(serialize(rig.state()), serialize(state));
  work_out(rig, 1);
  EXPECT_TRUE(rolling_histories(rig.state()).empty());
}

TEST_P(Rolling, CanBeAddedToAnRveInAnEngineWithRolling)
{
  const auto plain = make_engine(options());
  const auto engine = plain->empty_with(contacts_of(Rolling::packing()));
  const std::vector<int> rves = {engine->add(Rolling::plain()), engine->add(Rolling::plain())};
  const std::vector<Drive> drives(
      2, Drive::constant_velocity_gradient(SHEAR_AND_COMPRESSION, DT, 200));
  std::vector<Result> results;
  engine->advance(rves, drives, results);
  RveState by_hand = engine->state(rves[1]);
  const std::vector<char> other = serialize(engine->state(rves[0]));
  by_hand.material = Rolling::packing().material;
  RveRig rig(by_hand, options());

  engine->set_material(rves[1], by_hand.material);
  EXPECT_EQ(serialize(engine->state(rves[0])), other);
  engine->advance(rves, drives, results);
  rig.advance(drives[1]);

  EXPECT_EQ(serialize(engine->state(rves[1])), serialize(rig.state()));
  EXPECT_GT(rolling_histories(rig.state()).size(), 400u);
  // A grain has three owned pairs and a few extra ones.
  const std::size_t number = format() == Format::Fast || format() == Format::Single ? 4 : 8;
  EXPECT_GE(engine->bytes_per_rve(400), plain->bytes_per_rve(400) + 3 * 400 * number);
  EXPECT_LE(engine->bytes_per_rve(400), plain->bytes_per_rve(400) + 4 * 400 * number);
  EXPECT_GT(engine->bytes_of_call(4, 400), plain->bytes_of_call(4, 400));
}

TEST_P(Rolling, IsRefusedByAnEngineThatWasMadeWithoutIt)
{
  const auto engine = make_engine(options());
  const int rve = engine->add(Rolling::plain());
  const std::vector<char> before = serialize(engine->state(rve));
  RveState with_forces = Rolling::plain();
  with_forces.pairs.push_back({0, 1, 0.0, 1.0});
  const std::string word = word_of(law());
  const std::string message = "the RVE has contact law " + word +
      " with rolling resistance, but the engine was created for RVEs with contact law " + word;

  EXPECT_EQ(message_of([&] { engine->add(Rolling::packing()); }), message);
  EXPECT_EQ(message_of([&] { engine->add(with_forces); }), message);
  EXPECT_EQ(message_of([&] { engine->set_material(rve, Rolling::packing().material); }), message);

  EXPECT_EQ(engine->size(), 1);
  EXPECT_EQ(serialize(engine->state(rve)), before);
}
