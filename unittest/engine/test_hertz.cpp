// SPDX-License-Identifier: GPL-2.0-only
// Contacts of Hertz and Mindlin in the whole engine: impacts of two disks compared with closed
// forms, energy, time steps, packings and files.

#include "rve/core/pi.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/packing.h"
#include "rve/engine/stability.h"
#include "support/files.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005, REDUCED_RADIUS = 0.5 * RADIUS;    // [m]
constexpr double DENSITY = 2650.0;                                 // [kg/m^3], disks of 1 m depth
constexpr double DISK_MASS = DENSITY * kPi * RADIUS * RADIUS, REDUCED_MASS = 0.5 * DISK_MASS;
constexpr double STIFFNESS = 1e8;    // k_n [N/m^2]

/// Returns a material without friction and losses.
Material hertz(double stiffness = STIFFNESS)
{
  Material material;
  material.law = ContactLaw::Hertz;
  material.hertz_stiffness = stiffness;
  material.density = DENSITY;
  material.thickness = 0.075;
  return material;
}

struct Damping {
  const char *name;
  MaterialMember member;
  double value;
};
// In the impacts below, each damping is 0.1 to 0.2 of critical damping.
constexpr Damping DAMPINGS[] = {{"none", &Material::normal_viscosity, 0.0},
                                {"velocity", &Material::normal_viscosity, 20.0},
                                {"viscoelastic", &Material::viscoelastic_damping, 4e5},
                                {"coeff_restitution", &Material::restitution_damping, 0.2}};

// Returns the largest overlap d of an impact with the velocity v: m v^2/2 = 2/5 k d^(5/2), since
// the force is f = k d^(3/2) with k = k_n sqrt(R). m and R are the reduced mass and radius.
double largest_overlap(double v)
{
  const double k = STIFFNESS * std::sqrt(REDUCED_RADIUS);
  return std::pow(1.25 * REDUCED_MASS * v * v / k, 0.4);
}
double duration(double v)
{
  return 2.9432 * largest_overlap(v) / v;
}

struct Impact {
  RveState after;
  EnergyTotals energy;
  double duration;
  double overlap;    ///< the largest overlap
};

Impact impact(const RveState &before, double dt)
{
  Options options = cpu_options();
  options.track_energy = true;
  RveRig rig(before, options);
  int in_contact = 0, steps = 0;
  double overlap = 0.0;
  do {
    rig.strain(Tensor2::zero(), dt, 1);
    EXPECT_EQ(rig.result().status & status::Fatal, 0u);
    in_contact += rig.result().num_contacts;
    overlap = std::fmax(overlap, 2.0 * RADIUS * rig.result().largest_overlap);
  } while ((rig.result().num_contacts > 0 || steps < 10) && ++steps < 100000);
  return {rig.state(), rig.result().energy, in_contact * dt, overlap};
}

/// Returns the coefficient of restitution: the ratio of the relative velocities along x after and
/// before the impact.
double restitution(const RveState &before, const RveState &after)
{
  return (after.velocity[2] - after.velocity[0]) / (before.velocity[0] - before.velocity[2]);
}

double kinetic_energy(const RveState &state)
{
  double energy = 0.0;
  for (const double v : state.velocity) energy += 0.5 * DISK_MASS * v * v;
  for (const double w : state.spin) energy += 0.25 * DISK_MASS * RADIUS * RADIUS * w * w;
  return energy;
}

// ---- packings ----

PackingRecipe recipe_of(double pressure)
{
  PackingRecipe recipe;
  recipe.material = hertz(1e10);
  recipe.material.mindlin_stiffness = 8e9;
  recipe.material.mindlin_damping = 0.5;
  recipe.material.friction = 0.4;
  recipe.material.restitution_damping = 0.1;
  recipe.material.mindlin_displacement = 1.0;
  recipe.material.local_damping = 0.2;
  recipe.num_grains = 100;
  recipe.radius_min = 0.0025;
  recipe.radius_max = 0.005;
  recipe.pressure = pressure;
  return recipe;
}

RveState packing_at(double pressure)
{
  Options options = cpu_options();
  const PackingRecipe recipe = recipe_of(pressure);
  options.contacts = contacts_of(recipe.material);
  const auto engine = make_engine(options);
  return generate_packing(recipe, *engine);
}

const RveState &packing()
{
  static const RveState STATE = packing_at(20e3);
  return STATE;
}

double time_step()
{
  return 0.5 * stable_time_step(packing());
}

/// Returns the state after 0.5 % of shear, with tangential forces at all contacts.
RveState sheared(const RveState &state)
{
  RveRig rig(state);
  rig.strain(gradient(0, 1, 0.5), time_step(), 100, static_cast<int>(1e-4 / time_step()));
  return rig.state();
}

/// Returns the highest frequency of a packing with sticking contacts. It assembles the matrix for
/// x, y and theta of all grains and uses power iteration.
double frequency_of_matrix(const RveState &state)
{
  const int size = 3 * state.num_grains();
  std::vector<double> scale(size), matrix(size * size, 0.0);    // M^-1/2, M^-1/2 K M^-1/2
  for (int k = 0; k < size; ++k) {
    const double r = state.radius[k / 3], mass = state.material.density * kPi * r * r;
    scale[k] = 1.0 / std::sqrt(k % 3 == 2 ? 0.5 * mass * r * r : mass);
  }
  for (const TouchingPair &contact : find_contacts(state)) {
    const int i = 3 * contact.first, j = 3 * contact.second;
    const double r_i = state.radius[contact.first], r_j = state.radius[contact.second];
    const double a = std::sqrt(r_i * r_j / (r_i + r_j) * contact.overlap);
    const double n_x = contact.normal[0], n_y = contact.normal[1];
    const double arm_i = r_i - 0.5 * contact.overlap, arm_j = r_j - 0.5 * contact.overlap;
    const int row[6] = {i, i + 1, i + 2, j, j + 1, j + 2};
    const double normal[6] = {-n_x, -n_y, 0.0, n_x, n_y, 0.0};
    const double tangent[6] = {n_y, -n_x, -arm_i, -n_y, n_x, -arm_j};
    for (int p = 0; p < 6; ++p)
      for (int q = 0; q < 6; ++q)
        matrix[row[p] * size + row[q]] += scale[row[p]] * scale[row[q]] * a *
            (1.5 * state.material.hertz_stiffness * normal[p] * normal[q] +
             state.material.mindlin_stiffness * tangent[p] * tangent[q]);
  }
  std::vector<double> x(size), y(size);
  for (int k = 0; k < size; ++k) x[k] = 1.0 + 0.1 * (k % 7);
  double eigenvalue = 0.0;
  for (int iteration = 0; iteration < 3000; ++iteration) {
    double square = 0.0;
    for (int p = 0; p < size; ++p) {
      y[p] = 0.0;
      for (int q = 0; q < size; ++q) y[p] += matrix[p * size + q] * x[q];
      square += y[p] * y[p];
    }
    eigenvalue = std::sqrt(square);
    for (int p = 0; p < size; ++p) x[p] = y[p] / eigenvalue;
  }
  return std::sqrt(eigenvalue);
}

double bound_of(const RveState &state)
{
  const auto engine = make_engine(with_contacts_of({state}, cpu_options()));
  std::vector<double> bounds;
  engine->bound_time_steps({engine->add(state)}, 10.0 * stable_time_step(state), bounds);
  return bounds.at(0);
}

}    // namespace

// ---- impacts ----

TEST(HertzImpact, HasTheOverlapAndTheDurationOfTheClosedForm)
{
  for (const double v : {0.01, 0.1}) {
    const double dt = duration(v) / 4000.0;
    const RveState before = approaching_disks(RADIUS, hertz(), v);

    const Impact found = impact(before, dt);

    EXPECT_NEAR(found.overlap / largest_overlap(v), 1.0, 1e-5);
    EXPECT_NEAR(found.duration, duration(v), 2.0 * dt);
    EXPECT_NEAR(restitution(before, found.after), 1.0, 1e-5);
  }
}

TEST(HertzImpact, RestitutionDoesNotDependOnTheVelocity)
{
  for (const double e : {0.3, 0.6, 0.9})
    for (const double v : {0.001, 0.01, 0.1}) {
      Material material = hertz();
      material.restitution_damping = std::sqrt(5.0) * -std::log(e) / std::hypot(kPi, std::log(e));
      const RveState before = approaching_disks(RADIUS, material, v);

      const Impact found = impact(before, duration(v) / 4000.0);

      // The error arises since the dashpot uses the velocity half a step earlier.
      EXPECT_NEAR(restitution(before, found.after), e, 1e-3) << "e " << e << " v " << v;
    }
}

TEST(HertzImpact, OtherDashpotsHaveVelocityDependentRestitution)
{
  const auto restitution_at = [](const Damping &damping, double v) {
    Material material = hertz();
    material.*damping.member = damping.value;
    const RveState before = approaching_disks(RADIUS, material, v);
    return restitution(before, impact(before, duration(v) / 1000.0).after);
  };
  // The loss 1 - e of the restitution e is proportional to the rate gamma/m times the duration of
  // the contact. The loss grows as v^-1/5 for a constant gamma, and as v^1/5 if gamma is
  // proportional to the contact radius.
  EXPECT_LT(restitution_at(DAMPINGS[1], 0.01), restitution_at(DAMPINGS[1], 0.1) - 0.02);
  EXPECT_GT(restitution_at(DAMPINGS[2], 0.01), restitution_at(DAMPINGS[2], 0.1) + 0.02);
}

TEST(HertzImpact, BalancesItsEnergyWithEveryDamping)
{
  const double v = 0.1;
  for (const double keeps_displacement : {0.0, 1.0})
    for (const Damping &damping : DAMPINGS)
      for (const double tangential_velocity : {0.03, 0.1}) {    // sticks, slides
        // Just before a contact opens, its radius a vanishes. A dashpot that acts on this contact
        // lets it slide. The energy f^2/(2 k_t a) of its tangential spring then grows without
        // limit, until the contact opens and the energy is lost.
        const bool is_sliding = tangential_velocity > 0.05;
        SCOPED_TRACE(std::string(damping.name) +
                     (keeps_displacement > 0.0 ? ", mindlin" : ", mindlin/force") + ", v_t " +
                     std::to_string(tangential_velocity));
        Material material = hertz();
        material.friction = 0.3;
        material.mindlin_stiffness = 0.8 * STIFFNESS;
        material.mindlin_displacement = keeps_displacement;
        material.mindlin_damping = 0.5;
        material.*damping.member = damping.value;
        const RveState before = approaching_disks(RADIUS, material, v, tangential_velocity);

        const auto residual = [&](int steps) {
          const Impact found = impact(before, duration(v) / steps);
          const double lost = kinetic_energy(before) - kinetic_energy(found.after);
          EXPECT_EQ(found.energy.viscous > 0.0, damping.value > 0.0);
          if (is_sliding || damping.value > 0.0) { EXPECT_GT(lost, 0.01 * kinetic_energy(before)); }
          // A contact that grows and shrinks can release more energy than it has stored. The
          // dissipation that is counted as friction is then negative.
          const double dissipation = found.energy.friction + found.energy.viscous;
          return std::fabs(lost - dissipation) / kinetic_energy(before);
        };
        // The residual is of first order in the time step.
        const double coarse = residual(1000), fine = residual(8000);
        EXPECT_LT(fine, 1e-3);
        EXPECT_LT(fine, std::fmax(0.5 * coarse, 1e-4));
      }
}

TEST(HertzImpact, GrossSlidingTransfersTheCoulombImpulse)
{
  // The velocity is so small that neither the overlap nor the rotation of the normal matters.
  const double v = 1e-6, v_t = 3e-6, mu = 0.1;
  for (const double keeps_displacement : {0.0, 1.0}) {
    Material material = hertz();
    material.friction = mu;
    material.mindlin_stiffness = 1e4 * STIFFNESS;    // reaches the limit at once
    material.mindlin_displacement = keeps_displacement;
    const RveState before = approaching_disks(RADIUS, material, v, v_t);

    const Impact found = impact(before, duration(v) / 4000.0);

    // The tangential impulse is J = mu m (1 + e) v_n, with the reduced mass m. J changes the
    // velocities of the centres. The angular impulse r J, with the radius r, changes the spins of
    // the disks with the inertia I = M r^2/2.
    const double change = (found.after.velocity[3] - found.after.velocity[1]) + v_t;
    EXPECT_NEAR(restitution(before, found.after), 1.0, 1e-4);
    EXPECT_NEAR(change, mu * 2.0 * v, 1e-4 * v);
    EXPECT_NEAR(std::fabs(found.after.spin[0]), mu * 2.0 * v / RADIUS, 1e-4 * v / RADIUS);
    EXPECT_LT(found.after.spin[0], 0.0);
    EXPECT_NEAR(found.after.spin[1] / found.after.spin[0], 1.0, 1e-12);
  }
}

// ---- time steps ----

TEST(HertzTimeStep, FallsWithTheQuarterPowerOfTheOverlap)
{
  const auto step_at = [](double overlap) {
    RveState state = two_disks(overlap);
    state.material = hertz();
    return stable_time_step(state);
  };
  // `k` is the normal stiffness 3/2 k_n sqrt(R d), with the reduced radius R and the overlap d.
  const double r = 0.005 * 0.004 / 0.009, k = 1.5 * STIFFNESS * std::sqrt(r * 1e-5);
  const double mass = DENSITY * kPi * 25e-6 * 16e-6 / 41e-6;
  EXPECT_NEAR(step_at(1e-5) / (2.0 * std::sqrt(mass / k)), 1.0, 1e-9);
  EXPECT_NEAR(step_at(1e-5) / step_at(16e-5), 2.0, 1e-9);
}

TEST(HertzTimeStep, FollowsFromTheMatrixOfAllMotionsAndBoundsTheEngine)
{
  RveState state = packing();
  state.material.local_damping = state.material.restitution_damping = 0.0;
  const double exact = stable_time_step(state);
  EXPECT_NEAR(exact * frequency_of_matrix(state), 2.0, 2e-4);
  EXPECT_LE(bound_of(state), exact);
  EXPECT_GE(bound_of(state), exact / 1.05);
}

TEST(HertzTimeStep, OfTheEngineIsBelowThatOfAStateWithEveryDamping)
{
  for (const Damping &damping : DAMPINGS) {
    SCOPED_TRACE(damping.name);
    RveState state = sheared(packing());
    state.material.restitution_damping = 0.0;
    state.material.*damping.member = damping.value;
    const double exact = stable_time_step(state), bound = bound_of(state);
    EXPECT_LE(bound, exact);
    EXPECT_GE(bound, exact / 1.05);
  }
}

// ---- packings ----

TEST(HertzPacking, ReachesItsPressureAndCompressesByHertzLaw)
{
  const auto result_at = [](double pressure) {
    RveRig rig(packing_at(pressure));
    const Result result = rig.evaluate();
    EXPECT_NEAR(-result.stress(0, 0) / pressure, 1.0, 2e-3);
    EXPECT_NEAR(-result.stress(1, 1) / pressure, 1.0, 2e-3);
    EXPECT_GT(result.coordination_number, 3.5);
    return result;
  };
  // f = k d^(3/2): eight times the pressure gives four times the overlap, apart from new contacts.
  const double ratio = result_at(20e3).mean_overlap / result_at(2.5e3).mean_overlap;
  EXPECT_NEAR(ratio, 4.0, 0.4);
}

TEST(HertzPacking, ContinuesToTheSameBitsFromImagesAndFiles)
{
  const RveState state = sheared(packing());
  ASSERT_EQ(remembered_numbers(state.pairs), 3);
  for (const Format format : ALL_FORMATS) {
    SCOPED_TRACE(to_string(format));
    RveRig rig(state, cpu_options(format));
    rig.strain(gradient(0, 1, 0.5), time_step(), 100);
    const RveState half = rig.state();
    const std::vector<char> bytes = serialize(half);
    const std::string path = temporary_path("half.rve");
    write_packing(path, half);

    RveRig from_bytes(deserialize(bytes.data(), bytes.size()), cpu_options(format));
    RveRig from_file(read_packing(path), cpu_options(format));
    for (RveRig *each : {&rig, &from_bytes, &from_file})
      each->strain(gradient(0, 1, 0.5), time_step(), 100);

    EXPECT_TRUE(same_motion(rig.state(), from_bytes.state()));
    EXPECT_TRUE(same_answer(rig.result(), from_bytes.result()));
    EXPECT_TRUE(same_motion(rig.state(), from_file.state()));
    EXPECT_TRUE(same_answer(rig.result(), from_file.result()));
  }
}

/// On CPUs with AVX2, the kernel variant without dashpots and energy bookkeeping computes several
/// grains at once.
TEST(HertzPacking, ProgramWithoutDashpotsAndEnergyHasTheBitsOfTheGeneralOne)
{
  RveState state = sheared(packing());
  state.material.restitution_damping = 0.0;
  // The values select mindlin/force, mindlin, and the two laws with rescaled histories.
  for (const double displacement : {0.0, 1.0, 2.0, 3.0})
    for (const Format format : ALL_FORMATS) {
      state.material.mindlin_displacement = displacement;
      Options has_bookkeeping = cpu_options(format);
      has_bookkeeping.track_energy = true;
      RveRig one(state, cpu_options(format)), other(state, has_bookkeeping);
      for (RveRig *each : {&one, &other}) each->strain(gradient(0, 1, 2.0), time_step(), 400);
      EXPECT_GT(one.result().sliding_fraction, 0.0);
      RveState with_books = other.state();
      with_books.energy = one.state().energy;    // energies are not tracked without bookkeeping
      EXPECT_EQ(serialize(one.state()), serialize(with_books))
          << "mindlin_displacement " << displacement;
    }
}

TEST(HertzPacking, HasTheSameResponseInAllFormats)
{
  const RveState state = sheared(packing());
  const auto stress_in = [&](Format format) {
    RveRig rig(state, cpu_options(format));
    return rig.strain(gradient(0, 1, 0.5), time_step(), 200).stress;
  };
  const Tensor2 exact = stress_in(Format::Double);
  const double p = -0.5 * trace(exact);
  const auto error_of = [&](Format format) {
    const Tensor2 error = stress_in(format) - exact;
    return std::hypot(std::hypot(error(0, 0), error(1, 1)), std::hypot(error(0, 1), error(1, 0)));
  };
  EXPECT_LT(error_of(Format::Mixed), 1e-4 * p);
  EXPECT_LT(error_of(Format::Fast), 1e-2 * p);
}

TEST(HertzPacking, RigidRotationRotatesItsStress)
{
  for (const double keeps_displacement : {0.0, 1.0}) {
    RveState state = sheared(packing());
    Tensor2 before;
    state.material.mindlin_displacement = keeps_displacement;
    {
      RveRig rest(state);
      rest.strain(Tensor2::zero(), time_step(), 20000);
      state = rest.state();
      before = rest.result().stress;
    }
    constexpr double RATE = 10.0;    // [rad/s]
    for (double &spin : state.spin) spin = RATE;
    RveRig rig(state);
    const int steps = 1 + static_cast<int>(0.5 * kPi / RATE / time_step() / 20.0);
    rig.strain(spin_gradient(RATE), 0.5 * kPi / RATE / (20 * steps), steps, 20);

    // The rotation matrix of a quarter turn is R = (0 -1; 1 0).
    const Tensor2 &after = rig.result().stress;
    const double p = -0.5 * trace(before), tolerance = 2e-3 * p;
    EXPECT_NEAR(after(0, 0), before(1, 1), tolerance);
    EXPECT_NEAR(after(1, 1), before(0, 0), tolerance);
    EXPECT_NEAR(after(0, 1), -before(1, 0), tolerance);
    EXPECT_GT(std::fabs(before(0, 1)), 0.05 * p);
  }
}
