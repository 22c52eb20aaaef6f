// SPDX-License-Identifier: GPL-2.0-only
// Contact laws of spheres in the whole engine: Hertz-Mindlin, adhesion, and resistance to rolling
// and twisting.

#include "engine/test_states.h"
#include "rve/engine/contact_model.h"
#include "rve/engine/finite_strain.h"
#include "support/messages.h"
#include "support/spheres.h"

#include <algorithm>
#include <cmath>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

using Vector = Vec<double, 3>;

constexpr double RADIUS = 0.005, REDUCED_RADIUS = 0.5 * RADIUS;    // [m]
constexpr Format FORMATS[] = {Format::Double, Format::Mixed, Format::Fast};

Options options_for(const Spheres &state, Format format = Format::Double)
{
  Options options = sphere_options(format);
  options.contacts = contacts_of(state);
  return options;
}

/// Returns a material without friction, resistance and damping.
Material material_of(ContactLaw law)
{
  Material material;
  material.law = law;
  material.density = 2650.0;
  if (law == ContactLaw::Linear) {
    material.normal_stiffness = 1e6;
  } else {
    material.hertz_stiffness = 1e9;
    material.mindlin_displacement = 1.0;
  }
  if (law == ContactLaw::Dmt) material.surface_energy = 5.0;
  return material;
}

Material with_friction(Material material)
{
  material.friction = 0.5;
  (material.law == ContactLaw::Linear ? material.tangential_stiffness
                                      : material.mindlin_stiffness) = 0.8 *
      (material.law == ContactLaw::Linear ? material.normal_stiffness : material.hertz_stiffness);
  return material;
}

Material with_resistance(Material material)
{
  material.rolling_stiffness = 4e5;
  material.rolling_friction = 0.1;
  material.twisting_stiffness = 2.0;
  material.twisting_friction = 2e-4;
  return material;
}

Material with_dashpots(Material material)
{
  material.rolling_viscosity = 3.0;
  material.twisting_viscosity = 2e-5;
  return material;
}

/// Returns the material with Marshall's twisting resistance in place of its own twisting springs.
/// Marshall's resistance follows from tangential springs and friction on the contact area.
Material after_marshall(Material material)
{
  material.twisting_stiffness = material.twisting_friction = material.twisting_viscosity = 0.0;
  material.twisting_marshall = 1.0;
  return material;
}

constexpr ContactLaw LAWS[] = {ContactLaw::Linear, ContactLaw::Hertz, ContactLaw::Dmt};

/// Returns two spheres that just touch along x, with an approach velocity v_n and a velocity v_t in
/// an oblique direction perpendicular to x.
Spheres approaching(const Material &material, double v_n, double v_t)
{
  Spheres state = spheres(material, 0.1 * Tensor3::identity(), {RADIUS, RADIUS},
                          {0.05 - RADIUS, 0.05, 0.05, 0.05 + RADIUS, 0.05, 0.05});
  state.velocity = {0.5 * v_n, 0.3 * v_t, 0.4 * v_t, -0.5 * v_n, -0.3 * v_t, -0.4 * v_t};
  return state;
}

}    // namespace

TEST(SphereImpact, OfHertzHasTheOverlapForceAndDurationOfItsClosedForm)
{
  const Material material = material_of(ContactLaw::Hertz);
  const double v = 0.1, mass = 0.5 * sphere_mass(material, RADIUS);    // reduced mass
  const double deepest =
      std::pow(1.25 * mass * v * v / (material.hertz_stiffness * std::sqrt(REDUCED_RADIUS)), 0.4);
  const double largest =
      material.hertz_stiffness * std::sqrt(REDUCED_RADIUS) * std::pow(deepest, 1.5);
  const double duration = 2.9432751 * deepest / v;
  for (const Format format : FORMATS) {
    const Spheres before = approaching(material, v, 0.0);
    SphereRig rig(before, options_for(before, format));
    double overlap = 0.0, force = 0.0;
    int in_touch = 0;
    constexpr int CALLS = 500;
    for (int call = 0; call < 1.2 * CALLS; ++call) {
      const auto result = rig.strain(Tensor3::zero(), duration / (20 * CALLS), 20);
      overlap = std::max(overlap, 2.0 * RADIUS * result.largest_overlap);
      force = std::max(force, result.largest_contact_force);
      in_touch += result.num_contacts;
    }
    const double error = format == Format::Fast ? 5e-3 : 1e-3;
    EXPECT_NEAR(overlap, deepest, error * deepest) << to_string(format);
    EXPECT_NEAR(force, largest, 1.5 * error * largest) << to_string(format);
    EXPECT_NEAR(in_touch, CALLS, 2) << to_string(format);
    // no energy is lost
    EXPECT_NEAR(rig.state().velocity[0], -0.5 * v, 1e-3 * v);
  }
}

TEST(SphereImpact, OfHertzThatSlidesTransfersTheCoulombImpulse)
{
  const double v_n = 0.05, v_t = 0.02, mu = 0.02;    // v_t > 7/2 mu (1 + e) v_n
  Material material = material_of(ContactLaw::Hertz);
  material.friction = mu;
  material.mindlin_stiffness = 100.0 * material.hertz_stiffness;    // reaches the limit at once
  const Spheres before = approaching(material, v_n, v_t);
  const double m = sphere_mass(material, RADIUS);
  for (const Format format : FORMATS) {
    SphereRig rig(before, options_for(before, format));
    rig.strain(Tensor3::zero(), 1e-7, 6000);
    const Spheres after = rig.state();

    const double impulse = 0.5 * m * 2.0 * v_n * mu;    // mu m* (1 + e) v_n with e = 1
    const double error = format == Format::Fast ? 2e-3 : 1e-3;
    EXPECT_NEAR(after.velocity[0], -0.5 * v_n, error * v_n) << to_string(format);
    EXPECT_NEAR(after.velocity[1], 0.6 * (0.5 * v_t - impulse / m), error * v_t);
    EXPECT_NEAR(after.velocity[2], 0.8 * (0.5 * v_t - impulse / m), error * v_t);
    // Each sphere gets the spin 5/2 J/(m r) about n x t, with the impulse J.
    const double turn = 2.5 * impulse / (m * RADIUS);
    for (int grain = 0; grain < 2; ++grain) {
      EXPECT_NEAR(after.spin[3 * grain], 0.0, error * turn);
      EXPECT_NEAR(after.spin[3 * grain + 1], 0.8 * turn, error * v_t / RADIUS);
      EXPECT_NEAR(after.spin[3 * grain + 2], -0.6 * turn, error * v_t / RADIUS);
    }
    for (int a = 0; a < 3; ++a) EXPECT_EQ(after.velocity[a], -after.velocity[3 + a]);
  }
}

TEST(SphereTurning, DecreasesByTheLimitsOfRollingAndTwisting)
{
  // Neighbouring layers of a cubic array spin in opposite directions. If the axis lies in the
  // layers, spheres roll on the neighbouring layers. If the axis is normal to the layers, they
  // twist. Each sphere has two such contacts, whose moments are at their limits.
  for (const ContactLaw law : LAWS)
    for (const bool twists : {false, true}) {
      Material material = with_resistance(material_of(law));
      material.rolling_stiffness = 1e6;
      material.twisting_stiffness = 20.0;
      const double overlap = 5e-6;
      Spheres state = simple_cubic(material, 4, RADIUS, overlap);
      const double spin = 50.0;
      for (int i = 0; i < state.num_grains(); ++i)
        state.spin[3 * i + (twists ? 0 : 2)] = i / 16 % 2 ? -spin : spin;
      const double spring = law == ContactLaw::Linear
          ? material.normal_stiffness * overlap
          : material.hertz_stiffness * std::sqrt(REDUCED_RADIUS) * std::pow(overlap, 1.5);
      // `limiting` is the normal force to which the limits of the moments are proportional.
      const double limiting = spring + 4.0 * kPi * material.surface_energy * REDUCED_RADIUS;
      const double moment = limiting *
          (twists ? material.twisting_friction : REDUCED_RADIUS * material.rolling_friction);
      const double inertia = 0.4 * sphere_mass(material, RADIUS) * RADIUS * RADIUS;
      const double stop = spin * inertia / (2.0 * moment);
      const int steps = 4000;
      SphereRig rig(state, options_for(state));
      rig.strain(Tensor3::zero(), 0.5 * stop / steps, steps);
      const Spheres after = rig.state();

      for (int i = 0; i < state.num_grains(); ++i)
        for (int a = 0; a < 3; ++a)
          EXPECT_NEAR(after.spin[3 * i + a], 0.5 * state.spin[3 * i + a], 0.015 * spin)
              << word_of(law) << (twists ? " twisting" : " rolling");
    }
}

TEST(SphereTurning, DashpotsReduceItExponentially)
{
  // Springs are hardly loaded in this short time. Each of the two contacts of a sphere has only the
  // moment of its dashpot.
  for (const bool twists : {false, true}) {
    Material material = with_dashpots(with_resistance(material_of(ContactLaw::Linear)));
    material.rolling_stiffness = 1.0;
    material.twisting_stiffness = 1e-5;
    material.rolling_friction = 1e3;
    material.twisting_friction = 1.0;
    Spheres state = simple_cubic(material, 4, RADIUS, 5e-6);
    const double spin = 50.0;
    for (int i = 0; i < state.num_grains(); ++i)
      state.spin[3 * i + (twists ? 0 : 2)] = i / 16 % 2 ? -spin : spin;
    const double inertia = 0.4 * sphere_mass(material, RADIUS) * RADIUS * RADIUS;
    const double dashpot = twists ? material.twisting_viscosity
                                  : REDUCED_RADIUS * REDUCED_RADIUS * material.rolling_viscosity;
    const double time = inertia / (4.0 * dashpot);    // the relative spin is twice the spin
    const int steps = 4000;
    SphereRig rig(state, options_for(state));
    rig.strain(Tensor3::zero(), time / steps, steps);
    const Spheres after = rig.state();
    for (int i = 0; i < state.num_grains(); ++i)
      for (int a = 0; a < 3; ++a)
        EXPECT_NEAR(after.spin[3 * i + a], std::exp(-1.0) * state.spin[3 * i + a], 1e-3 * spin)
            << (twists ? " twisting" : " rolling");
  }
}

TEST(SphereTurning, MarshallTwistingOscillatesWithTheStiffnessOfTheContactArea)
{
  for (const ContactLaw law : LAWS) {
    Material material = after_marshall(with_friction(material_of(law)));
    material.friction = 100.0;
    const double overlap = 5e-5, spin = 1.0, spacing = 2.0 * RADIUS - overlap;
    constexpr int COUNT = 8;
    std::vector<double> x;
    for (int i = 0; i < COUNT; ++i) x.insert(x.end(), {spacing * (i + 0.5), 0.02, 0.02});
    Spheres state =
        spheres(material, Tensor3{{COUNT * spacing, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 0.04}},
                std::vector<double>(COUNT, RADIUS), x);
    for (int i = 0; i < COUNT; ++i) state.spin[3 * i] = i % 2 ? -spin : spin;
    const double area = REDUCED_RADIUS * overlap;
    const double kt = law == ContactLaw::Linear ? material.tangential_stiffness
                                                : material.mindlin_stiffness * std::sqrt(area);
    const double inertia = 0.4 * sphere_mass(material, RADIUS) * RADIUS * RADIUS;
    // The spheres of the chain twist in alternating directions. Each sphere has two contacts, and a
    // contact twists by twice the angle of the sphere.
    const double frequency = std::sqrt(4.0 * 0.5 * kt * area / inertia);
    const int steps = 2000;
    SphereRig rig(state, options_for(state));
    rig.strain(Tensor3::zero(), 0.25 * kPi / frequency / steps, steps);
    EXPECT_NEAR(rig.state().spin[0], std::cos(0.25 * kPi) * spin, 2e-3 * spin) << word_of(law);
  }
}

TEST(FaceCentredCubic, OfHertzHasThePressureOfItsContacts)
{
  const double overlap = 1e-3 * RADIUS, distance = 2.0 * RADIUS - overlap;
  const Material material = with_friction(material_of(ContactLaw::Hertz));
  const Spheres state = face_centred_cubic(material, 4, RADIUS, overlap);
  const double force =
      material.hertz_stiffness * std::sqrt(REDUCED_RADIUS) * std::pow(overlap, 1.5);
  const double pressure = 2.0 * std::sqrt(2.0) * force / (distance * distance);

  for (const Format format : FORMATS) {
    const ResultOf<3> result = SphereRig(state, options_for(state, format)).advance(DriveOf<3>());

    const double error = format == Format::Fast ? 3e-4 : format == Format::Mixed ? 2e-6 : 1e-9;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        EXPECT_NEAR(result.stress(a, b), a == b ? -pressure : 0.0, error * pressure)
            << to_string(format);
  }
}

TEST(FaceCentredCubic, OfHertzHasTheElasticConstantsOfItsLatticeUnderStress)
{
  const double overlap = 1e-2 * RADIUS, l = 2.0 * RADIUS - overlap;
  const Material material = with_friction(material_of(ContactLaw::Hertz));
  const Spheres state = face_centred_cubic(material, 4, RADIUS, overlap);
  const double a = std::sqrt(REDUCED_RADIUS * overlap);
  const double kn = 1.5 * material.hertz_stiffness * a, kt = material.mindlin_stiffness * a,
               force = material.hertz_stiffness * a * overlap;
  const ElasticResultOf<3> answer = SphereRig(state, options_for(state)).stiffness();
  const auto &c = answer.stiffness.component;

  // The stiffness includes terms of the contact forces, since contacts rotate and stretch.
  const double root = std::sqrt(2.0);
  const double c11 = root / l * (kn + kt - force / l),
               c12 = root / (2.0 * l) * (kn - kt + 5.0 * force / l),
               c44 = root / (2.0 * l) * (kn + kt - 3.0 * force / l);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(c[4 * i][j], i == j ? c11 : c12, 1e-10 * c11);
  EXPECT_NEAR(c[1][3], 2.0 * c44, 1e-10 * c11);
  EXPECT_NEAR(c[2][4], 2.0 * c44, 1e-10 * c11);
  EXPECT_NEAR(c[5][5], 2.0 * c44, 1e-10 * c11);
  EXPECT_NEAR(c[1][0], 0.0, 1e-10 * c11);
}

TEST(SimpleCubic, AdhesiveArraySeparatesAtThePullOffForce)
{
  const Material material = material_of(ContactLaw::Dmt);
  const double pull_off = 4.0 * kPi * material.surface_energy * REDUCED_RADIUS;
  // The contacts are about to open, so that their spring force is nearly zero.
  const double overlap = 1e-10 * RADIUS, distance = 2.0 * RADIUS - overlap;
  Spheres state = simple_cubic(material, 4, RADIUS, overlap);
  const ResultOf<3> parting = SphereRig(state, options_for(state)).advance(DriveOf<3>());
  EXPECT_NEAR(parting.mean_stress(), -pull_off / (distance * distance),
              1e-6 * pull_off / (distance * distance));
  // At this overlap, spring force and attraction balance.
  const double rest =
      std::pow(pull_off / (material.hertz_stiffness * std::sqrt(REDUCED_RADIUS)), 2.0 / 3.0);
  state = simple_cubic(material, 4, RADIUS, rest);
  const ResultOf<3> resting = SphereRig(state, options_for(state)).advance(DriveOf<3>());
  EXPECT_NEAR(resting.mean_stress(), 0.0, 1e-9 * pull_off / (distance * distance));
}

namespace {

constexpr double DT = 2e-6;

Tensor3 shear()
{
  return Tensor3{{-2.0, 3.0, 1.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.5}};
}

struct Sums {
  double tangential = 0.0, rolling = 0.0, twisting = 0.0, contact_radius = 0.0;

  explicit Sums(const Spheres &state)
  {
    for (const PairOf<3> &pair : state.pairs) {
      tangential += dot(pair.tangential_force, pair.tangential_force);
      rolling += dot(pair.rolling_force, pair.rolling_force);
      twisting += pair.twisting_moment * pair.twisting_moment;
      contact_radius += pair.contact_radius;
    }
  }
};

}    // namespace

TEST(SphereLaws, BalanceTheirEnergy)
{
  const auto resist = [](const Material &material, int variant) {
    const Material sds = with_resistance(material);
    return variant == 0 ? material
        : variant == 1  ? sds
        : variant == 2  ? with_dashpots(sds)
                        : after_marshall(with_dashpots(sds));
  };
  for (const ContactLaw law : LAWS)
    for (const int variant : {0, 1, 2, 3}) {
      Material material = resist(with_friction(material_of(law)), variant);
      material.local_damping = 0.2;
      material.normal_viscosity = 2.0;
      if (law == ContactLaw::Linear)
        material.tangential_viscosity = 0.5;
      else
        material.mindlin_damping = 0.25;
      const Spheres state = disordered_spheres(material, 6, 2);
      Options options = options_for(state);
      options.track_energy = true;
      SphereRig rig(state, options);
      const ResultOf<3> first = rig.advance(DriveOf<3>());
      ResultOf<3> last;
      for (int call = 0; call < 5; ++call) last = rig.strain(shear(), 0.5 * DT, 400);

      const double gained =
          last.kinetic_energy + last.elastic_energy - first.kinetic_energy - first.elastic_energy;
      const double lost = last.energy.friction + last.energy.local_damping + last.energy.viscous;
      EXPECT_GT(last.energy.friction, 0.0);
      EXPECT_GT(last.energy.viscous, 0.0);
      EXPECT_NEAR(last.energy.work, gained + lost, 0.01 * (std::fabs(last.energy.work) + lost))
          << word_of(law) << " with resistance " << variant;
    }
}

TEST(SphereLaws, KeepStressAndHistoriesThroughARigidRotationAboutAnyAxis)
{
  for (const ContactLaw law : LAWS) {
    Material material = with_resistance(with_friction(material_of(law)));
    material.local_damping = 0.5;
    Spheres loose = disordered_spheres(material, 5, 4);
    for (double &w : loose.spin) w *= 10.0;
    SphereRig prepared(loose, options_for(loose));
    prepared.strain(shear(), DT, 300);
    prepared.strain(Tensor3::zero(), DT, 20000);
    Spheres still = prepared.state();
    const Vector axis{{0.48, 0.6, 0.64}};
    const int steps = 20000;
    const double rate = 0.5 * kPi / (steps * DT);
    for (int i = 0; i < still.num_grains(); ++i)
      for (int a = 0; a < 3; ++a) {
        still.velocity[3 * i + a] = 0.0;
        still.spin[3 * i + a] = rate * axis[a];
      }
    const Tensor3 spin{{0.0, -rate * axis[2], rate * axis[1], rate * axis[2], 0.0, -rate * axis[0],
                        -rate * axis[1], rate * axis[0], 0.0}};
    SphereRig rig(still, options_for(still));
    const ResultOf<3> before = rig.advance(DriveOf<3>());
    const ResultOf<3> after = rig.strain(spin, DT, steps);

    const Tensor3 turn = spatial_rotation((0.5 * kPi) * axis);
    const Tensor3 expected = turn * before.stress * transpose(turn);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        EXPECT_NEAR(after.stress(a, b), expected(a, b), 1e-3 * before.mean_stress())
            << word_of(law);
    const Sums was(still), is(rig.state());
    EXPECT_GT(was.rolling, 0.0);
    EXPECT_GT(was.twisting, 0.0);
    EXPECT_NEAR(is.tangential, was.tangential, 1e-2 * was.tangential) << word_of(law);
    EXPECT_NEAR(is.rolling, was.rolling, 1e-2 * was.rolling) << word_of(law);
    EXPECT_NEAR(is.twisting, was.twisting, 1e-2 * was.twisting) << word_of(law);
  }
}

TEST(SphereLaws, HaveTheSameStateAfterARecord)
{
  for (const ContactLaw law : LAWS) {
    const Spheres begin =
        disordered_spheres(with_resistance(with_friction(material_of(law))), 6, 5);
    SphereRig rig(begin, options_for(begin));
    rig.strain(shear(), DT, 300);
    const Spheres state = rig.state();
    const Sums all(state);
    EXPECT_GT(all.tangential, 0.0);
    EXPECT_GT(all.rolling, 0.0);
    EXPECT_GT(all.twisting, 0.0);
    EXPECT_EQ(all.contact_radius > 0.0, law != ContactLaw::Linear);

    const std::vector<char> record = serialize(state);
    const Spheres again = deserialize<3>(record.data(), record.size());
    EXPECT_EQ(contacts_of(again), contacts_of(begin));
    SphereRig one(state, options_for(state)), other(again, options_for(again));
    one.strain(shear(), DT, 300);
    other.strain(shear(), DT, 300);
    EXPECT_EQ(serialize(one.state()), serialize(other.state()));
  }
}

TEST(SphereLaws, ZeroResistanceGivesTheBitsOfTheProgramWithoutIt)
{
  for (const ContactLaw law : LAWS)
    for (const Format format : FORMATS) {
      const Spheres state = disordered_spheres(with_friction(material_of(law)), 5, 6);
      const Options plain = options_for(state, format);
      Options resisting = plain;
      resisting.contacts.rolling = true;
      SphereRig one(state, plain), other(state, resisting);
      one.strain(shear(), DT, 300);
      other.strain(shear(), DT, 300);
      EXPECT_EQ(serialize(one.state()), serialize(other.state())) << word_of(law);
    }
}

/// On CPUs with AVX2, the kernel variant without dashpots and energy bookkeeping computes several
/// grains at once.
TEST(SphereLaws, ProgramWithoutDashpotsAndEnergyHasTheBitsOfTheGeneralOne)
{
  for (const ContactLaw law : {ContactLaw::Linear, ContactLaw::Hertz})
    for (const double displacement :
         {0.0, 1.0, 2.0, 3.0})    // mindlin/force, mindlin, rescaled histories
      for (const Format format : FORMATS) {
        Material material = with_friction(material_of(law));
        if (law == ContactLaw::Hertz) material.mindlin_displacement = displacement;
        const Spheres state = disordered_spheres(material, 6, 7);
        const Options plain = options_for(state, format);
        Options has_bookkeeping = plain;
        has_bookkeeping.track_energy = true;
        SphereRig one(state, plain), other(state, has_bookkeeping);
        EXPECT_GT(one.strain(shear(), DT, 400).sliding_fraction, 0.0);
        other.strain(shear(), DT, 400);
        Spheres with_books = other.state();
        with_books.energy = one.state().energy;    // energies are not tracked without bookkeeping
        EXPECT_EQ(serialize(one.state()), serialize(with_books))
            << word_of(law) << ", mindlin_displacement " << displacement;
      }
}

/// A contact whose overlap changes keeps either its tangential force or its tangential
/// displacement. If all RVEs of an engine keep forces, the engine uses a kernel variant without
/// contact radii. If one RVE keeps displacements, all RVEs use the variant that rescales forces.
TEST(SphereLaws, KeptForcesGiveTheBitsOfTheProgramThatRescalesThem)
{
  for (const Format format : FORMATS) {
    Material material = with_friction(material_of(ContactLaw::Hertz));
    material.mindlin_displacement = 0.0;
    const Spheres state = disordered_spheres(material, 6, 7);
    Spheres companion = state;
    companion.material.mindlin_displacement = 1.0;
    std::vector<std::vector<char>> ends;
    for (const bool company : {false, true}) {
      const auto engine = make_engine<3>(options_for(state, format));
      const int rve = engine->add(state);
      if (company) engine->add(companion);
      const DriveOf<3> drive = DriveOf<3>::constant_velocity_gradient(shear(), DT, 150);
      for (int call = 0; call < 4; ++call) {
        std::vector<ResultOf<3>> results;
        engine->advance({rve}, {drive}, results);
        EXPECT_GT(results[0].sliding_fraction, 0.0);
      }
      const Spheres end = engine->state(rve);
      EXPECT_GE(end.counters.rebuilds, 3);
      int remembered = 0, touching = 0;
      for (const PairOf<3> &pair : end.pairs) {
        remembered += pair.contact_radius > 0.0;
        touching += dot(pair.tangential_force, pair.tangential_force) > 0.0;
      }
      EXPECT_EQ(remembered, touching);
      EXPECT_GT(touching, 50);
      ends.push_back(serialize(end));
    }
    EXPECT_TRUE(ends[0] == ends[1]) << to_string(format);
  }
}

TEST(SphereLaws, TimeStepIsBoundedByTwisting)
{
  // Two spheres that twist on each other have w^2 = 2 k_q / I, far above all other frequencies.
  Material material = with_resistance(material_of(ContactLaw::Hertz));
  material.twisting_stiffness = 1e5;
  Spheres state = spheres(material, 0.1 * Tensor3::identity(), {RADIUS, RADIUS},
                          {0.05, 0.05, 0.05, 0.0599, 0.05, 0.05});
  const double inertia = 0.4 * sphere_mass(material, RADIUS) * RADIUS * RADIUS;
  const double exact = 2.0 / std::sqrt(2.0 * material.twisting_stiffness / inertia);
  const auto engine = make_engine<3>(options_for(state));
  std::vector<double> bounds;
  engine->bound_time_steps({engine->add(state)}, 1.0, bounds);
  EXPECT_LE(bounds[0], exact);
  EXPECT_GT(bounds[0], 0.98 * exact);
}

TEST(SphereLaws, OfHertzAreStableBelowTheirTimeStep)
{
  // A lattice with small random velocities keeps its energy.
  const Material material = with_resistance(with_friction(material_of(ContactLaw::Hertz)));
  Spheres state = face_centred_cubic(material, 3, RADIUS, 1e-2 * RADIUS);
  Random random(7);
  for (double &v : state.velocity) v = random.uniform(-1e-4, 1e-4);
  for (double &w : state.spin) w = random.uniform(-1e-2, 1e-2);
  const auto engine = make_engine<3>(options_for(state));
  std::vector<double> bounds;
  engine->bound_time_steps({engine->add(state)}, 1.0, bounds);
  SphereRig rig(state, options_for(state));
  const ResultOf<3> before = rig.advance(DriveOf<3>());
  const ResultOf<3> after = rig.strain(Tensor3::zero(), 0.95 * bounds[0], 3000);
  EXPECT_LT(after.kinetic_energy, 2.0 * before.kinetic_energy);
}

TEST(SphereLaws, TwistingOfDisksIsAnError)
{
  RveState disks = two_disks(1e-5);
  disks.material.twisting_stiffness = 2.0;
  EXPECT_EQ(
      message_of([&] { disks.check(); }),
      "twisting stiffness is 2 [force length], and the contact law hooke of disks has no such "
      "parameter");
  Spheres spheres = simple_cubic(with_resistance(material_of(ContactLaw::Linear)), 4, RADIUS, 1e-6);
  spheres.check();
  spheres.material.twisting_friction = -1.0;
  EXPECT_EQ(message_of([&] { spheres.check(); }),
            "twisting friction is -1 [length]; it must be finite and at least 0");
}
