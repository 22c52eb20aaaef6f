// SPDX-License-Identifier: GPL-2.0-only
// Conversion of a macro step into DEM steps: polar decomposition, affine stiffness, adaptive
// substeps, and advice.

#include "oracle/affine_stiffness.h"
#include "support/lattice.h"
#include "support/rve_rig.h"

#include "rve/core/error.h"
#include "rve/engine/advice.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/substeps.h"

#include <cstring>
#include <gtest/gtest.h>
#include <random>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;

/// Returns the paper's packing after 1 % of shear and a rest, with tangential forces at all
/// contacts and some contacts at the Coulomb limit.
RveState sheared_packing()
{
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 0.05), DT, 2000, 2);
  rig.strain(Tensor2::zero(), DT, 4000);
  RveState state = rig.state();
  // Velocities are exactly zero, so that no contact slides in a small step.
  std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
  std::fill(state.spin.begin(), state.spin.end(), 0.0);
  state.material.friction = 10.0;
  return state;
}

/// Returns the state after a rigid rotation of cell, deformation and velocities; fractional
/// coordinates, spins and contact history do not change.
RveState turned(RveState state, const Tensor2 &rotation)
{
  for (Tensor2 *columns : {&state.cell, &state.list_cell, &state.deformation})
    *columns = rotation * *columns;
  state.servo_velocity_gradient = rotation * state.servo_velocity_gradient * transpose(rotation);
  for (int i = 0; i < state.num_grains(); ++i) {
    const Vec<double, 2> velocity =
        rotation * Vec<double, 2>{{state.velocity[2 * i], state.velocity[2 * i + 1]}};
    for (int a = 0; a < 2; ++a) state.velocity[2 * i + a] = velocity[a];
  }
  return state;
}

const Tensor2 SOME_STRAIN{{0.3, -0.5, -0.5, -0.8}};

bool has(const std::vector<Advice> &list, AdviceKind kind)
{
  return std::any_of(list.begin(), list.end(),
                     [&](const Advice &advice) { return advice.kind == kind; });
}

}    // namespace

TEST(FiniteStrain, RotationAndStretchAreRecovered)
{
  const Tensor2 stretch = Tensor2::identity() + 0.1 * SOME_STRAIN;
  for (const double angle : {0.0, 1e-9, 0.3, -2.0, 3.1}) {
    const PolarDecomposition polar(plane_rotation(angle) * stretch);

    EXPECT_NEAR(polar.angle, angle, 1e-15 * 4);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(polar.strain.component[k], 0.1 * SOME_STRAIN.component[k], 1e-15);
    EXPECT_LT(strain_size(plane_rotation(angle)), 1e-15);
  }
}

namespace {

/// Calls f for strains of several sizes and rotations by several angles in random directions.
template <int D, class F> void for_increments(const F &f)
{
  std::mt19937 numbers(4711);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const double strain : {0.0, 1e-7, 1e-5, 1e-3, 0.02, 0.3})
    for (const double angle : {0.0, 1e-9, 1e-6, 1e-3, 0.1, 0.4, 1.5, 3.0})
      for (int direction = 0; direction < 20; ++direction) {
        auto stretch = rve::Tensor<double, D>::zero();
        for (int a = 0; a < D; ++a)
          for (int b = a; b < D; ++b) stretch(a, b) = stretch(b, a) = uniform(numbers);
        stretch = rve::Tensor<double, D>::identity() + (strain / rve::norm(stretch)) * stretch;
        if constexpr (D == 2) {
          f(plane_rotation(angle) * stretch, strain, angle);
        } else {
          rve::Vec<double, 3> axis{{uniform(numbers), uniform(numbers), uniform(numbers)}};
          axis = (angle / std::sqrt(rve::dot(axis, axis))) * axis;
          f(rve::spatial_rotation(axis) * stretch, strain, angle);
        }
      }
}

template <int D> void expect_sizes_of_increments()
{
  for_increments<D>([](const rve::Tensor<double, D> &increment, double strain, double angle) {
    // The increment has rounding errors of 1e-16.
    EXPECT_NEAR(strain_size(increment), strain, 2e-15 + 1e-12 * strain) << strain << " " << angle;
    const double bound = rve::bound_of_rotation(increment);
    EXPECT_GE(bound, angle - 1e-15) << strain;
    const bool is_large = angle > 0.1 || strain > 1e-3;
    EXPECT_TRUE(is_large || bound <= 1.2 * angle + 1e-15) << strain << " " << angle << " " << bound;
  });
}

}    // namespace

TEST(FiniteStrain, SizeOfTheStrainAndBoundOfTheRotationNeedNoDecomposition)
{
  expect_sizes_of_increments<2>();
  expect_sizes_of_increments<3>();
}

TEST(FiniteStrain, AnglesAgreeWithTheLibraryFunctions)
{
  for (int k = 0; k <= 1000; ++k) {
    const double angle = 0.001 * k * rve::kPi;
    const double exact = std::atan2(std::sin(angle), std::cos(angle));
    // The series gives an error of one unit in the last place, and each halving of the angle adds
    // another.
    EXPECT_NEAR(rve::angle_of(std::sin(angle), std::cos(angle)), exact,
                (exact < 0.1 ? 3e-16 : 1e-15) * exact);
  }
  EXPECT_EQ(rve::angle_of(1e-12, 1.0), 1e-12);
  EXPECT_EQ(rve::angle_of(0.0, -1.0), rve::kPi);
}

namespace {
template <int D> void expect_that_rotations_are_taken()
{
  for_increments<D>([](const rve::Tensor<double, D> &increment, double strain, double angle) {
    rve::Tensor<double, D> stretch = increment;
    const rve::Tensor<double, D> rotation = rve::take_rotation(stretch);

    EXPECT_NEAR(rve::angle_of_rotation(rotation), angle, 4e-15) << strain;
    const rve::Tensor<double, D> lost = stretch * rotation - increment;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        EXPECT_NEAR(stretch(a, b), stretch(b, a), 2e-15) << strain << " " << angle;
        EXPECT_NEAR(lost(a, b), 0.0, 2e-15) << strain << " " << angle;
      }
    EXPECT_NEAR(strain_size(stretch), strain, 2e-15 + 1e-12 * strain) << angle;
  });
}
}    // namespace

TEST(FiniteStrain, RemovingTheRotationLeavesTheStretch)
{
  expect_that_rotations_are_taken<2>();
  expect_that_rotations_are_taken<3>();
}

TEST(FiniteStrain, PartsOfAnIncrementFollowThePathOfTheEngine)
{
  // Without contacts, fractional coordinates do not change, so that the cell alone shows the path.
  const Tensor2 increment = plane_rotation(0.3) * (Tensor2::identity() + 0.02 * SOME_STRAIN);
  RveRig whole(paper_gas()), parts(paper_gas());
  Drive drive;
  drive.dt = DT;
  drive.substeps = 60;
  drive.deformation = increment;
  whole.advance(drive);

  Tensor2 before = Tensor2::identity();
  drive.substeps = 20;
  for (const double share : {1.0 / 3.0, 2.0 / 3.0, 1.0}) {
    const Tensor2 after = part_of_increment(increment, share);
    drive.deformation = after * inverse(before);
    parts.advance(drive);
    before = after;
  }

  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(parts.result().cell.component[k], whole.result().cell.component[k], 1e-15);
}

TEST(RigidTurn, RotatedRveHasTheRotatedStressAndResponse)
{
  RveState state = sheared_packing();
  state.material.local_damping =
      0.0;    // Cundall's damping acts on components and depends on the axes
  const Tensor2 rotation = plane_rotation(1.2);
  RveRig first(state), second(state);
  const Tensor2 l{{0.0, 0.05, 0.0, -0.02}};

  second.owner().turn({second.rve_number()}, {rotation});
  first.strain(l, DT, 200);
  second.strain(rotation * l * transpose(rotation), DT, 200);

  const Tensor2 expected = rotation * first.result().stress * transpose(rotation);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(second.result().stress.component[k], expected.component[k],
                1e-9 * first.result().mean_stress());
  EXPECT_EQ(second.result().num_contacts, first.result().num_contacts);
}

TEST(RigidTurn, RotatesTheStateToTheBitAndNoOther)
{
  for (const Format format : ALL_FORMATS) {
    SCOPED_TRACE(to_string(format));
    RveRig rig(paper_packing(), cpu_options(format));
    rig.strain(gradient(0, 1, 0.5), DT, 400, 2);    // the packing moves, and its list is not new
    Engine &engine = rig.owner();
    const RveState state = rig.state();
    const int alone = engine.add(paper_packing()), other = engine.add(state);
    const auto before = serialize(engine.state(alone));

    engine.turn({other, rig.rve_number()}, {plane_rotation(-0.4), plane_rotation(1.2)});

    // Returns the rotated state after an engine has stored it with the precision of the format.
    const auto stored = [&](double angle) {
      RveRig copy(turned(state, plane_rotation(angle)), cpu_options(format));
      return serialize(copy.state());
    };
    EXPECT_EQ(serialize(rig.state()), stored(1.2));
    EXPECT_EQ(serialize(engine.state(other)), stored(-0.4));
    EXPECT_EQ(serialize(engine.state(alone)), before);
  }
}

TEST(RigidTurn, RefusesTensorsOtherThanRotations)
{
  RveRig rig(paper_packing());
  const auto before = serialize(rig.state());

  for (const Tensor2 &tensor :
       {1.001 * Tensor2::identity(), Tensor2{{1.0, 0.0, 0.0, -1.0}}, Tensor2::zero()})
    EXPECT_THROW(rig.owner().turn({rig.rve_number()}, {tensor}), InputError);
  EXPECT_THROW(rig.owner().turn({7}, {Tensor2::identity()}), InputError);
  EXPECT_EQ(serialize(rig.state()), before);
}

TEST(Engine, NextRveTakesTheIndexOfARemovedOne)
{
  const auto engine = make_engine(cpu_options());
  std::vector<int> numbers;
  for (int k = 0; k < 4; ++k) numbers.push_back(engine->add(paper_packing()));
  engine->remove(numbers[0]);
  engine->remove(numbers[2]);

  EXPECT_EQ(engine->add(paper_packing()), numbers[2]);
}

TEST(AffineStiffness, IsTheStressOfTheFirstStepOfAnRveAtRest)
{
  const RveState state = sheared_packing();
  const AffineStiffness stiffness = affine_stiffness(state);
  const double size = 1e-8;
  for (const Tensor2 &strain : {Tensor2{{1.0, 0.0, 0.0, 0.0}}, Tensor2{{0.0, 0.0, 0.0, 1.0}},
                                Tensor2{{0.0, 1.0, 1.0, 0.0}}, SOME_STRAIN}) {
    RveRig rig(state);
    const Tensor2 before = rig.evaluate().stress;
    Drive drive;
    drive.dt = 1e-9;    // grains hardly move
    drive.substeps = 1;
    drive.deformation = Tensor2::identity() + size * strain;

    const Tensor2 rate = (1.0 / size) * (rig.advance(drive).stress - before);

    // The error is of second order in the strain. Contacts that open or close add a relative error
    // of 1e-8 / 4e-3, the strain divided by the mean relative overlap.
    const Tensor2 expected = stiffness(strain);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(rate.component[k], expected.component[k], 2e-5 * norm(expected)) << k;
  }
}

TEST(AffineStiffness, OfALatticeIsItsShearModulus)
{
  const Material material = paper_material();
  const AffineStiffness stiffness = affine_stiffness(hexagonal_lattice(material, 0.005, 1e-9));

  const Tensor2 stress = stiffness(Tensor2{{0.0, 1.0, 1.0, 0.0}});

  // The relative error is the relative overlap.
  EXPECT_NEAR(stress(0, 1) / (2.0 * lattice_shear_modulus(material)), 1.0, 1e-6);
  EXPECT_NEAR(stress(1, 0) / (2.0 * lattice_shear_modulus(material)), 1.0, 1e-6);
  EXPECT_NEAR(stress(0, 0) / stress(0, 1), 0.0, 1e-12);
}

// ---- the stiffness that the engine returns ------------------------------------------------------

namespace {

/// Returns the relative error of contact forces and branch vectors in a format. In `double` the
/// error is the unit of the integer sums, 2^-40 of the stiffest contact.
double error_of(Format format)
{
  return format == Format::Double ? 1e-11 : 1e-6;
}

/// A deformed packing with sliding contacts. Variations add dashpots, remove friction, stiffen the
/// tangential springs, add pairs by a thick skin, or make radii very unequal.
struct StiffnessCase {
  const char *name;
  RveState state;
  double skin = 0.0;
};

std::vector<StiffnessCase> stiffness_cases()
{
  std::vector<StiffnessCase> cases;
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 0.5), DT, 400, 2);
  const RveState sheared = rig.state();
  cases.push_back({"sliding", sheared});
  cases.push_back({"dashpots", sheared});
  cases.back().state.material.normal_viscosity = 3.0;
  cases.back().state.material.tangential_viscosity = 1.5;
  cases.push_back({"no friction", sheared});
  cases.back().state.material.friction = 0.0;
  cases.push_back({"stiff along the contact", sheared});
  cases.back().state.material.tangential_stiffness *= 300.0;
  cases.push_back({"extra pairs", sheared, 5e-3});
  cases.push_back({"pebbles in sand", sheared});
  for (std::size_t i = 0; i < sheared.radius.size(); i += 7)
    cases.back().state.radius[i] *= i % 2 ? 0.1 : 0.9;
  return cases;
}

ElasticResult elastic_answer(Engine &engine, int rve, const Drive &drive = Drive())
{
  std::vector<ElasticResult> answers;
  engine.advance({rve}, {drive}, answers);
  return answers[0];
}

bool same_bits(const AffineStiffness &a, const AffineStiffness &b)
{
  return std::memcmp(&a, &b, sizeof(a)) == 0;
}

}    // namespace

TEST(AffineStiffness, EngineAgreesWithTheState)
{
  for (const StiffnessCase &one : stiffness_cases())
    for (const Format format : {Format::Double, Format::Mixed, Format::Fast, Format::Single}) {
      SCOPED_TRACE(std::string(one.name) + ", " + to_string(format));
      Options options = cpu_options(format);
      options.skin = one.skin;
      const auto engine = make_engine(options);
      const int rve = engine->add(one.state);

      const ElasticResult answer = elastic_answer(*engine, rve);

      const AffineStiffness expected = affine_stiffness(engine->state(rve));
      double size = 0.0;
      for (const auto &row : expected.component)
        for (const double x : row) size = std::max(size, std::fabs(x));
      ASSERT_GT(size, 0.0);
      for (int c = 0; c < 4; ++c)
        for (int e = 0; e < 3; ++e)
          EXPECT_NEAR(answer.stiffness.component[c][e], expected.component[c][e],
                      error_of(format) * size)
              << c << e;
    }
}

TEST(AffineStiffness, HasTheSameBitsInEveryCallForAConfiguration)
{
  const RveState state = stiffness_cases()[0].state;
  const Drive shear = Drive::constant_velocity_gradient(gradient(0, 1, 0.5), DT, 30);
  for (const Format format : ALL_FORMATS) {
    SCOPED_TRACE(to_string(format));
    const auto engine = make_engine(cpu_options(format)), other = make_engine(cpu_options(format));
    const int rve = engine->add(state);

    const ElasticResult moved = elastic_answer(*engine, rve, shear);

    // The stiffness has the same bits in an evaluation after the call, in another engine, with
    // another force scale, and with grains and pairs in another order.
    EXPECT_TRUE(same_bits(moved.stiffness, elastic_answer(*engine, rve).stiffness));
    RveState copy = engine->state(rve);
    EXPECT_TRUE(same_bits(moved.stiffness, elastic_answer(*other, other->add(copy)).stiffness));
    copy.largest_contact_force *= 70.0;
    EXPECT_TRUE(same_bits(moved.stiffness, elastic_answer(*other, other->add(copy)).stiffness));
    std::reverse(copy.order.begin(), copy.order.end());
    std::reverse(copy.pairs.begin(), copy.pairs.end());
    for (Pair &pair : copy.pairs) std::swap(pair.first, pair.second);
    EXPECT_TRUE(same_bits(moved.stiffness, elastic_answer(*other, other->add(copy)).stiffness));
  }
}

TEST(AffineStiffness, HugeSpringsAreLimitedAndNoSumOverflows)
{
  // The engine limits forces to 8 K L. K is at most twice the largest stiffness, and L at most four
  // times the largest radius. The springs of this test exceed the limit. Such springs are not
  // physical, but a file can contain them.
  for (const Format format : ALL_FORMATS) {
    SCOPED_TRACE(to_string(format));
    RveState state = stiffness_cases()[0].state;
    const auto with_springs = [&](double force) {
      for (Pair &pair : state.pairs) pair.tangential_force = force;
      const auto engine = make_engine(cpu_options(format));
      return elastic_answer(*engine, engine->add(state)).stiffness;
    };
    const double longest = 32.0 * state.material.normal_stiffness * 2.0 *
        *std::max_element(state.radius.begin(), state.radius.end());

    const AffineStiffness far = with_springs(longest), farther = with_springs(1e12 * longest);

    EXPECT_TRUE(same_bits(far, farther));
    for (const auto &row : far.component)
      for (const double x : row) {
        EXPECT_TRUE(std::isfinite(x));
        EXPECT_LT(std::fabs(x), 1e10);    // a thousand contacts with at most 2^5 K L^2 / V each
      }
  }
}

TEST(AffineStiffness, RequestDoesNotChangeOtherResults)
{
  for (const StiffnessCase &one : stiffness_cases()) {
    SCOPED_TRACE(one.name);
    const Drive shear = Drive::constant_velocity_gradient(gradient(0, 1, 0.5), DT, 30);
    RveRig without(one.state), with(one.state);

    for (int call = 0; call < 2; ++call) {
      const ElasticResult answer = elastic_answer(with.owner(), with.rve_number(), shear);
      EXPECT_TRUE(same_answer(answer.result, without.advance(shear)));
    }
    EXPECT_EQ(serialize(with.state()), serialize(without.state()));
  }
}

TEST(AffineStiffness, IsZeroWithoutContactsAndNanAfterAFailedCall)
{
  const auto engine = make_engine(cpu_options());
  const int gas = engine->add(paper_gas()), crushed = engine->add(paper_packing());
  const Drive crush = Drive::constant_velocity_gradient(Tensor2{{-20.0, 0.0, 0.0, -20.0}}, DT, 600);
  std::vector<ElasticResult> answers;

  engine->advance({crushed, gas}, {crush, Drive()}, answers);

  EXPECT_NE(answers[0].result.status & status::Fatal, 0u);
  for (const ElasticResult &answer : answers)
    EXPECT_TRUE(same_bits(answer.stiffness, AffineStiffness()));
  EXPECT_EQ(answers[0].result.num_grains, 400);
  EXPECT_NEAR(answers[0].result.void_ratio, RveRig(paper_packing()).evaluate().void_ratio, 0.0);
}

TEST(AdaptiveSubsteps, KeepStrainPerStepAndInertialNumberBelowTheirBounds)
{
  const RveState state = paper_packing();
  RveRig rig(state);
  const Result result = rig.evaluate();
  const double pressure = result.mean_stress(), size = grain_size(result);
  const double density = inertial_density(state.material);
  for (const double strain : {1e-12, 1e-7, 1e-5, 1e-3, 1e-2}) {
    const AdaptiveSubsteps by_strain{1e-5, 1e9, 1000000}, by_inertia{1e9, 1e-4, 1000000};

    const int strain_steps = by_strain.of(strain, DT, pressure, size, density);
    const int inertia_steps = by_inertia.of(strain, DT, pressure, size, density);
    const auto inertia = [&](int n) {
      return inertial_number(result, state.material, strain / (n * DT));
    };

    EXPECT_LE(strain / strain_steps, 1e-5 * (1.0 + 1e-12));
    EXPECT_LE(inertia(inertia_steps), 1e-4 * (1.0 + 1e-12));
    if (strain_steps > 1) { EXPECT_GT(strain / (strain_steps - 1), 1e-5 * (1.0 - 1e-12)); }
    if (inertia_steps > 1) { EXPECT_GT(inertia(inertia_steps - 1), 1e-4 * (1.0 - 1e-12)); }
  }
  EXPECT_EQ((AdaptiveSubsteps{1e-5, 1.0, 50}.of(1e-2, DT, pressure, size, density)), 50);
}

TEST(AdaptiveSubsteps, InertialNumberIsThatOfTheFormula)
{
  // For grains of one size d, the inertial number is I = rate d sqrt(rho depth / (p h)), with the
  // pressure p and the thickness h.
  const Material material = paper_material();
  RveRig rig(hexagonal_lattice(material, 0.005, 1e-5));
  const Result result = rig.evaluate();

  EXPECT_NEAR(grain_size(result), 0.01, 1e-14);
  EXPECT_NEAR(inertial_number(result, material, 2.0),
              2.0 * 0.01 * std::sqrt(2650.0 / (result.mean_stress() * 0.075)), 1e-12);
}

TEST(Advice, NamesOnlyQuantitiesBeyondTheirLimits)
{
  const RveState state = paper_packing();
  RveRig rig(state);
  const Result result = rig.evaluate();
  const DriveRates gentle{0.01, DT, 1.1e-4, 0.01};
  const auto of = [&](Format format, const Result &r, const DriveRates &motion) {
    return advice(format, r, state.material, motion);
  };

  for (const Format format : ALL_FORMATS) EXPECT_TRUE(of(format, result, gentle).empty());

  Result soft = result;
  soft.mean_overlap = 2e-5;
  EXPECT_TRUE(has(of(Format::Fast, soft, gentle), AdviceKind::SmallOverlap));
  EXPECT_FALSE(has(of(Format::Mixed, soft, gentle), AdviceKind::SmallOverlap));
  // In `single`, the last digit of a position is a fixed fraction of the cell. Compared with an
  // overlap, it is twice as large in a cell with twice as many grains along an edge.
  Result firm = result;
  firm.mean_overlap = 2e-3;
  Result wide = firm;
  wide.cell = 2.0 * firm.cell;
  wide.num_grains = 4 * firm.num_grains;
  EXPECT_FALSE(has(of(Format::Single, firm, gentle), AdviceKind::SmallOverlap));
  EXPECT_TRUE(has(of(Format::Single, wide, gentle), AdviceKind::SmallOverlap));
  DriveRates slow = gentle, fast = gentle, long_step = gentle, far = gentle;
  slow.strain_rate = 1e-6;
  fast.strain_rate = 10.0;
  long_step.dt = 1.08e-4;
  far.applied_strain = 0.2;
  EXPECT_TRUE(has(of(Format::Fast, result, slow), AdviceKind::SlowStrain));
  EXPECT_FALSE(has(of(Format::Double, result, slow), AdviceKind::SlowStrain));
  EXPECT_TRUE(has(of(Format::Mixed, result, fast), AdviceKind::FastStrain));
  EXPECT_TRUE(has(of(Format::Mixed, result, long_step), AdviceKind::LongTimeStep));
  EXPECT_FALSE(has(of(Format::Mixed, result, far), AdviceKind::SmallCell));
  Result pressed = result, gas = result;
  pressed.mean_overlap = 0.06;
  gas.num_contacts = 0;
  gas.status = status::NoContacts;
  EXPECT_TRUE(has(of(Format::Mixed, pressed, gentle), AdviceKind::LargeOverlap));
  EXPECT_TRUE(has(of(Format::Mixed, gas, gentle), AdviceKind::NoContacts));
  Result narrow = result;
  narrow.cell = 0.7 * narrow.cell;
  narrow.num_grains = 196;
  EXPECT_TRUE(has(of(Format::Mixed, narrow, far), AdviceKind::SmallCell));
  for (const Advice &advice : of(Format::Fast, soft, fast)) {
    EXPECT_GT(advice.severity(), 1.0);
    EXPECT_NE(advice.message.find(rounded(advice.limit)), std::string::npos) << advice.message;
    EXPECT_NE(advice.message.find("use "), std::string::npos) << advice.message;
  }
}

TEST(Advice, NamesAFrictionThatLooksLikeAnAngle)
{
  Material material = paper_material();
  EXPECT_TRUE(advice_on_friction(material).empty());
  material.friction = 30.0;
  const std::vector<Advice> list = advice_on_friction(material);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, AdviceKind::LargeFriction);
  EXPECT_NE(list[0].message.find("0.577"), std::string::npos) << list[0].message;
}

TEST(Advice, NamesAServoThatDoesNotConverge)
{
  Drive drive;
  drive.controlled[0][0] = true;
  drive.stress_goal(0, 0) = 1e4;    // grains cannot bear tension
  drive.servo_max_rate = 0.5;
  Result result;
  result.servo_velocity_gradient(0, 0) = 0.5;
  EXPECT_EQ(stress_out_of_reach(result, drive), 1e4);
  EXPECT_TRUE(advice_on_servo(result, drive, 0.0).empty());
  EXPECT_TRUE(advice_on_servo(result, drive, 2e4).empty());
  EXPECT_EQ(advice_on_servo(result, drive, 1e4).size(), 1u);
  result.servo_velocity_gradient(0, 0) = 0.4;
  EXPECT_EQ(stress_out_of_reach(result, drive), 0.0);
}
