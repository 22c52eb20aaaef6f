// SPDX-License-Identifier: GPL-2.0-only
// Tests properties of every contact law in the table of kernel variants, in every number format. A
// law in a new line of the table is tested without further code.

#include "rve/core/pi.h"
#include "rve/engine/variant_configs.h"
#include "rve/physics/material.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005;    // [m]

Material all_that_contacts_have()
{
  Material material;
  material.normal_stiffness = 1e6;
  material.tangential_stiffness = 0.8e6;
  material.friction = 0.5;
  material.rolling_stiffness = 4e5;
  material.rolling_friction = 0.1;
  material.twisting_stiffness = 2.0;
  material.twisting_friction = 2e-4;
  material.rolling_viscosity = 5.0;
  material.twisting_viscosity = 1e-5;
  material.normal_viscosity = 30.0;
  material.tangential_viscosity = 150.0;
  material.hertz_stiffness = 1e9;
  material.mindlin_stiffness = 0.8e9;
  material.viscoelastic_damping = 2e7;
  material.restitution_damping = 0.2;
  material.mindlin_damping = 0.5;
  material.surface_energy = 30.0;
  material.adhesion_reach = 0.2 * RADIUS;
  material.density = 2650.0;
  material.mass_depth = 0.01;
  return material;
}

/// Returns the law with parameters in the units of the script and with lever arms to the contact
/// point.
template <class Law> Law law_of(const Material &material)
{
  typename Law::Constants constants;
  constants.set(material, LawUnits::same(), 0.5);
  Law law;
  law.take(constants);
  return law;
}

template <class T> bool same_bytes(const T &x, const T &y)
{
  return std::memcmp(&x, &y, sizeof(T)) == 0;
}

template <class Number> void randomize(Random &random, Number &force)
{
  force = Number(random.uniform(-50.0, 50.0));
}
template <class Number> void randomize(Random &random, Vec<Number, 3> &force)
{
  for (Number &component : force.component) randomize(random, component);
}
template <class Number, int D> void randomize(Random &random, MindlinHistory<Number, D> &history)
{
  randomize(random, history.tangential);
  history.contact_radius = Number(random.uniform(1e-5, 1e-3));
}
template <class Number> void randomize(Random &random, TurningHistory<Number, 2> &history)
{
  randomize(random, history.rolling);
}
template <class Number> void randomize(Random &random, TurningHistory<Number, 3> &history)
{
  randomize(random, history.rolling);
  history.twisting = Number(random.uniform(-0.02, 0.02));
}
template <class Contact, class Turning>
void randomize(Random &random, RollingHistory<Contact, Turning> &history)
{
  randomize(random, history.contact);
  randomize(random, history.turning);
}

/// Returns a grain with random motion.
template <class Real, int D> GrainMotion<Real, D> random_grain(Random &random)
{
  GrainMotion<Real, D> grain;
  for (int a = 0; a < D; ++a) grain.velocity[a] = Real(random.uniform(-1.0, 1.0));
  for (int k = 0; k < Space<D>::spins; ++k)
    spin_component(grain.spin, k) = Real(random.uniform(-99.0, 99.0));
  grain.radius = Real(random.uniform(0.5 * RADIUS, RADIUS));
  return grain;
}

template <class Real, int D> GrainMotion<Real, D> grain_at_rest()
{
  GrainMotion<Real, D> grain{};
  grain.radius = Real(RADIUS);
  return grain;
}

/// Returns the vector with the component x along the first axis.
template <class Real, int D> Vec<Real, D> along_x(double x)
{
  Vec<Real, D> v = Vec<Real, D>::zero();
  v[0] = Real(x);
  return v;
}

/// Returns true if all numbers are equal. Zeros with different signs are equal.
template <class Number, class T> bool same_numbers(const T &x, const T &y)
{
  Number a[sizeof(T) / sizeof(Number)], b[sizeof(T) / sizeof(Number)];
  std::memcpy(a, &x, sizeof(T));
  std::memcpy(b, &y, sizeof(T));
  return std::equal(std::begin(a), std::end(a), std::begin(b));
}

/// A touching pair with random motion.
template <class Law> struct Sample {
  using Real = typename Law::Numbers::Real;
  using Wide = typename Law::Numbers::Wide;

  static constexpr int D = Law::D;

  GrainMotion<Real, D> i, j;
  Vec<Wide, D> branch;
  Tensor<Real, D> gradient;
  typename Law::History history;
  Real dt;

  explicit Sample(Random &random)
  {
    i = random_grain<Real, D>(random);
    j = random_grain<Real, D>(random);
    for (Real &x : gradient.component) x = Real(random.uniform(-20.0, 20.0));
    const double distance = static_cast<double>(sum_of_radii()) * (1.0 - random.uniform(1e-5, 0.1));
    Vec<double, D> direction;
    for (double &x : direction.component) x = random.uniform(-1.0, 1.0);
    branch = ((distance / std::sqrt(dot(direction, direction))) * direction).template as<Wide>();
    randomize(random, history);
    dt = Real(random.uniform(1e-6, 1e-4));
  }

  /// Returns the same pair with a gap and without history.
  Sample apart() const
  {
    Sample gap = *this;
    const double distance = std::sqrt(static_cast<double>(dot(branch, branch)));
    gap.branch = Wide(1.01 * static_cast<double>(sum_of_radii()) / distance) * branch;
    gap.history = typename Law::History();
    return gap;
  }

  Wide sum_of_radii() const { return static_cast<Wide>(i.radius) + static_cast<Wide>(j.radius); }

  typename Law::Force force(const Law &law) const
  {
    return evaluate(law, contact_geometry<Real>(branch, sum_of_radii()), i, j, gradient, history,
                    dt);
  }
  typename Law::Force force_from_j(const Law &law) const
  {
    const Vec<Wide, D> back = Wide(-1) * branch;
    return evaluate(law, contact_geometry<Real>(back, sum_of_radii()), j, i, gradient,
                    Law::seen_from_partner(history), dt);
  }
};

/// Returns true if, in any of many random pairs, the parameter changes the force, the torques or
/// the history.
template <class Law> bool matters(double MaterialNumbers::*parameter)
{
  const Material material = all_that_contacts_have();
  Material other = material;
  other.*parameter = other.*parameter == 0.0 ? 1.0 : 1.5 * other.*parameter;
  const Law law = law_of<Law>(material), changed = law_of<Law>(other);
  Random random(1);
  for (int k = 0; k < 500; ++k) {
    const Sample<Law> sample(random);
    const auto differ = [&](const Sample<Law> &pair) {
      const auto one = pair.force(law), two = pair.force(changed);
      return !same_bytes(one.force, two.force) || !same_bytes(one.torque_i, two.torque_i) ||
          !same_bytes(one.torque_j, two.torque_j) || !same_bytes(one.history(), two.history());
    };
    if (differ(sample) || (Law::has_reach && differ(sample.apart()))) return true;
  }
  return false;
}

template <class Law> void expect_that_a_law_has_the_parameters_that_it_says()
{
  // Returns true if the kernels of the law omit this parameter.
  const auto is_left_out = [](MaterialMember member) {
    if (member == &MaterialNumbers::rolling_stiffness ||
        member == &MaterialNumbers::rolling_friction ||
        member == &MaterialNumbers::rolling_viscosity ||
        member == &MaterialNumbers::twisting_stiffness ||
        member == &MaterialNumbers::twisting_friction ||
        member == &MaterialNumbers::twisting_viscosity ||
        member == &MaterialNumbers::twisting_marshall)
      return !Law::has_rolling;
    if (member == &MaterialNumbers::normal_viscosity ||
        member == &MaterialNumbers::tangential_viscosity ||
        member == &MaterialNumbers::viscoelastic_damping ||
        member == &MaterialNumbers::restitution_damping ||
        member == &MaterialNumbers::mindlin_damping)
      return !Law::is_damped;
    if (member == &MaterialNumbers::mindlin_displacement) return !Law::has_rescaling;
    return (member == &MaterialNumbers::friction ||
            member == &MaterialNumbers::tangential_stiffness) &&
        !Law::has_friction;
  };
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS) {
    if (!parameter.of_contact()) continue;
    const bool has_it = parameter.is_of(Law::contact_law, Law::D) && !is_left_out(parameter.member);
    EXPECT_EQ(matters<Law>(parameter.member), has_it) << parameter.name;
  }
}

template <class Law> void expect_the_same_bits_from_both_grains()
{
  const Law law = law_of<Law>(all_that_contacts_have());
  Random random(2);
  for (int k = 0; k < 5000; ++k) {
    Sample<Law> sample(random);
    if (Law::has_reach && k % 2 == 1) sample = sample.apart();
    const auto of_i = sample.force(law), of_j = sample.force_from_j(law);
    using Real = typename Law::Numbers::Real;
    using Spring = typename Law::Numbers::Spring;
    for (int a = 0; a < Law::D; ++a) ASSERT_EQ(of_i.force[a], -of_j.force[a]);
    ASSERT_TRUE(same_numbers<Real>(of_i.torque_i, of_j.torque_j));
    ASSERT_TRUE(same_numbers<Real>(of_i.torque_j, of_j.torque_i));
    ASSERT_TRUE(same_numbers<Spring>(of_i.history(), Law::seen_from_partner(of_j.history())));
    ASSERT_TRUE(
        same_bytes(sample.history, Law::seen_from_partner(Law::seen_from_partner(sample.history))));
  }
}

/// Without dashpots, a second evaluation of a contact with a time step of zero changes nothing.
template <class Law> void expect_that_looking_twice_changes_nothing()
{
  if (Law::is_damped) return;
  const Law law = law_of<Law>(all_that_contacts_have());
  Random random(3);
  for (int k = 0; k < 5000; ++k) {
    Sample<Law> sample(random);
    sample.dt = 0;
    const auto once = sample.force(law);
    sample.history = once.history();
    const auto twice = sample.force(law);
    ASSERT_TRUE(same_bytes(once.force, twice.force));
    ASSERT_TRUE(same_bytes(once.history(), twice.history()));
  }
}

/// Law::largest() returns at least the tangential force and at least the largest force so far.
template <class Law> void expect_that_the_largest_force_is_one_of_the_contact()
{
  const Law law = law_of<Law>(all_that_contacts_have());
  Random random(4);
  for (int k = 0; k < 2000; ++k) {
    const auto force = Sample<Law>(random).force(law);
    const double largest = static_cast<double>(Law::largest(force, 0));
    ASSERT_GE(largest, magnitude(in_numbers<double>(force.tangential)));
    ASSERT_EQ(static_cast<double>(Law::largest(force, 1e6f)), 1e6);
  }
}

template <class T> double power_of(T torque, T spin)
{
  return torque * spin;
}
template <class T> double power_of(const Vec<T, 3> &torque, const Vec<T, 3> &spin)
{
  return dot(torque, spin);
}

/// A grain is pressed on another grain, slides, rolls and twists on it back and forth, and is
/// lifted a little. The work on the grains equals the change of spring energy plus the dissipation
/// of the contact.
template <class Law>
void expect_that_energy_is_balanced(bool dissipates,
                                    const Material &material = all_that_contacts_have())
{
  using Real = typename Law::Numbers::Real;
  using Wide = typename Law::Numbers::Wide;
  constexpr int D = Law::D;
  const Law law = law_of<Law>(material);
  constexpr int STEPS = 200000;
  constexpr double DURATION = 0.02, DT = DURATION / STEPS;
  auto i = grain_at_rest<Real, D>(), j = i;
  typename Law::History history = typename Law::History();
  Vec<double, D> x = along_x<double, D>(2.0 * RADIUS - 8e-5);
  double supplied = 0.0, before = 0.0, at_start = 0.0;
  double elastic = 0.0;
  Dissipation dissipation{0.0, 0.0};
  for (int k = 0; k <= STEPS; ++k) {
    const double t = static_cast<double>(k) / STEPS;
    j.velocity[0] = Real(-0.02 * std::cos(2.0 * kPi * t));
    j.velocity[1] = Real(0.1 * std::sin(6.0 * kPi * t));
    // The next two lines set the spin of a disk, or the z component of the spin of a sphere.
    spin_component(i.spin, Space<D>::spins - 1) = Real(8.0 * std::sin(4.0 * kPi * t));
    spin_component(j.spin, Space<D>::spins - 1) = Real(-5.0 * std::sin(10.0 * kPi * t));
    if constexpr (D == 3) {
      j.velocity[2] = Real(0.07 * std::cos(4.0 * kPi * t));
      i.spin[0] = Real(6.0 * std::cos(2.0 * kPi * t));
      j.spin[0] = Real(-9.0 * std::sin(8.0 * kPi * t));
      i.spin[1] = Real(-3.0 * std::cos(6.0 * kPi * t));
    }
    x = x + DT * j.velocity.template as<double>();
    const auto contact =
        contact_geometry<Real>(x.template as<Wide>(), static_cast<Wide>(2.0 * RADIUS));
    ASSERT_GT(contact.overlap, 0);
    const auto force = evaluate(law, contact, i, j, Tensor<Real, D>::zero(), history, Real(DT));
    history = force.history();
    // `power` is the power of the external forces and torques that balance the forces and torques
    // of the contact.
    const double power = dot(force.force, j.velocity) - power_of(force.torque_i, i.spin) -
        power_of(force.torque_j, j.spin);
    elastic = law.elastic_energy(contact, force);
    if (k == 0)
      at_start = elastic;
    else {
      supplied += 0.5 * (before + power) * DT;
      law.dissipate(contact, force, Real(DT), dissipation);
    }
    before = power;
  }
  const double lost = dissipation.friction + dissipation.viscous;
  EXPECT_NEAR(supplied, elastic - at_start + lost, 1e-3 * (lost + elastic));
  if (dissipates)
    EXPECT_GT(lost, elastic);
  else
    EXPECT_EQ(lost, 0.0);
}

/// The normal stiffness is the slope of the spring force. If a law declares its moduli as constant,
/// they do not depend on the overlap. Otherwise moduli do not decrease with the overlap, so that
/// their values at the full overlap are upper bounds.
template <class Law> void expect_that_the_stiffness_is_the_slope_of_the_force()
{
  const Law law = law_of<Law>(all_that_contacts_have());
  const ContactSite whole{2.0 * RADIUS, RADIUS, RADIUS};
  const ContactModuli most = law.stiffness(whole), most_viscous = law.viscosity(whole);
  constexpr double SMALLEST_SHARE = 1e-4;
  for (const double share : {SMALLEST_SHARE, 1e-2, 0.3}) {
    const ContactSite site{share * RADIUS, RADIUS, 0.6 * RADIUS};
    const double step = 1e-4 * site.overlap;
    ContactSite before = site, after = site;
    before.overlap -= step;
    after.overlap += step;
    const ContactModuli stiffness = law.stiffness(site), viscosity = law.viscosity(site);
    const double slope = (law.spring_force(after) - law.spring_force(before)) / (2.0 * step);
    EXPECT_NEAR(stiffness.normal, slope, 1e-7 * slope);
    EXPECT_EQ(
        stiffness.largest(),
        std::max({stiffness.normal, stiffness.tangential, stiffness.rolling, stiffness.twisting}));
    EXPECT_EQ(stiffness.twisting > 0.0, Law::has_rolling && Law::D == 3);
    // A law without constant moduli may be linear at large overlaps. Its stiffness at the smallest
    // overlap must differ from that at the full overlap.
    if (Law::has_constant_moduli || share == SMALLEST_SHARE) {
      EXPECT_EQ(stiffness.normal == most.normal, Law::has_constant_moduli);
    }
    EXPECT_LE(stiffness.normal, most.normal);
    EXPECT_LE(stiffness.tangential, most.tangential);
    EXPECT_LE(viscosity.largest(), most_viscous.largest());
    EXPECT_EQ(stiffness.tangential > 0.0, Law::has_friction);
    EXPECT_EQ(stiffness.rolling > 0.0, Law::has_rolling);
    EXPECT_EQ(viscosity.largest() > 0.0, Law::is_damped);
  }
}

/// At rest the normal force is the spring force. For small motions, the tangential force and the
/// moments are given by the moduli of springs and dashpots.
template <class Law> void expect_that_moduli_are_those_of_small_motions()
{
  using Real = typename Law::Numbers::Real;
  constexpr int D = Law::D, LAST = Space<D>::spins - 1;
  const Law law = law_of<Law>(all_that_contacts_have());
  const auto i = grain_at_rest<Real, D>();
  auto j = i;
  const auto contact =
      contact_geometry<Real>(along_x<typename Law::Numbers::Wide, D>(1.98 * RADIUS), 2.0 * RADIUS);
  const ContactSite site{contact.overlap, RADIUS, RADIUS};
  const typename Law::History none = typename Law::History();
  const auto none_moves = Tensor<Real, D>::zero();
  const auto at_rest = evaluate(law, contact, i, j, none_moves, none, Real(1e-6));
  EXPECT_NEAR(at_rest.normal_force, law.spring_force(site), 1e-12 * law.spring_force(site));
  EXPECT_EQ(magnitude(at_rest.tangential), 0.0);

  constexpr double DT = 1e-6;
  const ContactModuli stiffness = law.stiffness(site), viscosity = law.viscosity(site);
  j.velocity[1] = 1e-3;
  auto across = evaluate(law, contact, i, j, none_moves, none, Real(DT)).tangential;
  const double expected = (stiffness.tangential * DT + viscosity.tangential) * 1e-3;
  EXPECT_NEAR(spin_component(across, LAST - (D == 3 ? 1 : 0)), expected, 1e-12 * expected);
  j.velocity = along_x<Real, D>(1e-3);
  const double along = evaluate(law, contact, i, j, none_moves, none, Real(DT)).normal_force;
  EXPECT_NEAR(along - at_rest.normal_force, -viscosity.normal * 1e-3, 1e-12 * at_rest.normal_force);

  if constexpr (Law::has_rolling) {
    // With the reduced radius R, the moment is R^2 times the spring modulus times the rotation w
    // dt, plus R^2 times the dashpot modulus times the spin w.
    const double area = 0.25 * RADIUS * RADIUS, turn = 1e-3;
    j = i;
    spin_component(j.spin, LAST) = turn;
    const auto rolled = evaluate(law, contact, i, j, none_moves, none, Real(DT)).turned.moment;
    const double rolling = (stiffness.rolling * DT + viscosity.rolling) * area * turn;
    EXPECT_NEAR(spin_component(rolled, LAST), rolling, 1e-12 * rolling);
    if constexpr (D == 3) {
      j.spin = along_x<Real, 3>(turn);
      const auto twisted = evaluate(law, contact, i, j, none_moves, none, Real(DT)).turned.moment;
      const double twisting = (stiffness.twisting * DT + viscosity.twisting) * area * turn;
      EXPECT_NEAR(twisted[0], twisting, 1e-12 * twisting);
      EXPECT_EQ(twisted[1], 0.0);
    }
  }
}

template <class Law> void check_in_this_format()
{
  expect_that_a_law_has_the_parameters_that_it_says<Law>();
  expect_the_same_bits_from_both_grains<Law>();
  expect_that_looking_twice_changes_nothing<Law>();
  expect_that_the_largest_force_is_one_of_the_contact<Law>();
}

template <template <class> class Law> void check_in_all_formats()
{
  check_in_this_format<Law<FastNumbers>>();
  check_in_this_format<Law<MixedNumbers>>();
  check_in_this_format<Law<DoubleNumbers>>();
  check_in_this_format<Law<SingleNumbers>>();
}

}    // namespace

TEST(LawsOfTheVariants, HaveTheirParametersAndAreSymmetricInBothGrains){
#define RVE_CHECK(name, law, has_bookkeeping, prepared) \
  {                                                     \
    SCOPED_TRACE(#name);                                \
    check_in_all_formats<law>();                        \
  }
    RVE_KERNEL_VARIANTS(RVE_CHECK)
#undef RVE_CHECK
}

TEST(LawsOfTheVariants, BalanceTheEnergyOfAContactThatSlidesAndRolls){
#define RVE_CHECK(name, law, has_bookkeeping, prepared)                                   \
  {                                                                                       \
    SCOPED_TRACE(#name);                                                                  \
    expect_that_energy_is_balanced<law<DoubleNumbers>>(law<DoubleNumbers>::has_friction); \
  }
    RVE_KERNEL_VARIANTS(RVE_CHECK)
#undef RVE_CHECK
}

TEST(LawsOfTheVariants, BalanceTheEnergyOfTwistingAfterMarshall)
{
  Material material = all_that_contacts_have();
  material.twisting_stiffness = material.twisting_friction = material.twisting_viscosity = 0.0;
  material.twisting_marshall = 1.0;
  expect_that_energy_is_balanced<SphereRollingSprings<DoubleNumbers>>(true, material);
  expect_that_energy_is_balanced<SphereRollingHertz<DoubleNumbers>>(true, material);
  expect_that_energy_is_balanced<SphereRollingDmt<DoubleNumbers>>(true, material);
}

TEST(LawsOfTheVariants, ModuliAreThoseOfTheirForces){
#define RVE_CHECK(name, law, has_bookkeeping, prepared)                        \
  {                                                                            \
    SCOPED_TRACE(#name);                                                       \
    expect_that_the_stiffness_is_the_slope_of_the_force<law<DoubleNumbers>>(); \
    expect_that_moduli_are_those_of_small_motions<law<DoubleNumbers>>();       \
  }
    RVE_KERNEL_VARIANTS(RVE_CHECK)
#undef RVE_CHECK
}

TEST(LawsOfTheVariants, ProgramsWithTheSamePreparationHaveTheSameMemory)
{
#define RVE_CHECK(name, law, has_bookkeeping, prepared)                                 \
  {                                                                                     \
    using Own = VariantConfig<KernelVariant::name, MixedNumbers>;                       \
    using Preparing =                                                                   \
        VariantConfig<VariantTraits<KernelVariant::name>::prepared_like, MixedNumbers>; \
    EXPECT_TRUE((std::is_same_v<Own::History, Preparing::History>) ) << #name;          \
    EXPECT_EQ(sizeof(Own::Law::Constants), sizeof(Preparing::Law::Constants)) << #name; \
  }
  RVE_KERNEL_VARIANTS(RVE_CHECK)
#undef RVE_CHECK
}
