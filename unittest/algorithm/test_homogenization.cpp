// SPDX-License-Identifier: GPL-2.0-only
// Compares the results of an RVE with an oracle: a sum over all pairs of grains in double
// precision.

#include "oracle/homogenization.h"
#include "rve/engine/engine.h"
#include "support/packings.h"

#include <gtest/gtest.h>

#include <memory>
#include <ostream>

using namespace rve;
using namespace rve_test;

namespace {

/// A number format and the relative error of its contact forces at the relative overlaps of these
/// tests, 1e-3 to 1e-2. With the sum of radii R and the distance d, `fast` rounds R^2 - d^2 by 6e-8
/// R^2. `mixed` has R^2 - d^2 in fp64 and all else in fp32. `double` sums forces in units of 2^-52
/// of the largest force.
struct FormatCase {
  Format format;
  double error;
};

class Homogenization : public ::testing::TestWithParam<FormatCase> {
 protected:
  std::unique_ptr<Engine> engine() const
  {
    Options options;
    options.format = GetParam().format;
    options.device = Device::Cpu;
    options.threads = 1;
    return make_engine(options);
  }

  /// Shears the state for `steps` steps. Returns the state as the engine stores it, and its result.
  std::pair<RveState, Result> sheared(const RveState &start, double rate, int steps) const
  {
    const auto rves = engine();
    const int rve = rves->add(start);
    std::vector<Result> results;
    Drive drive = Drive::constant_velocity_gradient(Tensor2{{0.0, rate, 0.0, 0.0}}, 5e-5, steps);
    rves->advance({rve}, {drive}, results);
    EXPECT_EQ(results[0].status & status::Fatal, 0u) << describe_status(results[0].status);
    rves->advance({rve}, {Drive()}, results);    // a call without substeps evaluates the state
    return {rves->state(rve), results[0]};
  }

  void expect_equal_to_oracle(const RveState &state, const Result &result) const
  {
    const double error = GetParam().error;
    const OracleResult oracle = homogenize_all_pairs(state, 10.0 * error);
    const double stress = std::fabs(trace(oracle.stress)), count = std::max(1, oracle.num_contacts);
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(result.stress.component[k], oracle.stress.component[k], error * stress)
          << "stress " << k;
      EXPECT_NEAR(result.fabric.component[k], oracle.fabric.component[k], error) << "fabric " << k;
    }
    EXPECT_EQ(result.num_grains, state.num_grains());
    EXPECT_EQ(result.num_contacts, oracle.num_contacts);
    EXPECT_EQ(result.num_rattlers, oracle.num_rattlers);
    EXPECT_DOUBLE_EQ(result.coordination_number, oracle.coordination_number);
    EXPECT_DOUBLE_EQ(result.mechanical_coordination_number, oracle.mechanical_coordination_number);
    // The numbers of sliding contacts agree. In `fast`, rounding decides if a spring at its Coulomb
    // limit counts as sliding.
    EXPECT_NEAR(result.sliding_fraction, oracle.sliding_fraction,
                GetParam().format == Format::Fast ? 2.01 / count : 1e-12);
    EXPECT_NEAR(result.void_ratio, oracle.void_ratio,
                1e-6 * (1.0 + oracle.void_ratio));    // radii of `fast` are fp32
    // The forces on a grain cancel. Their rounding errors do not cancel.
    EXPECT_NEAR(result.unbalanced_ratio, oracle.unbalanced_ratio, 4.0 * error);
    EXPECT_NEAR(result.kinetic_energy, oracle.kinetic_energy,
                1e-12 * oracle.kinetic_energy);    // sums in double
    EXPECT_NEAR(result.elastic_energy, oracle.elastic_energy, 2.0 * error * oracle.elastic_energy);
    EXPECT_NEAR(result.largest_overlap, oracle.largest_overlap, error * oracle.largest_overlap);
    EXPECT_NEAR(result.mean_overlap, oracle.mean_overlap,
                error * oracle.mean_overlap + 1e-12 / count);
    EXPECT_NEAR(result.largest_contact_force, oracle.largest_contact_force,
                error * oracle.largest_contact_force);
  }
};

std::string name_of(const ::testing::TestParamInfo<FormatCase> &info)
{
  return to_string(info.param.format);
}

INSTANTIATE_TEST_SUITE_P(Formats, Homogenization,
                         ::testing::Values(FormatCase{Format::Fast, 3e-5},
                                           FormatCase{Format::Mixed, 1e-6},
                                           FormatCase{Format::Double, 1e-10}),
                         name_of);

}    // namespace

TEST_P(Homogenization, OfAPackingAtRest)
{
  const auto [state, result] = sheared(packing_of_400(), 0.0, 0);

  EXPECT_NEAR(result.mean_stress(), 1e5, 2e3);    // the pressure of the preparation
  EXPECT_EQ(result.kinetic_energy, 0.0);
  expect_equal_to_oracle(state, result);
}

TEST_P(Homogenization, OfAShearedPackingWithSlidingContacts)
{
  const auto [state, result] = sheared(packing_of_400(), 1.0, 1200);

  EXPECT_GT(result.sliding_fraction, 0.05);
  EXPECT_LT(result.sliding_fraction, 0.95);
  EXPECT_GT(result.num_rattlers, 0);
  EXPECT_GT(std::fabs(result.stress(0, 1)), 0.05 * result.mean_stress());
  EXPECT_GT(result.kinetic_energy, 0.0);
  expect_equal_to_oracle(state, result);
}

TEST_P(Homogenization, OfAShakenPackingFarFromEquilibrium)
{
  RveState start = packing_of_400();
  shake(start, 0.5, 3);
  const auto [state, result] = sheared(start, 5.0, 60);

  EXPECT_GT(result.unbalanced_ratio, 0.1);
  expect_equal_to_oracle(state, result);
}

TEST_P(Homogenization, OfAListWithExtraPairs)
{
  RveState start = triangular_packing(packing_of_400().material, 12, 12, 0.004, 5);
  Options options;
  options.format = GetParam().format;
  options.device = Device::Cpu;
  options.skin = 0.0065;    // reaches the second shell of neighbours
  const auto rves = make_engine(options);
  const int rve = rves->add(start);
  std::vector<Result> results;
  rves->advance({rve},
                {Drive::constant_velocity_gradient(Tensor2{{-0.2, 0.5, 0.0, -0.2}}, 2e-5, 200)},
                results);
  rves->advance({rve}, {Drive()}, results);

  EXPECT_GT(results[0].num_pairs, 3 * 144 + 50);
  expect_equal_to_oracle(rves->state(rve), results[0]);
}

TEST_P(Homogenization, OfAGasIsZeroStress)
{
  RveState gas = triangular_packing(packing_of_400().material, 6, 6, 0.004, 5);
  gas.cell = 1.5 * gas.cell;
  const auto [state, result] = sheared(gas, 0.0, 0);

  EXPECT_EQ(result.status, status::NoContacts);
  EXPECT_EQ(result.num_contacts, 0);
  EXPECT_EQ(result.num_rattlers, 36);
  EXPECT_EQ(result.mean_stress(), 0.0);
  expect_equal_to_oracle(state, result);
}

TEST_P(Homogenization, StressIsSymmetricInEquilibriumAndSlopesWithTheElasticEnergy)
{
  // Without friction the packing is hyperelastic: V sigma : dF = dE, with the volume V, the
  // deformation F and the elastic energy E.
  RveState start = packing_of_400();
  start.material.friction = 0.0;
  const double strain = 1e-6;
  const auto energy = [&](const Tensor2 &direction, double sign) {
    RveState state = start;
    state.cell = (Tensor2::identity() + (sign * strain) * direction) * state.cell;
    return sheared(state, 0.0, 0).second.elastic_energy;
  };
  const Result result = sheared(start, 0.0, 0).second;
  const double volume = start.cell_volume() * start.material.thickness;

  for (const Tensor2 &direction :
       {Tensor2{{1, 0, 0, 0}}, Tensor2{{0, 0, 0, 1}}, Tensor2{{0, 1, 0, 0}}}) {
    double expected = 0.0;
    for (int k = 0; k < 4; ++k)
      expected += volume * result.stress.component[k] * direction.component[k];

    const double slope = (energy(direction, 1.0) - energy(direction, -1.0)) / (2.0 * strain);

    // The slope is the difference of two energies, divided by the strain. Its error is the rounding
    // error of the energies, divided by the strain.
    const double error = GetParam().error * result.elastic_energy / strain / 10.0 +
        1e-4 * volume * result.mean_stress();
    EXPECT_NEAR(slope, expected, error);
  }
  EXPECT_NEAR(result.stress(0, 1), result.stress(1, 0),
              1e-6 * result.mean_stress());    // central forces
}
