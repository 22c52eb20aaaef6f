// SPDX-License-Identifier: GPL-2.0-only
// The tangent of an RVE by probing: lattices against closed forms, disordered packings against
// linear algebra and against runs, and a single RVE against the same RVE in a batch, to the bit.

#include "macro/tangent_probes.h"

#include "oracle/lattice_tangents.h"
#include "oracle/network_stiffness.h"
#include "oracle/tangent_algebra.h"
#include "rve/core/error.h"
#include "rve/engine/finite_strain.h"
#include "support/environment.h"
#include "support/packings.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

using namespace macro;
using namespace rve_test;
using rve::Tensor2;
using rve::Tensor3;

namespace {

constexpr double RADIUS = LATTICE_RADIUS, OVERLAP = LATTICE_OVERLAP;

template <int D> using State = rve::RveStateOf<D>;
template <int D> using Matrix = rve::Tensor<double, D>;

template <int D> rve::Options options_for(const State<D> &state, rve::Format format, int threads)
{
  rve::Options options = cpu_options(format, threads);
  options.contacts = rve::contacts_of(state);
  return options;
}

TangentOptions elastic(rve::Format format = rve::Format::Double)
{
  return TangentOptions::of(format, TangentKind::Elastic);
}

TangentOptions loading()
{
  return TangentOptions::of(rve::Format::Double, TangentKind::Loading);
}

template <int D>
std::vector<ProbedTangentOf<D>> probe(const std::vector<State<D>> &states,
                                      const TangentOptions &options,
                                      rve::Format format = rve::Format::Double, int threads = 1,
                                      const Matrix<D> &rate = Matrix<D>::zero())
{
  TangentProbesOf<D> probes(rve::make_engine<D>(options_for(states[0], format, threads)), options);
  return probes.probe(
      static_cast<int>(states.size()), [&](int k) { return states[k]; }, [&](int) { return rate; });
}

template <int D> ProbedTangentOf<D> probe(const State<D> &state, const TangentOptions &options)
{
  return probe(std::vector<State<D>>{state}, options)[0];
}

template <int D> double relative_error(const TangentOf<D> &found, const TangentOf<D> &expected)
{
  return (found + (-1.0) * expected).norm() / expected.norm();
}

/// Returns a disordered packing at rest after a shear with sliding contacts.
rve::RveState sheared_packing()
{
  rve::Material material = paper_material();
  material.tangential_stiffness = 0.7 * material.normal_stiffness;
  material.local_damping = 0.7;
  RveRig rig(triangular_packing(material, 14, 14, RADIUS, 3));
  rig.strain(Tensor2::zero(), 5e-6, 2000);
  rig.strain(Tensor2{{0.6, 0.0, 0.0, -0.8}}, 5e-6, 4000);
  return rig.state();
}

rve::RveState at_rest(const rve::RveState &state)
{
  RveRig rig(state);
  const rve::Result &result = rig.strain(Tensor2::zero(), 5e-6, 40000);
  EXPECT_LT(result.unbalanced_ratio, 1e-11);
  return rig.state();
}

template <int D> TangentOf<D> affine_tangent(const rve::AffineStiffnessOf<D> &stiffness)
{
  TangentOf<D> tangent;
  for (int c = 0; c < D; ++c)
    for (int d = c; d < D; ++d) {
      auto strain = Matrix<D>::zero();
      strain(c, d) += 0.5;
      strain(d, c) += 0.5;
      const Matrix<D> stress = stiffness(strain);
      for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b)
          tangent.component[TangentOf<D>::index(a, b)][TangentOf<D>::index(c, d)] =
              0.5 * (stress(a, b) + stress(b, a));
    }
  return tangent;
}

template <int D> void expect_bound(const TangentOf<D> &bound, const TangentOf<D> &tangent)
{
  EXPECT_GT((bound + (-1.0) * tangent).least_second_order_work(), 0.0);
  EXPECT_GT(bound.isotropic_part().shear, 1.05 * tangent.isotropic_part().shear);
  EXPECT_GT(tangent.least_second_order_work(), 0.0);
}

const Tensor2 LOADING{{0.6, 0.0, 0.0, -0.8}};

template <int D> bool same_bits(const ProbedTangentOf<D> &a, const ProbedTangentOf<D> &b)
{
  return std::memcmp(&a.tangent, &b.tangent, sizeof(a.tangent)) == 0 &&
      std::memcmp(&a.response, &b.response, sizeof(a.response)) == 0 && a.steps == b.steps &&
      a.status == b.status && a.nonlinearity == b.nonlinearity;
}

double along(const Tensor2 &stress, const Tensor2 &strain)
{
  double sum = 0.0;
  for (int k = 0; k < 4; ++k) sum += stress.component[k] * strain.component[k];
  return sum;
}

}    // namespace

TEST(TangentProbes, LatticesHaveTheirClosedForms)
{
  // The tolerance of 1e-8 covers two errors. The rounding error of stresses, divided by their
  // change in a probe, is 1e-16/(1e-4 overlap/distance) = 5e-10. For Hertz contacts the square of
  // the probe is 1e-8/40.
  for (const rve::Material &material : {linear_springs(), hertz_mindlin()}) {
    SCOPED_TRACE(rve::word_of(material.law));
    const Springs springs = springs_of(material);
    const double h = material.thickness;
    EXPECT_LT(
        relative_error(probe(square_lattice(material), elastic()).tangent, of_squares(springs, h)),
        1e-8);
    EXPECT_LT(relative_error(probe(hexagonal_lattice(material, RADIUS, OVERLAP), elastic()).tangent,
                             of_hexagons(springs, h)),
              1e-8);
    EXPECT_LT(relative_error(probe(simple_cubic(of_spheres(material)), elastic()).tangent,
                             of_cubes(springs)),
              1e-8);
    EXPECT_LT(
        relative_error(
            probe(face_centred_cubic(of_spheres(material), 2, RADIUS, OVERLAP), elastic()).tangent,
            of_face_centred_cubes(springs)),
        1e-8);
  }
}

TEST(TangentProbes, FrictionlessGrainsHaveNoSpringsAlongContacts)
{
  rve::Material material = linear_springs();
  material.friction = 0.0;
  const Springs springs{material.normal_stiffness * OVERLAP, material.normal_stiffness, 0.0};
  EXPECT_LT(relative_error(probe(hexagonal_lattice(material, RADIUS, OVERLAP), elastic()).tangent,
                           of_hexagons(springs, material.thickness)),
            1e-8);
}

TEST(TangentProbes, ErrorIsTheSquareOfLargeProbesAndTheInverseOfSmallOnes)
{
  const rve::Material material = hertz_mindlin();
  const rve::RveState lattice = hexagonal_lattice(material, RADIUS, OVERLAP);
  const TangentOf<2> expected = of_hexagons(springs_of(material), material.thickness);
  const auto error = [&](double size) {
    TangentOptions options = elastic();
    options.probe = size;
    return relative_error(probe(lattice, options).tangent, expected);
  };
  const double large = error(1e-1), smaller = error(1e-2);
  EXPECT_NEAR(large / smaller, 100.0, 5.0);
  EXPECT_LT(error(1e-8), 1e-4);
  EXPECT_GT(error(1e-8), 1e2 * error(1e-4));
}

TEST(TangentProbes, EveryNumberFormatHasASuitableProbe)
{
  // The tolerances are a rounding error divided by the size of the probe (doc: compute
  // rve/tangent). In mixed, forces are rounded by 6e-8. In fast, gaps between grains are rounded,
  // relative to overlaps.
  const rve::Material material = linear_springs();
  const rve::RveState lattice = hexagonal_lattice(material, RADIUS, OVERLAP);
  const TangentOf<2> expected = of_hexagons(springs_of(material), material.thickness);
  const auto error = [&](rve::Format format) {
    return relative_error(probe<2>({lattice}, elastic(format), format)[0].tangent, expected);
  };
  EXPECT_LT(error(rve::Format::Double), 1e-8);
  EXPECT_LT(error(rve::Format::Mixed), 2e-4);
  EXPECT_LT(error(rve::Format::Fast), 1e-2);
}

TEST(TangentProbes, PackingsHaveTheTangentOfTheirLinearEquations)
{
  // With less friction than before, contacts slide, and some come to rest at the friction limit.
  // They must nevertheless stick in an elastic probe.
  for (const double friction : {0.5, 0.05}) {
    SCOPED_TRACE(friction);
    rve::RveState state = sheared_packing();
    state.material.friction = friction;
    state = at_rest(state);
    const auto contacts = rve::find_spring_contacts(state);
    const auto at_limit =
        std::count_if(contacts.begin(), contacts.end(), [](const rve::SpringContact &contact) {
          return contact.mobilized_friction > 1.0 - 1e-5;
        });
    EXPECT_EQ(at_limit > 0, friction < 0.5) << at_limit;

    const ProbedTangentOf<2> probed = probe(state, elastic());

    const TangentOf<2> expected = network_stiffness(state);
    EXPECT_LE(probed.unrest, 1e-5);
    EXPECT_EQ(probed.changed_contacts, 0);
    EXPECT_LT(probed.nonlinearity, 1e-4);
    // The error comes from the unbalanced forces at rest and from rounding.
    EXPECT_LT(relative_error(probed.tangent, expected), 1e-8);
    EXPECT_GT(expected.isotropic_part().anisotropy, 0.02);
  }
}

TEST(TangentProbes, AreBelowTheAffineStiffness)
{
  // Grains that can deviate from the mean field store less energy. The affine stiffness minus the
  // tangent is therefore positive semidefinite.
  RveRig disks(at_rest(sheared_packing()));
  std::vector<rve::ElasticResult> answer;
  disks.owner().advance({disks.rve_number()}, {rve::Drive{1e-6}}, answer);
  expect_bound(affine_tangent(answer[0].stiffness), probe(disks.state(), elastic()).tangent);

  SphereRig rig(rve::read_packing<3>(std::string(RVE_PACKINGS_DIR) + "/S500.rve"));
  const ProbedTangentOf<3> probed = probe(rig.state(), elastic());
  expect_bound(affine_tangent(rig.stiffness().stiffness), probed.tangent);
  EXPECT_LT(probed.tangent.isotropic_part().anisotropy, 0.1);
}

TEST(TangentProbes, StepsContinueUntilRest)
{
  const rve::RveState state = packing_of_400();
  const TangentOf<2> expected = probe(state, elastic()).tangent;
  TangentOptions hasty = elastic();
  hasty.look_steps = 10;
  const auto patient = probe(state, hasty);
  hasty.tolerance = 0.1;
  const auto restless = probe(state, hasty);
  EXPECT_LT(relative_error(patient.tangent, expected), 1e-4);
  EXPECT_GT(relative_error(restless.tangent, expected), 1e-4);
  EXPECT_LT(restless.steps, patient.steps);
}

TEST(TangentProbes, ElasticTangentIsThatOfASmallStrainInARun)
{
  rve::RveState state = packing_of_400();
  state.material.local_damping = 0.7;
  const TangentOf<2> tangent = probe(state, elastic()).tangent;
  // The strain is a ten-thousandth of the overlap, so that no contact slides. Then the packing
  // comes to rest.
  const Tensor2 strain{{-3e-7, 2e-7, 2e-7, 5e-7}};
  RveRig rig(state);
  const Tensor2 before = rig.strain(Tensor2::zero(), 5e-6, 20000).stress;
  rig.strain((1.0 / (5e-6 * 500)) * strain, 5e-6, 500);
  const Tensor2 change = rig.strain(Tensor2::zero(), 5e-6, 20000).stress - before;
  const Tensor2 expected = tangent(strain);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(change.component[k], expected.component[k], 1e-4 * rve::norm(expected));
}

TEST(TangentProbes, ElasticTangentOfSpheresIsThatOfASmallStrainInARun)
{
  State<3> state = rve::read_packing<3>(std::string(RVE_PACKINGS_DIR) + "/S500.rve");
  state.material.local_damping = 0.7;
  constexpr double DT = 3e-6;
  constexpr int AWHILE = 6000;    // a wave crosses the cell about seventy times
  SphereRig rig(state);
  const rve::ResultOf<3> rest = rig.strain(Tensor3::zero(), DT, AWHILE);
  const TangentOf<3> tangent = probe(rig.state(), elastic()).tangent;
  // a ten-thousandth of the overlap, at which no contact slides
  const double size = 1e-4 * rest.mean_overlap;
  ASSERT_GT(rest.coordination_number, 4.0);
  ASSERT_GT(size, 1e-9);
  const Tensor3 strain = size * Tensor3{{-0.3, 0.2, -0.4, 0.2, 0.5, 0.1, -0.4, 0.1, 0.4}};
  rig.strain((1.0 / (DT * 500)) * strain, DT, 500);
  const Tensor3 change = rig.strain(Tensor3::zero(), DT, AWHILE).stress - rest.stress;
  const Tensor3 expected = tangent(strain);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(change.component[k], expected.component[k], 1e-4 * rve::norm(expected));
}

TEST(TangentProbes, LoadingTangentNeedsALead)
{
  // At rest, contacts have left the friction limit; the lead strains the packing until they slide
  // again. The disks in the manual (compute rve/tangent) have a nonlinearity of 16 % without a lead
  // and of 0.9 % with a lead of 0.1, which is 18 times less. This test has other disks. It requires
  // only a factor of four, about the square root of 18.
  const rve::RveState state = sheared_packing();
  const auto nonlinearity = [&](double lead) {
    TangentOptions options = loading();
    options.lead = lead;
    return probe<2>({state}, options, rve::Format::Double, 1, 2.5 * LOADING)[0].nonlinearity;
  };
  EXPECT_GT(nonlinearity(0.0), 4.0 * nonlinearity(0.1));
}

TEST(TangentProbes, LoadingTangentIsThatOfTheContinuedRunAndSofterThanTheElasticOne)
{
  const rve::RveState state = sheared_packing();
  const auto plastic = probe<2>({state}, loading(), rve::Format::Double, 1, 2.5 * LOADING)[0];
  const auto stiff = probe(state, elastic());
  ASSERT_TRUE(plastic.is_measured);

  // C : D is homogeneous of degree one, so it is the response along D itself (Euler)
  EXPECT_LT(plastic.nonlinearity, 0.05);
  EXPECT_LT(along(plastic.response, LOADING), 0.8 * along(stiff.tangent(LOADING), LOADING));

  // The run continues at a tenth of the rate.
  RveRig rig(state);
  const double overlap = rig.evaluate().mean_overlap;
  const auto strained = [&](double share) {
    const double size = share * overlap;
    return rig.strain((size / (5e-6 * 10000)) * LOADING, 5e-6, 10000).stress;
  };
  strained(0.05);
  const Tensor2 first = strained(0.05), second = strained(0.05);
  const Tensor2 rate = (1.0 / (0.05 * overlap)) * (second - first);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(plastic.response.component[k], rate.component[k], 0.1 * rve::norm(rate));
}

TEST(TangentProbes, LoadingTangentWithoutSlidingIsTheElasticOne)
{
  rve::RveState state = packing_of_400();
  state.material.friction = 1e6;
  TangentOptions options = loading();
  options.lead = 0.0;
  options.probe = 1e-4;
  const auto plastic = probe<2>({state}, options, rve::Format::Double, 1, LOADING)[0];
  const auto stiff = probe(state, elastic());
  // The tolerance covers the rounding error divided by the spread of the probes, and the
  // square of the probe.
  EXPECT_LT(relative_error(plastic.tangent, stiff.tangent), 1e-5);
  EXPECT_LT(plastic.nonlinearity, 1e-5);

  rve::Material material = of_spheres(hertz_mindlin());
  material.friction = 1e6;
  const auto cubic =
      probe<3>({face_centred_cubic(material, 2, RADIUS, OVERLAP)}, options, rve::Format::Double, 1,
               Tensor3{{0.3, 0.1, 0.0, 0.1, 0.2, -0.3, 0.0, -0.3, -0.7}})[0];
  EXPECT_LT(relative_error(cubic.tangent, of_face_centred_cubes(springs_of(material))), 1e-4);
}

TEST(TangentProbes, RotateWithTheRve)
{
  const auto turned_packing = [](const rve::RveState &state, const Tensor2 &rotation) {
    RveRig rig(state);
    rig.owner().turn({rig.rve_number()}, {rotation});
    return rig.state();
  };
  const Tensor2 rotation = rve::plane_rotation(0.7);
  const rve::RveState disks = at_rest(sheared_packing());
  const TangentOf<2> before = probe(disks, elastic()).tangent;
  EXPECT_LT(relative_error(probe(turned_packing(disks, rotation), elastic()).tangent,
                           turned(before, rotation)),
            1e-7);

  const Tensor3 in_space = rve::spatial_rotation({{0.4, -0.2, 0.9}});
  const auto engine = rve::make_engine<3>(sphere_options());
  const int cubes =
      engine->add(face_centred_cubic(of_spheres(linear_springs()), 2, RADIUS, OVERLAP));
  const TangentOf<3> cubic = probe(engine->state(cubes), elastic()).tangent;
  engine->turn({cubes}, {in_space});
  EXPECT_LT(relative_error(probe(engine->state(cubes), elastic()).tangent, turned(cubic, in_space)),
            1e-8);
}

TEST(TangentProbes, UnmeasurableTangentIsReportedAndChangesNoOther)
{
  const rve::RveState lattice = hexagonal_lattice(paper_material(), RADIUS, OVERLAP);
  rve::RveState crushed = lattice;
  for (double &r : crushed.radius) r *= 1.7;    // overlaps beyond the limit of the engine
  const auto batch = probe<2>({crushed, lattice}, elastic());
  EXPECT_FALSE(batch[0].is_measured);
  EXPECT_NE(batch[0].status & rve::status::Fatal, 0u);
  EXPECT_EQ(batch[0].tangent.norm(), 0.0);
  EXPECT_TRUE(same_bits(batch[1], probe(lattice, elastic())));

  EXPECT_FALSE(probe(lattice, loading()).is_measured);    // not measured along any direction
  const auto gas = probe(paper_gas(), elastic());
  EXPECT_TRUE(gas.is_measured);
  EXPECT_EQ(gas.tangent.norm(), 0.0);
}

TEST(TangentProbes, PortionsThatFitIntoMemoryGiveTheSameBits)
{
  const rve::RveState lattice = hexagonal_lattice(paper_material(), RADIUS, OVERLAP);
  rve::RveState other = lattice;
  other.material.tangential_stiffness *= 0.5;
  const std::vector<rve::RveState> states = {lattice, other, lattice};
  const auto at_once = probe<2>(states, elastic());
  const Environment limit("GPU_RVE_MEMORY_LIMIT", "1");    // not enough for two RVEs
  const auto one_by_one = probe<2>(states, elastic());
  ASSERT_EQ(one_by_one.size(), 3u);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(same_bits(one_by_one[k], at_once[k])) << k;
}

TEST(TangentProbes, WrongOptionsAreNamedWithTheirRange)
{
  const auto message = [](const TangentOptions &options) {
    try {
      options.check("tangent");
    } catch (const rve::InputError &e) {
      return std::string(e.what());
    }
    return std::string();
  };
  TangentOptions options = elastic();
  EXPECT_EQ(message(options), "");
  options.probe = 0.7;
  EXPECT_EQ(message(options),
            "tangent: probe is 0.7; it must be above 0 and at most 0.5 [-], of the mean overlap");
  options = elastic();
  options.damping = 1.0;
  EXPECT_EQ(message(options), "tangent: damping is 1; it must be at least 0 and below 1 [-]");
}
